#pragma once

#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/differences/hessian_detection.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"

namespace ipminmax {

/// A model whose Hessian of sigma f + lambda' g comes from differences of its gradient and
/// Jacobian; everything else is passed on.
///
/// The pattern is the model's structure of the Hessian or, when it has none, detected
/// (detect_hessian_pattern) and then checked: H d must agree with the difference along a random
/// direction d at points of its own, else the rows that disagree are filled. The same check is part
/// of hessian_errors, which the certificate asks for, so that an entry missed everywhere before
/// does not pass for a zero.
///
/// Variables are perturbed in groups (color_hessian) by minmax_difference_step times their length
/// (length_of): to both sides, or twice to one side near a bound. The error is of second order in
/// the step both ways.
/// Of many groups the last Hessian is returned again where three evaluations along a random
/// direction do not tell it from differences, as of a bilinear game.
/// Where a point is undefined, the group's variables are perturbed one by one, to the other side
/// and with smaller steps; when nothing helps, the Hessian is undefined.
class FiniteDifferenceHessian final : public Problem {
 public:
  /// The model must outlive this object. Detection evaluates it around its starting point. Only a
  /// structure with indices in range and consistent bounds is looked at; any other is left to the
  /// solver's own checks.
  /// known: the pattern where the model has none, lower triangle, not to be detected again; copied.
  FiniteDifferenceHessian(Problem& model, const SolverOptions& options,
                          const std::vector<Triplet>* known = nullptr);

  /// Evaluations of gradient and Jacobian for one Hessian away from bounds are twice this.
  [[nodiscard]] Index groups() const { return static_cast<Index>(coloring_.groups.size()); }
  /// Calls of the model that differences caused.
  [[nodiscard]] Index gradients() const { return source_.gradients(); }
  [[nodiscard]] Index jacobians() const { return source_.jacobians(); }

  /// Adds all pairs of the rows in which hessian_errors found entries missing since the last call.
  /// False: none were, or the pattern had them. Solvers have to start anew with the new structure.
  [[nodiscard]] bool widen();

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    return model_.user_scaling(scaling);
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override;
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override;

 private:
  enum class Side : std::uint8_t { Best, Up, Down };
  /// Distances of the two points of a variable's difference from its value.
  struct Offsets {
    double first = 0.0, second = 0.0;
  };
  /// Weights of f and g in the Lagrangian.
  struct Multipliers {
    double sigma;
    std::span<const double> lambda;
    [[nodiscard]] bool weigh_any_row() const {
      return std::ranges::any_of(lambda, [](double weight) { return weight != 0.0; });
    }
  };
  struct Start {
    std::vector<double> v, lambda, z_lower, z_upper;
  };

  [[nodiscard]] bool take_start();
  void choose_pattern(const std::vector<Triplet>* known);
  [[nodiscard]] std::vector<Triplet> given_pattern() const;
  void verify_detection(std::span<const double> start, Index most);
  void set_pattern(std::vector<Triplet> pattern);
  [[nodiscard]] bool fill(const std::vector<Index>& rows);

  [[nodiscard]] bool new_point(bool new_v);
  void move_base(std::span<const double> v);
  [[nodiscard]] bool load_base(std::span<const double> v, const Multipliers& multipliers);
  [[nodiscard]] double length_at(std::size_t i, double v) const;
  [[nodiscard]] Offsets offsets(std::size_t i, double v, double scale, Side side) const;
  [[nodiscard]] bool differences(std::span<const double> v, const Multipliers& multipliers,
                                 double scale, std::span<double> values,
                                 std::span<double> rounding);
  [[nodiscard]] bool difference(std::span<const Index> variables,
                                std::span<const HessianColoring::Entry> entries, double scale,
                                Side side, std::span<const double> v,
                                const Multipliers& multipliers, std::span<double> values,
                                std::span<double> rounding);
  [[nodiscard]] bool difference_alone(std::span<const HessianColoring::Entry> entries, double scale,
                                      std::span<const double> v, const Multipliers& multipliers,
                                      std::span<double> values, std::span<double> rounding);
  [[nodiscard]] bool find_change(const Multipliers& multipliers, std::vector<double>& change);
  /// Rows in which the values disagree with the difference along a random direction, by more than
  /// that share of their size, too; empty optional: undefined along every direction tried.
  [[nodiscard]] std::optional<std::vector<Index>> disagreeing_rows(std::span<const double> v,
                                                                   const Multipliers& multipliers,
                                                                   std::span<const double> values,
                                                                   std::span<const double> errors,
                                                                   double share);
  /// Values with the error estimate of each.
  [[nodiscard]] bool values_with_errors(std::span<const double> v, const Multipliers& multipliers,
                                        std::vector<double>& values, std::vector<double>& errors);

  Problem& model_;
  FirstDerivativeSource source_;
  double step_;
  ProblemStructure structure_;
  std::vector<bool> free_;  ///< per variable, not fixed by its bounds
  HessianColoring coloring_;
  bool warm_start_;
  std::optional<Start> start_;
  std::vector<Index> missing_;  ///< rows found to disagree, since the last widen
  std::mt19937_64 random_{19791117};

  bool moved_ = false;          ///< the model was last called at a point of a difference
  std::vector<double> base_v_;  ///< where base_ was evaluated
  bool base_gradient_ = false, base_jacobian_ = false;
  FirstDerivatives base_, ahead_;
  std::vector<double> kept_, kept_rounding_, kept_v_;  ///< the last Hessian, and where
  std::vector<double> trial_, first_, second_, third_, magnitude_;
  std::vector<Offsets> offsets_;  ///< of the group at hand
};

}  // namespace ipminmax
