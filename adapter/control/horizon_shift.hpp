#pragma once

#include <IpOptionsList.hpp>
#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "../../core/options.hpp"
#include "../../core/result.hpp"

/// Warm start in model predictive control. The solve of the next time step starts at the solution
/// of this one, moved one stage ahead.
///
///   HorizonShift shift(T, {{0, 8}}, {{0, 7}});          // 8 variables, 7 constraints per stage
///   app->OptimizeTNLP(model);                           // first time step, from a guess
///   warm_start(*app->Options(), 1e-6);
///   for (each time step) {
///     PrimalDual start = shift.next(app->LastResult()); // the model's get_starting_point gives it
///     ...                                               // the model's new state
///     app->ReOptimizeTNLP(model);                       // no ordering, no symbolic factorization
///   }

namespace ipminmax {

/// A starting point with multipliers, in the order and with the signs of Result.
struct PrimalDual {
  std::vector<double> v;                 ///< n
  std::vector<double> lambda;            ///< m
  std::vector<double> z_lower, z_upper;  ///< n
};

/// Entries begin, ..., begin + T size - 1 of a vector: those of stage 0, of stage 1, ..., size
/// each.
struct StageBlock {
  std::size_t begin = 0;
  std::size_t size = 0;
};

/// Moves primal-dual points one stage ahead. Entries in no block (parameters, a terminal set) stay.
class HorizonShift {
 public:
  /// stages: T. The blocks of the variables and of the constraints.
  HorizonShift(std::size_t stages, std::vector<StageBlock> variables,
               std::vector<StageBlock> constraints)
      : stages_(stages), variables_(std::move(variables)), constraints_(std::move(constraints)) {}

  /// Returns the point in which stage k has the values and multipliers that stage k + 1 had; the
  /// last stage keeps its own. Throws std::invalid_argument if a block ends outside the vectors.
  [[nodiscard]] PrimalDual next(const Result& last) const {
    PrimalDual point{last.v, last.lambda, last.z_lower, last.z_upper};
    for (auto* values : {&point.v, &point.z_lower, &point.z_upper}) shift(variables_, *values);
    shift(constraints_, point.lambda);
    return point;
  }

  /// Returns the worst cases of robust constraints for RepeatedSolver::start_at. Each becomes one
  /// of the same constraint one stage earlier; those of stage 0 are dropped. The last stage also
  /// keeps its own.
  [[nodiscard]] std::vector<RobustWorstCase> worst_cases(const Result& last) const {
    std::vector<RobustWorstCase> moved;
    for (const RobustWorstCase& found : last.worst_cases) {
      RobustWorstCase next = found;
      shift(variables_, next.v);
      const auto row = static_cast<std::size_t>(found.constraint);
      for (const StageBlock& block : constraints_) {
        if (row < block.begin || block.size == 0) continue;
        const std::size_t stage = (row - block.begin) / block.size;
        if (stage >= stages_) continue;
        next.constraint -= static_cast<Index>(block.size);
        if (stage + 1 == stages_) {
          moved.push_back(next);
          next.constraint = found.constraint;
        }
        if (stage == 0) next.constraint = -1;
      }
      if (next.constraint >= 0) moved.push_back(std::move(next));
    }
    return moved;
  }

 private:
  void shift(const std::vector<StageBlock>& blocks, std::vector<double>& values) const {
    for (const StageBlock& block : blocks) {
      const std::size_t length = values.size();
      const bool fits = block.begin <= length &&
                        (block.size == 0 || stages_ <= (length - block.begin) / block.size);
      if (!fits) throw std::invalid_argument("a block of stages does not fit");
      const auto part = std::span(values).subspan(block.begin, stages_ * block.size);
      std::shift_left(part.begin(), part.end(), static_cast<std::ptrdiff_t>(block.size));
    }
  }

  std::size_t stages_;
  std::vector<StageBlock> variables_, constraints_;
};

/// Options for a start close to the solution: multipliers are asked for, the barrier parameter
/// starts at mu, and the point is hardly pushed away from its bounds. Take mu between
/// tol and 0.1: the nearer the start is to the solution, the smaller (1e-4, say). A mu that is too
/// small makes steps short, one that is too large first moves the iterates away.
inline void warm_start(Ipopt::OptionsList& options, double mu) {
  options.SetStringValue("warm_start_init_point", "yes");
  options.SetNumericValue("mu_init", mu);
  for (const char* push :
       {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
        "warm_start_slack_bound_frac", "warm_start_mult_bound_push"}) {
    options.SetNumericValue(push, mu);
  }
}

/// The same for a solve of the core.
inline void warm_start(SolverOptions& options, double mu) {
  options.warm_start_init_point = true;
  options.mu_init = mu;
  options.warm_start_bound_push = options.warm_start_bound_frac = mu;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = mu;
  options.warm_start_mult_bound_push = mu;
}

/// Back to starts without multipliers, with Ipopt's barrier parameter.
inline void cold_start(Ipopt::OptionsList& options) {
  options.SetStringValue("warm_start_init_point", "no");
  options.SetNumericValue("mu_init", 0.1);
}

}  // namespace ipminmax
