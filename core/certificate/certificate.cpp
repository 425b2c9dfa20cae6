#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/certificate.hpp"
#include "core/point/merit.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {
namespace {

/// z / s above which a bound is active, and its inverse below which it is inactive.
constexpr double kStrictRatio = 100.0;
/// Barrier curvature of a slack that is away from its bounds; not 0, because slack rows are
/// eliminated by dividing by it.
constexpr double kInactiveCurvature = 1e-12;

/// Newton's method counts as contracting when the second step with the same matrix is at most this
/// fraction of the first (1/4 for x^3 at 0, below it quadratic convergence is near).
constexpr double kContraction = 0.1;
/// Margins so many times minmax_curvature_tol owe nothing to the distance to the solution, if that
/// is below the fraction of the margin.
constexpr double kClear = 100.0;
constexpr double kNear = 0.1;
/// Relative length of a Newton step that is rounding.
constexpr double kNegligibleStep = 1e-10;

struct BoundClasses {
  std::vector<bool> active;      ///< per canonical variable; weakly active ones included
  Eigen::VectorXd with_weak;     ///< barrier curvature, weakly active bounds keep theirs
  Eigen::VectorXd without_weak;  ///< barrier curvature, weakly active bounds count as inactive
  Index weak_min = 0, weak_max = 0;
};

BoundClasses classify(const CanonicalProblem& canonical, const Iterate& iterate) {
  BoundClasses classes;
  const Index n = canonical.variables();
  classes.active.assign(static_cast<std::size_t>(n), false);
  classes.with_weak.setZero(n);
  for (const IndexRange slacks : {canonical.x_slacks(), canonical.y_slacks()}) {
    for (Index i = slacks.begin; i < slacks.end; ++i) classes.with_weak[i] = kInactiveCurvature;
  }
  classes.without_weak = classes.with_weak;
  const auto add = [&](Index i, double distance, double multiplier) {
    const double ratio = multiplier / distance;
    if (ratio < 1.0 / kStrictRatio) return;
    classes.active[static_cast<std::size_t>(i)] = true;
    classes.with_weak[i] += ratio;
    if (ratio > kStrictRatio) {
      classes.without_weak[i] += ratio;
    } else {
      ++(canonical.owned_by_max(i) ? classes.weak_max : classes.weak_min);
    }
  };
  for (const Index i : canonical.lower_bounded()) {
    add(i, iterate.v[i] - canonical.lower()[i], iterate.z_lower[i]);
  }
  for (const Index i : canonical.upper_bounded()) {
    add(i, canonical.upper()[i] - iterate.v[i], iterate.z_upper[i]);
  }
  return classes;
}

/// Whether both inertias are right with the given curvature added to x and taken from y.
struct InertiaTest {
  bool inner = false;
  bool full = false;
  [[nodiscard]] bool both() const { return inner && full; }
};

double max_norm(const Eigen::VectorXd& v) {
  return v.size() == 0 ? 0.0 : v.lpNorm<Eigen::Infinity>();
}

/// Solves with the assembled matrix, factorized anew at a higher quality as often as needed.
/// factorized: whether its factors are there.
bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation, const NewtonResidual& rhs,
                      bool factorized, Step& step) {
  for (;;) {
    if (!factorized && kkt.factorize_for_solutions({}).status != FactorizationStatus::Ok) {
      return false;
    }
    if (kkt.solve(evaluation, rhs, step)) return true;
    if (!kkt.increase_quality()) return false;
    factorized = false;
  }
}

/// Newton's method at fixed mu from a point: whether the second step with the same matrix is a
/// fraction of the first. The point is left at the end of the first step, whose length is added to
/// distance.
bool newton_contracts_here(CanonicalProblem& canonical, KktSystem& kkt, double mu, Point& point,
                           bool& stop, double& distance) {
  stop = true;
  kkt.assemble(point.iterate, point.evaluation);
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  newton_residual(canonical, point.iterate, point.evaluation, point.dual, mu, rhs);
  if (!solve_accurately(kkt, point.evaluation, rhs, false, step)) return false;
  const double first = max_norm(step.v);
  distance += first;
  if (first <= kNegligibleStep * (1.0 + max_norm(point.iterate.v))) return true;

  constexpr double kTau = 0.99;
  const StepLength alpha = largest_step(canonical, point.iterate, step, kTau);
  const bool full = alpha.primal == 1.0 && alpha.dual == 1.0;
  Point next{point.iterate, {}, {}};  // all but the Hessian
  next.evaluation.c = point.evaluation.c;
  next.evaluation.gradient = point.evaluation.gradient;
  next.evaluation.jacobian = point.evaluation.jacobian;
  next.dual = point.dual;
  advance(step, alpha, next.iterate);
  if (canonical.constraints(next.iterate.v, next.evaluation.c) != EvaluationStatus::Ok ||
      canonical.first_derivatives(next.iterate.v, next.evaluation) != EvaluationStatus::Ok) {
    return false;
  }
  dual_residual(canonical, next.iterate, next.evaluation, next.dual);
  newton_residual(canonical, next.iterate, next.evaluation, next.dual, mu, rhs);
  // Solved with the first point's matrix, barrier terms included.
  if (!solve_accurately(kkt, point.evaluation, rhs, true, step)) return false;
  stop = false;
  next.evaluation.f = point.evaluation.f;
  std::swap(point.evaluation.hessian, next.evaluation.hessian);
  std::swap(point, next);
  return full && max_norm(step.v) <= kContraction * first;
}

/// Whether Newton's method for the equations at mu converges fast from the point; a weakly active
/// bound may need a few steps to get there. Leaves the point where that was seen, its Hessian that
/// of one step before.
bool newton_contracts(CanonicalProblem& canonical, KktSystem& kkt, double mu, Point& point,
                      double& distance) {
  constexpr int kRounds = 4;
  for (int round = 0;; ++round) {
    bool stop = false;
    if (newton_contracts_here(canonical, kkt, mu, point, stop, distance)) return true;
    if (stop || round == kRounds) return false;
    if (canonical.second_derivatives(point.iterate.v, point.iterate.lambda, point.evaluation) !=
        EvaluationStatus::Ok) {
      return false;
    }
  }
}

/// Goes on to the solution that Newton's method converges to, with derivatives of all orders there.
bool refine(CanonicalProblem& canonical, KktSystem& kkt, double mu, Point& point) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    bool stop = false;
    double distance = 0.0;
    if (canonical.second_derivatives(point.iterate.v, point.iterate.lambda, point.evaluation) !=
            EvaluationStatus::Ok ||
        !newton_contracts_here(canonical, kkt, mu, point, stop, distance)) {
      return false;
    }
    if (stop) return true;  // the step was negligible
  }
  return canonical.second_derivatives(point.iterate.v, point.iterate.lambda, point.evaluation) ==
         EvaluationStatus::Ok;
}

class SecondOrderTest {
 public:
  /// error: diagonal bound of the error of W, zero when W is exact.
  SecondOrderTest(const CanonicalProblem& canonical, KktSystem& kkt, const Evaluation& evaluation,
                  const Eigen::VectorXd& error, const SolverOptions& options)
      : canonical_(canonical),
        kkt_(kkt),
        evaluation_(evaluation),
        error_(error),
        options_(options) {}

  /// Right with curvature to spare: satisfied beyond doubt.
  InertiaTest survives(const Eigen::VectorXd& curvature, double margin) {
    InertiaTest test;
    // The worst W for the maximizer has + error in y; for the minimizer - error everywhere, for
    // then phi'' = W_xx - W_xy W_yy^-1 W_yx (on the tangent spaces) is smallest.
    kkt_.assemble(evaluation_, shifted(curvature, 0.0, -1.0));
    if (!has_error()) kkt_.factorize_ahead({.y = -margin}, {.x = -margin});
    test.inner = kkt_.has_expected_inner_inertia(kkt_.factorize_inner({.y = -margin}));
    const bool inner_stable = test.inner && (kkt_.pivots() || inner_backward_stable());
    if (has_error()) kkt_.assemble(evaluation_, shifted(curvature, -1.0, 1.0));
    test.full = kkt_.has_expected_inertia(kkt_.factorize({.x = -margin}));
    if (test.both() && !kkt_.pivots() && !(inner_stable && backward_stable())) test = {};
    return test;
  }

  /// Right when some curvature is given: not refuted.
  InertiaTest helped(const Eigen::VectorXd& curvature, double margin, bool inner_satisfied) {
    kkt_.assemble(evaluation_, shifted(curvature, 1.0, 1.0));
    const double multiplier_shift = options_.jacobian_regularization_value;
    const Regularization help{.x = margin,
                              .y = inner_satisfied ? 0.0 : margin,
                              .lambda_x = multiplier_shift,
                              .lambda_y = multiplier_shift};
    InertiaTest test;
    test.inner = inner_satisfied || kkt_.has_expected_inner_inertia(kkt_.factorize_inner(help));
    if (has_error() && inner_satisfied) kkt_.assemble(evaluation_, shifted(curvature, 1.0, -1.0));
    test.full = kkt_.has_expected_inertia(kkt_.factorize(help));
    return test;
  }

 private:
  /// Without pivoting an inertia is trusted only when the factors reproduce the matrix: a system
  /// with a generic right-hand side must refine to a small residual.
  bool backward_stable() {
    const NewtonResidual rhs = generic_right_hand_side();
    Step step = zero_step(canonical_);
    return kkt_.solve(evaluation_, rhs, step);
  }
  bool inner_backward_stable() {
    const NewtonResidual rhs = generic_right_hand_side();
    Step step = zero_step(canonical_);
    return kkt_.solve_inner(evaluation_, rhs, step);
  }
  [[nodiscard]] NewtonResidual generic_right_hand_side() const {
    NewtonResidual rhs = zero_step(canonical_);
    // Slack rows are eliminated exactly, so they need no test.
    for (const IndexRange range : {canonical_.x(), canonical_.y()}) {
      for (Index i = range.begin; i < range.end; ++i) rhs.v[i] = std::sin(1.0 + i);
    }
    for (Index j = 0; j < canonical_.constraints(); ++j) rhs.lambda[j] = std::cos(1.0 + j);
    return rhs;
  }

  [[nodiscard]] bool has_error() const { return error_.size() > 0; }
  /// Barrier curvatures with so many times the error added to Min and Max variables.
  [[nodiscard]] Eigen::VectorXd shifted(const Eigen::VectorXd& curvature, double min_times,
                                        double max_times) const {
    if (!has_error()) return curvature;
    Eigen::VectorXd result = curvature;
    for (Index i = 0; i < canonical_.variables(); ++i) {
      result[i] += (canonical_.owned_by_max(i) ? max_times : min_times) * error_[i];
    }
    return result;
  }

  const CanonicalProblem& canonical_;
  KktSystem& kkt_;
  const Evaluation& evaluation_;
  const Eigen::VectorXd& error_;
  const SolverOptions& options_;
};

/// clear: whether to ask for 100 times the margin first; at the end, whether that was there.
SecondOrder second_order(const CanonicalProblem& canonical, KktSystem& kkt,
                         const BoundClasses& classes, const Evaluation& evaluation,
                         const Eigen::VectorXd& error, const SolverOptions& options,
                         Certificate& certificate, bool& clear) {
  SecondOrderTest test(canonical, kkt, evaluation, error, options);
  kkt.assemble(evaluation, classes.without_weak);
  // Gamma distorts curvature by gamma, so the margin has to dominate it.
  const double margin = std::max(options.minmax_curvature_tol * std::max(kkt.hessian_norm(), 1.0),
                                 2.0 * kkt.perturbation());
  certificate.margin = kClear * margin;
  InertiaTest spare;
  if (clear) spare = test.survives(classes.without_weak, certificate.margin);
  clear = spare.both();
  if (!clear) {
    certificate.margin = margin;
    spare = test.survives(classes.without_weak, margin);
  }
  if (spare.both()) {
    const KktSystem::RankFinding rank = kkt.active_rank(evaluation, classes.active);
    certificate.licq_min = rank.full_min;
    certificate.licq_max = rank.full_max;
    // Independent Max gradients make the inner maximum follow x; a Min point needs none.
    const bool inner_follows = rank.full_max || kkt.layout().x.size() == 0;
    return inner_follows ? SecondOrder::Satisfied : SecondOrder::Undecided;
  }
  certificate.margin = 0.0;
  const InertiaTest helped = test.helped(classes.with_weak, margin, spare.inner);
  const KktSystem::RankFinding rank = kkt.active_rank(evaluation, classes.active);
  certificate.licq_min = rank.full_min;
  certificate.licq_max = rank.full_max;
  // Where an active gradient vanishes the second-order conditions are not necessary.
  return helped.both() || rank.vanishing ? SecondOrder::Undecided : SecondOrder::Violated;
}

}  // namespace

Certificate certify(CanonicalProblem& canonical, KktSystem& kkt, const Iterate& iterate,
                    const Evaluation& evaluation, double mu, const SolverOptions& options) {
  Certificate certificate;
  kkt.require_certain_inertia(true);
  const BoundClasses classes = classify(canonical, iterate);
  certificate.weakly_active_min = classes.weak_min;
  certificate.weakly_active_max = classes.weak_max;
  certificate.inner_expected = kkt.layout().expected_inner();
  certificate.full_expected = kkt.layout().expected();
  const auto hessian_error = canonical.hessian_error(iterate.v, iterate.lambda);
  const Eigen::VectorXd error = hessian_error.value_or(Eigen::VectorXd());
  certificate.finite_differences = hessian_error.has_value();
  certificate.hessian_error = max_norm(error);
  const bool unknown = !error.allFinite();

  bool clear = true;
  certificate.second_order = unknown ? SecondOrder::Undecided
                                     : second_order(canonical, kkt, classes, evaluation, error,
                                                    options, certificate, clear);
  // Anything but a clear yes is asked again with pivoting.
  if (certificate.second_order != SecondOrder::Satisfied && !unknown && !kkt.pivots()) {
    while (!kkt.pivots() && kkt.increase_quality()) {
    }
    clear = true;
    certificate.second_order =
        second_order(canonical, kkt, classes, evaluation, error, options, certificate, clear);
  }
  if (certificate.second_order == SecondOrder::Satisfied) {
    Point point{iterate, evaluation, {}};
    dual_residual(canonical, iterate, evaluation, point.dual);
    double distance = 0.0;  // to the solution
    bool confirmed = newton_contracts(canonical, kkt, mu, point, distance);
    const bool was_clear = clear;
    clear = clear && distance <= kNear * kClear * options.minmax_curvature_tol;
    if (confirmed && !clear) {
      clear = was_clear;
      // So little curvature may be due to the distance to the solution (f = x^2 + y^3 + x y).
      confirmed = refine(canonical, kkt, mu, point) &&
                  second_order(canonical, kkt, classify(canonical, point.iterate), point.evaluation,
                               error, options, certificate, clear) == SecondOrder::Satisfied;
    }
    if (!confirmed) {
      certificate.second_order = SecondOrder::Undecided;
      certificate.margin = 0.0;
    }
  }
  if (certificate.second_order == SecondOrder::Satisfied) {
    // Inertias right with curvature taken away are right without.
    certificate.inner = certificate.inner_expected;
    certificate.full = certificate.full_expected;
  } else {
    kkt.assemble(evaluation, classes.without_weak);
    kkt.factorize_ahead({}, {});
    certificate.inner = kkt.factorize_inner({}).inertia;
    certificate.full = kkt.factorize({}).inertia;
  }
  certificate.kind = certificate.second_order == SecondOrder::Satisfied
                         ? PointKind::LocalMinmax
                         : PointKind::FirstOrderPoint;
  kkt.require_certain_inertia(false);
  return certificate;
}

}  // namespace ipminmax
