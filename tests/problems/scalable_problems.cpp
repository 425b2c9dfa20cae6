#include <problems/scalable_problems.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include <Eigen/Dense>
#include <Eigen/SparseLU>

#include <problems/quadratic_problem.hpp>
#include <support/dense_algebra.hpp>

namespace ipminmax::testing {
namespace {

using Eigen::VectorXd;

constexpr double kUnbounded = 2e19;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::vector<double> to_std(const VectorXd& v) { return {v.begin(), v.end()}; }

/// The same numbers with every standard library, in [-1, 1).
double next_uniform(std::mt19937& random) { return static_cast<double>(random()) / 0x1p31 - 1.0; }

double value_at(QuadraticProblem& problem, std::span<const double> v) {
  double f = 0.0;
  (void)problem.objective(v, true, f);
  return f;
}

/// Adds h (v_i - s_i)(v_j - s_j), halved when i == j.
void add_shifted(QuadraticFunction& f, Index i, Index j, double h, double si, double sj) {
  f.add(i, j, h);
  if (i == j) {
    f.add_linear(i, -h * si);
    f.constant += 0.5 * h * si * si;
  } else {
    f.add_linear(i, -h * sj);
    f.add_linear(j, -h * si);
    f.constant += h * si * sj;
  }
}

/// A quadratic problem with linear equalities and bounds whose KKT point is unique, solved by a
/// primal-dual active-set method: guess the active bounds, solve the linear KKT system, correct the
/// guess.
void solve_by_active_sets(QuadraticProblem& problem, ScalableProblem& solution) {
  const ProblemStructure& s = problem.structure();
  const auto n = static_cast<Index>(s.variable_lower.size());
  const auto m = static_cast<Index>(s.constraint_lower.size());
  const std::vector<double> zero(at(n), 0.0);
  VectorXd linear(n), constants(m);
  std::vector<double> h(s.hessian.size()), j(s.jacobian.size());
  const std::vector<double> no_multipliers(at(m), 0.0);
  (void)problem.gradient(zero, true, {linear.data(), at(n)});
  (void)problem.constraints(zero, true, {constants.data(), at(m)});
  (void)problem.jacobian(zero, true, j);
  (void)problem.hessian(zero, true, 1.0, no_multipliers, true, h);

  std::vector<int> active(at(n), 0);  // -1 lower, +1 upper
  for (int pass = 0; pass < 50; ++pass) {
    std::vector<Eigen::Triplet<double>> entries;
    VectorXd rhs(n + m);
    rhs.head(n) = -linear;
    for (Index i = 0; i < n; ++i) {
      if (active[at(i)] == 0) continue;
      entries.emplace_back(i, i, 1.0);
      rhs[i] = active[at(i)] > 0 ? s.variable_upper[at(i)] : s.variable_lower[at(i)];
    }
    const auto add = [&](Index row, Index col, double value) {
      if (row >= n || active[at(row)] == 0) entries.emplace_back(row, col, value);
    };
    for (std::size_t k = 0; k < h.size(); ++k) {
      const auto [row, col] = s.hessian[k];
      add(row, col, h[k]);
      if (row != col) add(col, row, h[k]);
    }
    for (std::size_t k = 0; k < j.size(); ++k) {
      const auto [row, col] = s.jacobian[k];
      add(n + row, col, j[k]);
      add(col, n + row, j[k]);
    }
    for (Index i = 0; i < m; ++i) rhs[n + i] = s.constraint_upper[at(i)] - constants[i];
    Eigen::SparseMatrix<double> kkt(n + m, n + m);
    kkt.setFromTriplets(entries.begin(), entries.end());
    Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(kkt);
    VectorXd point = lu.solve(rhs);
    const VectorXd correction = lu.solve(rhs - kkt * point);
    point += correction;

    // z = -(grad f + J' lambda), the upper multiplier minus the lower one.
    solution.v.assign(point.begin(), point.begin() + n);
    solution.lambda.assign(point.begin() + n, point.end());
    VectorXd z(n);
    (void)problem.gradient(solution.v, true, {z.data(), at(n)});
    for (std::size_t k = 0; k < j.size(); ++k) {
      z[s.jacobian[k].col] += j[k] * point[n + s.jacobian[k].row];
    }
    z = -z;
    std::vector<int> next(at(n), 0);
    for (Index i = 0; i < n; ++i) {
      const double pressure =
          (s.variable_players[at(i)] == Player::Min ? z[i] : -z[i]) * (active[at(i)] != 0 ? 1 : 0);
      if (pressure + (point[i] - s.variable_upper[at(i)]) > 0.0) next[at(i)] = 1;
      if (pressure + (point[i] - s.variable_lower[at(i)]) < 0.0) next[at(i)] = -1;
    }
    if (next == active) {
      solution.z_lower.assign(at(n), 0.0);
      solution.z_upper.assign(at(n), 0.0);
      for (Index i = 0; i < n; ++i) {
        if (active[at(i)] > 0) solution.z_upper[at(i)] = z[i];
        if (active[at(i)] < 0) solution.z_lower[at(i)] = -z[i];
      }
      solution.objective = value_at(problem, solution.v);
      return;
    }
    active = next;
  }
  throw std::logic_error(solution.name + ": the active sets do not settle");
}

ScalableProblem named(std::string name, int size) {
  return {.name = std::move(name) + "(" + std::to_string(size) + ")"};
}

}  // namespace

ScalableProblem f01_quad(int n) {
  ScalableProblem p = named("f01_quad", n);
  auto problem = std::make_unique<QuadraticProblem>(n, n);
  QuadraticFunction& f = problem->f();
  f.constant = 1.0;
  const auto a = [](Index i) { return std::sin(i + 1.0); };
  const auto b = [](Index i) { return std::cos(i + 1.0); };
  for (Index i = 0; i < n; ++i) {
    add_shifted(f, i, i, std::cos(i + 1.0), a(i), a(i));
    add_shifted(f, i, n + i, 2.0, a(i), b(i));
    add_shifted(f, n + i, n + i, -1.0, b(i), b(i));
    if (i + 1 < n) {
      add_shifted(f, i + 1, i, 0.2, a(i + 1), a(i));
      add_shifted(f, n + i + 1, n + i, 0.25, b(i + 1), b(i));
    }
  }
  problem->finish();
  for (Index i = 0; i < n; ++i) p.v.push_back(a(i));
  for (Index i = 0; i < n; ++i) p.v.push_back(b(i));
  p.objective = 1.0;
  p.problem = std::move(problem);
  return p;
}

ScalableProblem f03_quad_box(int n) {
  ScalableProblem p = named("f03_quad_box", n);
  p.global = p.unique_value = false;
  const auto x_is_active = [](Index i) { return i % 4 == 0; };
  const auto y_is_active = [](Index i) { return i % 3 == 1; };
  p.v.resize(2 * at(n));
  p.z_lower.assign(2 * at(n), 0.0);
  p.z_upper.assign(2 * at(n), 0.0);
  for (Index i = 0; i < n; ++i) {
    const double multiplier = 0.5 + 0.4 * std::sin(3.0 * i);
    p.v[at(i)] = x_is_active(i) ? (i % 8 == 0 ? -1.0 : 1.0) : 0.6 * std::sin(2.0 * i);
    p.v[at(n + i)] = y_is_active(i) ? (i % 2 == 0 ? -1.0 : 1.0) : 0.6 * std::cos(5.0 * i);
    if (x_is_active(i)) (i % 8 == 0 ? p.z_lower : p.z_upper)[at(i)] = multiplier;
    if (y_is_active(i)) (i % 2 == 0 ? p.z_lower : p.z_upper)[at(n + i)] = -multiplier;
  }

  auto problem = std::make_unique<QuadraticProblem>(n, n);
  QuadraticFunction& f = problem->f();
  const auto add = [&](Index i, Index j, double value) {
    add_shifted(f, i, j, value, p.v[at(i)], p.v[at(j)]);
  };
  for (Index i = 0; i < n; ++i) {
    add(i, i, y_is_active(i) ? 1.0 : std::cos(i));  // without y_i nothing helps a negative one
    add(n + i, n + i, y_is_active(i) ? 1.0 : -1.0);
    add(i, n + i, 2.0);
    if (i + 1 < n) {
      add(i, n + i + 1, 0.3);
      add(i + 1, i, 0.1);
      add(n + i + 1, n + i, 0.1);
    }
    problem->set_bounds(i, -1.0, 1.0);
    problem->set_bounds(n + i, -1.0, 1.0);
  }
  // grad f = z_lower - z_upper at the planted point.
  for (std::size_t i = 0; i < p.v.size(); ++i) {
    const double slope = p.z_lower[i] - p.z_upper[i];
    f.add_linear(static_cast<Index>(i), slope);
    p.objective += slope * p.v[i];
  }
  problem->finish();
  p.problem = std::move(problem);
  return p;
}

namespace {

class TrigProblem final : public Problem {
 public:
  explicit TrigProblem(int n) : n_(n) {
    const std::size_t size = at(n);
    structure_.variable_players.assign(2 * size, Player::Min);
    std::fill_n(structure_.variable_players.begin() + n, n, Player::Max);
    structure_.variable_lower.assign(2 * size, -kUnbounded);
    structure_.variable_upper.assign(2 * size, kUnbounded);
    for (Index i = 0; i < 2 * n; ++i) structure_.hessian.push_back({i, i});
    for (Index i = 0; i < n; ++i) structure_.hessian.push_back({n + i, i});
    for (Index i = 0; i + 1 < n; ++i) structure_.hessian.push_back({n + i + 1, i});
  }

  /// a_i = sin i, b_i = cos i: the solution.
  [[nodiscard]] double center(Index k) const {
    return k < n_ ? std::sin(k + 1.0) : std::cos(k - n_ + 1.0);
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    for (Index k = 0; k < 2 * n_; ++k) start.v[at(k)] = center(k) + 0.5 * std::sin(7.0 * k);
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (Index i = 0; i < n_; ++i) {
      f += std::cos(u(v, i)) - 1.0 + std::cos(u(v, n_ + i)) - 1.0;
      f += 2.0 * std::sin(u(v, i)) * std::sin(u(v, n_ + i));
      if (i + 1 < n_) f += 0.2 * std::sin(u(v, i)) * std::sin(u(v, n_ + i + 1));
    }
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    for (Index k = 0; k < 2 * n_; ++k) {
      grad[at(k)] = -std::sin(u(v, k)) + std::cos(u(v, k)) * partners(v, k);
    }
    return true;
  }

  [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double>) override {
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double>) override {
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>,
                             bool, std::span<double> values) override {
    for (std::size_t entry = 0; entry < values.size(); ++entry) {
      const auto [row, col] = structure_.hessian[entry];
      if (row == col) {
        values[entry] = sigma * (-std::cos(u(v, row)) - std::sin(u(v, row)) * partners(v, row));
      } else {
        const double weight = row - n_ == col ? 2.0 : 0.2;
        values[entry] = sigma * weight * std::cos(u(v, row)) * std::cos(u(v, col));
      }
    }
    return true;
  }

 private:
  [[nodiscard]] double u(std::span<const double> v, Index k) const { return v[at(k)] - center(k); }

  /// The factor of sin u_k in f.
  [[nodiscard]] double partners(std::span<const double> v, Index k) const {
    if (k < n_) {
      const double next = k + 1 < n_ ? std::sin(u(v, n_ + k + 1)) : 0.0;
      return 2.0 * std::sin(u(v, n_ + k)) + 0.2 * next;
    }
    const double previous = k > n_ ? std::sin(u(v, k - n_ - 1)) : 0.0;
    return 2.0 * std::sin(u(v, k - n_)) + 0.2 * previous;
  }

  Index n_;
  ProblemStructure structure_;
};

}  // namespace

ScalableProblem f05_trig(int n) {
  ScalableProblem p = named("f05_trig", n);
  auto problem = std::make_unique<TrigProblem>(n);
  for (Index k = 0; k < 2 * n; ++k) p.v.push_back(problem->center(k));
  p.global = p.unique_value = false;
  p.problem = std::move(problem);
  return p;
}

ScalableProblem f10_ball_halfspace(int n) {
  constexpr double kRadius = 2.0;
  ScalableProblem p = named("f10_ball_halfspace", n);
  std::vector<double> a;  // |a| = 1
  double norm = 0.0;
  for (Index i = 0; i < n; ++i) {
    a.push_back(1.0 + 0.5 * std::sin(i));
    norm = std::hypot(norm, a.back());
  }
  auto problem = std::make_unique<QuadraticProblem>(n, n);
  QuadraticFunction half_space, ball;
  std::vector<double> start;
  for (Index i = 0; i < n; ++i) {
    a[at(i)] /= norm;
    problem->f().add(i, i, 1.0);
    problem->f().add(n + i, i, -1.0);
    problem->f().add(n + i, n + i, 1.0);
    half_space.add_linear(i, a[at(i)]);
    ball.add(n + i, n + i, 1.0);
    start.push_back(1.0 / std::sqrt(n));
  }
  for (Index i = 0; i < n; ++i) start.push_back(-0.3 / std::sqrt(n));
  problem->add_constraint(half_space, 1.0, kUnbounded);
  problem->add_constraint(ball, -kUnbounded, 0.5 * kRadius * kRadius);
  problem->set_start(start);
  problem->finish();
  p.v = a;
  for (const double ai : a) p.v.push_back(-kRadius * ai);
  p.lambda = {-(1.0 + kRadius), -(1.0 + kRadius) / kRadius};
  p.objective = 0.5 * (1.0 + kRadius) * (1.0 + kRadius);
  p.problem = std::move(problem);
  return p;
}

namespace {

/// Variables x (n), dA (rows n, by rows), db (rows).
class RobustLeastSquares final : public Problem {
 public:
  RobustLeastSquares(Eigen::MatrixXd a, VectorXd b, double rho)
      : a_(std::move(a)),
        b_(std::move(b)),
        rows_(static_cast<Index>(a_.rows())),
        n_(static_cast<Index>(a_.cols())) {
    const std::size_t size = at(n_ + rows_ * (n_ + 1));
    structure_.variable_players.assign(size, Player::Max);
    std::fill_n(structure_.variable_players.begin(), n_, Player::Min);
    structure_.variable_lower.assign(size, -kUnbounded);
    structure_.variable_upper.assign(size, kUnbounded);
    structure_.constraint_lower = {-kUnbounded};
    structure_.constraint_upper = {0.5 * rho * rho};
    structure_.constraint_players = {Player::Max};
    for (Index k = n_; k < static_cast<Index>(size); ++k) structure_.jacobian.push_back({0, k});
    for_each_entry({}, [&](Index row, Index col, double) {
      structure_.hessian.push_back({row, col});
    });
    for (Index k = n_; k < static_cast<Index>(size); ++k) structure_.hessian.push_back({k, k});
  }

  [[nodiscard]] Index da(Index row, Index i) const { return n_ + row * n_ + i; }
  [[nodiscard]] Index db(Index row) const { return n_ + rows_ * n_ + row; }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    for (std::size_t k = 0; k < start.v.size(); ++k) {
      start.v[k] = 0.01 * std::sin(static_cast<double>(k));
    }
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (Index row = 0; row < rows_; ++row) f += 0.5 * residual(v, row) * residual(v, row);
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    for (Index row = 0; row < rows_; ++row) {
      const double r = residual(v, row);
      for (Index i = 0; i < n_; ++i) {
        grad[at(i)] += r * entry(v, row, i);
        grad[at(da(row, i))] = r * v[at(i)];
      }
      grad[at(db(row))] = -r;
    }
    return true;
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    g[0] = 0.0;
    for (const double value : v.subspan(at(n_))) g[0] += 0.5 * value * value;
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    std::ranges::copy(v.subspan(at(n_)), values.begin());
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    std::ranges::fill(values, lambda[0]);
    std::size_t k = 0;
    for_each_entry(v, [&](Index, Index, double value) { values[k++] = sigma * value; });
    return true;
  }

 private:
  [[nodiscard]] double entry(std::span<const double> v, Index row, Index i) const {
    return a_(row, i) + v[at(da(row, i))];
  }
  [[nodiscard]] double residual(std::span<const double> v, Index row) const {
    double r = -b_[row] - v[at(db(row))];
    for (Index i = 0; i < n_; ++i) r += entry(v, row, i) * v[at(i)];
    return r;
  }

  /// Lower triangle of the Hessian of f; without v only the places, with zero values.
  template <typename Function>
  void for_each_entry(std::span<const double> v, Function function) const {
    const auto value = [&](auto formula) { return v.empty() ? 0.0 : formula(); };
    for (Index i = 0; i < n_; ++i) {
      for (Index j = 0; j <= i; ++j) {
        function(i, j, value([&] {
                   double sum = 0.0;
                   for (Index row = 0; row < rows_; ++row)
                     sum += entry(v, row, i) * entry(v, row, j);
                   return sum;
                 }));
      }
    }
    for (Index row = 0; row < rows_; ++row) {
      const double r = value([&] { return residual(v, row); });
      for (Index i = 0; i < n_; ++i) {
        for (Index j = 0; j < n_; ++j) {
          function(da(row, i), j,
                   value([&] { return entry(v, row, j) * v[at(i)] + (i == j ? r : 0.0); }));
        }
        for (Index j = 0; j <= i; ++j) {
          function(da(row, i), da(row, j), value([&] { return v[at(i)] * v[at(j)]; }));
        }
        function(db(row), i, value([&] { return -entry(v, row, i); }));
        function(db(row), da(row, i), value([&] { return -v[at(i)]; }));
      }
      function(db(row), db(row), value([] { return 1.0; }));
    }
  }

  Eigen::MatrixXd a_;
  VectorXd b_;
  Index rows_, n_;
  ProblemStructure structure_;
};

/// Minimizer of |Ax-b| + rho sqrt(1+|x|^2), strictly convex: damped Newton.
VectorXd minimize_robust_residual(const Eigen::MatrixXd& a, const VectorXd& b, double rho) {
  const auto value = [&](const VectorXd& x) {
    return (a * x - b).norm() + rho * std::sqrt(1.0 + x.squaredNorm());
  };
  VectorXd x = VectorXd::Zero(a.cols());
  for (int iteration = 0; iteration < 100; ++iteration) {
    const VectorXd r = a * x - b;
    const double length = r.norm();
    const double s = std::sqrt(1.0 + x.squaredNorm());
    const VectorXd ar = a.transpose() * r / length;
    const VectorXd gradient = ar + rho * x / s;
    const Eigen::MatrixXd hessian =
        (a.transpose() * a - ar * ar.transpose()) / length +
        rho / s * (Eigen::MatrixXd::Identity(x.size(), x.size()) - x * x.transpose() / (s * s));
    const VectorXd step = -solve_dense(hessian, gradient);
    double alpha = 1.0;
    while (alpha > 1e-3 && value(x + alpha * step) > value(x)) alpha /= 2.0;
    x += alpha * step;
    if (step.norm() < 1e-15) break;
  }
  return x;
}

}  // namespace

ScalableProblem f12_robust_ls(int rows, int n) {
  constexpr double kRho = 0.5;
  ScalableProblem p = named("f12_robust_ls", n);
  std::mt19937 random(12);
  Eigen::MatrixXd a(rows, n);
  VectorXd b(rows);
  for (Index row = 0; row < rows; ++row) {
    for (Index i = 0; i < n; ++i) a(row, i) = next_uniform(random);
    b[row] = next_uniform(random);
  }
  const VectorXd x = minimize_robust_residual(a, b, kRho);
  const VectorXd r = a * x - b;
  const double s = std::sqrt(1.0 + x.squaredNorm());
  const double worst = r.norm() + kRho * s;

  auto problem = std::make_unique<RobustLeastSquares>(a, b, kRho);
  p.v.resize(problem->structure().variable_lower.size());
  std::ranges::copy(x, p.v.begin());
  for (Index row = 0; row < rows; ++row) {
    const double weight = kRho * r[row] / (r.norm() * s);
    for (Index i = 0; i < n; ++i) p.v[at(problem->da(row, i))] = weight * x[i];
    p.v[at(problem->db(row))] = -weight;
  }
  p.lambda = {-worst * s / kRho};
  p.objective = 0.5 * worst * worst;
  p.problem = std::move(problem);
  return p;
}

namespace {

constexpr double kGammaSquared = 20.0;
constexpr double kControlWeight = 0.1;

/// Variables u_0..u_{T-1}, w_0..w_{T-1}, s_1..s_T (two entries each).
std::unique_ptr<QuadraticProblem> oscillator_game(int horizon, const Eigen::Vector2d& s0) {
  const Eigen::Matrix2d a{{0.98, 0.1}, {-0.1, 0.95}};
  const Eigen::Vector2d b(0.005, 0.1), d(0.1, 0.05);
  auto problem = std::make_unique<QuadraticProblem>(horizon, 3 * horizon);
  QuadraticFunction& f = problem->f();
  const auto state = [&](Index k, Index i) { return 2 * horizon + 2 * (k - 1) + i; };
  f.constant = 0.5 * s0.squaredNorm();
  for (Index k = 0; k < horizon; ++k) {
    f.add(k, k, kControlWeight);
    f.add(horizon + k, horizon + k, -kGammaSquared);
    for (Index i = 0; i < 2; ++i) {
      f.add(state(k + 1, i), state(k + 1, i), 1.0);  // Q = Q_f = I
      QuadraticFunction dynamics;
      dynamics.add_linear(state(k + 1, i), 1.0);
      dynamics.add_linear(k, -b[i]);
      dynamics.add_linear(horizon + k, -d[i]);
      for (Index j = 0; j < 2; ++j) {
        if (k > 0) dynamics.add_linear(state(k, j), -a(i, j));
      }
      const double right = k > 0 ? 0.0 : a.row(i).dot(s0);
      problem->add_constraint(dynamics, right, right);
    }
  }
  return problem;
}

/// s0' P_0 s0 / 2 of the coupled Riccati recursion: the value of the saddle point. Throws unless
/// the maximization over all w for given u is strictly concave, which the recursion without u
/// tells.
double riccati_value(int horizon, const Eigen::Vector2d& s0) {
  const Eigen::Matrix2d a{{0.98, 0.1}, {-0.1, 0.95}};
  const Eigen::Matrix2d g{{0.005, 0.1}, {0.1, 0.05}};  // columns: u, w
  Eigen::Matrix2d p = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d without_u = p;
  for (int k = 0; k < horizon; ++k) {
    Eigen::Matrix2d weights = g.transpose() * p * g;
    weights(0, 0) += kControlWeight;
    weights(1, 1) -= kGammaSquared;
    const Eigen::Matrix2d coupling = g.transpose() * p * a;
    p = (Eigen::Matrix2d::Identity() + a.transpose() * p * a -
         coupling.transpose() * weights.inverse() * coupling)
            .eval();

    const Eigen::Vector2d d = g.col(1);
    const double concavity = kGammaSquared - d.dot(without_u * d);
    if (concavity <= 0.0) throw std::logic_error("the maximization over w is not concave");
    const Eigen::Vector2d response = a.transpose() * without_u * d;
    without_u = (Eigen::Matrix2d::Identity() + a.transpose() * without_u * a +
                 response * response.transpose() / concavity)
                    .eval();
  }
  return 0.5 * s0.dot(p * s0);
}

}  // namespace

ScalableProblem f16_lq_game(int horizon) {
  const Eigen::Vector2d s0(1.0, 0.5);
  ScalableProblem p = named("f16_lq_game", horizon);
  auto problem = oscillator_game(horizon, s0);
  problem->finish();
  solve_by_active_sets(*problem, p);
  p.objective = riccati_value(horizon, s0);
  p.problem = std::move(problem);
  return p;
}

ScalableProblem f17_mpc_box(int horizon) {
  ScalableProblem p = named("f17_mpc_box", horizon);
  const Eigen::Vector2d s0(1.0, 0.5);
  (void)riccati_value(horizon, s0);  // concave
  auto problem = oscillator_game(horizon, s0);
  for (Index k = 0; k < horizon; ++k) {
    problem->set_bounds(k, -0.5, 0.5);
    problem->set_bounds(horizon + k, -0.02, 0.02);
  }
  problem->finish();
  solve_by_active_sets(*problem, p);
  p.problem = std::move(problem);
  return p;
}

ScalableProblem f19_pde(int nodes) {
  constexpr double kControlCost = 1e-3, kSourceCost = 0.1, kLargestControl = 8.0;
  ScalableProblem p = named("f19_pde", nodes);
  auto problem = std::make_unique<QuadraticProblem>(nodes, 2 * nodes);
  QuadraticFunction& f = problem->f();
  const double h = 1.0 / (nodes + 1);
  for (Index i = 0; i < nodes; ++i) {
    const Index u = i, w = nodes + i, z = 2 * nodes + i;
    const double wanted = std::sin(std::numbers::pi * (i + 1) * h);
    f.add(u, u, kControlCost);
    f.add(w, w, -kSourceCost);
    add_shifted(f, z, z, 1.0, wanted, wanted);
    QuadraticFunction equation;
    equation.add_linear(z, 2.0 / h);
    if (i > 0) equation.add_linear(z - 1, -1.0 / h);
    if (i + 1 < nodes) equation.add_linear(z + 1, -1.0 / h);
    equation.add_linear(u, -h);
    equation.add_linear(w, -h);
    problem->add_constraint(equation, 0.0, 0.0);
    problem->set_bounds(u, -kLargestControl, kLargestControl);
  }
  problem->finish();
  solve_by_active_sets(*problem, p);
  p.problem = std::move(problem);
  return p;
}

ScalableProblem f30_few_min(int n, int side) {
  const Index nodes = side * side;
  ScalableProblem p = named("f30_few_min", n);
  p.name += " side " + std::to_string(side);
  auto problem = std::make_unique<QuadraticProblem>(n, nodes);
  QuadraticFunction& f = problem->f();
  const auto size = at(n + nodes);
  p.v.resize(size);
  p.z_lower.assign(size, 0.0);
  p.z_upper.assign(size, 0.0);
  std::vector<double> slope(size, 0.0);  // s = -J'lambda + z_lower - z_upper
  std::vector<double> start(size);
  for (Index i = 0; i < n + nodes; ++i) {
    p.v[at(i)] = i >= n && i % 4 == 0 ? (i % 8 == 0 ? -1.0 : 1.0) : 0.6 * std::sin(2.0 * i);
    start[at(i)] = p.v[at(i)] + 0.1 * std::sin(7.0 * i);
    if (i >= n && i % 4 == 0) {
      const double multiplier = -0.5 + 0.4 * std::sin(3.0 * i);
      (i % 8 == 0 ? p.z_lower : p.z_upper)[at(i)] = multiplier;
      slope[at(i)] = i % 8 == 0 ? multiplier : -multiplier;
    }
  }
  const auto add = [&](Index i, Index j, double value) {
    add_shifted(f, i, j, value, p.v[at(i)], p.v[at(j)]);
  };
  QuadraticFunction sum;
  double least = 0.0;
  constexpr double kSumMultiplier = -0.5;
  for (Index i = 0; i < n; ++i) {
    add(i, i, -1.0);
    sum.add_linear(i, 1.0);
    least += p.v[at(i)];
    slope[at(i)] -= kSumMultiplier;
  }
  problem->add_constraint(sum, least, kUnbounded);
  p.lambda.push_back(kSumMultiplier);
  for (Index k = 0; k < nodes; ++k) {
    const Index y = n + k;
    problem->set_bounds(y, -1.0, 1.0);
    add(y, y, -1.0);
    for (Index i = 0; i < n; ++i) {
      add(y, i,
          2.0 * std::sqrt(2.0 / nodes) * std::cos(std::numbers::pi * (i + 1) * (k + 0.5) / nodes));
    }
    if (k >= side) add(y, y - side, 0.1);
    if (k % side > 0) add(y, y - 1, 0.1);
    if (k % 8 != 1 || k + 1 == nodes) continue;
    QuadraticFunction equation;
    const double multiplier = std::sin(11.0 * k);
    for (const auto& [i, value] :
         {std::pair{y, 1.0}, std::pair{y + 1, -0.5}, std::pair{k % n, 0.5 / side}}) {
      equation.add_linear(i, value);
      equation.constant -= value * p.v[at(i)];
      slope[at(i)] -= value * multiplier;
    }
    problem->add_constraint(equation, 0.0, 0.0);
    p.lambda.push_back(multiplier);
  }
  for (Index i = 0; i < n + nodes; ++i) {
    f.add_linear(i, slope[at(i)]);
    f.constant -= slope[at(i)] * p.v[at(i)];
  }
  problem->set_start(start);
  problem->finish();
  p.unique_value = false;
  p.global = false;
  p.problem = std::move(problem);
  return p;
}

ScalableProblem f23_sphere(int n) {
  ScalableProblem p = named("f23_sphere", n);
  auto problem = std::make_unique<QuadraticProblem>(n, n);
  const auto diagonal = [n](Index i) { return 1.0 + 4.0 * i / n; };
  constexpr double kAbove = 0.3;
  QuadraticFunction x_sphere, y_sphere;
  std::vector<double> start(2 * at(n));
  for (Index i = 0; i < n; ++i) {
    problem->f().add(n + i, i, diagonal(i));
    if (i + 1 < n) problem->f().add(n + i + 1, i, kAbove);
    x_sphere.add(i, i, 1.0);
    y_sphere.add(n + i, n + i, 1.0);
    start[at(i)] = std::exp(-0.5 * i);
    start[at(n + i)] = std::exp(-0.4 * i);
  }
  problem->add_constraint(x_sphere, 0.5, 0.5);
  problem->add_constraint(y_sphere, 0.5, 0.5);
  problem->set_start(start);
  problem->finish();

  // Right singular vector of the smallest singular value: inverse iteration with A'A.
  VectorXd y = VectorXd::Ones(n);
  for (int iteration = 0; iteration < 10000; ++iteration) {
    VectorXd next = y;
    for (Index i = 0; i < n; ++i) {  // A' is lower bidiagonal
      if (i > 0) next[i] -= kAbove * next[i - 1];
      next[i] /= diagonal(i);
    }
    for (Index i = n; i-- > 0;) {
      if (i + 1 < n) next[i] -= kAbove * next[i + 1];
      next[i] /= diagonal(i);
    }
    next.normalize();
    const double change = (next - y).lpNorm<Eigen::Infinity>();
    y = next;
    if (change < 1e-16) break;
  }
  VectorXd x(n);  // A y = sigma x
  for (Index i = 0; i < n; ++i) x[i] = diagonal(i) * y[i] + (i + 1 < n ? kAbove * y[i + 1] : 0.0);
  const double sigma = x.norm();
  x /= sigma;
  p.v = to_std(x);
  const std::vector<double> tail = to_std(y);
  p.v.insert(p.v.end(), tail.begin(), tail.end());
  p.lambda = {-sigma, -sigma};
  p.objective = sigma;
  p.problem = std::move(problem);
  return p;
}

std::vector<ScalableProblem> small_scalable_problems() {
  std::vector<ScalableProblem> all;
  all.push_back(f01_quad(10));
  all.push_back(f03_quad_box(20));
  all.push_back(f05_trig(10));
  all.push_back(f10_ball_halfspace(10));
  all.push_back(f12_robust_ls(6, 4));
  all.push_back(f16_lq_game(10));
  all.push_back(f17_mpc_box(10));
  all.push_back(f19_pde(15));
  all.push_back(f23_sphere(10));
  all.push_back(f30_few_min(3, 6));
  return all;
}

}  // namespace ipminmax::testing
