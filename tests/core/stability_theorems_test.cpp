// The paper's four theorems at random equilibria: what attracts Algorithm 1's iteration and what
// repels it, by iteration_map and by the dense Jacobian I - (J + E)^-1 J.

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>
#include <support/dense_algebra.hpp>
#include <support/dense_algorithm_one.hpp>
#include <support/function_problem.hpp>
#include <support/paper_form.hpp>

#include "core/iteration_map.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::DenseAlgorithmOne;
using testing::Expression;
using testing::FunctionProblem;
using testing::kNoBound;
using testing::Model;
using testing::PaperForm;
using testing::PaperPoint;

using Matrix = Eigen::MatrixXd;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  /// Uniform in [low, high); the same on every machine.
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }
  Eigen::Index index(Eigen::Index low, Eigen::Index high) {
    return low + static_cast<Eigen::Index>(engine_() % static_cast<unsigned>(high - low + 1));
  }
  Matrix symmetric(Eigen::Index n, double size = 2.0) {
    Matrix h(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) h(i, j) = h(j, i) = (*this)(-size, size);
    }
    return h;
  }

 private:
  std::mt19937 engine_;
};

double radius(const Matrix& map) { return testing::spectral_radius(map); }
Eigen::VectorXd eigenvalues(const Matrix& matrix) { return testing::symmetric_eigenvalues(matrix); }
Matrix modified(const Matrix& j, const Matrix& e) {
  return Matrix::Identity(j.rows(), j.cols()) - testing::solve_dense(j + e, j);
}
/// diag(x, ..., x, -y, ..., -y)
Matrix shift(Eigen::Index nx, double x, Eigen::Index ny, double y) {
  Eigen::VectorXd e(nx + ny);
  e << Eigen::VectorXd::Constant(nx, x), Eigen::VectorXd::Constant(ny, -y);
  return e.asDiagonal();
}
bool has_signs(const Matrix& matrix, Eigen::Index positive) {
  return (eigenvalues(matrix).array() > 0.0).count() == positive;
}

/// The equilibrium 0 of a quadratic; shifts prescribed, or chosen as printed where they are
/// negative.
IterationMap map_of(const Matrix& h, Eigen::Index nx, double x = -1.0, double y = -1.0) {
  const Eigen::Index n = h.rows();
  std::vector<Player> players(static_cast<std::size_t>(n), Player::Max);
  std::fill_n(players.begin(), nx, Player::Min);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  FunctionProblem problem = FunctionProblem::quadratic(players, h, zero, zero);
  Result at;
  at.v.assign(static_cast<std::size_t>(n), 0.0);
  at.z_lower = at.z_upper = at.v;
  at.mu = 0.1;
  SolverOptions options = as_printed();
  options.linear_solver = LinearSolver::Lapack;
  options.minmax_prescribed_delta_x = x;
  options.minmax_prescribed_delta_y = y;
  IterationMap map = iteration_map(problem, at, options);
  EXPECT_EQ(map.error, "");
  return map;
}

/// Spectral radius of the printed Jacobian, which the library's must equal.
double checked_radius(const Matrix& h, Eigen::Index nx, const IterationMap& map) {
  const double dense = radius(modified(h, shift(nx, map.delta_x, h.rows() - nx, map.delta_y)));
  EXPECT_NEAR(map.spectral_radius, dense, 1e-7 * (1.0 + dense));
  return dense;
}

// --- Theorem 1: minimization ---------------------------------------------------------------------

TEST(Theorem1, MinimaAttractAndAllOtherPointsRepel) {
  Random random(1);
  int minima = 0, others = 0;
  for (int k = 0; k < 400; ++k) {
    const Eigen::Index n = random.index(1, 4);
    Matrix h = random.symmetric(n);
    if (k % 2 == 0) h += 2.5 * Matrix::Identity(n, n);
    const double least = eigenvalues(h)[0];
    if (std::abs(least) < 1e-3) continue;
    const double x = std::max(0.0, -least) + random(1e-2, 3.0);  // any that makes h + x I > 0
    const double rho = checked_radius(h, n, map_of(h, n, x, 0.0));
    (least > 0.0 ? minima : others) += 1;
    EXPECT_EQ(rho<1.0, least> 0.0) << h;
  }
  EXPECT_GT(minima, 50);
  EXPECT_GT(others, 50);
}

// --- Theorem 3: minmax ---------------------------------------------------------------------------

struct Game {
  Matrix h;
  Eigen::Index nx = 1;
  bool inner = false, full = false;  ///< right inertias
  [[nodiscard]] Eigen::Index ny() const { return h.rows() - nx; }
  [[nodiscard]] Matrix xy() const { return h.topRightCorner(nx, ny()); }
  [[nodiscard]] Matrix yy() const { return h.bottomRightCorner(ny(), ny()); }
};

/// A random one that is clearly nonsingular; towards_minmax moves it to where local minmax are.
Game random_game(Random& random, bool towards_minmax) {
  for (;;) {
    const Eigen::Index nx = random.index(1, 3), ny = random.index(1, 3);
    Matrix h = random.symmetric(nx + ny);
    if (towards_minmax) h += shift(nx, random(0.0, 2.0), ny, random(1.0, 3.0));
    Game game{h, nx};
    if (eigenvalues(h).cwiseAbs().minCoeff() < 1e-2) continue;
    if (eigenvalues(game.yy()).cwiseAbs().minCoeff() < 1e-2) continue;
    game.inner = has_signs(game.yy(), 0);
    game.full = has_signs(h, nx);
    return game;
  }
}

/// epsilon_y W_xy W_yy^-2 W_yx of (eps-cond).
Matrix condition(const Game& game, double y) {
  const Matrix b = testing::solve_dense(game.yy(), game.xy().transpose());
  return y * b.transpose() * b;
}

TEST(Theorem3, LocalMinmaxPointsAttractWhereEpsilonXExceedsTheLargestEigenvalue) {
  // (eps-cond) as printed has the smallest eigenvalue, which is not enough.
  Random random(2);
  int games = 0, unstable_with_largest = 0, unstable_with_smallest = 0;
  double worst = 0.0;
  while (games < 20000) {
    const Game game = random_game(random, true);
    if (!game.inner || !game.full) continue;
    ++games;
    const double y = std::pow(10.0, random(-2.0, 2.0));
    const Eigen::VectorXd values = eigenvalues(condition(game, y));
    const auto rho = [&](double x) {
      return radius(modified(game.h, shift(game.nx, x, game.ny(), y)));
    };
    const double with_largest = rho(values[values.size() - 1]);
    worst = std::max(worst, with_largest);
    unstable_with_largest += with_largest >= 1.0 ? 1 : 0;
    // The smallest satisfies (LQAC) or does not; only those that do count.
    const double x = std::max(0.0, values[0]);
    const Matrix shifted = game.h + shift(game.nx, x, game.ny(), y);
    unstable_with_smallest += has_signs(shifted, game.nx) && rho(x) >= 1.0 ? 1 : 0;
    if (games % 100 == 0) {
      const double any = values[values.size() - 1] + random(0.0, 5.0);
      EXPECT_LT(checked_radius(game.h, game.nx, map_of(game.h, game.nx, any, y)), 1.0);
      // epsilon_y = 0: any epsilon_x.
      EXPECT_LT(checked_radius(game.h, game.nx, map_of(game.h, game.nx, random(0.0, 5.0), 0.0)),
                1.0);
      // What Algorithm 1 chooses: zero shifts.
      EXPECT_EQ(map_of(game.h, game.nx).spectral_radius, 0.0);
    }
  }
  std::printf(
      "%d local minmax points: unstable with lambda_max %d (largest radius %.6f), with lambda_min "
      "%d\n",
      games, unstable_with_largest, worst, unstable_with_smallest);
  EXPECT_EQ(unstable_with_largest, 0);
  EXPECT_GT(unstable_with_smallest, 0);
}

TEST(Theorem3, EveryOtherPointRepels) {
  Random random(3);
  int wrong_full = 0, wrong_both = 0, wrong_inner = 0;
  for (int k = 0; k < 1500; ++k) {
    const Game game = random_game(random, k % 3 == 0);
    if (game.inner && game.full) continue;
    (game.inner ? wrong_full : game.full ? wrong_inner : wrong_both) += 1;
    const IterationMap map = map_of(game.h, game.nx);
    EXPECT_EQ(map.inner == map.inner_expected, game.inner);
    EXPECT_EQ(map.full == map.full_expected, game.full);
    EXPECT_GT(checked_radius(game.h, game.nx, map), 1.0) << game.h;
    if (game.full) continue;
    // Where K is wrong, any shifts that satisfy (LQAC) do.
    double y = std::max(0.0, eigenvalues(game.yy()).maxCoeff()) + random(0.01, 2.0);
    double x = random(0.01, 2.0);
    while (!has_signs(game.h + shift(game.nx, x, game.ny(), y), game.nx)) x *= 1.5;
    EXPECT_GT(checked_radius(game.h, game.nx, map_of(game.h, game.nx, x, y)), 1.0) << game.h;
  }
  std::printf("wrong: K alone %d, both %d, K_yy alone (line 7) %d\n", wrong_full, wrong_both,
              wrong_inner);
  EXPECT_GT(wrong_full, 50);
  EXPECT_GT(wrong_both, 50);
  EXPECT_GT(wrong_inner, 50);
}

TEST(Theorem3, WithoutLine7SomeWrongPointsAttract) {
  Random random(4);
  int attracting = 0, points = 0;
  for (int k = 0; k < 2000; ++k) {
    const Game game = random_game(random, false);
    if (game.inner || !game.full) continue;
    ++points;
    const double y = eigenvalues(game.yy()).maxCoeff() * random(1.2, 3.0);
    double x = 0.0;
    while (!has_signs(game.h + shift(game.nx, x, game.ny(), y), game.nx))
      x = x == 0.0 ? 1e-4 : 10.0 * x;
    attracting += radius(modified(game.h, shift(game.nx, x, game.ny(), y))) < 1.0 ? 1 : 0;
  }
  EXPECT_GT(attracting, 0) << "of " << points;
}

TEST(Theorem3, RealSingularitiesDoNotDecideStability) {
  // "Nonsingular for all mu in [0, 2]" fails at the paper's own Example 3: det(K + mu E) has no
  // real zero at all, and the point repels, for the eigenvalues are complex.
  const Matrix k{{-0.5, 1.0}, {1.0, -1.0}};
  const Matrix e = shift(1, 0.3, 1, 3.0);
  for (int i = 0; i <= 2000; ++i) EXPECT_LT((k + i / 1000.0 * e).determinant(), -0.09);
  EXPECT_NEAR(radius(modified(k, e)), std::hypot(1.5, 1.5), 1e-12);
  // The right set: |1 - mu| <= 1, mu complex. rho = 1 / (1 - mu).
  const std::complex<double> rho(1.5, 1.5), mu = 1.0 - 1.0 / rho;
  EXPECT_LE(std::abs(1.0 - mu), 1.0);
  const Eigen::MatrixXcd singular =
      k.cast<std::complex<double>>() + mu * e.cast<std::complex<double>>();
  EXPECT_LT(std::abs(singular.determinant()), 1e-12);
}

// --- Theorems 2 and 4: interior-point methods at b > 0 -------------------------------------------

/// A random problem with a random equilibrium g(z, b) = 0: quadratics with a linear term that makes
/// the gradient of L vanish.
struct Equilibrium {
  Model model;
  Result at;
};

Expression quadratic(const Matrix& h, const Eigen::VectorXd& g, const std::vector<Expression>& v) {
  Expression sum = 0.0;
  for (Eigen::Index i = 0; i < h.rows(); ++i) {
    sum += g[i] * v[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double factor = i == j ? 0.5 * h(i, i) : h(i, j);
      sum += factor * (v[static_cast<std::size_t>(i)] * v[static_cast<std::size_t>(j)]);
    }
  }
  return sum;
}

/// nx, ny variables; every player an inequality and, with more than one variable, an equality;
/// every second variable has bounds. Those of Max read x, too.
Equilibrium random_equilibrium(Random& random, Eigen::Index nx, Eigen::Index ny,
                               bool towards_minmax) {
  Equilibrium e;
  const Eigen::Index n = nx + ny;
  const double b = std::pow(10.0, random(-2.0, 0.0));
  e.at.mu = b;
  Eigen::VectorXd v(n), slope = Eigen::VectorXd::Zero(n);  // of L without the linear term of f
  std::vector<Expression> variables;
  for (Eigen::Index i = 0; i < n; ++i) {
    v[i] = random(-1.0, 1.0);
    const double owner = i < nx ? 1.0 : -1.0;
    double lower = -kNoBound, upper = kNoBound, z_lower = 0.0, z_upper = 0.0;
    if (i % 2 == 1) {
      lower = v[i] - random(0.1, 1.0);
      z_lower = owner * b / (v[i] - lower);
      if (random(0.0, 1.0) < 0.5) {
        upper = v[i] + random(0.1, 1.0);
        z_upper = owner * b / (upper - v[i]);
      }
    }
    slope[i] += z_upper - z_lower;
    e.at.v.push_back(v[i]);
    e.at.z_lower.push_back(z_lower);
    e.at.z_upper.push_back(z_upper);
    variables.push_back(e.model.variable(i < nx ? Player::Min : Player::Max,
                                         "v" + std::to_string(i), lower, upper));
  }
  Matrix h = random.symmetric(n);
  if (towards_minmax) h += shift(nx, random(0.0, 3.0), ny, random(1.0, 4.0));
  slope += h * v;

  const auto constraint = [&](Player owner, bool equality) {
    // Linear and quadratic in what the owner may read.
    Matrix c = random.symmetric(n, 0.5);
    Eigen::VectorXd g(n);
    for (Eigen::Index i = 0; i < n; ++i) g[i] = random(-1.0, 1.0);
    if (owner == Player::Min) {
      c.bottomRows(ny).setZero();
      c.rightCols(ny).setZero();
      g.tail(ny).setZero();
    }
    const double value = 0.5 * v.dot(c * v) + g.dot(v);
    const double slack = random(0.1, 1.0);
    const double lambda =
        equality ? random(-1.0, 1.0) : (owner == Player::Min ? 1.0 : -1.0) * b / slack;
    slope += lambda * (c * v + g);
    e.at.lambda.push_back(lambda);
    e.model.constraint(quadratic(c, g, variables), equality ? value : -kNoBound,
                       equality ? value : value + slack, owner);
  };
  for (const Player owner : {Player::Min, Player::Max}) {
    const Eigen::Index own = owner == Player::Min ? nx : ny;
    if (own == 0) continue;
    constraint(owner, false);
    if (own > 1) constraint(owner, true);
  }
  e.model.objective(quadratic(h, -slope, variables));
  return e;
}

/// J_zz and J_yy of the paper at the equilibrium.
struct Printed {
  Matrix j;
  Matrix inner;
  bool full_right = false, inner_right = false;
  double smallest = 0.0;  ///< eigenvalue by modulus, of both
  double residual = 0.0;
};

Printed printed_at(Equilibrium& e, AutodiffProblem& problem, const PaperForm& form, PaperPoint& z) {
  z = form.start(e.at.v, e.at.mu, 0.0);
  // nu from the result; lambda = b / s is what start gives.
  Eigen::Index x = 0, y = 0;
  const ProblemStructure& shape = problem.structure();
  for (std::size_t j = 0; j < e.at.lambda.size(); ++j) {
    if (shape.constraint_lower[j] != shape.constraint_upper[j]) continue;
    (shape.constraint_players[j] == Player::Min ? z.nu_x[x++] : z.nu_y[y++]) = e.at.lambda[j];
  }
  const DenseAlgorithmOne dense(form.functions(), z, e.at.mu, {});
  Printed result;
  result.j = dense.matrix(form.derivatives(z));
  result.inner = dense.inner(result.j);
  result.full_right = testing::inertia(result.j) == dense.full_expected();
  result.inner_right = testing::inertia(result.inner) == dense.inner_expected();
  result.smallest = eigenvalues(result.j).cwiseAbs().minCoeff();
  if (result.inner.rows() > 0)
    result.smallest = std::min(result.smallest, eigenvalues(result.inner).cwiseAbs().minCoeff());
  return result;
}

/// Of the printed Jacobian with the library's shifts.
double printed_radius(const PaperForm& form, const PaperPoint& z, const Printed& printed,
                      const IterationMap& map) {
  const DenseAlgorithmOne dense(form.functions(), z, 1.0, {});
  return radius(modified(printed.j, dense.shift(map.delta_x, map.delta_y)));
}

struct Tally {
  int right = 0, wrong_full = 0, wrong_both = 0, wrong_inner = 0;
};

Tally check_equilibria(unsigned seed, int count, bool with_max) {
  Random random(seed);
  Tally tally;
  SolverOptions options = as_printed();
  options.linear_solver = LinearSolver::Lapack;
  for (int k = 0; k < count; ++k) {
    const Eigen::Index nx = random.index(1, 3), ny = with_max ? random.index(1, 3) : 0;
    Equilibrium e = random_equilibrium(random, nx, ny, k % 2 == 0);
    AutodiffProblem problem(e.model, e.at.v);
    const PaperForm form(problem);
    PaperPoint z;
    const Printed printed = printed_at(e, problem, form, z);
    if (printed.smallest < 1e-3) continue;
    const IterationMap map = iteration_map(problem, e.at, options);
    if (map.error != "") {
      ADD_FAILURE() << map.error;
      continue;
    }
    EXPECT_LT(map.residual, 1e-12);
    EXPECT_EQ(map.full == map.full_expected, printed.full_right);
    EXPECT_EQ(map.inner == map.inner_expected, printed.inner_right);
    const double rho = printed_radius(form, z, printed, map);
    EXPECT_NEAR(map.spectral_radius, rho, 1e-6 * (1.0 + rho));
    const bool right = printed.full_right && printed.inner_right;
    EXPECT_EQ(rho < 1.0, right) << "epsilon_x " << map.delta_x << ", epsilon_y " << map.delta_y;
    (right                 ? tally.right
     : printed.inner_right ? tally.wrong_full
     : printed.full_right  ? tally.wrong_inner
                           : tally.wrong_both) += 1;
    // A larger epsilon_x, as by a cautious implementation, changes nothing where epsilon_y is 0.
    if (map.delta_y == 0.0) {
      SolverOptions larger = options;
      larger.minmax_prescribed_delta_x = map.delta_x + random(0.1, 3.0);
      larger.minmax_prescribed_delta_y = 0.0;
      EXPECT_EQ(iteration_map(problem, e.at, larger).spectral_radius < 1.0, right);
    }
  }
  std::printf("right %d; wrong: K alone %d, both %d, K_yy alone %d\n", tally.right,
              tally.wrong_full, tally.wrong_both, tally.wrong_inner);
  return tally;
}

TEST(Theorem2, MinimaOfTheBarrierProblemAttractAndAllOtherPointsRepel) {
  const Tally tally = check_equilibria(5, 400, false);
  EXPECT_GT(tally.right, 50);
  EXPECT_GT(tally.wrong_full, 50);
}

TEST(Theorem4, LocalMinmaxPointsOfTheBarrierProblemAttractAndAllOtherPointsRepel) {
  const Tally tally = check_equilibria(6, 1500, true);
  EXPECT_GT(tally.right, 50);
  EXPECT_GT(tally.wrong_full, 20);
  EXPECT_GT(tally.wrong_both, 20);
  EXPECT_GT(tally.wrong_inner, 20);
}

TEST(IterationMapOfAPoint, SaysWhatIsWrongWithItsArguments) {
  FunctionProblem problem = FunctionProblem::quadratic(
      {Player::Min}, Matrix::Identity(1, 1), Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1));
  Result at;
  EXPECT_NE(iteration_map(problem, at).error, "");
  at.v = at.z_lower = at.z_upper = {0.0};
  SolverOptions bad;
  bad.tol = -1.0;
  EXPECT_NE(iteration_map(problem, at, bad).error, "");
  EXPECT_EQ(iteration_map(problem, at).error, "");
}

}  // namespace
}  // namespace ipminmax
