#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/method/parameters.hpp"
#include "core/model/budget.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// The filter of Waechter and Biegler 2006, section 2.3: pairs (theta, phi) that later points must
/// improve on in one of the two. Constants are the paper's, names too.
class Filter {
 public:
  enum class Verdict : unsigned char {
    Reject,     ///< no sufficient progress from the point left
    Dominated,  ///< progress from the point left, but a pair of the filter is better
    Armijo,     ///< a step on phi: sufficient decrease of phi, the filter stays as it is
    Sufficient  ///< theta or phi decreased enough; the point left is added to the filter
  };

  [[nodiscard]] static bool accepted(Verdict verdict) { return verdict >= Verdict::Armijo; }

  /// Forgets all pairs. The first violation of a solve fixes theta_min and theta_max.
  void reset() { entries_.clear(); }
  void set_scale(double first_theta);
  /// From now on, as in Ipopt, no step is accepted that raises phi by orders of magnitude, however
  /// theta falls, and a step that phi falls by enters no pair above theta_min either.
  void minimize() { minimizes_ = true; }
  /// As a new filter, with room for that many pairs; its scale is to be set.
  void begin_anew(std::size_t pairs) {
    reset();
    entries_.reserve(pairs);
    minimizes_ = false;
  }

  /// Whether a step of length alpha from one point to another is acceptable; slope is the
  /// directional derivative of phi.
  [[nodiscard]] Verdict test(const Merit& from, double slope, double alpha, const Merit& to) const;

  /// The largest phi that test would accept of a point with this theta.
  [[nodiscard]] double largest_acceptable(const Merit& from, double slope, double alpha,
                                          double theta) const;

  /// Records the point that was left by an accepted step.
  void add(const Merit& from);

  /// Not dominated by a pair of the filter and not above theta_max.
  [[nodiscard]] bool acceptable(const Merit& merit) const;

  /// Step length below which the search gives up (eq. (23)).
  [[nodiscard]] double smallest_step(const Merit& from, double slope) const;

 private:
  struct Entry {
    double theta, phi;
  };
  /// Whether phi falls so fast along the step that theta need not.
  [[nodiscard]] static bool switches(const Merit& from, double slope, double alpha);
  /// Whether the step is one on phi alone.
  [[nodiscard]] bool is_armijo(const Merit& from, double slope, double alpha) const;
  /// By which phi may rise.
  [[nodiscard]] double most_increase(const Merit& from) const;
  /// The change of phi that such a step to a point with this theta has to make, eq. (18) or (20);
  /// none: theta falls enough.
  [[nodiscard]] static std::optional<double> demanded(bool armijo, const Merit& from, double slope,
                                                      double alpha, double theta);

  std::vector<Entry> entries_;
  double theta_min_ = parameters::filter::kThetaMin;
  double theta_max_ = parameters::filter::kThetaMax;
  bool minimizes_ = false;
};

/// A trial point's merit, where it has one.
struct Trial {
  bool usable = false;
  Merit merit{};
};

/// What a filter search goes along.
struct SearchLine {
  Merit from{};
  double slope = 0.0;        ///< of phi along the step
  StepLength longest{};      ///< first length tried
  double smallest = 0.0;     ///< last one
  int trials = 0;            ///< at most
  bool first_fails = false;  ///< the first length is known to be rejected
};

/// How a filter search ended.
struct SearchEnd {
  bool accepted = false;  ///< the block's trial point
  StepLength alpha{};
  bool corrected = false;  ///< by a second-order correction
  int cuts = 0;
};

/// Second-order correction against the Maratos effect, [WB, 2.4]: same matrix, c_soc = alpha c +
/// c(trial). first: theta of the trial point rejected, alpha long. test: the filter's verdict on a
/// trial's merit.
template <class Block, class Test>
Filter::Verdict correct_to_second_order(Block& block, const Test& test, double slope, double alpha,
                                        double first, SearchEnd& end) {
  Eigen::VectorXd& c = block.corrected_c();
  c = alpha * block.from().evaluation.c + block.trial().evaluation.c;
  double last_theta = first;
  constexpr int kMostCorrections = 4;  // p_max of [WB, 2.4]
  for (int k = 0; k < kMostCorrections; ++k) {
    const std::optional<StepLength> corrected = block.correct(c);
    if (!corrected) break;
    const Trial trial = block.evaluate_corrected(slope, alpha);
    if (!trial.usable) break;
    const auto verdict = test(trial.merit);
    if (Filter::accepted(verdict)) {
      end.alpha = *corrected;
      end.corrected = true;
      return verdict;
    }
    if (trial.merit.theta > parameters::outer::kSecondOrderDecrease * last_theta) break;
    last_theta = trial.merit.theta;
    c = corrected->primal * c + block.trial().evaluation.c;
  }
  return Filter::Verdict::Reject;
}

/// Backtracking with a filter, [WB, 2.3], for one player's block: y alone with K_yy, or x through
/// K. A block has
///   from(), trial()               the point left, and the one tried
///   evaluate(slope, alpha)        moves trial() along the step: its merit
///   correct(c)                    moves trial() along a corrected step: its lengths
///   evaluate_corrected(slope, a)  the merit there
///   passed(dominated)             told of a trial point accepted, and whether the filter alone
///                                 rejected the one before
///   complete()                    derivatives at the trial point; false: undefined
template <class Block>
SearchEnd filter_search(Block& block, Filter& filter, const SearchLine& line, SolveLimit& limit) {
  SearchEnd end;
  bool dominated = false;  // the last trial: by the filter alone
  StepLength alpha = line.longest;
  for (; end.cuts < line.trials && alpha.primal >= line.smallest && !limit.expired();
       ++end.cuts, alpha.primal *= 0.5) {
    if (end.cuts == 0 && line.first_fails) continue;
    end.alpha = alpha;
    end.corrected = false;
    const auto test = [&](const Merit& to) {
      const auto verdict = filter.test(line.from, line.slope, alpha.primal, to);
      if (Filter::accepted(verdict)) block.passed(dominated);
      dominated = verdict == Filter::Verdict::Dominated;
      return verdict;
    };
    const Trial trial = block.evaluate(line.slope, alpha);
    auto verdict = Filter::Verdict::Reject;
    if (trial.usable) {
      verdict = test(trial.merit);
      const double before = line.from.theta, after = trial.merit.theta;
      if (!Filter::accepted(verdict) && end.cuts == 0 && after >= before && before + after > 0.0) {
        verdict =
            correct_to_second_order(block, test, line.slope, alpha.primal, trial.merit.theta, end);
      }
    }
    if (!Filter::accepted(verdict) || !block.complete()) continue;
    if (verdict == Filter::Verdict::Sufficient) filter.add(line.from);
    end.accepted = true;
    return end;
  }
  return end;
}

}  // namespace ipminmax
