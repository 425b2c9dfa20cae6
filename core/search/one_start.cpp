#include <Eigen/Core>
#include <new>
#include <utility>
#include <vector>

#include "core/diagnostics/diagnosis.hpp"
#include "core/differences/finite_difference_hessian.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "core/search/one_start.hpp"
#include "core/search/solve.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {
namespace {

/// Tables that are made on first use are made when the library is loaded: a child that is forked
/// while another thread is at it would wait for them for ever.
[[maybe_unused]] const bool tables_are_made = [] {
  static_cast<void>(option_table());
  static_cast<void>(Eigen::l1CacheSize());
  return true;
}();

/// A function was evaluated, in vain: the numbers of the start itself are in order.
bool start_is_undefined(const Result& result) {
  const Counts& calls = result.counts;
  return result.v.empty() &&
         (result.status == Status::EvaluationFailed || result.status == Status::InvalidNumber) &&
         calls.objective + calls.gradient + calls.constraints + calls.jacobian > 0;
}

/// What was evaluated when the budget ended is undefined for that reason.
Result cut_at_start(Status why, Result undefined) {
  undefined.status = why;
  undefined.message = std::string(name_of(why)) + " at the starting point";
  return undefined;
}

/// One solve from one start; see solve_from_start.
struct OneStart {
  Budget& budget;
  const SolveObserver& observer;
  KeptWork* kept;

  void say(const std::string& text) const {
    if (observer.message) observer.message(text);
  }

  /// With second derivatives from differences. Where the pattern turns out to have missed entries
  /// at the end of a solve, it grows and the solve starts anew.
  Result solve_with_differences(Problem& problem, SolverOptions options) const {
    options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
    const Stopwatch stopwatch;
    Result result;
    FiniteDifferenceHessian model(
        problem, options, kept && kept->hessian_pattern ? &*kept->hessian_pattern : nullptr);
    const double detection = stopwatch.wall();
    for (int restarts = 0;; ++restarts) {
      say("Second derivatives from finite differences: " +
          std::to_string(model.structure().hessian.size()) + " entries by " +
          std::to_string(model.groups()) + " groups of variables.");
      result = run_searches(model, options, budget, observer, kept);
      constexpr int kMostRestarts = 6;
      if (restarts == kMostRestarts || stopped_from_outside(result.status)) break;
      // The certificate has looked at points that it tested; elsewhere a wrong Hessian may be why
      // the solve failed.
      if (result.certificate.second_order == SecondOrder::NotTested && !result.v.empty()) {
        std::vector<double> unused(result.v.size());
        static_cast<void>(model.hessian_errors(result.v, 1.0, result.lambda, unused));
      }
      if (!model.widen()) break;
      say("The Hessian has entries that its structure misses: starting anew with more.");
    }
    result.counts.gradient += model.gradients();
    result.counts.jacobian += model.jacobians();
    result.timing.evaluations += detection;
    set_seconds(stopwatch, result);
    return result;
  }

  /// With quasi-Newton matrices, of a minimization: they have no inertia to certify with.
  Result solve_by_quasi_newton(Problem& problem, SolverOptions options) const {
    options.minmax_certificate = CertificateEffort::None;
    if (options.mu_strategy == BarrierStrategy::Unset &&
        options.minmax_barrier_rule == BarrierRule::Ipopt) {
      options.mu_strategy = BarrierStrategy::Adaptive;
    }
    Restructured model(problem);
    model.changed.has_hessian = false;
    model.changed.hessian.clear();
    Result result = run_searches(model, options, budget, observer, kept);
    if (is_success(result.status) && result.message == name_of(result.status))
      result.message += "; limited-memory Hessian: nothing is certified";
    return result;
  }

  /// From the model's second derivatives, or from what stands for them.
  Result solve_with_hessian(Problem& problem, const SolverOptions& options) const {
    using enum HessianApproximation;
    const bool has_hessian = problem.structure().has_hessian;
    const auto approximation = options.hessian_approximation;
    const bool asks_model =
        has_hessian && approximation != LimitedMemory && approximation != FiniteDifferenceValues;
    if (asks_model || !check(options).empty()) {
      return run_searches(problem, options, budget, observer, kept);
    }
    if (approximation == Exact) {
      return without_point(
          Status::InvalidOption,
          "hessian_approximation = exact needs second derivatives, and the model has none\n"
          "use finite-difference-values");
    }
    if (approximation == LimitedMemory && !has_max_variables(problem.structure())) {
      return solve_by_quasi_newton(problem, options);
    }
    return solve_with_differences(problem, options);
  }

  /// Where a game is not defined at its own starting point: from the first of other ones where it
  /// is.
  Result solve_elsewhere(Problem& problem, const SolverOptions& options, Result undefined) const {
    if (!makes_new_starts(options) || !has_max_variables(problem.structure())) return undefined;
    const Stopwatch stopwatch;
    const std::vector<double> own = starting_values(problem);
    SolverOptions cold = options;
    cold.warm_start_init_point = false;
    for (Index start = 1; !own.empty() && start <= options.minmax_max_restarts; ++start) {
      const std::string which = "new start " + std::to_string(start);
      say(undefined.message + "; " + which);
      Restarted restarted(problem, random_start(problem.structure(), own, start, options));
      Result result = solve_with_hessian(restarted, cold);
      const bool defined = !start_is_undefined(result);
      if (defined && !is_success(result.status)) {
        result.message += "\nthis is from " + which + ", since " + undefined.message;
      }
      Result& all = defined ? result : undefined;
      add_work(defined ? undefined : result, all);
      set_seconds(stopwatch, all);
      if (defined || stopped_from_outside(result.status)) return all;
    }
    if (!own.empty()) {
      undefined.message +=
          ", and at " + std::to_string(options.minmax_max_restarts) + " other points, too";
    }
    return undefined;
  }
};

}  // namespace

/// Also where the solver itself, or its answer, finds no memory.
Result solve_from_start(Problem& problem, const SolverOptions& options, Budget& budget,
                        const SolveObserver& observer, KeptWork* kept) {
  try {
    const OneStart start{.budget = budget, .observer = observer, .kept = kept};
    Result result = start.solve_with_hessian(problem, options);
    if (start_is_undefined(result)) {
      if (const auto why = budget.interrupted()) return cut_at_start(*why, std::move(result));
      result = start.solve_elsewhere(problem, options, std::move(result));
    }
    diagnose_failure(problem, options, result);
    return result;
  } catch (const std::bad_alloc&) {
    if (kept) *kept = {};
    budget.stop(Status::OutOfMemory);
    return without_point(Status::OutOfMemory, "out of memory");
  } catch (...) {  // the solvers may be in any state
    if (kept) kept->analysis.reset();
    throw;
  }
}

SearchStructure::SearchStructure() : kept_(std::make_unique<KeptWork>()) {
  kept_->structure_only = true;
}
SearchStructure::~SearchStructure() = default;
SearchStructure::SearchStructure(SearchStructure&&) noexcept = default;

Counts SearchStructure::detect(Problem& problem, const SolverOptions& options) {
  Counts counts;
  const ProblemStructure& structure = problem.structure();
  if (structure.has_hessian || !check(options).empty() ||
      options.hessian_approximation == HessianApproximation::Exact ||
      options.hessian_approximation == HessianApproximation::LimitedMemory) {
    return counts;
  }
  FiniteDifferenceHessian model(problem, options);
  kept_->hessian_pattern = model.structure().hessian;
  counts.gradient = model.gradients();
  counts.jacobian = model.jacobians();
  return counts;
}

Result SearchStructure::solve(Problem& problem, const SolverOptions& options, Budget& budget,
                              const SolveObserver& observer) {
  return solve_from_start(problem, options, budget, observer, kept_.get());
}

}  // namespace ipminmax
