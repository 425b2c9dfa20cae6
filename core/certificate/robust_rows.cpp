#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/certificate/trial.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

/// Barrier curvatures at which active bounds hold firmly and others not at all. set: of bounds that
/// hold however small their multipliers are; null: not known.
Vector firm_curvature(const CanonicalProblem& canonical, const Iterate& iterate,
                      const ActiveBounds* set, const VariableScaling& scaling) {
  Vector curvature = Vector::Zero(canonical.variables());
  // Of a quadratic term that is one at one scaled unit.
  const Vector one = scaling.variable.cwiseAbs2().cwiseInverse();
  for (const IndexRange slacks : {canonical.x_slacks(), canonical.y_slacks()}) {
    for (const Index i : indices(slacks)) curvature[i] = kConstant * one[i];
  }
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    const double multiplier = multiplier_of(iterate, i, side);
    const bool holds = set != nullptr && (*set)[i] == BoundClass::Active && set->side_of(i) == side;
    if (holds || class_of(multiplier / one[i], distance, 1.0) == BoundClass::Active)
      curvature[i] += kFirm * std::max(multiplier / distance, one[i]);
  });
  return curvature;
}

struct ActiveRow {
  Index constraint;
  double compliance;  ///< D = s / z
};

std::vector<ActiveRow> active_rows(const CanonicalProblem& canonical, const Vector& firm,
                                   const VariableScaling& scaling) {
  std::vector<ActiveRow> rows;
  for (const Index j : canonical.robust_constraints()) {
    const Index slack = canonical.slack_of(j);
    const double unit = scaling.variable[slack];
    if (firm[slack] * unit * unit >= kFirm) rows.push_back({j, kFirm / firm[slack]});
  }
  return rows;
}

/// The robust rows' Schur complement I - D^(-1/2) T D^(-1/2), T_rs = -J_r K_yy^-1 J_s'; empty: no
/// solution. K_yy is factorized.
std::optional<Eigen::MatrixXd> schur_complement(const CanonicalProblem& canonical, KktSystem& kkt,
                                                const Evaluation& evaluation,
                                                const std::vector<ActiveRow>& rows) {
  const auto size = static_cast<Index>(rows.size());
  std::vector<Index> column_of(at(canonical.constraints()), -1);
  for (Index r = 0; r < size; ++r) column_of[at(rows[at(r)].constraint)] = r;
  // J_r over y; rows of K_yy are found by the step's v. A copy maximizes its own row: what the row
  // still changes along it is the barrier's.
  const auto for_each = [&](auto&& visit) {
    for_each_in_jacobian(canonical, evaluation, [&](Index row, Index col, double value) {
      if (column_of[at(row)] >= 0 && canonical.owned_by_max(col) &&
          canonical.robust_slack(col) != canonical.slack_of(row)) {
        visit(column_of[at(row)], col, value);
      }
    });
  };
  Eigen::MatrixXd right = Eigen::MatrixXd::Identity(size, size);
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  for (Index r = 0; r < size; ++r) {
    rhs.v.setZero();
    for_each([&](Index s, Index col, double value) {
      if (s == r) rhs.v[col] += value;
    });
    if (!kkt.solve_inner(evaluation, rhs, step)) return std::nullopt;
    for_each([&](Index s, Index col, double value) {
      right(s, r) +=
          value * step.v[col] / std::sqrt(rows[at(r)].compliance * rows[at(s)].compliance);
    });
  }
  return 0.5 * (right + right.transpose());
}

}  // namespace

SecondOrder test_robust_rows(TestContext& c, const TrialPoint& trial, const Point& point) {
  if (c.canonical.robust_constraints().empty()) return SecondOrder::Satisfied;
  const Vector& length = trial.scaling.variable;
  Vector firm = firm_curvature(c.canonical, point.iterate, &trial.set, trial.scaling);
  for (const Index i : trial.inactive.variables) firm[i] += kFirm / (length[i] * length[i]);
  const std::vector<ActiveRow> rows = active_rows(c.canonical, firm, trial.scaling);
  if (rows.empty()) return SecondOrder::Satisfied;
  const IndexRange y = c.canonical.y();
  firm.segment(y.begin, y.size()) +=
      trial.proximal * length.segment(y.begin, y.size()).cwiseAbs2().cwiseInverse();
  c.kkt.assemble(point.evaluation, firm);
  if (!c.kkt.has_expected_inner_inertia(c.kkt.factorize_inner({}))) return SecondOrder::Undecided;

  const auto left = schur_complement(c.canonical, c.kkt, point.evaluation, rows);
  if (!left) return SecondOrder::Undecided;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(*left, Eigen::EigenvaluesOnly);
  const double least = eigen.eigenvalues()[0];
  if (least > kConfirmed) return SecondOrder::Satisfied;
  // What Max would gain of a constraint's violation by its Newton step in y.
  double gain = 0.0;
  for (const auto r : indices(rows)) {
    const auto k = static_cast<Index>(r);
    gain = std::max(gain, 0.5 * std::abs(point.iterate.lambda[rows[r].constraint]) *
                              rows[r].compliance * (1.0 - (*left)(k, k)));
  }
  return least < -1.0 && gain > kNegligible ? SecondOrder::Violated : SecondOrder::Undecided;
}

InactiveCopies inactive_copies(const CanonicalProblem& canonical, const Iterate& iterate,
                               const VariableScaling& scaling) {
  if (!canonical.has_copies()) return {};
  std::vector<bool> active(at(canonical.variables()), false);
  const Vector firm = firm_curvature(canonical, iterate, nullptr, scaling);
  for (const ActiveRow& row : active_rows(canonical, firm, scaling))
    active[at(canonical.slack_of(row.constraint))] = true;
  const auto is_inactive = [&](Index slack) { return slack >= 0 && !active[at(slack)]; };
  InactiveCopies inactive;
  for (const Index i : indices(canonical.y())) {
    if (is_inactive(canonical.robust_slack(i))) inactive.variables.push_back(i);
  }
  for (Index j = 0; j < canonical.constraints() && !inactive.variables.empty(); ++j)
    inactive.rows.push_back(is_inactive(canonical.robust_slack_of_constraint(j)));
  return inactive;
}

}  // namespace ipminmax
