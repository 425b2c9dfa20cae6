#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "../linalg/solver_options.hpp"

namespace IPMINMAX_API ipminmax {

enum class Globalization : std::uint8_t {
  None,   ///< the paper's Algorithm 1: no line search
  Filter  ///< filter line search on the local maximum over y
};
enum class BarrierRule : std::uint8_t {
  /// While E_mu <= kappa_eps mu:
  /// mu <- max(min(tol, compl_inf_tol) / (kappa_eps + 1), min(kappa_mu mu, mu^theta_mu))
  Ipopt,
  Paper  ///< b <- sigma b when |g(z,b)| <= b
};
enum class BarrierStrategy : std::uint8_t {
  Monotone,
  Adaptive,
  Unset  ///< Monotone; Adaptive for a minimization with LimitedMemory, as in Ipopt
};
enum class BarrierOracle : std::uint8_t { QualityFunction, Probing, Loqo };
/// Whether K is factorized by way of K_yy and its dense complement.
enum class SchurComplementUse : std::uint8_t { Auto, Yes, No };
/// Test by which the adaptive strategy notices that it makes no progress.
enum class AdaptiveGlobalization : std::uint8_t {
  ObjectiveFilter,  ///< obj-constr-filter: filter on objective and violation
  KktError,         ///< decrease of the squared residual of the first-order conditions
  NeverMonotone     ///< no test: no guarantee of convergence
};
enum class Scaling : std::uint8_t { None, GradientBased, User };
enum class HessianApproximation : std::uint8_t {
  LimitedMemory,           ///< BFGS for a minimization; with Max variables FiniteDifferenceValues
  Exact,                   ///< the model's second derivatives
  FiniteDifferenceValues,  ///< differences of the model's first derivatives
  Unset                    ///< Exact; differences if the model has no second derivatives
};
enum class DerivativeTest : std::uint8_t { None, FirstOrder, SecondOrder, OnlySecondOrder };
enum class FixedVariableTreatment : std::uint8_t {
  MakeParameter,        ///< taken out; one more gradient and Jacobian give the multipliers
  MakeParameterNodual,  ///< taken out; multipliers zero
  MakeConstraint,       ///< free variable with an equality constraint of its owner
  RelaxBounds           ///< bounds moved apart by bound_relax_factor
};
enum class BoundMultiplierInit : std::uint8_t { Constant, MuBased };

/// How much the second-order test may cost.
enum class CertificateEffort : std::uint8_t {
  Full,   ///< until the point is certified or refuted, or the budget of factorizations is used up
  Quick,  ///< at most two of K_yy and of K; more only to refute a clearly wrong point
  None,   ///< no test; for minimizations
  Proved  ///< as Full, and interval arithmetic proves that a solution exists near the point
};

/// All settings of a solve. Names, defaults and meanings are Ipopt's unless a name begins with
/// minmax_; the defaults of linear_solver and adaptive_mu_globalization differ. option_table()
/// lists them with bounds and texts, unregistered_settings() those that have no name for users.
struct SolverOptions {
  // Termination
  double tol = 1e-8;
  double dual_inf_tol = 1.0;
  double constr_viol_tol = 1e-4;
  double compl_inf_tol = 1e-4;
  double acceptable_tol = 1e-6;
  int acceptable_iter = 15;
  double acceptable_dual_inf_tol = 1e10;
  double acceptable_constr_viol_tol = 1e-2;
  double acceptable_compl_inf_tol = 1e-2;
  double acceptable_obj_change_tol = 1e20;
  int max_iter = 3000;
  double max_cpu_time = 1e20;
  double max_wall_time = 1e20;
  int minmax_max_factorizations = 0;
  double diverging_iterates_tol = 1e20;
  double s_max = 100.0;

  // Model
  double nlp_lower_bound_inf = -1e19;
  double nlp_upper_bound_inf = 1e19;
  double bound_relax_factor = 1e-8;
  bool honor_original_bounds = false;
  FixedVariableTreatment fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  Scaling nlp_scaling_method = Scaling::GradientBased;
  double nlp_scaling_max_gradient = 100.0;
  double nlp_scaling_min_value = 1e-8;
  double obj_scaling_factor = 1.0;
  HessianApproximation hessian_approximation = HessianApproximation::Unset;
  double minmax_difference_step = 6e-6;

  // Derivative test (test_derivatives)
  DerivativeTest derivative_test = DerivativeTest::None;
  double derivative_test_tol = 1e-4;
  double derivative_test_perturbation = 1e-8;
  bool derivative_test_print_all = false;
  int derivative_test_first_index = -2;
  double point_perturbation_radius = 10.0;

  // Starting point
  double bound_push = 1e-2;
  double bound_frac = 1e-2;
  double slack_bound_push = 1e-2;
  double slack_bound_frac = 1e-2;
  double bound_mult_init_val = 1.0;
  BoundMultiplierInit bound_mult_init_method = BoundMultiplierInit::Constant;
  double constr_mult_init_max = 1e3;
  bool warm_start_init_point = false;
  double warm_start_bound_push = 1e-3;
  double warm_start_bound_frac = 1e-3;
  double warm_start_slack_bound_push = 1e-3;
  double warm_start_slack_bound_frac = 1e-3;
  double warm_start_mult_bound_push = 1e-3;
  double warm_start_mult_init_max = 1e6;

  // Barrier
  double mu_init = 0.1;
  double mu_target = 0.0;
  double mu_linear_decrease_factor = 0.2;
  double mu_superlinear_decrease_power = 1.5;
  double barrier_tol_factor = 10.0;
  double tau_min = 0.99;
  double kappa_sigma = 1e10;
  double kappa_d = 1e-5;
  BarrierRule minmax_barrier_rule = BarrierRule::Ipopt;
  BarrierStrategy mu_strategy = BarrierStrategy::Unset;
  BarrierOracle mu_oracle = BarrierOracle::QualityFunction;
  AdaptiveGlobalization adaptive_mu_globalization = AdaptiveGlobalization::KktError;
  double mu_max = 0.0;
  double mu_max_fact = 1e3;
  double mu_min = 1e-11;
  int adaptive_mu_kkterror_red_iters = 4;
  double adaptive_mu_kkterror_red_fact = 0.9999;
  double adaptive_mu_monotone_init_factor = 0.8;

  // Method
  Globalization minmax_globalization = Globalization::Filter;
  bool minmax_instability = true;
  bool minmax_warm_start_shifts = true;
  double minmax_freeze_tol = 0.0;
  bool minmax_residual_watchdog = false;
  bool minmax_pure_newton = false;
  double minmax_prescribed_delta_x = -1.0;
  double minmax_prescribed_delta_y = -1.0;
  int minmax_max_restarts = 20;
  bool minmax_robust_constraints = true;

  // Starts of x, other y
  int minmax_starts = 1;
  int minmax_start_seed = 1;
  double minmax_start_radius = 10.0;
  double minmax_distinct_tol = 1e-4;
  int minmax_worst_case_starts = -1;
  bool minmax_worst_case_proof = false;
  bool minmax_concave_in_y = false;

  // Robust constraints, see robust.hpp
  bool minmax_robust_copies = true;
  bool minmax_epigraph = false;
  bool minmax_epigraph_at_kinks = false;
  double minmax_worst_case_tol = 1e-6;

  // Hessian and Jacobian shifts
  double first_hessian_perturbation = 1e-4;
  double min_hessian_perturbation = 1e-20;
  double max_hessian_perturbation = 1e20;
  double perturb_inc_fact_first = 100.0;
  double perturb_inc_fact = 8.0;
  double perturb_dec_fact = 1.0 / 3.0;
  double jacobian_regularization_value = 1e-8;
  double jacobian_regularization_exponent = 0.25;

  // Linear systems
  LinearSolver linear_solver = LinearSolver::Auto;
  Ordering minmax_ordering = Ordering::Best;
  SchurComplementUse minmax_schur_complement = SchurComplementUse::Auto;
  int minmax_threads = 1;
  double minmax_ldlt_gamma = 1e-11;
  double mumps_pivtol = 1e-6;
  double mumps_pivtolmax = 0.1;
  int mumps_mem_percent = 1000;
  double max_memory = 1e20;
  int max_refinement_steps = 10;
  double residual_ratio_max = 1e-10;
  double residual_ratio_singular = 1e-5;

  // Certificate
  CertificateEffort minmax_certificate = CertificateEffort::Full;
  double minmax_curvature_tol = 1e-8;
};

/// Scaling factors outside this range are refused: products with them could overflow.
inline constexpr double kLeastScaling = 1e-20, kLargestScaling = 1e20;
[[nodiscard]] constexpr bool is_sane_scaling(double factor) {
  return factor >= kLeastScaling && factor <= kLargestScaling;
}

/// Description of an option of the solver or a front end. Options are registered, read, printed and
/// documented from it. If SolverOptions does not hold the option, member, set and get are null.
struct OptionInfo {
  struct Number {
    double SolverOptions::*member;
    double lower, upper;  ///< infinite: none
    bool lower_strict, upper_strict;
    double by_default;
  };
  struct Integer {
    int SolverOptions::*member;
    int lower, upper;  ///< the least and the largest int: none
    int by_default;
  };
  struct Flag {  ///< yes / no
    bool SolverOptions::*member;
    bool by_default;
  };
  struct Choice {
    std::vector<std::string_view> names;
    std::vector<std::string_view> texts;
    std::function<void(SolverOptions&, std::size_t)> set;
    std::function<std::size_t(const SolverOptions&)> get;
    std::size_t by_default;
  };
  struct Name {  ///< any text
    std::string_view by_default;
  };
  std::string_view name;
  std::string_view category;
  std::string_view text;  ///< sentences, with the symbol of the paper or of Ipopt's report
  std::variant<Number, Integer, Flag, Choice, Name> kind;
};

/// Returns every option of the solver, in the order of SolverOptions. The defaults are those of a
/// value-initialized SolverOptions.
[[nodiscard]] std::span<const OptionInfo> option_table();
/// Returns settings for studies of the method. Only C++ programs can change them.
[[nodiscard]] std::span<const OptionInfo> unregistered_settings();

/// Returns the options for the paper's Algorithm 1 as printed: minmax_globalization none, shifts
/// that start at zero in every iteration and grow tenfold from 1e-4, b <- sigma b after a step with
/// |g(z,b)| <= b, no scaling, no relaxed bounds, multipliers lambda = b / s, no shift of multiplier
/// rows, no limits of the multipliers. Other options keep their values, also delta_epsilon
/// (minmax_freeze_tol). docs/algorithm.md lists what still differs.
[[nodiscard]] SolverOptions as_printed(SolverOptions options = {});

/// Returns the first error, for example "tol = nan is not in (0, inf)"; empty if all values are
/// allowed.
[[nodiscard]] std::string check(const SolverOptions& options);

}  // namespace ipminmax
