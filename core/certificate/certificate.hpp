#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "core/certificate/active_set.hpp"
#include "core/certificate/dependence.hpp"
#include "core/certificate/newton_step.hpp"
#include "core/differences/directional_check.hpp"
#include "core/method/step_method.hpp"
#include "core/model/parameters.hpp"
#include "core/result.hpp"

// The second-order test. A TrialPoint is a point near the solution, with an active set, a scaling
// and the results of the tests. It is all that the parts pass to each other.
//
//  1. certify (certificate). Prepares: the error of second derivatives that are differences; holds
//     copies of y that only inactive robust rows read (robust_rows).
//
//  2. first_look (certificate), the nondegenerate test: 2 or 4 factorizations. Variable scaling
//     (scaling). Active-set identification by z / s and the KKT system of the active set
//     (active_set). The inertias of K_yy and K with the margin taken from both (trial:
//     second_order_test). The Newton step to the solution: does it keep the active set, would the
//     next step be much shorter, how much do W and the active gradients change on the way
//     (newton_step)? Comparison of W with a difference of gradients (derivative_checks). If all is
//     right the point is certified. minmax_certificate quick ends here, unless the inertias are
//     wrong.
//
//  3. correct_and_test (corrections), the degenerate test: the same at other points, with pivoting.
//     If the active set is not clear, the set by z / s alone is tried first. If the set is not
//     clear or the solution far, the trials start after following the path. If a trial does not
//     pass, the first correction of this table that applies changes it:
//       release_bounds       that the Newton step shows to be inactive
//       leave_out_rows       that are redundant (dependence)
//       hold_unread          a variable of each step of x that the model does not read
//       take_newton_step     towards the solution
//       follow_barrier_path  finds the active set while mu falls (barrier_path)
//       allow_other_answers  K_yy is singular, y best but not unique: takes curvature from Max; y
//                            must maximize, by structure or by values (other_answers)
//     The returned point is the certified one: it moves there if necessary.
//
//  4. judge_without_certificate (refutation): refuted, by a direction of wrong curvature; flat, one
//     of many equally good points (directions); or undecided, with reasons (reasons).
//
// With mu_target > 0 the barrier problem is tested instead (barrier_path). The certificate is
// written in one place (certificate: write). The numbers are in parameters.hpp.

namespace ipminmax {

/// Whether the two matrices have the expected inertias, and inverse-norm estimates: the largest
/// entry of the solution for a generic right-hand side. Moderate values show that the gradients of
/// the equalities are independent.
struct InertiaTest {
  bool inner = false;
  bool full = false;
  double inner_inverse_norm = 0.0;
  double full_inverse_norm = 0.0;
  [[nodiscard]] bool both() const { return inner && full; }
  [[nodiscard]] double inverse_norm() const {
    return std::max(inner_inverse_norm, full_inverse_norm);
  }
};

/// Inactive copies: copies of y that serve inactive robust constraints (CanonicalProblem::owners).
/// Their values do not matter to x, and they have no curvature because lambda_r goes to 0. The test
/// holds them and leaves out Max's rows on them.
struct InactiveCopies {
  std::vector<Index> variables;
  std::vector<bool> rows;  ///< per canonical constraint, or empty
};

/// A point near the solution with a guess of its active set, and the results of the tests.
struct TrialPoint {
  Point point;
  double mu = 0.0;
  ActiveBounds set;
  VariableScaling scaling;
  InactiveCopies inactive;
  /// Curvature subtracted from all of Max's variables, scaled, if the best answer is not unique.
  double proximal = 0.0;
  Vector unread;          ///< a step of x that the model does not read; one variable of it is held
  int steps = 0;          ///< of Newton's method that have led here
  bool followed = false;  ///< the active set was found while mu fell
  /// Bounds were released that bound_relax_factor alone made active.
  bool released_relaxed_bound = false;
  bool is_far = false;  ///< the conditions hold, at a solution that is farther than allowed

  NewtonTest newton;
  bool converges = false;  ///< Newton's method, to a solution with this active set
  Vector error;            ///< of W, scaled
  InertiaTest test;
  std::optional<Dependences> dependences{};

  std::optional<Point> moved{};            ///< point nearer to the solution than the given one
  double margin = 0.0;                     ///< with which the inertias were right
  std::optional<Inertia> inner{}, full{};  ///< measured if the test failed or y is not unique
  std::optional<WrongCurvature> wrong{};

  /// Starts a trial at a point, without results. Arrays keep their memory.
  void begin(const CanonicalProblem& canonical, const Point& here, double its_mu) {
    point = here;
    mu = its_mu;
    set.reset(canonical);
    inactive = {};
    test = {};
    newton.clear();
    inner.reset();
    full.reset();
    moved.reset();
  }
  /// Holds the inactive copies and leaves out the rows on them.
  void hold_inactive() {
    for (const Index i : inactive.variables) set.hold(i);
    set.held_rows = inactive.rows;
  }
};

/// What the second-order test found, and where.
struct Finding {
  Certificate certificate;
  /// The point that the certificate is about, with all derivatives and the barrier parameter that
  /// belongs to it. Empty: it is about the given point.
  std::optional<Point> point;
  double mu = 0.0;
  /// The direction that refutes a point (Violated). In an undecided minimization: a step to smaller
  /// values.
  std::optional<WrongCurvature> wrong;
  std::string remark;  ///< which entry of W is wrong; empty: none. Without line end
};

/// An upper estimate of the least curvature of both matrices, scaled, by two inverse iterations.
struct LittleCurvature {
  double least = 1.0;
  Index variable = -1;  ///< canonical, the one that moves most along the least; -1: no factors
};

/// Work arrays of the test, kept from test to test; the workspace is its own while it runs.
struct CertificateArrays : Workspace {
  VariableScaling scaling;
  TrialPoint trial;  ///< of the first look
  LittleCurvature curvature;
};

/// Makes the second-order test at a first-order point: the paper's Proposition "Second order
/// sufficient conditions for constrained minmax", all regularization off. For the claim, its
/// hypotheses and how they are checked see docs/algorithm.md, "Second-order test".
///
/// point: with f, c, first and second derivatives and the dual residual at the iterate.
/// factorizations: how many an undecided point may cost, with kToConfirm more. A refutation and the
/// test of robust rows are not limited.
/// options.minmax_certificate: Full or Quick. The KKT matrices keep the certificate's values.
[[nodiscard]] Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point,
                              double mu, const SolverOptions& options, Index factorizations,
                              CertificateArrays& arrays);

}  // namespace ipminmax
