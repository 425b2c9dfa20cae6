#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/model/iterate.hpp"
#include "core/model/kept.hpp"
#include "core/model/parameters.hpp"
#include "core/model/quasi_newton.hpp"
#include "core/model/variable_map.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

class SolveLimit;

/// Factors of a gradient-based scaling with the options that they were made with.
struct GradientScaling {
  double objective = 1.0;     ///< obj_scaling_factor not included
  Array<double> constraints;  ///< canonical
  double largest_gradient = 0.0, least_factor = 0.0;
};

/// What a CanonicalProblem holds, kept from one to the next.
struct CanonicalArrays {
  VariableMap map_;
  std::vector<Index> lower_bounded_, upper_bounded_;
  Eigen::VectorXd lower_, upper_, damping_;
  /// By how much keep_distances has moved the bounds: too little to be added to large ones.
  Eigen::VectorXd room_below_, room_above_;
  Eigen::VectorXd right_hand_side_;  ///< of equalities, scaled; 0 for inequalities
  std::vector<double> jacobian_scale_, hessian_scale_;  ///< hessian_scale empty: all one
  Array<double> col_scale_, row_scale_;
  GradientScaling gradient_scaling_;
  struct {
    Array<double> v, lambda, z_lower, z_upper;
  } model_start_;  ///< as the model gave it
  Iterate start_;
  // In the model's shapes
  Array<double> model_v_, model_g_, model_gradient_, model_lambda_;
  Array<double> model_jacobian_, model_hessian_, model_errors_;
  Array<double> objective_point_;  ///< of the model, where its objective was last asked for
  Array<double> constraints_point_, constraint_values_;  ///< the same for the constraints
};

/// The problem that the method works on:
///
///     min over (x, s_x)   max over (y, s_y)   f(v)   s.t.  c(v) = 0,  lower <= v <= upper
///
/// Variables are ordered x | s_x | y | s_y and constraints Min | Max. Fixed variables are left out
/// (fixed_variable_treatment has alternatives), constraints without bounds too; every inequality
/// g(v) in [l, u] has become g(v) - s = 0 with a slack s in [l, u] owned by the constraint's owner.
/// Everything is scaled, bounds are relaxed by bound_relax_factor.
class CanonicalProblem : Kept<CanonicalArrays> {
 public:
  /// arrays: of no other problem that is in use; null: its own.
  CanonicalProblem(Problem& problem, const SolverOptions& options, Counts& counts, Timing& timing,
                   CanonicalArrays* arrays = nullptr);

  /// Checks the model and builds the canonical form. The error names what is wrong; the status
  /// that goes with it is error_status(). kept: the scaling of a problem of the same shape, to be
  /// used instead of a new one; null for none. limit: asked between the steps; null for none.
  [[nodiscard]] std::string build(const GradientScaling* kept = nullptr,
                                  SolveLimit* limit = nullptr);
  /// The gradient-based scaling, where that is the method and no kept one was used; else null.
  [[nodiscard]] const GradientScaling* gradient_scaling() const {
    return makes_scaling_ ? &gradient_scaling_ : nullptr;
  }
  [[nodiscard]] Status error_status() const { return error_status_; }

  [[nodiscard]] Index variables() const { return map_.variables(); }
  [[nodiscard]] Index constraints() const { return map_.constraints(); }
  [[nodiscard]] IndexRange x() const { return map_.x; }  ///< Min variables of the model
  [[nodiscard]] IndexRange x_slacks() const { return map_.x_slacks; }
  [[nodiscard]] IndexRange y() const { return map_.y; }  ///< Max variables of the model
  [[nodiscard]] IndexRange y_slacks() const { return map_.y_slacks; }
  /// Whether the model has no free variable: only slacks are left.
  [[nodiscard]] bool is_constant() const { return x().size() + y().size() == 0; }
  [[nodiscard]] IndexRange min_constraints() const { return map_.min_constraints; }
  [[nodiscard]] IndexRange max_constraints() const { return map_.max_constraints; }
  [[nodiscard]] Index max_size() const { return variables() - map_.y.begin; }  ///< slacks included
  /// Whether the Max player has any bound or inequality.
  [[nodiscard]] bool has_max_bounds() const {
    return (!lower_bounded_.empty() && owned_by_max(lower_bounded_.back())) ||
           (!upper_bounded_.empty() && owned_by_max(upper_bounded_.back()));
  }
  [[nodiscard]] bool owned_by_max(Index variable) const { return map_.owned_by_max(variable); }
  /// +1 for Min variables, -1 for Max: the sign of barrier terms and bound multipliers.
  [[nodiscard]] double sign(Index variable) const { return owned_by_max(variable) ? -1.0 : 1.0; }

  [[nodiscard]] const Eigen::VectorXd& lower() const { return lower_; }
  [[nodiscard]] const Eigen::VectorXd& upper() const { return upper_; }
  /// Distances of a value of variable i to its bounds, never zero for a value in the bounds or
  /// rounded out of them: the only place that subtracts bounds.
  [[nodiscard]] double above_lower(Index i, double value) const {
    return safe_distance(value - lower_[i] + room_below_[i], lower_[i]);
  }
  [[nodiscard]] double below_upper(Index i, double value) const {
    return safe_distance(upper_[i] - value + room_above_[i], upper_[i]);
  }
  /// Moves bounds that an iterate meets but for rounding so far away that the products with their
  /// multipliers are mu, slightly: Waechter and Biegler 2006, section 3.5, and Ipopt's slack_move.
  void keep_distances(const Iterate& iterate, double mu);
  [[nodiscard]] std::span<const Index> lower_bounded() const { return lower_bounded_; }
  [[nodiscard]] std::span<const Index> upper_bounded() const { return upper_bounded_; }
  /// Gradient, over mu, of the linear terms that keep variables with one bound from running away:
  /// sign kappa_d for a lower bound alone, -sign kappa_d for an upper one [WB, 3.7]; zero for
  /// Algorithm 1.
  [[nodiscard]] const Eigen::VectorXd& damping() const { return damping_; }
  /// Slack variable of a constraint, -1 for an equality; the same of all.
  [[nodiscard]] Index slack_of(Index constraint) const {
    return map_.slack_of_constraint[constraint];
  }
  [[nodiscard]] std::span<const Index> slack_of_constraint() const {
    return map_.slack_of_constraint;
  }

  /// Constraints of Min that read Max variables: they must hold for every y, so Max tries to
  /// violate them. Inequalities all; ascending.
  [[nodiscard]] std::span<const Index> robust_constraints() const {
    return map_.robust_constraints;
  }

  /// Max variables and constraints that serve one robust constraint alone maximize it whatever its
  /// multiplier lambda_r is: L = f + sum over r of lambda_r (g_r + mu ln(distances of y_r)) - ...
  /// The products of their distances and bound multipliers go to weight mu, and their errors,
  /// lengths and shifts are those of max g_r, which are L's over weight = |lambda_r|.
  [[nodiscard]] const RowOwners& owners() const { return map_.owners; }
  [[nodiscard]] bool has_copies() const { return !owners().slack_of_variable.empty(); }
  /// Slack of the robust constraint that a variable or a constraint serves, -1: none.
  [[nodiscard]] Index served_slack(Index variable) const {
    return has_copies() ? owners().slack_of_variable[variable] : -1;
  }
  [[nodiscard]] Index slack_served_by_constraint(Index constraint) const {
    return has_copies() ? owners().slack_of_constraint[constraint] : -1;
  }
  /// |lambda_r| by the slack's bound, 1 for no slack (-1).
  [[nodiscard]] static double weight_by(Index slack, const Iterate& iterate) {
    return slack < 0 ? 1.0 : iterate.z_lower[slack] + iterate.z_upper[slack];
  }
  [[nodiscard]] double weight(Index variable, const Iterate& iterate) const {
    return weight_by(served_slack(variable), iterate);
  }

  /// lambda_r by the slack's bound: negative where that is the lower one.
  [[nodiscard]] static double signed_weight(Index slack, const Iterate& iterate) {
    return iterate.z_upper[slack] - iterate.z_lower[slack];
  }
  /// Of a constraint that copies serve.
  [[nodiscard]] Index constraint_of_slack(Index slack) const {
    return owners().constraint_of_slack[slack];
  }

  /// Patterns without the slacks' entries (which are -1): row = constraint, col = variable.
  [[nodiscard]] std::span<const Triplet> jacobian() const { return map_.jacobian; }
  [[nodiscard]] std::span<const Triplet> hessian() const { return map_.hessian; }

  /// The model's starting point, which is asked for once, pushed into the bounds; slacks at zero,
  /// multipliers zero or, for a warm start, those of the model.
  [[nodiscard]] const Iterate& starting_point() const { return start_; }
  /// Sets the slacks from c evaluated with the slacks at zero.
  void start_slacks(Iterate& start, const Eigen::VectorXd& c) const;

  /// The functions at a point. False: undefined there, or not finite; evaluation_error says which.
  [[nodiscard]] bool objective(const Eigen::VectorXd& v, double& f);
  /// c, slacks included.
  [[nodiscard]] bool constraints(const Eigen::VectorXd& v, Eigen::VectorXd& c);
  /// Objective and constraints.
  [[nodiscard]] bool values(const Eigen::VectorXd& v, double& f, Eigen::VectorXd& c);
  /// Gradient and Jacobian.
  [[nodiscard]] bool first_derivatives(const Eigen::VectorXd& v, Evaluation& evaluation);
  /// Of a minimization with limited-memory Hessian: from the first derivatives there, which have to
  /// be in the evaluation.
  [[nodiscard]] bool second_derivatives(const Eigen::VectorXd& v, const Eigen::VectorXd& lambda,
                                        Evaluation& evaluation, double objective_factor = 1.0);
  /// Diagonal R with -R <= error of the Hessian of f + lambda' c <= R as quadratic forms, per
  /// canonical variable; infinite where unknown. Empty: exact up to rounding.
  [[nodiscard]] std::optional<Eigen::VectorXd> hessian_error(const Eigen::VectorXd& v,
                                                             const Eigen::VectorXd& lambda);
  /// The point in the model's variables, until the next evaluation.
  [[nodiscard]] std::span<const double> model_point(const Eigen::VectorXd& v) {
    static_cast<void>(load(v));
    return model_v_;
  }
  /// Names the function and entry of the last evaluation that failed.
  [[nodiscard]] std::string evaluation_error();
  /// How a solve ends that cannot go on without it: EvaluationFailed or InvalidNumber.
  [[nodiscard]] Status evaluation_status() const { return evaluation_failure_.status; }

  /// Whether a call of the model has begun and not ended: an exception on its way is the model's.
  [[nodiscard]] bool inside_model() const { return inside_model_; }

  /// The first constraint without a free variable whose value, as last evaluated, violates it by
  /// more than constr_viol_tol.
  [[nodiscard]] std::optional<Index> violated_constant_constraint() const;

  /// Fills v, lambda, z, constraints, objective of the result in the model's units; NaN where the
  /// model's functions are undefined.
  void restore(const Iterate& iterate, Result& result);
  /// The factors of objective, variables and constraints, in the model's order; 1 for what has
  /// been taken out.
  void write_scaling(UserScaling& factors) const;
  /// Largest violation of the model's own bounds and constraints by a result's v and constraints.
  [[nodiscard]] double violation(const Result& result) const;
  /// The model's constraint that a result's constraints violate most; 0 where none is violated.
  [[nodiscard]] Index most_violated_constraint(const Result& result) const;
  [[nodiscard]] double unscaled_objective(double f) const { return f / objective_scale_; }
  /// Factor by which a canonical constraint was scaled.
  [[nodiscard]] double constraint_scale(Index constraint) const { return row_scale_[constraint]; }
  [[nodiscard]] double objective_scale() const { return objective_scale_; }
  /// Factor, without its sign, by which f of the model that tolerances are meant for was scaled.
  [[nodiscard]] double user_objective_scale() const {
    return std::abs(objective_scale_ * structure_.objective_factor);
  }
  /// Factor by which a canonical variable was scaled.
  [[nodiscard]] double variable_scale(Index variable) const { return col_scale_[variable]; }

  /// Of the model, for a canonical variable or constraint; -1: a slack, or a constraint that fixes
  /// a variable.
  [[nodiscard]] Index model_variable(Index variable) const { return map_.model_variable[variable]; }
  [[nodiscard]] Index model_constraint(Index constraint) const {
    return map_.model_constraint[constraint];
  }
  /// Name of a model variable or constraint for messages.
  [[nodiscard]] std::string variable_name(Index model_variable) const;
  [[nodiscard]] std::string constraint_name(Index model_constraint) const;
  /// Of a canonical variable that is no slack, and of a canonical constraint.
  [[nodiscard]] std::string column_name(Index variable) const {
    return variable_name(model_variable(variable));
  }
  [[nodiscard]] std::string row_name(Index constraint) const;

 private:
  template <class Call>
  [[nodiscard]] bool ask(const Call& call) {
    inside_model_ = true;
    const bool defined = call();
    inside_model_ = false;
    return defined;
  }
  /// Not negative; of bounds that are none, zero.
  [[nodiscard]] double bound_violation(double value, double lower, double upper) const;
  /// slack_move of Ipopt, over max(1, |bound|).
  static constexpr double kSlackMove = 1.8189894035458565e-12;  // epsilon^(3/4)
  [[nodiscard]] static double safe_distance(double distance, double bound) {
    const bool rounded = distance < parameters::kVanished &&
                         -distance <= kSlackMove * std::max(1.0, std::abs(bound));
    return rounded ? parameters::kVanished : distance;
  }
  void make_buffers();
  [[nodiscard]] std::string read_start();
  [[nodiscard]] std::string check_start();
  [[nodiscard]] std::string scale(const GradientScaling* kept);
  [[nodiscard]] std::string user_scaling();
  void scale_variables();
  [[nodiscard]] std::string gradient_based_scaling();
  [[nodiscard]] std::string scale_gradients();
  void set_bounds(Index variable, double lower, double upper);
  void set_variable_bounds();
  void set_constraint_bounds();
  void list_bounds();
  void push_start();
  void start_multipliers();
  void scale_entries();
  void begin_quasi_newton();
  // False: not finite, and no point to evaluate the model at.
  [[nodiscard]] bool load(const Eigen::VectorXd& v);
  [[nodiscard]] bool load_multipliers(const Eigen::VectorXd& lambda);
  [[nodiscard]] bool take_new_point();
  /// Value of a canonical Jacobian entry, unscaled, after the model's Jacobian was evaluated.
  [[nodiscard]] double model_jacobian(std::size_t entry) const {
    const Index source = map_.jacobian_source[entry];
    return source >= 0 ? model_jacobian_[source] : 1.0;
  }
  void restore_fixed_multipliers(Result& result);
  void restore_values(bool finite, Result& result);
  void set_fixed_multiplier(Index model_variable, double slope, Result& result) const;
  /// The model's function and entry that failed; the text is made when it is asked for.
  struct EvaluationFailure {
    std::string_view function{};
    Status status = Status::InvalidNumber;
    Index row = -1;  ///< canonical constraint
    Index col = -1;  ///< canonical variables
    Index other_col = -1;
  };
  bool fails(const EvaluationFailure& failure) {
    evaluation_failure_ = failure;
    return false;
  }
  /// How messages call it: by the first constraint that is undefined, where that can be told.
  std::string undefined_function(std::string_view function);
  bool undefined(std::string_view function) {
    return fails({.function = function, .status = Status::EvaluationFailed});
  }
  [[nodiscard]] std::string fail(Status status, std::string message);

  Problem& problem_;
  const ProblemStructure& structure_;
  const SolverOptions& options_;
  Counts& counts_;
  Timing& timing_;
  Status error_status_ = Status::InvalidProblem;

  double objective_scale_ = 1.0;
  bool makes_scaling_ = false;
  double objective_value_ = 0.0;
  bool new_point_ = true;
  bool inside_model_ = false;
  std::optional<QuasiNewton> quasi_newton_;  ///< in place of the model's Hessian
  std::uint64_t derivative_calls_ = 0;       ///< of Jacobian and Hessian
  EvaluationFailure evaluation_failure_;
};

/// visit(variable, side, distance) for every bound: all lower ones (side -1), then the upper ones
/// (side +1).
template <class Visit>
void for_each_bound(const CanonicalProblem& canonical, const Eigen::VectorXd& v, Visit&& visit) {
  for (const Index i : canonical.lower_bounded()) visit(i, -1, canonical.above_lower(i, v[i]));
  for (const Index i : canonical.upper_bounded()) visit(i, 1, canonical.below_upper(i, v[i]));
}
/// The bound's multiplier in an iterate, or its entry of a step.
template <class Multipliers>
[[nodiscard]] auto& multiplier_of(Multipliers& z, Index i, int side) {
  return side < 0 ? z.z_lower[i] : z.z_upper[i];
}

/// What a bound is relaxed by, in the model's units: Ipopt's rule, but that a narrow interval is
/// not widened by more than 100 bound_relax_factor of its width (infinite: one bound alone).
[[nodiscard]] inline double relaxation(double bound, double width, const SolverOptions& options) {
  constexpr double kMostOfWidth = 100.0;
  double size = std::max(1.0, std::abs(bound));
  if (width > 0.0) size = std::min(size, kMostOfWidth * width);
  return std::min(options.bound_relax_factor * size, options.constr_viol_tol);
}

/// The same in canonical units. side: -1 of the lower bound, +1 of the upper one.
[[nodiscard]] inline double relaxation_of(const CanonicalProblem& canonical, Index i, int side,
                                          const SolverOptions& options) {
  const double scale = canonical.variable_scale(i);
  const double bound = side < 0 ? canonical.lower()[i] : canonical.upper()[i];
  const double width = canonical.upper()[i] - canonical.lower()[i];
  return scale * relaxation(bound / scale, width / scale, options);
}

}  // namespace ipminmax
