#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/certificate/certificate.hpp"
#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/method/algorithm_one.hpp"
#include "core/method/barrier.hpp"
#include "core/method/globalized_method.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/finite_difference_hessian.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/model_shape.hpp"
#include "core/model/timer.hpp"
#include "core/point/iterate.hpp"
#include "core/point/norms.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"
#include "core/search/restart.hpp"
#include "core/search/search_structure.hpp"
#include "core/solver.hpp"

namespace ipminmax {

/// What a solve leaves to the next one.
struct KeptWork {
  ModelShape shape;
  std::optional<GradientScaling> scaling;
  std::optional<KktAnalysis> analysis;
  ShiftMemory shifts;
  /// For searches that must not depend on those before: shape, analysis and pattern are those of
  /// the first and stay, the rest is not kept.
  bool structure_only = false;
  /// Of second derivatives by differences, detected; empty: not known.
  std::optional<std::vector<Triplet>> hessian_pattern;
};

namespace {

/// Size of a variable (scaled problem), over those of its bounds and of the start, at which a failed
/// solve counts as diverged.
constexpr double kRunaway = 1e10;
/// Iterations of a minimization beyond that, for starts of moderate size, after which the
/// minimization is called unbounded: shifts that double and divide can keep it there for ever.
constexpr Index kRunawayIterations = 100;
/// Multiplier of a Max constraint (scaled problem) at which a failed solve has left the maximizer
/// without room.
constexpr double kLargeMultiplier = 1e6;
/// Growth of |v| by a Newton step, as a share of 1 + |v|, that counts as a run to infinity when
/// that many steps in a row pass through first-order points, each of them at least that share of
/// the one before: towards a zero of order p they shrink by (p - 1)/p.
constexpr double kOutwardStep = 5e-4;
constexpr int kOutwardSteps = 3;
constexpr double kOutwardShare = 0.95;
/// Unscaled gradient of the Lagrangian above which a degenerate point is not taken for a solution at
/// once where the objective is scaled down, and the iterations that it may take to do better.
constexpr double kFlatGradient = 1e-4;
constexpr Index kHiddenIterations = 50;
/// Iterations allowed after a minimization has left a point whose curvature decides nothing, or as
/// many as that took where it is more.
constexpr Index kFewestAfterEscape = 20;
/// Second derivatives below this, that many times farther out than the start, have died out.
constexpr double kDiedOut = 1e-100;
constexpr double kFarAway = 10.0;

/// What is NaN or infinite in a result, empty: nothing.
std::string_view not_finite_part(const Result& result) {
  const auto finite = [](const std::vector<double>& values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  };
  if (!finite(result.v)) return "a variable";
  if (!std::isfinite(result.objective)) return "the objective";
  if (!finite(result.constraints)) return "a constraint";
  if (!finite(result.lambda)) return "a multiplier of a constraint";
  if (!finite(result.z_lower) || !finite(result.z_upper)) return "a multiplier of a bound";
  const KktError& e = result.error;
  if (!finite({e.primal, e.dual_min, e.dual_max, e.complementarity, e.total})) return "an error";
  return {};
}

/// Whether a search that ended so may do better from another starting point.
bool search_failed(Status status) {
  switch (status) {
    case Status::NotLocalMinmax:
    case Status::NoLocalMinmaxFound:
    case Status::InnerUnbounded:
    case Status::OuterUnbounded:
    case Status::DivergingIterates:
    case Status::LocallyInfeasible:
    case Status::InnerInfeasible:
    case Status::TinyStep:
    case Status::RestorationFailed:
    case Status::InertiaCorrectionFailed:
    case Status::LinearSolverFailed:
    case Status::EvaluationFailed:
    case Status::InvalidNumber:
      return true;
    default:
      return false;
  }
}

class Solver {
 public:
  /// kept: of the last solve, replaced by that of this one. Null: nothing is kept.
  Solver(Problem& problem, const SolverOptions& options, const SolveObserver& observer, bool nested,
         KeptWork* kept)
      : problem_(problem),
        options_(options),
        nested_(nested),
        kept_(kept),
        observer_(observer),
        limit_(options),
        canonical_(problem, options, result_.counts, result_.timing) {}

  Result run();

 private:
  void match_kept_work();
  void keep_work(Status status);
  [[nodiscard]] std::optional<Status> start();
  [[nodiscard]] std::optional<Status> contradiction();
  [[nodiscard]] std::optional<Status> evaluate_start(const SolverOptions& options);
  [[nodiscard]] bool start_elsewhere(Status failed);
  [[nodiscard]] bool begin_elsewhere();
  struct Stop;
  [[nodiscard]] Stop stop_here(Status status) const;
  void report(const Stop& stop);
  void start_method(bool repeated);
  [[nodiscard]] bool tell_restoration(const IterationInfo& nested, const Eigen::VectorXd& v,
                                      const Eigen::VectorXd& c);
  void describe(const Point& point, Result& result);
  void set_totals(Result& result) const;
  [[nodiscard]] std::optional<Status> iterate();
  [[nodiscard]] std::optional<Status> evaluate_derivatives();
  [[nodiscard]] std::optional<Status> stop_reason();
  [[nodiscard]] bool hidden_by_scaling(Status stop);
  [[nodiscard]] bool leave_wrong_point(Status stop);
  void return_to_fast_factorizations();
  [[nodiscard]] Status certified_status(Status when_not_refuted);
  [[nodiscard]] bool converged(const KktError& error) const;
  [[nodiscard]] bool out_of_iterations() const {
    return info_.iteration + result_.counts.restoration_iterations >= options_.max_iter;
  }
  [[nodiscard]] bool runs_to_infinity();
  [[nodiscard]] bool is_acceptable(const KktError& error) const;
  [[nodiscard]] bool stays_acceptable(const KktError& error);
  void drop_idle_multipliers(double tolerance);
  [[nodiscard]] Status evaluation_failure(EvaluationStatus status, std::string_view where);
  void update_error();
  void update_barrier();
  [[nodiscard]] std::optional<double> ask_oracle();
  void say(std::string_view text) {
    if (!observer_.message) return;
    inside_observer_ = true;
    observer_.message(text);
    inside_observer_ = false;
  }
  [[nodiscard]] bool tell(const IterationInfo& info) {
    inside_observer_ = true;
    const bool goes_on = observer_.on_iteration(info);
    inside_observer_ = false;
    return goes_on;
  }
  [[nodiscard]] bool has_run_away(IndexRange variables) const;
  [[nodiscard]] Status name_divergence(Status status);
  Result finish(Status status);
  Result finish_without_memory();

  Problem& problem_;
  const SolverOptions& options_;
  bool nested_;  ///< feasibility restoration of another solve
  KeptWork* kept_;
  const SolveObserver& observer_;
  Result result_;
  TimeLimit limit_;
  CanonicalProblem canonical_;
  std::optional<KktSystem> kkt_;
  std::optional<InertiaCorrection> correction_;
  std::optional<GlobalizedMethod> method_;  ///< empty for Algorithm 1
  std::optional<AlgorithmOne> algorithm_one_;
  std::optional<AdaptiveBarrier> adaptive_;  ///< empty for mu_strategy monotone

  Point point_;
  NewtonResidual rhs_;
  Step step_;
  Step affine_;  ///< of the quality function
  OracleWork oracle_work_;
  IterationInfo info_;
  double mu_final_ = 0.0;
  double last_objective_ = 0.0;
  Index acceptable_count_ = 0;
  /// Factorizations told to the observer.
  Index reported_full_ = 0, reported_inner_ = 0, reported_complement_ = 0;
  /// Where a search stopped that went on elsewhere.
  struct Stop {
    Status status;
    std::string message;
    Point point;
    Certificate certificate;
    IterationInfo info;
  };
  std::optional<WrongCurvature> wrong_;   ///< that refuted the last point tested
  std::optional<Stop> degenerate_point_;  ///< undecided second-order test, left for a better point
  std::optional<Stop> first_failure_;     ///< of the search from the model's starting point
  Index restarts_ = 0;
  std::optional<Index> last_resort_end_;  ///< iteration at which Algorithm 1 gives up, too
  std::optional<Index> search_end_;       ///< for a better point than the degenerate one
  Index runaway_iterations_ = 0;          ///< in a row
  Index hidden_iterations_ = 0;   ///< beyond points that meet the tolerances by their scaling
  bool inside_observer_ = false;  ///< an exception on its way is the caller's
  bool analyzed_ = false;
  bool started_ = false;
  bool escaped_ = false;  ///< the iteration's step was an escape from a wrong first-order point
};

Result Solver::run() {
  if (auto error = check(options_); !error.empty()) {
    result_.message = error;
    return finish(Status::InvalidOption);
  }
  try {
    match_kept_work();
    if (auto error = canonical_.build(kept_ ? kept_->scaling : std::nullopt); !error.empty()) {
      result_.message = error;
      return finish(canonical_.error_status());
    }
    if (options_.mu_strategy == BarrierStrategy::Adaptive && canonical_.max_size() > 0 &&
        options_.adaptive_mu_globalization == AdaptiveGlobalization::ObjectiveFilter) {
      result_.message =
          "adaptive_mu_globalization = obj-constr-filter is not available with Max variables, for "
          "whom the objective may rise; kkt-error is";
      return finish(Status::InvalidOption);
    }
    if (auto status = start()) return finish(*status);
    if (auto status = contradiction()) return finish(*status);
    for (;; ++info_.iteration) {
      auto status = stop_reason();
      if (!status) status = iterate();
      if (!status) continue;
      const Status named = name_divergence(*status);
      if (!start_elsewhere(named)) return finish(named);
    }
  } catch (const FactorsOutOfMemory& error) {
    result_.message = error.what();
    return finish(Status::OutOfMemory);
  } catch (const std::bad_alloc&) {
    if (nested_) throw;  // the whole solve is out of memory, not its restoration
    return finish_without_memory();
  } catch (const std::length_error&) {  // more than an array can hold
    if (canonical_.inside_model() || inside_observer_) throw;
    return finish_without_memory();
  } catch (const SolverUnavailable& error) {
    if (nested_) throw;
    result_.message = error.what();
    first_failure_.reset();  // this is why nothing better was found
    return finish(analyzed_ ? Status::LinearSolverFailed : Status::InvalidOption);
  }
}

Result Solver::finish_without_memory() {
  started_ = false;  // whatever was under way is half done
  result_.certificate = {};
  result_.message = "out of memory";
  return finish(Status::OutOfMemory);
}

void Solver::match_kept_work() {
  if (!kept_) return;
  const ProblemStructure& s = problem_.structure();
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  if (s.variable_lower.size() != n || s.variable_upper.size() != n ||
      s.constraint_lower.size() != m || s.constraint_upper.size() != m) {
    if (kept_->structure_only)
      kept_ = nullptr;
    else
      *kept_ = {};  // a bad model
    return;
  }
  ModelShape shape = shape_of(s, options_);
  if (kept_->structure_only) {
    if (!kept_->analysis)
      kept_->shape = std::move(shape);
    else if (kept_->shape != shape)
      kept_ = nullptr;
  } else if (kept_->shape != shape) {
    *kept_ = {};
    kept_->shape = std::move(shape);
  }
}

void Solver::keep_work(Status status) {
  if (!kept_ || kept_->structure_only) return;
  if (!analyzed_ || status == Status::OutOfMemory) {
    *kept_ = {};
    return;
  }
  kept_->scaling = canonical_.gradient_scaling();
  kept_->analysis = kkt_->analysis();
  kept_->shifts = is_success(status) ? correction_->memory() : ShiftMemory{};
}

std::optional<Status> Solver::start() {
  kkt_.emplace(canonical_, options_, result_.counts, result_.timing);
  correction_.emplace(*kkt_, options_, result_.counts, &limit_);
  const Index n = canonical_.variables();
  const Index m = canonical_.constraints();
  rhs_ = step_ = affine_ = zero_step(canonical_);
  point_.evaluation.c.setZero(m);
  point_.evaluation.gradient.setZero(n);
  point_.evaluation.jacobian.assign(canonical_.jacobian().size(), 0.0);
  point_.evaluation.hessian.assign(canonical_.hessian().size(), 0.0);

  if (!kkt_->analyze(kept_ ? kept_->analysis : std::nullopt)) {
    result_.message = "out of memory in the analysis of the KKT matrix";
    return Status::OutOfMemory;
  }
  analyzed_ = true;
  // Before any factorization, so that every search begins with the same solvers in the same places.
  if (kept_ && kept_->structure_only && !kept_->analysis) kept_->analysis = kkt_->analysis();
  if (kept_ && options_.minmax_warm_start_shifts) correction_->remember(kept_->shifts);
  point_.iterate = canonical_.starting_point();
  if (auto status = evaluate_start(options_)) return status;
  started_ = true;
  info_.mu = options_.mu_init;
  mu_final_ = final_barrier(options_, canonical_.objective_scale());
  info_.mu = std::max(info_.mu, mu_final_);
  update_error();
  const Complementarity products = complementarity_of(canonical_, point_.iterate);
  if (options_.mu_strategy == BarrierStrategy::Adaptive && products.bounds > 0) {
    adaptive_.emplace(options_, mu_final_,
                      least_adaptive_barrier(options_, canonical_.objective_scale()),
                      products.average);
  }
  if (options_.minmax_globalization == Globalization::Filter && !options_.minmax_pure_newton) {
    start_method(false);
  } else {
    algorithm_one_.emplace(canonical_, *kkt_, *correction_, options_, result_.counts);
    if (options_.minmax_freeze_tol > 0.0) {
      say("minmax_freeze_tol > 0: shifts that are kept depend on where the iterates came from, so "
          "points that are no local minmax may attract them; the certificate tells");
    }
  }
  return std::nullopt;
}

std::optional<Status> Solver::contradiction() {
  const auto row = nested_ ? std::nullopt : canonical_.violated_constant_constraint();
  if (!row) return std::nullopt;
  const bool max =
      problem_.structure().constraint_players[static_cast<std::size_t>(*row)] == Player::Max;
  result_.message = canonical_.constraint_name(*row) + " has no free variable and is violated";
  return max ? Status::InnerInfeasible : Status::LocallyInfeasible;
}

void Solver::start_method(bool repeated) {
  method_.emplace(canonical_, *kkt_, *correction_, options_, limit_, result_.counts, !nested_,
                  repeated);
  method_->start(point_);
  if (observer_.on_iteration && !nested_) {
    method_->observe_restorations([this](const auto& nested, const auto& v, const auto& c) {
      return tell_restoration(nested, v, c);
    });
  }
}

std::optional<Status> Solver::evaluate_start(const SolverOptions& options) {
  const std::string_view where = "at the starting point";
  auto status = canonical_.values(point_.iterate.v, point_.evaluation.f, point_.evaluation.c);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, where);
  canonical_.start_slacks(point_.iterate, point_.evaluation.c);
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (const Index s = canonical_.slack_of_constraint()[static_cast<std::size_t>(j)]; s >= 0) {
      point_.evaluation.c[j] -= point_.iterate.v[s];
    }
  }
  start_bound_multipliers(canonical_, options, point_.iterate);
  canonical_.keep_distances(point_.iterate, options.mu_init);
  status = canonical_.first_derivatives(point_.iterate.v, point_.evaluation);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, where);

  if (!options.warm_start_init_point && canonical_.constraints() > 0 &&
      options.constr_mult_init_max > 0.0) {
    // Least-squares multipliers, dropped when large: Waechter and Biegler 2006, section 3.6.
    const bool ok =
        kkt_->least_squares_multipliers(point_.iterate, point_.evaluation, point_.iterate.lambda);
    if (!ok || point_.iterate.lambda.lpNorm<Eigen::Infinity>() > options.constr_mult_init_max) {
      start_constraint_multipliers(canonical_, options, point_.iterate);
    }
  } else if (!options.warm_start_init_point) {
    start_constraint_multipliers(canonical_, options, point_.iterate);
  }
  if (!options.warm_start_init_point) start_robust_multipliers(canonical_, point_.iterate);
  status =
      canonical_.second_derivatives(point_.iterate.v, point_.iterate.lambda, point_.evaluation);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, where);
  return std::nullopt;
}

bool Solver::start_elsewhere(Status failed) {
  if (!method_ || nested_ || canonical_.max_size() == 0 || degenerate_point_ ||
      options_.minmax_max_restarts == 0 || !search_failed(failed) || out_of_iterations()) {
    return false;
  }
  Stop stop = stop_here(failed);
  if (!begin_elsewhere()) {
    report(stop);
    return false;
  }
  if (!first_failure_) first_failure_ = std::move(stop);
  say("no local minmax found from here; " + (last_resort_end_
                                                 ? "Algorithm 1 from the first point"
                                                 : "new start " + std::to_string(restarts_)));

  result_.certificate = {};
  result_.message.clear();
  acceptable_count_ = 0;
  escaped_ = false;
  const Index iteration = info_.iteration;
  info_ = {};
  info_.iteration = iteration;
  info_.mu = std::max(options_.mu_init, mu_final_);
  info_.step_kind = 'w';
  update_error();
  if (adaptive_) adaptive_->reset();
  return true;
}

bool Solver::begin_elsewhere() {
  SolverOptions cold = options_;
  cold.warm_start_init_point = false;
  const Index variables = canonical_.x().size() + canonical_.y().size();
  correction_->remember({});  // the shifts of the failed search
  kkt_->reset_quality();
  while (restarts_ < options_.minmax_max_restarts &&
         info_.iteration < restart_iterations(variables)) {
    point_.iterate = restart_point(canonical_, canonical_.starting_point(), ++restarts_);
    if (evaluate_start(cold)) continue;
    start_method(true);
    return true;
  }
  const Index iterations = last_resort_iterations(canonical_);
  point_.iterate = canonical_.starting_point();
  if (iterations == 0 || evaluate_start(options_)) return false;
  last_resort_end_ = info_.iteration + iterations;
  method_.reset();
  algorithm_one_.emplace(canonical_, *kkt_, *correction_, options_, result_.counts);
  return true;
}

Solver::Stop Solver::stop_here(Status status) const {
  return {status, result_.message, point_, result_.certificate, info_};
}

void Solver::report(const Stop& stop) {
  result_.message = stop.message;
  result_.certificate = stop.certificate;
  point_ = stop.point;
  const Index iterations = info_.iteration;
  info_ = stop.info;
  info_.iteration = iterations;
}

std::optional<Status> Solver::stop_reason() {
  if (observer_.on_iteration) {
    info_.v = canonical_.model_point(point_.iterate.v);
    const Counts& counts = result_.counts;
    info_.factorizations_full = counts.factorizations_full - reported_full_;
    info_.factorizations_inner = counts.factorizations_inner - reported_inner_;
    info_.factorizations_complement = counts.factorizations_complement - reported_complement_;
    reported_full_ = counts.factorizations_full;
    reported_inner_ = counts.factorizations_inner;
    reported_complement_ = counts.factorizations_complement;
    info_.result = [this] {
      Result result;
      result.status = Status::UserStop;
      result.message = std::string(name_of(result.status));
      describe(point_, result);
      return result;
    };
    if (!tell(info_)) return Status::UserStop;
  }
  drop_idle_multipliers(options_.tol);
  std::optional<Status> stop;
  if (converged(info_.error)) {
    stop = certified_status(Status::Solved);
  } else if (stays_acceptable(info_.error)) {
    stop = certified_status(Status::SolvedToAcceptableLevel);
  }
  if (stop && !hidden_by_scaling(*stop) && !leave_wrong_point(*stop)) return stop;
  if (canonical_.variables() > 0 &&
      point_.iterate.v.lpNorm<Eigen::Infinity>() > options_.diverging_iterates_tol) {
    return Status::DivergingIterates;
  }
  if (out_of_iterations()) return Status::MaxIterations;
  const bool far = canonical_.max_size() == 0 && has_run_away({0, canonical_.variables()});
  runaway_iterations_ = far ? runaway_iterations_ + 1 : 0;
  if (runaway_iterations_ > kRunawayIterations) return Status::OuterUnbounded;
  if (limit_.expired()) return limit_.exceeded();
  return std::nullopt;
}

bool Solver::tell_restoration(const IterationInfo& nested, const Eigen::VectorXd& v,
                              const Eigen::VectorXd& c) {
  IterationInfo info = nested;
  info.restoration = true;
  info.iteration = info_.iteration + 1;
  info.factorizations_full = info.factorizations_inner = 0;
  double f = std::numeric_limits<double>::quiet_NaN();
  if (canonical_.objective(v, f) != EvaluationStatus::Ok) {
    f = std::numeric_limits<double>::quiet_NaN();
  }
  info.objective = canonical_.unscaled_objective(f);
  info.error.primal = 0.0;
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    info.error.primal =
        std::max(info.error.primal, std::abs(c[j]) / canonical_.constraint_scale(j));
  }
  info.v = canonical_.model_point(v);
  info.result = [&] {
    Point here = point_;
    here.iterate.v = v;
    evaluate_where_defined(canonical_, here);
    Result result;
    result.status = Status::UserStop;
    result.message = std::string(name_of(result.status));
    describe(here, result);
    return result;
  };
  return tell(info);
}

bool Solver::converged(const KktError& error) const {
  return error.total <= options_.tol &&
         std::max(error.dual_min, error.dual_max) <= options_.dual_inf_tol &&
         error.primal <= options_.constr_viol_tol &&
         error.complementarity <= options_.compl_inf_tol;
}

bool Solver::is_acceptable(const KktError& error) const {
  return options_.acceptable_iter > 0 && error.total <= options_.acceptable_tol &&
         std::max(error.dual_min, error.dual_max) <= options_.acceptable_dual_inf_tol &&
         error.primal <= options_.acceptable_constr_viol_tol &&
         error.complementarity <= options_.acceptable_compl_inf_tol;
}

bool Solver::stays_acceptable(const KktError& error) {
  if (options_.acceptable_iter == 0) return false;
  const double f = info_.objective;
  const double change = std::abs(f - last_objective_) / std::max(1.0, std::abs(f));
  const bool is_acceptable =
      Solver::is_acceptable(error) && change <= options_.acceptable_obj_change_tol;
  acceptable_count_ = is_acceptable ? acceptable_count_ + 1 : 0;
  return acceptable_count_ >= options_.acceptable_iter;
}

void Solver::drop_idle_multipliers(double tolerance) {
  // Without a gradient of the objective every feasible point is optimal, with multipliers zero.
  constexpr double kIdle = 1e-3;  // times tol, of the multipliers of bounds: the barrier needs some
  if (canonical_.max_size() > 0 || point_.evaluation.c.size() == 0 ||
      max_norm(point_.evaluation.gradient) > 0.0 || max_norm(point_.evaluation.c) > tolerance ||
      max_norm(point_.iterate.lambda) == 0.0) {
    return;
  }
  Iterate& iterate = point_.iterate;
  iterate.lambda.setZero();
  iterate.z_lower = iterate.z_lower.cwiseMin(kIdle * options_.tol);
  iterate.z_upper = iterate.z_upper.cwiseMin(kIdle * options_.tol);
  static_cast<void>(canonical_.second_derivatives(iterate.v, iterate.lambda, point_.evaluation));
  update_error();
}

Status Solver::certified_status(Status when_not_refuted) {
  // The oracle's mu may be far above the complementarity that was reached.
  if (adaptive_) info_.mu = std::min(info_.mu, mu_final_);
  Finding finding = certify(canonical_, *kkt_, point_, info_.mu, options_);
  result_.certificate = finding.certificate;
  wrong_ = std::move(finding.wrong);
  if (finding.point && result_.certificate.second_order == SecondOrder::Satisfied) {
    point_ = std::move(*finding.point);
    info_.mu = finding.mu;
    update_error();
  }
  switch (result_.certificate.second_order) {
    case SecondOrder::Violated:
      return Status::NotLocalMinmax;
    case SecondOrder::Undecided:
      if (nested_) return when_not_refuted;
      if (runs_to_infinity()) {
        result_.message = "the iterates run to infinity, where the gradient vanishes";
        return Status::DivergingIterates;
      }
      return when_not_refuted == Status::Solved ? Status::SolvedDegenerate : when_not_refuted;
    default:
      return when_not_refuted;
  }
}

bool Solver::runs_to_infinity() {
  // Newton's method, continued from a first-order point without curvature.
  const auto& hessian = point_.evaluation.hessian;
  const bool died_out =
      std::ranges::all_of(hessian, [](double value) { return std::abs(value) < kDiedOut; });
  if (!hessian.empty() && died_out &&
      max_norm(point_.iterate.v) > kFarAway * (1.0 + max_norm(canonical_.starting_point().v))) {
    return true;
  }
  Point here = point_;
  bool outward = true;
  double last_growth = 0.0;
  for (int k = 0; k < kOutwardSteps && outward; ++k) {
    const double norm = max_norm(point_.iterate.v);
    newton_residual(canonical_, point_.iterate, point_.evaluation, point_.dual, info_.mu, rhs_);
    kkt_->assemble(point_.iterate, point_.evaluation);
    outward = kkt_->factorize({}).status == FactorizationStatus::Ok &&
              kkt_->solve(point_.evaluation, rhs_, step_);
    if (!outward) break;
    advance(step_,
            largest_step(canonical_, point_.iterate, step_, boundary_fraction(info_.mu, options_)),
            point_.iterate);
    const double growth = max_norm(point_.iterate.v) - norm;
    outward = growth > std::max(kOutwardStep * (1.0 + norm), kOutwardShare * last_growth) &&
              canonical_.values(point_.iterate.v, point_.evaluation.f, point_.evaluation.c) ==
                  EvaluationStatus::Ok &&
              !evaluate_derivatives();
    if (!outward) break;
    dual_residual(canonical_, point_.iterate, point_.evaluation, point_.dual);
    outward = converged(kkt_error(canonical_, point_.iterate, point_.evaluation, point_.dual,
                                  options_.s_max, options_.mu_target));
    last_growth = growth;
  }
  point_ = std::move(here);
  result_.message.clear();
  return outward;
}

bool Solver::hidden_by_scaling(Status stop) {
  // A gradient that was huge at the start scales the objective down so far that any flat place meets
  // the tolerances: go on for a while. Minimizations end here, as Ipopt's do.
  const double gradient = std::max(info_.error.dual_min, info_.error.dual_max);
  if (stop != Status::SolvedDegenerate || nested_ || canonical_.max_size() == 0 ||
      canonical_.objective_scale() >= 1.0 || gradient <= kFlatGradient ||
      ++hidden_iterations_ > kHiddenIterations) {
    return false;
  }
  result_.certificate = {};
  return_to_fast_factorizations();
  return true;
}

/// Whether K_yy has a wrong sign, although no direction was found that proves it.
bool seems_wrong(const Certificate& found) {
  return found.inner.positive > found.inner_expected.positive;
}

bool Solver::leave_wrong_point(Status stop) {
  if (!method_ || out_of_iterations()) return false;
  // A degenerate point is left only when the inner maximum is clear or clearly none, and kept for the
  // case that nothing better comes.
  const Certificate& found = result_.certificate;
  const bool degenerate = stop == Status::SolvedDegenerate && !degenerate_point_ &&
                          (found.inner == found.inner_expected || seems_wrong(found));
  if (stop != Status::NotLocalMinmax && !degenerate) return false;
  Stop here = stop_here(stop);
  const bool clear = degenerate && canonical_.max_size() == 0;
  if (!method_->escape(point_, info_.mu, clear, info_, wrong_)) {
    report(here);
    return false;
  }
  if (degenerate) {
    degenerate_point_ = std::move(here);
    if (canonical_.max_size() == 0) {
      search_end_ = info_.iteration + std::max(kFewestAfterEscape, info_.iteration);
    }
  }
  result_.certificate = {};
  acceptable_count_ = 0;
  return_to_fast_factorizations();
  update_error();
  if (adaptive_) adaptive_->reset();
  escaped_ = true;
  return true;
}

void Solver::return_to_fast_factorizations() {
  // The test of a point that was not certified has gone over to pivoting.
  kkt_->reset_quality();
  if (method_) method_->factors_lost();
}

std::optional<Status> Solver::iterate() {
  if (std::exchange(escaped_, false)) return std::nullopt;
  if (last_resort_end_ && info_.iteration >= *last_resort_end_) return Status::NoLocalMinmaxFound;
  if (search_end_ && info_.iteration >= *search_end_) return Status::TinyStep;
  last_objective_ = info_.objective;
  // Algorithm 1 decreases b after a step, so not before the first.
  if (options_.minmax_barrier_rule != BarrierRule::Paper || info_.iteration > 0) update_barrier();
  info_.shifts = {};
  const auto status = method_ ? method_->step(point_, info_.mu, info_)
                              : algorithm_one_->step(point_, info_.mu, info_);
  canonical_.keep_distances(point_.iterate, info_.mu);
  update_error();                     // a step that fails may have moved the point, too
  if (status && limit_.exceeded()) {  // whatever failed was cut short
    result_.message.clear();
    return limit_.exceeded();
  }
  if (status) result_.message = method_ ? method_->message() : algorithm_one_->message();
  // As in Ipopt: where no better point can be reached, the acceptable tolerances are enough.
  const bool stuck = status == Status::TinyStep || status == Status::RestorationFailed;
  if (stuck) drop_idle_multipliers(options_.acceptable_tol);
  if (stuck && canonical_.max_size() == 0 && !nested_ && is_acceptable(info_.error)) {
    result_.message.clear();
    return certified_status(Status::SolvedToAcceptableLevel);
  }
  return status;
}

void Solver::update_barrier() {
  const auto error = [&](double mu) {
    return barrier_error(canonical_, point_.iterate, point_.evaluation, point_.dual, mu,
                         options_.s_max);
  };
  const double last_mu = info_.mu;
  const auto monotone = [&](double from) {
    return next_barrier(
        from, mu_final_, [&](double mu) { return error(mu).scaled; },
        [&](double mu) { return error(mu).norm(); }, options_);
  };
  if (adaptive_) {
    BarrierState now;
    now.residual =
        squared_residual(canonical_, point_.iterate, point_.evaluation, point_.dual).total();
    now.merit = {point_.evaluation.c.lpNorm<1>(), point_.evaluation.f};
    now.average = complementarity_of(canonical_, point_.iterate).average;
    now.barrier_error = error(last_mu).scaled;
    now.step_accepted = info_.step_kind != 'l' && info_.step_kind != 'R';
    info_.mu = adaptive_->next(
        last_mu, now, [&] { return ask_oracle(); }, monotone);
  } else {
    info_.mu = monotone(last_mu);
  }
  if (method_ && info_.mu != last_mu) method_->barrier_changed();
}

std::optional<double> Solver::ask_oracle() {
  const Complementarity products = complementarity_of(canonical_, point_.iterate);
  if (options_.mu_oracle == BarrierOracle::Loqo) return loqo_barrier(products);

  // The Newton step to mu = 0, with shifts of its own: the step's memory of shifts stays as it is.
  InertiaCorrection correction = *correction_;
  newton_residual(canonical_, point_.iterate, point_.evaluation, point_.dual, 0.0, rhs_);
  kkt_->assemble(point_.iterate, point_.evaluation);
  if (!correction.correct(info_.mu) || !kkt_->solve(point_.evaluation, rhs_, step_)) {
    return std::nullopt;
  }
  if (options_.mu_oracle == BarrierOracle::Probing) {
    return probing_barrier(canonical_, point_.iterate, step_, oracle_work_);
  }
  affine_ = step_;
  const double average = products.average;
  set_zero(rhs_);
  rhs_.v = -average * canonical_.damping();
  for (const Index i : canonical_.lower_bounded()) rhs_.z_lower[i] = average;
  for (const Index i : canonical_.upper_bounded()) rhs_.z_upper[i] = average;
  if (!kkt_->solve(point_.evaluation, rhs_, step_)) return std::nullopt;
  return quality_function_barrier(
      canonical_, point_.iterate,
      squared_residual(canonical_, point_.iterate, point_.evaluation, point_.dual), affine_, step_,
      options_.tau_min, oracle_work_);
}

std::optional<Status> Solver::evaluate_derivatives() {
  const auto status =
      canonical_.derivatives(point_.iterate.v, point_.iterate.lambda, point_.evaluation);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, "at an iterate");
  return std::nullopt;
}

void Solver::update_error() {
  dual_residual(canonical_, point_.iterate, point_.evaluation, point_.dual);
  info_.error = kkt_error(canonical_, point_.iterate, point_.evaluation, point_.dual,
                          options_.s_max, options_.mu_target);
  info_.barrier_error = barrier_error(canonical_, point_.iterate, point_.evaluation, point_.dual,
                                      info_.mu, options_.s_max)
                            .norm();
  info_.objective = canonical_.unscaled_objective(point_.evaluation.f);
}

Status Solver::evaluation_failure(EvaluationStatus status, std::string_view where) {
  result_.message = canonical_.evaluation_error() + " " + std::string(where);
  return status == EvaluationStatus::NotFinite ? Status::InvalidNumber : Status::EvaluationFailed;
}

bool Solver::has_run_away(IndexRange variables) const {
  const double start = std::max(1.0, max_norm(canonical_.starting_point().v));
  for (Index i = variables.begin; i < variables.end; ++i) {
    double reference = start;
    for (const double bound : {canonical_.lower()[i], canonical_.upper()[i]}) {
      if (std::isfinite(bound)) reference = std::max(reference, std::abs(bound));
    }
    if (std::abs(point_.iterate.v[i]) >= kRunaway * reference) return true;
  }
  return false;
}

Status Solver::name_divergence(Status status) {
  // Numbers that stopped a method whose iterates had run away say little; the running away does.
  const bool stopped = status == Status::InertiaCorrectionFailed ||
                       status == Status::EvaluationFailed || status == Status::LinearSolverFailed ||
                       status == Status::TinyStep || status == Status::MaxIterations ||
                       status == Status::RestorationFailed || status == Status::OuterUnbounded;
  if (!started_ || !stopped) return status;
  const IndexRange max_constraints = canonical_.max_constraints();
  const bool max_runs = has_run_away({canonical_.y().begin, canonical_.variables()});
  if (!max_runs && !has_run_away({0, canonical_.y().begin})) {
    const auto multipliers =
        point_.iterate.lambda.segment(max_constraints.begin, max_constraints.size());
    if (max_constraints.size() > 0 && multipliers.lpNorm<Eigen::Infinity>() > kLargeMultiplier) {
      result_.message =
          "the minimizer leaves the maximizer no feasible point: "
          "the multipliers of the Max constraints grow without bound";
      return Status::InnerInfeasible;
    }
    return status;
  }
  result_.message = max_runs ? "the maximization over the Max variables looks unbounded"
                             : "the minimization looks unbounded";
  return max_runs ? Status::InnerUnbounded : Status::OuterUnbounded;
}

Result Solver::finish(Status status) {
  if (degenerate_point_ && !is_success(status) && status != Status::UserStop) {
    status = degenerate_point_->status;
    report(*degenerate_point_);
  } else if (first_failure_ && search_failed(status)) {
    status = first_failure_->status;
    report(*first_failure_);
    if (result_.message.empty()) result_.message = std::string(name_of(status));
    result_.message += " (nor from " + std::to_string(restarts_) + " other starting points)";
  }
  if (started_) {
    describe(point_, result_);
    const std::string_view what = not_finite_part(result_);
    if (is_success(status) && !what.empty()) {
      status = Status::InvalidNumber;
      result_.message = std::string(what) + " is NaN or infinite at the last point";
      result_.certificate = {};
      describe(point_, result_);
    }
  } else {
    set_totals(result_);
  }
  keep_work(status);
  result_.status = status;
  if (result_.message.empty()) result_.message = std::string(name_of(status));
  return std::move(result_);
}

void Solver::describe(const Point& point, Result& result) {
  canonical_.restore(point.iterate, result);
  result.error = kkt_error(canonical_, point.iterate, point.evaluation, point.dual, options_.s_max,
                           options_.mu_target);
  const double violation = canonical_.violation(result);
  result.error.primal =
      options_.honor_original_bounds ? violation : largest(result.error.primal, violation);
  result.mu = info_.mu;
  result.objective_scale = canonical_.objective_scale();
  result.iterations = info_.iteration;
  if (result.certificate.second_order == SecondOrder::NotTested) {
    const double primal = result.error.primal;
    result.certificate.kind = std::isnan(primal)                   ? PointKind::Unknown
                              : primal <= options_.constr_viol_tol ? PointKind::FeasiblePoint
                                                                   : PointKind::InfeasiblePoint;
  }
  set_totals(result);
}

void Solver::set_totals(Result& result) const {
  result.counts = result_.counts;
  result.timing = result_.timing;
  result.factorizations = result.counts.factorizations_full + result.counts.factorizations_inner;
  result.seconds = limit_.stopwatch().wall();
  result.cpu_seconds = limit_.stopwatch().cpu();
  result.timing.total = result.seconds;
}

}  // namespace

namespace {

bool stopped_from_outside(Status status) {
  return status == Status::UserStop || status == Status::MaxCpuTime ||
         status == Status::MaxWallTime || status == Status::OutOfMemory;
}

/// With second derivatives from differences. Where the pattern turns out to have missed entries at
/// the end of a solve, it grows and the solve starts anew.
Result solve_with_differences(Problem& problem, const SolverOptions& options,
                              const SolveObserver& observer, KeptWork* kept) {
  constexpr int kRestarts = 5;
  const Stopwatch stopwatch;
  const auto say = [&](const std::string& text) {
    if (observer.message) observer.message(text);
  };
  Result result;
  try {
    FiniteDifferenceHessian model(
        problem, options, kept && kept->hessian_pattern ? &*kept->hessian_pattern : nullptr);
    SolverOptions limits = options;
    for (int restarts = 0;; ++restarts) {
      say("Second derivatives from finite differences: " +
          std::to_string(model.structure().hessian.size()) + " entries by " +
          std::to_string(model.groups()) + " groups of variables.");
      const double least = std::numeric_limits<double>::min();
      limits.max_wall_time = std::max(options.max_wall_time - stopwatch.wall(), least);
      limits.max_cpu_time = std::max(options.max_cpu_time - stopwatch.cpu(), least);
      result = Solver(model, limits, observer, false, kept).run();
      if (restarts == kRestarts || stopped_from_outside(result.status)) break;
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
  } catch (const std::bad_alloc&) {
    result = {};
    result.status = Status::OutOfMemory;
    result.message = "out of memory";
  }
  result.seconds = result.timing.total = stopwatch.wall();
  result.cpu_seconds = stopwatch.cpu();
  return result;
}

Result without_memory() {
  Result result;
  result.status = Status::OutOfMemory;
  result.message = "out of memory";
  return result;
}

Result solve_once(Problem& problem, const SolverOptions& options, const SolveObserver& observer,
                  KeptWork* kept) {
  const bool has_hessian = problem.structure().has_hessian;
  const auto approximation = options.hessian_approximation;
  if (check(options).empty()) {
    if (approximation == HessianApproximation::Exact && !has_hessian) {
      Result result;
      result.status = Status::InvalidOption;
      result.message =
          "hessian_approximation = exact needs second derivatives, and the model has none; "
          "finite-difference-values takes differences of first derivatives";
      return result;
    }
    if (approximation == HessianApproximation::FiniteDifferenceValues ||
        approximation == HessianApproximation::LimitedMemory || !has_hessian) {
      return solve_with_differences(problem, options, observer, kept);
    }
  }
  return Solver(problem, options, observer, false, kept).run();
}

/// Also where the solver itself, or its answer, found no memory.
Result solve_keeping(Problem& problem, const SolverOptions& options, const SolveObserver& observer,
                     KeptWork* kept) {
  try {
    return solve_once(problem, options, observer, kept);
  } catch (const std::bad_alloc&) {
    if (kept) *kept = {};
    return without_memory();
  }
}

}  // namespace

Result solve(Problem& problem, const SolverOptions& options, const SolveObserver& observer) {
  return solve_keeping(problem, options, observer, nullptr);
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
  Result result = solve_keeping(problem, options, observer, kept.get());
  kept_ = std::move(kept);
  return result;
}

void RepeatedSolver::reset() { kept_.reset(); }

SearchStructure::SearchStructure() : kept_(std::make_unique<KeptWork>()) {
  kept_->structure_only = true;
}
SearchStructure::~SearchStructure() = default;
SearchStructure::SearchStructure(SearchStructure&&) noexcept = default;

Counts SearchStructure::detect(Problem& problem, const SolverOptions& options) {
  Counts counts;
  const ProblemStructure& structure = problem.structure();
  if (structure.has_hessian || !check(options).empty() ||
      options.hessian_approximation == HessianApproximation::Exact) {
    return counts;
  }
  FiniteDifferenceHessian model(problem, options);
  kept_->hessian_pattern = model.structure().hessian;
  counts.gradient = model.gradients();
  counts.jacobian = model.jacobians();
  return counts;
}

Result SearchStructure::solve(Problem& problem, const SolverOptions& options,
                              const SolveObserver& observer) {
  try {
    return solve_keeping(problem, options, observer, kept_.get());
  } catch (...) {  // the solvers may be in any state
    kept_->analysis.reset();
    throw;
  }
}

Result solve_nested(Problem& problem, const SolverOptions& options, const SolveObserver& observer) {
  return Solver(problem, options, observer, true, nullptr).run();
}

Result solve(Problem& problem, const SolverOptions& options,
             const IterationCallback& on_iteration) {
  return solve(problem, options, SolveObserver{.on_iteration = on_iteration, .message = {}});
}

}  // namespace ipminmax
