#pragma once

#include <optional>
#include <string>

#include "core/certificate/active_set.hpp"
#include "core/certificate/contraction.hpp"
#include "core/certificate/hessian_check.hpp"
#include "core/certificate/units.hpp"
#include "core/kkt/system.hpp"
#include "core/method/wrong_curvature.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/merit.hpp"
#include "core/result.hpp"

// The second-order test, in the order in which it looks:
//
//  1. judge (certificate.cpp). Units: lengths in which entries of W are at most 1 (units). Copies of
//     y that only inactive robust rows read are held (robust_rows).
//  2. first_look: active bounds by z / s (bound_classes), the system of the active set in units
//     (active_set), inertias of K_yy and K with the margin in them (second_order), the Newton step
//     to the solution with what W and the gradients change by on the way (contraction), the model's
//     W beside a difference of gradients (hessian_check). Right: certified. Wrong, with a direction
//     tangent to the active constraints along which steps gain (witness, walk): refuted.
//  3. examine (examination.cpp), with pivoting, where that is not clear. Guessed classes first, then
//     those that show themselves while mu falls (follow_barrier). refine_and_test makes Newton steps
//     (newton, stage) until W changes by less than its curvature; on the way it tries: bounds of Max
//     that he leaves as inactive, directions into weakly active bounds of Min alone (critical_cone,
//     copositive), lengths of x by Max's real answers, longer lengths along little curvature, rows
//     that say nothing beside others left out (dependence).
//  4. test_with_many_answers: K_yy and K with curvature taken from Max, and whether y maximizes
//     (weak_maximum, valley).
//  5. test_at_vertices: one choice of multipliers where gradients depend on each other (vertex).
//  6. certified: the point that is returned is the one that is spoken of, or becomes it
//     (reported_point); robust rows have their own condition (robust_rows).
//  7. judge_without_certificate (refutation.cpp): a witness with wrong curvature, also into weakly
//     active bounds of either player; a valley of equally good points; else why nothing is known
//     (reasons), and what is known of y.
//
// With mu_target > 0 the barrier problem is tested instead (barrier_test). A case (case.hpp) is what
// all of them work with and what they have found; a stage (stage.hpp) is a point on its way.

namespace ipminmax {

/// What the second-order test found, and where.
struct Finding {
  Certificate certificate;
  /// A point nearer to the solution, with all derivatives and the barrier parameter that belongs to
  /// it, of which the certificate speaks; empty: of the point that was given.
  std::optional<Point> point;
  double mu = 0.0;
  std::optional<WrongCurvature> wrong;  ///< why the verdict is Violated
  /// A step of Min to smaller values, although no curvature was found that refutes the point.
  std::optional<Eigen::VectorXd> descent;
  std::string remark;  ///< where W is wrong, if it is, without line end
};

/// What the test of a clear point works with, kept from test to test.
struct CertificateArrays {
  UnitsArrays units;  ///< at the point that is given
  BoundClasses classes;
  ActiveSetArrays system;
  NewtonTest newton;
  Eigen::VectorXd change;  ///< of W on the way to the solution, in units
  NewtonArrays newton_step;
  CurvatureArrays curvature;
};

inline constexpr Index kGenerousFactorizations = 100;

/// Second-order test at a first-order point: the paper's Proposition "Second order sufficient
/// conditions for constrained minmax", all regularization off. The claim, its hypotheses and what
/// of them is proved, checked or trusted: core/algorithm.md, "Second-order test".
///
/// point: f, c, first and second derivatives and the dual residual at the iterate. The KKT matrices
/// are left at the certificate's values. factorizations: that may be spent on an undecided point,
/// beyond those of the first look; options.minmax_certificate: Full or Quick.
[[nodiscard]] Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point,
                              double mu, const SolverOptions& options, Index factorizations,
                              CertificateArrays& arrays);
/// The same with arrays of its own.
[[nodiscard]] Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point,
                              double mu, const SolverOptions& options,
                              Index factorizations = kGenerousFactorizations);

}  // namespace ipminmax
