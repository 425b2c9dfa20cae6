#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/method/globalized_method.hpp"
#include "core/method/parameters.hpp"
#include "core/method/restoration.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/paper/algorithm_one.hpp"
#include "core/search/divergence.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/search.hpp"
#include "core/search/solve.hpp"
#include "core/violations.hpp"
#include "linalg/solver_lost.hpp"

namespace ipminmax {
namespace {

SearchOutcome better(const std::optional<SearchOutcome>& earlier, SearchOutcome later) {
  if (!earlier) return later;
  return better(*earlier, std::move(later));
}

/// One solve: the best of a list of searches, all within one budget of iterations.
class Solve {
 public:
  /// Of a restoration: no restoration and no certificate of its own, and minmax_max_factorizations
  /// is what the solve around it leaves it.
  Solve(Problem& problem, const SolverOptions& options, Budget& shared,
        const SolveObserver& observer, Purpose purpose, KeptWork* kept)
      : problem_(problem),
        options_(options),
        shared_(shared),
        observer_(observer),
        purpose_(purpose),
        kept_(kept),
        arrays_(kept != nullptr ? kept->arrays : own_arrays_.emplace()),
        limit_(shared),
        budget_{.limit = options.max_iter},
        canonical_(problem, options, counts_, timing_, &arrays_.canonical) {
    if (purpose == Purpose::Solution) {
      if (const auto left = shared.factorizations_left()) budget_.factorizations = *left;
    } else if (options.minmax_max_factorizations > 0) {
      budget_.factorizations = options.minmax_max_factorizations;
    }
  }

  Result run() {
    Result result = run_guarded();
    if (purpose_ == Purpose::Restoration) return result;  // the whole solve counts it
    const Index restoring = counts_.factorizations_for(FactorizationCause::Restoration).full;
    shared_.spend(result.factorizations + restoring);
    if (result.status == Status::OutOfMemory) shared_.stop(Status::OutOfMemory);
    return result;
  }

 private:
  /// What the searches work with.
  struct Machinery {
    explicit Machinery(Solve& solve)
        : kkt(solve.canonical_, solve.options_, solve.counts_, solve.timing_, &solve.limit_,
              {.analysis = solve.kept_analysis(), .arrays = &solve.arrays_.kkt}),
          correction(kkt, solve.options_, solve.counts_, &solve.limit_),
          context{.canonical = solve.canonical_,
                  .kkt = kkt,
                  .correction = correction,
                  .options = solve.options_,
                  .limit = solve.limit_,
                  .budget = solve.budget_,
                  .counts = solve.counts_},
          observation(solve.observer_, context,
                      [&solve](Result& result) { solve.set_totals(result); }),
          others(context),
          best_point(solve.arrays_.search.best) {
      best_point.begin_anew();
      kkt.allow_factorizations(solve.budget_.factorizations_of_steps());
    }

    /// Of all searches, with the outcome of the last one.
    [[nodiscard]] SearchOutcome best_with(SearchOutcome last) const {
      return better(best, better(left, std::move(last)));
    }

    KktSystem kkt;
    InertiaCorrection correction;
    MethodContext context;
    Observation observation;
    OtherStarts others;
    std::optional<BarrierUpdate> barrier;
    bool rule_changed = false;          ///< a minimization's barrier, from one search to the next
    std::optional<Search> search;       ///< the last one
    std::optional<SearchOutcome> left;  ///< by the last one, for a better point
    std::optional<SearchOutcome> best;  ///< of those before
    BestPoint& best_point;              ///< of all
    /// Of the last search, one of them.
    std::optional<GlobalizedMethod> globalized;
    std::optional<AlgorithmOne> algorithm_one;
  };
  Result run_guarded() {
    try {
      return run_checked();
    } catch (const FactorsOutOfMemory& error) {
      return without_point(Status::OutOfMemory, error.what());
    } catch (const std::bad_alloc&) {
      if (purpose_ == Purpose::Restoration) throw;  // the whole solve is out of memory
      return without_point(Status::OutOfMemory, "out of memory");
    } catch (const std::length_error&) {  // more than an array can hold
      if (canonical_.inside_model() || observer_threw_) throw;
      return without_point(Status::OutOfMemory, "out of memory");
    } catch (const SolverLost& error) {
      if (purpose_ == Purpose::Restoration) throw;
      return without_point(Status::LinearSolverFailed, error.what());
    } catch (const SolverUnavailable& error) {
      if (purpose_ == Purpose::Restoration) throw;
      return without_point(Status::InvalidOption, error.what());
    }
  }

  Result run_checked() {
    if (auto error = check(options_); !error.empty()) {
      return without_point(Status::InvalidOption, std::move(error));
    }
    if (kept_ && !kept_->fits(problem_.structure(), options_)) kept_ = nullptr;
    const bool is_scaled = kept_ && kept_->scaling;
    if (auto error = canonical_.build(is_scaled ? &*kept_->scaling : nullptr, &limit_);
        !error.empty()) {
      return limit_.exceeded() ? at_start() : without_point(canonical_.error_status(), error);
    }
    if (options_.mu_strategy == BarrierStrategy::Adaptive && canonical_.max_size() > 0 &&
        options_.adaptive_mu_globalization == AdaptiveGlobalization::ObjectiveFilter) {
      return without_point(
          Status::InvalidOption,
          "adaptive_mu_globalization = obj-constr-filter is for minimizations: with "
          "Max variables the "
          "objective may rise\nuse kkt-error");
    }
    if (options_.minmax_certificate == CertificateEffort::None && canonical_.max_size() > 0) {
      return without_point(
          Status::InvalidOption,
          "minmax_certificate = none is for minimizations: with Max variables only the certificate "
          "tells a local minmax from a saddle");
    }
    return search();
  }

  Result search() {
    if (limit_.expired()) return at_start();
    Machinery machinery(*this);
    if (limit_.expired() || !analyze(machinery)) {
      return limit_.exceeded()
                 ? at_start()
                 : without_point(Status::OutOfMemory, "out of memory in the analysis");
    }
    const auto stopped = [&](Status status, const char* why) {
      return machinery.search
                 ? finish(machinery, machinery.best_with(machinery.search->ended(status, why)))
                 : without_point(status, why);
    };
    try {
      Start& first = arrays_.search.start;
      begin_at(canonical_, canonical_.starting_point(), first.point);
      first.how = StepKind::None;
      first.rule = Start::Rule::Chosen;
      first.deadline.reset();
      std::string message;
      if (const auto status = evaluate_start(machinery.context, options_, first.point, message)) {
        Result result = without_point(*status, std::move(message));
        keep_work(machinery, *status);
        return result;
      }
      return finish(machinery, search_all(machinery, first));
    } catch (const FactorsOutOfMemory& error) {
      return stopped(Status::OutOfMemory, error.what());
    } catch (const SolverUnavailable& error) {
      if (purpose_ == Purpose::Restoration) throw;
      machinery.best.reset();  // this is why nothing better was found
      return stopped(Status::LinearSolverFailed, error.what());
    } catch (const std::length_error&) {
      observer_threw_ = machinery.observation.is_inside();
      throw;
    }
  }

  bool analyze(Machinery& machinery) {
    if (!machinery.kkt.analyze(kept_ ? kept_->analysis : std::nullopt)) return false;
    if (!kept_) return true;
    // Before any factorization, so that every search begins with the same solvers in the same
    // places.
    if (kept_->structure_only && !kept_->analysis) kept_->analysis = machinery.kkt.analysis();
    if (options_.minmax_warm_start_shifts) machinery.correction.remember(kept_->shifts);
    return true;
  }

  const KktAnalysis* kept_analysis() const {
    return kept_ && kept_->analysis ? &*kept_->analysis : nullptr;
  }

  SearchOutcome search_all(Machinery& machinery, Start& start) {
    machinery.barrier.emplace(machinery.context, start.point);
    for (;;) {
      SearchOutcome outcome = machinery.best_with(search_from(start, machinery));
      const bool goes_on = search_failed(outcome.status);
      machinery.best = std::move(outcome);
      auto next = goes_on ? next_start(machinery) : std::nullopt;
      if (!next) break;
      start = std::move(*next);
    }
    SearchOutcome best = std::move(*machinery.best);
    if (search_failed(best.status) && machinery.others.drawn() > 0) {
      if (best.message.empty()) best.message = std::string(name_of(best.status));
      best.message += "\n" + machinery.others.describe();
    }
    return best;
  }

  SearchOutcome search_from(const Start& start, Machinery& machinery) {
    machinery.search.emplace(machinery.context, purpose_, *machinery.barrier, machinery.observation,
                             start, arrays_.search);
    StepMethod& method = method_for(start, machinery);
    if (auto found = contradiction(*machinery.search)) return std::move(*found);
    SearchOutcome outcome = machinery.search->run(method, machinery.left);
    if (returns_best(machinery.best_point, outcome)) take_best(machinery.best_point, outcome);
    const bool is_first = start.how == StepKind::None;
    if (is_first && has_line_search() && purpose_ == Purpose::Solution) {
      name_infeasibility(machinery.context, problem_.structure(), restorer(machinery), outcome);
    }
    return outcome;
  }

  /// Whether a search that is stuck is followed by one with the other mu_strategy.
  bool may_change_rule() const {
    const bool has_bounds =
        !canonical_.lower_bounded().empty() || !canonical_.upper_bounded().empty();
    return canonical_.max_size() == 0 && has_bounds && purpose_ == Purpose::Solution &&
           has_line_search() && makes_new_starts(options_);
  }

  /// A minimization that is stuck: once more from the model's start.
  std::optional<Start> start_with_other_rule(Machinery& machinery) {
    const Status status = machinery.best->status;
    const bool stuck = status == Status::TinyStep || status == Status::RestorationFailed ||
                       status == Status::InertiaCorrectionFailed ||
                       status == Status::NotLocalMinmax;
    if (!stuck || machinery.rule_changed || !may_change_rule() || budget_.is_spent()) {
      return std::nullopt;
    }
    SolverOptions cold = options_;
    cold.warm_start_init_point = false;
    Start start;
    start.how = StepKind::NewStart;
    begin_at(canonical_, canonical_.starting_point(), start.point);
    machinery.correction.begin_anew();
    machinery.kkt.reset_quality();
    std::string unused;
    if (evaluate_start(machinery.context, cold, start.point, unused) ||
        !machinery.barrier->change_rule(start.point)) {
      return std::nullopt;
    }
    machinery.rule_changed = true;
    machinery.observation.say(
        std::string("no solution from here; trying again with mu_strategy ") +
        (options_.mu_strategy == BarrierStrategy::Adaptive ? "monotone" : "adaptive"));
    machinery.barrier->begin_anew();
    ++budget_.iteration;
    return start;
  }

  std::optional<Start> next_start(Machinery& machinery) {
    if (canonical_.max_size() == 0) return start_with_other_rule(machinery);
    if (!makes_new_starts(options_) || budget_.is_spent()) return std::nullopt;
    auto next = machinery.others.next();
    if (!next) return std::nullopt;
    machinery.observation.say("no local minmax found from here; new start " +
                              std::to_string(machinery.others.drawn()) +
                              (next->rule == Start::Rule::AlgorithmOne ? ", by Algorithm 1" : ""));
    machinery.barrier->begin_anew();
    ++budget_.iteration;
    return next;
  }

  StepMethod& method_for(const Start& start, Machinery& machinery) {
    const bool is_first = start.how == StepKind::None;
    if (start.rule == Start::Rule::Chosen && has_line_search()) {
      return machinery.globalized.emplace(machinery.context, restorer(machinery), start.point,
                                          arrays_.method);
    }
    if (is_first && options_.minmax_freeze_tol > 0.0) {
      machinery.observation.say(
          "minmax_freeze_tol > 0: shifts that are kept depend on where the iterates came from, so "
          "points that are no local minmax may attract them; the certificate tells");
    }
    return machinery.algorithm_one.emplace(machinery.context);
  }

  Restorer restorer(Machinery& machinery) {
    if (purpose_ == Purpose::Restoration) return {};
    Restorer restorer{.solve =
                          [this, &machinery](Problem& problem, const SolverOptions& options,
                                             const SolveObserver& observer) {
                            return restoration(machinery, problem, options, observer);
                          },
                      .observe = {}};
    if (machinery.observation.is_wanted()) {
      restorer.observe = [&machinery](const IterationInfo& nested, const Point& from,
                                      const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
        return machinery.observation.tell_restoration(machinery.barrier->mu(), nested, from, v, c);
      };
    }
    return restorer;
  }

  Result restoration(Machinery& machinery, Problem& problem, const SolverOptions& options,
                     const SolveObserver& observer) {
    SolverOptions own = options;
    if (options_.minmax_max_factorizations > 0) {
      own.minmax_max_factorizations = machinery.kkt.factorizations_left();
      if (own.minmax_max_factorizations <= 0) {
        limit_.exceed(Status::MaxIterations);
        Result none;
        none.status = Status::MaxIterations;
        return none;
      }
    }
    Result result = Solve(problem, own, shared_, observer, Purpose::Restoration, nullptr).run();
    counts_.factorizations_for(FactorizationCause::Restoration).full += result.factorizations;
    return result;
  }

  bool has_line_search() const {
    return options_.minmax_globalization == Globalization::Filter && !options_.minmax_pure_newton;
  }

  /// Names a constraint that no variable can mend.
  std::optional<SearchOutcome> contradiction(const Search& search) const {
    const auto row = canonical_.violated_constant_constraint();
    if (!row) return std::nullopt;
    const bool max =
        problem_.structure().constraint_players[static_cast<std::size_t>(*row)] == Player::Max;
    return search.ended(max ? Status::InnerInfeasible : Status::LocallyInfeasible,
                        canonical_.constraint_name(*row) + " has no free variable and is violated");
  }

  /// Whether a solve that ended so returns the best point that it has seen instead of that.
  bool returns_best(const BestPoint& best, const SearchOutcome& ended) const {
    if (purpose_ != Purpose::Solution || !has_line_search()) return false;
    const PointRank reached = rank_of(canonical_, options_, ended.point);
    switch (ended.status) {
      case Status::TinyStep:
      case Status::RestorationFailed:
      case Status::InertiaCorrectionFailed:
      case Status::LinearSolverFailed:
      case Status::EvaluationFailed:
      case Status::InvalidNumber:
        return best.rank() < reached;
      case Status::MaxIterations:
      case Status::MaxCpuTime:
      case Status::MaxWallTime:
        // A minimization that goes on later does so from the last point, unless that is infeasible.
        return canonical_.max_size() > 0 ? best.rank() < reached
                                         : best.rank().violation < reached.violation;
      default:  // the last point shows what the status says, or is the user's
        return false;
    }
  }

  void take_best(const BestPoint& best, SearchOutcome& outcome) {
    outcome.point = best.point();
    outcome.mu = best.mu();
    outcome.certificate = {};
    // The bounds that were moved since then are those of other points.
    canonical_.keep_distances(outcome.point.iterate, outcome.mu);
    measure(canonical_, options_, outcome.point);
    outcome.of_iteration = best.iteration();
  }

  Result finish(Machinery& machinery, SearchOutcome outcome) {
    if (returns_best(machinery.best_point, outcome)) take_best(machinery.best_point, outcome);
    if (outcome.of_iteration && !outcome.message.empty()) {
      outcome.message += "\nthe returned point is the best one seen, of iteration " +
                         std::to_string(*outcome.of_iteration);
    }
    Result result;
    arrays_.result.give_to(result);
    describe(canonical_, options_, outcome, result);
    arrays_.search.ended = std::move(outcome.point);
    result.iterations = budget_.iteration;
    if (result.message.empty()) result.message.assign(name_of(result.status));
    keep_work(machinery, result.status);
    set_totals(result);
    return result;
  }

  Result without_point(Status status, std::string message) {
    if (kept_ && !kept_->structure_only) kept_->forget();
    Result result;
    result.status = status;
    result.message = std::move(message);
    set_totals(result);
    return result;
  }

  /// Of a solve that had no time to begin: the model's start, in its bounds, and the values there.
  Result at_start() {
    const Status status = *limit_.exceeded();
    Result result = without_point(status, std::string(name_of(status)));
    const ProblemStructure& s = problem_.structure();
    const std::size_t n = s.variable_players.size(), m = s.constraint_players.size();
    auto start = model_start(problem_);
    if (!start || !all_finite(*start)) {
      return without_point(Status::InvalidNumber, "the starting point is not finite");
    }
    result.v = std::move(*start);
    for (auto* z : {&result.z_lower, &result.z_upper}) z->resize(n);
    for (auto* of_constraints : {&result.lambda, &result.constraints}) of_constraints->resize(m);
    for (std::size_t i = 0; i < n; ++i) {
      result.v[i] = std::clamp(result.v[i], s.variable_lower[i], s.variable_upper[i]);
    }
    if (!problem_.objective(result.v, true, result.objective)) result.objective = kNaN;
    if (m > 0 && !problem_.constraints(result.v, false, result.constraints)) {
      result.constraints.assign(m, kNaN);
    }
    result.counts.objective += 1;
    result.counts.constraints += m > 0 ? 1 : 0;
    return measure_errors(result) ? result : without_point(status, std::string(name_of(status)));
  }

  /// Of a point whose multipliers are zero, but for those that hold fixed variables. False: some
  /// are undefined.
  bool measure_errors(Result& result) {
    const auto found = violations_at(problem_, result, options_);
    result.counts.gradient += 1;
    result.counts.jacobian += result.lambda.empty() ? 0 : 1;
    if (!found || !all_finite(result.constraints)) return false;
    const ProblemStructure& s = problem_.structure();
    using enum FixedVariableTreatment;
    const FixedVariableTreatment fixed = options_.fixed_variable_treatment;
    KktError& error = result.error = {};
    for (const double by : found->constraint) error.primal = largest(error.primal, by);
    for (const auto i : indices(result.v)) {
      const double slope = found->lagrangian_gradient[i];
      const bool is_fixed = s.variable_lower[i] == s.variable_upper[i];
      if (is_fixed && fixed == MakeParameter) {
        result.z_lower[i] = std::max(slope, 0.0);
        result.z_upper[i] = std::max(-slope, 0.0);
      }
      if (is_fixed && (fixed == MakeParameter || fixed == MakeParameterNodual)) continue;
      double& dual = s.variable_players[i] == Player::Max ? error.dual_max : error.dual_min;
      dual = largest(dual, std::abs(slope));
    }
    error.total = largest(error.primal, largest(error.dual_min, error.dual_max));
    result.certificate.kind = kind_without_test(error.primal, options_.constr_viol_tol);
    return true;
  }

  void keep_work(const Machinery& machinery, Status status) {
    if (!kept_ || kept_->structure_only) return;
    if (status == Status::OutOfMemory) {
      kept_->forget();
      return;
    }
    if (options_.nlp_scaling_method != Scaling::GradientBased) kept_->scaling.reset();
    if (canonical_.gradient_scaling()) kept_->scaling = canonical_.gradient_scaling();
    kept_->analysis = machinery.kkt.analysis();
    kept_->shifts = is_success(status) ? machinery.correction.memory() : ShiftMemory{};
  }

  void set_totals(Result& result) const {
    result.counts = counts_;
    result.counts.restoration_iterations = budget_.restoration;
    result.timing = timing_;
    result.factorizations = counts_.factorizations_full + counts_.factorizations_inner;
    result.seconds = limit_.stopwatch().wall();
    result.cpu_seconds = limit_.stopwatch().cpu();
    result.timing.total = result.seconds;
  }

  Problem& problem_;
  const SolverOptions& options_;
  Budget& shared_;
  const SolveObserver& observer_;
  Purpose purpose_;
  KeptWork* kept_;
  Counts counts_;
  Timing timing_;
  std::optional<SolveArrays> own_arrays_;
  SolveArrays& arrays_;
  TimeLimit limit_;
  IterationBudget budget_;
  CanonicalProblem canonical_;
  bool observer_threw_ = false;
};

}  // namespace

Result run_searches(Problem& problem, const SolverOptions& options, Budget& budget,
                    const SolveObserver& observer, KeptWork* kept) {
  return Solve(problem, options, budget, observer, Purpose::Solution, kept).run();
}

}  // namespace ipminmax
