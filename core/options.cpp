#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>

#include "core/options.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

constexpr int kIntMax = std::numeric_limits<int>::max();

using Number = OptionInfo::Number;
using Integer = OptionInfo::Integer;
using Flag = OptionInfo::Flag;
using Choice = OptionInfo::Choice;

Number within(double SolverOptions::*member, double lower, bool lower_strict, double upper,
              bool upper_strict) {
  return {member, lower, upper, lower_strict, upper_strict, SolverOptions{}.*member};
}
Number positive(double SolverOptions::*member) {
  return within(member, 0.0, true, kInfinity, true);
}
Number nonnegative(double SolverOptions::*member) {
  return within(member, 0.0, false, kInfinity, true);
}
Number any(double SolverOptions::*member) {
  return within(member, -kInfinity, true, kInfinity, true);
}
/// In the open interval (lower, upper).
Number open(double SolverOptions::*member, double lower, double upper) {
  return within(member, lower, true, upper, true);
}
/// In [0, upper].
Number closed_upto(double SolverOptions::*member, double upper) {
  return within(member, 0.0, false, upper, false);
}
/// A share of a distance: in (0, 1/2].
Number share(double SolverOptions::*member) { return within(member, 0.0, true, 0.5, false); }
Number from(double SolverOptions::*member, double lower) {
  return within(member, lower, false, kInfinity, true);
}
/// Slower growth would take thousands of factorizations.
constexpr double kLeastGrowth = 1.001;

Integer at_least(int SolverOptions::*member, int lower, int upper = kIntMax) {
  return {member, lower, upper, SolverOptions{}.*member};
}
Flag flag(bool SolverOptions::*member) { return {member, SolverOptions{}.*member}; }

/// An enumeration whose values are 0, 1, ... in the order of the names; Unset, the next one, shows
/// as the name number unset.
template <class Enum>
Choice choice(Enum SolverOptions::*member, std::vector<std::string_view> names,
              std::vector<std::string_view> texts, std::size_t unset) {
  const std::size_t size = names.size();
  const auto shown = [=](const SolverOptions& options) {
    const auto value = static_cast<std::size_t>(options.*member);
    return value == size ? unset : value;
  };
  return {
      std::move(names), std::move(texts),
      [member](SolverOptions& options, std::size_t i) { options.*member = static_cast<Enum>(i); },
      shown, shown({})};
}

/// Without Unset.
template <class Enum>
Choice choice(Enum SolverOptions::*member, std::vector<std::string_view> names,
              std::vector<std::string_view> texts) {
  const std::size_t size = names.size();
  return choice(member, std::move(names), std::move(texts), size);
}

using O = SolverOptions;
using Rows = std::vector<OptionInfo>;

Rows termination_options() {
  const std::string_view category = "Termination";
  return {
      {"tol", category,
       "Convergence tolerance of E_0, the scaled error of the first-order "
       "conditions.",
       positive(&O::tol)},
      {"dual_inf_tol", category,
       "Desired unscaled tolerance of the gradient of the Lagrangian, both players.",
       positive(&O::dual_inf_tol)},
      {"constr_viol_tol", category, "Desired unscaled tolerance of the constraint violation.",
       positive(&O::constr_viol_tol)},
      {"compl_inf_tol", category, "Desired unscaled tolerance of the complementarity.",
       positive(&O::compl_inf_tol)},
      {"acceptable_tol", category, "Acceptance threshold of E_0.", positive(&O::acceptable_tol)},
      {"acceptable_iter", category,
       "The solve stops after this many acceptable iterates in a row; 0: never.",
       at_least(&O::acceptable_iter, 0)},
      {"acceptable_dual_inf_tol", category, "Acceptance threshold of the dual infeasibility.",
       positive(&O::acceptable_dual_inf_tol)},
      {"acceptable_constr_viol_tol", category, "Acceptance threshold of the constraint violation.",
       positive(&O::acceptable_constr_viol_tol)},
      {"acceptable_compl_inf_tol", category, "Acceptance threshold of the complementarity.",
       positive(&O::acceptable_compl_inf_tol)},
      {"acceptable_obj_change_tol", category,
       "Acceptance threshold of the relative change of the objective in the last iteration.",
       nonnegative(&O::acceptable_obj_change_tol)},
      {"max_iter", category,
       "Maximum number of iterations, those of feasibility restorations included.",
       at_least(&O::max_iter, 0)},
      {"max_cpu_time", category, "Maximum number of CPU seconds.", positive(&O::max_cpu_time)},
      {"max_wall_time", category, "Maximum number of wall clock seconds.",
       positive(&O::max_wall_time)},
      {"minmax_max_factorizations", category,
       "Largest number of factorizations of K and K_yy (the KKT matrices, see docs/glossary.md) "
       "together, those of restorations included. It limits the work of a solve, on every machine "
       "alike. Two of them are reserved for the certificate. At the limit the solve ends as at "
       "max_iter, with the best point seen. 0: no limit.",
       at_least(&O::minmax_max_factorizations, 0)},
      {"diverging_iterates_tol", category,
       "Infinity norm of the variables above which the solve stops as diverging.",
       positive(&O::diverging_iterates_tol)},
      {"s_max", category,
       "If the multipliers are on average larger than this, E_0 is scaled "
       "down.",
       positive(&O::s_max)},
  };
}

Rows model_options() {
  const std::string_view category = "Model";
  return {
      {"nlp_lower_bound_inf", category, "Lower bounds at or below this value are absent.",
       any(&O::nlp_lower_bound_inf)},
      {"nlp_upper_bound_inf", category, "Upper bounds at or above this value are absent.",
       any(&O::nlp_upper_bound_inf)},
      {"bound_relax_factor", category,
       "Bounds are relaxed before the solve by this factor times the smaller of max(1, |bound|) "
       "and 100 times the distance to the other bound. Bounds move by at most constr_viol_tol.",
       nonnegative(&O::bound_relax_factor)},
      {"honor_original_bounds", category,
       "Whether the returned point is moved back into the bounds as given.",
       flag(&O::honor_original_bounds)},
      {"fixed_variable_treatment", category, "Treatment of variables with equal bounds.",
       choice(&O::fixed_variable_treatment,
              {"make_parameter", "make_parameter_nodual", "make_constraint", "relax_bounds"},
              {"they are taken out; one more gradient and Jacobian at the end give their "
               "multipliers",
               "they are taken out; their multipliers are zero",
               "they become free variables, each with an equality constraint of the same player",
               "their bounds are moved apart by bound_relax_factor, which must be positive"})},
      {"nlp_scaling_method", category, "How objective and constraints are scaled.",
       choice(&O::nlp_scaling_method, {"none", "gradient-based", "user-scaling"},
              {"no scaling",
               "scale the gradients at the starting point down to nlp_scaling_max_gradient",
               "factors given by the model"})},
      {"nlp_scaling_max_gradient", category, "Largest gradient after gradient-based scaling.",
       positive(&O::nlp_scaling_max_gradient)},
      {"nlp_scaling_min_value", category, "Smallest factor of gradient-based scaling.",
       nonnegative(&O::nlp_scaling_min_value)},
      {"obj_scaling_factor", category,
       "Additional factor of the objective. Negative: Min maximizes and Max minimizes, see "
       "docs/statuses.md.",
       within(&O::obj_scaling_factor, -kLargestScaling, false, kLargestScaling, false)},
      {"hessian_approximation", category, "Where the Hessian of the Lagrangian comes from.",
       choice(&O::hessian_approximation, {"limited-memory", "exact", "finite-difference-values"},
              {"limited-memory BFGS for a minimization, as in Ipopt; nothing is certified, "
               "because such a matrix does not have the true inertia. With Max variables: as "
               "finite-difference-values. The model's Hessian is not evaluated",
               "second derivatives of the model",
               "differences of gradient and Jacobian; the default if the model has no second "
               "derivatives"},
              1)},
  };
}

Rows derivative_test_options() {
  const std::string_view category = "Derivative Checker";
  return {
      {"derivative_test", category, "Derivatives compared with differences before the solve.",
       choice(&O::derivative_test, {"none", "first-order", "second-order", "only-second-order"},
              {"no test", "gradient and Jacobian", "also the Hessian", "the Hessian alone"})},
      {"derivative_test_tol", category, "Relative error above which a derivative counts as wrong.",
       positive(&O::derivative_test_tol)},
      {"derivative_test_perturbation", category,
       "Step of the derivative test's differences, times max(1, |v|).",
       positive(&O::derivative_test_perturbation)},
      {"derivative_test_print_all", category,
       "Whether the derivative test prints all entries, not only wrong ones.",
       flag(&O::derivative_test_print_all)},
      {"derivative_test_first_index", category,
       "Where the derivative test begins. First derivatives: a variable, from 0. Second "
       "derivatives: a constraint, from 0, or -1 for the objective. -2: test all.",
       at_least(&O::derivative_test_first_index, -2)},
      {"point_perturbation_radius", category,
       "Largest distance, in each variable, between the derivative test's point and the starting "
       "point.",
       nonnegative(&O::point_perturbation_radius)},
  };
}

Rows start_options() {
  const std::string_view category = "Initialization";
  return {
      {"bound_push", category,
       "The starting point is at least this times max(1, |bound|) away from a bound.",
       positive(&O::bound_push)},
      {"bound_frac", category,
       "The starting point is at least this times the distance between two bounds away from "
       "each, unless bound_push asks for less.",
       share(&O::bound_frac)},
      {"slack_bound_push", category, "bound_push of the slacks.", positive(&O::slack_bound_push)},
      {"slack_bound_frac", category, "bound_frac of the slacks.", share(&O::slack_bound_frac)},
      {"bound_mult_init_val", category, "Bound multipliers at the start.",
       positive(&O::bound_mult_init_val)},
      {"bound_mult_init_method", category, "How the bound multipliers start.",
       choice(&O::bound_mult_init_method, {"constant", "mu-based"},
              {"at bound_mult_init_val", "at mu_init over the distance to the bound"})},
      {"constr_mult_init_max", category,
       "Constraint multipliers start at least-squares estimates if none exceeds this. Otherwise, "
       "and with 0, they start at zero, but those of inequalities at the bound multiplier of their "
       "slack if bound_mult_init_method is mu-based.",
       nonnegative(&O::constr_mult_init_max)},
      {"warm_start_init_point", category,
       "Whether multipliers start from values that the model gives.",
       flag(&O::warm_start_init_point)},
      {"warm_start_bound_push", category, "bound_push of a warm start.",
       positive(&O::warm_start_bound_push)},
      {"warm_start_bound_frac", category, "bound_frac of a warm start.",
       share(&O::warm_start_bound_frac)},
      {"warm_start_slack_bound_push", category, "slack_bound_push of a warm start.",
       positive(&O::warm_start_slack_bound_push)},
      {"warm_start_slack_bound_frac", category, "slack_bound_frac of a warm start.",
       share(&O::warm_start_slack_bound_frac)},
      {"warm_start_mult_bound_push", category,
       "Least value of the bound multipliers of a warm start.",
       positive(&O::warm_start_mult_bound_push)},
      {"warm_start_mult_init_max", category, "Largest multiplier of a warm start.",
       positive(&O::warm_start_mult_init_max)},
  };
}

Rows barrier_options() {
  const std::string_view category = "Barrier Parameter";
  return {
      {"mu_init", category, "Barrier parameter at the start (the paper's b).",
       positive(&O::mu_init)},
      {"mu_target", category,
       "Final barrier parameter: the complementarity error is the violation of s z = mu_target. If "
       "it is positive, the certificate is about the barrier problem.",
       nonnegative(&O::mu_target)},
      {"mu_linear_decrease_factor", category,
       "kappa_mu of Ipopt's rule, sigma of the paper's Algorithm 1.",
       open(&O::mu_linear_decrease_factor, 0.0, 1.0)},
      {"mu_superlinear_decrease_power", category, "theta_mu of Ipopt's rule.",
       open(&O::mu_superlinear_decrease_power, 1.0, 2.0)},
      {"barrier_tol_factor", category,
       "kappa_epsilon: a barrier problem is solved when E_mu <= kappa_epsilon mu.",
       positive(&O::barrier_tol_factor)},
      {"tau_min", category, "Lower bound of the fraction-to-the-boundary parameter tau.",
       open(&O::tau_min, 0.0, 1.0)},
      {"kappa_sigma", category,
       "Bound multipliers stay within [mu/(kappa_sigma s), kappa_sigma mu/s].",
       from(&O::kappa_sigma, 1.0)},
      {"kappa_d", category,
       "Weight of the linear damping of variables with one bound. If mu_target is positive, the "
       "weight is at most tol / (10 mu_target). Not used in Algorithm 1.",
       nonnegative(&O::kappa_d)},
  };
}

Rows barrier_strategy_options() {
  const std::string_view category = "Barrier Parameter";
  return {
      {"minmax_barrier_rule", category, "How the barrier parameter decreases.",
       choice(&O::minmax_barrier_rule, {"ipopt", "paper"},
              {"mu <- max(min(tol, compl_inf_tol)/(kappa_epsilon + 1), min(kappa_mu mu, "
               "mu^theta_mu)) while E_mu <= kappa_epsilon mu",
               "mu <- sigma mu after a step with |g(z,mu)| <= mu (Algorithm 1; g is the residual "
               "of the first-order conditions)"})},
      {"mu_strategy", category, "Whether the barrier parameter only decreases.",
       choice(&O::mu_strategy, {"monotone", "adaptive"},
              {"as minmax_barrier_rule says",
               "mu_oracle chooses it in every iteration. While adaptive_mu_globalization sees no "
               "progress it decreases by Ipopt's monotone rule. As in Ipopt this is the default "
               "of a minimization with hessian_approximation limited-memory"},
              0)},
      {"mu_oracle", category, "How the adaptive strategy chooses mu.",
       choice(&O::mu_oracle, {"quality-function", "probing", "loqo"},
              {"least residual predicted by the linear model of the step; one more factorization",
               "Mehrotra's predictor step; one more factorization",
               "LOQO's formula from the spread of the complementarity products"})},
      {"adaptive_mu_globalization", category,
       "How the adaptive strategy measures progress. Ipopt's default is obj-constr-filter.",
       choice(
           &O::adaptive_mu_globalization, {"obj-constr-filter", "kkt-error", "never-monotone-mode"},
           {"filter on objective and violation; only without Max variables, because the "
            "objective may rise when Max gains",
            "reduction of the first-order residual", "no test, and no guarantee of convergence"})},
      {"mu_max", category,
       "Largest mu of the adaptive strategy, not below mu_min. 0: mu_max_fact times "
       "the average complementarity of the starting point, as in Ipopt by default.",
       nonnegative(&O::mu_max)},
      {"mu_max_fact", category, "See mu_max.", positive(&O::mu_max_fact)},
      {"mu_min", category,
       "Least mu of the adaptive strategy, at most half of the smaller of tol and compl_inf_tol.",
       positive(&O::mu_min)},
      {"adaptive_mu_kkterror_red_iters", category,
       "Number of earlier residuals. kkt-error sees progress if the residual is clearly below "
       "one of them.",
       at_least(&O::adaptive_mu_kkterror_red_iters, 0)},
      {"adaptive_mu_kkterror_red_fact", category,
       "Factor of an earlier residual below which "
       "kkt-error sees progress.",
       open(&O::adaptive_mu_kkterror_red_fact, 0.0, 1.0)},
      {"adaptive_mu_monotone_init_factor", category,
       "A monotone phase begins with this factor times the average complementarity.",
       positive(&O::adaptive_mu_monotone_init_factor)},
  };
}

Rows method_options() {
  const std::string_view category = "Minmax Method";
  return {
      {"minmax_globalization", category, "Which steps are accepted.",
       choice(&O::minmax_globalization, {"none", "filter"},
              {"every step: the paper's Algorithm 1",
               "filter line search on phi(x), the local maximum over y"})},
      {"minmax_instability", category,
       "Whether the instability rule, line 7 of the paper's Algorithm 1, is used. It keeps the "
       "iterates from converging to points at which K has the expected inertia and K_yy has not.",
       flag(&O::minmax_instability)},
      {"minmax_warm_start_shifts", category,
       "Whether shifts start from those of the last iteration (Ipopt's rule). no: anew in each "
       "iteration, as in the paper.",
       flag(&O::minmax_warm_start_shifts)},
      {"minmax_pure_newton", category,
       "Whether Newton's method is used without shifts and globalization, for comparison. It "
       "converges to first-order points of any kind.",
       flag(&O::minmax_pure_newton)},
      {"minmax_max_restarts", category,
       "Number of random starting points that are tried if the search from the model's start "
       "finds no local minmax, or the model is undefined there. 0: none. Unless this is 0, a "
       "minimization that is stuck starts again once, with the other mu_strategy.",
       at_least(&O::minmax_max_restarts, 0, 1000000)},
      {"minmax_robust_constraints", category,
       "Whether Min may own a constraint that reads Max variables, which must then hold for "
       "every y (a robust constraint). no: such a constraint is an error.",
       flag(&O::minmax_robust_constraints)},
  };
}

Rows multistart_options() {
  const std::string_view category = "Multistart";
  return {
      {"minmax_starts", category,
       "Number of starting points: the model's, then random ones. The best point is "
       "returned.",
       at_least(&O::minmax_starts, 1)},
      {"minmax_start_seed", category, "Seed of the random starting points: the same in every run.",
       at_least(&O::minmax_start_seed, 0)},
      {"minmax_start_radius", category,
       "Radius r of random starts. A variable without two bounds starts within r "
       "max(1, |s|) of its value s at the model's start, with r, r / 10 and r / 100 "
       "in turn. One with two bounds starts anywhere between them.",
       positive(&O::minmax_start_radius)},
      {"minmax_worst_case_starts", category,
       "Number of starts of maximizations over y, x held, for f and for each robust constraint. If "
       "f is higher, or a robust constraint violated, at a y that was found, the solve continues "
       "with this y. If such a y remains at the end, the answer is no success. 0: no search. -1: 8 "
       "for each robust constraint, or as few as 3 if these agree and are far below the limit. "
       "More follow, up to 100, while other maxima are to be expected, the constraint holds at all "
       "maxima found, and it would be violated at one a little higher. For f, -1 means the "
       "same with minmax_epigraph, 8 starts with minmax_worst_case_proof, and no search otherwise.",
       at_least(&O::minmax_worst_case_starts, -1)},
      {"minmax_worst_case_proof", category,
       "Whether branch and bound over y, with outward rounding, proves how large f and each robust "
       "constraint can become at the answer's x. If it finds a y with a higher value, the solve "
       "continues with this y. An answer without a complete proof is no success. Needs a model "
       "that gives its formulas, see docs/proof.md. At most 8 Max variables that are not fixed may "
       "count, all with two bounds (more if no box has to be divided): for f all of Max's, for a "
       "constraint those that it depends on, also through Max's constraints.",
       flag(&O::minmax_worst_case_proof)},
      {"minmax_concave_in_y", category,
       "yes states that f is concave in y and that the feasible y are a convex set. A local "
       "maximum over y is then the worst case over all of y, and one maximization is enough.",
       flag(&O::minmax_concave_in_y)},
  };
}

Rows robust_options() {
  const std::string_view category = "Robust Constraints";
  return {
      {"minmax_epigraph", category,
       "Whether f is treated as a robust constraint: min t subject to f(x, y) <= t for every y. "
       "The answer minimizes the largest value of f over the worst cases found, and it may be at a "
       "kink.",
       flag(&O::minmax_epigraph)},
      {"minmax_epigraph_at_kinks", category,
       "Whether a search that ends without a local minmax goes on as with "
       "minmax_epigraph, from its last point and with the maxima over y found there.",
       flag(&O::minmax_epigraph_at_kinks)},
  };
}

Rows shift_options() {
  const std::string_view category = "Hessian and Jacobian Shifts";
  return {
      {"first_hessian_perturbation", category, "First nonzero shift tried in a solve.",
       positive(&O::first_hessian_perturbation)},
      {"min_hessian_perturbation", category, "Smallest shift tried.",
       nonnegative(&O::min_hessian_perturbation)},
      {"max_hessian_perturbation", category, "Shift above which the correction gives up.",
       positive(&O::max_hessian_perturbation)},
      {"perturb_inc_fact_first", category,
       "Factor by which the first shift of a solve grows "
       "while it is too small.",
       from(&O::perturb_inc_fact_first, kLeastGrowth)},
      {"perturb_inc_fact", category, "Factor by which later shifts grow while they are too small.",
       from(&O::perturb_inc_fact, kLeastGrowth)},
      {"perturb_dec_fact", category,
       "Later the first shift tried is this factor times the last one that was used.",
       open(&O::perturb_dec_fact, 0.0, 1.0)},
      {"jacobian_regularization_value", category,
       "Shift of the rows of constraints in K when a Jacobian looks rank-deficient (delta_c).",
       nonnegative(&O::jacobian_regularization_value)},
      {"jacobian_regularization_exponent", category,
       "jacobian_regularization_value is multiplied by mu to this power.",
       nonnegative(&O::jacobian_regularization_exponent)},
  };
}

Rows linear_solver_options() {
  const std::string_view category = "Linear Solver";
  return {
      {"linear_solver", category, "Factorization of the KKT matrices.",
       choice(&O::linear_solver,
              {"auto", "mumps", "ldlt", "lapack", "mumps_mpi", "ma57", "spral", "pardiso",
               "pardisomkl", "ma97"},
              {"chosen by size and predicted fill", "MUMPS, sparse with pivoting",
               "sparse LDL' without pivoting on the signed-regularized matrix",
               "LAPACK, dense Bunch-Kaufman",
               "MUMPS on MPI ranks: mpirun -n 1 program : -n 7 ipminmax-worker",
               "MA57 of the HSL library that hsllib names",
               "SSIDS of the SPRAL library that minmax_spral_library names",
               "Pardiso of the Pardiso project's library that pardisolib names",
               "Pardiso of MKL: the library that pardisolib names, or libmkl_rt.so",
               "MA97 of the HSL library that hsllib names"})},
      {"minmax_ordering", category, "Fill-reducing ordering.",
       choice(&O::minmax_ordering, {"best", "amd", "pord", "metis"},
              {"AMD, or METIS if that is worth its time by predicted operations",
               "approximate minimum degree", "PORD (MUMPS only; AMD elsewhere)",
               "METIS nested dissection"})},
      {"minmax_schur_complement", category,
       "Whether K is factorized by way of K_yy and the dense Schur complement of K_yy "
       "in K, which has as many rows as x and its constraints. One factorization of "
       "K_yy then serves both matrices. The certificate factorizes K as a whole.",
       choice(&O::minmax_schur_complement, {"auto", "yes", "no"},
              {"if fewer operations are predicted", "always, with Max variables",
               "never: K and K_yy are factorized one by one"})},
      {"minmax_threads", category,
       "Largest number of threads. One factorization by LDL' uses them if its factor is no chain, "
       "takes longer than about a millisecond (by its counted operations), and its elimination "
       "tree has large independent subtrees. Maximizations of several robust constraints over y "
       "share them if the "
       "model can be cloned: formulas in C++, games by stages, a TNLP that is a ClonableModel. "
       "Results have the same bits with any number.",
       at_least(&O::minmax_threads, 1)},
  };
}

Rows mumps_options() {
  const std::string_view category = "Linear Solver";
  return {
      {"mumps_pivtol", category, "Pivot threshold of MUMPS.", closed_upto(&O::mumps_pivtol, 1.0)},
      {"mumps_pivtolmax", category, "Largest pivot threshold of MUMPS.",
       closed_upto(&O::mumps_pivtolmax, 1.0)},
      {"mumps_mem_percent", category, "Extra workspace of MUMPS in percent of its estimate.",
       at_least(&O::mumps_mem_percent, 0)},
      {"max_memory", category,
       "Memory of the process in MB (10^6 bytes). If MUMPS would need more, it is not started "
       "and the solve ends as out of memory. Limits that the system sets (address space, control "
       "group) hold in any case.",
       positive(&O::max_memory)},
      {"max_refinement_steps", category, "Largest number of refinement steps per linear system.",
       at_least(&O::max_refinement_steps, 0)},
      {"residual_ratio_max", category, "Residual ratio at which refinement stops.",
       positive(&O::residual_ratio_max)},
      {"residual_ratio_singular", category,
       "Residual ratio above which a factorization counts as inaccurate.",
       positive(&O::residual_ratio_singular)},
  };
}

Rows certificate_options() {
  const std::string_view category = "Minmax Method";
  return {
      {"minmax_certificate", category,
       "How much the second-order test at a first-order point may cost.",
       choice(
           &O::minmax_certificate, {"full", "quick", "none", "proved"},
           {"the test tries to certify or refute the point with at most 15 factorizations (43 if "
            "K has at most 300 rows, or with copies of y), or a fifth of those of the rest of the "
            "solve if that is more, and some to refute. Else the point is undecided",
            "at most two factorizations of K_yy and of K, and more only if an inertia is clearly "
            "wrong. Only points with clear curvature and clear active bounds are certified",
            "no test, for minimizations at Ipopt's cost. The test result is \"not tested\", "
            "and a saddle is not told from a minimum. Refused with Max variables",
            "as full, and interval arithmetic then proves that a strict local minmax of "
            "the formulas lies near a certified answer. For models that give their formulas, "
            "see docs/proof.md"})},
      {"minmax_curvature_tol", category,
       "Curvature below which the second-order test calls an eigenvalue zero, in "
       "scaled variables: in these the entries of the Hessian between variables with "
       "curvature are at most 1, so the units of the model do not matter.",
       positive(&O::minmax_curvature_tol)},
  };
}

Rows study_options() {
  const std::string_view category = "Study";
  return {
      {"minmax_freeze_tol", category,
       "delta_epsilon of Algorithm 1: shifts are kept while |g(z,mu)| is at most this. Above 0 the "
       "method may be attracted by points that are no local minmax (a message says so).",
       nonnegative(&O::minmax_freeze_tol)},
      {"minmax_residual_watchdog", category,
       "Algorithm 1 halves its steps while the residual exceeds the largest of the last ten.",
       flag(&O::minmax_residual_watchdog)},
      {"minmax_prescribed_delta_x", category,
       "Shift of the Min variables (the paper's epsilon_x) in every step of minmax_globalization "
       "none; negative: chosen by the inertias. Goes with minmax_prescribed_delta_y.",
       from(&O::minmax_prescribed_delta_x, -1.0)},
      {"minmax_prescribed_delta_y", category,
       "Shift of the Max variables (the paper's epsilon_y), alike.",
       from(&O::minmax_prescribed_delta_y, -1.0)},
      {"minmax_ldlt_gamma", category,
       "Signed regularization of linear_solver ldlt (the paper's Gamma); up to 1000 times that "
       "where the Jacobian's entries are larger than 1, as their square.",
       nonnegative(&O::minmax_ldlt_gamma)},
      {"minmax_difference_step", category,
       "Step of the differences that replace second derivatives, over the variables' lengths.",
       open(&O::minmax_difference_step, 0.0, 1.0)},
      {"minmax_distinct_tol", category,
       "Distance up to which two certified points, and two maxima over y, are the same: in each "
       "variable, relative to its box or, without two bounds, to the spread of its values.",
       positive(&O::minmax_distinct_tol)},
      {"minmax_worst_case_tol", category,
       "Violation of a robust constraint, relative to the range of the values that it was seen to "
       "take over y, from which a maximum over y becomes another worst case (with "
       "minmax_worst_case_starts).",
       positive(&O::minmax_worst_case_tol)},
      {"minmax_robust_copies", category,
       "Whether each robust constraint gets copies of its own of the Max variables that it shares "
       "with f or with other constraints.",
       flag(&O::minmax_robust_copies)},
  };
}

Rows make_table() {
  Rows table;
  for (const auto rows :
       {termination_options, model_options, derivative_test_options, start_options, barrier_options,
        barrier_strategy_options, method_options, multistart_options, robust_options, shift_options,
        linear_solver_options, mumps_options, certificate_options}) {
    std::ranges::move(rows(), std::back_inserter(table));
  }
  return table;
}

/// By name, then those of SolverOptions alone.
struct Tables {
  Rows registered = make_table();
  Rows unregistered = study_options();
};
const Tables& tables() {
  static const Tables made;
  return made;
}

template <class T>
std::string out_of_range(const OptionInfo& info, T value, T lower, T upper, bool lower_strict,
                         bool upper_strict) {
  std::ostringstream text;
  text << info.name << " = " << value << " is not in " << (lower_strict ? '(' : '[') << lower
       << ", " << upper << (upper_strict ? ')' : ']');
  return text.str();
}

std::string check(const OptionInfo& info, const SolverOptions& options) {
  if (const auto* number = std::get_if<Number>(&info.kind)) {
    const double value = options.*(number->member);
    const bool low_ok = number->lower_strict ? value > number->lower : value >= number->lower;
    const bool high_ok = number->upper_strict ? value < number->upper : value <= number->upper;
    if (!(low_ok && high_ok)) {
      return out_of_range(info, value, number->lower, number->upper, number->lower_strict,
                          number->upper_strict);
    }
  } else if (const auto* integer = std::get_if<Integer>(&info.kind)) {
    const int value = options.*(integer->member);
    if (value < integer->lower || value > integer->upper) {
      return out_of_range(info, value, integer->lower, integer->upper, false, false);
    }
  } else if (const auto* names = std::get_if<Choice>(&info.kind)) {
    if (names->get(options) >= names->names.size()) {
      return std::string(info.name) + " is not one of its choices";
    }
  }
  return {};
}

}  // namespace

std::span<const OptionInfo> option_table() { return tables().registered; }
std::span<const OptionInfo> unregistered_settings() { return tables().unregistered; }

SolverOptions as_printed(SolverOptions options) {
  options.minmax_globalization = Globalization::None;
  options.minmax_barrier_rule = BarrierRule::Paper;
  options.mu_strategy = BarrierStrategy::Monotone;
  options.minmax_warm_start_shifts = false;
  options.first_hessian_perturbation = 1e-4;
  options.perturb_inc_fact_first = options.perturb_inc_fact = 10.0;
  options.jacobian_regularization_value = 0.0;
  options.nlp_scaling_method = Scaling::None;
  options.bound_relax_factor = 0.0;
  options.bound_mult_init_method = BoundMultiplierInit::MuBased;
  options.constr_mult_init_max = 0.0;
  options.kappa_sigma = 1e100;
  options.acceptable_iter = 0;
  return options;
}

std::string check(const SolverOptions& options) {
  for (const auto rows : {option_table(), unregistered_settings()}) {
    for (const OptionInfo& info : rows) {
      if (auto error = check(info, options); !error.empty()) return error;
    }
  }
  if (!(options.nlp_lower_bound_inf < options.nlp_upper_bound_inf)) {
    return "nlp_lower_bound_inf is not below nlp_upper_bound_inf";
  }
  if (options.fixed_variable_treatment == FixedVariableTreatment::RelaxBounds &&
      options.bound_relax_factor == 0.0) {
    return "fixed_variable_treatment = relax_bounds needs a positive bound_relax_factor";
  }
  if (options.mu_strategy == BarrierStrategy::Adaptive &&
      options.minmax_barrier_rule == BarrierRule::Paper) {
    return "mu_strategy = adaptive and minmax_barrier_rule = paper exclude each other";
  }
  const bool x_prescribed = options.minmax_prescribed_delta_x >= 0.0;
  if (x_prescribed != (options.minmax_prescribed_delta_y >= 0.0)) {
    return "minmax_prescribed_delta_x and minmax_prescribed_delta_y go together";
  }
  if (x_prescribed && options.minmax_globalization != Globalization::None) {
    return "minmax_prescribed_delta_x needs minmax_globalization = none";
  }
  if (options.obj_scaling_factor == 0.0) return "obj_scaling_factor = 0 removes the objective";
  if (!is_sane_scaling(std::abs(options.obj_scaling_factor))) {
    std::ostringstream text;
    text << "obj_scaling_factor = " << options.obj_scaling_factor << " is not of a size in ["
         << kLeastScaling << ", " << kLargestScaling << "]";
    return text.str();
  }
  return {};
}

}  // namespace ipminmax
