#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/model/forwarding_problem.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/search/other_answers.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The maximizer's problem at fixed x: Min variables are fixed, Min constraints absent.
class HeldMin final : public ForwardingProblem {
 public:
  HeldMin(Problem& model, std::span<const double> v)
      : ForwardingProblem(model), structure_(model.structure()), v_(v.begin(), v.end()) {
    for (std::size_t i = 0; i < v_.size(); ++i) {
      if (structure_.variable_players[i] != Player::Min) continue;
      structure_.variable_lower[i] = structure_.variable_upper[i] = v_[i];
    }
    for (std::size_t j = 0; j < structure_.constraint_players.size(); ++j) {
      if (structure_.constraint_players[j] != Player::Min) continue;
      structure_.constraint_lower[j] = -kInfinity;
      structure_.constraint_upper[j] = kInfinity;
    }
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    return !start.needs_multipliers;
  }

 private:
  ProblemStructure structure_;
  std::vector<double> v_;
};

void check_point(const ProblemStructure& structure, std::span<const double> v) {
  if (v.size() != structure.variable_players.size()) {
    throw std::invalid_argument("the point of a worst-case check has " + std::to_string(v.size()) +
                                " values for " + std::to_string(structure.variable_players.size()) +
                                " variables");
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (std::isfinite(v[i])) continue;
    throw std::invalid_argument("variable " + std::to_string(i) +
                                " of a worst-case check's point is not finite");
  }
}

/// Collects what the maximizations find.
class Maxima {
 public:
  Maxima(const SolverOptions& options, WorstCaseCheck& check) : options_(options), check_(check) {}

  /// Values that f takes on the way tell which differences count.
  void see(const IterationInfo& info) {
    if (!std::isfinite(info.objective)) return;
    least_ = std::min(least_, info.objective);
    most_ = std::max(most_, info.objective);
    one_branch_ = one_branch_ && info.delta_y == 0.0;
  }

  void add(const Result& result) {
    ++check_.found.starts;
    using enum Status;
    const bool runs_away = result.status == InnerUnbounded || result.status == OuterUnbounded ||
                           result.status == DivergingIterates;
    if (runs_away) {
      // Far away and infeasible, nothing is seen of f.
      double size = 1.0;
      for (const double value : result.v) size = std::max(size, std::abs(value));
      if (result.error.primal <= options_.constr_viol_tol * size) check_.found.unbounded = true;
      one_branch_ = false;
      return;
    }
    if (result.v.empty() || !std::isfinite(result.objective) ||
        !(result.error.primal <= options_.constr_viol_tol)) {
      one_branch_ = false;
      return;
    }
    const bool maximum = is_success(result.status);
    one_branch_ = one_branch_ && maximum;
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    for (WorstCaseMaximum& known : check_.maxima) {
      if (!same_point(result.v, known.v, options_.minmax_distinct_tol)) continue;
      ++known.found;
      known.certified = known.certified || certified;
      if (result.objective > known.value) {
        known.value = result.objective;
        known.v = result.v;
      }
      return;
    }
    // A feasible point bounds the maximum from below, whatever ended the search there.
    check_.maxima.push_back({result.v, result.objective, certified, 1});
  }

  void finish(double here, const ProblemStructure& structure) {
    constexpr std::size_t kMostBranches = 10;
    WorstCase& found = check_.found;
    std::ranges::stable_sort(check_.maxima, std::greater{}, &WorstCaseMaximum::value);
    found.maxima =
        static_cast<Index>(std::ranges::count_if(check_.maxima, &WorstCaseMaximum::certified));
    found.single_branch = one_branch_ && found.maxima == 1 && check_.maxima.size() == 1;
    if (check_.maxima.empty()) return;
    found.value = check_.maxima.front().value;
    found.v = check_.maxima.front().v;
    for (std::size_t i = 0; i < found.v.size(); ++i) {
      if (structure.variable_players[i] == Player::Max) found.y.push_back(found.v[i]);
    }
    for (std::size_t k = 0; k < std::min(kMostBranches, check_.maxima.size()); ++k) {
      found.branches.push_back(check_.maxima[k].value);
    }
    // Of values at maxima; on the way, far from Y, f may be larger by far.
    const double last = check_.maxima.back().value;
    const double clear = clear_difference(std::isfinite(here) ? std::min(last, here) : last,
                                          found.value, std::max(most_ - least_, 0.0), options_.tol);
    found.higher = found.value - here > clear;
    for (const WorstCaseMaximum& maximum : check_.maxima) {
      if (found.value - maximum.value <= clear) ++found.competing;
    }
  }

 private:
  const SolverOptions& options_;
  WorstCaseCheck& check_;
  double least_ = kInfinity, most_ = -kInfinity;
  bool one_branch_ = true;
};

}  // namespace

WorstCaseCheck check_worst_case(Problem& problem, std::span<const double> v,
                                const SolverOptions& options, Index starts,
                                const std::vector<std::vector<double>>& given,
                                const MultistartObserver& observer) {
  check_point(problem.structure(), v);
  WorstCaseCheck check;
  if (!has_max_variables(problem.structure())) return check;
  double here = -kInfinity;
  if (!problem.objective(v, true, here) || std::isnan(here)) here = -kInfinity;

  HeldMin inner(problem, v);
  SolverOptions inner_options = options;
  inner_options.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  inner_options.warm_start_init_point = false;
  inner_options.minmax_worst_case_starts = 0;
  inner_options.minmax_epigraph = inner_options.minmax_epigraph_at_kinks = false;
  inner_options.minmax_starts = options.minmax_concave_in_y ? 1 : std::max(1, starts);
  check.found.stated_concave = options.minmax_concave_in_y;
  Maxima maxima(options, check);
  MultistartObserver inner_observer = observer;
  inner_observer.on_iteration = [&](Index start, const IterationInfo& info) {
    maxima.see(info);
    return !observer.on_iteration || observer.on_iteration(start, info);
  };
  inner_observer.on_result = [&](Index start, const Result& result) {
    maxima.add(result);
    if (observer.on_result) observer.on_result(start, result);
  };
  const std::vector<std::vector<double>> none;
  check.interrupted =
      multistart(inner, inner_options, inner_observer, options.minmax_concave_in_y ? none : given)
          .interrupted;
  maxima.finish(here, problem.structure());
  return check;
}

void add_worst_case(Problem& problem, const SolverOptions& options, Result& result,
                    const MultistartObserver& observer) {
  // A negative factor of the objective makes the inner player minimize: no maxima to look for.
  if (options.minmax_worst_case_starts == 0 || result.v.empty() || result.objective_scale < 0.0 ||
      !all_finite(result.v)) {
    return;
  }
  result.worst_case =
      check_worst_case(problem, result.v, options, options.minmax_worst_case_starts, {}, observer)
          .found;
}

namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.8g", value);
  return text;
}

constexpr const char* kOverBranches =
    "; minmax_epigraph yes, with minmax_worst_case_starts, minimizes over the branches of y";

/// "(a, b, c, ...)"
std::string list(const std::vector<double>& values, std::size_t most) {
  std::string text = "(";
  for (std::size_t i = 0; i < std::min(most, values.size()); ++i) {
    text += (i > 0 ? ", " : "") + number(values[i]);
  }
  return text + (values.size() > most ? ", ...)" : ")");
}

}  // namespace

std::string describe_worst_case(const Result& result) {
  constexpr std::size_t kMostEntries = 6;
  const WorstCase& found = result.worst_case;
  if (found.starts == 0 && !found.higher) return {};
  if (found.starts == 0) {
    return "value " + number(result.objective) +
           " is a local worst case only: the y of another start, y = " +
           list(found.y, kMostEntries) + ", gives " + number(found.value) +
           " at this x; minmax_worst_case_starts N maximizes over y" + kOverBranches;
  }
  const std::string searched = " in " + std::to_string(found.starts) + " maximization" +
                               (found.starts == 1 ? "" : "s") + " over y";
  std::string text;
  if (found.unbounded) {
    text = "at this x the maximization over y is unbounded, seen" + searched;
  } else if (found.higher) {
    text = "value " + number(result.objective) +
           " is a local worst case only: another y, y = " + list(found.y, kMostEntries) +
           ", gives " + number(found.value) + " at this x (largest" + searched + ")";
  } else if (found.stated_concave) {
    text = found.v.empty() ? "no maximum over y was found at this x"
                           : "f is concave in y, so the model says: no other y can be worse";
  } else if (found.single_branch) {
    text = "one maximum over y at this x" + searched +
           ", with K_yy of the right inertia at every iterate: f looks concave in y here";
  } else if (found.v.empty()) {
    text = "no maximum over y was found at this x" + searched;
  } else {
    text = "no higher maximum over y was found at this x" + searched + " (" +
           std::to_string(found.maxima) + " distinct)";
  }
  if (found.unbounded) return text;
  if (found.branches.size() > 1) {
    text += "; values at the maxima: " + list(found.branches, kMostEntries);
  }
  if (found.competing > 1) {
    text += "; " + std::to_string(found.competing) +
            " of them share the largest: the worst case may have a kink at this x, where "
            "minmax_epigraph yes goes on";
  } else if (found.higher) {
    text += kOverBranches;
  }
  return text;
}

}  // namespace ipminmax
