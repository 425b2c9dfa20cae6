#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/certificate/parameters.hpp"
#include "core/certificate/robust_rows.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

/// Barrier curvatures at which active bounds hold firmly and others not at all.
Eigen::VectorXd firm_curvature(const CanonicalProblem& canonical, const Iterate& iterate) {
  Eigen::VectorXd curvature = Eigen::VectorXd::Zero(canonical.variables());
  for (const IndexRange slacks : {canonical.x_slacks(), canonical.y_slacks()}) {
    for (Index i = slacks.begin; i < slacks.end; ++i) curvature[i] = parameter::kConstant;
  }
  const auto add = [&](Index i, double ratio) {
    if (ratio > 1.0) curvature[i] += parameter::kFirm * ratio;
  };
  for (const Index i : canonical.lower_bounded()) {
    add(i, iterate.z_lower[i] / canonical.above_lower(i, iterate.v[i]));
  }
  for (const Index i : canonical.upper_bounded()) {
    add(i, iterate.z_upper[i] / canonical.below_upper(i, iterate.v[i]));
  }
  return curvature;
}

struct ActiveRow {
  Index constraint;
  double compliance;  ///< D = s / z
};

std::vector<ActiveRow> active_rows(const CanonicalProblem& canonical, const Eigen::VectorXd& firm) {
  std::vector<ActiveRow> rows;
  for (const Index j : canonical.robust_constraints()) {
    const Index slack = canonical.slack_of_constraint()[static_cast<std::size_t>(j)];
    if (firm[slack] > parameter::kFirm) rows.push_back({j, parameter::kFirm / firm[slack]});
  }
  return rows;
}

}  // namespace

SecondOrder test_robust_rows(const CanonicalProblem& canonical, KktSystem& kkt,
                             const Iterate& iterate, const Evaluation& evaluation,
                             const std::vector<Index>& idle, const Eigen::VectorXd& proximal) {
  if (canonical.robust_constraints().empty()) return SecondOrder::Satisfied;
  Eigen::VectorXd firm = firm_curvature(canonical, iterate);
  for (const Index i : idle) firm[i] += parameter::kFirm;
  const std::vector<ActiveRow> rows = active_rows(canonical, firm);
  if (rows.empty()) return SecondOrder::Satisfied;
  if (proximal.size() > 0) firm += proximal;
  kkt.assemble(evaluation, firm);
  if (!kkt.has_expected_inner_inertia(kkt.factorize_inner({}))) return SecondOrder::Undecided;

  const auto size = static_cast<Eigen::Index>(rows.size());
  const auto jacobian = canonical.jacobian();
  // J_r over y, one column per row; rows of K_yy are found by the step's v.
  std::vector<Eigen::Index> column_of(static_cast<std::size_t>(canonical.constraints()), -1);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    column_of[static_cast<std::size_t>(rows[r].constraint)] = static_cast<Eigen::Index>(r);
  }
  Eigen::MatrixXd right = Eigen::MatrixXd::Identity(size, size);
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  for (Eigen::Index r = 0; r < size; ++r) {
    rhs.v.setZero();
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      const auto [row, col] = jacobian[k];
      if (canonical.owned_by_max(col) && column_of[static_cast<std::size_t>(row)] == r) {
        rhs.v[col] += evaluation.jacobian[k];
      }
    }
    if (!kkt.solve_inner(evaluation, rhs, step)) return SecondOrder::Undecided;
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      const auto [row, col] = jacobian[k];
      const Eigen::Index s = column_of[static_cast<std::size_t>(row)];
      if (s < 0 || !canonical.owned_by_max(col)) continue;
      const double scale = std::sqrt(rows[static_cast<std::size_t>(r)].compliance *
                                     rows[static_cast<std::size_t>(s)].compliance);
      right(s, r) += evaluation.jacobian[k] * step.v[col] / scale;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (right + right.transpose()),
                                                             Eigen::EigenvaluesOnly);
  const double least = eigen.eigenvalues()[0];
  if (least > parameter::kConfirmed) return SecondOrder::Satisfied;
  // What Max would gain of a constraint's violation by its Newton step in y.
  double gain = 0.0;
  for (Eigen::Index r = 0; r < size; ++r) {
    const ActiveRow& row = rows[static_cast<std::size_t>(r)];
    gain = std::max(gain, 0.5 * std::abs(iterate.lambda[row.constraint]) * row.compliance *
                              (1.0 - right(r, r)));
  }
  const bool violated = least < -1.0 && gain > parameter::kClearGain;
  return violated ? SecondOrder::Violated : SecondOrder::Undecided;
}

std::vector<Index> idle_copies(CanonicalProblem& canonical, const Iterate& iterate,
                               const Evaluation& evaluation) {
  if (canonical.robust_constraints().empty()) return {};
  Eigen::VectorXd lambda = iterate.lambda;
  std::vector<bool> inactive(static_cast<std::size_t>(canonical.constraints()), false);
  for (const Index j : canonical.robust_constraints()) inactive[static_cast<std::size_t>(j)] = true;
  for (const ActiveRow& row : active_rows(canonical, firm_curvature(canonical, iterate))) {
    inactive[static_cast<std::size_t>(row.constraint)] = false;
  }
  for (const Index j : canonical.robust_constraints()) {
    if (inactive[static_cast<std::size_t>(j)]) lambda[j] = 0.0;
  }
  Evaluation without = evaluation;
  if (canonical.second_derivatives(iterate.v, lambda, without) != EvaluationStatus::Ok) return {};

  std::vector<bool> idle(static_cast<std::size_t>(canonical.variables()), false);
  const auto jacobian = canonical.jacobian();
  for (const auto [row, col] : jacobian) {
    if (canonical.owned_by_max(col) && inactive[static_cast<std::size_t>(row)]) {
      idle[static_cast<std::size_t>(col)] = evaluation.gradient[col] == 0.0;
    }
  }
  for (const auto [row, col] : jacobian) {
    const bool other_min_row =
        canonical.min_constraints().contains(row) && !inactive[static_cast<std::size_t>(row)];
    if (other_min_row) idle[static_cast<std::size_t>(col)] = false;
  }
  for (std::size_t k = 0; k < without.hessian.size(); ++k) {
    if (without.hessian[k] == 0.0) continue;
    const auto [row, col] = canonical.hessian()[k];
    idle[static_cast<std::size_t>(row)] = idle[static_cast<std::size_t>(col)] = false;
  }
  std::vector<Index> variables;
  for (Index i = canonical.y().begin; i < canonical.y().end; ++i) {
    if (idle[static_cast<std::size_t>(i)]) variables.push_back(i);
  }
  return variables;
}

}  // namespace ipminmax
