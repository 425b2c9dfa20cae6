#include "core/certificate/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/contraction.hpp"
#include "core/certificate/newton.hpp"
#include "core/certificate/robust_rows.hpp"
#include "core/certificate/second_order.hpp"
#include "core/certificate/units.hpp"
#include "core/certificate/witness.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {
namespace {

/// Newton's method counts as contracting when the second step with the same matrix is at most this
/// fraction of the first (1/4 for x^3 at 0, below it quadratic convergence is near).
constexpr double kContraction = 0.1;
/// A clear point has so many times minmax_curvature_tol.
constexpr double kClear = 100.0;
/// Amplification of a generic right-hand side up to which active gradients are independent.
constexpr double kIndependent = 1e5;
/// Step to the solution, over the size of the point or of the start, that is worth going.
constexpr double kFar = 1e-6;
/// Newton steps towards the solution of a point that is not clear.
constexpr int kRefinements = 4;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

double max_norm(const Eigen::VectorXd& v) {
  return v.size() == 0 ? 0.0 : v.lpNorm<Eigen::Infinity>();
}

class Certifier {
 public:
  Certifier(CanonicalProblem& canonical, KktSystem& kkt, double mu, const SolverOptions& options)
      : canonical_(canonical), kkt_(kkt), options_(options), mu_(mu) {}

  Finding run(const Point& given);

 private:
  [[nodiscard]] bool clearly_right(const Point& point);
  [[nodiscard]] bool newton_confirms(ActiveSetSystem& system, const Point& point,
                                     const KktSolve& solve, NewtonTest& newton) const;
  /// A point on its way to the solution of the active set's equations.
  struct Stage {
    Point point;
    Units units;
    BoundClasses classes;
    NewtonTest newton;
    Eigen::VectorXd error;   ///< of W in units
    bool converges = false;  ///< Newton's method, to a solution with these classes
  };
  [[nodiscard]] SecondOrder examine(const Point& given);
  [[nodiscard]] bool settle(Stage& stage, bool follow);
  [[nodiscard]] bool refine_and_test(Stage& stage);
  [[nodiscard]] SecondOrder judge_without_certificate(Stage& stage);
  [[nodiscard]] std::optional<Player> wrong_player(ActiveSetSystem& system, const Stage& stage);
  [[nodiscard]] bool next_point(const NewtonTest& newton, Point& point);
  [[nodiscard]] bool clean(const BoundClasses& classes, Point& point);
  [[nodiscard]] Eigen::VectorXd error_of(const Point& point, const BoundClasses& classes,
                                         const Units& units);
  [[nodiscard]] Eigen::VectorXd hessian_error_in(const Units& units) const;
  [[nodiscard]] double margin(double times) const {
    return std::max(times * options_.minmax_curvature_tol, 2.0 * kkt_.perturbation());
  }
  [[nodiscard]] SecondOrder judge_barrier_problem(const Point& given);
  [[nodiscard]] bool barrier_newton_contracts(const Point& given);
  [[nodiscard]] BoundClasses with_idle_held(BoundClasses classes) const;
  void find_rank(const ActiveSetSystem& system, const Point& point);
  void report_inertias(ActiveSetSystem& system);

  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  const SolverOptions& options_;
  double mu_;
  std::vector<Index> idle_;  ///< copies of y whose robust constraint is inactive
  std::optional<Eigen::VectorXd> hessian_error_;  ///< of differences, canonical units
  KktSystem::RankFinding rank_;
  std::optional<Point> moved_;
  std::optional<WrongCurvature> wrong_;
  bool far_ = false;  ///< the solution is near enough for the test but not for the user
  Certificate certificate_;
};

/// At most one factorization of each matrix, with the margin in it: right with it is right without.
bool Certifier::clearly_right(const Point& point) {
  const Units units = units_of(canonical_, point.evaluation);
  const BoundClasses classes =
      with_idle_held(guess_classes(canonical_, options_, point.iterate, units));
  if (!classes.clear()) return false;
  ActiveSetSystem system(canonical_, kkt_, classes, units, point.evaluation);
  const Eigen::VectorXd error = hessian_error_in(units);
  const double needed = margin(1.0);
  const double asked = std::max(kClear * options_.minmax_curvature_tol, needed);
  const InertiaTest test = survives(system, error, asked);
  if (!test.both() || !(std::max(test.inner_response, test.full_response) <= kIndependent)) {
    return false;
  }
  NewtonTest newton;
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return kkt_.solve_unshifted(system.assembled(), rhs, step);
  };
  if (!newton_confirms(system, point, solve, newton)) return false;
  far_ = newton.step > kFar * size_of_problem(canonical_, point.iterate, units);
  if (far_) return false;
  const double left = asked - max_norm(newton.error);
  if (!(left >= margin(1.0))) return false;
  certificate_.margin = left;
  certificate_.licq_min = certificate_.licq_max = true;
  return true;
}

/// Idle copies stay where they are, whatever their bounds.
BoundClasses Certifier::with_idle_held(BoundClasses classes) const {
  for (const Index i : idle_) {
    if (classes[i] == BoundClass::Doubtful) {
      --(canonical_.owned_by_max(i) ? classes.weak_max : classes.weak_min);
    }
    classes.of[at(i)] = BoundClass::Active;
    classes.side[at(i)] = 0;
  }
  return classes;
}

bool Certifier::newton_confirms(ActiveSetSystem& system, const Point& point, const KktSolve& solve,
                                NewtonTest& newton) const {
  newton = test_newton(canonical_, system, point.iterate, point.evaluation, solve);
  return newton.done && newton.classes_hold && newton.contraction <= kContraction;
}

Eigen::VectorXd Certifier::hessian_error_in(const Units& units) const {
  if (!hessian_error_) return {};
  return hessian_error_->cwiseProduct(units.variable.cwiseAbs2());
}

/// Takes the multipliers of inactive inequalities, which are the barrier's, out of W.
bool Certifier::clean(const BoundClasses& classes, Point& point) {
  Eigen::VectorXd lambda = point.iterate.lambda;
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && classes[slack] == BoundClass::Inactive) lambda[j] = 0.0;
  }
  if (lambda == point.iterate.lambda) return true;
  return canonical_.second_derivatives(point.iterate.v, lambda, point.evaluation) ==
         EvaluationStatus::Ok;
}

/// Of W in units: that of differences, and what doubtful inequalities may give or not.
Eigen::VectorXd Certifier::error_of(const Point& point, const BoundClasses& classes,
                                    const Units& units) {
  Eigen::VectorXd error = hessian_error_in(units);
  Eigen::VectorXd lambda = point.iterate.lambda;
  const auto slack_of = canonical_.slack_of_constraint();
  bool any = false;
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack < 0 || classes[slack] == BoundClass::Active) continue;
    any = any || classes[slack] == BoundClass::Doubtful;
    lambda[j] = 0.0;
  }
  if (error.size() == 0) error.setZero(canonical_.variables());
  if (!any) return error;
  Evaluation without = point.evaluation;
  if (canonical_.second_derivatives(point.iterate.v, lambda, without) != EvaluationStatus::Ok) {
    return Eigen::VectorXd::Constant(canonical_.variables(),
                                     std::numeric_limits<double>::infinity());
  }
  for (std::size_t k = 0; k < without.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    const double change = units.variable[i] * units.variable[j] *
                          std::abs(without.hessian[k] - point.evaluation.hessian[k]);
    error[i] += change;
    if (i != j) error[j] += change;
  }
  return error;
}

/// The end of a Newton step with all derivatives.
bool Certifier::next_point(const NewtonTest& newton, Point& point) {
  point.iterate.v = newton.end.iterate.v;
  point.iterate.lambda = newton.end.iterate.lambda;
  return canonical_.values(point.iterate.v, point.evaluation.f, point.evaluation.c) ==
             EvaluationStatus::Ok &&
         canonical_.derivatives(point.iterate.v, point.iterate.lambda, point.evaluation) ==
             EvaluationStatus::Ok;
}

void Certifier::find_rank(const ActiveSetSystem& system, const Point& point) {
  std::vector<bool> active(at(canonical_.variables()));
  for (Index i = 0; i < canonical_.variables(); ++i) {
    active[at(i)] = system.classes()[i] != BoundClass::Inactive;
  }
  Units lengths = system.units();
  lengths.constraint.setOnes();
  rank_ = kkt_.active_rank(in_units(canonical_, point.evaluation, lengths), active);
  certificate_.licq_min = rank_.full_min;
  certificate_.licq_max = rank_.full_max;
}

void Certifier::report_inertias(ActiveSetSystem& system) {
  system.assemble(ActiveSetSystem::kSufficient);
  kkt_.factorize_ahead({}, {});
  certificate_.inner = kkt_.factorize_inner({}).inertia;
  certificate_.full = kkt_.factorize({}).inertia;
}

/// Classes that a Newton step confirms where possible; the stage's point may move along the central path.
bool Certifier::settle(Stage& stage, bool follow) {
  if (follow) {
    stage.classes = with_idle_held(
        follow_barrier(canonical_, kkt_, options_, stage.units, stage.classes, stage.point, mu_));
    moved_ = stage.point;
  }
  if (!clean(stage.classes, stage.point)) return false;
  stage.units = units_of(canonical_, stage.point.evaluation);
  return true;
}

/// Newton's method towards the solution of the active set's equations, until what W changes by on the
/// way is less than its curvature. False: not seen.
bool Certifier::refine_and_test(Stage& stage) {
  for (int round = 0;; ++round) {
    ActiveSetSystem system(canonical_, kkt_, stage.classes, stage.units, stage.point.evaluation);
    system.assemble(ActiveSetSystem::kSufficient);
    stage.error = error_of(stage.point, stage.classes, stage.units);
    const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
      return solve_accurately(kkt_, system.assembled(), rhs, step);
    };
    stage.converges = newton_confirms(system, stage.point, solve, stage.newton);
    if (!stage.newton.done) return false;
    stage.error += stage.newton.error;
    if (stage.converges && survives(system, stage.error, margin(1.0)).both()) {
      find_rank(system, stage.point);
      return true;
    }
    const bool there = max_norm(stage.newton.error) <= margin(1.0);
    if (there || !stage.newton.classes_hold || round == kRefinements) return false;
    if (!next_point(stage.newton, stage.point)) return false;
    stage.units = units_of(canonical_, stage.point.evaluation);
  }
}

/// The test at a point that is not clear, with pivoting.
SecondOrder Certifier::examine(const Point& given) {
  while (!kkt_.pivots() && kkt_.increase_quality()) {
  }
  Stage stage;
  stage.point = given;
  stage.units = units_of(canonical_, given.evaluation);
  stage.classes = with_idle_held(guess_classes(canonical_, options_, given.iterate, stage.units));
  const bool bounded = !canonical_.lower_bounded().empty() || !canonical_.upper_bounded().empty();
  bool follow = far_ || !stage.classes.clear();
  for (;;) {
    if (!settle(stage, follow)) return SecondOrder::Undecided;
    certificate_.weakly_active_min = stage.classes.weak_min;
    certificate_.weakly_active_max = stage.classes.weak_max;
    if (refine_and_test(stage)) {
      certificate_.margin = margin(1.0);
      // Independent Max gradients make the inner maximum follow x; a Min point needs none.
      const bool inner_follows = rank_.full_max || kkt_.layout().x.size() == 0;
      return inner_follows ? SecondOrder::Satisfied : SecondOrder::Undecided;
    }
    if (follow || !bounded || (stage.newton.done && stage.newton.classes_hold)) break;
    follow = true;
    stage.point = given;
  }
  return judge_without_certificate(stage);
}

SecondOrder Certifier::judge_without_certificate(Stage& stage) {
  ActiveSetSystem system(canonical_, kkt_, stage.classes, stage.units, stage.point.evaluation);
  report_inertias(system);
  find_rank(system, stage.point);
  // Where an active gradient vanishes the second-order conditions are not necessary.
  if (rank_.vanishing) return SecondOrder::Undecided;
  const std::optional<Player> suspect = wrong_player(system, stage);
  if (suspect) {
    wrong_ =
        find_witness(canonical_, system, stage.point, margin(1.0), stage.newton.step, *suspect);
  }
  return wrong_ ? SecondOrder::Violated : SecondOrder::Undecided;
}

/// Whose necessary conditions the matrices say are violated; where Newton's method does not converge,
/// those at the point have to do.
std::optional<Player> Certifier::wrong_player(ActiveSetSystem& system, const Stage& stage) {
  if (stage.newton.done && !stage.converges) {
    if (certificate_.inner.positive > certificate_.inner_expected.positive) return Player::Max;
    const bool too_low = certificate_.full.negative > certificate_.full_expected.negative;
    return too_low ? std::optional(Player::Min) : std::nullopt;
  }
  system.assemble({.min_fixed = false, .max_fixed = false}, stage.error, 0.0, -1.0);
  const bool inner_right =
      kkt_.has_expected_inner_inertia(kkt_.factorize_inner({.y = -margin(1.0)}));
  const InertiaTest test =
      helped(system, stage.error, margin(1.0), options_.jacobian_regularization_value, inner_right);
  if (test.both()) return std::nullopt;
  return test.inner ? Player::Min : Player::Max;
}

/// At mu_target > 0 the point solves the barrier problem, in which no bound is active and all curvature
/// counts.
SecondOrder Certifier::judge_barrier_problem(const Point& given) {
  kkt_.assemble(given.iterate, given.evaluation);
  const double spare = margin(1.0) * std::max(1.0, kkt_.hessian_norm());
  const auto right = [&](double shift) {
    return kkt_.has_expected_inner_inertia(kkt_.factorize_inner({.y = shift})) &&
           kkt_.has_expected_inertia(kkt_.factorize({.x = shift, .y = std::max(shift, 0.0)}));
  };
  if (right(-spare)) {
    certificate_.margin = spare;
    return barrier_newton_contracts(given) ? SecondOrder::Satisfied : SecondOrder::Undecided;
  }
  const bool refuted = !right(spare);
  kkt_.factorize_ahead({}, {});
  certificate_.inner = kkt_.factorize_inner({}).inertia;
  certificate_.full = kkt_.factorize({}).inertia;
  return refuted ? SecondOrder::Violated : SecondOrder::Undecided;
}

bool Certifier::barrier_newton_contracts(const Point& given) {
  constexpr double kTau = 0.99;
  constexpr double kNegligible = 1e-10;
  Point point = given;
  StepLength alpha;
  Eigen::VectorXd before = point.iterate.v;
  if (!barrier_newton_step(canonical_, kkt_, mu_, kTau, point, alpha)) return false;
  const double first = max_norm(point.iterate.v - before);
  if (first <= kNegligible * (1.0 + max_norm(before))) return true;
  before = point.iterate.v;
  return barrier_newton_step(canonical_, kkt_, mu_, kTau, point, alpha) &&
         max_norm(point.iterate.v - before) <= kContraction * first;
}

Finding Certifier::run(const Point& given) {
  kkt_.require_certain_inertia(true);
  certificate_.inner_expected = kkt_.layout().expected_inner();
  certificate_.full_expected = kkt_.layout().expected();
  certificate_.inner = certificate_.inner_expected;
  certificate_.full = certificate_.full_expected;
  hessian_error_ = canonical_.hessian_error(given.iterate.v, given.iterate.lambda);
  certificate_.finite_differences = hessian_error_.has_value();
  if (hessian_error_) certificate_.hessian_error = max_norm(*hessian_error_);
  if (hessian_error_ && !hessian_error_->allFinite()) {
    certificate_.second_order = SecondOrder::Undecided;
  } else if (options_.mu_target > 0.0) {
    certificate_.second_order = judge_barrier_problem(given);
  } else {
    idle_ = idle_copies(canonical_, given.iterate, given.evaluation);
    certificate_.second_order = clearly_right(given) ? SecondOrder::Satisfied : examine(given);
    if (certificate_.second_order == SecondOrder::Satisfied) {
      const Point& judged = moved_ ? *moved_ : given;
      certificate_.second_order =
          test_robust_rows(canonical_, kkt_, judged.iterate, judged.evaluation);
    }
  }
  if (certificate_.second_order != SecondOrder::Satisfied) certificate_.margin = 0.0;
  certificate_.kind = certificate_.second_order == SecondOrder::Satisfied
                          ? PointKind::LocalMinmax
                          : PointKind::FirstOrderPoint;
  kkt_.require_certain_inertia(false);
  return {.certificate = certificate_,
          .point = std::move(moved_),
          .mu = mu_,
          .wrong = std::move(wrong_)};
}

}  // namespace

Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point, double mu,
                const SolverOptions& options) {
  return Certifier(canonical, kkt, mu, options).run(point);
}

}  // namespace ipminmax
