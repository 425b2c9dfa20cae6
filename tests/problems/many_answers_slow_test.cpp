// Games whose best answer y is not unique: the certificates are compared with closed forms of
// phi(x) = max over y of f.
//
// By hand, any number of games from any seed: IPMINMAX_RUNS=10000 IPMINMAX_SEED=7.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>
#include <support/dice.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

MatrixXd random_matrix(Dice& dice, int rows, int cols) {
  return MatrixXd::NullaryExpr(rows, cols, [&] { return dice.between(-1.0, 1.0); });
}
VectorXd random_vector(Dice& dice, int size) { return random_matrix(dice, size, 1); }
std::vector<double> list(const VectorXd& v) { return {v.begin(), v.end()}; }

std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

struct Tally {
  int solved = 0, certified = 0, many = 0, wrong = 0, missed = 0;
  void print(const char* name) const {
    std::printf(
        "%s: %d solved, %d certified, %d with many answers, %d wrong, %d strict ones missed\n",
        name, solved, certified, many, wrong, missed);
  }
};

/// A game with what is known of it.
struct ClosedForm {
  Model model;
  VectorXd start;
  std::function<double(const VectorXd& x)> phi;
  Eigen::Index x = 0;    ///< Min's variables, the first ones
  double bound = 1e300;  ///< of each |x|
  /// Directions of x to be tried besides random ones: where a kink of phi does not help.
  std::function<MatrixXd(const VectorXd& x)> suspects;
};

enum class Found : std::uint8_t { Strict, Lower, Open };

/// What phi does around x, where points are exact to about 1e-7.
Found around(const ClosedForm& game, const VectorXd& x, Dice& dice) {
  const double here = game.phi(x);
  double least = 1e300;
  const auto look = [&](const VectorXd& d) {
    if (!(d.norm() > 0.0)) return;
    for (const double r : {1e-2, 1e-3}) {
      const VectorXd there = x + r * d / d.norm();
      if (there.cwiseAbs().maxCoeff() > game.bound) continue;
      least = std::min(least, (game.phi(there) - here) / (r * r));
    }
  };
  for (int k = 0; k < 200; ++k) look(random_vector(dice, static_cast<int>(game.x)));
  const MatrixXd suspects = game.suspects(x);
  for (Eigen::Index k = 0; k < suspects.cols(); ++k) {
    look(suspects.col(k));
    look(-suspects.col(k));
  }
  return least > 3e-4 ? Found::Strict : least < -3e-4 ? Found::Lower : Found::Open;
}

void judge(const ClosedForm& game, std::uint64_t seed, Tally& tally) {
  AutodiffProblem problem(game.model, list(game.start));
  const Result result = solve(problem, {});
  if (!is_success(result.status)) return;
  ++tally.solved;
  Dice dice(seed + 1);
  const VectorXd x = Eigen::Map<const VectorXd>(result.v.data(), game.x);
  const bool certified = result.certificate.kind == PointKind::LocalMinmax;
  tally.certified += certified ? 1 : 0;
  tally.many += result.certificate.answer == InnerAnswer::BestNotUnique ? 1 : 0;
  const bool best =
      std::abs(result.objective - game.phi(x)) <= 1e-6 * (1.0 + std::abs(game.phi(x)));
  const Found found = around(game, x, dice);
  if (certified && (!best || found == Found::Lower)) {
    ++tally.wrong;
    ADD_FAILURE() << "seed " << seed << ": certified at " << x.transpose() << ", value "
                  << result.objective << " of " << game.phi(x);
  }
  if (!certified && best && found == Found::Strict) ++tally.missed;
}

/// Null spaces of rows of phi that are level, and the least eigenvalue of h on them.
MatrixXd least_directions(const MatrixXd& rows, const MatrixXd& h) {
  const Eigen::Index n = h.rows();
  MatrixXd basis = MatrixXd::Identity(n, n);
  if (rows.rows() > 0) {
    const Eigen::FullPivLU<MatrixXd> lu(rows);
    if (lu.dimensionOfKernel() == 0) return MatrixXd(n, 0);
    basis = lu.kernel();
    basis =
        Eigen::HouseholderQR<MatrixXd>(basis).householderQ() * MatrixXd::Identity(n, basis.cols());
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(basis.transpose() * h * basis);
  return basis * eigen.eigenvectors();
}

/// x'Ax/2 + x'B (y - y*) on a box of y: phi is the same with |.|_1.
ClosedForm bilinear_game(Dice& dice) {
  const int nx = 1 + dice.below(4), ny = 1 + dice.below(4);
  MatrixXd a = random_matrix(dice, nx, nx), b = random_matrix(dice, nx, ny);
  a = (a + a.transpose()).eval();
  if (dice.chance(0.3)) b.col(0).setZero();  // a y that does nothing
  const VectorXd best = 0.9 * random_vector(dice, ny);
  ClosedForm game;
  game.x = nx;
  game.bound = 2.0;
  std::vector<Expression> x, y;
  for (int i = 0; i < nx; ++i)
    x.push_back(game.model.variable(kMin, "x" + std::to_string(i), -2.0, 2.0));
  for (int j = 0; j < ny; ++j)
    y.push_back(game.model.variable(kMax, "y" + std::to_string(j), -1.0, 1.0));
  Expression f = 0.0 * x[0];
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < nx; ++j) f += 0.5 * a(i, j) * x[at(i)] * x[at(j)];
    for (int j = 0; j < ny; ++j) f += b(i, j) * x[at(i)] * (y[at(j)] - best[j]);
  }
  game.model.objective(f);
  game.start = VectorXd::Zero(nx + ny);
  game.start.head(nx) = 0.3 * random_vector(dice, nx);
  game.start.tail(ny) = 0.9 * random_vector(dice, ny);
  game.phi = [=](const VectorXd& v) {
    return 0.5 * v.dot(a * v) - v.dot(b * best) + (b.transpose() * v).cwiseAbs().sum();
  };
  game.suspects = [=](const VectorXd& v) {
    std::vector<Eigen::Index> level;
    const VectorXd slopes = b.transpose() * v;
    for (Eigen::Index j = 0; j < slopes.size(); ++j) {
      if (std::abs(slopes[j]) < 1e-5) level.push_back(j);
    }
    MatrixXd rows = b(Eigen::all, level).transpose();
    return least_directions(rows, a);
  };
  return game;
}

/// The largest of quadratic functions, as sum q_i f_i(x) with q in the simplex.
ClosedForm finite_maximum(Dice& dice) {
  const int nx = 1 + dice.below(4), pieces = 2 + dice.below(4);
  std::vector<MatrixXd> h;
  MatrixXd g = 2.0 * random_matrix(dice, pieces, nx);
  const VectorXd c = 0.3 * random_vector(dice, pieces);
  const double shift = dice.one_of({0.0, 1.0, 3.0});
  for (int k = 0; k < pieces; ++k) {
    const MatrixXd part = random_matrix(dice, nx, nx);
    h.push_back(part + part.transpose() + shift * MatrixXd::Identity(nx, nx));
  }
  ClosedForm game;
  game.x = nx;
  game.bound = 3.0;
  std::vector<Expression> x, q;
  for (int i = 0; i < nx; ++i)
    x.push_back(game.model.variable(kMin, "x" + std::to_string(i), -3.0, 3.0));
  for (int k = 0; k < pieces; ++k)
    q.push_back(game.model.variable(kMax, "q" + std::to_string(k), 0.0));
  Expression f = 0.0 * x[0], sum = 0.0 * x[0];
  for (int k = 0; k < pieces; ++k) {
    Expression piece = 0.0 * x[0] + c[k];
    for (int i = 0; i < nx; ++i) {
      piece += g(k, i) * x[at(i)];
      for (int j = 0; j < nx; ++j) piece += 0.5 * h[at(k)](i, j) * x[at(i)] * x[at(j)];
    }
    f += q[at(k)] * piece;
    sum += 1.0 * q[at(k)];
  }
  game.model.objective(f);
  game.model.constraint(sum, 1.0, 1.0);
  game.start = VectorXd::Constant(nx + pieces, 1.0 / pieces);
  game.start.head(nx) = random_vector(dice, nx);
  const auto value = [=](const VectorXd& v, int k) {
    return c[k] + g.row(k).dot(v) + 0.5 * v.dot(h[at(k)] * v);
  };
  game.phi = [=](const VectorXd& v) {
    double largest = -1e300;
    for (int k = 0; k < pieces; ++k) largest = std::max(largest, value(v, k));
    return largest;
  };
  game.suspects = [=](const VectorXd& v) {
    // Along which all largest pieces change alike.
    std::vector<VectorXd> slopes;
    MatrixXd mean = MatrixXd::Zero(nx, nx);
    for (int k = 0; k < pieces; ++k) {
      if (value(v, k) < game.phi(v) - 1e-6) continue;
      slopes.push_back(g.row(k).transpose() + h[at(k)] * v);
      mean += h[at(k)];
    }
    MatrixXd rows(static_cast<Eigen::Index>(slopes.size()) - 1, nx);
    for (Eigen::Index k = 0; k < rows.rows(); ++k) {
      rows.row(k) = (slopes[static_cast<std::size_t>(k) + 1] - slopes[0]).transpose();
    }
    return least_directions(rows, mean);
  };
  return game;
}

struct Family {
  const char* name;
  ClosedForm (*game)(Dice& dice);
  std::uint64_t runs;
};
void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

class ManyAnswers : public ::testing::TestWithParam<Family> {};

TEST_P(ManyAnswers, AreCertifiedWhereXIsStrict) {
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", GetParam().runs);
  Tally tally;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    Dice dice(seed);
    judge(GetParam().game(dice), seed, tally);
  }
  tally.print(GetParam().name);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GT(tally.many, static_cast<int>(runs / 10));
  EXPECT_LE(20 * tally.missed, tally.certified + tally.missed);
}

INSTANTIATE_TEST_SUITE_P(Of, ManyAnswers,
                         ::testing::Values(Family{"Bilinear", bilinear_game, 500},
                                           Family{"FiniteMaxima", finite_maximum, 500}),
                         [](const auto& family) { return std::string(family.param.name); });

/// p'Aq on two simplices.
TEST(MatrixGames, AreCertifiedAtTheirSolutionWhereThatIsUnique) {
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 150);
  Tally tally;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    Dice dice(seed);
    const int rows = 2 + dice.below(seed % 10 == 0 ? 30 : 8);
    const int cols = 2 + dice.below(seed % 10 == 0 ? 30 : 8);
    MatrixXd a = random_matrix(dice, rows, cols);
    const bool twice = dice.chance(0.3);
    if (twice) a.row(1) = a.row(0);  // then p is not unique where it has them
    Model model;
    std::vector<Expression> p, q;
    for (int i = 0; i < rows; ++i) p.push_back(model.variable(kMin, "p" + std::to_string(i), 0.0));
    for (int j = 0; j < cols; ++j) q.push_back(model.variable(kMax, "q" + std::to_string(j), 0.0));
    Expression f = 0.0 * p[0], sum_p = f, sum_q = 0.0 * q[0];
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < cols; ++j) f += a(i, j) * p[at(i)] * q[at(j)];
      sum_p += 1.0 * p[at(i)];
    }
    for (int j = 0; j < cols; ++j) sum_q += 1.0 * q[at(j)];
    model.objective(f);
    model.constraint(sum_p, 1.0, 1.0);
    model.constraint(sum_q, 1.0, 1.0);
    VectorXd start(rows + cols);
    for (double& value : start) value = dice.uniform();
    start.head(rows) /= start.head(rows).sum();
    start.tail(cols) /= start.tail(cols).sum();
    AutodiffProblem problem(model, list(start));
    const Result result = solve(problem, {});
    if (!is_success(result.status)) continue;
    ++tally.solved;
    const Eigen::Map<const VectorXd> v(result.v.data(), rows + cols);
    const double gap = (a.transpose() * v.head(rows)).maxCoeff() - (a * v.tail(cols)).minCoeff();
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    const bool unique = !twice || std::max(v[0], v[1]) < 1e-5;
    tally.certified += certified ? 1 : 0;
    tally.many += result.certificate.answer == InnerAnswer::BestNotUnique ? 1 : 0;
    if (certified && (gap > 1e-6 || !unique)) {
      ++tally.wrong;
      ADD_FAILURE() << "seed " << seed << ": gap " << gap;
    }
    if (!certified && unique && gap < 1e-6) ++tally.missed;
  }
  tally.print("Matrix games");
  EXPECT_LE(20 * tally.missed, tally.certified + tally.missed);
}

/// x'Qx/2 + c'x + y'(Ax - b): y are multipliers, x is strict where Q is positive on the null space.
TEST(Lagrangians, AreCertifiedWhereTheReducedHessianIsPositive) {
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 300);
  Tally tally;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    Dice dice(seed);
    const int n = 1 + dice.below(6), m = 1 + dice.below(n);
    const double unit = dice.one_of({1.0, 1.0, 1e3, 1e-3});
    MatrixXd q = random_matrix(dice, n, n), a = random_matrix(dice, m, n) * unit;
    q = (q + q.transpose() + dice.one_of({0.0, 2.0}) * MatrixXd::Identity(n, n)).eval();
    const VectorXd c = random_vector(dice, n);
    const VectorXd b = a * random_vector(dice, n);
    Model model;
    std::vector<Expression> x, y;
    for (int i = 0; i < n; ++i) x.push_back(model.variable(kMin, "x" + std::to_string(i)));
    for (int j = 0; j < m; ++j) y.push_back(model.variable(kMax, "y" + std::to_string(j)));
    Expression f = 0.0 * x[0];
    for (int i = 0; i < n; ++i) {
      f += c[i] * x[at(i)];
      for (int j = 0; j < n; ++j) f += 0.5 * q(i, j) * x[at(i)] * x[at(j)];
      for (int j = 0; j < m; ++j) f += a(j, i) * y[at(j)] * x[at(i)];
    }
    for (int j = 0; j < m; ++j) f += -b[j] * y[at(j)];
    model.objective(f);
    AutodiffProblem problem(model, list(random_vector(dice, n + m)));
    const Result result = solve(problem, {});
    const MatrixXd basis = least_directions(a / unit, q);
    double least = 1.0;
    for (Eigen::Index k = 0; k < basis.cols(); ++k) {
      least = std::min(least, basis.col(k).dot(q * basis.col(k)));
    }
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    tally.certified += certified ? 1 : 0;
    tally.many += result.certificate.answer == InnerAnswer::BestNotUnique ? 1 : 0;
    if (!is_success(result.status)) continue;
    ++tally.solved;
    if (certified && least < 0.0) {
      ++tally.wrong;
      ADD_FAILURE() << "seed " << seed << ": reduced curvature " << least;
    }
    if (!certified && least > 1e-3) ++tally.missed;
  }
  tally.print("Lagrangians");
  EXPECT_LE(20 * tally.missed, tally.certified + tally.missed);
}

}  // namespace
}  // namespace ipminmax::testing
