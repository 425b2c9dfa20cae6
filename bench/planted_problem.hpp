#pragma once

#include <memory>
#include <vector>

#include "core/problem.hpp"

namespace bench {

/// With d = v - v*:   f = d'Hd/2 + sum q_i d_i^4 / 4 + s'd,   J d = 0,   bounds,
/// with s = -J'lambda* + z_lower* - z_upper*, so that v* meets the first-order conditions. Sparse;
/// every evaluation is one pass over the entries.
class PlantedProblem final : public ipminmax::Problem {
 public:
  using Index = ipminmax::Index;

  /// A variable with its value at the solution; returns its number.
  Index add_variable(ipminmax::Player player, double solution, double quartic = 0.0);
  /// Entry (i, j) of H, given once per pair.
  void add_curvature(Index i, Index j, double value);
  /// An equality with its multiplier at the solution; returns its number.
  Index add_equality(double multiplier);
  void add_coefficient(Index equality, Index variable, double value);
  /// lower <= v_i <= upper, with the bound's multiplier at the solution if it is active there.
  void set_bounds(Index i, double lower, double upper, double multiplier = 0.0);
  /// Call once, after everything was added. Starts are v* + distance sin(7 i).
  void finish(double distance);

  [[nodiscard]] const std::vector<double>& solution() const { return solution_; }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>,
                             bool, std::span<double> values) override;

 private:
  ipminmax::ProblemStructure structure_;
  std::vector<double> solution_, quartic_, slope_;
  std::vector<double> curvature_;     ///< per entry of structure_.hessian
  std::vector<double> coefficients_;  ///< per entry of structure_.jacobian
  std::vector<double> multipliers_;
  double distance_ = 0.0;
};

/// x_i, y_i on the nodes of a graph: A = diag(cos i) + .2 per edge indefinite, C = I - .1 per edge,
///
///   f = dx'A dx/2 + 2 dx'dy - dy'C dy/2 + sum dx^4/8 - dy^4/40,   |x| <= 1, a quarter active.
///
/// C is positive definite by its diagonal (at most 4 edges), and so is A + 4 C^-1 >= 4/1.4 - 1.8:
/// v* is a local minmax.
[[nodiscard]] std::unique_ptr<PlantedProblem> quartic_chain(ipminmax::Index nodes);
[[nodiscard]] std::unique_ptr<PlantedProblem> quartic_grid(ipminmax::Index side);

/// Control u of Min against a source w of Max; the state z is Max's: K z = u + w on a grid, K = I +
/// five-point Laplacian (seven-point in a cube),
///
///   f = |dz|^2/2 + |du|^2/20 - |dw|^2 + sum du^4/8 - dw^4/40 + s'd,   |u| <= 1, a quarter of it
///   active.
///
/// Given u, f is strictly concave in w, because |K^-1| <= 1 < 2; given w it is convex in u. So v*
/// is the only local minmax.
[[nodiscard]] std::unique_ptr<PlantedProblem> elliptic_grid(ipminmax::Index side);
[[nodiscard]] std::unique_ptr<PlantedProblem> elliptic_cube(ipminmax::Index side);

}  // namespace bench
