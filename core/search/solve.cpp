#include "core/search/solve.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/method/globalized_method.hpp"
#include "core/method/restoration.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/paper/algorithm_one.hpp"
#include "core/search/divergence.hpp"
#include "core/search/one_start.hpp"
#include "core/search/outcome.hpp"
#include "core/search/search.hpp"
#include "core/search/starts.hpp"
#include "core/violations.hpp"
#include "linalg/solver_lost.hpp"

namespace ipminmax {

namespace {

SearchOutcome better(const std::optional<SearchOutcome>& earlier, SearchOutcome later) {
  if (!earlier) return later;
  return better(*earlier, std::move(later));
}

/// Whether variables with equal bounds are taken out and may be kept instead.
bool may_keep_fixed_variables(const ProblemStructure& s, const SolverOptions& options) {
  const auto treatment = options.fixed_variable_treatment;
  const bool takes_out = treatment == FixedVariableTreatment::MakeParameter ||
                         treatment == FixedVariableTreatment::MakeParameterNodual;
  if (!takes_out || !(options.bound_relax_factor > 0.0)) return false;
  for (const auto i : indices(s.variable_lower)) {
    if (s.variable_lower[i] == s.variable_upper[i]) return true;
  }
  return false;
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
        limit_(shared, options.max_iter),
        canonical_(problem, options, counts_, timing_, &arrays_.canonical) {
    if (purpose == Purpose::Solution) {
      if (const auto left = shared.factorizations_left()) limit_.factorizations = *left;
    } else if (options.minmax_max_factorizations > 0) {
      limit_.factorizations = options.minmax_max_factorizations;
    }
  }

  /// Searches from one start after the other until one succeeds. What the model or the observer
  /// throws passes through; of a restoration all that is not the factors' memory does.
  Result run() {
    try {
      Start start;
      if (auto refused = prepare(start.point)) return std::move(*refused);
      for (;;) {
        search_.emplace(*context_, purpose_, *barrier_, *observation_, start, arrays_.search);
        StepMethod& method = method_for(start);
        auto outcome = contradiction(*search_);
        if (!outcome) outcome = improved(search_->run(method, left_), start);
        best_ = best_with(std::move(*outcome));
        auto next = search_failed(best_->status) ? next_start() : std::nullopt;
        if (!next) break;
        start = std::move(*next);
      }
      if (search_failed(best_->status) && others_->drawn() > 0) {
        if (best_->message.empty()) best_->message = std::string(name_of(best_->status));
        best_->message += "\n" + others_->describe();
      }
      return finish(std::move(*best_));
    } catch (const FactorsOutOfMemory& error) {
      return stopped(Status::OutOfMemory, error.what());
    } catch (const std::bad_alloc&) {
      if (purpose_ == Purpose::Restoration) throw;  // the whole solve is out of memory
    } catch (const std::length_error&) {            // more than an array can hold
      if (canonical_.inside_model() || (observation_ && observation_->is_inside())) throw;
    } catch (const SolverUnavailable& error) {
      if (purpose_ == Purpose::Restoration) throw;
      best_.reset();  // this is why nothing better was found
      const bool worked = is_analyzed_ || dynamic_cast<const SolverLost*>(&error) != nullptr;
      return stopped(worked ? Status::LinearSolverFailed : Status::InvalidOption, error.what());
    }
    return without_point(Status::OutOfMemory, "out of memory");
  }

 private:
  /// The canonical problem, what the searches work with, and the evaluated start of the first. A
  /// result: there is nothing to search.
  std::optional<Result> prepare(Point& first) {
    if (auto error = check(options_); !error.empty()) {
      return without_point(Status::InvalidOption, std::move(error));
    }
    if (kept_ && !kept_->fits(problem_.structure(), options_)) kept_ = nullptr;
    const bool is_scaled = kept_ && kept_->scaling && keeps_numbers();
    if (auto error = canonical_.build(is_scaled ? &*kept_->scaling : nullptr, &limit_);
        !error.empty()) {
      return limit_.exceeded() ? at_start() : without_point(canonical_.error_status(), error);
    }
    if (auto error = option_for_minimizations(); canonical_.max_size() > 0 && error != nullptr) {
      return without_point(Status::InvalidOption, error);
    }
    if (limit_.expired()) return at_start();
    begin();
    if (limit_.expired() || !analyze()) {
      return limit_.exceeded()
                 ? at_start()
                 : without_point(Status::OutOfMemory, "out of memory in the analysis");
    }
    is_analyzed_ = true;
    first = std::move(arrays_.search.point);  // for its room
    begin_at(canonical_, canonical_.starting_point(), first);
    if (evaluate_start(*context_, options_, first)) {
      barrier_.emplace(*context_, first);
      return std::nullopt;
    }
    const Status status = canonical_.evaluation_status();
    Result result = without_point(status, canonical_.evaluation_error() + " at the starting point");
    keep_work(status);
    return result;
  }

  /// What is asked for and possible without Max variables alone; null: nothing.
  [[nodiscard]] const char* option_for_minimizations() const {
    if (options_.mu_strategy == BarrierStrategy::Adaptive &&
        options_.adaptive_mu_globalization == AdaptiveGlobalization::ObjectiveFilter) {
      return "adaptive_mu_globalization = obj-constr-filter is for minimizations: with Max "
             "variables the objective may rise\nuse kkt-error";
    }
    if (options_.minmax_certificate == CertificateEffort::None) {
      return "minmax_certificate = none is for minimizations: with Max variables only the "
             "certificate tells a local minmax from a saddle";
    }
    return nullptr;
  }

  void begin() {
    kkt_.emplace(canonical_, options_, counts_, timing_, &limit_,
                 KeptKkt{.analysis = kept_ && kept_->analysis ? &*kept_->analysis : nullptr,
                         .arrays = &arrays_.kkt});
    correction_.emplace(*kkt_, options_, counts_);
    context_.emplace(MethodContext{canonical_, *kkt_, *correction_, options_, limit_, counts_});
    observation_.emplace(observer_, *context_, [this](Result& result) { set_totals(result); });
    others_.emplace(*context_);
    arrays_.search.best.any = false;
  }

  /// Whether the scaling and the shifts of the last solve are taken up: from a start that is not
  /// near its solution the answer is that of a solve by itself.
  [[nodiscard]] bool keeps_numbers() const { return options_.warm_start_init_point; }

  bool analyze() {
    if (!kkt_->analyze()) return false;
    if (!kept_) return true;
    // Before any factorization, so that every search begins with the same solvers in the same
    // places.
    if (kept_->structure_only && !kept_->analysis) kept_->analysis = kkt_->analysis();
    if (options_.minmax_warm_start_shifts && keeps_numbers()) correction_->remember(kept_->shifts);
    return true;
  }

  /// Of all searches, with the outcome of the last one.
  [[nodiscard]] SearchOutcome best_with(SearchOutcome last) const {
    return better(best_, better(left_, std::move(last)));
  }

  /// The end of all searches by what the last one met; without a search no point is known.
  Result stopped(Status status, const char* why) {
    return search_ ? finish(best_with(search_->ended(status, why))) : without_point(status, why);
  }

  /// The best point instead of the last one, or the least violation instead of none.
  SearchOutcome improved(SearchOutcome outcome, const Start& start) {
    if (returns_best(outcome)) take_best(outcome);
    const bool is_first = start.how == StepKind::None;
    if (is_first && has_line_search() && purpose_ == Purpose::Solution) {
      name_infeasibility(*context_, problem_.structure(), restorer(), outcome);
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
  std::optional<Start> start_with_other_rule() {
    const Status status = best_->status;
    const bool stuck = status == Status::TinyStep || status == Status::RestorationFailed ||
                       status == Status::InertiaCorrectionFailed ||
                       status == Status::NotLocalMinmax;
    if (!stuck || rule_changed_ || !may_change_rule() || limit_.iterations_left() <= 0) {
      return std::nullopt;
    }
    SolverOptions cold = options_;
    cold.warm_start_init_point = false;
    Start start{.point = unevaluated_point(canonical_, canonical_.starting_point()),
                .how = StepKind::NewStart};
    correction_->begin_anew();
    kkt_->reset_quality();
    if (!evaluate_start(*context_, cold, start.point) || !barrier_->change_rule(start.point)) {
      return std::nullopt;
    }
    rule_changed_ = true;
    observation_->say(
        std::string("no solution from here; trying again with mu_strategy ") +
        (options_.mu_strategy == BarrierStrategy::Adaptive ? "monotone" : "adaptive"));
    barrier_->begin_anew();
    ++limit_.iteration;
    return start;
  }

  std::optional<Start> next_start() {
    if (canonical_.max_size() == 0) return start_with_other_rule();
    if (!makes_new_starts(options_) || limit_.iterations_left() <= 0) return std::nullopt;
    auto next = others_->next();
    if (!next) return std::nullopt;
    observation_->say("no local minmax found from here; new start " +
                      std::to_string(others_->drawn()) +
                      (next->algorithm_one_until ? ", by Algorithm 1" : ""));
    barrier_->begin_anew();
    ++limit_.iteration;
    return next;
  }

  StepMethod& method_for(const Start& start) {
    const bool is_first = start.how == StepKind::None;
    if (!start.algorithm_one_until && has_line_search()) {
      return globalized_.emplace(*context_, restorer(), arrays_.search.point, arrays_.method,
                                 arrays_.search.certificate);
    }
    if (is_first && options_.minmax_freeze_tol > 0.0) {
      observation_->say(
          "minmax_freeze_tol > 0: shifts that are kept depend on where the iterates came from, so "
          "points that are no local minmax may attract them; the certificate tells");
    }
    return algorithm_one_.emplace(*context_);
  }

  Restorer restorer() {
    if (purpose_ == Purpose::Restoration) return {};
    Restorer restorer{
        .solve =
            [this](Problem& problem, const SolverOptions& options, const SolveObserver& observer) {
              return restoration(problem, options, observer);
            },
        .observe = {}};
    if (observation_->is_wanted()) {
      restorer.observe = [this](const IterationInfo& nested, const Point& from,
                                const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
        return observation_->tell_restoration(barrier_->mu(), nested, from, v, c);
      };
    }
    return restorer;
  }

  Result restoration(Problem& problem, const SolverOptions& options,
                     const SolveObserver& observer) {
    SolverOptions own = options;
    if (options_.minmax_max_factorizations > 0) {
      own.minmax_max_factorizations = kkt_->factorizations_left();
      if (own.minmax_max_factorizations <= 0) {
        limit_.exceed(Status::MaxIterations);
        return ipminmax::without_point(Status::MaxIterations, {});
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
    const bool max = problem_.structure().constraint_players[at(*row)] == Player::Max;
    return search.ended(max ? Status::InnerInfeasible : Status::LocallyInfeasible,
                        canonical_.constraint_name(*row) + " has no free variable and is violated");
  }

  /// Whether a solve that ended so returns the best point that it has seen instead of that.
  bool returns_best(const SearchOutcome& ended) const {
    if (purpose_ != Purpose::Solution || !has_line_search()) return false;
    const PointRank reached = rank_of(canonical_, options_, ended.point);
    const PointRank& best = arrays_.search.best.rank;
    switch (ended.status) {
      case Status::TinyStep:
      case Status::RestorationFailed:
      case Status::InertiaCorrectionFailed:
      case Status::LinearSolverFailed:
      case Status::EvaluationFailed:
      case Status::InvalidNumber:
        return best < reached;
      case Status::MaxIterations:
      case Status::MaxCpuTime:
      case Status::MaxWallTime:
        // A minimization that goes on later does so from the last point, unless that is infeasible.
        return canonical_.max_size() > 0 ? best < reached : best.violation < reached.violation;
      default:  // the last point shows what the status says, or is the user's
        return false;
    }
  }

  void take_best(SearchOutcome& outcome) {
    const BestPoint& best = arrays_.search.best;
    outcome.point = best.point;
    outcome.mu = best.mu;
    outcome.certificate = {};
    // The bounds that were moved since then are those of other points.
    canonical_.keep_distances(outcome.point.iterate, outcome.mu);
    measure(canonical_, options_, outcome.point);
    outcome.of_iteration = best.iteration;
  }

  Result finish(SearchOutcome outcome) {
    if (returns_best(outcome)) take_best(outcome);
    if (outcome.of_iteration && !outcome.message.empty()) {
      outcome.message += "\nthe returned point is the best one seen, of iteration " +
                         std::to_string(*outcome.of_iteration);
    }
    Result result;
    arrays_.result.give_to(result);
    describe(canonical_, options_, outcome, result);
    arrays_.search.next = std::move(outcome.point);
    result.iterations = limit_.iteration;
    if (result.message.empty()) result.message.assign(name_of(result.status));
    keep_work(result.status);
    set_totals(result);
    return result;
  }

  Result without_point(Status status, std::string message) {
    if (kept_ && !kept_->structure_only) kept_->forget();
    Result result = ipminmax::without_point(status, std::move(message));
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

  void keep_work(Status status) {
    if (!kept_ || kept_->structure_only) return;
    if (status == Status::OutOfMemory) {
      kept_->forget();
      return;
    }
    if (options_.nlp_scaling_method != Scaling::GradientBased) kept_->scaling.reset();
    if (const auto* scaling = canonical_.gradient_scaling()) kept_->scaling = *scaling;
    kept_->analysis = kkt_->analysis();
    kept_->shifts = is_success(status) ? correction_->memory() : ShiftMemory{};
  }

  void set_totals(Result& result) const {
    result.counts = counts_;
    result.counts.restoration_iterations = limit_.restoration;
    result.timing = timing_;
    result.factorizations = counts_.factorizations_full + counts_.factorizations_inner;
    set_seconds(limit_.stopwatch(), result);
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
  SolveLimit limit_;
  CanonicalProblem canonical_;
  // What the searches work with.
  std::optional<KktSystem> kkt_;
  std::optional<InertiaCorrection> correction_;
  std::optional<MethodContext> context_;
  std::optional<Observation> observation_;
  std::optional<OtherStarts> others_;
  std::optional<BarrierUpdate> barrier_;
  bool rule_changed_ = false;          ///< a minimization's barrier, from one search to the next
  std::optional<Search> search_;       ///< the last one
  std::optional<SearchOutcome> left_;  ///< by the last one, for a better point
  std::optional<SearchOutcome> best_;  ///< of those before
  bool is_analyzed_ = false;           ///< the linear solver has worked
  // Of the last search, one of them.
  std::optional<GlobalizedMethod> globalized_;
  std::optional<AlgorithmOne> algorithm_one_;
};

}  // namespace

void KeptWork::forget() {
  shape = {};
  scaling.reset();
  analysis.reset();
  shifts = {};
  structure_only = false;
  hessian_pattern.reset();
}

bool KeptWork::fits(const ProblemStructure& s, const SolverOptions& options) {
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  const bool complete = s.variable_lower.size() == n && s.variable_upper.size() == n &&
                        s.constraint_lower.size() == m && s.constraint_upper.size() == m;
  const bool same = complete && has_shape(s, options, shape);
  // New ones instead of others in size: one of Eigen's is no more what it was when memory fails.
  if (!same) arrays = {};
  if (structure_only) {
    if (complete && !analysis && !same) shape = shape_of(s, options);
    return complete && (same || !analysis);
  }
  if (same) return true;
  forget();
  if (complete) shape = shape_of(s, options);
  return true;
}

Result run_searches(Problem& problem, const SolverOptions& options, Budget& budget,
                    const SolveObserver& observer, KeptWork* kept) {
  const auto run = [&](const SolverOptions& with) {
    Result result = Solve(problem, with, budget, observer, Purpose::Solution, kept).run();
    const auto& restoring = result.counts.factorizations_for(FactorizationCause::Restoration);
    budget.spend(result.factorizations + restoring.full);
    if (result.status == Status::OutOfMemory) budget.stop(Status::OutOfMemory);
    return result;
  };
  Result refused = run(options);
  if (refused.status != Status::TooFewDegreesOfFreedom ||
      !may_keep_fixed_variables(problem.structure(), options)) {
    return refused;
  }
  SolverOptions relaxed = options;
  relaxed.fixed_variable_treatment = FixedVariableTreatment::RelaxBounds;
  Result result = run(relaxed);
  if (result.status == Status::TooFewDegreesOfFreedom) return refused;
  result.fixed_variables_relaxed = true;
  if (observer.message) {
    observer.message(
        "The bounds of fixed variables were moved apart (fixed_variable_treatment "
        "relax_bounds): without these variables there were " +
        refused.message + ".");
  }
  return result;
}

}  // namespace ipminmax
