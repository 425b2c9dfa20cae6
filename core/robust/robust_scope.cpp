#include "core/robust/robust_scope.hpp"

#include <algorithm>

#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

std::vector<Index> marked(const std::vector<bool>& marks) {
  std::vector<Index> found;
  for (const auto i : indices(marks)) {
    if (marks[i]) found.push_back(static_cast<Index>(i));
  }
  return found;
}

}  // namespace

bool has_valid_indices(const ProblemStructure& s) { return check_indices(s).empty(); }

std::vector<Index> robust_constraints(const ProblemStructure& s) {
  if (!has_valid_indices(s)) return {};
  std::vector<Index> rows;
  for (const auto [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] == Player::Min &&
        s.variable_players[at(col)] == Player::Max) {
      rows.push_back(row);
    }
  }
  std::ranges::sort(rows);
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

RobustScopes::RobustScopes(const ProblemStructure& structure)
    : structure_(structure),
      columns_(structure.constraint_players.size()),
      rows_(structure.variable_players.size()),
      determines_(columns_.size(), -1),
      determined_by_(rows_.size(), -1) {
  for (const auto [row, col] : structure.jacobian) {
    if (structure.variable_players[at(col)] != Player::Max) continue;
    columns_[at(row)].push_back(col);
    if (structure.constraint_players[at(row)] == Player::Max) rows_[at(col)].push_back(row);
  }
  match();
}

/// Gives Max's equations unbounded variables of their own: a largest matching.
void RobustScopes::match() {
  for (const auto row : indices(columns_)) {
    const bool equation = structure_.constraint_players[row] == Player::Max &&
                          structure_.constraint_lower[row] == structure_.constraint_upper[row];
    if (equation) match_from(static_cast<Index>(row));
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
      const bool unbounded = structure_.variable_lower[at(i)] <= -kUnbounded &&
                             structure_.variable_upper[at(i)] >= kUnbounded;
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

/// What constraints of Max tie to what a constraint reads.
void RobustScopes::tie(Index constraint, Marks& variables, Marks& rows) const {
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
}

/// Adds what the variables that constraints read depend on, through the equations that determine
/// them.
void RobustScopes::depend(const std::vector<Index>& seeds, Marks& variables) const {
  std::vector<Index> queue = seeds;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (const Index i : columns_[at(queue[next])]) {
      if (variables[at(i)]) continue;
      variables[at(i)] = true;
      if (determined_by_[at(i)] >= 0) queue.push_back(determined_by_[at(i)]);
    }
  }
}

/// A constraint that determines nothing restricts what it reads, and so what that depends on.
std::vector<Index> RobustScopes::idle(Index constraint, const RobustScope& scope) const {
  const auto determined = [&](Index i) { return determined_by_[at(i)] >= 0; };
  std::vector<Index> restricting;
  for (const Index row : scope.constraints) {
    if (determines_[at(row)] < 0) restricting.push_back(row);
  }
  std::vector<Index> seeds{constraint};
  for (const Index row : restricting) {
    if (std::ranges::any_of(columns_[at(row)], determined)) seeds.push_back(row);
  }
  Marks matters(rows_.size(), false);
  for (std::size_t before = 0; seeds.size() > before;) {
    before = seeds.size();
    depend(seeds, matters);
    for (const Index row : restricting) {
      const auto& reads = columns_[at(row)];
      if (std::ranges::any_of(reads, [&](Index i) { return matters[at(i)]; }) &&
          !std::ranges::all_of(reads, [&](Index i) { return matters[at(i)]; })) {
        seeds.push_back(row);
      }
    }
  }
  std::vector<Index> idle;
  for (const Index i : scope.variables) {
    if (!matters[at(i)] && !determined(i)) idle.push_back(i);
  }
  return idle;
}

std::vector<Index> RobustScopes::followers(const RobustScope& scope) const {
  std::vector<Index> found;
  for (const Index row : scope.constraints) {
    if (determines_[at(row)] < 0) return {};
    found.push_back(determines_[at(row)]);
  }
  std::ranges::sort(found);
  return found;
}

RobustScope RobustScopes::of(Index constraint) const {
  Marks variables(rows_.size(), false), rows(columns_.size(), false);
  tie(constraint, variables, rows);
  RobustScope scope{marked(variables), marked(rows), {}, {}};
  scope.idle = idle(constraint, scope);
  scope.followers = followers(scope);
  return scope;
}

RobustScope robust_scope(const ProblemStructure& s, Index constraint) {
  return RobustScopes(s).of(constraint);
}

bool can_be_held(const ProblemStructure& s, const RobustScope& scope) {
  return !scope.followers.empty() || std::ranges::none_of(s.jacobian, [&](Triplet entry) {
    return s.variable_players[at(entry.col)] == Player::Min &&
           std::ranges::binary_search(scope.constraints, entry.row);
  });
}

}  // namespace ipminmax
