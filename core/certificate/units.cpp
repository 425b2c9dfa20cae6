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

/// Entries of W in the rows of one player: those between his own variables, and those with others.
void take_entries(const CanonicalProblem& canonical, const Evaluation& evaluation, bool max,
                  UnitsArrays& arrays) {
  arrays.own.clear();
  arrays.mixed.clear();
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    const bool row = canonical.owned_by_max(i) == max, col = canonical.owned_by_max(j) == max;
    const double size = std::abs(evaluation.hessian[k]);
    if (row && col) {
      arrays.own.push_back({i, j, size});
    } else if (row) {
      arrays.mixed.push_back({i, j, size});
    } else if (col) {
      arrays.mixed.push_back({j, i, size});
    }
  }
}

/// Largest |W_ik| d_i d_k of a row; d_i = 1 where unknown, entries with an unknown d_k left out.
void include(Index row, Index col, double size, const Eigen::VectorXd& d, Eigen::VectorXd& norms) {
  norms[row] = std::max(norms[row], size * (d[row] == kUnknown ? 1.0 : d[row]) * d[col]);
}

/// The same of all rows of the player, in his own columns.
void own_norms(const UnitsArrays& arrays, const Eigen::VectorXd& d, Eigen::VectorXd& norms) {
  norms.setZero(d.size());
  for (const auto& [i, j, size] : arrays.own) {
    include(i, j, size, d, norms);
    include(j, i, size, d, norms);
  }
}

/// Where a coupling of two variables of one player exceeds 1, a small diagonal entry has given one
/// of them too much: the one whose length is the larger beside the variable's own size.
void cut_longer_of_pairs(UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  const Eigen::VectorXd& size = arrays.size;
  Eigen::VectorXd& cut = arrays.cut;
  cut.setOnes(d.size());
  for (const auto& [i, j, value] : arrays.own) {
    if (i == j) continue;
    const double entry = value * d[i] * d[j];
    if (!(entry > 1.0) || size[i] == 0.0 || size[j] == 0.0) continue;
    const double ratio = (d[i] / size[i]) / (d[j] / size[j]);
    if (ratio > 1.0) cut[i] = std::max(cut[i], std::min(entry, ratio));
    if (ratio < 1.0) cut[j] = std::max(cut[j], std::min(entry, 1.0 / ratio));
  }
  d.array() /= cut.array();
}

/// From diagonal entries, and what the maximizer's answer makes of a coupling, W_xy^2 / W_yy, which
/// is curvature of x as well.
void start_block(const CanonicalProblem& canonical, bool max, const Eigen::VectorXd& answers,
                 UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  Eigen::VectorXd& diagonal = arrays.diagonal;
  diagonal.setZero(d.size());
  for (const auto& [i, j, size] : arrays.own) {
    if (i == j) diagonal[i] += size;
  }
  Eigen::VectorXd& coupling = arrays.coupling;
  coupling.setZero(d.size());
  if (!max && answers.size() > 0) coupling = answers.cwiseSqrt();
  if (!max && answers.size() == 0) {
    for (const auto& [i, j, size] : arrays.mixed) include(i, j, size, d, coupling);
  }
  for (Index i = 0; i < d.size(); ++i) {
    if (canonical.owned_by_max(i) == max) {
      d[i] = inverse(std::max(std::sqrt(diagonal[i]), coupling[i]));
    }
  }
}

/// The block of one player: diagonal entries first, then rows without one by what couples them.
void equilibrate_block(const CanonicalProblem& canonical, const Evaluation& evaluation, bool max,
                       const Eigen::VectorXd& answers, UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  Eigen::VectorXd& norms = arrays.norms;
  take_entries(canonical, evaluation, max, arrays);
  start_block(canonical, max, answers, arrays);
  const auto is_open = [&](const UnitsArrays::Entry& entry) {
    return d[entry.row] == kUnknown || d[entry.col] == kUnknown;
  };
  for (int round = 0; round < kRounds && std::ranges::any_of(arrays.own, is_open); ++round) {
    own_norms(arrays, d, norms);
    bool found = false;
    for (Index i = 0; i < d.size(); ++i) {
      if (d[i] != kUnknown || norms[i] == 0.0) continue;
      d[i] = inverse(norms[i]);
      found = true;
    }
    if (!found) break;
  }
  // Nothing but products: x_1 x_2.
  for (const auto& [i, j, size] : arrays.own) {
    if (d[i] != kUnknown && d[j] != kUnknown) continue;
    const double half = inverse(std::sqrt(size));
    for (const Index m : {i, j}) {
      if (d[m] == kUnknown) d[m] = half;
    }
  }
  cut_longer_of_pairs(arrays);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    own_norms(arrays, d, norms);
    bool cut = false;
    for (Index i = 0; i < d.size(); ++i) {
      if (!(norms[i] > 1.0)) continue;
      d[i] /= std::sqrt(norms[i]);
      cut = true;
    }
    if (!cut) break;
  }
}

/// Variables without curvature from the other player's, whose lengths are known; two that are both
/// without share the coupling in proportion to their sizes.
void measure_by_coupling(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  Eigen::VectorXd &known = arrays.norms, &unknown = arrays.coupling;
  known.setZero(d.size());
  unknown.setZero(d.size());
  const auto size = [&](Index i) { return arrays.size[i] > 0.0 ? arrays.size[i] : 1.0; };
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (canonical.owned_by_max(i) == canonical.owned_by_max(j)) continue;
    const double entry = std::abs(evaluation.hessian[k]);
    for (const auto& [row, col] : {std::pair{i, j}, std::pair{j, i}}) {
      if (d[row] != kUnknown) continue;
      if (d[col] != kUnknown) known[row] = std::max(known[row], entry * d[col]);
      if (d[col] == kUnknown) unknown[row] = std::max(unknown[row], entry * size(i) * size(j));
    }
  }
  for (Index i = 0; i < d.size(); ++i) {
    if (d[i] != kUnknown) continue;
    d[i] = known[i] > 0.0 ? inverse(known[i]) : size(i) * inverse(std::sqrt(unknown[i]));
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
  const auto is_open = [&](const Triplet& entry) { return d[entry.col] == kUnknown; };
  for (int round = 0; round < kRounds && std::ranges::any_of(canonical.jacobian(), is_open);
       ++round) {
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

/// The Jacobian's entries row by row, and the rows that each variable is in.
void index_jacobian(const CanonicalProblem& canonical, UnitsArrays& arrays) {
  const auto jacobian = canonical.jacobian();
  const auto sort = [&](Index buckets, auto&& bucket_of, auto&& item_of,
                        UnitsArrays::Lists& lists) {
    lists.starts.assign(at(buckets) + 1, 0);
    for (const Triplet& entry : jacobian) ++lists.starts[at(bucket_of(entry)) + 1];
    for (std::size_t b = 1; b < lists.starts.size(); ++b) lists.starts[b] += lists.starts[b - 1];
    arrays.next = lists.starts;
    lists.items.resize(jacobian.size());
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      lists.items[at(arrays.next[at(bucket_of(jacobian[k]))]++)] = item_of(k);
    }
  };
  sort(
      canonical.constraints(), [](const Triplet& entry) { return entry.row; },
      [](std::size_t k) { return static_cast<Index>(k); }, arrays.entries_of_row);
  sort(
      canonical.variables(), [](const Triplet& entry) { return entry.col; },
      [&](std::size_t k) { return jacobian[k].row; }, arrays.rows_of_column);
}

void include(double term, Index variable, UnitsArrays::Terms& terms) {
  if (term > terms.largest) {
    terms = {.largest = term, .second = terms.largest, .variable = variable};
  } else {
    terms.second = std::max(terms.second, term);
  }
}

/// What cut_by_equations does in one equation. False: nothing.
bool cut_by_equation(const CanonicalProblem& canonical, Index row, UnitsArrays& arrays) {
  const auto& [largest, second, i] = arrays.terms[at(row)];
  if (!(second > 0.0) || largest <= kMostCompensated * second) return false;
  if (canonical.owned_by_max(i) != canonical.max_constraints().contains(row)) return false;
  double& length = arrays.units.variable[i];
  length = std::min(length, std::max(length * second / largest, arrays.size[i]));
  arrays.used[at(row)] = true;
  arrays.cut_columns.push_back(i);
  return true;
}

/// After a round: equations that have not cut, and whose terms have changed.
void find_changed_rows(UnitsArrays& arrays) {
  arrays.changed_rows.clear();
  for (const Index i : arrays.cut_columns) {
    const auto& [starts, rows] = arrays.rows_of_column;
    for (Index p = starts[at(i)]; p < starts[at(i) + 1]; ++p) {
      if (const Index row = rows[at(p)]; !arrays.used[at(row)]) arrays.changed_rows.push_back(row);
    }
  }
  std::ranges::sort(arrays.changed_rows);
  const auto last = std::unique(arrays.changed_rows.begin(), arrays.changed_rows.end());
  arrays.changed_rows.erase(last, arrays.changed_rows.end());
  arrays.cut_columns.clear();
}

/// An equation ties its owner's variables to others: a length beside which those are nothing is cut
/// to what they can make up for, or to the variable's own size. Each equation cuts one length, as
/// it determines one variable.
void cut_by_equations(const CanonicalProblem& canonical, const Evaluation& evaluation,
                      UnitsArrays& arrays) {
  const Eigen::VectorXd& d = arrays.units.variable;
  const auto jacobian = canonical.jacobian();
  const auto slack_of = canonical.slack_of_constraint();
  const Index constraints = canonical.constraints();
  arrays.used.assign(at(constraints), false);  // inequalities cut nothing
  for (Index j = 0; j < constraints; ++j) arrays.used[at(j)] = slack_of[at(j)] >= 0;
  arrays.terms.assign(at(constraints), {});
  const auto term = [&](std::size_t k) {
    return std::abs(evaluation.jacobian[k]) * d[jacobian[k].col];
  };
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = jacobian[k];
    if (!arrays.used[at(row)]) include(term(k), col, arrays.terms[at(row)]);
  }
  arrays.cut_columns.clear();
  bool any = false;
  for (Index j = 0; j < constraints; ++j) {
    if (!arrays.used[at(j)]) any = cut_by_equation(canonical, j, arrays) || any;
  }
  if (any) index_jacobian(canonical, arrays);
  for (int round = 1; any && round < kRounds; ++round) {
    find_changed_rows(arrays);
    for (const Index row : arrays.changed_rows) {
      arrays.terms[at(row)] = {};
      const auto& [starts, entries] = arrays.entries_of_row;
      for (Index p = starts[at(row)]; p < starts[at(row) + 1]; ++p) {
        const auto k = at(entries[at(p)]);
        include(term(k), jacobian[k].col, arrays.terms[at(row)]);
      }
    }
    any = false;
    for (const Index row : arrays.changed_rows)
      any = cut_by_equation(canonical, row, arrays) || any;
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
               const Evaluation& evaluation, const Eigen::VectorXd& answers, bool by_coupling) {
  UnitsArrays arrays;
  units_of(canonical, v, evaluation, answers, arrays, by_coupling);
  return std::move(arrays.units);
}

const Units& units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                      const Evaluation& evaluation, const Eigen::VectorXd& answers,
                      UnitsArrays& arrays, bool by_coupling) {
  Units& units = arrays.units;
  units.variable.setConstant(canonical.variables(), kUnknown);
  units.constraint.setOnes(canonical.constraints());
  arrays.size = v.cwiseAbs().cwiseMax(canonical.starting_point().v.cwiseAbs());
  equilibrate_block(canonical, evaluation, true, answers, arrays);
  equilibrate_block(canonical, evaluation, false, answers, arrays);
  if (by_coupling) measure_by_coupling(canonical, evaluation, arrays);
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
