#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../linalg/inertia.hpp"
#include "problem.hpp"

namespace IPMINMAX_API ipminmax {

/// Why a solve stopped. Certificate::kind says what the returned point is.
enum class Status : std::uint8_t {
  InternalError,            ///< initial value; also an internal error
  Solved,                   ///< first-order conditions to tol, second-order test passed
  SolvedDegenerate,         ///< first-order conditions to tol, second-order test undecided
  SolvedToAcceptableLevel,  ///< acceptable_* tolerances, second-order test not refuted
  NotLocalMinmax,  ///< first-order point that the second-order test refuted: a player gains nearby
  /// The search ended at a kink of phi(x) = f(x, y(x)), y(x) the local maximum over y, or at an x
  /// where that maximum ends.
  NoLocalMinmaxFound,
  InnerUnbounded,     ///< the maximization over y looks unbounded
  OuterUnbounded,     ///< the objective decreases without bound in x
  DivergingIterates,  ///< |v| above diverging_iterates_tol
  LocallyInfeasible,  ///< the violation of a player's constraints is locally minimal
  InnerInfeasible,    ///< the Max constraints cannot be met near x
  MaxIterations,
  MaxCpuTime,
  MaxWallTime,
  TinyStep,  ///< no step above rounding makes progress
  RestorationFailed,
  InertiaCorrectionFailed,  ///< no shift up to max_hessian_perturbation gave the expected inertias
  LinearSolverFailed,
  EvaluationFailed,  ///< the model is undefined at the starting point or around an iterate
  InvalidNumber,     ///< the model returned NaN or infinity
  UserStop,
  InvalidProblem,
  InvalidOption,
  TooFewDegreesOfFreedom,
  OutOfMemory,
  /// The search over y found a y at which, at the returned x, f is higher than the objective or a
  /// robust constraint is violated; or a function could not be maximized over y.
  WorstCaseNotMet
};

/// Returns the short name that is printed.
[[nodiscard]] std::string_view name_of(Status status);

/// Returns true for Solved, SolvedDegenerate and SolvedToAcceptableLevel.
[[nodiscard]] bool is_success(Status status);

enum class PointKind : std::uint8_t {
  LocalMinmax,      ///< certified: second-order test passed, and no search refutes the point
  FirstOrderPoint,  ///< stationary, not certified; Certificate::second_order says more
  FeasiblePoint,    ///< not stationary
  InfeasiblePoint,  ///< not stationary
  Unknown           ///< no point, or one at which the constraints are undefined
};
[[nodiscard]] std::string_view name_of(PointKind kind);

/// Outcome of the second-order test (docs/certificate.md).
enum class SecondOrder : std::uint8_t {
  NotTested,  ///< not a first-order point, or minmax_certificate none
  Satisfied,
  Undecided,  ///< neither certified nor refuted; Certificate::reasons say why
  Violated,   ///< refuted: a player gains along some direction
  /// Not refuted, and the value stays the same, to rounding, along the directions without curvature
  /// that were tried: one of many equally good x (without x: of many equally good y).
  Flat
};
[[nodiscard]] std::string_view name_of(SecondOrder outcome);

/// What is known of y, Max's answer to x, at a certified point.
enum class InnerAnswer : std::uint8_t {
  Unknown,
  StrictlyBest,  ///< not given any more
  Unique,        ///< each x nearby has exactly one answer y(x) nearby; y(x) is Lipschitz
  Smooth,        ///< as Unique, and y(x) is differentiable
  BestNotUnique  ///< no y nearby is better at this x, but others nearby may be as good
};
[[nodiscard]] std::string_view name_of(InnerAnswer answer);

/// A reason why a point is not certified; at a certified point a remark.
struct CertificateReason {
  enum class Kind : std::uint8_t {
    WeaklyActive,       ///< an active bound or inequality with multiplier zero
    Dependent,          ///< an active constraint whose gradient is a combination of others'
    VanishingGradient,  ///< an active constraint without a gradient
    FlatDirection,      ///< the value is constant along a direction
    /// No curvature along a direction, but the value is not constant; or the curvature is neither
    /// clearly right nor clearly wrong.
    LittleCurvature,
    WrongCurvature,  ///< the player gains along a direction
    /// Newton's method does not contract towards a solution, changes the active set, leads too far
    /// from the point or to where the model is undefined.
    NotIsolated,
    /// Gradients of active constraints change too much on the way to the solution, or first
    /// derivatives jump next to active bounds.
    Unsteady,
    RobustRow,     ///< the worst case of a robust constraint is not certain
    Differences,   ///< second derivatives from differences are too uncertain
    WrongHessian,  ///< second derivatives disagree with gradients, or these with values
    /// The test stopped early: minmax_certificate quick, out of factorizations, or out of memory.
    Effort,
    /// The point passed the test, but the solve was no success: a y with a higher f or a violated
    /// robust constraint is known, or the search was not finished.
    Search,
    Relaxed  ///< a remark: bound_relax_factor moved an active bound by much, relative to its size
  };
  Kind kind = Kind::Effort;
  Player player = Player::Min;       ///< the player that it is about
  std::string text{};                ///< a sentence with the names of the model
  std::vector<Index> variables{};    ///< indices of the model's variables that it is about
  std::vector<Index> constraints{};  ///< indices of the model's constraints
};

/// Result of the second-order test at the returned point, with all regularization off. Inertias are
/// those of K (section "KKT system" of docs/algorithm.md; the paper's J_zz) and of its (y,
/// lambda_y) part K_yy (the paper's J_yy), slack rows included, as in the paper's Proposition
/// "Second order sufficient conditions for constrained minmax".
struct Certificate {
  PointKind kind = PointKind::Unknown;
  SecondOrder second_order = SecondOrder::NotTested;
  /// What was not measured is as expected (a certified point, minmax_certificate quick, undefined
  /// derivatives), or zero if factorizations or memory ran out.
  Inertia inner, inner_expected;
  Inertia full, full_expected;
  /// Curvature that the test added to W_yy in K_yy and subtracted from W in K, beside errors of W
  /// and its change on the way to the solution, while both inertias stayed as expected. In scaled
  /// variables (docs/algorithm.md, "Variable scaling"). It says how reliable the test is, not how
  /// robust the design. 0 unless Satisfied.
  double margin = 0.0;
  /// Estimate of the least curvature of K and K_yy, scaled, at most 1; 0 unless Satisfied.
  double least_curvature = 0.0;
  Index least_curvature_variable = -1;  ///< variable that moves most along that direction; -1: none
  /// Whether the gradients of Min's active constraints are known to be independent. One value for
  /// both players, unless dependent gradients were searched for.
  bool licq_min = false;
  bool licq_max = false;            ///< the same for Max
  Index weakly_active_min = 0;      ///< number of Min's active bounds and rows with multiplier 0
  Index weakly_active_max = 0;      ///< the same for Max
  bool finite_differences = false;  ///< whether second derivatives come from differences
  /// Estimate of the error of these differences (curvature of the scaled problem); the result holds
  /// for every Hessian within it. 0 if the model gives second derivatives.
  double hessian_error = 0.0;
  InnerAnswer answer = InnerAnswer::Unknown;
  std::vector<CertificateReason> reasons;  ///< the most important first; at most 16 of a kind
  /// Whether the model's second derivatives disagree with differences of its gradients, as they
  /// also do where they jump; the result is then Undecided.
  bool hessian_disagrees = false;
  /// With minmax_certificate proved: whether exactly one strict local minmax of the formulas is
  /// proved to lie near the point. It differs from the point by at most proved_within in every
  /// variable (infinite: not proved).
  bool proved = false;
  double proved_within = std::numeric_limits<double>::infinity();
  std::string proof;  ///< one sentence: what is proved, or why nothing is; empty: not asked for
};

/// Errors of the first-order conditions: infinity norms, unscaled except where noted, NaN if a
/// function is undefined. `total` is Ipopt's scaled E_0 with respect to the relaxed bounds
/// (bound_relax_factor).
struct KktError {
  double primal = 0.0;  ///< violation of constraints and bounds, or of g = slack if that is larger
  double dual_min = 0.0;         ///< gradient of the Lagrangian in the Min variables
  double dual_max = 0.0;         ///< in the Max variables
  double complementarity = 0.0;  ///< of bounds and inequalities
  double total = 0.0;
  // The same in the solver's scaling, both players' dual errors together.
  double scaled_primal = 0.0;
  double scaled_dual = 0.0;
  double scaled_complementarity = 0.0;

  [[nodiscard]] static KktError unknown() {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan, nan, nan, nan, nan, nan, nan};
  }
};

/// Seconds by stage. Zero for work with KKT matrices up to 16 rows, which takes less time than
/// reading the clock.
struct Timing {
  double total = 0.0;
  double evaluations = 0.0;  ///< the model's functions
  double assembly = 0.0;
  double analysis = 0.0;  ///< orderings and symbolic factorizations
  double factorization = 0.0;
  double solves = 0.0;  ///< back substitution and refinement

  /// Adds the times of another part of the same work, except total.
  Timing& operator+=(const Timing& part);
};

/// Purpose of a factorization of K or K_yy.
enum class FactorizationCause : std::uint8_t {
  Step,         ///< the matrices of an iteration's step, with the shifts guessed first
  Shifts,       ///< the same with other shifts, after wrong inertias
  TrialPoint,   ///< K_yy at trial points of Min's line search
  InnerAscent,  ///< further steps of the maximization over y
  Curvature,    ///< leaving a first-order point along curvature
  Barrier,      ///< oracles of mu_strategy adaptive
  Multipliers,  ///< least-squares multipliers
  Certificate,  ///< the second-order test
  Restoration   ///< K of the restoration problem; no other count of factorizations includes it
};
inline constexpr std::size_t kFactorizationCauses = 9;
[[nodiscard]] std::string_view name_of(FactorizationCause cause);

/// Factorizations of K and of K_yy.
struct FactorizationCounts {
  Index full = 0;
  Index inner = 0;
};

struct Counts {
  Index objective = 0, gradient = 0, constraints = 0, jacobian = 0, hessian = 0;  ///< model calls
  Index factorizations_full = 0;                                                  ///< of K
  Index factorizations_inner = 0;                                                 ///< of K_yy
  /// Of the dense Schur complement of K_yy in K, instead of K.
  Index factorizations_complement = 0;
  /// factorizations_full and factorizations_inner by FactorizationCause. All but Restoration add up
  /// to them.
  std::array<FactorizationCounts, kFactorizationCauses> by_cause{};
  Index solves = 0;                  ///< linear systems, refinement not counted
  Index analyses = 0;                ///< symbolic analyses
  Index instability_raises = 0;      ///< times line 7 of Algorithm 1 raised delta_x
  Index restoration_iterations = 0;  ///< they count against max_iter, but not in Result::iterations

  [[nodiscard]] const FactorizationCounts& factorizations_for(FactorizationCause cause) const {
    return by_cause[static_cast<std::size_t>(cause)];
  }
  [[nodiscard]] FactorizationCounts& factorizations_for(FactorizationCause cause) {
    return by_cause[static_cast<std::size_t>(cause)];
  }
  /// Adds the counts of another part of the same work.
  Counts& operator+=(const Counts& part);
};

/// Worst case over all of y at the returned x, found by maximizations from several starts
/// (worst_case.hpp). Without maximizations a multistart evaluates f at the returned x with the y of
/// its other starts, and sets `higher`, `value`, `v` and `y`.
struct WorstCase {
  Index starts = 0;       ///< number of maximizations; 0: none
  Index maxima = 0;       ///< number of distinct certified maxima over y
  Index competing = 0;    ///< number of distinct maxima that share the largest value
  double value = 0.0;     ///< largest f(x, y) found at a feasible y
  std::vector<double> v;  ///< n: x and that y; empty: none was found
  std::vector<double> y;  ///< Max's variables of v, in their order
  /// Values of f at the distinct maxima over y, the largest first, at most ten.
  std::vector<double> branches;
  /// Whether value exceeds the objective by more than the accuracy of a maximization, or a
  /// maximization diverged (unbounded).
  bool higher = false;
  bool unbounded = false;  ///< whether a maximization over y diverged
  /// Whether all ended at one maximum, with the expected inertia of K_yy at every iterate.
  bool single_branch = false;
  bool stated_concave = false;  ///< whether minmax_concave_in_y is set: one maximization is enough
};

/// A worst case y of a robust constraint: a local maximum over y of its violation.
struct RobustWorstCase {
  Index constraint = 0;     ///< index in the model; m for the objective's row
  std::vector<double> v;    ///< n: x and that y
  double value = 0.0;       ///< the constraint (or f) at v
  double multiplier = 0.0;  ///< of the constraint at that y, with the signs of Result
  /// Whether this worst case limits x: the size of its multiplier exceeds the distance of value to
  /// the bound, with the constraint scaled by its range.
  bool active = false;
  int side = 0;  ///< 1: worst case of the upper bound, -1: of the lower one, 0: not known
  /// Range of the constraint's values in the last full search over y; 0: not known.
  double range = 0.0;
  Index age = 0;  ///< number of solves since that search
};

/// Bounds of the largest value of f or a constraint over all y in Y(x), at one x: a y gives `seen`,
/// and no y gives more than `proved`. With `least` they are bounds of the least value: no y gives
/// less than `proved`.
struct WorstCaseProof {
  Index constraint = -1;  ///< of Min's that reads Max variables; -1: the objective
  bool least = false;     ///< bounds of the least value, which matters if there is a lower bound
  double seen = std::numeric_limits<double>::quiet_NaN();    ///< NaN: no point of Y(x) was found
  double proved = std::numeric_limits<double>::quiet_NaN();  ///< infinite: no bound was found
  /// Largest gap between seen and proved that counts as none: a tolerance times the range of the
  /// values seen, or rounding.
  double resolution = 0.0;
  bool complete = false;  ///< whether this gap is within the resolution, or Y(x) proved empty
  bool empty = false;     ///< whether Y(x) is proved empty
  std::vector<double> v;  ///< n: x and the y of `seen`; empty: none
  Index boxes = 0;        ///< number of boxes examined
  Index left = 0;         ///< number of boxes not decided
  double seconds = 0.0;
  std::optional<Status> interrupted;  ///< set if the observer or a time limit ended the proof
  std::string message;                ///< one sentence
};

/// What was searched over all of y, beyond the y of the certificate. A function is f, or a bounded
/// side of a robust constraint.
struct SearchOverY {
  Index asked = 0;          ///< number of starts of y for each function; 0: no search
  Index functions = 0;      ///< number of functions maximized at the returned x
  Index maximizations = 0;  ///< number of maximizations in the whole run
  /// False: cut short, or a function was not maximized or proved as asked.
  bool finished = true;
  /// Whether a y is known at which f is clearly higher or a robust constraint violated.
  bool better_known = false;
  /// Largest violation of a robust constraint, in its own units, at the returned x over all y
  /// examined; NaN: none was examined.
  double largest_violation = std::numeric_limits<double>::quiet_NaN();
  /// Solving again: number of solves since the last full search, the largest of all robust
  /// constraints (RobustWorstCase::age). 0: all were searched in this solve.
  Index age = 0;
  /// Number of worst cases of f, if f was treated as a robust constraint. At a certified answer x
  /// is a local minimum of the largest of them. 0: f was not.
  Index branches = 0;
  Index solves = 0;  ///< number of solves, each with other worst cases
  /// One proof for each function at the returned x, with minmax_worst_case_proof.
  std::vector<WorstCaseProof> proofs{};
  /// Why a higher maximum than those found is expected; empty: none is.
  std::string open{};
  Index open_constraint = -1;  ///< the constraint that `open` is about; -1: f
};

/// What was searched over x.
struct SearchOverX {
  Index asked = 1;  ///< number of starts asked for
  Index made = 1;   ///< number of starts that were finished
};

/// Answer of a solve, in the units of the model. It makes four statements: why it stopped (status,
/// message), what the point is locally (certificate), what was searched over all of y (over_y) and
/// over x (over_x). kind is LocalMinmax only together with a success. There is no success if a
/// search over y that was asked for was not finished, or found a y at which f is higher or a robust
/// constraint violated. Multipliers satisfy grad f + J' lambda - z_lower + z_upper = 0 for every
/// variable, so those of a Max variable's bounds are <= 0.
///
/// Objective, constraints, error and certificate are those of v and of the multipliers, whatever
/// the status. Exception: honor_original_bounds moves v (by bound_relax_factor) after the dual and
/// complementarity errors were computed. Without a point (refused, undefined at the start, out of
/// memory) the vectors are empty, objective and errors NaN and the kind is unknown. What the model
/// does not define at v is NaN; with a success everything is finite.
struct Result {
  Status status = Status::InternalError;
  Certificate certificate;
  std::string message;
  std::vector<double> v;            ///< n
  std::vector<double> lambda;       ///< m
  std::vector<double> z_lower;      ///< n
  std::vector<double> z_upper;      ///< n
  std::vector<double> constraints;  ///< m, values g(v)
  double objective = std::numeric_limits<double>::quiet_NaN();
  /// Factor of the objective inside the solve: obj_scaling_factor times that of nlp_scaling_method.
  /// Negative: f is maximized over x and minimized over y, a local minmax is one of -f, and the
  /// multipliers of bounds have the opposite signs: <= 0 for Min variables, >= 0 for Max variables.
  double objective_scale = 1.0;
  /// Whether the bounds of fixed variables were moved apart, as with fixed_variable_treatment
  /// relax_bounds, because there were too few degrees of freedom without these variables. Errors
  /// and multipliers are those of the moved bounds.
  bool fixed_variables_relaxed = false;
  KktError error = KktError::unknown();
  double mu = 0.0;  ///< last barrier parameter
  Index iterations = 0;
  /// Number of factorizations of K and K_yy together, without those of restorations. Restorations
  /// have their own number, counts.factorizations_for(FactorizationCause::Restoration);
  /// minmax_max_factorizations limits the sum of both.
  Index factorizations = 0;
  double seconds = 0.0;  ///< wall time
  double cpu_seconds = 0.0;
  Counts counts;
  Timing timing;
  WorstCase worst_case;  ///< of f; see WorstCase::starts, minmax_worst_case_starts
  /// Worst cases of robust constraints, and of an objective that is treated as one
  /// (minmax_epigraph). Ordered by constraint, the first found first.
  std::vector<RobustWorstCase> worst_cases;
  SearchOverY over_y;
  SearchOverX over_x;
};

}  // namespace ipminmax
