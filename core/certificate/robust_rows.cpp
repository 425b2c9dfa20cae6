#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/certificate/parameters.hpp"
#include "core/certificate/robust_rows.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

/// Barrier curvatures at which active bounds hold firmly and others not at all. classes: of bounds
/// that hold however small their multipliers are; null: not known.
Eigen::VectorXd firm_curvature(const CanonicalProblem& canonical, const Iterate& iterate,
                               const BoundClasses* classes, const Units& units) {
  Eigen::VectorXd curvature = Eigen::VectorXd::Zero(canonical.variables());
  // Of a quadratic term that is one at one unit.
  const Eigen::VectorXd one = units.variable.cwiseAbs2().cwiseInverse();
  for (const IndexRange slacks : {canonical.x_slacks(), canonical.y_slacks()}) {
    for (Index i = slacks.begin; i < slacks.end; ++i) curvature[i] = parameter::kConstant * one[i];
  }
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    const double multiplier = multiplier_of(iterate, i, side);
    const bool holds = classes != nullptr && (*classes)[i] == BoundClass::Active &&
                       classes->side[static_cast<std::size_t>(i)] == side;
    if (holds || class_of(multiplier / one[i], distance, 1.0) == BoundClass::Active) {
      curvature[i] += parameter::kFirm * std::max(multiplier / distance, one[i]);
    }
  });
  return curvature;
}

struct ActiveRow {
  Index constraint;
  double compliance;  ///< D = s / z
};

std::vector<ActiveRow> active_rows(const CanonicalProblem& canonical, const Eigen::VectorXd& firm,
                                   const Units& units) {
  std::vector<ActiveRow> rows;
  for (const Index j : canonical.robust_constraints()) {
    const Index slack = canonical.slack_of(j);
    const double unit = units.variable[slack];
    if (firm[slack] * unit * unit >= parameter::kFirm)
      rows.push_back({j, parameter::kFirm / firm[slack]});
  }
  return rows;
}

/// I - D^(-1/2) T D^(-1/2), T_rs = -J_r K_yy^-1 J_s'; empty: no solution. K_yy is factorized.
std::optional<Eigen::MatrixXd> compliance_left(const CanonicalProblem& canonical, KktSystem& kkt,
                                               const Evaluation& evaluation,
                                               const std::vector<ActiveRow>& rows) {
  const auto size = static_cast<Eigen::Index>(rows.size());
  const auto jacobian = canonical.jacobian();
  // J_r over y, one column per row; rows of K_yy are found by the step's v. A copy maximizes its
  // own row: what the row still changes along it is the barrier's.
  const auto counts = [&](Index row, Index col) {
    const Index slack = canonical.slack_of(row);
    return canonical.owned_by_max(col) && canonical.served_slack(col) != slack;
  };
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
      if (column_of[static_cast<std::size_t>(row)] == r && counts(row, col)) {
        rhs.v[col] += evaluation.jacobian[k];
      }
    }
    if (!kkt.solve_inner(evaluation, rhs, step)) return std::nullopt;
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      const auto [row, col] = jacobian[k];
      const Eigen::Index s = column_of[static_cast<std::size_t>(row)];
      if (s < 0 || !counts(row, col)) continue;
      const double scale = std::sqrt(rows[static_cast<std::size_t>(r)].compliance *
                                     rows[static_cast<std::size_t>(s)].compliance);
      right(s, r) += evaluation.jacobian[k] * step.v[col] / scale;
    }
  }
  return 0.5 * (right + right.transpose());
}

}  // namespace

SecondOrder test_robust_rows(const CanonicalProblem& canonical, KktSystem& kkt, const Point& point,
                             const BoundClasses& classes, const Units& units,
                             const std::vector<Index>& idle, const Eigen::VectorXd& proximal) {
  if (canonical.robust_constraints().empty()) return SecondOrder::Satisfied;
  const Iterate& iterate = point.iterate;
  const Evaluation& evaluation = point.evaluation;
  Eigen::VectorXd firm = firm_curvature(canonical, iterate, &classes, units);
  for (const Index i : idle) firm[i] += parameter::kFirm / (units.variable[i] * units.variable[i]);
  const std::vector<ActiveRow> rows = active_rows(canonical, firm, units);
  if (rows.empty()) return SecondOrder::Satisfied;
  if (proximal.size() > 0) firm += proximal;
  kkt.assemble(evaluation, firm);
  if (!kkt.has_expected_inner_inertia(kkt.factorize_inner({}))) return SecondOrder::Undecided;

  const auto left = compliance_left(canonical, kkt, evaluation, rows);
  if (!left) return SecondOrder::Undecided;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(*left, Eigen::EigenvaluesOnly);
  const double least = eigen.eigenvalues()[0];
  if (least > parameter::kConfirmed) return SecondOrder::Satisfied;
  // What Max would gain of a constraint's violation by its Newton step in y.
  double gain = 0.0;
  for (Eigen::Index r = 0; r < left->rows(); ++r) {
    const ActiveRow& row = rows[static_cast<std::size_t>(r)];
    gain = std::max(gain, 0.5 * std::abs(iterate.lambda[row.constraint]) * row.compliance *
                              (1.0 - (*left)(r, r)));
  }
  const bool violated = least < -1.0 && gain > parameter::kHardly;
  return violated ? SecondOrder::Violated : SecondOrder::Undecided;
}

IdleCopies idle_copies(const CanonicalProblem& canonical, const Iterate& iterate,
                       const Units& units) {
  if (!canonical.has_copies()) return {};
  std::vector<bool> active(static_cast<std::size_t>(canonical.variables()), false);
  const Eigen::VectorXd firm = firm_curvature(canonical, iterate, nullptr, units);
  for (const ActiveRow& row : active_rows(canonical, firm, units)) {
    const Index slack = canonical.slack_of(row.constraint);
    active[static_cast<std::size_t>(slack)] = true;
  }
  const auto serves_inactive = [&](Index slack) {
    return slack >= 0 && !active[static_cast<std::size_t>(slack)];
  };
  IdleCopies idle;
  for (Index i = canonical.y().begin; i < canonical.y().end; ++i) {
    if (serves_inactive(canonical.served_slack(i))) idle.variables.push_back(i);
  }
  if (idle.variables.empty()) return {};
  for (Index j = 0; j < canonical.constraints(); ++j) {
    idle.rows.push_back(serves_inactive(canonical.slack_served_by_constraint(j)));
  }
  return idle;
}

}  // namespace ipminmax
