#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/method/filter.hpp"
#include "core/method/parameters.hpp"
#include "core/model/budget.hpp"
#include "core/point/point.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

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
