#include <algorithm>
#include <cmath>
#include <ipminmax/core/barrier.hpp>
#include <ipminmax/core/canonical_problem.hpp>
#include <ipminmax/core/certificate.hpp>
#include <ipminmax/core/inertia_correction.hpp>
#include <ipminmax/core/initial_point.hpp>
#include <ipminmax/core/iterate.hpp>
#include <ipminmax/core/kkt_system.hpp>
#include <ipminmax/core/residual.hpp>
#include <ipminmax/core/solver.hpp>
#include <ipminmax/core/step_length.hpp>
#include <ipminmax/core/timer.hpp>
#include <new>
#include <optional>

namespace ipminmax {
namespace {

/// Halvings of a step whose end point the model cannot evaluate.
constexpr int kMaxCuts = 40;

class Solver {
 public:
  Solver(Problem& problem, const SolverOptions& options, const SolveObserver& observer)
      : options_(options),
        observer_(observer),
        canonical_(problem, options, result_.counts, result_.timing) {}

  Result run();

 private:
  [[nodiscard]] std::optional<Status> start();
  [[nodiscard]] std::optional<Status> evaluate_start();
  [[nodiscard]] std::optional<Status> iterate();
  [[nodiscard]] std::optional<Status> compute_step();
  [[nodiscard]] std::optional<Status> take_step();
  [[nodiscard]] std::optional<Status> evaluate_derivatives();
  [[nodiscard]] std::optional<Status> stop_reason();
  [[nodiscard]] Status certified_status(Status when_not_refuted);
  [[nodiscard]] bool converged(const KktError& error) const;
  [[nodiscard]] bool acceptable(const KktError& error);
  [[nodiscard]] Status evaluation_failure(EvaluationStatus status, std::string_view where);
  void update_error();
  void update_barrier();
  void say(std::string_view text) const {
    if (observer_.message) observer_.message(text);
  }
  Result finish(Status status);

  const SolverOptions& options_;
  const SolveObserver& observer_;
  Result result_;
  Stopwatch stopwatch_;
  CanonicalProblem canonical_;
  std::optional<KktSystem> kkt_;
  std::optional<InertiaCorrection> correction_;

  Iterate iterate_, trial_;
  Evaluation evaluation_;
  Eigen::VectorXd trial_c_, dual_;
  NewtonResidual rhs_;
  Step step_;
  Regularization shift_;
  IterationInfo info_;
  double mu_final_ = 0.0;
  double last_objective_ = 0.0;
  Index acceptable_count_ = 0;
  bool started_ = false;
};

Result Solver::run() {
  if (auto error = check(options_); !error.empty()) {
    result_.message = error;
    return finish(Status::InvalidOption);
  }
  try {
    if (auto error = canonical_.build(); !error.empty()) {
      result_.message = error;
      return finish(canonical_.error_status());
    }
    if (auto status = start()) return finish(*status);
    for (;; ++info_.iteration) {
      if (auto status = stop_reason()) return finish(*status);
      if (auto status = iterate()) return finish(*status);
    }
  } catch (const std::bad_alloc&) {
    result_.message = "out of memory";
    return finish(Status::OutOfMemory);
  }
}

std::optional<Status> Solver::start() {
  kkt_.emplace(canonical_, options_, result_.counts, result_.timing);
  correction_.emplace(*kkt_, options_, result_.counts);
  const Index n = canonical_.variables();
  const Index m = canonical_.constraints();
  for (Step* step : {&rhs_, &step_}) {
    step->v.setZero(n);
    step->lambda.setZero(m);
    step->z_lower.setZero(n);
    step->z_upper.setZero(n);
  }
  evaluation_.c.setZero(m);
  evaluation_.gradient.setZero(n);
  evaluation_.jacobian.assign(canonical_.jacobian().size(), 0.0);
  evaluation_.hessian.assign(canonical_.hessian().size(), 0.0);
  trial_c_.setZero(m);

  if (!kkt_->analyze()) {
    result_.message = "out of memory in the analysis of the KKT matrix";
    return Status::OutOfMemory;
  }
  if (auto status = evaluate_start()) return status;
  started_ = true;
  trial_ = iterate_;
  info_.mu = options_.mu_init;
  mu_final_ = final_barrier(options_, canonical_.objective_scale());
  info_.mu = std::max(info_.mu, mu_final_);
  update_error();
  return std::nullopt;
}

std::optional<Status> Solver::evaluate_start() {
  iterate_ = canonical_.starting_point();
  const std::string_view where = "at the starting point";
  auto status = canonical_.objective(iterate_.v, evaluation_.f);
  if (status == EvaluationStatus::Ok) {
    status = canonical_.constraints(iterate_.v, evaluation_.c);
  }
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, where);
  canonical_.start_slacks(iterate_, evaluation_.c);
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (const Index s = canonical_.slack_of_constraint()[static_cast<std::size_t>(j)]; s >= 0) {
      evaluation_.c[j] -= iterate_.v[s];
    }
  }
  start_bound_multipliers(canonical_, options_, iterate_);
  status = canonical_.first_derivatives(iterate_.v, evaluation_);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, where);

  if (!options_.warm_start_init_point && canonical_.constraints() > 0 &&
      options_.constr_mult_init_max > 0.0) {
    // Least-squares multipliers, dropped when large: Waechter and Biegler 2006, section 3.6.
    const bool ok = kkt_->least_squares_multipliers(iterate_, evaluation_, iterate_.lambda);
    if (!ok || iterate_.lambda.lpNorm<Eigen::Infinity>() > options_.constr_mult_init_max) {
      iterate_.lambda.setZero();
    }
  }
  status = canonical_.second_derivatives(iterate_.v, iterate_.lambda, evaluation_);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, where);
  return std::nullopt;
}

std::optional<Status> Solver::stop_reason() {
  if (observer_.on_iteration && !observer_.on_iteration(info_)) return Status::UserStop;
  if (converged(info_.error)) return certified_status(Status::Solved);
  if (acceptable(info_.error)) return certified_status(Status::SolvedToAcceptableLevel);
  if (canonical_.variables() > 0 &&
      iterate_.v.lpNorm<Eigen::Infinity>() > options_.diverging_iterates_tol) {
    return Status::DivergingIterates;
  }
  if (info_.iteration >= options_.max_iter) return Status::MaxIterations;
  if (stopwatch_.cpu() > options_.max_cpu_time) return Status::MaxCpuTime;
  if (stopwatch_.wall() > options_.max_wall_time) return Status::MaxWallTime;
  return std::nullopt;
}

bool Solver::converged(const KktError& error) const {
  return error.total <= options_.tol &&
         std::max(error.dual_min, error.dual_max) <= options_.dual_inf_tol &&
         error.primal <= options_.constr_viol_tol &&
         error.complementarity <= options_.compl_inf_tol;
}

bool Solver::acceptable(const KktError& error) {
  if (options_.acceptable_iter == 0) return false;
  const double f = info_.objective;
  const double change = std::abs(f - last_objective_) / std::max(1.0, std::abs(f));
  const bool is_acceptable =
      error.total <= options_.acceptable_tol &&
      std::max(error.dual_min, error.dual_max) <= options_.acceptable_dual_inf_tol &&
      error.primal <= options_.acceptable_constr_viol_tol &&
      error.complementarity <= options_.acceptable_compl_inf_tol &&
      change <= options_.acceptable_obj_change_tol;
  acceptable_count_ = is_acceptable ? acceptable_count_ + 1 : 0;
  return acceptable_count_ >= options_.acceptable_iter;
}

Status Solver::certified_status(Status when_not_refuted) {
  result_.certificate = certify(canonical_, *kkt_, iterate_, evaluation_, info_.mu, options_);
  switch (result_.certificate.second_order) {
    case SecondOrder::Violated:
      return Status::NotLocalMinmax;
    case SecondOrder::Undecided:
      return when_not_refuted == Status::Solved ? Status::SolvedDegenerate : when_not_refuted;
    default:
      return when_not_refuted;
  }
}

std::optional<Status> Solver::iterate() {
  update_barrier();
  if (auto status = compute_step()) return status;
  if (auto status = take_step()) return status;
  if (auto status = evaluate_derivatives()) return status;
  last_objective_ = info_.objective;
  update_error();
  return std::nullopt;
}

void Solver::update_barrier() {
  const auto error = [&](double mu) {
    return barrier_error(canonical_, iterate_, evaluation_, dual_, mu, options_.s_max);
  };
  info_.mu = next_barrier(
      info_.mu, mu_final_, [&](double mu) { return error(mu).scaled; },
      [&](double mu) { return error(mu).norm(); }, options_);
}

std::optional<Status> Solver::compute_step() {
  newton_residual(canonical_, iterate_, evaluation_, dual_, info_.mu, rhs_);
  kkt_->assemble(iterate_, evaluation_);
  const double residual_norm =
      barrier_error(canonical_, iterate_, evaluation_, dual_, info_.mu, options_.s_max).norm();
  for (;;) {
    const Index raises = result_.counts.instability_raises;
    const bool frozen = options_.minmax_pure_newton || residual_norm <= options_.minmax_freeze_tol;
    bool factorized = false;
    if (frozen) {
      if (options_.minmax_pure_newton) shift_ = {};
      factorized = kkt_->factorize(shift_).status == FactorizationStatus::Ok;
    }
    if (!factorized && !options_.minmax_pure_newton) {
      const auto shift = correction_->correct(info_.mu);
      factorized = shift.has_value();
      if (factorized) shift_ = *shift;
    }
    if (!factorized) {
      result_.message = "no shift of the Hessian gives the KKT matrix the expected inertia";
      return Status::InertiaCorrectionFailed;
    }
    info_.delta_x = shift_.x;
    info_.delta_y = shift_.y;
    info_.step_kind = result_.counts.instability_raises > raises ? 'i'
                      : shift_ == Regularization{}               ? 'n'
                                                                 : 's';
    if (kkt_->solve(evaluation_, rhs_, step_)) return std::nullopt;
    if (!kkt_->increase_quality()) {
      result_.message = "the Newton system cannot be solved accurately";
      return Status::LinearSolverFailed;
    }
  }
}

std::optional<Status> Solver::take_step() {
  const double tau = boundary_fraction(info_.mu, options_);
  StepLength alpha = largest_step(canonical_, iterate_, step_, tau);
  // One step length for everything, as in Algorithm 1.
  alpha.primal = alpha.dual = std::min(alpha.primal, alpha.dual);
  EvaluationStatus status = EvaluationStatus::Ok;
  for (info_.trials = 1; info_.trials <= kMaxCuts; ++info_.trials) {
    trial_ = iterate_;
    advance(step_, alpha, trial_);
    status = canonical_.objective(trial_.v, evaluation_.f);
    if (status == EvaluationStatus::Ok) status = canonical_.constraints(trial_.v, trial_c_);
    if (status == EvaluationStatus::Ok) break;
    alpha.primal = alpha.dual = 0.5 * alpha.primal;
  }
  if (status != EvaluationStatus::Ok) {
    return evaluation_failure(status, "at every point tried along the step");
  }
  info_.alpha_primal = alpha.primal;
  info_.alpha_dual = alpha.dual;
  info_.step_norm = canonical_.variables() > 0 ? step_.v.lpNorm<Eigen::Infinity>() : 0.0;
  std::swap(iterate_, trial_);
  std::swap(evaluation_.c, trial_c_);
  clip_bound_multipliers(canonical_, info_.mu, options_.kappa_sigma, iterate_);
  return std::nullopt;
}

std::optional<Status> Solver::evaluate_derivatives() {
  auto status = canonical_.first_derivatives(iterate_.v, evaluation_);
  if (status == EvaluationStatus::Ok) {
    status = canonical_.second_derivatives(iterate_.v, iterate_.lambda, evaluation_);
  }
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, "at an iterate");
  return std::nullopt;
}

void Solver::update_error() {
  dual_residual(canonical_, iterate_, evaluation_, dual_);
  info_.error = kkt_error(canonical_, iterate_, evaluation_, dual_, options_.s_max);
  info_.objective = canonical_.unscaled_objective(evaluation_.f);
}

Status Solver::evaluation_failure(EvaluationStatus status, std::string_view where) {
  result_.message = canonical_.evaluation_error() + " " + std::string(where);
  return status == EvaluationStatus::NotFinite ? Status::InvalidNumber : Status::EvaluationFailed;
}

Result Solver::finish(Status status) {
  result_.status = status;
  if (started_) {
    canonical_.restore(iterate_, result_);
    result_.error = info_.error;
    result_.mu = info_.mu;
    result_.iterations = info_.iteration;
    if (result_.certificate.second_order == SecondOrder::NotTested) {
      result_.certificate.kind = info_.error.primal <= options_.constr_viol_tol
                                     ? PointKind::FeasiblePoint
                                     : PointKind::InfeasiblePoint;
    }
  }
  if (result_.message.empty()) result_.message = std::string(name_of(status));
  result_.factorizations = result_.counts.factorizations_full + result_.counts.factorizations_inner;
  result_.seconds = stopwatch_.wall();
  result_.cpu_seconds = stopwatch_.cpu();
  result_.timing.total = result_.seconds;
  return std::move(result_);
}

}  // namespace

Result solve(Problem& problem, const SolverOptions& options, const SolveObserver& observer) {
  return Solver(problem, options, observer).run();
}

Result solve(Problem& problem, const SolverOptions& options,
             const IterationCallback& on_iteration) {
  return solve(problem, options, SolveObserver{.on_iteration = on_iteration, .message = {}});
}

}  // namespace ipminmax
