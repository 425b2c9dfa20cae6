#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "core/certificate/certificate.hpp"
#include "core/certificate/dependence.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/reasons.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// What all parts of the second-order test share.
struct TestContext {
  CanonicalProblem& canonical;
  KktSystem& kkt;
  const SolverOptions& options;
  CertificateArrays& arrays;
  const Point& given;
  Parts parts;               ///< of the workspace
  Index last_factorization;  ///< limit for an undecided point, as counted by kkt
  Reasons reasons{canonical};
  std::optional<Vector> hessian_error{};  ///< of differences, canonical units
  std::optional<Deviation> wrong_row{};   ///< row of W that is wrong, along little curvature
  bool stopped = false;                   ///< by the budget of factorizations

  /// Curvature, scaled, that the test subtracts; at least twice what factorizations perturb.
  [[nodiscard]] double margin() const {
    return std::max(options.minmax_curvature_tol, 2.0 * kkt.perturbation());
  }
  /// Relative length of a step to the solution above which the point is moved.
  [[nodiscard]] double far() const {
    using namespace parameters::certificate;
    return std::clamp(kInTols * options.tol, kLeastFar, kMostFar);
  }
  /// Whether so many more factorizations are allowed. False ends the test of an undecided point.
  [[nodiscard]] bool may_factorize(Index more) {
    const bool may = kkt.factorizations() + more <= last_factorization;
    stopped = stopped || !may;
    return may;
  }
  [[nodiscard]] bool has_x() const { return kkt.layout().x.size() > 0; }
  [[nodiscard]] bool has_y() const { return kkt.layout().y.size() > 0; }
  /// Whether a bound is no farther than its relaxation: the model's own may be active.
  [[nodiscard]] bool within_relaxation(Index i, int side, double distance) const {
    return distance <= 2.0 * relaxation_of(canonical, i, side, options);
  }
  [[nodiscard]] double error(const Point& point) const {
    return barrier_error(canonical, point, 0.0, options.s_max).scaled;
  }
  /// Of a point that is returned in place of this one.
  [[nodiscard]] double allowed_error(const Point& reported) const {
    return std::max(error(reported), std::min(options.tol, options.acceptable_tol));
  }
  /// Not beside another one: both take the same parts of the workspace.
  [[nodiscard]] ActiveSetSystem system_of(const TrialPoint& trial) const {
    return {canonical, kkt, trial.set, trial.scaling, trial.point.evaluation, parts};
  }
  [[nodiscard]] Vector scaled_hessian_error(const VariableScaling& scaling) const {
    if (!hessian_error) return {};
    return hessian_error->cwiseProduct(scaling.variable.cwiseAbs2());
  }

  /// Evaluates everything but f at the point's iterate. Few trial points need their value.
  [[nodiscard]] bool evaluate(Point& point) const {
    return canonical.constraints(point.iterate.v, point.evaluation.c) &&
           evaluate_derivatives(canonical, point);
  }
  [[nodiscard]] bool evaluate_objective(Point& point) const {
    return canonical.objective(point.iterate.v, point.evaluation.f);
  }
  /// Writes the least curvature of the factorized matrices to arrays.curvature, and the row of W
  /// that is wrong along its direction to wrong_row. lambda: for which the point's W was evaluated.
  /// system: null if the active set is not known; then assembled: the matrices' unscaled
  /// derivatives. Both null: there are no factors.
  void examine_curvature(const Point& point, const Vector& lambda, const ActiveSetSystem* system,
                         const Evaluation* assembled = nullptr);
};

/// Solves with the assembled K at a shift. Factorizes again with a higher quality if the solution
/// is not accurate.
[[nodiscard]] bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation,
                                    const NewtonResidual& rhs, Step& step,
                                    const Regularization& shift = {});

/// Returns lambda with zeros for inactive inequalities.
[[nodiscard]] Vector without_inactive(const CanonicalProblem& canonical, const ActiveBounds& set,
                                      Vector lambda);
/// Whether a Newton step with this solver keeps the active set, and the next step would be much
/// shorter. The step tried is longer than what rounding of the derivatives could explain. W at its
/// end has no multipliers of inactive inequalities.
[[nodiscard]] bool newton_confirms(TestContext& c, TrialPoint& trial, ActiveSetSystem& system,
                                   const KktSolve& solve);

/// Tests the sufficient conditions: whether both inertias are right for every Hessian within the
/// error, and with weakly active bounds at their worst. The matrices have
///     K_yy: W_yy + margin - proximal
///     K:    W_xx - margin,  W_yy - margin - proximal
/// proximal: as for f - proximal |y - y*|^2 / 2. K stays factorized with margin and error in it.
[[nodiscard]] InertiaTest second_order_test(ActiveSetSystem& system, const Vector& error,
                                            double margin, double proximal = 0.0);
/// The same of K_yy alone.
[[nodiscard]] InertiaTest inner_test(ActiveSetSystem& system, const Vector& error, double margin,
                                     double proximal = 0.0);
/// Moves the trial to an iterate that its Newton steps reached, where multipliers of open bounds
/// are mu / s, if its error is allowed. Returns the error; infinity: the model is undefined there.
[[nodiscard]] double move_to(TestContext& c, TrialPoint& trial, const Iterate& reached, double mu,
                             double allowed);
/// The same, if need be with a smaller mu. Whether the trial has moved.
[[nodiscard]] bool move_to_end(TestContext& c, TrialPoint& trial, const Iterate& end,
                               double allowed);
/// Whether the matrices of the test stay nonsingular with the gradients at the end of the step.
[[nodiscard]] bool gradients_hold(const TrialPoint& trial);
/// Measures the inertias at the point without margin. All zero if no factorizations are left.
void measure_inertias(TestContext& c, ActiveSetSystem& system, TrialPoint& trial);

/// Guesses the active set by z / s, scaled, and holds inactive copies. A Newton step has to confirm
/// it. A bound is weakly active if the ratio lies between 1 / strict_ratio and strict_ratio. A
/// bound that is no farther than its relaxation is never inactive.
void guess_active_set(const TestContext& c, double strict_ratio, TrialPoint& trial);
/// Whether two points are near each other: scaled, within share of the problem's size; and each
/// variable within a thousandth of its own size, or within a thousandth and, scaled, far().
[[nodiscard]] bool is_near(const TestContext& c, const Vector& from, const Vector& to,
                           const VariableScaling& scaling, double share);
/// Finds dependent gradients among the constraints that the system counts, weakly active bounds as
/// in its last assemble(). Inverse iteration with [I J'; J -delta I] takes one factorization.
/// Constraints are evaluated at a few points nearby. The matrices have other values afterwards.
[[nodiscard]] Dependences find_dependences(TestContext& c, ActiveSetSystem& system,
                                           const Point& point);

/// Whether all dependent rows that were found are left out; of_max: only Max's count.
[[nodiscard]] bool rows_are_left_out(const CanonicalProblem& canonical, const TrialPoint& trial,
                                     bool of_max);

// --- The parts that work with trials, each in a file of its name ---------------------------------

/// Tests the sufficient conditions at a degenerate point, by trials and their corrections. trial:
/// on return the one that the result is about.
[[nodiscard]] SecondOrder correct_and_test(TestContext& c, bool is_far, TrialPoint& trial);

/// The directions found of x without curvature, y answering.
[[nodiscard]] std::vector<Vector> find_uncurved_directions(TestContext& c, ActiveSetSystem& system,
                                                           const TrialPoint& trial);

/// If the model does not change along all of them (a variable that nothing reads, two that occur in
/// a sum alone): every x nearby is as good as one with a variable of each direction where it is
/// now. These are held: what is a strict local minmax of the rest is a local minmax of all. False:
/// there are none, or the model changes.
[[nodiscard]] bool hold_unread(TestContext& c, TrialPoint& next);

/// Whether y is a best answer to x nearby, maybe one of many, at a point whose K_yy has no wrong
/// curvature beyond the trial's proximal term. By structure: W has no entries between some of Max's
/// free variables, Z, and any of them, so L is affine in Z, with slope zero; and K_yy is right
/// without Z and the rows that read it. Or by values: they are constant along all directions
/// without curvature. Reasons name such a direction.
[[nodiscard]] bool maximizes_weakly(TestContext& c, const TrialPoint& trial);

/// Finds a direction tangent to the active constraints along which the curvature of W (for Min: of
/// phi) has a wrong sign beyond the margin. Steps along it, both ways, must gain part of what the
/// curvature predicts: Max's value rises, or phi falls. Steps are at least ten times longer than
/// the Newton step to the solution, so that the point's own error does not count. Weakly active
/// bounds are kept. Empty: none was found.
[[nodiscard]] std::optional<WrongCurvature> find_refuting_direction(TestContext& c,
                                                                    ActiveSetSystem& system,
                                                                    const TrialPoint& trial,
                                                                    Player owner);

/// Directions without curvature beyond the margin.
struct FlatDirections {
  /// There are some, and the value stays the same along the first and a combination of all, up to
  /// rounding and the effect of relaxed bounds, over three lengths of at most a tenth of the
  /// problem's size. False as well if such points could not be computed.
  bool flat = false;
  /// The first direction that is not flat, or the first one; a step of canonical variables. Empty:
  /// there are none.
  Vector direction;
  /// A step of Min along which the value clearly falls although there is no curvature; only without
  /// y.
  std::optional<Vector> descent{};
};

/// Finds directions without curvature at a point that is not refuted: of Max at this x, or of Min
/// with y answering. Weakly active bounds are kept. Curvature up to ten margins counts as none.
/// Inverse iteration gives a few orthogonal directions. They are general combinations of all
/// flat ones, so the value changes along them if it changes along any.
[[nodiscard]] FlatDirections find_flat_directions(TestContext& c, ActiveSetSystem& system,
                                                  const Point& point, double margin, Player owner);

/// Decides about a point that gets no certificate: it is refuted by a direction, it is flat, or it
/// is undecided with reasons.
[[nodiscard]] SecondOrder judge_without_certificate(TestContext& c, TrialPoint& trial);

/// Follows the solution to smaller barrier parameters. The distance of an active bound falls as mu
/// and its multiplier stays; at an inactive one it is the other way round. Ends if every bound is
/// classified and the point hardly moves, if a distance has lost its digits, or with the budget.
void follow_barrier_path(TestContext& c, TrialPoint& trial);

/// Checks a vertex, where curvature does not show that gradients jump. For each player of a game
/// without free variables the gradient is compared with what W predicts a small step inside the
/// active bounds and inequalities, in two directions. Each takes one gradient and Jacobian.
///
/// Returns a variable whose gradient no longer has the sign that its multipliers balance, or -1.
[[nodiscard]] Index multiplier_lost_inside(TestContext& c, const TrialPoint& trial,
                                           const Point& point);

/// Tests the second-order conditions of robust constraints at a point whose K_yy, over (y,
/// lambda_y), is right. K_yy with their rows must be right too: In = (m_y, n_y + m_r, 0).
///
/// Eliminating y leaves -(D - T) on the rows lambda_r, D = s / z of their slacks and T_rs = -J_r
/// K_yy^-1 J_s', so that D - T must be positive definite. T vanishes if each active constraint is
/// stationary in its own y. If T exceeds D, Max can violate the constraint: Violated. Inactive
/// constraints are left out and their copies held. The KKT matrices have other values afterwards.
[[nodiscard]] SecondOrder test_robust_rows(TestContext& c, const TrialPoint& trial,
                                           const Point& point);

[[nodiscard]] InactiveCopies inactive_copies(const CanonicalProblem& canonical,
                                             const Iterate& iterate,
                                             const VariableScaling& scaling);

/// Tests a point with mu_target > 0. It solves the barrier problem, in which no bound is active and
/// all curvature counts.
[[nodiscard]] SecondOrder judge_barrier_problem(TestContext& c, TrialPoint& trial);

}  // namespace ipminmax
