#pragma once

#include <optional>
#include <string>

#include "core/certificate/active_set.hpp"
#include "core/certificate/dependence.hpp"
#include "core/certificate/derivative_checks.hpp"
#include "core/certificate/newton_step.hpp"
#include "core/certificate/robust_rows.hpp"
#include "core/method/step_method.hpp"
#include "core/model/parameters.hpp"
#include "core/result.hpp"

// The second-order test. A TrialPoint is a point near the solution with an active set, a scaling
// and what the tests found of them; it is all that the parts pass on.
//
//  1. certify (certificate). What is known from outside: second derivatives that are differences
//     have an error; copies of y that only inactive robust rows read are held (robust_rows).
//
//  2. first_look (certificate): two factorizations at a clear point. Variable scaling (scaling).
//     Active-set identification by z / s and the KKT system of the active set (active_set). The
//     inertias of K_yy and K with the margin taken from both (trial: second_order_test). The
//     Newton step to the solution: does it keep the active set, would the next one be much
//     shorter, what do W and the active gradients change by on the way (newton_step)? W beside a
//     difference of gradients (derivative_checks). All right: certified. minmax_certificate quick
//     ends here, unless the inertias are wrong.
//
//  3. correct_and_test (corrections): the same at other points, with pivoting. Where bounds are not
//     clear the active set by z / s alone is tried first. A trial that does not pass is changed by
//     the first correction of a table that applies:
//       release_bounds       of Max, that he leaves
//       leave_out_rows       that say nothing beside others (dependence)
//       scale_min_first      lengths of x without what couples x to y
//       take_newton_step     towards the solution
//       follow_path          the active set that shows itself while mu falls (barrier_path)
//       allow_other_answers  K_yy is singular, y best but not unique: curvature is taken from Max,
//                            and y has to maximize, by structure or by values (other_answers)
//     The point that is returned is the one that is spoken of, or moves there.
//
//  4. judge_without_certificate (refutation): refuted, by a direction of wrong curvature; flat, one
//     of many equally good points (directions); or why neither is known (reasons).
//
// With mu_target > 0 the barrier problem is tested instead (barrier_path). The certificate is
// written in one place (certificate: write). Numbers stand in parameters.hpp.

namespace ipminmax {

/// Inertias of the two matrices, and how much a system with each amplifies a generic right-hand
/// side (inverse-norm estimate): moderate numbers show that the gradients of the equalities are
/// independent.
struct InertiaTest {
  bool inner = false;
  bool full = false;
  double inner_response = 0.0;
  double full_response = 0.0;
  [[nodiscard]] bool both() const { return inner && full; }
};

/// A point near the solution with a guess of what is active there, and what was found of them.
struct TrialPoint {
  Point point;
  double mu = 0.0;
  ActiveBounds set;
  VariableScaling scaling;
  bool min_first = false;  ///< rule of the scaling
  InactiveCopies inactive;
  /// Curvature taken from all of Max's variables, scaled, where his best answer is not unique.
  double proximal = 0.0;
  int steps = 0;          ///< of Newton's method that have led here
  bool followed = false;  ///< the active set showed itself while mu fell
  bool relaxed = false;   ///< bounds were released that bound_relax_factor alone made active
  bool is_far = false;    ///< the conditions hold, at a solution that is farther than allowed

  NewtonTest newton;
  bool converges = false;  ///< Newton's method, to a solution with this active set
  Vector error;            ///< of W, scaled
  InertiaTest test;
  std::optional<Dependences> dependences{};

  std::optional<Point> moved{};            ///< nearer to the solution than the point given
  double margin = 0.0;                     ///< that the inertias were right with
  std::optional<Inertia> inner{}, full{};  ///< measured where the test failed or y is not unique
  std::optional<WrongCurvature> wrong{};

  /// At a point, with nothing found; arrays keep their room.
  void begin(const CanonicalProblem& canonical, const Point& here, double its_mu);
  /// The inactive copies are held, and the rows on them left out.
  void hold_inactive();
};

/// What the second-order test found, and where.
struct Finding {
  Certificate certificate;
  /// A point nearer to the solution, with all derivatives and the barrier parameter that belongs to
  /// it, of which the certificate speaks; empty: of the point that was given.
  std::optional<Point> point;
  double mu = 0.0;
  /// Why the verdict is Violated; or, of an undecided minimization, a step to smaller values.
  std::optional<WrongCurvature> wrong;
  std::string remark;  ///< where W is wrong, if it is, without line end
};

/// What the test of a clear point works with, kept from test to test.
struct CertificateArrays {
  ScalingArrays scaling;
  TrialPoint trial;  ///< of the first look
  ActiveSetArrays system;
  NewtonArrays newton;
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
