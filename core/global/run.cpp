#include <memory>
#include <stdexcept>
#include <utility>

#include "core/answer.hpp"
#include "core/global/audit.hpp"
#include "core/global/over_y.hpp"
#include "core/global/refinement.hpp"
#include "core/global/starts.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof/local_minmax.hpp"
#include "core/robust.hpp"
#include "core/robust/epigraph.hpp"
#include "core/search/solve.hpp"
#include "core/solver.hpp"

// The door: every call makes one budget, and all that is solved behind it is given that one.
namespace ipminmax {
namespace {

/// One solve is all that is asked for.
bool is_plain(const ProblemStructure& structure, const SolverOptions& options) {
  return options.minmax_starts <= 1 && options.minmax_worst_case_starts <= 0 &&
         !options.minmax_worst_case_proof &&
         options.minmax_certificate != CertificateEffort::Proved && !options.minmax_epigraph &&
         !options.minmax_epigraph_at_kinks && !has_rows_for_every_y(structure, options);
}

/// Quasi-Newton matrices are for minimizations that were given as such, not for parts of a game.
SolverOptions for_all_parts(const ProblemStructure& structure, SolverOptions options) {
  if (options.hessian_approximation == HessianApproximation::LimitedMemory &&
      has_max_variables(structure)) {
    options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  }
  return options;
}

/// Why f cannot be treated as a robust constraint, or nothing be proved, as asked; empty: it can.
std::string error_over_y(Problem& model, const SolverOptions& options) {
  const char* asked = options.minmax_worst_case_proof    ? "minmax_worst_case_proof"
                      : options.minmax_epigraph          ? "minmax_epigraph"
                      : options.minmax_epigraph_at_kinks ? "minmax_epigraph_at_kinks"
                                                         : nullptr;
  if (asked == nullptr || !check_indices(model.structure()).empty() ||
      !has_max_variables(model.structure())) {
    return {};
  }
  if (options.minmax_worst_case_proof && model.over_boxes() == nullptr) {
    return "minmax_worst_case_proof needs a model whose formulas are known (docs/proof.md)";
  }
  bool mirrored = options.obj_scaling_factor < 0.0;
  if (options.nlp_scaling_method == Scaling::User) {
    UserScaling scaling;
    if (model.user_scaling(scaling) && scaling.objective < 0.0) mirrored = !mirrored;
  }
  if (!mirrored) return {};
  return std::string(asked) +
         " cannot be used with a negative factor of the objective, by which y minimizes f";
}

/// What is wrong with what was asked for; empty: nothing that the door sees.
std::string error_of(Problem& problem, const SolverOptions& options) {
  if (auto error = check(options); !error.empty()) return error;
  if (options.minmax_certificate == CertificateEffort::Proved && problem.over_boxes() == nullptr) {
    return "minmax_certificate proved needs a model whose formulas are known (docs/proof.md)";
  }
  return error_over_y(problem, options);
}

Answer refused(std::string error) {
  Answer answer;
  answer.best = without_point(Status::InvalidOption, std::move(error));
  answer.statuses = {{Status::InvalidOption, 1}};
  answer.starts = 1;
  return answer;
}

/// One for each thread.
struct OwnModels {
  OwnModels(const ProblemFactory& make_problem, int count) {
    for (int k = 0; k < count; ++k) {
      owned.push_back(make_problem());
      if (!owned.back()) throw std::invalid_argument("the factory of a multistart made no problem");
      models.push_back(owned.back().get());
    }
  }
  std::vector<std::unique_ptr<Problem>> owned;
  std::vector<Problem*> models;
};

/// models: one for each thread. ranks: null, or the others that share the starts.
Answer run_on(const std::vector<Problem*>& models, Ranks* ranks, const SolverOptions& asked,
              const MultistartObserver& observer, const Points& given,
              const std::vector<RobustWorstCase>& known = {}) {
  const SolverOptions options = for_all_parts(models.front()->structure(), asked);
  if (auto error = error_of(*models.front(), options); !error.empty()) return refused(error);
  Budget budget(options, observer);
  Starts starts(models, options, budget, given, known);
  Answer answer = ranks != nullptr ? starts.run(*ranks) : starts.run();
  if (options.minmax_certificate == CertificateEffort::Proved) {
    prove_local_minmax(
        *models.front(), options, [&] { return !budget.interrupted(); }, answer.best);
  }
  add_gap(*models.front(), options, budget, answer.best);
  answer.best.seconds = answer.best.timing.total = budget.stopwatch().wall();
  answer.best.cpu_seconds = budget.stopwatch().cpu();
  return answer;
}

/// As one observer of a solve hears the starts. He outlives the budget: one word each.
MultistartObserver listener_of(const SolveObserver& observer) {
  MultistartObserver listener;
  if (observer.on_iteration) {
    listener.on_iteration = [&observer](Index, const IterationInfo& info) {
      return observer.on_iteration(info);
    };
  }
  if (observer.message) {
    listener.message = [&observer](Index, std::string_view text) { observer.message(text); };
  }
  return listener;
}

Answer run_for(Problem& problem, const SolverOptions& options, const SolveObserver& observer) {
  return run(problem, options, listener_of(observer));
}

/// The only solve. kept: null, or of the last one.
Result solve_plain(Problem& problem, const SolverOptions& options, const SolveObserver& observer,
                   KeptWork* kept) {
  Budget budget(options, listener_of(observer));
  Result result = solve_from_start(problem, options, budget, budget.observer_of(0), kept);
  audit(problem, options, Witnesses(), budget, result, result.counts);
  add_gap(problem, options, budget, result);
  return result;
}

}  // namespace

Answer run(Problem& problem, const SolverOptions& options, const MultistartObserver& observer,
           const Points& given) {
  return run_on({&problem}, nullptr, options, observer, given);
}

Result solve(Problem& problem, const SolverOptions& options, const SolveObserver& observer) {
  return is_plain(problem.structure(), options) ? solve_plain(problem, options, observer, nullptr)
                                                : run_for(problem, options, observer).best;
}

Result solve(Problem& problem, const SolverOptions& options,
             const IterationCallback& on_iteration) {
  return solve(problem, options, SolveObserver{.on_iteration = on_iteration, .message = {}});
}

RepeatedSolver::RepeatedSolver() = default;
RepeatedSolver::~RepeatedSolver() = default;
RepeatedSolver::RepeatedSolver(RepeatedSolver&&) noexcept = default;
RepeatedSolver& RepeatedSolver::operator=(RepeatedSolver&&) noexcept = default;

Result RepeatedSolver::solve(Problem& problem, const SolverOptions& options,
                             const SolveObserver& observer) {
  // Taken out, so that an exception of the model leaves nothing half made.
  std::unique_ptr<KeptWork> kept = std::move(kept_);
  if (!kept) kept = std::make_unique<KeptWork>();
  Result result;
  if (is_plain(problem.structure(), options)) {
    result = solve_plain(problem, options, observer, kept.get());
  } else {
    std::vector<RobustWorstCase> known = std::exchange(kept->worst_cases, {});
    if (!options.warm_start_init_point) known.clear();
    result = run_on({&problem}, nullptr, options, listener_of(observer), {}, known).best;
    if (is_success(result.status)) kept->worst_cases = result.worst_cases;
  }
  if (result.status != Status::OutOfMemory) kept_ = std::move(kept);
  return result;
}

void RepeatedSolver::solve(Problem& problem, const SolverOptions& options,
                           const SolveObserver& observer, Result& result) {
  if (!kept_) kept_ = std::make_unique<KeptWork>();
  kept_->arrays.result.take_from(result);
  result = solve(problem, options, observer);
}

void RepeatedSolver::start_at(std::vector<RobustWorstCase> worst_cases) {
  if (!kept_) kept_ = std::make_unique<KeptWork>();
  kept_->worst_cases = std::move(worst_cases);
}

void RepeatedSolver::reset() { kept_.reset(); }

MultistartResult multistart(Problem& problem, const SolverOptions& options,
                            const MultistartObserver& observer, const Points& given) {
  return run(problem, options, observer, given);
}

MultistartResult multistart(const ProblemFactory& make_problem, int threads,
                            const SolverOptions& options, const MultistartObserver& observer,
                            const Points& given) {
  const int starts = std::max(options.minmax_starts, static_cast<int>(given.size()) + 1);
  const OwnModels own(make_problem, std::clamp(threads, 1, std::max(starts - 1, 1)));
  return run_on(own.models, nullptr, options, observer, given);
}

MultistartResult multistart_over_ranks(const ProblemFactory& make_problem, int threads,
                                       const SolverOptions& options,
                                       const MultistartObserver& observer, const Points& given) {
  Ranks ranks;
  const OwnModels own(make_problem, std::max(threads, 1));
  return run_on(own.models, &ranks, options, observer, given);
}

StartsRank join_ranks_for_starts() {
  const auto [rank, size] = Ranks::join();
  return {rank, size};
}

std::unique_ptr<Problem> make_epigraph(Problem& model) {
  return std::make_unique<Epigraph>(model, std::vector<bool>{});
}

RobustResult solve_robust(Problem& model, const SolverOptions& options,
                          const SolveObserver& observer) {
  Answer answer = run_for(model, options, observer);
  const SearchOverY& y = answer.best.over_y;
  return {.result = answer.best,
          .worst_cases = answer.best.worst_cases,
          .solves = y.solves,
          .maximizations = y.maximizations,
          .largest_violation = y.largest_violation,
          .branches = y.branches,
          .starts = answer.starts,
          .best_start = answer.best_start,
          .points = std::move(answer.points)};
}

}  // namespace ipminmax
