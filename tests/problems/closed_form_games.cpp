#include <problems/closed_form_games.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include <problems/quadratic_problem.hpp>
#include <support/autodiff_problem.hpp>
#include <support/dense_algebra.hpp>
#include <support/dice.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

MatrixXd random_matrix(Dice& dice, Eigen::Index rows, Eigen::Index cols) {
  return MatrixXd::NullaryExpr(rows, cols, [&] { return dice.between(-1.0, 1.0); });
}
VectorXd random_vector(Dice& dice, Eigen::Index size) { return random_matrix(dice, size, 1); }
std::vector<double> list(const VectorXd& v) { return {v.begin(), v.end()}; }
std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }
bool anywhere(const VectorXd&) { return true; }
MatrixXd none(const VectorXd& v) { return MatrixXd(v.size(), 0); }

std::vector<Expression> variables(Model& model, Player player, const char* name, Eigen::Index size,
                                  double bound = kNoBound) {
  std::vector<Expression> all;
  for (Eigen::Index i = 0; i < size; ++i) {
    all.push_back(model.variable(player, name + std::to_string(i), -bound, bound));
  }
  return all;
}

/// Null spaces of rows of phi that are level, and the least eigenvalue of h on them.
MatrixXd least_directions(const MatrixXd& rows, const MatrixXd& h) {
  const MatrixXd basis = null_space(rows);
  if (basis.cols() == 0) return basis;
  return basis * symmetric_eigenvectors(basis.transpose() * h * basis);
}

}  // namespace

/// x'Ax/2 + x'B (y - y*) on a box of y: phi is the same with |.|_1.
ClosedForm bilinear_game(std::uint64_t seed) {
  Dice dice(seed);
  const int nx = 1 + dice.below(4), ny = 1 + dice.below(4);
  MatrixXd a = random_matrix(dice, nx, nx), b = random_matrix(dice, nx, ny);
  a = (a + a.transpose()).eval();
  if (dice.chance(0.3)) b.col(0).setZero();  // a y that does nothing
  const VectorXd best = 0.9 * random_vector(dice, ny);
  ClosedForm game;
  game.x = nx;
  game.allowed = [](const VectorXd& v) { return v.cwiseAbs().maxCoeff() <= 2.0; };
  Model model;
  VectorXd start;
  std::vector<Expression> x, y;
  for (int i = 0; i < nx; ++i)
    x.push_back(model.variable(kMin, "x" + std::to_string(i), -2.0, 2.0));
  for (int j = 0; j < ny; ++j)
    y.push_back(model.variable(kMax, "y" + std::to_string(j), -1.0, 1.0));
  Expression f = 0.0 * x[0];
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < nx; ++j) f += 0.5 * a(i, j) * x[at(i)] * x[at(j)];
    for (int j = 0; j < ny; ++j) f += b(i, j) * x[at(i)] * (y[at(j)] - best[j]);
  }
  model.objective(f);
  start = VectorXd::Zero(nx + ny);
  start.head(nx) = 0.3 * random_vector(dice, nx);
  start.tail(ny) = 0.9 * random_vector(dice, ny);
  game.problem = std::make_unique<AutodiffProblem>(model, list(start));
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
ClosedForm finite_maximum(std::uint64_t seed) {
  Dice dice(seed);
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
  game.allowed = [](const VectorXd& v) { return v.cwiseAbs().maxCoeff() <= 3.0; };
  Model model;
  VectorXd start;
  std::vector<Expression> x, q;
  for (int i = 0; i < nx; ++i)
    x.push_back(model.variable(kMin, "x" + std::to_string(i), -3.0, 3.0));
  for (int k = 0; k < pieces; ++k) q.push_back(model.variable(kMax, "q" + std::to_string(k), 0.0));
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
  model.objective(f);
  model.constraint(sum, 1.0, 1.0);
  start = VectorXd::Constant(nx + pieces, 1.0 / pieces);
  start.head(nx) = random_vector(dice, nx);
  game.problem = std::make_unique<AutodiffProblem>(model, list(start));
  const auto value = [=](const VectorXd& v, int k) {
    return c[k] + g.row(k).dot(v) + 0.5 * v.dot(h[at(k)] * v);
  };
  game.phi = [=](const VectorXd& v) {
    double largest = -1e300;
    for (int k = 0; k < pieces; ++k) largest = std::max(largest, value(v, k));
    return largest;
  };
  const auto phi = game.phi;
  game.suspects = [=](const VectorXd& v) {
    // Along which all largest pieces change alike.
    std::vector<VectorXd> slopes;
    MatrixXd mean = MatrixXd::Zero(nx, nx);
    for (int k = 0; k < pieces; ++k) {
      if (value(v, k) < phi(v) - 1e-6) continue;
      slopes.emplace_back(g.row(k).transpose() + h[at(k)] * v);
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

ClosedForm matrix_game(std::uint64_t seed) {
  Dice dice(seed);
  const int most = seed % 10 == 0 ? 49 : 7;
  const int rows = 2 + dice.below(most), cols = 2 + dice.below(most);
  MatrixXd a = random_matrix(dice, rows, cols);
  if (dice.chance(0.3)) a.row(1) = a.row(0);  // then p is not unique where it has them
  auto problem = std::make_unique<QuadraticProblem>(rows, cols);
  QuadraticFunction sum_p, sum_q;
  VectorXd start(rows + cols);
  for (double& value : start) value = dice.uniform();
  start.head(rows) /= start.head(rows).sum();
  start.tail(cols) /= start.tail(cols).sum();
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) problem->f().add(i, rows + j, a(i, j));
    sum_p.add_linear(i, 1.0);
  }
  for (int j = 0; j < cols; ++j) sum_q.add_linear(rows + j, 1.0);
  for (int i = 0; i < rows + cols; ++i) problem->set_bounds(i, 0.0, kNoBound);
  problem->add_constraint(sum_p, 1.0, 1.0);
  problem->add_constraint(sum_q, 1.0, 1.0);
  problem->set_start(list(start));
  problem->finish();
  ClosedForm game;
  game.problem = std::move(problem);
  game.x = rows;
  game.phi = [=](const VectorXd& p) { return (a.transpose() * p).maxCoeff(); };
  game.allowed = [](const VectorXd& p) {
    return std::abs(p.sum() - 1.0) <= 1e-9 && p.minCoeff() >= -1e-7;
  };
  game.suspects = [=](const VectorXd& p) {
    // From strategies in use to others: pairs, and what leaves all columns that are largest alike.
    std::vector<Eigen::Index> used, level;
    const VectorXd values = a.transpose() * p;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (p[i] > 1e-4) used.push_back(i);
    }
    for (Eigen::Index j = 0; j < cols; ++j) {
      if (values[j] > values.maxCoeff() - 1e-6) level.push_back(j);
    }
    MatrixXd pairs = MatrixXd::Zero(rows, static_cast<Eigen::Index>(used.size()) * rows);
    for (std::size_t k = 0; k < used.size(); ++k) {
      for (Eigen::Index i = 0; i < rows; ++i) {
        const Eigen::Index col = static_cast<Eigen::Index>(k) * rows + i;
        pairs(i, col) += 1.0;
        pairs(used[k], col) -= 1.0;
      }
    }
    MatrixXd alike(static_cast<Eigen::Index>(level.size()), static_cast<Eigen::Index>(used.size()));
    for (std::size_t l = 0; l < level.size(); ++l) {
      for (std::size_t k = 0; k < used.size(); ++k) {
        const auto row = static_cast<Eigen::Index>(l), col = static_cast<Eigen::Index>(k);
        alike(row, col) = l == 0 ? 1.0 : a(used[k], level[l]) - a(used[k], level[0]);
      }
    }
    if (alike.size() == 0) return pairs;
    const MatrixXd kernel = null_space(alike);
    MatrixXd all = MatrixXd::Zero(rows, pairs.cols() + kernel.cols());
    all.leftCols(pairs.cols()) = pairs;
    for (std::size_t k = 0; k < used.size(); ++k) {
      all.row(used[k]).tail(kernel.cols()) = kernel.row(static_cast<Eigen::Index>(k));
    }
    return all;
  };
  return game;
}

ClosedForm lagrangian(std::uint64_t seed) {
  Dice dice(seed);
  const int n = 1 + dice.below(6), m = 1 + dice.below(n);
  const double unit = dice.one_of({1.0, 1.0, 1e3, 1e-3});
  MatrixXd q = random_matrix(dice, n, n), a = random_matrix(dice, m, n) * unit;
  q = (q + q.transpose() + dice.one_of({0.0, 2.0}) * MatrixXd::Identity(n, n)).eval();
  const VectorXd c = random_vector(dice, n), b = a * random_vector(dice, n);
  Model model;
  const auto x = variables(model, kMin, "x", n), y = variables(model, kMax, "y", m);
  Expression f = 0.0;
  for (int i = 0; i < n; ++i) {
    f += c[i] * x[at(i)];
    for (int j = 0; j < n; ++j) f += 0.5 * q(i, j) * x[at(i)] * x[at(j)];
    for (int j = 0; j < m; ++j) f += a(j, i) * y[at(j)] * x[at(i)];
  }
  for (int j = 0; j < m; ++j) f += -b[j] * y[at(j)];
  model.objective(f);
  ClosedForm game;
  game.problem = std::make_unique<AutodiffProblem>(model, list(random_vector(dice, n + m)));
  game.x = n;
  game.phi = [=](const VectorXd& v) {
    const bool meets = (a * v - b).norm() <= 1e-6 * (unit + b.norm());
    return meets ? 0.5 * v.dot(q * v) + c.dot(v) : kInfinity;
  };
  game.allowed = [=](const VectorXd& v) { return (a * v - b).norm() <= 1e-9 * (unit + b.norm()); };
  game.suspects = [=](const VectorXd&) { return least_directions(a / unit, q); };
  game.accuracy = 1e-4;  // y'(Ax - b) of multipliers up to 1e5
  return game;
}

ClosedForm wasserstein_gan(std::uint64_t seed) {
  Dice dice(seed);
  const int d = 1 + dice.below(3);
  MatrixXd factor = random_matrix(dice, d, d).triangularView<Eigen::Lower>();
  for (int i = 0; i < d; ++i) factor(i, i) = dice.between(0.5, 1.5);
  const MatrixXd s = factor * factor.transpose();
  Model model;
  std::vector<std::vector<Expression>> v(at(d)), w(at(d));
  std::vector<double> start;
  const auto lower = [&](Player player, const char* name, auto& all) {
    for (int i = 0; i < d; ++i) {
      for (int j = 0; j <= i; ++j) {
        const double bound = player == kMax ? 1.0 : kNoBound;
        all[at(i)].push_back(
            model.variable(player, name + std::to_string(i) + std::to_string(j), -bound, bound));
        start.push_back(player == kMax ? dice.between(-0.5, 0.5)
                                       : factor(i, j) + dice.between(-0.3, 0.3));
      }
    }
  };
  lower(kMin, "v", v);
  lower(kMax, "w", w);
  Expression f = 0.0;
  for (int i = 0; i < d; ++i) {
    for (int j = 0; j <= i; ++j) {
      Expression gap = s(i, j);
      for (int k = 0; k <= j; ++k) gap -= v[at(i)][at(k)] * v[at(j)][at(k)];
      f += w[at(i)][at(j)] * gap;
    }
  }
  model.objective(f);
  ClosedForm game;
  game.problem = std::make_unique<AutodiffProblem>(model, start);
  game.x = d * (d + 1) / 2;
  game.phi = [=](const VectorXd& entries) {
    MatrixXd made = MatrixXd::Zero(d, d);
    for (int i = 0, k = 0; i < d; ++i) {
      for (int j = 0; j <= i; ++j) made(i, j) = entries[k++];
    }
    const MatrixXd gap = s - made * made.transpose();
    double sum = 0.0;
    for (int i = 0; i < d; ++i) sum += gap.row(i).head(i + 1).cwiseAbs().sum();
    return sum;
  };
  game.allowed = anywhere;
  game.suspects = none;
  return game;
}

ClosedForm dirac_gan(std::uint64_t seed) {
  Dice dice(seed);
  const int n = 1 + dice.below(4);
  const VectorXd a = random_vector(dice, n);
  const double r = dice.one_of({0.0, 0.1, 1.0});
  const double bound = dice.between(0.5, 2.0);
  Model model;
  const auto x = variables(model, kMin, "x", n), y = variables(model, kMax, "y", n, bound);
  Expression real = 0.0, made = 0.0, f = 0.0;
  for (int i = 0; i < n; ++i) {
    real += a[i] * y[at(i)];
    made += x[at(i)] * y[at(i)];
    f += 0.5 * r * square(x[at(i)] - a[i]);
  }
  model.objective(f - log(1.0 + exp(-real)) - log(1.0 + exp(made)));
  ClosedForm game;
  VectorXd start(2 * n);
  start << a + 0.3 * random_vector(dice, n), 0.3 * random_vector(dice, n);
  game.problem = std::make_unique<AutodiffProblem>(model, list(start));
  game.x = n;
  // Concave in y, so that ascent finds the maximum on the box.
  game.phi = [=](const VectorXd& v) {
    VectorXd best = VectorXd::Zero(n);
    const auto h = [](double t) { return -std::log1p(std::exp(-t)); };
    const auto slope = [](double t) { return 1.0 / (1.0 + std::exp(t)); };
    for (int k = 0; k < 2000; ++k) {
      const VectorXd g = slope(best.dot(a)) * a - slope(-best.dot(v)) * v;
      best = (best + g).cwiseMax(-bound).cwiseMin(bound);
    }
    return h(best.dot(a)) + h(-best.dot(v)) + 0.5 * r * (v - a).squaredNorm();
  };
  game.allowed = anywhere;
  game.suspects = none;
  return game;
}

ClosedForm ridge(std::uint64_t seed) {
  Dice dice(seed);
  const int n = 1 + dice.below(4), m = 2 + dice.below(4), rows = 1 + dice.below(m - 1);
  const MatrixXd b = random_matrix(dice, rows, m), c = random_matrix(dice, rows, n);
  const VectorXd centre = random_vector(dice, n);
  Model model;
  const auto x = variables(model, kMin, "x", n), y = variables(model, kMax, "y", m);
  Expression f = 0.0;
  for (int i = 0; i < n; ++i) f += 0.5 * square(x[at(i)] - centre[i]);
  for (int r = 0; r < rows; ++r) {
    Expression off = 0.0;
    for (int j = 0; j < m; ++j) off += b(r, j) * y[at(j)];
    for (int i = 0; i < n; ++i) off += -c(r, i) * x[at(i)];
    f += -0.5 * square(off);
  }
  model.objective(f);
  ClosedForm game;
  game.problem = std::make_unique<AutodiffProblem>(model, list(random_vector(dice, n + m)));
  game.x = n;
  game.phi = [=](const VectorXd& v) { return 0.5 * (v - centre).squaredNorm(); };
  game.allowed = anywhere;
  game.suspects = none;
  return game;
}

ClosedForm robust_linear_program(std::uint64_t seed) {
  Dice dice(seed);
  const int n = 2 + dice.below(3), m = n + dice.below(3), k = 1 + dice.below(3);
  const VectorXd c = random_vector(dice, n);
  MatrixXd a = random_matrix(dice, m, n);
  const VectorXd b = VectorXd::NullaryExpr(m, [&] { return dice.between(0.2, 1.0); });
  std::vector<MatrixXd> uncertain;
  for (int r = 0; r < m; ++r) uncertain.push_back(0.5 * random_matrix(dice, n, k));
  if (dice.chance(0.5)) {  // of single entries, so that u has no influence where x is zero
    for (MatrixXd& p : uncertain) p = p.cwiseProduct(MatrixXd::Identity(n, k)).eval();
  }
  Model model, linear;  // linear: with s >= |P'x|
  const auto x = variables(model, kMin, "x", n, 2.0), z = variables(linear, kMin, "x", n, 2.0);
  Expression f = 0.0, g = 0.0;
  for (int i = 0; i < n; ++i) {
    f += c[i] * x[at(i)];
    g += c[i] * z[at(i)];
  }
  std::vector<double> start(at(n), 0.0), linear_start(at(n), 0.0);
  for (int r = 0; r < m; ++r) {
    Expression row = 0.0, exact = 0.0;
    for (int i = 0; i < n; ++i) {
      row += a(r, i) * x[at(i)];
      exact += a(r, i) * z[at(i)];
    }
    const std::string name = std::to_string(r) + "_";
    for (int l = 0; l < k; ++l) {
      const Expression u = model.variable(kMax, "u" + name + std::to_string(l), -1.0, 1.0);
      const Expression s = linear.variable(kMin, "s" + name + std::to_string(l));
      start.push_back(dice.between(-0.5, 0.5));
      linear_start.push_back(1.0);
      Expression along = 0.0;
      for (int i = 0; i < n; ++i) {
        if (uncertain[at(r)](i, l) == 0.0) continue;
        row += uncertain[at(r)](i, l) * u * x[at(i)];
        along += uncertain[at(r)](i, l) * z[at(i)];
      }
      linear.constraint(s - along, 0.0, kNoBound);
      linear.constraint(s + along, 0.0, kNoBound);
      exact += 1.0 * s;
    }
    model.constraint(row, -kNoBound, b[r], kMin);
    linear.constraint(exact, -kNoBound, b[r]);
  }
  model.objective(f);
  linear.objective(g);
  AutodiffProblem reformulated(linear, linear_start);
  const Result best = solve(reformulated, {});
  ClosedForm game;
  game.problem = std::make_unique<AutodiffProblem>(model, start);
  game.x = n;
  if (is_success(best.status)) game.optimum = best.objective;
  game.phi = [=](const VectorXd& v) {
    for (int r = 0; r < m; ++r) {
      const double worst =
          a.row(r).dot(v) + (uncertain[at(r)].transpose() * v).cwiseAbs().sum() - b[r];
      if (worst > 1e-6) return kInfinity;
    }
    return c.dot(v);
  };
  game.allowed = [](const VectorXd& v) { return v.cwiseAbs().maxCoeff() <= 2.0 + 1e-7; };
  game.suspects = none;
  return game;
}

const std::vector<ClosedFormFamily>& closed_form_families() {
  static const std::vector<ClosedFormFamily> all = {{"bilinear", bilinear_game},
                                                    {"finite_maximum", finite_maximum},
                                                    {"matrix_game", matrix_game},
                                                    {"lagrangian", lagrangian},
                                                    {"wasserstein_gan", wasserstein_gan},
                                                    {"dirac_gan", dirac_gan},
                                                    {"ridge", ridge},
                                                    {"robust_lp", robust_linear_program}};
  return all;
}

Around look_around(const ClosedForm& game, const VectorXd& x, std::uint64_t seed) {
  Dice dice(seed);
  const double here = game.phi(x);
  double least = kInfinity;
  const auto look = [&](const VectorXd& d) {
    if (!(d.norm() > 0.0)) return;
    for (const double r : {1e-2, 1e-3}) {
      const VectorXd there = x + r * d / d.norm();
      if (game.allowed(there)) least = std::min(least, (game.phi(there) - here) / (r * r));
    }
  };
  for (int k = 0; k < 200; ++k) look(random_vector(dice, game.x));
  const MatrixXd suspects = game.suspects(x);
  for (Eigen::Index k = 0; k < suspects.cols(); ++k) {
    look(suspects.col(k));
    look(-suspects.col(k));
  }
  return least > 3e-4 ? Around::Strict : least < -3e-4 ? Around::Lower : Around::Open;
}

ClosedFormJudgement judge(const ClosedForm& game, const Result& result, std::uint64_t seed) {
  const VectorXd x = Eigen::Map<const VectorXd>(result.v.data(), game.x);
  const double phi = game.phi(x);
  if (game.optimum) {
    const bool best = phi <= *game.optimum + 1e-6 * (1.0 + std::abs(*game.optimum));
    return {.best = best, .around = best ? Around::Strict : Around::Lower};
  }
  return {.best = std::abs(result.objective - phi) <= game.accuracy * (1.0 + std::abs(phi)),
          .around = look_around(game, x, seed + 1)};
}

}  // namespace ipminmax::testing
