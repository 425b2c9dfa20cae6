#include <problems/random_robust.hpp>

#include <algorithm>
#include <cmath>

#include "linalg/numbers.hpp"

namespace ipminmax::testing {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

ipminmax::Index to_int(Index i) { return static_cast<ipminmax::Index>(i); }

/// Near y, in the set: projections on its parts in turn (Dykstra), then towards 0, an inner point.
void project(const DisturbanceSet& set, VectorXd& y) {
  std::vector<VectorXd> removed(1 + (set.ball ? 1 : 0) + set.normals.size(),
                                VectorXd::Zero(y.size()));
  for (int k = 0; k < 25; ++k) {
    const VectorXd before = y;
    std::size_t part = 0;
    const auto onto = [&](const auto& nearest) {
      const VectorXd from = y + removed[part];
      y = nearest(from);
      removed[part++] = from - y;
    };
    onto([](const VectorXd& z) -> VectorXd { return z.cwiseMax(-1.0).cwiseMin(1.0); });
    if (set.ball) onto([](const VectorXd& z) -> VectorXd { return z / std::max(1.0, z.norm()); });
    for (const VectorXd& a : set.normals) {
      onto([&](const VectorXd& z) -> VectorXd {
        return z - std::max(0.0, a.dot(z) - 1.0) / a.squaredNorm() * a;
      });
    }
    if ((y - before).lpNorm<Eigen::Infinity>() < 1e-10) break;
  }
  double outside = std::max(1.0, y.lpNorm<Eigen::Infinity>());
  if (set.ball) outside = std::max(outside, y.norm());
  for (const VectorXd& a : set.normals) outside = std::max(outside, a.dot(y));
  y /= outside;
}

}  // namespace

/// Argument of the waves; x_k of the first variables again where there are more waves.
VectorXd RobustRow::phases(const VectorXd& x, const VectorXd& y) const {
  VectorXd phase = frequencies * y;
  for (Index k = 0; k < phase.size(); ++k) phase[k] += x[k % x.size()];
  return phase;
}

double RobustRow::value(const VectorXd& x, const VectorXd& y) const {
  double sum = c.dot(x) + offset + a.dot(y) + x.dot(b * y) + 0.5 * y.dot(d.cwiseProduct(y));
  if (amplitudes.size() > 0) sum += amplitudes.dot(phases(x, y).array().sin().matrix());
  return sum;
}

VectorXd RobustRow::gradient(const VectorXd& x, const VectorXd& y, VectorXd& of_x) const {
  VectorXd of_y = a + b.transpose() * x + d.cwiseProduct(y);
  of_x = c + b * y;
  if (amplitudes.size() == 0) return of_y;
  const VectorXd slope = amplitudes.cwiseProduct(phases(x, y).array().cos().matrix());
  for (Index k = 0; k < slope.size(); ++k) of_x[k % x.size()] += slope[k];
  return of_y + frequencies.transpose() * slope;
}

MatrixXd RobustRow::hessian(const VectorXd& x, const VectorXd& y) const {
  const Index n = x.size(), m = y.size();
  MatrixXd h = MatrixXd::Zero(n + m, n + m);
  h.bottomLeftCorner(m, n) = b.transpose();
  h.bottomRightCorner(m, m) = d.asDiagonal();
  if (amplitudes.size() == 0) return h;
  const VectorXd bend = -amplitudes.cwiseProduct(phases(x, y).array().sin().matrix());
  for (Index k = 0; k < bend.size(); ++k) {
    VectorXd direction = VectorXd::Zero(n + m);
    direction[k % n] = 1.0;
    direction.tail(m) = frequencies.row(k);
    h += bend[k] * direction * direction.transpose();
  }
  return h;
}

RobustProgram RobustProgram::random(std::mt19937_64& random, Index disturbances) {
  const auto uniform = [&](double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random);
  };
  const auto vector = [&](Index size, double reach) {
    VectorXd v(size);
    for (double& value : v) value = uniform(-reach, reach);
    return v;
  };
  const auto whole = [&](Index least, Index most) {
    return static_cast<Index>(std::uniform_int_distribution<std::size_t>(
        static_cast<std::size_t>(least), static_cast<std::size_t>(most))(random));
  };
  RobustProgram p;
  const Index n = whole(1, 5), m = p.set.size = whole(1, disturbances);
  const Index kind = whole(0, 2);
  p.set.ball = kind == 1;
  for (int k = 0; kind == 2 && k < 3; ++k) p.set.normals.push_back(vector(m, 2.0));
  p.target = vector(n, 2.0);
  const Index waves = whole(0, 1) == 1 ? 2 : 0;
  p.rows.resize(static_cast<std::size_t>(whole(1, 10)));
  const double small = 1.0 / std::sqrt(static_cast<double>(m));
  for (RobustRow& row : p.rows) {
    row.c = vector(n, 1.0);
    row.a = vector(m, 0.3 * small);
    row.b.resize(n, m);
    for (Index i = 0; i < n; ++i) row.b.row(i) = vector(m, small);
    row.d = vector(m, small);
    row.amplitudes.resize(waves);
    row.frequencies.resize(waves, m);
    for (Index k = 0; k < waves; ++k) {
      row.amplitudes[k] = uniform(0.05, 0.3);
      row.frequencies.row(k) = vector(m, 2.0 * small);
    }
    row.offset = -uniform(1.0, 3.0);
  }
  return p;
}

double RobustProgram::largest(const RobustRow& row, const VectorXd& x, int starts,
                              std::mt19937_64& random) const {
  double most = -kInfinity;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  VectorXd y(set.size), of_x;
  for (int start = 0; start < starts; ++start) {
    const double reach = std::abs(uniform(random));
    for (double& value : y) {
      value = start % 3 == 0   ? reach * normal(random)
              : start % 3 == 1 ? std::copysign(reach, uniform(random))
                               : uniform(random);
    }
    project(set, y);
    double best = row.value(x, y);
    int slow = 0;
    for (double length = 1.0; length > 1e-6 && slow < 5;) {
      VectorXd moved = y + length * row.gradient(x, y, of_x);
      project(set, moved);
      const double value = row.value(x, moved);
      if (value > best) {
        slow = value - best < 1e-10 ? slow + 1 : 0;
        best = value;
        y = moved;
        length *= 1.6;
      } else {
        length *= 0.4;
      }
    }
    most = std::max(most, best);
  }
  return most;
}

RobustProgramModel::RobustProgramModel(const RobustProgram& program)
    : program_(program), n_(program.target.size()), m_(program.set.size) {
  for (Index i = 0; i < n_ + m_; ++i) {
    const double reach = i < n_ ? 3.0 : 1.0;
    structure_.variable_players.push_back(i < n_ ? Player::Min : Player::Max);
    structure_.variable_lower.push_back(-reach);
    structure_.variable_upper.push_back(reach);
    for (Index j = 0; j <= i; ++j) structure_.hessian.push_back({to_int(i), to_int(j)});
  }
  for (std::size_t r = 0; r < program.rows.size(); ++r) add_constraint(Player::Min, 0.0, 0);
  if (program.set.ball) add_constraint(Player::Max, 1.0, n_);
  for (std::size_t k = 0; k < program.set.normals.size(); ++k) {
    add_constraint(Player::Max, 1.0, n_);
  }
}

bool RobustProgramModel::starting_point(StartingPoint& start) {
  std::ranges::fill(start.v, 0.0);
  return !start.needs_multipliers;
}

bool RobustProgramModel::objective(std::span<const double> v, bool, double& f) {
  f = 0.5 * x(v).squaredNorm() - program_.target.dot(x(v));
  return true;
}

bool RobustProgramModel::gradient(std::span<const double> v, bool, std::span<double> g) {
  std::ranges::fill(g, 0.0);
  VectorXd::Map(g.data(), n_) = x(v) - program_.target;
  return true;
}

bool RobustProgramModel::constraints(std::span<const double> v, bool, std::span<double> g) {
  std::size_t k = 0;
  for (const RobustRow& row : program_.rows) g[k++] = row.value(x(v), y(v));
  if (program_.set.ball) g[k++] = y(v).squaredNorm();
  for (const VectorXd& normal : program_.set.normals) g[k++] = normal.dot(y(v));
  return true;
}

bool RobustProgramModel::jacobian(std::span<const double> v, bool, std::span<double> j) {
  double* entry = j.data();
  const auto put = [&](const VectorXd& values) { entry = std::ranges::copy(values, entry).out; };
  VectorXd of_x;
  for (const RobustRow& row : program_.rows) {
    const VectorXd of_y = row.gradient(x(v), y(v), of_x);
    put(of_x);
    put(of_y);
  }
  if (program_.set.ball) put(2.0 * y(v));
  for (const VectorXd& normal : program_.set.normals) put(normal);
  return true;
}

bool RobustProgramModel::hessian(std::span<const double> v, bool, double sigma,
                                 std::span<const double> lambda, bool, std::span<double> h) {
  MatrixXd sum = MatrixXd::Zero(n_ + m_, n_ + m_);
  sum.topLeftCorner(n_, n_).diagonal().setConstant(sigma);
  for (std::size_t r = 0; r < program_.rows.size(); ++r) {
    if (lambda[r] != 0.0) sum += lambda[r] * program_.rows[r].hessian(x(v), y(v));
  }
  if (program_.set.ball) {
    sum.bottomRightCorner(m_, m_).diagonal().array() += 2.0 * lambda[program_.rows.size()];
  }
  for (std::size_t e = 0; e < h.size(); ++e) {
    h[e] = sum(structure_.hessian[e].row, structure_.hessian[e].col);
  }
  return true;
}

/// Below `upper`, of the variables from `first` on.
void RobustProgramModel::add_constraint(Player owner, double upper, Index first) {
  const Index row = std::ssize(structure_.constraint_players);
  structure_.constraint_players.push_back(owner);
  structure_.constraint_lower.push_back(-kInfinity);
  structure_.constraint_upper.push_back(upper);
  for (Index i = first; i < n_ + m_; ++i) structure_.jacobian.push_back({to_int(row), to_int(i)});
}

}  // namespace ipminmax::testing
