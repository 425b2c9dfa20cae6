#pragma once

#include <optional>
#include <string>

#include "core/certificate/active_set.hpp"
#include "core/certificate/corner_check.hpp"
#include "core/certificate/hessian_check.hpp"
#include "core/certificate/newton_test.hpp"
#include "core/certificate/units.hpp"
#include "core/kkt/system.hpp"
#include "core/method/step_method.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/parameters.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"
#include "core/result.hpp"

// The second-order test, in the order in which it looks. Each part has a file of its name.
//
//  1. judge (certificate). What is known from outside: second derivatives that are differences
//     have an error (hessian_error); copies of y that only inactive robust rows read are held
//     (robust_rows).
//
//  2. first_look (certificate): two factorizations at a clear point. Lengths in which entries of
//     W are at most 1 (units). Active bounds by z / s (bound_classes). The KKT system of the
//     active set (active_set), and the inertias of K_yy and K with the margin taken from both
//     (second_order). The Newton step to the solution: does it keep the classes, would the next
//     one be much shorter, what do W and the active gradients change by on the way (newton_test)?
//     W beside a difference of gradients (hessian_check). All right: certified. minmax_certificate
//     quick ends here, unless the inertias are wrong.
//
//  3. examine (remedies): the same at other points, with pivoting. A candidate is a point on its
//     way to a solution, with classes of its bounds (candidate). The first one has those by z / s,
//     the second one those that show themselves while mu falls (bound_classes: follow_barrier,
//     barrier_step). One that does not pass is handed to remedies, in this order, until none
//     applies:
//       release_bounds    of Max, that he leaves
//       leave_out_rows    that say nothing beside others (dependence)
//       measure_min_first lengths of x without what couples x to y
//       take_newton_step  towards the solution
//
//  4. with_many_answers (remedies): K_yy is singular, y best but not unique. The same with
//     curvature taken from Max, and whether y maximizes: by structure, or by values
//     (weak_maximum).
//
//  5. with_basic_multipliers (remedies): gradients depend on each other at this point alone. One
//     choice of multipliers is enough (basic_multipliers).
//
//  6. certified (remedies): the point that is returned is the one that is spoken of, or moves
//     there (reported_point). Robust rows have a condition of their own (robust_rows).
//
//  7. judge_without_certificate (refutation): refuted, by a direction of wrong curvature, also
//     into weakly active bounds of either player; flat, one of many equally good points
//     (direction); or why neither is known (reasons), and what is known of y at this x.
//
// With mu_target > 0 the barrier problem is tested instead (barrier_test). All of them share a
// TestContext: the problem, the budget of factorizations, and what has been found for the answer.
// Their numbers stand in parameters.hpp.

namespace ipminmax {

/// What the second-order test found, and where.
struct Finding {
  Certificate certificate;
  /// A point nearer to the solution, with all derivatives and the barrier parameter that belongs to
  /// it, of which the certificate speaks; empty: of the point that was given.
  std::optional<Point> point;
  double mu = 0.0;
  std::optional<WrongCurvature> wrong;  ///< why the verdict is Violated
  std::string remark;  ///< where W is wrong, if it is, without line end
};

/// What the test of a clear point works with, kept from test to test.
struct CertificateArrays {
  UnitsArrays units;  ///< at the point that is given
  BoundClasses classes;
  ActiveSetArrays system;
  NewtonTest newton;
  NewtonArrays newton_step;
  CurvatureArrays curvature;
  CornerArrays corner;
};

/// Second-order test at a first-order point: the paper's Proposition "Second order sufficient
/// conditions for constrained minmax", all regularization off. The claim, its hypotheses and what
/// of them is proved, checked or trusted: docs/algorithm.md, "Second-order test".
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
                              Index factorizations = parameters::kPlenty);

}  // namespace ipminmax
