#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "core/certificate/certificate.hpp"
#include "core/certificate/dependence.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/reasons.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {

/// What all parts of the second-order test of a point work with.
struct TestContext {
  CanonicalProblem& canonical;
  KktSystem& kkt;
  const SolverOptions& options;
  CertificateArrays& arrays;
  const Point& given;
  Index last_factorization;  ///< that an undecided point may cost, as counted by kkt
  Reasons reasons{canonical};
  std::optional<Vector> hessian_error{};  ///< of differences, canonical units
  std::optional<Deviation> wrong_row{};   ///< of W, along little curvature
  bool stopped = false;                   ///< by the budget of factorizations

  /// Curvature, scaled, that a certificate leaves, at least what factorizations perturb.
  [[nodiscard]] double margin() const {
    return std::max(options.minmax_curvature_tol, 2.0 * kkt.perturbation());
  }
  /// Step to the solution, over the size of the problem, that is worth going.
  [[nodiscard]] double far() const {
    using namespace parameters::certificate;
    return std::clamp(kInTols * options.tol, kLeastFar, kMostFar);
  }
  /// False ends the test of an undecided point.
  [[nodiscard]] bool may_factorize(Index more) {
    const bool may = kkt.factorizations() + more <= last_factorization;
    stopped = stopped || !may;
    return may;
  }
  [[nodiscard]] bool has_x() const { return kkt.layout().x.size() > 0; }
  [[nodiscard]] bool has_y() const { return kkt.layout().y.size() > 0; }
  [[nodiscard]] double error(const Point& point) const {
    return kkt_error(canonical, point.iterate, point.evaluation, point.dual, options.s_max).total;
  }
  [[nodiscard]] Vector scaled_hessian_error(const VariableScaling& scaling) const {
    if (!hessian_error) return {};
    return hessian_error->cwiseProduct(scaling.variable.cwiseAbs2());
  }

  /// All but f at the point's iterate: few of the points on the way are asked for their value.
  [[nodiscard]] bool evaluate(Point& point) const {
    return canonical.constraints(point.iterate.v, point.evaluation.c) == EvaluationStatus::Ok &&
           evaluate_derivatives(canonical, point) == EvaluationStatus::Ok;
  }
  [[nodiscard]] bool evaluate_objective(Point& point) const {
    return canonical.objective(point.iterate.v, point.evaluation.f) == EvaluationStatus::Ok;
  }
  /// To arrays.curvature: little curvature of the factorized matrices; to wrong_row: where W is
  /// wrong along it. The system, or where the active set is not known the matrices' unscaled
  /// derivatives; null: there are no factors.
  void examine_curvature(const Point& point, const Vector& lambda, const VariableScaling& scaling,
                         ActiveSetSystem* system, const Evaluation* assembled = nullptr);
};

/// Solves with the assembled K at a shift, factorized anew at a higher quality as often as needed.
[[nodiscard]] bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation,
                                    const NewtonResidual& rhs, Step& step,
                                    const Regularization& shift = {});

/// Classes of the bounds by z / s at the point, in a raw scaling.
void guess_active_set(const TestContext& c, TrialPoint& trial);
/// Multipliers of inactive inequalities, which are the barrier's, are taken out of W.
[[nodiscard]] bool drop_inactive_multipliers(TestContext& c, TrialPoint& trial);
/// lambda with zero for inactive inequalities.
[[nodiscard]] Vector without_inactive(const CanonicalProblem& canonical, const ActiveBounds& set,
                                      Vector lambda);
/// From entries of W and the Jacobian that neither rounding of the variables and errors of the
/// multipliers nor the last Newton step changes by more than they are: what is left of a
/// cancellation gives no length.
[[nodiscard]] VariableScaling certain_scaling(TestContext& c, const TrialPoint& trial);

/// The Newton step to the solution with the trial's active set: whether Newton's method converges,
/// and the error of W over the step.
void settle_active_set(TestContext& c, TrialPoint& trial, ActiveSetSystem& system);
/// Whether a Newton step with this solver of the system keeps the active set, and the next one
/// would be much shorter. W at the end of the step has no lambda of inactive inequalities. The
/// change is measured at least over a distance that rounding of the derivatives could explain.
[[nodiscard]] bool newton_confirms(TestContext& c, TrialPoint& trial, ActiveSetSystem& system,
                                   const KktSolve& solve);

/// Whether the inertias are right for every Hessian within the error and with the margin taken away
/// from both players' curvature, weakly active bounds at their worst: the sufficient conditions
/// hold. K is left factorized with the margin in it (and the error, if there is one). proximal:
/// taken from the curvature of all of Max's variables besides, as of f - proximal |y - y*|^2 / 2.
[[nodiscard]] InertiaTest second_order_test(ActiveSetSystem& system, const Vector& error,
                                            double margin, double proximal = 0.0,
                                            bool inner_alone = false);
/// Whether the matrices of the test are nonsingular at the end of the step as well.
[[nodiscard]] bool gradients_hold(const TrialPoint& trial);
/// The matrices' inertias at the point without any margin; all zero where no factorizations are
/// left.
void measure_inertias(TestContext& c, ActiveSetSystem& system, TrialPoint& trial);

/// Whether the way from a point to another one is short: share of the problem's size in lengths of
/// curvature, and of each variable's own size; where that is zero, of one and in lengths both.
[[nodiscard]] bool is_near(const TestContext& c, const Vector& from, const Vector& to,
                           const VariableScaling& scaling, double share);
/// Looks for all of them among the constraints that the system counts, weakly active bounds as in
/// its last assemble: inverse iteration with [I J'; J -delta I], one factorization. Constraints are
/// evaluated at a few points nearby. The matrices are left at other values.
[[nodiscard]] Dependences find_dependences(TestContext& c, ActiveSetSystem& system,
                                           const Point& point);

/// Whether all dependent rows found are left out; of_max: of Max's.
[[nodiscard]] bool rows_are_left_out(const CanonicalProblem& canonical, const TrialPoint& trial,
                                     bool of_max);

// --- The parts that work with trials, each in a file of its name ---------------------------------

/// The sufficient conditions at a point that is not clear: trials for the solution nearby, and what
/// corrections make of them. trial: of the first look; the one that the verdict is about.
[[nodiscard]] SecondOrder correct_and_test(TestContext& c, bool is_far, TrialPoint& trial);

/// Whether y is a best answer to x nearby, maybe one of many, at a point whose K_yy has no
/// curvature of the wrong sign beyond the trial's proximal term. Either by structure: W has no
/// entries between some of his free variables, Z, and any of them; L is affine in Z then, with
/// slope zero, and constant; without Z and the rows that read it K_yy is right. Or by values:
/// these are constant along all directions without curvature. Reasons name such a direction.
[[nodiscard]] bool maximizes_weakly(TestContext& c, const TrialPoint& trial);

/// A direction tangent to the active constraints along which the curvature of W (for Min: of phi)
/// has a wrong sign beyond the margin, and along which trial steps in both directions gain what it
/// predicts: the maximizer's value rises, or phi falls. Steps are at least ten times distance (to
/// the solution, scaled), so that it is not the point's own error that is seen. Weakly active
/// bounds are kept. Empty: none was found.
[[nodiscard]] std::optional<WrongCurvature> find_refuting_direction(TestContext& c,
                                                                    ActiveSetSystem& system,
                                                                    const TrialPoint& trial,
                                                                    Player owner);

/// Directions without curvature beyond the margin.
struct FlatDirections {
  enum class Verdict : std::uint8_t {
    /// The value stays the same along all of them, over lengths up to a tenth of the point, to
    /// rounding and what multipliers of relaxed bounds change it by.
    Flat,
    Neither,  ///< it changes, or the model could not be followed along them
    None      ///< there are none
  };
  Verdict verdict = Verdict::None;
  /// The first that is not flat, or the first of all; a step of canonical variables.
  Vector direction;
  /// A step of Min along which the value falls clearly, although curvature does not say so; only
  /// where there is no y.
  std::optional<Vector> descent{};
};

/// At a point that is not refuted, with no weakly active bounds: of Max at this x, of Min with y
/// answering. Curvature up to ten margins counts as little. A few directions, orthogonal, are found
/// by inverse iteration with the matrix helped by the margin: of many flat ones these are general
/// combinations, along which the value changes if it does along any.
[[nodiscard]] FlatDirections find_flat_directions(TestContext& c, ActiveSetSystem& system,
                                                  const Point& point, double margin, Player owner);

/// What is said of a point that gets no certificate: that it is refuted, by a witness; that it is
/// flat; or why neither is known.
[[nodiscard]] SecondOrder judge_without_certificate(TestContext& c, TrialPoint& trial);

/// Follows the solution to smaller barrier parameters, where the distance of an active bound falls
/// as mu and its multiplier stays, and the other way round at an inactive one: until every bound
/// has shown what it is and the point hardly moves, a distance has lost its digits, or the budget
/// is spent.
void follow_barrier(TestContext& c, TrialPoint& trial);

/// Of the point given, whose active set is not known. assembled: null where no factors are.
void examine_unclear_curvature(TestContext& c, const Evaluation* assembled);

/// At a vertex no curvature shows where gradients jump, so these are compared with what W predicts
/// a small step inside the active bounds and inequalities of each player of a game who has no free
/// variable, in two directions. One gradient and Jacobian for each of them.
///
/// Returns a variable whose gradient no longer has the sign that its multipliers balance, or -1.
[[nodiscard]] Index multiplier_lost_inside(TestContext& c, const TrialPoint& trial,
                                           const Point& point);

/// Second-order test of the robust constraints at a point whose K_yy, over (y, lambda_y), is right:
/// is K_yy with their rows right too, In = (m_y, n_y + m_r, 0)?
///
/// Eliminating y leaves -(D - T) on the rows lambda_r, D = s / z of their slacks and T_rs = -J_r
/// K_yy^-1 J_s', so that D - T must be positive definite. T vanishes where each active constraint
/// is stationary in its own y. Where it exceeds D, Max can violate the constraint at second order
/// for a gain of first: Violated. Inactive constraints are left out. The inactive copies are held.
/// The KKT matrices are left at other values.
[[nodiscard]] SecondOrder test_robust_rows(TestContext& c, const TrialPoint& trial,
                                           const Point& point);

/// At mu_target > 0 the point solves the barrier problem, in which no bound is active and all
/// curvature counts.
[[nodiscard]] SecondOrder judge_barrier_problem(TestContext& c, TrialPoint& trial);

}  // namespace ipminmax
