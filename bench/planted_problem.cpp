#include "planted_problem.hpp"

#include <algorithm>
#include <cmath>

namespace bench {
namespace {

using ipminmax::Index;
using ipminmax::Player;

constexpr double kUnbounded = 2e19;
constexpr double kStartDistance = 0.5;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// A Min variable in [-1, 1]; every fourth is at a bound, in turn the lower and the upper.
Index add_boxed(PlantedProblem& p, Index node, double quartic) {
  const bool active = node % 4 == 0;
  const bool lower = node % 8 == 0;
  const double solution = active ? (lower ? -1.0 : 1.0) : 0.6 * std::sin(2.0 * node);
  const Index i = p.add_variable(Player::Min, solution, quartic);
  p.set_bounds(i, -1.0, 1.0, active ? 0.5 + 0.4 * std::sin(3.0 * node) : 0.0);
  return i;
}

/// Nodes 0 ... count - 1 with the edges that for_each_edge gives.
template <class ForEachEdge>
std::unique_ptr<PlantedProblem> quartic_graph(Index count, ForEachEdge&& for_each_edge) {
  auto p = std::make_unique<PlantedProblem>();
  for (Index i = 0; i < count; ++i) (void)add_boxed(*p, i, 0.5);
  for (Index i = 0; i < count; ++i) p->add_variable(Player::Max, std::cos(5.0 * i), -0.1);
  for (Index i = 0; i < count; ++i) {
    p->add_curvature(i, i, std::cos(i + 1.0));
    p->add_curvature(count + i, i, 2.0);
    p->add_curvature(count + i, count + i, -1.0);
  }
  for_each_edge([&](Index i, Index j) {
    p->add_curvature(i, j, 0.2);
    p->add_curvature(count + i, count + j, 0.1);
  });
  p->finish(kStartDistance);
  return p;
}

/// Edges of a square or, in three dimensions, a cube.
template <class Visit>
void for_each_grid_edge(int dimensions, Index side, Visit&& visit) {
  const Index layers = dimensions == 3 ? side : 1;
  for (Index node = 0; node < layers * side * side; ++node) {
    if (node % side > 0) visit(node, node - 1);
    if (node / side % side > 0) visit(node, node - side);
    if (node / (side * side) > 0) visit(node, node - side * side);
  }
}

/// The game of elliptic_grid, elliptic_cube.
std::unique_ptr<PlantedProblem> elliptic_game(int dimensions, Index side) {
  const Index count = (dimensions == 3 ? side : 1) * side * side;
  auto p = std::make_unique<PlantedProblem>();
  for (Index i = 0; i < count; ++i) (void)add_boxed(*p, i, 0.5);
  for (Index i = 0; i < count; ++i) p->add_variable(Player::Max, std::cos(5.0 * i), -0.1);
  for (Index i = 0; i < count; ++i) p->add_variable(Player::Max, std::sin(3.0 * i));
  const auto u = [](Index i) { return i; };
  const auto w = [count](Index i) { return count + i; };
  const auto z = [count](Index i) { return 2 * count + i; };
  for (Index i = 0; i < count; ++i) {
    p->add_curvature(u(i), u(i), 0.1);
    p->add_curvature(w(i), w(i), -2.0);
    p->add_curvature(z(i), z(i), 1.0);
    const Index row = p->add_equality(std::sin(11.0 * i));
    p->add_coefficient(row, z(i), 1.0 + 2.0 * dimensions);
    p->add_coefficient(row, u(i), -1.0);
    p->add_coefficient(row, w(i), -1.0);
  }
  for_each_grid_edge(dimensions, side, [&](Index i, Index j) {
    p->add_coefficient(i, z(j), -1.0);
    p->add_coefficient(j, z(i), -1.0);
  });
  p->finish(kStartDistance);
  return p;
}

}  // namespace

Index PlantedProblem::add_variable(Player player, double solution, double quartic) {
  structure_.variable_players.push_back(player);
  structure_.variable_lower.push_back(-kUnbounded);
  structure_.variable_upper.push_back(kUnbounded);
  solution_.push_back(solution);
  quartic_.push_back(quartic);
  slope_.push_back(0.0);
  return static_cast<Index>(solution_.size()) - 1;
}

void PlantedProblem::add_curvature(Index i, Index j, double value) {
  structure_.hessian.push_back({i, j});
  curvature_.push_back(value);
}

Index PlantedProblem::add_equality(double multiplier) {
  multipliers_.push_back(multiplier);
  structure_.constraint_lower.push_back(0.0);
  structure_.constraint_upper.push_back(0.0);
  return static_cast<Index>(multipliers_.size()) - 1;
}

void PlantedProblem::add_coefficient(Index equality, Index variable, double value) {
  structure_.jacobian.push_back({equality, variable});
  coefficients_.push_back(value);
}

void PlantedProblem::set_bounds(Index i, double lower, double upper, double multiplier) {
  structure_.variable_lower[at(i)] = lower;
  structure_.variable_upper[at(i)] = upper;
  const double sign = structure_.variable_players[at(i)] == Player::Min ? 1.0 : -1.0;
  slope_[at(i)] = solution_[at(i)] == lower ? sign * multiplier : -sign * multiplier;
}

void PlantedProblem::finish(double distance) {
  distance_ = distance;
  for (std::size_t k = 0; k < coefficients_.size(); ++k) {
    const auto [row, col] = structure_.jacobian[k];
    slope_[at(col)] -= coefficients_[k] * multipliers_[at(row)];
  }
  for (std::size_t i = 0; i < quartic_.size(); ++i) {
    if (quartic_[i] == 0.0) continue;
    structure_.hessian.push_back({static_cast<Index>(i), static_cast<Index>(i)});
  }
  structure_.constraint_players = implied_constraint_players(structure_);
}

bool PlantedProblem::starting_point(ipminmax::StartingPoint& start) {
  for (std::size_t i = 0; i < solution_.size(); ++i) {
    start.v[i] = solution_[i] + distance_ * std::sin(7.0 * static_cast<double>(i));
  }
  return !start.needs_multipliers;
}

bool PlantedProblem::objective(std::span<const double> v, bool, double& f) {
  f = 0.0;
  for (std::size_t k = 0; k < curvature_.size(); ++k) {
    const auto [i, j] = structure_.hessian[k];
    f += (i == j ? 0.5 : 1.0) * curvature_[k] * (v[at(i)] - solution_[at(i)]) *
         (v[at(j)] - solution_[at(j)]);
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double d = v[i] - solution_[i];
    f += d * (slope_[i] + 0.25 * quartic_[i] * d * d * d);
  }
  return true;
}

bool PlantedProblem::gradient(std::span<const double> v, bool, std::span<double> grad) {
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double d = v[i] - solution_[i];
    grad[i] = slope_[i] + quartic_[i] * d * d * d;
  }
  for (std::size_t k = 0; k < curvature_.size(); ++k) {
    const auto [i, j] = structure_.hessian[k];
    grad[at(i)] += curvature_[k] * (v[at(j)] - solution_[at(j)]);
    if (i != j) grad[at(j)] += curvature_[k] * (v[at(i)] - solution_[at(i)]);
  }
  return true;
}

bool PlantedProblem::constraints(std::span<const double> v, bool, std::span<double> g) {
  std::ranges::fill(g, 0.0);
  for (std::size_t k = 0; k < coefficients_.size(); ++k) {
    const auto [row, col] = structure_.jacobian[k];
    g[at(row)] += coefficients_[k] * (v[at(col)] - solution_[at(col)]);
  }
  return true;
}

bool PlantedProblem::jacobian(std::span<const double>, bool, std::span<double> values) {
  std::ranges::copy(coefficients_, values.begin());
  return true;
}

bool PlantedProblem::hessian(std::span<const double> v, bool, double sigma, std::span<const double>,
                             bool, std::span<double> values) {
  std::size_t k = 0;
  for (; k < curvature_.size(); ++k) values[k] = sigma * curvature_[k];
  for (; k < values.size(); ++k) {
    const std::size_t i = at(structure_.hessian[k].row);
    const double d = v[i] - solution_[i];
    values[k] = 3.0 * sigma * quartic_[i] * d * d;
  }
  return true;
}

std::unique_ptr<PlantedProblem> quartic_chain(Index nodes) {
  return quartic_graph(nodes, [nodes](auto&& visit) {
    for (Index i = 1; i < nodes; ++i) visit(i, i - 1);
  });
}

std::unique_ptr<PlantedProblem> quartic_grid(Index side) {
  return quartic_graph(side * side, [side](auto&& visit) { for_each_grid_edge(2, side, visit); });
}

std::unique_ptr<PlantedProblem> elliptic_grid(Index side) { return elliptic_game(2, side); }
std::unique_ptr<PlantedProblem> elliptic_cube(Index side) { return elliptic_game(3, side); }

}  // namespace bench
