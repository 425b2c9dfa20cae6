#include "core/certificate/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/contraction.hpp"
#include "core/certificate/copositive.hpp"
#include "core/certificate/critical_cone.hpp"
#include "core/certificate/dependence.hpp"
#include "core/certificate/hessian_check.hpp"
#include "core/certificate/newton.hpp"
#include "core/certificate/reasons.hpp"
#include "core/certificate/robust_rows.hpp"
#include "core/certificate/second_order.hpp"
#include "core/certificate/units.hpp"
#include "core/certificate/valley.hpp"
#include "core/certificate/vertex.hpp"
#include "core/certificate/witness.hpp"
#include "core/model/directional_check.hpp"
#include "core/model/norms.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {
namespace {

/// Newton's method counts as contracting when the second step with the same matrix is at most this
/// fraction of the first (1/4 for x^3 at 0, below it quadratic convergence is near).
constexpr double kContraction = 0.1;
/// A clear point has so many times minmax_curvature_tol. More is taken away where tolerances are
/// loose, for W changes by more on the way to the solution: so many tols, at most so much.
constexpr double kClear = 100.0;
constexpr double kProbeInTols = 100.0;
constexpr double kMostProbed = 1e-4;
/// Amplification of a generic right-hand side up to which active gradients are independent.
constexpr double kIndependent = 1e5;
/// Change of the active gradients over a step, times the amplification of the matrices, up to which
/// these are nonsingular all along it.
constexpr double kTurn = 0.25;
/// Step to the solution, over the size of the point or of the start, that is worth going: in tols,
/// within limits.
constexpr double kFarInTols = 100.0;
constexpr double kLeastFar = 1e-6, kMostFar = 1e-4;
/// The same of a certified solution that does not meet the tolerances itself.
constexpr double kNear = 1e-3;
/// Of an active gradient, in units.
constexpr double kVanishing = 1e-9;
/// Factorizations that a Newton step and the test at its end need, and those that may refute a
/// point.
constexpr Index kToConfirm = 3;
constexpr Index kToRefute = 3;
/// Lengths over those before that are worth another test.
constexpr double kLonger = 10.0;
/// Curvature, over the margin, of a direction that may be flat.
constexpr double kFlatTimes = 10.0;
/// z / s in units at which a bound is guessed to be one or the other, where Newton steps decide.
constexpr double kEitherRatio = 1.0;
/// Newton steps towards the solution of a point that is not clear.
constexpr int kRefinements = 4;
/// The same where each of them contracts by at most this: as towards a zero of high order, where it
/// is 1/4 to 0.37.
constexpr int kMostRefinements = 16;
constexpr double kCreeping = 0.4;
/// Rows of K above which a step costs more than the chance is worth that the next one settles what
/// this one has not changed: change of W, or contraction, over that of the last one.
constexpr Index kLargeSystem = 300;
constexpr double kProgress = 0.5;
/// Error of W over the margin that makes no difference to the test.
constexpr double kLittle = 0.25;
/// How often longer units are tried.
constexpr int kStretches = 2;
/// What a Newton step has to leave of an entry of W, over its change: 0.6 of f'' is left where it
/// vanishes with f' and f, whatever the order.
constexpr double kLeft = 0.3;
/// Of the error allowed, that multipliers mu / s of open bounds may leave.
constexpr double kShareOfError = 0.1;
/// Of a multiplier or distance, left at the solution by which a guess of the bound's class holds:
/// of a weakly active one nothing but rounding is.
constexpr double kShareLeft = 1e-3;
/// Of the largest entry of a matrix, by its factorization.
constexpr double kRoundingOfEntry = 1e-15;
/// Of variables, relative to their sizes here or at the start.
constexpr double kRounding = 1e-13;
/// Of a distance to a bound, of steps that are no larger.
constexpr double kShareOfDistance = 0.1;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::string percentage(const Deviation& found) {
  const double size = std::max(std::abs(found.exact), std::abs(found.difference));
  const double percent = 100.0 * std::abs(found.exact - found.difference) / size;
  char text[32];
  std::snprintf(text, sizeof text, " by %.3g percent", percent);
  return text;
}
/// A first look at a point.
enum class Look : std::uint8_t { Right, Wrong, Unclear };

/// Entries of W that are rounding errors of multipliers give lengths beside which everything that
/// ties these variables looks like nothing.
bool are_alike(const Units& units) {
  constexpr double kLargestRatio = 1e6;
  return units.variable.size() == 0 ||
         units.variable.maxCoeff() <= kLargestRatio * units.variable.minCoeff();
}

class Certifier {
 public:
  Certifier(CanonicalProblem& canonical, KktSystem& kkt, double mu, const SolverOptions& options,
            Index factorizations, CertificateArrays& arrays)
      : canonical_(canonical),
        kkt_(kkt),
        options_(options),
        arrays_(arrays),
        mu_(mu),
        last_factorization_(kkt.factorizations() + factorizations + kToConfirm),
        reasons_(canonical) {}

  Finding run(const Point& given);

 private:
  using Kind = CertificateReason::Kind;
  /// A point on its way to the solution of the active set's equations.
  struct Stage {
    Point point;
    Units units;
    BoundClasses classes;
    NewtonTest newton;
    InertiaTest test;
    Eigen::VectorXd error;   ///< of W in units
    bool converges = false;  ///< Newton's method, to a solution with these classes
    bool guessed = false;    ///< some classes are mere guesses: nothing but success counts
    /// After many steps: other solutions may be nearer to where they began, so that the certified
    /// one has to be returned itself.
    bool crept = false;
    std::optional<Dependences> dependences{};
    /// Curvature that Max's answers give x, once it has been asked for; empty where it is of no
    /// use.
    std::optional<Eigen::VectorXd> answers{};
    /// Times the lengths: how much farther variables go along directions of little curvature.
    std::optional<Eigen::VectorXd> stretch{};
    /// Fewer answers of Max, in which K is tested: where his active gradients depend.
    std::optional<BoundClasses> narrow{};
  };
  [[nodiscard]] SecondOrder judge(const Point& given);
  [[nodiscard]] Look first_look(const Point& point);
  [[nodiscard]] bool refute_clearly(ActiveSetSystem& system, const Point& point, double error,
                                    Player player);
  [[nodiscard]] bool newton_confirms(ActiveSetSystem& system, const Point& point,
                                     const KktSolve& solve, Probe probe, NewtonTest& newton) const;
  [[nodiscard]] SecondOrder examine(const Point& given);
  [[nodiscard]] bool settle(Stage& stage, bool follow);
  [[nodiscard]] bool refine_and_test(Stage& stage);
  [[nodiscard]] bool is_attracted_elsewhere(const Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool test_at_vertices(Stage& stage);
  [[nodiscard]] bool release(Stage& stage);
  [[nodiscard]] bool revise(Stage& stage);
  [[nodiscard]] bool ends_near(const Stage& stage) const;
  [[nodiscard]] bool guess_holds(const Stage& stage, const Point& given);
  [[nodiscard]] bool weakly_active_are_near(const Stage& stage) const;
  [[nodiscard]] bool measure_answers(Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool confirm(Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool is_right_in_longer_units(Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool is_right(Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool look_for_dependences(Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool independent_or_harmless(Stage& stage, ActiveSetSystem& system);
  [[nodiscard]] bool settled(const Stage& stage, bool of_max) const;
  [[nodiscard]] SecondOrder certified(const Stage& stage, const Point& given);
  [[nodiscard]] bool reports_solution(const Stage& stage, const Point& given);
  [[nodiscard]] SecondOrder judge_without_certificate(Stage& stage);
  [[nodiscard]] bool refute(ActiveSetSystem& system, Stage& stage);
  [[nodiscard]] bool refute_in_cone(ActiveSetSystem& system, const Stage& stage);
  [[nodiscard]] bool is_valley(ActiveSetSystem& system, const Stage& stage);
  [[nodiscard]] InertiaTest helped_by_margin(ActiveSetSystem& system, const Eigen::VectorXd& error);
  [[nodiscard]] std::optional<Player> wrong_player(ActiveSetSystem& system, const Stage& stage);
  [[nodiscard]] InnerAnswer answer_alone(const Stage& stage);
  [[nodiscard]] std::vector<bool> droppable(const Dependences& dependences, bool x_held) const;
  [[nodiscard]] bool evaluate(Point& point);
  [[nodiscard]] bool evaluate_objective(Point& point);
  [[nodiscard]] Units certain_units(const Stage& stage);
  [[nodiscard]] Units measured(const Stage& stage, const Evaluation& certain) const;
  [[nodiscard]] Iterate solution_of(const Stage& stage, Iterate end, double mu) const;
  [[nodiscard]] bool clean(const BoundClasses& classes, Point& point);
  [[nodiscard]] Eigen::VectorXd error_of(const Point& point, const BoundClasses& classes,
                                         const Units& units);
  [[nodiscard]] Eigen::VectorXd hessian_error_in(const Units& units) const;
  [[nodiscard]] double margin(double times) const {
    return std::max(times * options_.minmax_curvature_tol, 2.0 * kkt_.perturbation());
  }
  [[nodiscard]] double far() const {
    return std::clamp(kFarInTols * options_.tol, kLeastFar, kMostFar);
  }
  [[nodiscard]] SecondOrder judge_barrier_problem(const Point& given);
  [[nodiscard]] bool barrier_problem_refuted(double spare);
  [[nodiscard]] bool barrier_newton_contracts(const Point& given);
  void hold_idle(BoundClasses& classes) const;
  [[nodiscard]] BoundClasses with_idle_held(BoundClasses classes) const;
  void report_inertias(ActiveSetSystem& system);
  void explain(const Stage& stage);
  [[nodiscard]] bool may_factorize(Index more) {
    const bool may = kkt_.factorizations() + more <= last_factorization_;
    stopped_ = stopped_ || !may;
    return may;
  }
  [[nodiscard]] bool has_x() const { return kkt_.layout().x.size() > 0; }
  [[nodiscard]] bool has_y() const { return kkt_.layout().y.size() > 0; }
  void examine_curvature(const CurvatureTrial& trial, const Point& point,
                         const Eigen::VectorXd& lambda);
  void examine_curvature(const Point& point, const Evaluation* assembled);
  void examine_curvature(ActiveSetSystem& system, const Point& point,
                         const Eigen::VectorXd& lambda);
  [[nodiscard]] Eigen::VectorXd without_inactive(const BoundClasses& classes,
                                                 Eigen::VectorXd lambda) const;

  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  const SolverOptions& options_;
  CertificateArrays& arrays_;
  double mu_;
  Index last_factorization_;
  Reasons reasons_;
  std::vector<Index> idle_;  ///< copies of y whose robust constraint is inactive
  std::optional<Eigen::VectorXd> hessian_error_;  ///< of differences, canonical units
  std::optional<Point> moved_;
  std::optional<WrongCurvature> wrong_;
  std::optional<Eigen::VectorXd> descent_;
  bool far_ = false;      ///< the solution is near enough for the test but not for the user
  bool stopped_ = false;  ///< by the budget of factorizations
  std::optional<Deviation> wrong_row_;  ///< of W
  Certificate certificate_;
};

/// A robust constraint's worst case has to follow x smoothly.
bool reads_both_players(const CanonicalProblem& canonical) {
  return std::ranges::any_of(canonical.jacobian(), [&](const auto& entry) {
    return canonical.min_constraints().contains(entry.row) && canonical.owned_by_max(entry.col);
  });
}

/// Whether the matrices of the test are nonsingular at the end of the step as well.
bool gradients_hold(const NewtonTest& newton, const InertiaTest& test) {
  return newton.inner_turn * test.inner_response <= kTurn &&
         newton.turn * test.full_response <= kTurn;
}

/// Lengths longer than W's own make entries large: whether their rounding in a factorization leaves
/// the inertias what they are. The smallest singular values are the responses' inverses.
bool inertias_are_certain(const ActiveSetSystem& system, const InertiaTest& test) {
  double largest = 1.0;
  for (const double entry : system.derivatives().hessian) {
    largest = std::max(largest, std::abs(entry));
  }
  for (const double entry : system.derivatives().jacobian) {
    largest = std::max(largest, std::abs(entry));
  }
  return kRoundingOfEntry * (largest - 1.0) * std::max(test.inner_response, test.full_response) <=
         kTurn;
}

/// Multipliers cannot be known better than this: rounding of the variables, relative to their
/// sizes, over what it changes the gradient by that they balance.
Eigen::VectorXd rounding_of_multipliers(const CanonicalProblem& canonical, const Point& point,
                                        const Eigen::VectorXd& size) {
  const Evaluation& here = point.evaluation;
  Eigen::VectorXd terms = here.gradient.cwiseAbs();
  for (std::size_t k = 0; k < here.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    terms[i] += std::abs(here.hessian[k]) * size[j];
    if (i != j) terms[j] += std::abs(here.hessian[k]) * size[i];
  }
  Eigen::VectorXd balanced = Eigen::VectorXd::Zero(canonical.constraints()), length = balanced;
  for (std::size_t k = 0; k < here.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    terms[col] += std::abs(here.jacobian[k] * point.iterate.lambda[row]);
    length[row] = std::max(length[row], std::abs(here.jacobian[k]));
  }
  for (std::size_t k = 0; k < here.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    if (here.jacobian[k] != 0.0) balanced[row] = std::max(balanced[row], terms[col]);
  }
  for (Index j = 0; j < balanced.size(); ++j) {
    balanced[j] *= length[j] > 0.0 ? kRounding / length[j] : 0.0;
  }
  return balanced;
}

/// At most one factorization of each matrix at a clear point, with the margin in it: right with it
/// is right without.
Look Certifier::first_look(const Point& point) {
  const Units& units = units_of(canonical_, point.iterate.v, point.evaluation, {}, arrays_.units);
  BoundClasses& classes = arrays_.classes;
  guess_classes(canonical_, options_, point.iterate, units, classes);
  hold_idle(classes);
  if (!classes.clear()) return Look::Unclear;
  ActiveSetSystem system(canonical_, kkt_, classes, units, point.evaluation, &arrays_.system);
  const Eigen::VectorXd error = hessian_error_in(units);
  const double asked = std::max({kClear * options_.minmax_curvature_tol, margin(1.0),
                                 std::min(kProbeInTols * options_.tol, kMostProbed)});
  const InertiaTest test = survives(system, error, asked);
  if (!test.both()) {
    // Singular beside the margin, it is so without: gradients depend on each other.
    const KktFactors& last = test.inner ? kkt_.factors() : kkt_.inner_factors();
    if (!are_alike(units) || last.status == FactorizationStatus::Singular) return Look::Unclear;
    // Wrong with the margin for him, too?
    const bool inner = test.inner;
    if (error.size() > 0) {
      system.assemble(ActiveSetSystem::kSufficient, error, 1.0, inner ? -1.0 : 1.0);
    }
    const bool open = inner ? kkt_.has_expected_inertia(kkt_.factorize({.x = asked, .y = -asked}))
                            : kkt_.has_expected_inner_inertia(kkt_.factorize_inner({.y = asked}));
    const Player player = inner ? Player::Min : Player::Max;
    return !open && refute_clearly(system, point, max_norm(error), player) ? Look::Wrong
                                                                           : Look::Unclear;
  }
  if (!(std::max(test.inner_response, test.full_response) <= kIndependent)) return Look::Unclear;
  NewtonTest& newton = arrays_.newton;
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return kkt_.solve_unshifted(system.assembled(), rhs, step);
  };
  if (!newton_confirms(system, point, solve, Probe::Beyond, newton)) return Look::Unclear;
  if (!gradients_hold(newton, test)) return Look::Unclear;
  far_ = newton.step > far() * size_of_problem(canonical_, point.iterate, units);
  if (far_) return Look::Unclear;
  double left = asked - max_norm(newton.error);
  if (!(left >= margin(1.0))) {
    // W changes by more than that on the way to the solution: does the test hold beside it?
    Eigen::VectorXd& change = arrays_.change;
    change = newton.error;
    if (error.size() > 0) change += error;
    if (!may_factorize(kToConfirm - 1)) return Look::Unclear;
    const InertiaTest beside = survives(system, change, margin(kClear));
    if (!beside.both() || !gradients_hold(newton, beside)) return Look::Unclear;
    left = margin(kClear);
  }
  examine_curvature(system, point, point.iterate.lambda);
  certificate_.margin = left;
  certificate_.licq_min = certificate_.licq_max = true;
  certificate_.answer = InnerAnswer::Smooth;
  return Look::Right;
}

/// Where an active gradient vanishes the second-order conditions are not necessary.
bool has_vanishing_row(ActiveSetSystem& system) {
  const CanonicalProblem& canonical = system.canonical();
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(canonical.constraints());
  for (std::size_t k = 0; k < system.derivatives().jacobian.size(); ++k) {
    double& row = largest[canonical.jacobian()[k].row];
    row = std::max(row, std::abs(system.derivatives().jacobian[k]));
  }
  for (Index j = 0; j < largest.size(); ++j) {
    if (system.counts(j) && largest[j] <= kVanishing) return true;
  }
  return false;
}

bool Certifier::refute_clearly(ActiveSetSystem& system, const Point& point, double error,
                               Player player) {
  if (has_vanishing_row(system)) return false;
  report_inertias(system);
  NewtonTest newton;
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return kkt_.factorize({}).status == FactorizationStatus::Ok &&
           kkt_.solve(system.assembled(), rhs, step);
  };
  if (!newton_confirms(system, point, solve, Probe::Beyond, newton)) return false;
  const double spare = margin(1.0) + 2.0 * (error + max_norm(newton.error));
  wrong_ = find_witness(canonical_, system, point, spare, newton.step, player);
  if (!wrong_) return false;
  certificate_.licq_min = certificate_.licq_max = true;
  return true;
}

/// Idle copies stay where they are, whatever their bounds.
void Certifier::hold_idle(BoundClasses& classes) const {
  for (const Index i : idle_) {
    if (classes[i] == BoundClass::Doubtful) {
      --(canonical_.owned_by_max(i) ? classes.weak_max : classes.weak_min);
    }
    classes.of[at(i)] = BoundClass::Active;
    classes.side[at(i)] = 0;
  }
}

BoundClasses Certifier::with_idle_held(BoundClasses classes) const {
  hold_idle(classes);
  return classes;
}

bool Certifier::newton_confirms(ActiveSetSystem& system, const Point& point, const KktSolve& solve,
                                Probe probe, NewtonTest& newton) const {
  test_newton(canonical_, system, point, {solve, probe}, arrays_.newton_step, newton);
  return newton.done && newton.classes_hold && newton.contraction <= kContraction;
}

Eigen::VectorXd Certifier::hessian_error_in(const Units& units) const {
  if (!hessian_error_) return {};
  return hessian_error_->cwiseProduct(units.variable.cwiseAbs2());
}

Eigen::VectorXd Certifier::without_inactive(const BoundClasses& classes,
                                            Eigen::VectorXd lambda) const {
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && classes[slack] <= BoundClass::Inactive) lambda[j] = 0.0;
  }
  return lambda;
}

/// From entries of W and the Jacobian that neither rounding of the variables and multipliers nor
/// the last Newton step changes by more than they are: what is left of a cancellation gives no
/// length.
Units Certifier::certain_units(const Stage& stage) {
  const Point& point = stage.point;
  Evaluation certain = point.evaluation, there = certain;
  for (std::size_t k = 0; k < stage.newton.hessian_change.size(); ++k) {
    if (std::abs(certain.hessian[k]) < kLeft * stage.newton.hessian_change[k]) {
      certain.hessian[k] = 0.0;
    }
  }
  const Eigen::VectorXd size =
      point.iterate.v.cwiseAbs().cwiseMax(canonical_.starting_point().v.cwiseAbs());
  Eigen::VectorXd step = kRounding * size;
  keep_within_bounds(canonical_, point.iterate.v, kShareOfDistance, step);
  const Eigen::VectorXd lambda =
      point.iterate.lambda + rounding_of_multipliers(canonical_, point, size);
  if (canonical_.first_derivatives(point.iterate.v + step, there) != EvaluationStatus::Ok ||
      canonical_.second_derivatives(point.iterate.v + step, without_inactive(stage.classes, lambda),
                                    there) != EvaluationStatus::Ok) {
    return measured(stage, certain);
  }
  const auto keep = [](double changed, double& value) {
    if (!(std::abs(changed - value) <= std::abs(value))) value = 0.0;
  };
  for (std::size_t k = 0; k < certain.hessian.size(); ++k) {
    if (certain.hessian[k] != 0.0) keep(there.hessian[k], certain.hessian[k]);
  }
  for (std::size_t k = 0; k < certain.jacobian.size(); ++k) {
    keep(there.jacobian[k], certain.jacobian[k]);
  }
  return measured(stage, certain);
}

/// Lengths from what is certain of the derivatives, and from what has been found out about them.
Units Certifier::measured(const Stage& stage, const Evaluation& certain) const {
  Units units = units_of(canonical_, stage.point.iterate.v, certain,
                         stage.answers.value_or(Eigen::VectorXd()));
  if (stage.stretch) units = stretched(canonical_, certain, std::move(units), *stage.stretch);
  return units;
}

/// Takes the multipliers of inactive inequalities, which are the barrier's, out of W.
bool Certifier::clean(const BoundClasses& classes, Point& point) {
  const Eigen::VectorXd lambda = without_inactive(classes, point.iterate.lambda);
  if (lambda == point.iterate.lambda) return true;
  return canonical_.second_derivatives(point.iterate.v, lambda, point.evaluation) ==
         EvaluationStatus::Ok;
}

void Certifier::examine_curvature(const CurvatureTrial& trial, const Point& point,
                                  const Eigen::VectorXd& lambda) {
  find_little_curvature(canonical_, kkt_, trial, arrays_.curvature);
  const LittleCurvature& found = arrays_.curvature.found;
  if (found.variable >= 0) {
    certificate_.least_curvature = found.least;
    certificate_.least_curvature_variable = canonical_.model_variable(found.variable);
  }
  // Differences have errors of their own, which the tests allow for.
  if (!hessian_error_) {
    wrong_row_ = find_wrong_row(canonical_, point, lambda, trial.units, arrays_.curvature);
  }
}

void Certifier::examine_curvature(ActiveSetSystem& system, const Point& point,
                                  const Eigen::VectorXd& lambda) {
  const auto is_held = [&](Index i) { return system.is_slack(i) || system.is_fixed(i); };
  examine_curvature({.units = system.units(), .assembled = &system.assembled(), .is_held = is_held},
                    point, lambda);
}

/// At a point whose active set is not known.
void Certifier::examine_curvature(const Point& point, const Evaluation* assembled) {
  const Units units = units_of(canonical_, point.iterate.v, point.evaluation);
  const auto is_held = [&](Index i) {
    return canonical_.x_slacks().contains(i) || canonical_.y_slacks().contains(i);
  };
  examine_curvature({.units = units, .assembled = assembled, .in_units = false, .is_held = is_held},
                    point, point.iterate.lambda);
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

/// All but f at the point's iterate: few of the points on the way are asked for their value.
bool Certifier::evaluate(Point& point) {
  return canonical_.constraints(point.iterate.v, point.evaluation.c) == EvaluationStatus::Ok &&
         evaluate_derivatives(canonical_, point) == EvaluationStatus::Ok;
}

void Certifier::report_inertias(ActiveSetSystem& system) {
  system.assemble(ActiveSetSystem::kSufficient);
  kkt_.factorize_ahead({}, {});
  certificate_.inner = kkt_.factorize_inner({}).inertia;
  certificate_.full = kkt_.factorize({}).inertia;
}

/// Classes that a Newton step confirms where possible; the stage's point may move along the central
/// path.
bool Certifier::settle(Stage& stage, bool follow) {
  if (follow) {
    const auto most =
        static_cast<int>(last_factorization_ - kkt_.factorizations() - 2 * kToConfirm);
    stage.classes = with_idle_held(follow_barrier(canonical_, kkt_, options_, stage.units,
                                                  stage.classes, most, stage.point, mu_));
    moved_ = stage.point;
  }
  if (!clean(stage.classes, stage.point)) return false;
  stage.units = certain_units(stage);
  return true;
}

/// Constraints that say nothing beside others, so that the model without them is the same model.
/// x_held: beside others at this x.
std::vector<bool> Certifier::droppable(const Dependences& dependences, bool x_held) const {
  std::vector<bool> rows(at(canonical_.constraints()), false);
  for (const Dependence& dependence : dependences.found) {
    rows[at(dependence.row)] = x_held ? dependence.identical_in_y : dependence.identical;
  }
  return rows;
}

/// False: not asked for again, or nothing can be left out.
bool Certifier::look_for_dependences(Stage& stage, ActiveSetSystem& system) {
  if (stage.dependences || canonical_.constraints() == 0 || !may_factorize(1)) return false;
  system.assemble(ActiveSetSystem::kSufficient);
  stage.dependences = find_dependences(canonical_, system, stage.point, options_);
  certificate_.licq_min = stage.dependences->independent(canonical_, false);
  certificate_.licq_max = stage.dependences->independent(canonical_, true);
  std::vector<bool> rows = droppable(*stage.dependences, !has_x());
  if (std::ranges::find(rows, true) == rows.end()) return false;
  stage.classes.redundant = std::move(rows);
  return true;
}

/// Doubtful bounds that Max leaves are none of his active ones. False: there are none.
bool Certifier::release(Stage& stage) {
  if (stage.newton.pulled_off.empty()) return false;
  for (const Index i : stage.newton.pulled_off) stage.classes.of[at(i)] = BoundClass::Inactive;
  stage.classes.weak_max -= static_cast<Index>(stage.newton.pulled_off.size());
  return clean(stage.classes, stage.point);
}

/// Guessed classes that the Newton step contradicts change, and the next one begins at its end.
bool Certifier::revise(Stage& stage) {
  constexpr double kInside = 1e-2;  // of the distance before, from a bound that was crossed
  Iterate& end = stage.newton.end.iterate;
  for (const Index i : stage.newton.contradicted) {
    const bool crossed = stage.classes[i] == BoundClass::Inactive;
    if (crossed) {
      const double distance = stage.classes.distance(canonical_, stage.point.iterate, i);
      const double move = (1.0 - kInside) * distance;
      end.v[i] = stage.point.iterate.v[i] + stage.classes.side[at(i)] * move;
    }
    stage.classes.of[at(i)] = crossed ? BoundClass::Active : BoundClass::Inactive;
  }
  const auto above = [&](Index i) { return canonical_.above_lower(i, end.v[i]) > 0.0; };
  const auto below = [&](Index i) { return canonical_.below_upper(i, end.v[i]) > 0.0; };
  if (!std::ranges::all_of(canonical_.lower_bounded(), above) ||
      !std::ranges::all_of(canonical_.upper_bounded(), below)) {
    return false;
  }
  stage.point.iterate = end;
  if (!evaluate(stage.point) || !clean(stage.classes, stage.point)) return false;
  stage.units = certain_units(stage);
  return true;
}

/// The path leads to a solution far from the point, a Newton step not quite to its bounds.
bool Certifier::ends_near(const Stage& stage) const {
  return stage.newton.step <= far() * size_of_problem(canonical_, stage.point.iterate, stage.units);
}

/// Whether the bounds are clearly what they were guessed to be at the solution, and that is
/// reported.
bool Certifier::guess_holds(const Stage& stage, const Point& given) {
  const Iterate& end = stage.newton.end.iterate;
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (stage.classes.side[at(i)] == 0) continue;
    const bool active = stage.classes[i] == BoundClass::Active;
    const auto left = [&](const Iterate& z) {
      return active ? stage.classes.multiplier(z, i) : stage.classes.distance(canonical_, z, i);
    };
    if (!(left(end) >= kShareLeft * left(given.iterate))) return false;
  }
  return reports_solution(stage, given);
}

/// The cone of directions into weakly active bounds of Min tells of a solution at these bounds.
/// False: there are none, or they are farther than what is returned may be from the solution.
bool Certifier::weakly_active_are_near(const Stage& stage) const {
  const double near = kNear * size_of_problem(canonical_, stage.point.iterate, stage.units);
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (stage.classes[i] != BoundClass::Doubtful || canonical_.owned_by_max(i)) continue;
    const double distance = stage.classes.distance(canonical_, stage.point.iterate, i);
    if (distance > near * stage.units.variable[i]) return false;
  }
  return stage.classes.weak_min > 0;
}

/// Lengths of x are too short where they come from a coupling with a y that its constraints hold.
/// False: no others.
bool Certifier::measure_answers(Stage& stage, ActiveSetSystem& system) {
  if (!has_x() || !has_y() || stage.answers || !may_factorize(1 + kToConfirm)) return false;
  stage.answers = curvature_of_answers(system);
  if (stage.answers->size() == 0) return false;
  Units longer = certain_units(stage);
  const IndexRange x = canonical_.x();
  bool any = false;
  for (Index i = x.begin; i < x.end; ++i) {
    any = any || longer.variable[i] > kLonger * stage.units.variable[i];
  }
  if (any) {
    stage.units = std::move(longer);
  } else {
    stage.answers->resize(0);
  }
  return any;
}

/// Directions of little curvature lead variables farther than their lengths, where stiff curvature
/// or constraints make others follow: in lengths as long the change of W along them, and how far
/// gradients turn, are seen as small as they are. The margin asked for stays what it was.
bool Certifier::is_right_in_longer_units(Stage& stage, ActiveSetSystem& system) {
  if (!may_factorize(2 + kToConfirm)) return false;
  Stage trial = stage;
  trial.stretch = stretch_of_little_curvature(system);
  if (!(max_norm(*trial.stretch) > kLonger)) return false;
  trial.units = certain_units(trial);
  ActiveSetSystem longer(canonical_, kkt_, trial.classes, trial.units, trial.point.evaluation);
  if (!confirm(trial, longer) || !is_right(trial, longer)) return false;
  stage = std::move(trial);
  return true;
}

/// The Newton step, and the error of W over it.
bool Certifier::confirm(Stage& stage, ActiveSetSystem& system) {
  system.assemble(ActiveSetSystem::kSufficient);
  stage.error = error_of(stage.point, stage.classes, stage.units);
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return solve_accurately(kkt_, system.assembled(), rhs, step);
  };
  stage.converges = newton_confirms(system, stage.point, solve, Probe::EndAndBeyond, stage.newton);
  if (stage.newton.done) stage.error += stage.newton.error;
  return stage.converges;
}

/// Whether the matrices are right for every W within the error, over the whole step.
bool Certifier::is_right(Stage& stage, ActiveSetSystem& system) {
  Eigen::VectorXd error = stage.error;
  if (stage.stretch) {
    error.array() += margin(1.0) * (stage.stretch->array().square() - 1.0);
  }
  const auto holds = [&](ActiveSetSystem& tested) {
    if (!stage.test.both() || !gradients_hold(stage.newton, stage.test) ||
        !inertias_are_certain(tested, stage.test)) {
      return false;
    }
    examine_curvature(tested, stage.point,
                      without_inactive(stage.classes, stage.point.iterate.lambda));
    return true;
  };
  if (stage.narrow) {
    ActiveSetSystem narrow(canonical_, kkt_, *stage.narrow, stage.units, stage.point.evaluation);
    stage.test = survives_narrowed(system, narrow, error, margin(1.0));
    return holds(narrow);
  }
  stage.test = survives(system, error, margin(1.0));
  if (!stage.test.both() && weakly_active_are_near(stage) && may_factorize(1)) {
    stage.test = survives_in_cone(system, error, margin(1.0), stage.test);
  }
  return holds(system);
}

/// Newton's method towards the solution of the active set's equations, until what W changes by on
/// the way is less than its curvature. False: not seen.
bool Certifier::refine_and_test(Stage& stage) {
  bool steady = true;
  int stretches = kStretches;
  const bool large = kkt_.layout().dimension() > kLargeSystem;
  double last = std::numeric_limits<double>::infinity();
  bool had_converged = false;
  for (int round = 0;; ++round) {
    if (!may_factorize(round == 0 ? 1 : kToConfirm)) return false;
    ActiveSetSystem system(canonical_, kkt_, stage.classes, stage.units, stage.point.evaluation);
    static_cast<void>(confirm(stage, system));
    if (release(stage)) {
      --round;
      continue;
    }
    if (stage.guessed && !(stage.newton.classes_hold && ends_near(stage))) {
      if (!stage.newton.done || round == kRefinements || !revise(stage)) return false;
      continue;
    }
    if (stage.converges && is_right(stage, system)) return independent_or_harmless(stage, system);
    const bool right = stage.converges && stage.test.both();
    if (!stage.guessed && stage.converges && stage.test.inner && !right &&
        measure_answers(stage, system)) {
      --round;
      continue;
    }
    // Other lengths leave the inertias what they are beside the same margin.
    const bool margin_decides =
        !stage.test.both() && max_norm(stage.error) <= kLittle * margin(1.0);
    if (stage.converges && stretches > 0 && !margin_decides) {
      --stretches;
      if (is_right_in_longer_units(stage, system)) return independent_or_harmless(stage, system);
    }
    // Where all but how far the gradients turn is right the next point settles that.
    if (!stage.guessed && !right && look_for_dependences(stage, system)) {
      round = -1;
      continue;
    }
    if (!stage.newton.done) return false;
    const bool there =
        max_norm(stage.newton.error) <= margin(1.0) && gradients_hold(stage.newton, stage.test);
    // Newton's method creeps to where derivatives nearly vanish together.
    steady = steady && !stage.guessed && !stage.converges && stage.newton.contraction <= kCreeping;
    if (there || !stage.newton.classes_hold) return false;
    if (round == (steady ? kMostRefinements : kRefinements)) return false;
    const double here = stage.converges ? max_norm(stage.newton.error) : stage.newton.contraction;
    if (large && stage.converges == had_converged && !(here <= kProgress * last)) return false;
    had_converged = stage.converges;
    last = here;
    if (is_attracted_elsewhere(stage, system)) return false;
    stage.crept = stage.crept || round >= kRefinements;
    stage.point.iterate = stage.newton.end.iterate;
    if (!evaluate(stage.point)) return false;
    stage.units = certain_units(stage);
  }
}

/// Newton's method does not lead from where an inertia is wrong to the solution near by: over a
/// hill, by chance, to another one. That takes curvature of the other sign at the end of the step.
bool Certifier::is_attracted_elsewhere(const Stage& stage, ActiveSetSystem& system) {
  bool turns = false;
  for (std::size_t k = 0; k < stage.newton.hessian_change.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    const double here = std::abs(stage.point.evaluation.hessian[k]);
    turns = turns || (i == j && here > 0.0 && stage.newton.hessian_change[k] >= here);
  }
  if (!turns || stage.guessed || !may_factorize(3)) return false;
  return !helped_by_margin(system, {}).both();
}

/// Where active gradients depend on each other, the test with one choice of multipliers is enough
/// for Min, and for Max to say that y is strictly best.
bool Certifier::test_at_vertices(Stage& stage) {
  if (canonical_.constraints() == 0 || !may_factorize(1 + kToConfirm)) return false;
  ActiveSetSystem system(canonical_, kkt_, stage.classes, stage.units, stage.point.evaluation);
  system.assemble({.min_fixed = true, .max_fixed = true});
  const Dependences dependences = find_dependences(canonical_, system, stage.point, options_);
  stage.classes.redundant = droppable(dependences, !has_x());
  const bool max = !has_x() || (has_y() && !dependences.independent(canonical_, true) &&
                                !reads_both_players(canonical_));
  for (Vertex& vertex : vertices_of_multipliers(system, stage.point, dependences, options_, max)) {
    if (!may_factorize(kToConfirm)) return false;
    Stage trial;
    trial.point = stage.point;
    trial.point.iterate = std::move(vertex.iterate);
    trial.classes = std::move(vertex.classes);
    trial.narrow = std::move(vertex.narrow);
    if (!evaluate(trial.point) || !clean(trial.classes, trial.point)) continue;
    trial.units = certain_units(trial);
    trial.dependences = dependences;
    if (!refine_and_test(trial)) continue;
    stage = std::move(trial);
    certificate_.licq_min = stage.dependences->independent(canonical_, false);
    certificate_.licq_max = stage.dependences->independent(canonical_, true);
    certificate_.weakly_active_min = stage.classes.weak_min;
    certificate_.weakly_active_max = stage.classes.weak_max;
    return true;
  }
  return false;
}

/// Independent Max gradients make the inner maximum follow x; a Min point needs none.
bool Certifier::independent_or_harmless(Stage& stage, ActiveSetSystem& system) {
  const double response = std::max(stage.test.inner_response, stage.test.full_response);
  if (response <= kIndependent || canonical_.constraints() == 0) {
    if (!stage.dependences) certificate_.licq_min = certificate_.licq_max = true;
    return true;
  }
  if (!stage.dependences) {
    const BoundClasses classes = stage.classes;
    static_cast<void>(look_for_dependences(stage, system));
    stage.classes = classes;
  }
  if (canonical_.max_constraints().size() == 0) return true;
  return stage.dependences && (settled(stage, true) || !has_x());
}

/// Whether all dependent rows found are left out; of_max: of Max's.
bool Certifier::settled(const Stage& stage, bool of_max) const {
  if (!stage.dependences) return true;
  const auto open = [&](const Dependence& d) {
    const bool max = canonical_.max_constraints().contains(d.row);
    return (max || !of_max) && !stage.classes.is_redundant(d.row);
  };
  return stage.dependences->complete && std::ranges::none_of(stage.dependences->found, open);
}

bool Certifier::evaluate_objective(Point& point) {
  return canonical_.objective(point.iterate.v, point.evaluation.f) == EvaluationStatus::Ok;
}

/// An iterate on the way of the test's Newton steps, with multipliers of open bounds that are mu /
/// s.
Iterate Certifier::solution_of(const Stage& stage, Iterate end, double mu) const {
  const auto is_open = [&](Index i, int side) {
    return stage.classes[i] <= BoundClass::Inactive || stage.classes.side[at(i)] != side;
  };
  for (const Index i : canonical_.lower_bounded()) {
    const double distance = canonical_.above_lower(i, end.v[i]);
    if (is_open(i, -1) && distance > 0.0) end.z_lower[i] = mu / distance;
  }
  for (const Index i : canonical_.upper_bounded()) {
    const double distance = canonical_.below_upper(i, end.v[i]);
    if (is_open(i, 1) && distance > 0.0) end.z_upper[i] = mu / distance;
  }
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack < 0 || stage.classes[slack] == BoundClass::Active) continue;
    // Doubtful rows of Max are in the equations, with multipliers of their own.
    if (stage.classes[slack] == BoundClass::Doubtful && canonical_.owned_by_max(slack)) continue;
    end.lambda[j] = canonical_.sign(slack) * (end.z_upper[slack] - end.z_lower[slack]);
  }
  return end;
}

/// After Newton steps on the way to the certified solution: whether the point that is returned is
/// that one, or as near as makes no difference.
bool Certifier::reports_solution(const Stage& stage, const Point& given) {
  const Point& reported = moved_ ? *moved_ : given;
  if (stage.point.iterate.v == reported.iterate.v) return true;
  const auto error = [&](const Point& p) {
    return kkt_error(canonical_, p.iterate, p.evaluation, p.dual, options_.s_max).total;
  };
  Point end = stage.point;
  const auto inside = [&](const DroppedBound& dropped) {
    return stage.classes.distance(canonical_, end.iterate, dropped.variable) > 0.0;
  };
  const double allowed = std::max(error(reported), std::min(options_.tol, options_.acceptable_tol));
  double left = 0.0;
  const auto moves_to = [&](const Iterate& reached, double mu) {
    end.iterate = solution_of(stage, reached, mu);
    if (!std::ranges::all_of(stage.classes.dropped, inside) || !evaluate(end)) return false;
    left = error(end);
    if (!(left <= allowed)) return false;
    moved_ = std::move(end);
    mu_ = mu;
    return true;
  };
  if (moves_to(stage.point.iterate, mu_)) return true;
  const Eigen::VectorXd way = stage.point.iterate.v - reported.iterate.v;
  const bool near =
      !stage.crept && longest(canonical_, way, stage.units) <=
                          kNear * size_of_problem(canonical_, reported.iterate, stage.units);
  if (near && !stage.guessed) return true;
  // The last step has not been taken yet; then multipliers mu / s may be what is left.
  const Iterate& last = stage.newton.end.iterate;
  return moves_to(last, mu_) ||
         (left > 0.0 && moves_to(last, kShareOfError * allowed / left * mu_)) || near;
}

SecondOrder Certifier::certified(const Stage& stage, const Point& given) {
  if ((!stage.guessed && !reports_solution(stage, given)) ||
      (moved_ && !evaluate_objective(*moved_))) {
    reasons_.add(Kind::NotIsolated, Player::Min,
                 "the solution near by is farther than the point's accuracy allows");
    return SecondOrder::Undecided;
  }
  certificate_.margin = margin(1.0);
  certificate_.weakly_active_max = stage.classes.weak_max;
  certificate_.answer = stage.classes.weak_max == 0 ? InnerAnswer::Smooth : InnerAnswer::Unique;
  if (stage.narrow) certificate_.answer = InnerAnswer::StrictlyBest;
  reasons_.add_weakly_active(stage.classes);
  if (stage.dependences) reasons_.add_dependences(*stage.dependences);
  return SecondOrder::Satisfied;
}

/// The test at a point that is not clear, with pivoting.
SecondOrder Certifier::examine(const Point& given) {
  kkt_.begin_pivoting();
  Stage stage;
  stage.point = given;
  stage.units = units_of(canonical_, given.iterate.v, given.evaluation);
  stage.classes = with_idle_held(guess_classes(canonical_, options_, given.iterate, stage.units));
  const bool bounded = !canonical_.lower_bounded().empty() || !canonical_.upper_bounded().empty();
  bool follow = far_ || !stage.classes.clear();
  if (follow && !far_) {
    BoundClasses guess = with_idle_held(
        guess_classes(canonical_, options_, given.iterate, stage.units, kEitherRatio));
    if (guess.clear()) {
      stage.classes = std::move(guess);
      stage.guessed = true;
      follow = false;
    }
  }
  const Index before = kkt_.factorizations();
  Stage start;
  for (;;) {
    if (!settle(stage, follow)) return SecondOrder::Undecided;
    start = stage;
    certificate_.weakly_active_min = stage.classes.weak_min;
    certificate_.weakly_active_max = stage.classes.weak_max;
    if (refine_and_test(stage) && (!stage.guessed || guess_holds(stage, given)))
      return certified(stage, given);
    if (stage.guessed) {
      last_factorization_ += kkt_.factorizations() - before;
      stage.guessed = stopped_ = false;
      stage.units = units_of(canonical_, given.iterate.v, given.evaluation);
      stage.classes =
          with_idle_held(guess_classes(canonical_, options_, given.iterate, stage.units));
    } else if (follow || !bounded || (stage.newton.done && stage.newton.classes_hold) ||
               !may_factorize(kToConfirm + 1)) {
      break;
    }
    follow = true;
    stage.point = given;
    stage.classes.redundant.clear();
    stage.dependences.reset();
    stage.answers.reset();
    stage.newton = {};
  }
  const bool too_many = stage.dependences && stage.dependences->too_many;
  if (!too_many && test_at_vertices(start)) return certified(start, given);
  if (stage.point.iterate.v != given.iterate.v && !evaluate_objective(stage.point)) {
    return SecondOrder::Undecided;
  }
  return judge_without_certificate(stage);
}

SecondOrder Certifier::judge_without_certificate(Stage& stage) {
  ActiveSetSystem system(canonical_, kkt_, stage.classes, stage.units, stage.point.evaluation);
  report_inertias(system);
  if (canonical_.constraints() == 0) certificate_.licq_min = certificate_.licq_max = true;
  // Then K is singular with any help for W.
  const bool too_many = stage.dependences && stage.dependences->too_many;
  const bool vanishing =
      stage.dependences && std::ranges::any_of(stage.dependences->found, &Dependence::vanishing);
  SecondOrder verdict = SecondOrder::Undecided;
  if (vanishing) {
    explain(stage);
    return verdict;
  }
  if (may_factorize(kToRefute) && refute(system, stage)) {
    verdict = SecondOrder::Violated;
  } else if (!too_many && may_factorize(1) && is_valley(system, stage)) {
    verdict = SecondOrder::Flat;
  }
  if (wrong_ && wrong_->owner == Player::Max) return verdict;
  explain(stage);
  if (has_x() && has_y()) certificate_.answer = answer_alone(stage);
  return verdict;
}

bool Certifier::refute(ActiveSetSystem& system, Stage& stage) {
  const std::optional<Player> suspect = wrong_player(system, stage);
  if (suspect) {
    wrong_ =
        find_witness(canonical_, system, stage.point, margin(1.0), stage.newton.step, *suspect);
    return wrong_.has_value();
  }
  return stage.converges && stage.classes.weak_min > 0 && refute_in_cone(system, stage);
}

/// After wrong_player, which leaves K with all help in it: a direction into weakly active bounds.
bool Certifier::refute_in_cone(ActiveSetSystem& system, const Stage& stage) {
  if (stage.classes.weak_max > 0) return false;
  const Eigen::VectorXd added =
      stage.error + Eigen::VectorXd::Constant(canonical_.variables(), margin(1.0));
  const auto cone = critical_cone(system, added);
  if (!cone) return false;
  const Copositivity found = copositivity(cone->curvature);
  if (found.verdict != Copositivity::Verdict::Not) return false;
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(canonical_.variables());
  for (std::size_t k = 0; k < cone->directions.size(); ++k) {
    direction += found.direction[static_cast<Eigen::Index>(k)] * cone->directions[k];
  }
  wrong_ = try_witness(canonical_, system, stage.point, direction, stage.newton.step);
  return wrong_.has_value();
}

/// Of Min where the inner maximum is strict; of Max where there is no x, else it is a reason alone.
bool Certifier::is_valley(ActiveSetSystem& system, const Stage& stage) {
  const bool inner =
      !has_x() || (has_y() && !inner_survives(system, stage.error, margin(1.0)).inner);
  if (inner && !may_factorize(1)) return false;
  const Player player = inner ? Player::Max : Player::Min;
  Valley valley =
      explore_valley(canonical_, system, stage.point, margin(1.0), kFlatTimes * margin(1.0), inner);
  descent_ = std::move(valley.descent);
  if (valley.verdict == Valley::Verdict::None) return false;
  const bool flat = valley.verdict == Valley::Verdict::Flat;
  reasons_.add_direction(flat ? Kind::FlatDirection : Kind::LittleCurvature, player,
                         valley.direction,
                         flat ? "flat: the value is constant along" : "no curvature is seen along");
  return flat && !(inner && has_x()) && stage.classes.clear() && settled(stage, false);
}

void Certifier::explain(const Stage& stage) {
  reasons_.add_weakly_active(stage.classes);
  if (stage.dependences) reasons_.add_dependences(*stage.dependences);
  if (wrong_) return;
  if (stage.newton.done && !stage.newton.classes_hold) {
    reasons_.add(Kind::NotIsolated, Player::Min,
                 "which bounds are active is not settled: a Newton step changes it");
  } else if (!stage.converges) {
    reasons_.add(Kind::NotIsolated, Player::Min,
                 "Newton's method does not contract here: no isolated solution is seen");
  } else if (max_norm(stage.newton.error) > margin(1.0)) {
    reasons_.add(Kind::Unsteady, Player::Min,
                 "second derivatives change by more than the curvature on the way to the solution");
  }
  if (stopped_) {
    reasons_.add(Kind::Effort, Player::Min, "the test was ended after its share of factorizations");
  }
}

/// What is known of y at this x alone.
InnerAnswer Certifier::answer_alone(const Stage& stage) {
  if (!may_factorize(2)) return InnerAnswer::Unknown;
  Stage alone;
  alone.point = stage.point;
  alone.units = stage.units;
  alone.classes = stage.classes;
  for (const IndexRange own : {canonical_.x(), canonical_.x_slacks()}) {
    for (Index i = own.begin; i < own.end; ++i) {
      if (alone.classes[i] == BoundClass::Doubtful) --alone.classes.weak_min;
      alone.classes.of[at(i)] = BoundClass::Active;
      alone.classes.side[at(i)] = 0;
    }
  }
  std::vector<bool>& held = alone.classes.redundant;
  held.assign(at(canonical_.constraints()), false);
  bool smooth = true;
  if (stage.dependences) {
    held = droppable(*stage.dependences, true);
    smooth = held == droppable(*stage.dependences, false);
  }
  const IndexRange min_rows = canonical_.min_constraints();
  for (Index j = min_rows.begin; j < min_rows.end; ++j) held[at(j)] = true;
  ActiveSetSystem system(canonical_, kkt_, alone.classes, alone.units, alone.point.evaluation);
  system.assemble(ActiveSetSystem::kSufficient);
  alone.error = error_of(alone.point, stage.classes, alone.units);
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return solve_accurately(kkt_, system.assembled(), rhs, step);
  };
  if (!newton_confirms(system, alone.point, solve, Probe::EndAndBeyond, alone.newton)) {
    return InnerAnswer::Unknown;
  }
  alone.error += alone.newton.error;
  const InertiaTest test = inner_survives(system, alone.error, margin(1.0));
  if (alone.newton.inner_turn * test.inner_response > kTurn) return InnerAnswer::Unknown;
  if (!test.inner || !(test.inner_response <= kIndependent)) return InnerAnswer::Unknown;
  if (!smooth) return InnerAnswer::StrictlyBest;
  return alone.classes.weak_max == 0 ? InnerAnswer::Smooth : InnerAnswer::Unique;
}

/// The necessary conditions, with the margin given to Max in K where K_yy is right without.
InertiaTest Certifier::helped_by_margin(ActiveSetSystem& system, const Eigen::VectorXd& error) {
  system.assemble({.min_fixed = false, .max_fixed = false}, error, 0.0, -1.0);
  const bool inner_right =
      kkt_.has_expected_inner_inertia(kkt_.factorize_inner({.y = -margin(1.0)}));
  return helped(system, error, margin(1.0), options_.jacobian_regularization_value, inner_right);
}

/// Whose necessary conditions the matrices say are violated; where Newton's method does not
/// converge, those at the point have to do.
std::optional<Player> Certifier::wrong_player(ActiveSetSystem& system, const Stage& stage) {
  if (stage.newton.done && !stage.converges) {
    if (certificate_.inner.positive > certificate_.inner_expected.positive) return Player::Max;
    const bool too_low = certificate_.full.negative > certificate_.full_expected.negative;
    return too_low ? std::optional(Player::Min) : std::nullopt;
  }
  const InertiaTest test = helped_by_margin(system, stage.error);
  if (test.both()) return std::nullopt;
  return test.inner ? Player::Min : Player::Max;
}

/// At mu_target > 0 the point solves the barrier problem, in which no bound is active and all
/// curvature counts.
SecondOrder Certifier::judge_barrier_problem(const Point& given) {
  kkt_.assemble(given.iterate, given.evaluation);
  const double spare = margin(1.0) * std::max(1.0, kkt_.hessian_norm());
  const auto right = [&](double shift) {
    return kkt_.has_expected_inner_inertia(kkt_.factorize_inner({.y = shift})) &&
           kkt_.has_expected_inertia(kkt_.factorize({.x = shift, .y = std::max(shift, 0.0)}));
  };
  if (right(-spare)) {
    certificate_.margin = spare;
    examine_curvature(given, &given.evaluation);
    return barrier_newton_contracts(given) ? SecondOrder::Satisfied : SecondOrder::Undecided;
  }
  kkt_.begin_pivoting();
  const bool refuted = barrier_problem_refuted(spare);
  kkt_.factorize_ahead({}, {});
  certificate_.inner = kkt_.factorize_inner({}).inertia;
  certificate_.full = kkt_.factorize({}).inertia;
  return refuted ? SecondOrder::Violated : SecondOrder::Undecided;
}

/// Whether pivoted factors show another inertia although each player is given so much curvature.
bool Certifier::barrier_problem_refuted(double spare) {
  const auto shows = [](const KktFactors& f) {
    return f.trust.pivoted &&
           (f.status == FactorizationStatus::Ok || f.status == FactorizationStatus::Singular);
  };
  const KktFactors inner = kkt_.factorize_inner({.y = spare});
  if (!kkt_.has_expected_inner_inertia(inner)) return shows(inner);
  const KktFactors full = kkt_.factorize({.x = spare, .y = spare});
  return !kkt_.has_expected_inertia(full) && shows(full);
}

bool Certifier::barrier_newton_contracts(const Point& given) {
  constexpr double kTau = 0.99;
  constexpr double kNegligible = 1e-10;
  Point point = given;
  StepLength alpha;
  bool dependent = false;
  Eigen::VectorXd before = point.iterate.v;
  if (!barrier_newton_step(canonical_, kkt_, mu_, kTau, point, alpha, dependent)) return false;
  const double first = max_norm(point.iterate.v - before);
  if (first <= kNegligible * (1.0 + max_norm(before))) return true;
  before = point.iterate.v;
  return barrier_newton_step(canonical_, kkt_, mu_, kTau, point, alpha, dependent) &&
         max_norm(point.iterate.v - before) <= kContraction * first;
}

SecondOrder Certifier::judge(const Point& given) {
  idle_ = idle_copies(canonical_, given.iterate, given.evaluation);
  const Look look = first_look(given);
  if (look == Look::Wrong) return SecondOrder::Violated;
  SecondOrder verdict = SecondOrder::Satisfied;
  if (look == Look::Unclear) {
    if (options_.minmax_certificate == CertificateEffort::Quick) {
      reasons_.add(Kind::Effort, Player::Min,
                   "not clear at a quick look (minmax_certificate quick)");
      return SecondOrder::Undecided;
    }
    verdict = examine(given);
  }
  if (verdict != SecondOrder::Satisfied) return verdict;
  const Point& judged = moved_ ? *moved_ : given;
  verdict = test_robust_rows(canonical_, kkt_, judged.iterate, judged.evaluation, idle_);
  if (verdict != SecondOrder::Satisfied) {
    certificate_.answer = InnerAnswer::Unknown;
    reasons_.add(Kind::RobustRow, Player::Max,
                 "a robust constraint's worst case is no strict maximum of it");
  }
  return verdict;
}

Finding Certifier::run(const Point& given) {
  certificate_.inner_expected = kkt_.layout().expected_inner();
  certificate_.full_expected = kkt_.layout().expected();
  certificate_.inner = certificate_.inner_expected;
  certificate_.full = certificate_.full_expected;
  hessian_error_ = canonical_.hessian_error(given.iterate.v, given.iterate.lambda);
  certificate_.finite_differences = hessian_error_.has_value();
  if (hessian_error_) certificate_.hessian_error = max_norm(*hessian_error_);
  if (hessian_error_ && !hessian_error_->allFinite()) {
    certificate_.second_order = SecondOrder::Undecided;
    reasons_.add(Kind::Differences, Player::Min,
                 "second derivatives from differences could not be trusted");
  } else if (options_.mu_target > 0.0) {
    certificate_.second_order = judge_barrier_problem(given);
  } else {
    certificate_.second_order = judge(given);
  }
  // Wrong second derivatives may be why nothing could be decided.
  if (certificate_.second_order == SecondOrder::Undecided ||
      certificate_.second_order == SecondOrder::Flat) {
    examine_curvature(given, nullptr);
  }
  std::string remark;
  if (wrong_row_ && certificate_.second_order != SecondOrder::Violated) {
    certificate_.second_order = SecondOrder::Undecided;
    certificate_.hessian_disagrees = true;
    certificate_.answer = InnerAnswer::Unknown;
    remark = "the second derivatives in " + canonical_.column_name(wrong_row_->index) +
             " disagree with differences of the gradient" + percentage(*wrong_row_) +
             ": either may be wrong, and no certificate rests on that; try derivative_test "
             "second-order, which tests both";
    reasons_.add(Kind::WrongHessian, Player::Min, remark);
  }
  if (certificate_.second_order != SecondOrder::Satisfied) {
    certificate_.margin = certificate_.least_curvature = 0.0;
    certificate_.least_curvature_variable = -1;
  }
  if (wrong_) {
    reasons_.add_direction(Kind::WrongCurvature, wrong_->owner, wrong_->direction,
                           wrong_->owner == Player::Min ? "Min gains along" : "Max gains along");
  }
  certificate_.reasons = reasons_.take();
  certificate_.kind = certificate_.second_order == SecondOrder::Satisfied
                          ? PointKind::LocalMinmax
                          : PointKind::FirstOrderPoint;
  return {.certificate = certificate_,
          .point = std::move(moved_),
          .mu = mu_,
          .wrong = std::move(wrong_),
          .descent = std::move(descent_),
          .remark = std::move(remark)};
}

}  // namespace

Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point, double mu,
                const SolverOptions& options, Index factorizations, CertificateArrays& arrays) {
  return Certifier(canonical, kkt, mu, options, factorizations, arrays).run(point);
}

Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point, double mu,
                const SolverOptions& options, Index factorizations) {
  CertificateArrays arrays;
  return certify(canonical, kkt, point, mu, options, factorizations, arrays);
}

}  // namespace ipminmax
