#include "core/certificate/units.hpp"

#include <algorithm>
#include <cmath>

namespace ipminmax {
namespace {

constexpr double kUnknown = 0.0;
/// Rounds in which units spread from variable to variable.
constexpr int kRounds = 16;
constexpr int kSweeps = 4;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Largest |W_ik| d_i d_k per row; d_i = 1 where unknown, entries with an unknown d_k left out.
Eigen::VectorXd row_norms(const CanonicalProblem& canonical, const Evaluation& evaluation,
                          const Eigen::VectorXd& d) {
  Eigen::VectorXd norms = Eigen::VectorXd::Zero(d.size());
  const auto own = [&](Index i) { return d[i] == kUnknown ? 1.0 : d[i]; };
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    const double value = std::abs(evaluation.hessian[k]);
    norms[i] = std::max(norms[i], value * own(i) * d[j]);
    norms[j] = std::max(norms[j], value * own(j) * d[i]);
  }
  return norms;
}

/// 1 / norm; unknown for zero and for what would leave the range of numbers.
double inverse(double norm) { return norm > 1e-150 && norm < 1e150 ? 1.0 / norm : kUnknown; }

void equilibrate_hessian(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         Eigen::VectorXd& d) {
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (i == j) d[i] += std::abs(evaluation.hessian[k]);
  }
  for (double& value : d) value = inverse(std::sqrt(value));
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd norms = row_norms(canonical, evaluation, d);
    bool found = false;
    for (Index i = 0; i < d.size(); ++i) {
      if (d[i] != kUnknown || norms[i] == 0.0) continue;
      d[i] = inverse(norms[i]);
      found = true;
    }
    if (!found) break;
  }
  // Nothing but products: x y.
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    const double half = inverse(std::sqrt(std::abs(evaluation.hessian[k])));
    for (const Index m : {i, j}) {
      if (d[m] == kUnknown) d[m] = half;
    }
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const Eigen::VectorXd norms = row_norms(canonical, evaluation, d);
    for (Index i = 0; i < d.size(); ++i) {
      if (norms[i] > 0.0) d[i] /= std::sqrt(norms[i]);
    }
  }
}

/// Largest |J_ji| d_i of each row, unknown ones left out.
void constraint_norms(const CanonicalProblem& canonical, const Evaluation& evaluation,
                      const Eigen::VectorXd& d, Eigen::VectorXd& norms) {
  norms.setZero();
  for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    norms[row] = std::max(norms[row], std::abs(evaluation.jacobian[k]) * d[col]);
  }
}

/// Variables without curvature, from the constraints that tie them to others.
void spread_by_constraints(const CanonicalProblem& canonical, const Evaluation& evaluation,
                           Eigen::VectorXd& d) {
  Eigen::VectorXd rows(canonical.constraints()), columns(d.size());
  for (int round = 0; round < kRounds; ++round) {
    constraint_norms(canonical, evaluation, d, rows);
    columns.setZero();
    for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
      const auto [row, col] = canonical.jacobian()[k];
      if (d[col] != kUnknown || rows[row] == 0.0) continue;
      columns[col] = std::max(columns[col], std::abs(evaluation.jacobian[k]) / rows[row]);
    }
    bool found = false;
    for (Index i = 0; i < d.size(); ++i) {
      if (columns[i] == 0.0) continue;
      d[i] = inverse(columns[i]);
      found = found || d[i] != kUnknown;
    }
    if (!found) break;
  }
  for (double& value : d) {
    if (value == kUnknown) value = 1.0;
  }
}

}  // namespace

Units units_of(const CanonicalProblem& canonical, const Evaluation& evaluation) {
  Units units{Eigen::VectorXd::Constant(canonical.variables(), kUnknown),
              Eigen::VectorXd::Ones(canonical.constraints())};
  equilibrate_hessian(canonical, evaluation, units.variable);
  spread_by_constraints(canonical, evaluation, units.variable);
  Eigen::VectorXd norms(canonical.constraints());
  constraint_norms(canonical, evaluation, units.variable, norms);
  const auto slack_of = canonical.slack_of_constraint();
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (const double unit = inverse(norms[j]); unit != kUnknown) units.constraint[j] = unit;
    if (slack_of[at(j)] >= 0) units.variable[slack_of[at(j)]] = 1.0 / units.constraint[j];
  }
  return units;
}

Evaluation in_units(const CanonicalProblem& canonical, const Evaluation& evaluation,
                    const Units& units) {
  Evaluation scaled = evaluation;
  scaled.jacobian_call = scaled.hessian_call = 0;
  for (std::size_t k = 0; k < scaled.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    scaled.hessian[k] *= units.variable[i] * units.variable[j];
  }
  for (std::size_t k = 0; k < scaled.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    scaled.jacobian[k] *= units.constraint[row] * units.variable[col];
  }
  return scaled;
}

}  // namespace ipminmax
