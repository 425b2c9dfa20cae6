#include "core/certificate/units.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ipminmax {
namespace {

constexpr double kUnknown = 0.0;
/// Rounds in which units spread from variable to variable.
constexpr int kRounds = 16;
constexpr int kSweeps = 4;
/// Term of one variable in an equation over the largest of the others.
constexpr double kMostCompensated = 10.0;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// 1 / norm; unknown for zero and for what would leave the range of numbers.
double inverse(double norm) { return norm > 1e-150 && norm < 1e150 ? 1.0 / norm : kUnknown; }

/// Largest |W_ik| d_i d_k per row of one player; d_i = 1 where unknown, entries with an unknown d_k
/// left out. Of the other player's columns: with_others.
class RowNorms {
 public:
  RowNorms(const CanonicalProblem& canonical, const Evaluation& evaluation, bool max)
      : canonical_(canonical), evaluation_(evaluation), max_(max) {}

  void operator()(const Eigen::VectorXd& d, bool own_columns, Eigen::VectorXd& norms) const {
    norms.setZero(d.size());
    for (std::size_t k = 0; k < evaluation_.hessian.size(); ++k) {
      const auto [i, j] = canonical_.hessian()[k];
      const double value = std::abs(evaluation_.hessian[k]);
      include(i, j, value, d, own_columns, norms);
      include(j, i, value, d, own_columns, norms);
    }
  }

 private:
  void include(Index row, Index col, double value, const Eigen::VectorXd& d, bool own_columns,
               Eigen::VectorXd& norms) const {
    if (canonical_.owned_by_max(row) != max_) return;
    if ((canonical_.owned_by_max(col) == max_) != own_columns) return;
    norms[row] = std::max(norms[row], value * (d[row] == kUnknown ? 1.0 : d[row]) * d[col]);
  }

  const CanonicalProblem& canonical_;
  const Evaluation& evaluation_;
  const bool max_;
};

/// Where a coupling of two variables of one player exceeds 1, a small diagonal entry has given one
/// of them too much: the one whose length is the larger beside the variable's own size.
void cut_longer_of_pairs(const CanonicalProblem& canonical, const Evaluation& evaluation, bool max,
                         UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  const Eigen::VectorXd& size = arrays.size;
  Eigen::VectorXd& cut = arrays.cut;
  cut.setOnes(d.size());
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (i == j || canonical.owned_by_max(i) != max || canonical.owned_by_max(j) != max) continue;
    const double entry = std::abs(evaluation.hessian[k]) * d[i] * d[j];
    if (!(entry > 1.0) || size[i] == 0.0 || size[j] == 0.0) continue;
    const double ratio = (d[i] / size[i]) / (d[j] / size[j]);
    if (ratio > 1.0) cut[i] = std::max(cut[i], std::min(entry, ratio));
    if (ratio < 1.0) cut[j] = std::max(cut[j], std::min(entry, 1.0 / ratio));
  }
  d.array() /= cut.array();
}

/// The block of one player: diagonal entries first, then rows without one by what couples them.
void equilibrate_block(const CanonicalProblem& canonical, const Evaluation& evaluation, bool max,
                       const Eigen::VectorXd& answers, UnitsArrays& arrays) {
  const RowNorms row_norms(canonical, evaluation, max);
  Eigen::VectorXd& d = arrays.units.variable;
  Eigen::VectorXd& norms = arrays.norms;
  Eigen::VectorXd& diagonal = arrays.diagonal;
  diagonal.setZero(d.size());
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (i == j) diagonal[i] += std::abs(evaluation.hessian[k]);
  }
  // What the maximizer's answer makes of a coupling, W_xy^2 / W_yy, is curvature of x as well.
  Eigen::VectorXd& coupling = arrays.coupling;
  coupling.setZero(d.size());
  if (!max && answers.size() > 0) coupling = answers.cwiseSqrt();
  if (!max && answers.size() == 0) row_norms(d, false, coupling);
  for (Index i = 0; i < d.size(); ++i) {
    if (canonical.owned_by_max(i) == max) {
      d[i] = inverse(std::max(std::sqrt(diagonal[i]), coupling[i]));
    }
  }
  for (int round = 0; round < kRounds; ++round) {
    row_norms(d, true, norms);
    bool found = false;
    for (Index i = 0; i < d.size(); ++i) {
      if (d[i] != kUnknown || norms[i] == 0.0) continue;
      d[i] = inverse(norms[i]);
      found = true;
    }
    if (!found) break;
  }
  // Nothing but products: x_1 x_2.
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (canonical.owned_by_max(i) != max || canonical.owned_by_max(j) != max) continue;
    const double half = inverse(std::sqrt(std::abs(evaluation.hessian[k])));
    for (const Index m : {i, j}) {
      if (d[m] == kUnknown) d[m] = half;
    }
  }
  cut_longer_of_pairs(canonical, evaluation, max, arrays);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    row_norms(d, true, norms);
    for (Index i = 0; i < d.size(); ++i) {
      if (norms[i] > 1.0) d[i] /= std::sqrt(norms[i]);
    }
  }
}

/// Shorter lengths of y where W_xy exceeds 1.
void cut_coupling(const CanonicalProblem& canonical, const Evaluation& evaluation,
                  Eigen::VectorXd& d) {
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    auto [i, j] = canonical.hessian()[k];
    if (canonical.owned_by_max(i) == canonical.owned_by_max(j)) continue;
    if (canonical.owned_by_max(i)) std::swap(i, j);
    const double entry = std::abs(evaluation.hessian[k]) * d[i] * d[j];
    if (entry > 1.0) d[j] /= entry;
  }
}

/// Largest |J_ji| d_i of each row, unknown ones left out.
void constraint_norms(const CanonicalProblem& canonical, const Evaluation& evaluation,
                      const Eigen::VectorXd& d, Eigen::VectorXd& norms) {
  norms.setZero(canonical.constraints());
  for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    norms[row] = std::max(norms[row], std::abs(evaluation.jacobian[k]) * d[col]);
  }
}

/// Variables without curvature, from the constraints that tie them to others, but no less than
/// their own size: a short one comes from an entry that vanishes.
void spread_by_constraints(const CanonicalProblem& canonical, const Evaluation& evaluation,
                           UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  const Eigen::VectorXd& size = arrays.size;
  Eigen::VectorXd &rows = arrays.rows, &columns = arrays.columns;
  for (int round = 0; round < kRounds; ++round) {
    constraint_norms(canonical, evaluation, d, rows);
    columns.setZero(d.size());
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
      if (d[i] != kUnknown) d[i] = std::max(d[i], size[i]);
    }
    if (!found) break;
  }
  for (double& value : d) {
    if (value == kUnknown) value = 1.0;
  }
}

/// An equation ties its owner's variables to others: a length beside which those are nothing is cut
/// to what they can make up for, or to the variable's own size. Each equation cuts one length, as
/// it determines one variable.
void cut_by_equations(const CanonicalProblem& canonical, const Evaluation& evaluation,
                      UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  const auto slack_of = canonical.slack_of_constraint();
  std::vector<bool>& used = arrays.used;
  used.assign(at(canonical.constraints()), false);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<UnitsArrays::Terms>& rows = arrays.terms;
    rows.assign(used.size(), {});
    for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
      const auto [row, col] = canonical.jacobian()[k];
      if (used[at(row)] || slack_of[at(row)] >= 0) continue;
      UnitsArrays::Terms& terms = rows[at(row)];
      const double term = std::abs(evaluation.jacobian[k]) * d[col];
      if (term > terms.largest) {
        terms = {.largest = term, .second = terms.largest, .variable = col};
      } else {
        terms.second = std::max(terms.second, term);
      }
    }
    bool any = false;
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const auto& [largest, second, i] = rows[j];
      if (!(second > 0.0) || largest <= kMostCompensated * second) continue;
      const bool of_max = canonical.max_constraints().contains(static_cast<Index>(j));
      if (canonical.owned_by_max(i) != of_max) continue;
      d[i] = std::min(d[i], std::max(d[i] * second / largest, arrays.size[i]));
      used[j] = any = true;
    }
    if (!any) break;
  }
}

/// Rows of length about one, and slacks of their length.
void measure_rows(const CanonicalProblem& canonical, const Evaluation& evaluation, Units& units,
                  Eigen::VectorXd& norms) {
  constraint_norms(canonical, evaluation, units.variable, norms);
  const auto slack_of = canonical.slack_of_constraint();
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const double unit = inverse(norms[j]);
    units.constraint[j] = unit == kUnknown ? 1.0 : unit;
    if (slack_of[at(j)] >= 0) units.variable[slack_of[at(j)]] = 1.0 / units.constraint[j];
  }
}

}  // namespace

Units units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
               const Evaluation& evaluation, const Eigen::VectorXd& answers) {
  UnitsArrays arrays;
  units_of(canonical, v, evaluation, answers, arrays);
  return std::move(arrays.units);
}

const Units& units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                      const Evaluation& evaluation, const Eigen::VectorXd& answers,
                      UnitsArrays& arrays) {
  Units& units = arrays.units;
  units.variable.setConstant(canonical.variables(), kUnknown);
  units.constraint.setOnes(canonical.constraints());
  arrays.size = v.cwiseAbs().cwiseMax(canonical.starting_point().v.cwiseAbs());
  equilibrate_block(canonical, evaluation, true, answers, arrays);
  equilibrate_block(canonical, evaluation, false, answers, arrays);
  if (answers.size() > 0) cut_coupling(canonical, evaluation, units.variable);
  spread_by_constraints(canonical, evaluation, arrays);
  cut_by_equations(canonical, evaluation, arrays);
  measure_rows(canonical, evaluation, units, arrays.rows);
  return units;
}

Units stretched(const CanonicalProblem& canonical, const Evaluation& evaluation, Units units,
                const Eigen::VectorXd& factors) {
  for (const IndexRange own : {canonical.x(), canonical.y()}) {
    for (Index i = own.begin; i < own.end; ++i) units.variable[i] *= factors[i];
  }
  Eigen::VectorXd norms;
  measure_rows(canonical, evaluation, units, norms);
  return units;
}

double longest(const CanonicalProblem& canonical, const Eigen::VectorXd& v, const Units& units) {
  double size = 0.0;
  for (const IndexRange own : {canonical.x(), canonical.y()}) {
    for (Index i = own.begin; i < own.end; ++i) {
      size = std::max(size, std::abs(v[i]) / units.variable[i]);
    }
  }
  return size;
}

double size_of_problem(const CanonicalProblem& canonical, const Iterate& iterate,
                       const Units& units) {
  return std::max(longest(canonical, iterate.v, units),
                  longest(canonical, canonical.starting_point().v, units));
}

void set_in_units(const CanonicalProblem& canonical, const Evaluation& evaluation,
                  const Units& units, Evaluation& scaled) {
  scaled = evaluation;
  scaled.jacobian_call = scaled.hessian_call = 0;
  for (std::size_t k = 0; k < scaled.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    scaled.hessian[k] *= units.variable[i] * units.variable[j];
  }
  for (std::size_t k = 0; k < scaled.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    scaled.jacobian[k] *= units.constraint[row] * units.variable[col];
  }
}

}  // namespace ipminmax
