#include "core/certificate/units.hpp"

#include <algorithm>
#include <utility>

#include "core/certificate/parameters.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

namespace parameter = parameters::certificate;

constexpr double kUnknown = 0.0;
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

/// From diagonal entries, and of the second player from what couples him to the first: the
/// maximizer's answer makes of it W_xy^2 / W_yy, which is curvature of x as well.
void start_block(const CanonicalProblem& canonical, bool max, bool second, UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  Eigen::VectorXd& diagonal = arrays.diagonal;
  diagonal.setZero(d.size());
  for (const auto& [i, j, size] : arrays.own) {
    if (i == j) diagonal[i] += size;
  }
  Eigen::VectorXd& coupling = arrays.coupling;
  coupling.setZero(d.size());
  if (second) {
    for (const auto& [i, j, size] : arrays.mixed) include(i, j, size, d, coupling);
  }
  for (Index i = 0; i < d.size(); ++i) {
    if (canonical.owned_by_max(i) == max) {
      d[i] = inverse(std::max(std::sqrt(diagonal[i]), coupling[i]));
    }
  }
}

/// The block of one player: diagonal entries first, then rows without one.
void equilibrate_block(const CanonicalProblem& canonical, const Evaluation& evaluation, bool max,
                       bool second, UnitsArrays& arrays) {
  Eigen::VectorXd& d = arrays.units.variable;
  Eigen::VectorXd& norms = arrays.norms;
  take_entries(canonical, evaluation, max, arrays);
  start_block(canonical, max, second, arrays);
  // Nothing but products, x_1 x_2: in proportion to their sizes.
  for (const auto& [i, j, entry] : arrays.own) {
    if (d[i] == kUnknown && d[j] == kUnknown) {
      const double both = inverse(std::sqrt(entry * arrays.size_of(i) * arrays.size_of(j)));
      d[i] = arrays.size_of(i) * both;
      d[j] = arrays.size_of(j) * both;
    } else if (d[i] == kUnknown || d[j] == kUnknown) {
      (d[i] == kUnknown ? d[i] : d[j]) = inverse(entry * std::max(d[i], d[j]));
    }
  }
  for (int sweep = 0; sweep < parameter::kFew; ++sweep) {
    own_norms(arrays, d, norms);
    if (!(norms.size() > 0 && norms.maxCoeff() > 1.0)) break;
    d.array() /= norms.array().max(1.0).sqrt();
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
  const auto jacobian = canonical.jacobian();
  Eigen::VectorXd &rows = arrays.rows, &columns = arrays.columns;
  rows.setZero(canonical.constraints());
  // An entry counts in the norm of its row once its column is known.
  const auto is_counted = [&](const UnitsArrays::Entry& entry) {
    rows[entry.row] = std::max(rows[entry.row], entry.size * d[entry.col]);
    return d[entry.col] != kUnknown;
  };
  arrays.open.clear();
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = jacobian[k];
    const UnitsArrays::Entry entry{row, col, std::abs(evaluation.jacobian[k])};
    if (!is_counted(entry)) arrays.open.push_back(entry);
  }
  for (int round = 0; round < parameter::kMany && !arrays.open.empty(); ++round) {
    columns.setZero(d.size());
    for (const auto& [row, col, entry] : arrays.open) {
      if (rows[row] > 0.0) columns[col] = std::max(columns[col], entry / rows[row]);
    }
    bool found = false;
    for (Index i = 0; i < d.size(); ++i) {
      if (columns[i] == 0.0) continue;
      d[i] = inverse(columns[i]);
      found = found || d[i] != kUnknown;
      if (d[i] != kUnknown) d[i] = std::max(d[i], size[i]);
    }
    if (!found) break;
    std::erase_if(arrays.open, is_counted);
  }
  for (double& value : d) {
    if (value == kUnknown) value = 1.0;
  }
}

void include(double term, Index variable, UnitsArrays::Terms& terms) {
  if (term > terms.largest) {
    terms = {.largest = term, .second = terms.largest, .variable = variable};
  } else {
    terms.second = std::max(terms.second, term);
  }
}

/// What cut_by_equations does in one equation, which then has no terms any more. False: nothing.
bool cut_by_equation(const CanonicalProblem& canonical, Index row, UnitsArrays& arrays) {
  const auto [largest, second, i] = arrays.terms[at(row)];
  if (!(second > 0.0) || parameter::kLittle * largest <= second) return false;
  if (canonical.owned_by_max(i) != canonical.max_constraints().contains(row)) return false;
  double& length = arrays.units.variable[i];
  length = std::min(length, std::max(length * second / largest, arrays.size[i]));
  arrays.terms[at(row)] = {};
  return true;
}

/// An equation ties its owner's variables to others: a length beside which those are nothing is cut
/// to what they can make up for, or to the variable's own size. Each equation cuts one length, as
/// it determines one variable.
void cut_by_equations(const CanonicalProblem& canonical, const Evaluation& evaluation,
                      UnitsArrays& arrays) {
  const auto jacobian = canonical.jacobian();
  arrays.open.clear();
  for (std::size_t k = 0; k < jacobian.size(); ++k) {  // inequalities cut nothing
    const auto [row, col] = jacobian[k];
    if (canonical.slack_of(row) < 0)
      arrays.open.push_back({row, col, std::abs(evaluation.jacobian[k])});
  }
  bool any = true;
  for (int round = 0; any && round < parameter::kMany; ++round) {
    arrays.terms.assign(at(canonical.constraints()), {});
    for (const auto& [row, col, size] : arrays.open) {
      include(size * arrays.units.variable[col], col, arrays.terms[at(row)]);
    }
    any = false;
    for (Index j = 0; j < canonical.constraints(); ++j) {
      any = cut_by_equation(canonical, j, arrays) || any;
    }
    // Of those that have cut, and of rows without terms
    std::erase_if(arrays.open, [&](const UnitsArrays::Entry& entry) {
      return arrays.terms[at(entry.row)].variable < 0;
    });
  }
}

/// Rows of length about one, and slacks of their length.
void measure_rows(const CanonicalProblem& canonical, const Evaluation& evaluation, Units& units,
                  Eigen::VectorXd& norms) {
  constraint_norms(canonical, evaluation, units.variable, norms);
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const double unit = inverse(norms[j]);
    units.constraint[j] = unit == kUnknown ? 1.0 : unit;
    if (canonical.slack_of(j) >= 0)
      units.variable[canonical.slack_of(j)] = 1.0 / units.constraint[j];
  }
}

}  // namespace

Units units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
               const Evaluation& evaluation, LengthRules rules) {
  UnitsArrays arrays;
  units_of(canonical, v, evaluation, arrays, rules);
  return std::move(arrays.units);
}

const Units& units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                      const Evaluation& evaluation, UnitsArrays& arrays, LengthRules rules) {
  Units& units = arrays.units;
  units.variable.setConstant(canonical.variables(), kUnknown);
  units.constraint.setOnes(canonical.constraints());
  arrays.size = v.cwiseAbs().cwiseMax(canonical.starting_point().v.cwiseAbs());
  equilibrate_block(canonical, evaluation, !rules.min_first, false, arrays);
  equilibrate_block(canonical, evaluation, rules.min_first, true, arrays);
  spread_by_constraints(canonical, evaluation, arrays);
  cut_by_equations(canonical, evaluation, arrays);
  measure_rows(canonical, evaluation, units, arrays.rows);
  return units;
}

double own_size(const CanonicalProblem& canonical, double v, Index i, const Units& units) {
  const double start = canonical.starting_point().v[i], unit = units.variable[i];
  const double size = std::max(std::abs(v), std::abs(start));
  const double width = canonical.upper()[i] - canonical.lower()[i];
  return std::min({size > 0.0 ? size : unit, width, std::max(std::abs(v - start), unit)});
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
