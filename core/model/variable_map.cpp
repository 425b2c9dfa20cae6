#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <utility>

#include "core/model/indices.hpp"
#include "core/model/variable_map.hpp"
#include "linalg/array.hpp"

namespace ipminmax {
namespace {

bool has_equal_bounds(const ProblemStructure& s, Index i) {
  return s.variable_lower[at(i)] == s.variable_upper[at(i)];
}

}  // namespace

bool is_fixed_by_constraint(const ProblemStructure& structure, const SolverOptions& options,
                            Index model_variable) {
  return options.fixed_variable_treatment == FixedVariableTreatment::MakeConstraint &&
         has_equal_bounds(structure, model_variable);
}

std::string VariableMap::build(const ProblemStructure& structure, const SolverOptions& options) {
  if (auto error = index_variables(structure, options); !error.empty()) return error;
  index_constraints(structure, options);
  map_entries(structure);
  return {};
}

std::string VariableMap::index_variables(const ProblemStructure& s, const SolverOptions& options) {
  const auto& players = s.variable_players;
  variable_of_model.assign(players.size(), -1);
  const auto treatment = options.fixed_variable_treatment;
  const bool takes_out = treatment == FixedVariableTreatment::MakeParameter ||
                         treatment == FixedVariableTreatment::MakeParameterNodual;
  const auto is_fixed = [&](std::size_t i) {
    return takes_out && has_equal_bounds(s, static_cast<Index>(i));
  };
  std::array<Index, 2> free{}, equalities{}, inequalities{};
  for (const auto i : indices(players)) {
    const bool max = players[i] == Player::Max;
    if (!is_fixed(i)) ++free[max];
    if (is_fixed_by_constraint(s, options, static_cast<Index>(i))) ++equalities[max];
  }
  // An equation without free variables holds or not; it takes no degree of freedom.
  std::array<Index, 2> constant{};
  varies.assign(s.constraint_players.size(), false);
  for (const Triplet& entry : s.jacobian) {
    if (!is_fixed(at(entry.col))) varies[entry.row] = true;
  }
  for (const auto j : indices(s.constraint_players)) {
    const bool max = s.constraint_players[j] == Player::Max;
    if (s.constraint_lower[j] == s.constraint_upper[j]) {
      ++equalities[max];
      if (!varies[j]) ++constant[max];
    } else if (s.constraint_lower[j] > options.nlp_lower_bound_inf ||
               s.constraint_upper[j] < options.nlp_upper_bound_inf) {
      ++inequalities[max];
    }
  }
  for (const bool max : {false, true}) {
    const Index equations = equalities[max] - constant[max];
    if (equations > free[max]) {
      std::ostringstream text;
      text << "too few degrees of freedom: the " << (max ? "Max" : "Min") << " player has "
           << free[max] << " free variable" << (free[max] == 1 ? "" : "s") << " and " << equations
           << " equality constraints";
      return text.str();
    }
  }

  x = {0, free[0]};
  x_slacks = {x.end, x.end + inequalities[0]};
  y = {x_slacks.end, x_slacks.end + free[1]};
  y_slacks = {y.end, y.end + inequalities[1]};
  min_constraints = {0, equalities[0] + inequalities[0]};
  max_constraints = {min_constraints.end, min_constraints.end + equalities[1] + inequalities[1]};

  model_variable.assign(at(variables()), -1);
  std::array<Index, 2> next{x.begin, y.begin};
  for (const auto i : indices(players)) {
    if (is_fixed(i)) continue;
    const Index canonical = next[players[i] == Player::Max]++;
    variable_of_model[i] = canonical;
    model_variable[canonical] = static_cast<Index>(i);
  }
  return {};
}

void VariableMap::index_constraints(const ProblemStructure& s, const SolverOptions& options) {
  const std::size_t m = s.constraint_players.size();
  constraint_of_model.assign(m, -1);
  model_constraint.assign(at(constraints()), -1);
  fixing_variable.assign(at(constraints()), -1);
  slack_of_constraint.assign(at(constraints()), -1);
  std::array<Index, 2> next{min_constraints.begin, max_constraints.begin};
  std::array<Index, 2> next_slack{x_slacks.begin, y_slacks.begin};
  for (std::size_t j = 0; j < m; ++j) {
    const double lower = s.constraint_lower[j];
    const double upper = s.constraint_upper[j];
    const bool equality = lower == upper;
    if (!equality && lower <= options.nlp_lower_bound_inf && upper >= options.nlp_upper_bound_inf) {
      continue;
    }
    const bool max = s.constraint_players[j] == Player::Max;
    const Index canonical = next[max]++;
    constraint_of_model[j] = canonical;
    model_constraint[canonical] = static_cast<Index>(j);
    if (!equality) slack_of_constraint[canonical] = next_slack[max]++;
  }
  for (Index i = 0; i < variables(); ++i) {
    const Index model = model_variable[i];
    if (model < 0 || !is_fixed_by_constraint(s, options, model)) continue;
    fixing_variable[next[owned_by_max(i)]++] = i;
  }
}

void VariableMap::map_entries(const ProblemStructure& s) {
  for (auto* entries : {&jacobian, &hessian}) entries->clear();
  for (auto* sources : {&jacobian_source, &hessian_source}) sources->clear();
  jacobian.reserve(s.jacobian.size());
  jacobian_source.reserve(s.jacobian.size());
  hessian.reserve(s.hessian.size());
  hessian_source.reserve(s.hessian.size());
  for (const auto k : indices(s.jacobian)) {
    const Index row = constraint_of_model[s.jacobian[k].row];
    const Index col = variable_of_model[s.jacobian[k].col];
    if (row < 0 || col < 0) continue;
    jacobian.push_back({row, col});
    jacobian_source.push_back(static_cast<Index>(k));
  }
  for (Index j = 0; j < constraints(); ++j) {
    if (fixing_variable[j] < 0) continue;
    jacobian.push_back({j, fixing_variable[j]});
    jacobian_source.push_back(-1);
  }
  for (const auto k : indices(s.hessian)) {
    const Index row = variable_of_model[s.hessian[k].row];
    const Index col = variable_of_model[s.hessian[k].col];
    if (row < 0 || col < 0) continue;
    hessian.push_back({std::max(row, col), std::min(row, col)});
    hessian_source.push_back(static_cast<Index>(k));
  }
  list_robust_constraints();
  list_owners(s);
}

void VariableMap::list_robust_constraints() {
  robust_constraints.clear();
  for (const auto [row, col] : jacobian) {
    if (owned_by_max(col) && min_constraints.contains(row)) robust_constraints.push_back(row);
  }
  sort_each_once(robust_constraints);
}

void VariableMap::list_owners(const ProblemStructure& s) {
  owners = {};
  if (s.served_constraint.empty()) return;
  owners.slack_of_variable.assign(at(variables()), -1);
  owners.slack_of_constraint.assign(at(constraints()), -1);
  for (const Index i : indices(y)) {
    const Index row = s.served_constraint[at(model_variable[i])];
    if (row < 0 || constraint_of_model[row] < 0) continue;
    owners.slack_of_variable[i] = slack_of_constraint[constraint_of_model[at(row)]];
  }
  const auto owner = [&](Index i) -> Index& { return owners.slack_of_variable[i]; };
  for (const auto [row, col] : jacobian) {
    if (!max_constraints.contains(row) || owner(col) < 0) continue;
    owners.slack_of_constraint[row] = owner(col);
    if (slack_of_constraint[row] >= 0) owner(slack_of_constraint[row]) = owner(col);
  }
  owners.has_copies.assign(at(variables()), false);
  for (const Index slack : owners.slack_of_variable) {
    if (slack >= 0) owners.has_copies[slack] = true;
  }
  owners.constraint_of_slack.assign(at(variables()), -1);
  for (const Index j : indices(min_constraints)) {
    if (slack_of_constraint[j] >= 0) owners.constraint_of_slack[slack_of_constraint[at(j)]] = j;
  }
  std::map<std::pair<Index, Index>, std::size_t> entry_of;  // of robust constraints: slack, column
  for (const auto k : indices(jacobian)) {
    const auto [row, col] = jacobian[k];
    if (!min_constraints.contains(row) || slack_of_constraint[row] < 0) continue;
    if (owner(col) == slack_of_constraint[row]) {
      owners.own_entries.push_back(k);
    } else {
      entry_of.try_emplace({slack_of_constraint[row], col}, k);
    }
  }
  for (const auto k : indices(jacobian)) {
    const auto [row, col] = jacobian[k];
    const Index slack = owners.slack_of_constraint[row];
    if (slack < 0) continue;
    if (const auto found = entry_of.find({slack, col}); found != entry_of.end()) {
      owners.shared_entries.push_back({found->second, k, row});
    }
  }
}

}  // namespace ipminmax
