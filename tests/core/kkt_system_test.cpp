#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <support/dense_algebra.hpp>

#include "core/kkt/block.hpp"
#include "core/kkt/system.hpp"
#include "core/model/budget.hpp"
#include "core/model/canonical_problem.hpp"

// K and K_yy are compared with dense matrices that keep the slack rows and are built here from the
// model's own Hessian and Jacobian.

namespace ipminmax {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInf = std::numeric_limits<double>::infinity();

/// Numbers of variables and constraints of a random problem.
struct Shape {
  Index x = 3, y = 3;
  Index min_equalities = 1, min_inequalities = 1;
  Index max_equalities = 1, max_inequalities = 2;
};

/// A model with constant derivatives, dense, variables of the players interleaved.
class RandomModel final : public Problem {
 public:
  ProblemStructure shape;
  MatrixXd hessian_matrix, jacobian_matrix;
  VectorXd gradient_vector;

  RandomModel(const Shape& s, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Index x = s.x;
    Index y = s.y;
    while (x + y > 0) {
      if (y > 0) shape.variable_players.push_back(Player::Max), --y;
      if (x > 0) shape.variable_players.push_back(Player::Min), --x;
    }
    const Index n = s.x + s.y;
    for (Index i = 0; i < n; ++i) {  // bounds of every kind
      shape.variable_lower.push_back(i % 4 == 0 || i % 4 == 1 ? -2.0 : -kInf);
      shape.variable_upper.push_back(i % 4 == 1 || i % 4 == 2 ? 2.0 : kInf);
    }
    const auto add = [&](Player player, Index count, bool equality) {
      for (Index k = 0; k < count; ++k) {
        shape.constraint_players.push_back(player);
        shape.constraint_lower.push_back(equality || k % 3 != 1 ? 0.0 : -kInf);
        shape.constraint_upper.push_back(equality ? 0.0 : k % 3 == 2 ? kInf : 5.0);
      }
    };
    add(Player::Max, s.max_inequalities, false);
    add(Player::Min, s.min_equalities, true);
    add(Player::Min, s.min_inequalities, false);
    add(Player::Max, s.max_equalities, true);
    const auto m = static_cast<Index>(shape.constraint_players.size());

    hessian_matrix = MatrixXd::NullaryExpr(n, n, [&] { return uniform(random); });
    hessian_matrix = (hessian_matrix + hessian_matrix.transpose()).eval();
    jacobian_matrix = MatrixXd::NullaryExpr(m, n, [&] { return uniform(random); });
    gradient_vector = VectorXd::NullaryExpr(n, [&] { return uniform(random); });
    for (Index j = 0; j < m; ++j) {
      for (Index i = 0; i < n; ++i) {
        const bool allowed = shape.constraint_players[at(j)] == Player::Max ||
                             shape.variable_players[at(i)] == Player::Min;
        if (!allowed) jacobian_matrix(j, i) = 0.0;
        if (allowed) shape.jacobian.push_back({j, i});
      }
    }
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j) shape.hessian.push_back({i, j});
    }
  }

  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  const ProblemStructure& structure() const override { return shape; }
  bool starting_point(StartingPoint&) override { return true; }
  bool objective(std::span<const double>, bool, double& f) override {
    f = 0.0;
    return true;
  }
  bool gradient(std::span<const double>, bool, std::span<double> out) override {
    std::copy(gradient_vector.begin(), gradient_vector.end(), out.begin());
    return true;
  }
  bool constraints(std::span<const double>, bool, std::span<double>) override { return true; }
  bool jacobian(std::span<const double>, bool, std::span<double> out) override {
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] = jacobian_matrix(shape.jacobian[k].row, shape.jacobian[k].col);
    }
    return true;
  }
  bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
               std::span<double> out) override {
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] = hessian_matrix(shape.hessian[k].row, shape.hessian[k].col);
    }
    return true;
  }
};

Inertia inertia_of(const MatrixXd& symmetric) {
  Inertia inertia;
  if (symmetric.rows() == 0) return inertia;
  const VectorXd values = testing::symmetric_eigenvalues(symmetric);
  const double zero = 1e-11 * values.cwiseAbs().maxCoeff();
  for (const double value : values) {
    ++(value > zero ? inertia.positive : value < -zero ? inertia.negative : inertia.zero);
  }
  return inertia;
}

/// A random model, a random interior point of it, the library's KKT system and the dense one.
class RandomSystem {
 public:
  RandomSystem(const Shape& shape, unsigned seed, LinearSolver solver = LinearSolver::Lapack,
               SchurComplementUse schur = SchurComplementUse::No)
      : random_(seed), model(shape, random_), canonical(model, options, counts, timing) {
    options.nlp_scaling_method = Scaling::None;
    options.linear_solver = solver;
    options.minmax_schur_complement = schur;
    EXPECT_EQ(canonical.build(), "");
    take();
  }
  RandomSystem(const RandomSystem&) = delete;
  RandomSystem& operator=(const RandomSystem&) = delete;

  /// Reads the model anew, after a change of its numbers.
  void take() {
    kkt = std::make_unique<KktSystem>(canonical, options, counts, timing);
    ASSERT_TRUE(kkt->analyze());
    std::uniform_real_distribution<double> inside(0.05, 0.95);
    const Index n = canonical.variables();
    const Index m = canonical.constraints();
    iterate.v = VectorXd::Zero(n);
    iterate.z_lower = VectorXd::Zero(n);
    iterate.z_upper = VectorXd::Zero(n);
    iterate.lambda = VectorXd::NullaryExpr(m, [&] { return inside(random_) - 0.5; });
    for (Index i = 0; i < n; ++i) {
      const double lower = std::max(canonical.lower()[i], -3.0);
      const double upper = std::min(canonical.upper()[i], 6.0);
      iterate.v[i] = lower + inside(random_) * (upper - lower);
    }
    for (const Index i : canonical.lower_bounded()) iterate.z_lower[i] = 3.0 * inside(random_);
    for (const Index i : canonical.upper_bounded()) iterate.z_upper[i] = 3.0 * inside(random_);
    evaluation.gradient.setZero(n);
    evaluation.jacobian.assign(canonical.jacobian().size(), 0.0);
    evaluation.hessian.assign(canonical.hessian().size(), 0.0);
    ASSERT_TRUE(canonical.first_derivatives(iterate.v, evaluation));
    ASSERT_TRUE(canonical.second_derivatives(iterate.v, iterate.lambda, evaluation));
    build_reference();
    kkt->assemble(iterate, evaluation);
  }

  /// The matrix with slack rows: variables x, s_x, y, s_y and multipliers Min, Max.
  MatrixXd dense(const Regularization& shift, bool barrier = true) const {
    const Index n = canonical.variables();
    const Index m = canonical.constraints();
    MatrixXd k = MatrixXd::Zero(n + m, n + m);
    k.topLeftCorner(n, n) = w;
    k.bottomLeftCorner(m, n) = a;
    k.topRightCorner(n, m) = a.transpose();
    for (Index i = 0; i < n; ++i) {
      if (barrier) k(i, i) += sign(i) * sigma[i];
      if (canonical.x().contains(i)) k(i, i) += shift.x;
      if (canonical.x_slacks().contains(i)) k(i, i) += shift.slacks;
      if (canonical.y().contains(i)) k(i, i) -= shift.y;
    }
    for (Index j = 0; j < m; ++j) {
      k(n + j, n + j) = canonical.min_constraints().contains(j) ? -shift.lambda_x : shift.lambda_y;
    }
    return k;
  }

  /// Rows and columns of the Max player.
  MatrixXd dense_inner(const Regularization& shift) const {
    std::vector<Index> rows;
    for (Index i = canonical.y().begin; i < canonical.variables(); ++i) rows.push_back(i);
    for (Index j = canonical.max_constraints().begin; j < canonical.constraints(); ++j) {
      rows.push_back(canonical.variables() + j);
    }
    return dense(shift)(rows, rows);
  }

  double sign(Index i) const { return i >= canonical.y().begin ? -1.0 : 1.0; }

  NewtonResidual random_residual() {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto draw = [&](Index size) {
      return VectorXd(VectorXd::NullaryExpr(size, [&] { return uniform(random_); }));
    };
    NewtonResidual rhs = zero_step(canonical);
    rhs.v = draw(canonical.variables());
    rhs.lambda = draw(canonical.constraints());
    for (const Index i : canonical.lower_bounded()) rhs.z_lower[i] = uniform(random_);
    for (const Index i : canonical.upper_bounded()) rhs.z_upper[i] = uniform(random_);
    return rhs;
  }

  /// Largest residual of the unreduced equations in the rows from the given ones on.
  double newton_error(const Regularization& shift, const NewtonResidual& rhs, const Step& step,
                      Index first_variable = 0, Index first_constraint = 0) const {
    const Index n = canonical.variables();
    const Index m = canonical.constraints();
    VectorXd u(n + m);
    u << step.v, step.lambda;
    const VectorXd product = dense(shift, false) * u;
    double error = 0.0;
    for (Index i = first_variable; i < n; ++i) {
      const double row = product[i] + sign(i) * (step.z_upper[i] - step.z_lower[i]);
      error = std::max(error, std::abs(row - rhs.v[i]));
      const double to_lower = iterate.v[i] - canonical.lower()[i];
      const double to_upper = canonical.upper()[i] - iterate.v[i];
      const double lower = std::isinf(to_lower)
                               ? step.z_lower[i]
                               : iterate.z_lower[i] * step.v[i] + to_lower * step.z_lower[i];
      const double upper = std::isinf(to_upper)
                               ? step.z_upper[i]
                               : to_upper * step.z_upper[i] - iterate.z_upper[i] * step.v[i];
      error = std::max(error, std::abs(lower - rhs.z_lower[i]));
      error = std::max(error, std::abs(upper - rhs.z_upper[i]));
    }
    for (Index j = first_constraint; j < m; ++j) {
      error = std::max(error, std::abs(product[n + j] - rhs.lambda[j]));
    }
    return error;
  }

 private:
  void build_reference() {
    // The model's numbering of the canonical variables and constraints, from its players alone.
    std::vector<Index> variables;
    std::vector<Index> constraints;
    for (const Player player : {Player::Min, Player::Max}) {
      for (std::size_t i = 0; i < model.shape.variable_players.size(); ++i) {
        if (model.shape.variable_players[i] == player) variables.push_back(static_cast<Index>(i));
      }
      for (std::size_t j = 0; j < model.shape.constraint_players.size(); ++j) {
        if (model.shape.constraint_players[j] == player) {
          constraints.push_back(static_cast<Index>(j));
        }
      }
      variables.resize(static_cast<std::size_t>(player == Player::Min ? canonical.y().begin
                                                                      : canonical.variables()),
                       -1);  // slacks
    }
    const Index n = canonical.variables();
    const Index m = canonical.constraints();
    w = MatrixXd::Zero(n, n);
    a = MatrixXd::Zero(m, n);
    g = VectorXd::Zero(n);
    sigma = VectorXd::Zero(n);
    for (Index i = 0; i < n; ++i) {
      const Index vi = variables[static_cast<std::size_t>(i)];
      if (vi >= 0) {
        g[i] = model.gradient_vector[vi];
        for (Index k = 0; k < n; ++k) {
          const Index vk = variables[static_cast<std::size_t>(k)];
          if (vk >= 0) w(i, k) = model.hessian_matrix(vi, vk);
        }
        for (Index j = 0; j < m; ++j) {
          a(j, i) = model.jacobian_matrix(constraints[static_cast<std::size_t>(j)], vi);
        }
      }
      if (canonical.lower()[i] > -kInf) {
        sigma[i] += iterate.z_lower[i] / (iterate.v[i] - canonical.lower()[i]);
      }
      if (canonical.upper()[i] < kInf) {
        sigma[i] += iterate.z_upper[i] / (canonical.upper()[i] - iterate.v[i]);
      }
    }
    Index slack_x = canonical.x_slacks().begin;
    Index slack_y = canonical.y_slacks().begin;
    for (Index j = 0; j < m; ++j) {
      const auto model_row = static_cast<std::size_t>(constraints[static_cast<std::size_t>(j)]);
      if (model.shape.constraint_lower[model_row] == model.shape.constraint_upper[model_row]) {
        continue;
      }
      a(j, canonical.min_constraints().contains(j) ? slack_x++ : slack_y++) = -1.0;
    }
  }

  std::mt19937 random_;

 public:
  RandomModel model;
  SolverOptions options;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical;
  std::unique_ptr<KktSystem> kkt;
  Iterate iterate;
  Evaluation evaluation;
  MatrixXd w, a;  ///< dense W without barrier terms, Jacobian with slack columns
  VectorXd g, sigma;
};

Shape random_shape(unsigned seed) {
  std::mt19937 random(seed);
  const auto draw = [&](Index from, Index to) {
    return std::uniform_int_distribution<Index>(from, to)(random);
  };
  Shape shape;
  shape.x = draw(0, 4);
  shape.y = draw(0, 4);
  shape.min_equalities = draw(0, shape.x);
  shape.max_equalities = draw(0, shape.y);
  shape.min_inequalities = shape.x > 0 ? draw(0, 3) : 0;
  shape.max_inequalities = shape.y > 0 ? draw(0, 3) : 0;
  return shape;
}

TEST(KktLayoutTest, CountsTheSlackRows) {
  const RandomSystem s({.x = 4,
                        .y = 3,
                        .min_equalities = 2,
                        .min_inequalities = 1,
                        .max_equalities = 1,
                        .max_inequalities = 3},
                       1);
  const KktLayout& layout = s.kkt->layout();
  EXPECT_EQ(layout.dimension(), 4 + 3 + 3 + 4);
  // n_x = 4 + 1, n_y = 3 + 3, m_x = 3, m_y = 4.
  EXPECT_EQ(layout.expected(), (Inertia{5 + 4, 6 + 3, 0}));
  EXPECT_EQ(layout.expected_inner(), (Inertia{4, 6, 0}));
  EXPECT_EQ(layout.with_slacks({1, 2, 3}), (Inertia{2, 5, 3}));
  EXPECT_EQ(layout.with_slacks_inner({1, 2, 3}), (Inertia{1, 5, 3}));
  EXPECT_EQ(KktPattern(KktPart::Full, s.canonical, layout).signs,
            (std::vector<std::int8_t>{1, 1, 1, 1, -1, -1, -1, -1, -1, -1, 1, 1, 1, 1}));
}

class KktBySolver : public ::testing::TestWithParam<LinearSolver> {};

TEST_P(KktBySolver, InertiasAreThoseOfTheDenseMatrices) {
  int right = 0;
  int wrong = 0;
  for (unsigned seed = 0; seed < 150; ++seed) {
    RandomSystem s(random_shape(seed), seed, GetParam());
    for (const Regularization& shift :
         {Regularization{}, Regularization{.x = 0.7, .y = 1.3},
          Regularization{.x = 0.2, .y = 0.4, .lambda_x = 0.3, .lambda_y = 0.6},
          Regularization{.x = 0.7, .y = 1.3, .lambda_x = 0.3, .slacks = 0.9},
          Regularization{.x = 20.0, .y = 20.0}}) {
      const Factorization full = s.kkt->factorize(shift);
      const Factorization inner = s.kkt->factorize_inner(shift);
      EXPECT_EQ(full.inertia, inertia_of(s.dense(shift))) << "K, seed " << seed;
      EXPECT_EQ(inner.inertia, inertia_of(s.dense_inner(shift))) << "K_yy, seed " << seed;
      ++(s.kkt->has_expected_inertia(full) && s.kkt->has_expected_inner_inertia(inner) ? right
                                                                                       : wrong);
    }
  }
  EXPECT_GT(right, 50);
  EXPECT_GT(wrong, 50) << "both outcomes have to occur";
}

TEST_P(KktBySolver, SolvesTheUnreducedNewtonEquations) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    RandomSystem s(random_shape(seed), seed, GetParam());
    for (const Regularization& shift :
         {Regularization{}, Regularization{.x = 0.7, .y = 1.3},
          Regularization{.x = 0.2, .y = 0.4, .lambda_x = 0.3, .lambda_y = 0.6},
          Regularization{.x = 0.7, .y = 1.3, .lambda_x = 0.3, .slacks = 0.9}}) {
      if (s.canonical.variables() == 0) continue;
      ASSERT_EQ(s.kkt->factorize(shift).status, FactorizationStatus::Ok) << seed;
      const NewtonResidual rhs = s.random_residual();
      Step step = zero_step(s.canonical);
      ASSERT_TRUE(s.kkt->solve(s.evaluation, rhs, step)) << seed;
      const double size = 1.0 + step.v.lpNorm<Eigen::Infinity>();
      EXPECT_LT(s.newton_error(shift, rhs, step), 1e-8 * size) << seed;
    }
  }
}

TEST_P(KktBySolver, TheInnerSolveHoldsTheMinPlayer) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    RandomSystem s(random_shape(seed), seed, GetParam());
    if (s.canonical.max_size() == 0) continue;
    const Regularization shift{.x = 0.0, .y = 0.5, .lambda_x = 0.0, .lambda_y = 0.25};
    ASSERT_EQ(s.kkt->factorize_inner(shift).status, FactorizationStatus::Ok) << seed;
    const NewtonResidual rhs = s.random_residual();
    Step step = zero_step(s.canonical);
    step.v.setConstant(99.0);  // whatever it held before
    step.lambda.setConstant(99.0);
    step.z_lower.setConstant(99.0);
    step.z_upper.setConstant(99.0);
    ASSERT_TRUE(s.kkt->solve_inner(s.evaluation, rhs, step)) << seed;
    const Index y = s.canonical.y().begin;
    const Index lambda_y = s.canonical.max_constraints().begin;
    EXPECT_TRUE(step.v.head(y).isZero(0.0));
    EXPECT_TRUE(step.z_lower.head(y).isZero(0.0));
    EXPECT_TRUE(step.z_upper.head(y).isZero(0.0));
    EXPECT_TRUE(step.lambda.head(lambda_y).isZero(0.0));
    const double size = 1.0 + step.v.lpNorm<Eigen::Infinity>();
    EXPECT_LT(s.newton_error(shift, rhs, step, y, lambda_y), 1e-8 * size) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, KktBySolver,
                         ::testing::Values(LinearSolver::Lapack, LinearSolver::Mumps,
                                           LinearSolver::Auto));

TEST(KktShifts, ActOnXAndYButNotOnSlacks) {
  // Only slacks carry curvature: x and y have W = 0 and no bounds, so their pivots are the shifts.
  RandomSystem s({.x = 2,
                  .y = 2,
                  .min_equalities = 0,
                  .min_inequalities = 1,
                  .max_equalities = 0,
                  .max_inequalities = 1},
                 3);
  s.model.hessian_matrix.setZero();
  s.model.jacobian_matrix.setZero();
  s.take();
  const Regularization shift{.x = 0.5, .y = 0.25, .lambda_x = 0.0, .lambda_y = 0.0};
  ASSERT_EQ(s.kkt->factorize(shift).status, FactorizationStatus::Ok);
  NewtonResidual rhs = zero_step(s.canonical);
  rhs.v.setOnes();
  Step step = zero_step(s.canonical);
  ASSERT_TRUE(s.kkt->solve(s.evaluation, rhs, step));
  for (const auto& [range, delta] : {std::pair{s.canonical.x(), 0.5}, {s.canonical.y(), -0.25}}) {
    for (Index i = range.begin; i < range.end; ++i) {
      EXPECT_NEAR(step.v[i], 1.0 / (delta + s.sign(i) * s.sigma[i]), 1e-10);
    }
  }
  // A slack's constraint is -ds = 0; its multiplier step balances the right-hand side alone.
  const Index slack_x = s.canonical.x_slacks().begin;
  const Index slack_y = s.canonical.y_slacks().begin;
  EXPECT_NEAR(step.v[slack_x], 0.0, 1e-12);
  EXPECT_NEAR(step.v[slack_y], 0.0, 1e-12);
  EXPECT_NEAR(step.lambda[0], -1.0, 1e-12);
  EXPECT_NEAR(step.lambda[1], -1.0, 1e-12);
  // With a right-hand side in the constraint the slack moves by its own curvature only.
  rhs.v.setZero();
  rhs.lambda.setOnes();
  ASSERT_TRUE(s.kkt->solve(s.evaluation, rhs, step));
  EXPECT_NEAR(step.lambda[0], -s.sigma[slack_x], 1e-10);
  EXPECT_NEAR(step.lambda[1], s.sigma[slack_y], 1e-10);
}

TEST(KktShifts, MultiplierShiftsRepairDependentEqualitiesOfEitherPlayer) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    for (const Player player : {Player::Min, Player::Max}) {
      const bool max = player == Player::Max;
      RandomSystem s({.x = 3,
                      .y = 3,
                      .min_equalities = max ? 0 : 2,
                      .min_inequalities = 0,
                      .max_equalities = max ? 2 : 0,
                      .max_inequalities = 0},
                     seed);
      s.model.jacobian_matrix.row(1) = s.model.jacobian_matrix.row(0);
      s.take();
      // x larger than y: a constrained y follows x, so -d_y |y|^2 is concave in x as well.
      const Regularization none{.x = 1e5, .y = 50.0, .lambda_x = 0.0, .lambda_y = 0.0};
      Regularization right = none;
      (max ? right.lambda_y : right.lambda_x) = 1e-2;
      Regularization wrong = right;
      wrong.lambda_x *= -1.0;
      wrong.lambda_y *= -1.0;
      EXPECT_FALSE(s.kkt->has_expected_inertia(s.kkt->factorize(none)));
      EXPECT_FALSE(s.kkt->has_expected_inertia(s.kkt->factorize(wrong)));
      EXPECT_TRUE(s.kkt->has_expected_inertia(s.kkt->factorize(right))) << seed;
      if (max) {
        EXPECT_FALSE(s.kkt->has_expected_inner_inertia(s.kkt->factorize_inner(none)));
        EXPECT_FALSE(s.kkt->has_expected_inner_inertia(s.kkt->factorize_inner(wrong)));
        EXPECT_TRUE(s.kkt->has_expected_inner_inertia(s.kkt->factorize_inner(right))) << seed;
      }
    }
  }
}

TEST(KktAssembly, TakesTheNumbersOfTheLatestPoint) {
  RandomSystem s({}, 5);
  RandomSystem other({}, 5);
  other.model.hessian_matrix *= -2.0;
  other.take();
  s.kkt->assemble(other.iterate, other.evaluation);
  const Regularization shift{.x = 0.1, .y = 0.2, .lambda_x = 0.0, .lambda_y = 0.0};
  ASSERT_EQ(s.kkt->factorize(shift).status, FactorizationStatus::Ok);
  const NewtonResidual rhs = other.random_residual();
  Step step = zero_step(s.canonical);
  ASSERT_TRUE(s.kkt->solve(other.evaluation, rhs, step));
  EXPECT_LT(other.newton_error(shift, rhs, step), 1e-8);
}

TEST(KktAssembly, ShiftsDoNotAccumulate) {
  RandomSystem s({}, 6);
  const Inertia unshifted = s.kkt->factorize({}).inertia;
  for (int k = 0; k < 3; ++k) static_cast<void>(s.kkt->factorize({.x = 1e3, .y = 1e3}));
  EXPECT_EQ(s.kkt->factorize({}).inertia, unshifted);
  const NewtonResidual rhs = s.random_residual();
  Step step = zero_step(s.canonical);
  ASSERT_TRUE(s.kkt->solve(s.evaluation, rhs, step));
  EXPECT_LT(s.newton_error({}, rhs, step), 1e-8 * (1.0 + step.v.norm()));
}

TEST(KktAssembly, TheInnerMatrixAloneIsTheSame) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    RandomSystem s({}, seed);
    RandomSystem twin({}, seed);
    twin.kkt->assemble_inner(s.iterate, s.evaluation);
    for (const double y : {0.0, 1.0, 10.0}) {
      EXPECT_EQ(twin.kkt->factorize_inner({.y = y}).inertia, inertia_of(s.dense_inner({.y = y})));
    }
  }
}

TEST(KktAssembly, GivenCurvaturesReplaceTheBarrierTerms) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    RandomSystem s({}, seed);
    for (Index i = 0; i < s.canonical.variables(); ++i) s.sigma[i] = 0.5 + 0.1 * i;
    s.kkt->assemble(s.evaluation, s.sigma);
    EXPECT_EQ(s.kkt->factorize({}).inertia, inertia_of(s.dense({}))) << seed;
    EXPECT_EQ(s.kkt->factorize_inner({}).inertia, inertia_of(s.dense_inner({}))) << seed;
  }
}

TEST(KktAssembly, KnowsTheLargestHessianEntry) {
  RandomSystem s({}, 7);
  EXPECT_DOUBLE_EQ(s.kkt->hessian_norm(), s.model.hessian_matrix.cwiseAbs().maxCoeff());
}

TEST(KktCounts, CountFactorizationsSolvesAndAnalyses) {
  RandomSystem s({}, 8);
  EXPECT_EQ(s.counts.analyses, 2);
  static_cast<void>(s.kkt->factorize({.x = 1.0, .y = 1.0}));
  static_cast<void>(s.kkt->factorize_inner({.y = 1.0}));
  static_cast<void>(s.kkt->factorize_inner({.y = 2.0}));
  EXPECT_EQ(s.counts.factorizations_full, 1);
  EXPECT_EQ(s.counts.factorizations_inner, 2);
  Step step = zero_step(s.canonical);
  ASSERT_TRUE(s.kkt->solve(s.evaluation, s.random_residual(), step));
  EXPECT_EQ(s.counts.solves, 1);
}

TEST(KktSystemTest, LaysNothingOutOnceTimeIsOver) {
  RandomSystem s({}, 8);
  s.options.max_wall_time = 1e-9;
  Budget budget(s.options);
  SolveLimit limit(budget);
  const KktAnalysis late = KktSystem(s.canonical, s.options, s.counts, s.timing, &limit).analysis();
  EXPECT_EQ(late.full_pattern->matrix.dimension(), 0);
  EXPECT_EQ(late.inner_pattern->matrix.dimension(), 0);
  EXPECT_EQ(limit.exceeded(), Status::MaxWallTime);
}

TEST(KktSolutions, AreRefinedAsFarAsTheirUseAsks) {
  // Refinement has to make up for a shift.
  constexpr Regularization kShift{.x = 1e-3, .y = 1e-3};
  constexpr double kRatio = 1e-3, kResidual = 1e-5;
  int rough = 0, between = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    RandomSystem s({}, seed, LinearSolver::Lapack);
    static_cast<void>(s.kkt->factorize(kShift));
    const NewtonResidual rhs = s.random_residual();
    const auto error = [&](const Accuracy& accuracy, double& scale) {
      Step step = zero_step(s.canonical);
      if (!s.kkt->solve_unshifted(s.evaluation, rhs, step, accuracy)) return kInf;
      const auto size = [](const Step& of) {
        return std::max({of.v.lpNorm<Eigen::Infinity>(), of.lambda.lpNorm<Eigen::Infinity>(),
                         of.z_lower.lpNorm<Eigen::Infinity>(),
                         of.z_upper.lpNorm<Eigen::Infinity>()});
      };
      scale = size(step) + size(rhs);
      return s.newton_error({}, rhs, step);
    };
    double scale = 0.0;
    const double full = error({}, scale);
    if (full == kInf) continue;
    EXPECT_LE(full, 1.01e-10 * scale) << seed;
    const double by_ratio = error({.ratio = kRatio, .by_rows = false}, scale);
    EXPECT_LE(by_ratio, 1.01 * kRatio * scale) << seed;
    rough += by_ratio > 1e-8 * scale ? 1 : 0;
    const double by_residual = error({.residual = kResidual}, scale);
    EXPECT_LE(by_residual, 1.01 * std::max(kResidual, 1e-10 * scale)) << seed;
    between += by_residual > 1e-10 * scale ? 1 : 0;
  }
  EXPECT_GT(rough, 50);
  EXPECT_GT(between, 50);
}

// --- K by way of K_yy ----------------------------------------------------------------------------

class KktBySchurComplement : public ::testing::TestWithParam<LinearSolver> {};

INSTANTIATE_TEST_SUITE_P(Solvers, KktBySchurComplement,
                         ::testing::Values(LinearSolver::Auto, LinearSolver::Mumps,
                                           LinearSolver::Lapack));

/// While iterating inertias need not be certain, and K may be factorized by way of K_yy.
constexpr Certainty kUsual = Certainty::Usual;

TEST_P(KktBySchurComplement, GivesTheDenseInertiasAndSolutions) {
  int by_complement = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    RandomSystem s(random_shape(seed), seed, GetParam(), SchurComplementUse::Yes);
    for (const Regularization& shift :
         {Regularization{}, Regularization{.x = 3.0}, Regularization{.x = 3.0, .y = 4.0},
          Regularization{.x = 9.0, .y = 4.0, .lambda_x = 1e-2, .lambda_y = 1e-2}}) {
      EXPECT_EQ(s.kkt->factorize(shift, kUsual).inertia, inertia_of(s.dense(shift))) << seed;
      EXPECT_EQ(s.kkt->factorize_inner(shift, kUsual).inertia, inertia_of(s.dense_inner(shift)))
          << seed;
      const NewtonResidual rhs = s.random_residual();
      Step step = zero_step(s.canonical);
      if (s.kkt->solve(s.evaluation, rhs, step)) {
        EXPECT_LE(s.newton_error(shift, rhs, step), 1e-7 * (1.0 + step.v.norm())) << seed;
      }
    }
    by_complement += s.counts.factorizations_complement;
  }
  EXPECT_GT(by_complement, 500);
}

TEST_P(KktBySchurComplement, SharesTheFactorsOfTheInnerMatrix) {
  RandomSystem s({}, 8, GetParam(), SchurComplementUse::Yes);
  static_cast<void>(s.kkt->factorize_inner({.y = 1.0}, kUsual));
  for (const double x : {0.0, 1.0, 10.0}) {
    const Regularization shift{.x = x, .y = 1.0};
    EXPECT_EQ(s.kkt->factorize(shift, kUsual).inertia, inertia_of(s.dense(shift)));
  }
  static_cast<void>(s.kkt->factorize_inner({.y = 1.0}, kUsual));
  EXPECT_EQ(s.counts.factorizations_full, 0);
  EXPECT_EQ(s.counts.factorizations_inner, 1);
  EXPECT_EQ(s.counts.factorizations_complement, 3);
}

TEST_P(KktBySchurComplement, FactorsOfKSurviveThoseOfTheInnerMatrix) {
  RandomSystem s({}, 8, GetParam(), SchurComplementUse::Yes);
  const Regularization shift{.x = 2.0, .y = 3.0};
  static_cast<void>(s.kkt->factorize_inner(shift, kUsual));
  static_cast<void>(s.kkt->factorize(shift, kUsual));
  for (const double y : {5.0, 7.0, 9.0}) {
    const Regularization other{.y = y};
    EXPECT_EQ(s.kkt->factorize_inner(other, kUsual).inertia, inertia_of(s.dense_inner(other)));
    const NewtonResidual rhs = s.random_residual();
    Step step = zero_step(s.canonical);
    ASSERT_TRUE(s.kkt->solve_inner(s.evaluation, rhs, step));
    EXPECT_LE(s.newton_error(other, rhs, step, s.canonical.y().begin,
                             s.canonical.max_constraints().begin),
              1e-9);
    ASSERT_TRUE(s.kkt->solve(s.evaluation, rhs, step));
    EXPECT_LE(s.newton_error(shift, rhs, step), 1e-9);
  }
}

TEST_P(KktBySchurComplement, CertainInertiasAreThoseOfTheWholeMatrix) {
  RandomSystem s({}, 8, GetParam(), SchurComplementUse::Yes);
  EXPECT_EQ(s.kkt->factorize({}).inertia, inertia_of(s.dense({})));
  EXPECT_EQ(s.counts.factorizations_full, 1);
  EXPECT_EQ(s.counts.factorizations_complement, 0);
}

TEST_P(KktBySchurComplement, ASingularInnerMatrixLeavesTheWholeOne) {
  RandomSystem s({.x = 4,
                  .y = 3,
                  .min_equalities = 1,
                  .min_inequalities = 0,
                  .max_equalities = 0,
                  .max_inequalities = 0},
                 3, GetParam(), SchurComplementUse::Yes);
  const VectorXd values = testing::symmetric_eigenvalues(s.dense_inner({}));
  for (const double distance : {0.0, 1e-13, -1e-11}) {  // of an eigenvalue of K_yy to zero
    const Regularization shift{.x = 1.0, .y = values[1] + distance};
    const Index whole = s.counts.factorizations_full;
    EXPECT_EQ(s.kkt->factorize(shift, kUsual).inertia, inertia_of(s.dense(shift)));
    EXPECT_EQ(s.counts.factorizations_full, whole + 1);
    const NewtonResidual rhs = s.random_residual();
    Step step = zero_step(s.canonical);
    ASSERT_TRUE(s.kkt->solve(s.evaluation, rhs, step));
    EXPECT_LE(s.newton_error(shift, rhs, step), 1e-8);
  }
}

TEST(KktWithoutMaxPlayer, NeedsNoInnerFactorization) {
  RandomSystem s({.x = 3,
                  .y = 0,
                  .min_equalities = 1,
                  .min_inequalities = 1,
                  .max_equalities = 0,
                  .max_inequalities = 0},
                 9);
  EXPECT_EQ(s.counts.analyses, 1);
  EXPECT_TRUE(s.kkt->has_expected_inner_inertia(s.kkt->factorize_inner({})));
  EXPECT_EQ(s.counts.factorizations_inner, 0);
}

TEST(LeastSquaresMultipliers, AreTheDenseOnesMaxFirst) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    RandomSystem s(random_shape(seed), seed);
    const Index n = s.canonical.variables();
    const Index m = s.canonical.constraints();
    const Index y = s.canonical.y().begin;
    const Index my = s.canonical.max_constraints().begin;
    VectorXd r = s.g;
    for (Index i = 0; i < n; ++i) r[i] += s.sign(i) * (s.iterate.z_upper[i] - s.iterate.z_lower[i]);
    VectorXd expected = VectorXd::Zero(m);
    if (my < m) {
      const MatrixXd a_yy = s.a.bottomRightCorner(m - my, n - y).transpose();
      expected.tail(m - my) = testing::least_squares(a_yy, -r.tail(n - y));
    }
    if (my > 0) {
      const MatrixXd a_xx = s.a.topLeftCorner(my, y).transpose();
      const VectorXd from_max = s.a.bottomLeftCorner(m - my, y).transpose() * expected.tail(m - my);
      expected.head(my) = testing::least_squares(a_xx, -r.head(y) - from_max);
    }
    VectorXd lambda;
    ASSERT_TRUE(s.kkt->least_squares_multipliers(s.iterate, s.evaluation, lambda)) << seed;
    ASSERT_EQ(lambda.size(), m);
    EXPECT_LT((lambda - expected).norm(), 1e-7 * (1.0 + expected.norm())) << seed;
  }
}

TEST(LeastSquaresMultipliers, OfDependentGradientsAreRefused) {
  for (const bool max : {false, true}) {
    RandomSystem s({.x = 3,
                    .y = 3,
                    .min_equalities = max ? 0 : 2,
                    .min_inequalities = 0,
                    .max_equalities = max ? 2 : 0,
                    .max_inequalities = 0},
                   2);
    s.model.jacobian_matrix.row(1) = s.model.jacobian_matrix.row(0);
    s.take();
    VectorXd lambda;
    const bool ok = s.kkt->least_squares_multipliers(s.iterate, s.evaluation, lambda);
    EXPECT_TRUE(!ok || lambda.lpNorm<Eigen::Infinity>() > 1e3) << lambda.transpose();
  }
}

TEST(KktFactorsTest, AreRefusedOnceOthersAreAtHand) {
  RandomSystem s({}, 9);
  const Regularization shift{.x = 2.0, .y = 3.0};
  const KktFactors inner = s.kkt->factorize_inner(shift);
  const KktFactors full = s.kkt->factorize(shift);
  EXPECT_EQ(full.shift, shift);
  const NewtonResidual rhs = s.random_residual();
  Step step = zero_step(s.canonical);
  ASSERT_TRUE(s.kkt->solve(full, s.evaluation, rhs, step));
  EXPECT_LT(s.newton_error(shift, rhs, step), 1e-8);
  ASSERT_TRUE(s.kkt->solve_inner(inner, s.evaluation, rhs, step));

  // K_yy at another point: its own factors are gone, and K's are not, nor the barrier terms of K's
  // point.
  Iterate other = s.iterate;
  for (const Index i : s.canonical.lower_bounded()) other.z_lower[i] *= 1.5;
  s.kkt->assemble_inner(other, s.evaluation);
  const KktFactors there = s.kkt->factorize_inner(shift);
  EXPECT_FALSE(s.kkt->solve_inner(inner, s.evaluation, rhs, step));
  EXPECT_TRUE(s.kkt->solve_inner(there, s.evaluation, rhs, step));
  ASSERT_TRUE(s.kkt->solve(full, s.evaluation, rhs, step));
  EXPECT_LT(s.newton_error(shift, rhs, step), 1e-8);

  // The same matrix and shift again: the same factors. Another shift: others.
  EXPECT_EQ(s.kkt->factorize(shift).serial, full.serial);
  static_cast<void>(s.kkt->factorize({.x = 5.0, .y = 3.0}));
  EXPECT_FALSE(s.kkt->are_current(full));
  EXPECT_FALSE(s.kkt->solve(full, s.evaluation, rhs, step));
  const KktFactors last = s.kkt->factorize(shift);
  s.kkt->reset_quality();
  EXPECT_FALSE(s.kkt->solve(last, s.evaluation, rhs, step));
}

TEST(KktFactorizations, AreNotRepeatedForTheSameValuesAndShifts) {
  RandomSystem system({}, 3);
  KktSystem& kkt = *system.kkt;
  const Counts& counts = system.counts;
  const Regularization shift{.x = 1.0, .y = 2.0};
  const Factorization first = kkt.factorize(shift, Certainty::Usual);
  const Factorization inner = kkt.factorize_inner({}, Certainty::Usual);
  EXPECT_EQ(counts.factorizations_full, 1);
  EXPECT_EQ(counts.factorizations_inner, 1);

  kkt.assemble(system.iterate, system.evaluation);
  EXPECT_EQ(kkt.factorize(shift, Certainty::Usual).inertia, first.inertia);
  EXPECT_EQ(kkt.factorize_inner({}, Certainty::Usual).inertia, inner.inertia);
  EXPECT_EQ(counts.factorizations_full, 1);
  EXPECT_EQ(counts.factorizations_inner, 1);
  const NewtonResidual rhs = system.random_residual();
  Step step = zero_step(system.canonical);
  ASSERT_TRUE(kkt.solve(system.evaluation, rhs, step));
  EXPECT_LT(system.newton_error(shift, rhs, step), 1e-8);

  // Another shift of one matrix.
  static_cast<void>(kkt.factorize({.x = 1.5, .y = 2.0}, Certainty::Usual));
  static_cast<void>(kkt.factorize_inner({}, Certainty::Usual));
  EXPECT_EQ(counts.factorizations_full, 2);
  EXPECT_EQ(counts.factorizations_inner, 1);

  // Other values: barrier terms, derivatives.
  for (const Index i : system.canonical.lower_bounded()) system.iterate.z_lower[i] *= 1.5;
  kkt.assemble(system.iterate, system.evaluation);
  static_cast<void>(kkt.factorize({.x = 1.5, .y = 2.0}, Certainty::Usual));
  EXPECT_EQ(counts.factorizations_full, 3);
  ASSERT_TRUE(system.canonical.second_derivatives(system.iterate.v, 2.0 * system.iterate.lambda,
                                                  system.evaluation));
  kkt.assemble(system.iterate, system.evaluation);
  static_cast<void>(kkt.factorize({.x = 1.5, .y = 2.0}, Certainty::Usual));
  static_cast<void>(kkt.factorize_inner({}, Certainty::Usual));
  EXPECT_EQ(counts.factorizations_full, 4);
  EXPECT_EQ(counts.factorizations_inner, 2);

  // A factorization that must be better than the last, and one that need not be.
  static_cast<void>(kkt.factorize({.x = 1.5, .y = 2.0}));
  EXPECT_EQ(counts.factorizations_full, 5);
  static_cast<void>(kkt.factorize({.x = 1.5, .y = 2.0}, Certainty::Usual));
  EXPECT_EQ(counts.factorizations_full, 5);
}

// Nearly no diagonal: pivots are delayed, and MUMPS needs more workspace than it expects, several
// times.
TEST(KktFactorizations, AskForNoMoreWorkspaceWhenTimeIsUp) {
  constexpr Index kVariables = 1500;
  std::mt19937 random(3);
  RandomModel model({kVariables, 0, 0, 0, 0, 0}, random);
  model.shape.variable_lower.assign(RandomModel::at(kVariables), -kInf);
  model.shape.variable_upper.assign(RandomModel::at(kVariables), kInf);
  model.hessian_matrix.diagonal().setConstant(1e-9);
  model.shape.hessian.clear();
  for (Index i = 0; i < kVariables; ++i) {
    model.shape.hessian.push_back({i, i});
    for (int k = 0; k < 3 && i > 0; ++k) {
      model.shape.hessian.push_back({i, static_cast<Index>(random() % static_cast<unsigned>(i))});
    }
  }
  SolverOptions options;
  options.nlp_scaling_method = Scaling::None;
  options.linear_solver = LinearSolver::Mumps;
  options.minmax_ordering = Ordering::Amd;
  options.mumps_mem_percent = 0;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(model, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  Iterate iterate;
  iterate.v = iterate.z_lower = iterate.z_upper = VectorXd::Zero(canonical.variables());
  Evaluation evaluation;
  evaluation.gradient.setZero(canonical.variables());
  evaluation.hessian.assign(canonical.hessian().size(), 0.0);
  ASSERT_TRUE(canonical.second_derivatives(iterate.v, iterate.lambda, evaluation));
  Budget budget(options);
  for (const bool expired : {false, true}) {
    SolveLimit limit(budget);
    KktSystem kkt(canonical, options, counts, timing, &limit);
    ASSERT_TRUE(kkt.analyze());
    if (expired) limit.exceed(Status::MaxCpuTime);
    kkt.assemble(iterate, evaluation);
    EXPECT_EQ(kkt.factorize({}).status,
              expired ? FactorizationStatus::Failed : FactorizationStatus::Ok);
  }
}

}  // namespace
}  // namespace ipminmax
