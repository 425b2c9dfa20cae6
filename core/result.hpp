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

/// Why a solve stopped. What the returned point is stands in Certificate::kind.
enum class Status : std::uint8_t {
  InternalError,            ///< starts as failure
  Solved,                   ///< first-order conditions to tol, second-order test passed
  SolvedDegenerate,         ///< first-order conditions to tol, second-order test undecided
  SolvedToAcceptableLevel,  ///< acceptable_* tolerances, second-order test not refuted
  NotLocalMinmax,           ///< first-order point whose curvature has a definite wrong sign
  NoLocalMinmaxFound,       ///< gave up: the branch of inner maxima ends, iterates cycle
  InnerUnbounded,           ///< the maximization over y looks unbounded
  OuterUnbounded,           ///< the objective decreases without bound in x
  DivergingIterates,        ///< |v| above diverging_iterates_tol
  LocallyInfeasible,        ///< the violation of a player's constraints is locally minimal
  InnerInfeasible,          ///< the Max constraints cannot be met near x
  MaxIterations,
  MaxCpuTime,
  MaxWallTime,
  TinyStep,  ///< no progress possible with steps above rounding
  RestorationFailed,
  InertiaCorrectionFailed,  ///< no shift up to max_hessian_perturbation gave the inertias
  LinearSolverFailed,
  EvaluationFailed,  ///< the model is undefined at the starting point or around an iterate
  InvalidNumber,     ///< the model returned NaN or infinity
  UserStop,
  InvalidProblem,
  InvalidOption,
  TooFewDegreesOfFreedom,
  OutOfMemory,
  /// A y is known that the answer does not meet although it was asked to: f is higher there at the
  /// returned x, or a robust constraint is violated; or one could not be maximized over y.
  WorstCaseNotMet
};

/// Short name, as printed.
[[nodiscard]] std::string_view name_of(Status status);

/// True for Solved, SolvedDegenerate and SolvedToAcceptableLevel.
[[nodiscard]] bool is_success(Status status);

enum class PointKind : std::uint8_t {
  LocalMinmax,      ///< first-order point, both inertias right with margin, LICQ
  FirstOrderPoint,  ///< first-order point; second-order test undecided or failed, see the verdict
  FeasiblePoint,
  InfeasiblePoint,
  Unknown  ///< no point, or one at which the constraints are undefined
};
[[nodiscard]] std::string_view name_of(PointKind kind);

/// Outcome of the second-order test.
enum class SecondOrder : std::uint8_t {
  NotTested,  ///< not a first-order point, or minmax_certificate none
  Satisfied,
  Undecided,  ///< none of the others could be shown; Certificate::reasons say why
  Violated,   ///< an inertia with a definite wrong sign
  /// Not refuted, and along every direction without curvature the value stays the same, as far as
  /// rounding shows: a valley of equally good points (of x, y answering; of y where there is no x).
  Flat
};
[[nodiscard]] std::string_view name_of(SecondOrder outcome);

/// What was shown of the maximizer's answer near the returned point, whatever is known of x.
enum class InnerAnswer : std::uint8_t {
  Unknown,
  StrictlyBest,  ///< to this x, y is strictly the best answer nearby; how it moves with x is open
  Unique,        ///< for each x nearby there is exactly one answer y(x) nearby, and it is Lipschitz
  Smooth,        ///< the same, and y(x) is differentiable
  BestNotUnique  ///< to this x, y is a best answer nearby, and others are as good
};
[[nodiscard]] std::string_view name_of(InnerAnswer answer);

/// Why a certificate is not more than it is, or what is special about the point.
struct CertificateReason {
  enum class Kind : std::uint8_t {
    WeaklyActive,       ///< an active bound or inequality with multiplier zero
    Dependent,          ///< an active constraint whose gradient is a combination of others'
    VanishingGradient,  ///< an active constraint without a gradient
    FlatDirection,      ///< the value is constant along it
    LittleCurvature,    ///< none is seen along it, but the value is not constant
    WrongCurvature,     ///< along it the owner gains
    NotIsolated,        ///< Newton's method does not contract towards a solution
    Unsteady,           ///< second derivatives change by more than the curvature on the way to it
    RobustRow,          ///< a robust constraint's worst case is not settled
    Differences,        ///< second derivatives from differences are too uncertain
    WrongHessian,       ///< second derivatives disagree with gradients, or these with values
    Effort,             ///< minmax_certificate quick, or the budget is used up
    Search,             ///< the point passed the test, the search that it belongs to did not
    Relaxed  ///< a remark: bound_relax_factor moved an active bound by much beside its size
  };
  Kind kind = Kind::Effort;
  Player player = Player::Min;     ///< whose
  std::string text;                ///< for people, with the names of the model
  std::vector<Index> variables;    ///< of the model, that it is about
  std::vector<Index> constraints;  ///< the same
};

/// What was found at the returned point, with all regularization off. Inertias are those of
/// K (section "KKT system" of docs/algorithm.md; the paper's J_zz) and of its (y, lambda_y) part
/// K_yy (the paper's J_yy), slack rows included, as in the paper's Proposition "Second order
/// sufficient conditions for constrained minmax".
struct Certificate {
  PointKind kind = PointKind::Unknown;
  SecondOrder second_order = SecondOrder::NotTested;
  Inertia inner, inner_expected;
  Inertia full, full_expected;
  /// Curvature that can be taken away from both players while both inertias stay right, relative to
  /// what each variable has: in lengths in which the entries of W are at most 1 (docs/algorithm.md,
  /// "Units"): the size of a probe, no measure of robustness. 0 unless Satisfied.
  double margin = 0.0;
  /// About the least curvature of K and K_yy in the same lengths, by inverse iteration; 0 unless
  /// Satisfied.
  double least_curvature = 0.0;
  Index least_curvature_variable = -1;  ///< the one that moves most along it; -1: not known
  bool licq_min = false;        ///< gradients of the Min player's active constraints independent
  bool licq_max = false;        ///< the same for Max
  Index weakly_active_min = 0;  ///< Min bounds and inequalities without strict complementarity
  Index weakly_active_max = 0;
  bool finite_differences = false;  ///< second derivatives came from differences
  double hessian_error = 0.0;       ///< curvature (scaled problem) by which these may be wrong, as
                                    ///< estimated; the tests hold in spite of it
  InnerAnswer answer = InnerAnswer::Unknown;
  std::vector<CertificateReason> reasons;  ///< the most telling first; at most 20 of a kind
  bool hessian_disagrees =
      false;  ///< the model's second derivatives are not those of its gradients:
              ///< a difference along little curvature shows it, so Undecided
  /// With minmax_certificate proved: exactly one strict local minmax of the formulas lies in a ball
  /// around the point, all of which is at most proved_within from it in every variable (infinite:
  /// not proved).
  bool proved = false;
  double proved_within = std::numeric_limits<double>::infinity();
  std::string proof;  ///< one sentence, or why not; empty: not asked for
};

/// Errors of the first-order conditions. Infinity norms, NaN where the model's functions are
/// undefined; total is Ipopt's scaled E_0 with respect to the relaxed bounds (bound_relax_factor),
/// the others are unscaled.
struct KktError {
  double primal = 0.0;  ///< violation of constraints and bounds, or of g = slack where it is larger
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

/// Seconds spent, by stage; of KKT matrices up to 16 rows, shorter than a look at the clock, zero.
struct Timing {
  double total = 0.0;
  double evaluations = 0.0;  ///< the model's functions
  double assembly = 0.0;
  double analysis = 0.0;  ///< orderings and symbolic factorizations
  double factorization = 0.0;
  double solves = 0.0;  ///< back substitution and refinement

  /// Of another part of the same work, total apart.
  Timing& operator+=(const Timing& part);
};

/// What K or K_yy was factorized for.
enum class FactorizationCause : std::uint8_t {
  Step,         ///< the matrices of an iteration's step, with the shifts guessed first
  Shifts,       ///< the same with other shifts, where inertias were wrong
  TrialPoint,   ///< K_yy where the minimizer's line search looked
  InnerAscent,  ///< further steps of the maximization over y
  Curvature,    ///< leaving a first-order point along curvature
  Barrier,      ///< oracles of mu_strategy adaptive
  Multipliers,  ///< least-squares multipliers
  Certificate,  ///< the second-order test
  Restoration   ///< K of the restoration problem, which the other counts leave out
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
  Index factorizations_complement = 0;  ///< of the dense complement of K_yy in K, instead of K
  /// factorizations_full and _inner by FactorizationCause; Restoration apart they add up to these.
  std::array<FactorizationCounts, kFactorizationCauses> by_cause{};
  Index solves = 0;                  ///< linear systems, refinement not counted
  Index analyses = 0;                ///< symbolic analyses
  Index instability_raises = 0;      ///< times line 7 of Algorithm 1 raised delta_x
  Index restoration_iterations = 0;  ///< count against max_iter, not in Result::iterations

  [[nodiscard]] const FactorizationCounts& factorizations_for(FactorizationCause cause) const {
    return by_cause[static_cast<std::size_t>(cause)];
  }
  [[nodiscard]] FactorizationCounts& factorizations_for(FactorizationCause cause) {
    return by_cause[static_cast<std::size_t>(cause)];
  }
  /// Of another part of the same work.
  Counts& operator+=(const Counts& part);
};

/// The worst case over all of y at the returned x, as far as maximizations from several starts tell
/// (worst_case.hpp), or, where none was made, y of a multistart's other starts: then `higher`
/// alone.
struct WorstCase {
  Index starts = 0;       ///< maximizations made; 0: none
  Index maxima = 0;       ///< distinct certified maxima over y
  Index competing = 0;    ///< distinct points that share the largest value
  double value = 0.0;     ///< largest f(x, y) found at a feasible y
  std::vector<double> v;  ///< n: x and that y; empty when none was found
  std::vector<double> y;  ///< Max's variables of v, in their order
  /// Values of f at the distinct maxima over y, the largest first, at most ten.
  std::vector<double> branches;
  bool higher = false;          ///< value is clearly above the objective of the result
  bool unbounded = false;       ///< a maximization over y ran to infinity
  bool single_branch = false;   ///< all ended at one maximum, K_yy right at every iterate
  bool stated_concave = false;  ///< by minmax_concave_in_y: one maximization is enough
};

/// A worst case y of a robust constraint: a local maximum over y of its violation.
struct RobustWorstCase {
  Index constraint = 0;     ///< of the model; its number of constraints for the objective's row
  std::vector<double> v;    ///< n: x and that y
  double value = 0.0;       ///< the constraint (or f) there
  double multiplier = 0.0;  ///< of the constraint at that y; signs as in Result
  bool active = false;      ///< its multiplier exceeds its distance to the bound: x rests on it
};

/// The largest value over all y in Y(x) of f or a constraint, at one x, enclosed: no y gives more
/// than `proved`, and one that gives `seen` is known. For the least value both are turned round.
struct WorstCaseProof {
  Index constraint = -1;  ///< of Min's that reads Max variables; -1: the objective
  bool least = false;     ///< of the least value, which counts where there is a lower bound
  double seen = std::numeric_limits<double>::quiet_NaN();    ///< NaN: no point of Y(x) was found
  double proved = std::numeric_limits<double>::quiet_NaN();  ///< infinite: no bound was found
  /// A gap that counts as none: the tolerance times the range of the values seen, or rounding.
  double resolution = 0.0;
  bool complete = false;  ///< the gap is within the resolution, or Y(x) is proved to be empty
  bool empty = false;     ///< Y(x) is proved to be empty
  std::vector<double> v;  ///< n: x and the y that was seen; empty: none
  Index boxes = 0;        ///< looked at
  Index left = 0;         ///< not decided
  double seconds = 0.0;
  std::optional<Status> interrupted;
  std::string message;  ///< one sentence
};

/// What was looked at over all of y, beyond the y that the certificate is about. A function is f,
/// or a bounded side of a robust constraint.
struct SearchOverY {
  Index asked = 0;            ///< starts of y for each function; 0: other y were not looked at
  Index functions = 0;        ///< maximized at the returned x
  Index maximizations = 0;    ///< made, at all x
  bool finished = true;       ///< false: cut short, or a function not maximized or proved as asked
  bool better_known = false;  ///< a y at which f is clearly higher or a robust constraint violated
  /// Of robust constraints at the returned x, over all y looked at; NaN: none was.
  double largest_violation = std::numeric_limits<double>::quiet_NaN();
  /// Worst cases of f among the worst cases, where f was treated as a robust constraint: with a
  /// certificate, x minimizes the largest of so many local worst cases. 0: f is that of one y.
  Index branches = 0;
  Index solves = 0;  ///< with other worst cases each
  /// Of each function at the returned x, with minmax_worst_case_proof.
  std::vector<WorstCaseProof> proofs{};
  /// Why a higher maximum than those found is to be expected; empty: it is not.
  std::string open{};
  Index open_constraint = -1;  ///< that this is about; -1: f
};

/// What was looked at over x.
struct SearchOverX {
  Index asked = 1;  ///< starts
  Index made = 1;   ///< to their end
};

/// Answer of a solve, in the units of the model. It makes four statements: why it stopped (status,
/// message), what the point is locally (certificate), what was looked at over all of y (over_y) and
/// over x (over_x). kind is LocalMinmax only together with a success, and there is none where a
/// better y is known that was asked for, or where what was asked for was not finished. Multipliers
/// satisfy grad f + J' lambda - z_lower + z_upper = 0 for every variable, so those of a Max
/// variable's bounds are <= 0.
///
/// Objective, constraints, error and certificate are those of v and of the multipliers, whatever
/// the status. Only the moves of honor_original_bounds (by bound_relax_factor) come after the dual
/// and complementarity errors. Without a point (refused, undefined at the start, out of memory) the
/// vectors are empty, objective and errors NaN and the kind is unknown. What the model does not
/// define at v is NaN; with a success everything is finite.
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
  /// The bounds of fixed variables were moved apart as with fixed_variable_treatment relax_bounds,
  /// although the option takes these variables out: without them there were too few degrees of
  /// freedom. Errors and multipliers are those of the moved bounds.
  bool fixed_variables_relaxed = false;
  KktError error = KktError::unknown();
  double mu = 0.0;  ///< last barrier parameter
  Index iterations = 0;
  Index factorizations = 0;  ///< of K and K_yy together
  double seconds = 0.0;      ///< wall time
  double cpu_seconds = 0.0;
  Counts counts;
  Timing timing;
  WorstCase worst_case;  ///< of f; see WorstCase::starts, minmax_worst_case_starts
  /// Of robust constraints and of an objective treated as one (minmax_epigraph): ordered by
  /// constraint, first found first.
  std::vector<RobustWorstCase> worst_cases;
  SearchOverY over_y;
  SearchOverX over_x;
};

}  // namespace ipminmax
