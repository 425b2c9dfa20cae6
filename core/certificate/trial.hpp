#pragma once

#include <optional>
#include <vector>

#include "core/certificate/certificate.hpp"
#include "core/certificate/dependence.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/reasons.hpp"

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
  std::optional<Eigen::VectorXd> hessian_error{};  ///< of differences, canonical units
  std::optional<Deviation> wrong_row{};            ///< of W, along little curvature
  bool stopped = false;                            ///< by the budget of factorizations

  /// Curvature, scaled, that a certificate leaves, at least what factorizations perturb.
  [[nodiscard]] double margin() const;
  /// Step to the solution, over the size of the problem, that is worth going.
  [[nodiscard]] double far() const;
  /// False ends the test of an undecided point.
  [[nodiscard]] bool may_factorize(Index more);
  [[nodiscard]] bool has_x() const { return kkt.layout().x.size() > 0; }
  [[nodiscard]] bool has_y() const { return kkt.layout().y.size() > 0; }
  [[nodiscard]] double error(const Point& point) const;
  [[nodiscard]] Eigen::VectorXd scaled_hessian_error(const VariableScaling& scaling) const;

  /// All but f at the point's iterate: few of the points on the way are asked for their value.
  [[nodiscard]] bool evaluate(Point& point) const;
  [[nodiscard]] bool evaluate_objective(Point& point) const;
  /// To arrays.curvature: little curvature of the factorized matrices; to wrong_row: where W is
  /// wrong along it.
  void examine_curvature(ActiveSetSystem& system, const Point& point,
                         const Eigen::VectorXd& lambda);
  /// The same at the point given, whose active set is not known. assembled: null where no factors
  /// are.
  void examine_curvature(const Evaluation* assembled);
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
[[nodiscard]] Eigen::VectorXd without_inactive(const CanonicalProblem& canonical,
                                               const ActiveBounds& set, Eigen::VectorXd lambda);
/// From entries of W and the Jacobian that neither rounding of the variables nor the last Newton
/// step changes by more than they are: what is left of a cancellation gives no length.
[[nodiscard]] VariableScaling certain_scaling(TestContext& c, const TrialPoint& trial);

/// The Newton step to the solution with the trial's active set: whether Newton's method converges,
/// and the error of W over the step.
void settle_active_set(TestContext& c, TrialPoint& trial, ActiveSetSystem& system);
/// Whether a Newton step with this solver of the system keeps the active set, and the next one would
/// be much shorter.
[[nodiscard]] bool newton_confirms(TestContext& c, TrialPoint& trial, ActiveSetSystem& system,
                                   const KktSolve& solve);

/// Whether the inertias are right for every Hessian within the error and with the margin taken away
/// from both players' curvature, weakly active bounds at their worst: the sufficient conditions
/// hold. K is left factorized with the margin in it (and the error, if there is one). proximal:
/// taken from the curvature of all of Max's variables besides, as of f - proximal |y - y*|^2 / 2.
[[nodiscard]] InertiaTest second_order_test(ActiveSetSystem& system, const Eigen::VectorXd& error,
                                            double margin, double proximal = 0.0,
                                            bool inner_alone = false);
/// Whether the matrices of the test are nonsingular at the end of the step as well.
[[nodiscard]] bool gradients_hold(const TrialPoint& trial);
/// The matrices' inertias at the point without any margin; all zero where no factorizations are
/// left.
void measure_inertias(TestContext& c, ActiveSetSystem& system, TrialPoint& trial);

/// Whether the way from a point to another one is short: share of the problem's size in lengths of
/// curvature, and of each variable's own size; where that is zero, of one and in lengths both.
[[nodiscard]] bool is_near(const TestContext& c, const Eigen::VectorXd& from,
                           const Eigen::VectorXd& to, const VariableScaling& scaling, double share);
/// Whether all dependent rows found are left out; of_max: of Max's.
[[nodiscard]] bool rows_are_left_out(const CanonicalProblem& canonical, const TrialPoint& trial,
                                     bool of_max);

// --- The parts that work with trials, each in a file of its name ---------------------------------

/// The sufficient conditions at a point that is not clear: trials for the solution nearby, and what
/// corrections make of them. trial: of the first look; the one that the verdict is about.
[[nodiscard]] SecondOrder correct_and_test(TestContext& c, bool is_far, TrialPoint& trial);

/// Whether y is a best answer to x nearby, maybe one of many, at a point whose K_yy has no
/// curvature of the wrong sign beyond the trial's proximal term. Either by structure: W has no
/// entries between some of his free variables, Z, and any of them; L is affine in Z then, with slope
/// zero, and constant; without Z and the rows that read it K_yy is right. Or by values: these are
/// constant along all directions without curvature. Reasons name such a direction.
[[nodiscard]] bool maximizes_weakly(TestContext& c, const TrialPoint& trial);

/// What is said of a point that gets no certificate: that it is refuted, by a witness; that it is
/// flat; or why neither is known.
[[nodiscard]] SecondOrder judge_without_certificate(TestContext& c, TrialPoint& trial);

/// Follows the solution to smaller barrier parameters, where the distance of an active bound falls
/// as mu and its multiplier stays, and the other way round at an inactive one: until every bound
/// has shown what it is and the point hardly moves, a distance has lost its digits, or the budget is
/// spent.
void follow_barrier(TestContext& c, TrialPoint& trial);

/// At mu_target > 0 the point solves the barrier problem, in which no bound is active and all
/// curvature counts.
[[nodiscard]] SecondOrder judge_barrier_problem(TestContext& c, TrialPoint& trial);

}  // namespace ipminmax
