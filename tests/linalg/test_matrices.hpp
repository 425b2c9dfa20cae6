#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "linalg/symmetric_matrix.hpp"

namespace ipminmax::test {

/// A matrix and the expected signs of its pivots.
struct KktMatrix {
  std::string name;
  SymmetricMatrix matrix;
  std::vector<std::int8_t> signs;
};

/// Collects entries, then makes the matrix; duplicates add up.
class MatrixBuilder {
 public:
  explicit MatrixBuilder(Index dimension) : dimension_(dimension) {}

  void add(Index row, Index col, double value) {
    entries_.push_back({row, col});
    values_.push_back(value);
  }

  [[nodiscard]] SymmetricMatrix build() const {
    SymmetricMatrix matrix(dimension_, entries_);
    const auto positions = matrix.triplet_positions();
    for (std::size_t k = 0; k < values_.size(); ++k) {
      matrix.values()[static_cast<std::size_t>(positions[k])] += values_[k];
    }
    return matrix;
  }

 private:
  Index dimension_;
  std::vector<Triplet> entries_;
  std::vector<double> values_;
};

/// Sizes of the blocks (x, y, lambda_x, lambda_y).
struct Blocks {
  Index x = 0, y = 0, lambda_x = 0, lambda_y = 0;

  [[nodiscard]] Index dimension() const { return x + y + lambda_x + lambda_y; }
  [[nodiscard]] std::vector<std::int8_t> signs() const {
    std::vector<std::int8_t> result;
    const auto append = [&](Index count, int sign) {
      result.insert(result.end(), static_cast<std::size_t>(count), static_cast<std::int8_t>(sign));
    };
    append(x, 1);
    append(y, -1);
    append(lambda_x, -1);
    append(lambda_y, 1);
    return result;
  }
};

/// How random_kkt fills the blocks.
struct RandomKkt {
  Blocks blocks;
  double density = 0.4;           // of the blocks W and J
  double barrier_decades = 0.0;   // diagonals S between 10^-decades and 10^decades; 0: none
  bool repeat_last_rows = false;  // last row of J_x and of (J_yx J_yy) twice: a singular matrix
};

/// | W_xx + S_x  W_xy         J_x'  J_yx' |
/// | W_yx        W_yy - S_y   0     J_yy' |
/// | J_x         0            0     0     |
/// | J_yx        J_yy         0     0     |
inline KktMatrix random_kkt(const RandomKkt& kind, unsigned seed) {
  const Blocks& b = kind.blocks;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto chance = [&] { return 0.5 * (uniform(random) + 1.0) < kind.density; };
  MatrixBuilder builder(b.dimension());
  const Index variables = b.x + b.y;
  for (Index j = 0; j < variables; ++j) {
    for (Index i = j + 1; i < variables; ++i) {
      if (chance()) builder.add(i, j, uniform(random));
    }
    const double sign = j < b.x ? 1.0 : -1.0;
    const double barrier =
        kind.barrier_decades > 0.0 ? std::pow(10.0, kind.barrier_decades * uniform(random)) : 0.0;
    builder.add(j, j, uniform(random) + sign * barrier);
  }
  const auto fill_rows = [&](Index first_row, Index rows, Index columns) {
    std::vector<double> last;
    for (Index i = 0; i < rows; ++i) {
      const bool repeat = kind.repeat_last_rows && i > 0 && i == rows - 1;
      if (!repeat) last.assign(static_cast<std::size_t>(columns), 0.0);
      for (Index j = 0; j < columns; ++j) {
        double& value = last[static_cast<std::size_t>(j)];
        if (!repeat && (chance() || j == i % columns)) value = uniform(random);
        if (value != 0.0) builder.add(first_row + i, j, value);
      }
    }
  };
  fill_rows(variables, b.lambda_x, b.x);
  fill_rows(variables + b.lambda_x, b.lambda_y, variables);
  return {"random" + std::to_string(b.dimension()) + "_" + std::to_string(seed), builder.build(),
          b.signs()};
}

/// KKT matrix of the homicidal chauffeur over the given number of steps, at a random point:
///   pursuer p+ = p + v (cos theta, sin theta), theta+ = theta + u   (x: u, p, theta; |u| bounded)
///   evader  e+ = e + d, |d|^2 + s = d_max^2, s >= 0                 (y: d, e, s)
///   f = scale sum |p - e|^2 + gamma_u u^2 - gamma_d |d|^2
/// barrier: the order of magnitude of multiplier / slack of active bounds, as late in a solve.
inline KktMatrix chauffeur_kkt(Index steps, unsigned seed, double barrier = 10.0) {
  constexpr double kScale = 1.0 / 400.0, kSpeed = 0.1, kGammaU = 4.0, kGammaD = 120.0;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Blocks b{4 * steps, 5 * steps, 3 * steps, 3 * steps};
  MatrixBuilder builder(b.dimension());
  const auto x = [](Index t, Index k) { return 4 * t + k; };         // u, p1, p2, theta
  const auto y = [&](Index t, Index k) { return b.x + 5 * t + k; };  // d1, d2, e1, e2, s
  const auto lx = [&](Index t, Index k) { return b.x + b.y + 3 * t + k; };
  const auto ly = [&](Index t, Index k) { return b.x + b.y + b.lambda_x + 3 * t + k; };
  for (Index t = 0; t < steps; ++t) {
    const double theta = 3.0 * uniform(random);
    const bool u_active = uniform(random) > 0.5;
    const bool d_active = uniform(random) > 0.0;
    builder.add(x(t, 0), x(t, 0), 2.0 * kScale * kGammaU + (u_active ? barrier : 0.1 / barrier));
    for (Index k = 0; k < 2; ++k) {
      builder.add(x(t, 1 + k), x(t, 1 + k), 2.0 * kScale);
      builder.add(y(t, 2 + k), y(t, 2 + k), 2.0 * kScale);
      builder.add(y(t, 2 + k), x(t, 1 + k), -2.0 * kScale);
    }
    builder.add(x(t, 3), x(t, 3), 0.05 * uniform(random));  // multipliers times v cos, v sin
    const double lambda_speed = d_active ? -0.5 - 0.4 * uniform(random) : -1e-3 / barrier;
    for (Index k = 0; k < 2; ++k) {
      builder.add(y(t, k), y(t, k), -2.0 * kScale * kGammaD + 2.0 * lambda_speed);
      builder.add(ly(t, 2), y(t, k), 0.22 * uniform(random));
    }
    builder.add(y(t, 4), y(t, 4), d_active ? -barrier : -0.1 / barrier);
    builder.add(ly(t, 2), y(t, 4), 1.0);

    for (Index k = 0; k < 3; ++k) builder.add(lx(t, k), x(t, 1 + k), 1.0);
    for (Index k = 0; k < 2; ++k) {
      builder.add(ly(t, k), y(t, 2 + k), 1.0);
      builder.add(ly(t, k), y(t, k), -1.0);
    }
    builder.add(lx(t, 2), x(t, 0), -1.0);
    if (t > 0) {
      for (Index k = 0; k < 3; ++k) builder.add(lx(t, k), x(t - 1, 1 + k), -1.0);
      for (Index k = 0; k < 2; ++k) builder.add(ly(t, k), y(t - 1, 2 + k), -1.0);
      builder.add(lx(t, 0), x(t - 1, 3), kSpeed * std::sin(theta));
      builder.add(lx(t, 1), x(t - 1, 3), -kSpeed * std::cos(theta));
    }
  }
  return {"chauffeur" + std::to_string(steps) + "_" + std::to_string(seed), builder.build(),
          b.signs()};
}

/// Control of a Poisson equation on a side x side grid: state and control of x (n_x = 2 side^2),
/// a disturbance of y at every point, state equations owned by x. Its factor fills in.
inline KktMatrix grid_kkt(Index side, unsigned seed, double barrier = 10.0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const Index points = side * side;
  const Blocks b{2 * points, points, points, 0};
  MatrixBuilder builder(b.dimension());
  for (Index i = 0; i < side; ++i) {
    for (Index j = 0; j < side; ++j) {
      const Index k = i * side + j;
      const Index state = k, control = points + k, disturbance = 2 * points + k;
      const Index equation = 3 * points + k;
      builder.add(state, state, 1.0);
      builder.add(control, control, 1e-2 + (uniform(random) > 0.7 ? barrier : 0.0));
      builder.add(disturbance, disturbance, -1.0 - (uniform(random) > 0.7 ? barrier : 0.0));
      builder.add(disturbance, state, 0.3 * uniform(random));
      builder.add(equation, state, 4.0);
      if (i > 0) builder.add(equation, state - side, -1.0);
      if (i < side - 1) builder.add(equation, state + side, -1.0);
      if (j > 0) builder.add(equation, state - 1, -1.0);
      if (j < side - 1) builder.add(equation, state + 1, -1.0);
      builder.add(equation, control, -1.0);
    }
  }
  return {"grid" + std::to_string(side), builder.build(), b.signs()};
}

}  // namespace ipminmax::test
