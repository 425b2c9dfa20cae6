#include "core/robust/robust_scope.hpp"

#include <algorithm>

#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/array.hpp"

namespace ipminmax {
namespace {

bool is_equation_of_max(const ProblemStructure& s, std::size_t j) {
  return s.constraint_players[j] == Player::Max && s.constraint_lower[j] == s.constraint_upper[j];
}

}  // namespace

std::vector<Index> marked(const std::vector<bool>& marks) {
  std::vector<Index> found;
  for (const auto i : indices(marks)) {
    if (marks[i]) found.push_back(static_cast<Index>(i));
  }
  return found;
}

std::vector<std::size_t> variables_of(const ProblemStructure& s, Player player) {
  std::vector<std::size_t> found;
  for (const auto i : indices(s.variable_players)) {
    if (s.variable_players[i] == player) found.push_back(i);
  }
  return found;
}

std::vector<std::vector<std::size_t>> entries_of_rows(const ProblemStructure& s) {
  std::vector<std::vector<std::size_t>> entries(s.constraint_players.size());
  for (const auto k : indices(s.jacobian)) entries[at(s.jacobian[k].row)].push_back(k);
  return entries;
}

std::vector<Index> robust_constraints(const ProblemStructure& s) {
  if (!check_indices(s).empty()) return {};  // a solve says what is wrong
  std::vector<Index> rows;
  for (const auto [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] == Player::Min &&
        s.variable_players[at(col)] == Player::Max) {
      rows.push_back(row);
    }
  }
  sort_each_once(rows);
  return rows;
}

RobustScopes::RobustScopes(const ProblemStructure& structure, const std::vector<bool>& linear)
    : structure_(&structure),
      columns_(structure.constraint_players.size()),
      rows_(structure.variable_players.size()),
      determines_(columns_.size(), -1),
      determined_by_(rows_.size(), -1),
      explicit_(columns_.size(), false) {
  for (const auto [row, col] : structure.jacobian) {
    if (structure.variable_players[at(col)] != Player::Max) continue;
    columns_[at(row)].push_back(col);
    if (structure.constraint_players[at(row)] == Player::Max) rows_[at(col)].push_back(row);
  }
  // Max's equations get unbounded variables of their own: a largest matching.
  for (const auto row : indices(columns_)) {
    if (is_equation_of_max(structure, row)) match_from(static_cast<Index>(row));
  }
  for (const auto k : indices(linear)) {
    const auto [row, col] = structure.jacobian[k];
    if (determines_[at(row)] == col) explicit_[at(row)] = linear[k];
  }
}

/// Along a shortest augmenting path, if there is one.
void RobustScopes::match_from(Index start) {
  std::vector<Index> queue{start};
  std::vector<std::pair<Index, Index>> found_from;  // variable, row that it was reached from
  Marks seen;
  const auto augment = [&](Index variable, Index row) {
    for (;;) {
      const Index before = determines_[at(row)];
      determines_[at(row)] = variable;
      determined_by_[at(variable)] = row;
      if (row == start) return;
      variable = before;
      row = std::ranges::find(found_from, variable, &std::pair<Index, Index>::first)->second;
    }
  };
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const Index row = queue[next];
    for (const Index i : columns_[at(row)]) {
      const bool unbounded = structure_->variable_lower[at(i)] <= -kUnbounded &&
                             structure_->variable_upper[at(i)] >= kUnbounded;
      if (unbounded && determined_by_[at(i)] < 0) return augment(i, row);
    }
    if (seen.empty()) seen.assign(rows_.size(), false);
    for (const Index i : columns_[at(row)]) {
      if (determined_by_[at(i)] < 0 || seen[at(i)]) continue;
      seen[at(i)] = true;
      found_from.emplace_back(i, row);
      queue.push_back(determined_by_[at(i)]);
    }
  }
}

/// What of Max the constraint depends on, if these constraints are tied to it: one that determines
/// nothing restricts what it reads, and so what that depends on.
RobustScopes::Marks RobustScopes::matters(Index constraint,
                                          const std::vector<Index>& constraints) const {
  const auto determined = [&](Index i) { return determined_by_[at(i)] >= 0; };
  std::vector<Index> restricting;
  for (const Index row : constraints) {
    if (determines_[at(row)] < 0) restricting.push_back(row);
  }
  std::vector<Index> seeds{constraint};
  for (const Index row : restricting) {
    if (std::ranges::any_of(columns_[at(row)], determined)) seeds.push_back(row);
  }
  Marks matters(rows_.size(), false);
  for (std::size_t before = 0; seeds.size() > before;) {
    before = seeds.size();
    // What the variables that these read depend on, through the equations that determine them.
    std::vector<Index> queue = seeds;
    for (std::size_t next = 0; next < queue.size(); ++next) {
      for (const Index i : columns_[at(queue[next])]) {
        if (!matters[at(i)] && determined(i)) queue.push_back(determined_by_[at(i)]);
        matters[at(i)] = true;
      }
    }
    for (const Index row : restricting) {
      const auto& reads = columns_[at(row)];
      if (std::ranges::any_of(reads, [&](Index i) { return matters[at(i)]; }) &&
          !std::ranges::all_of(reads, [&](Index i) { return matters[at(i)]; })) {
        seeds.push_back(row);
      }
    }
  }
  return matters;
}

/// What equations determine, without some of it, in an order in which each follows from those
/// before. Empty: there is none.
ExplicitEquations RobustScopes::in_order(const std::vector<Index>& variables,
                                         const Marks& without) const {
  const auto is_one = [&](Index i) { return determined_by_[at(i)] >= 0 && !without[at(i)]; };
  std::vector<Index> waits_for(rows_.size(), 0), ready;
  std::size_t count = 0;
  for (const Index i : variables) {
    if (!is_one(i)) continue;
    if (!explicit_[at(determined_by_[at(i)])]) return {};
    for (const Index read : columns_[at(determined_by_[at(i)])]) {
      if (read != i && is_one(read)) ++waits_for[at(i)];
    }
    if (waits_for[at(i)] == 0) ready.push_back(i);
    ++count;
  }
  ExplicitEquations order;
  for (std::size_t next = 0; next < ready.size(); ++next) {
    const Index i = ready[next];
    order.push_back({determined_by_[at(i)], i});
    for (const Index row : rows_[at(i)]) {
      const Index other = determines_[at(row)];
      if (other >= 0 && other != i && --waits_for[at(other)] == 0) ready.push_back(other);
    }
  }
  return order.size() == count ? order : ExplicitEquations{};
}

std::vector<Index> RobustScopes::dependent(const RobustScope& scope) const {
  std::vector<Index> found;
  for (const Index row : scope.constraints) {
    if (determines_[at(row)] < 0) return {};
    found.push_back(determines_[at(row)]);
  }
  std::ranges::sort(found);
  return found;
}

RobustScope RobustScopes::all_of(Index constraint) const {
  // What constraints of Max tie to what the constraint reads.
  Marks variables(rows_.size(), false), rows(columns_.size(), false);
  std::vector<Index> queue;
  const auto read = [&](Index row) {
    for (const Index i : columns_[at(row)]) {
      if (!variables[at(i)]) queue.push_back(i);
      variables[at(i)] = true;
    }
  };
  read(constraint);
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (const Index row : rows_[at(queue[next])]) {
      if (rows[at(row)]) continue;
      rows[at(row)] = true;
      read(row);
    }
  }
  RobustScope scope{marked(variables), marked(rows), {}, {}};
  const Marks counts = matters(constraint, scope.constraints);
  for (const Index i : scope.variables) {
    if (!counts[at(i)] && determined_by_[at(i)] < 0) scope.irrelevant.push_back(i);
  }
  scope.dependent = dependent(scope);
  return scope;
}

ExplicitEquations RobustScopes::follows() const {
  return in_order(numbers_below(rows_.size()), Marks(rows_.size(), false));
}

RobustScope RobustScopes::of(Index constraint) const {
  RobustScope scope = all_of(constraint);
  const Marks counts = matters(constraint, scope.constraints);
  scope.follows = in_order(scope.variables, Marks(rows_.size(), false));
  if (scope.follows.empty()) scope.follows = in_order(scope.variables, counts);
  const auto is_behind = [&](auto equation) { return !counts[at(equation.variable)]; };
  if (std::ranges::none_of(scope.follows, is_behind)) return scope;
  std::erase_if(scope.variables, [&](Index i) { return !counts[at(i)]; });
  std::erase_if(scope.constraints, [&](Index row) {
    const auto matters = [&](Index i) { return counts[at(i)]; };
    const Index own = determines_[at(row)];
    return own >= 0 ? !matters(own) : std::ranges::none_of(columns_[at(row)], matters);
  });
  scope.dependent = dependent(scope);
  return scope;
}

std::vector<bool> linear_entries(Problem& model, const std::vector<double>& v, Counts& counts) {
  constexpr double kSame = 1e-6;  // also where derivatives are differences
  const ProblemStructure& s = model.structure();
  bool any = false;
  for (const auto j : indices(s.constraint_players)) any = any || is_equation_of_max(s, j);
  if (!any) return {};
  std::vector<double> first, other(s.jacobian.size());
  std::vector<bool> linear(other.size(), true);
  for (const auto& point : points_around(s, v)) {
    ++counts.jacobian;
    if (!all_finite(point) || !model.jacobian(point, true, other)) return {};
    if (first.empty()) first = other;
    for (const auto k : indices(other)) {
      const bool same = std::abs(other[k] - first[k]) <= kSame * std::abs(first[k]);
      linear[k] = linear[k] && same && first[k] != 0.0;
    }
  }
  return linear;
}

/// Newton's method with a triangular matrix: after each step one more equation holds, at least.
bool complete(Problem& model, const ExplicitEquations& follows, std::vector<double>& v) {
  if (follows.empty()) return true;
  constexpr double kRounding = 1e-11;  // beside the terms of an equation
  const ProblemStructure& s = model.structure();
  std::vector<Index> rows;
  for (const auto& [row, variable] : follows) rows.push_back(row);
  std::ranges::sort(rows);
  const auto entries = entries_of_rows(s);
  std::vector<double> g(entries.size()), jacobian(s.jacobian.size()), step(v.size());
  for (std::size_t done = 0; done <= follows.size() + 1; ++done) {
    if (!model.constraint_rows(rows, v, true, g) || !model.jacobian_rows(rows, v, false, jacobian))
      return false;
    bool holds = true;
    std::ranges::fill(step, 0.0);
    for (const auto& [row, variable] : follows) {
      const double error = g[at(row)] - s.constraint_lower[at(row)];
      double terms = std::abs(s.constraint_lower[at(row)]), rest = error, slope = 0.0;
      for (const std::size_t entry : entries[at(row)]) {
        const Index col = s.jacobian[entry].col;
        terms += std::abs(jacobian[entry] * v[at(col)]);
        (col == variable ? slope : rest) +=
            jacobian[entry] * (col == variable ? 1.0 : step[at(col)]);
      }
      holds = holds && std::abs(error) <= kRounding * terms;
      step[at(variable)] = -rest / slope;
    }
    if (holds) return true;
    for (const auto& [row, variable] : follows) v[at(variable)] += step[at(variable)];
    if (!all_finite(v)) return false;
  }
  return false;
}

bool can_be_held(const ProblemStructure& s, const RobustScope& scope) {
  return !scope.dependent.empty() || std::ranges::none_of(s.jacobian, [&](Triplet entry) {
    return s.variable_players[at(entry.col)] == Player::Min &&
           std::ranges::binary_search(scope.constraints, entry.row);
  });
}

}  // namespace ipminmax
