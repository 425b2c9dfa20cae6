#pragma once

#include <optional>
#include <vector>

#include "core/certificate/dependence.hpp"
#include "core/certificate/test_context.hpp"

namespace ipminmax {

/// Derivatives beside a point, as far away as rounding is.
struct RoundedDerivatives {
  Eigen::VectorXd v, lambda;
  Evaluation evaluation;
};

/// A point on its way to the solution of the active set's equations, and what is known of it.
struct Candidate {
  Point point;
  Units units;
  bool min_first = false;  ///< rule of the units
  BoundClasses classes;
  NewtonTest newton;
  InertiaTest test;
  Eigen::VectorXd error;   ///< of W in units
  int steps = 0;           ///< of Newton's method that have led here
  bool converges = false;  ///< Newton's method, to a solution with these classes
  /// After many steps: other solutions may be nearer to where they began, so that the certified
  /// one has to be returned itself.
  bool crept = false;
  bool relaxed = false;  ///< bounds were released that bound_relax_factor alone made active
  bool creeps = true;    ///< each of them has contracted, none enough
  std::optional<Dependences> dependences{};
  /// Curvature taken from all of Max's variables, in units, where his best answer is not unique.
  double proximal = 0.0;
  std::optional<RoundedDerivatives> rounded{};  ///< last asked for
};

/// lambda with zero for inactive inequalities.
[[nodiscard]] Eigen::VectorXd without_inactive(const CanonicalProblem& canonical,
                                               const BoundClasses& classes, Eigen::VectorXd lambda);
/// All but f at the point's iterate: few of the points on the way are asked for their value.
[[nodiscard]] bool evaluate(CanonicalProblem& canonical, Point& point);
[[nodiscard]] bool evaluate_objective(CanonicalProblem& canonical, Point& point);
/// Takes the multipliers of inactive inequalities, which are the barrier's, out of W.
[[nodiscard]] bool drop_inactive_multipliers(CanonicalProblem& canonical,
                                             const BoundClasses& classes, Point& point);

/// From entries of W and the Jacobian that neither rounding of the variables and multipliers nor
/// the last Newton step changes by more than they are: what is left of a cancellation gives no
/// length.
[[nodiscard]] Units certain_units(CanonicalProblem& canonical, Candidate& candidate);
/// Of W in units: that of differences, and what doubtful inequalities may give or not.
[[nodiscard]] Eigen::VectorXd error_of(TestContext& c, const Point& point,
                                       const BoundClasses& classes, const Units& units);
/// The Newton step, and the error of W over it.
void confirm(TestContext& c, Candidate& candidate, ActiveSetSystem& system);
/// Whether the way from an iterate to a point is short: share of the problem's size in lengths of
/// curvature, and of each variable's own size; where that is zero, of one and in lengths both.
[[nodiscard]] bool is_near(const TestContext& c, const Iterate& from, const Eigen::VectorXd& to,
                           const Units& units, double share);

/// Constraints that say nothing beside others, so that the model without them is the same model.
[[nodiscard]] std::vector<bool> droppable(const CanonicalProblem& canonical,
                                          const Dependences& dependences);
/// Whether all dependent rows found are left out; of_max: of Max's.
[[nodiscard]] bool rows_are_left_out(const CanonicalProblem& canonical, const Candidate& candidate,
                                     bool of_max);

// --- The parts that work with candidates, each in a file of its name -----------------------------

/// The second-order test of a point that is not clear: candidates for the solution near by, and
/// what remedies make of them, in the order of certificate.hpp.
[[nodiscard]] SecondOrder examine(TestContext& c, const Point& given);

/// Whether y is a best answer to x nearby, maybe one of many, at a point whose K_yy has no
/// curvature of the wrong sign beyond kProximal. Either by structure: W has no entries between some
/// of his free variables, Z, and any of them; L is affine in Z then, with slope zero, and constant;
/// without Z and the rows that read it K_yy is right. Or by values: these are constant along all
/// directions without curvature. Reasons name such a direction.
[[nodiscard]] bool maximizes_weakly(TestContext& c, const Candidate& candidate);

/// After Newton steps on the way to the certified solution: whether the point that is returned is
/// that one, or as near as makes no difference. c.moved and c.mu may move there.
[[nodiscard]] bool reports_solution(TestContext& c, const Candidate& candidate, const Point& given);

/// Where the objective was scaled down a gradient that meets the tolerances may be large in the
/// model's units: the end of the Newton step is returned, if it is no worse otherwise.
void report_end(TestContext& c, const Point& given, const NewtonTest& newton);

/// What is said of a point that gets no certificate: that it is refuted, by a witness; that it is
/// flat; or why neither is known.
[[nodiscard]] SecondOrder judge_without_certificate(TestContext& c, Candidate& candidate);

/// At mu_target > 0 the point solves the barrier problem, in which no bound is active and all
/// curvature counts.
[[nodiscard]] SecondOrder judge_barrier_problem(TestContext& c, const Point& given);

}  // namespace ipminmax
