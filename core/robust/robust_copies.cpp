#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include "core/model/initial_point.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_copies.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// What the model calls the original, with the number of the copy.
Label label_of_copy(const std::vector<std::string>& names, const std::vector<Index>& numbers,
                    Index i, std::size_t copy) {
  const bool named = at(i) < names.size() && !names[at(i)].empty();
  return {.number = at(i) < numbers.size() ? numbers[at(i)] : i,
          .name = (named ? names[at(i)] + "@" : "copy ") + std::to_string(copy)};
}

}  // namespace

RobustCopies::RobustCopies(Problem& model, std::vector<WorstCase> worst_cases,
                           const std::vector<bool>& reads_y, Budget& budget)
    : model_(model),
      budget_(budget),
      worst_cases_(std::move(worst_cases)),
      structure_(model.structure()),
      v_(structure_.variable_players.size()),
      g_(structure_.constraint_players.size()),
      lambda_(g_.size()),
      jacobian_(structure_.jacobian.size()),
      hessian_(structure_.hessian.size()) {
  structure_.nonlinear_variables.reset();
  const RobustScopes scopes(model.structure());
  for (const WorstCase& worst_case : worst_cases_) {
    scopes_.push_back(scopes.of(worst_case.constraint));
  }
  model_variable_.resize(v_.size());
  std::iota(model_variable_.begin(), model_variable_.end(), 0);
  model_row_.resize(g_.size());
  std::iota(model_row_.begin(), model_row_.end(), 0);
  add_base(reads_y);
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) add_worst_case(k);
  serve_rows(reads_y);
  add_entries();
}

/// The first worst case of a constraint; empty: none, the constraint does not count.
std::optional<std::size_t> RobustCopies::first_of(Index constraint) const {
  const auto first = std::ranges::find(worst_cases_, constraint, &WorstCase::constraint);
  if (first == worst_cases_.end()) return {};
  return static_cast<std::size_t>(first - worst_cases_.begin());
}

void RobustCopies::add_base(const std::vector<bool>& reads_y) {
  const ProblemStructure& s = model_.structure();
  Part base;
  base.with_objective = true;
  base.column = model_variable_;
  base.row_of = model_row_;
  for (const auto [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] == Player::Min &&
        s.variable_players[at(col)] == Player::Max) {
      base.row_of[at(row)] = -1;  // its worst cases' part
    }
  }
  parts_.push_back(std::move(base));
  for (const Index row : robust_constraints(s)) {
    if (first_of(row)) continue;
    structure_.constraint_lower[at(row)] = -kInfinity;
    structure_.constraint_upper[at(row)] = kInfinity;
  }
  // Of Max's variables count those that f reads or that a robust constraint has to itself, and
  // whatever is tied to them.
  std::vector<bool> read = reads_y;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    if (worst_cases_[k].copied) continue;
    for (const Index i : scopes_[k].variables) read[at(i)] = true;
  }
  drop_unread(read);
}

void RobustCopies::drop_unread(const std::vector<bool>& read) {
  const RobustScopes scopes(model_.structure());
  for (const Index row : robust_constraints(model_.structure())) {
    const auto first = first_of(row);
    if (first && !worst_cases_[*first].copied) continue;
    const RobustScope scope = scopes.of(row);
    if (std::ranges::any_of(scope.variables, [&](Index i) { return read[at(i)]; })) continue;
    hold(scope.variables, worst_cases_[first.value_or(0)]);
    for (const Index j : scope.constraints) {
      structure_.constraint_lower[at(j)] = -kInfinity;
      structure_.constraint_upper[at(j)] = kInfinity;
    }
  }
}

/// The model's own variables at their values in a worst case.
void RobustCopies::hold(const std::vector<Index>& variables, const WorstCase& worst_case) {
  for (const Index i : variables) {
    structure_.variable_lower[at(i)] = structure_.variable_upper[at(i)] = worst_case.v[at(i)];
  }
}

Index RobustCopies::copy_variable(Index i, std::size_t copy, const WorstCase& worst_case,
                                  bool held) {
  const ProblemStructure& s = model_.structure();
  const double value = worst_case.v[at(i)];
  model_variable_.push_back(i);
  if (!s.variable_units.empty()) structure_.variable_units.push_back(s.variable_units[at(i)]);
  return add_variable(structure_, Player::Max, held ? value : s.variable_lower[at(i)],
                      held ? value : s.variable_upper[at(i)],
                      label_of_copy(s.variable_names, s.variable_numbers, i, copy));
}

Index RobustCopies::copy_row(Index j, std::size_t copy) {
  const ProblemStructure& s = model_.structure();
  model_row_.push_back(j);
  return add_constraint(structure_, s.constraint_players[at(j)], s.constraint_lower[at(j)],
                        s.constraint_upper[at(j)],
                        label_of_copy(s.constraint_names, s.constraint_numbers, j, copy));
}

void RobustCopies::add_worst_case(std::size_t k) {
  const WorstCase& worst_case = worst_cases_[k];
  const std::size_t copy = parts_.size();
  const auto same_row = [&](const Part& part) { return part.row == worst_case.constraint; };
  Part part;
  part.column.resize(v_.size());
  std::iota(part.column.begin(), part.column.end(), 0);
  part.row_of.assign(g_.size(), -1);
  part.row = std::ranges::any_of(parts_, same_row) ? copy_row(worst_case.constraint, copy)
                                                   : worst_case.constraint;
  part.row_of[at(worst_case.constraint)] = part.row;
  if (worst_case.side > 0) structure_.constraint_lower[at(part.row)] = -kInfinity;
  if (worst_case.side < 0) structure_.constraint_upper[at(part.row)] = kInfinity;
  if (worst_case.copied) {
    const RobustScope& scope = scopes_[k];
    for (const Index i : scope.variables) {
      const bool idle = std::ranges::binary_search(scope.idle, i);
      const bool held = worst_case.held && !std::ranges::binary_search(scope.followers, i);
      part.column[at(i)] = copy_variable(i, copy, worst_case, held || idle);
    }
    if (!worst_case.held || !scope.followers.empty()) {
      for (const Index j : scope.constraints) part.row_of[at(j)] = copy_row(j, copy);
    }
  }
  parts_.push_back(std::move(part));
}

/// Copies, and variables of the model that nothing else reads, serve the row of their worst case.
void RobustCopies::serve_rows(const std::vector<bool>& reads_y) {
  std::vector<Index>& served = structure_.served_constraint;
  served.assign(structure_.variable_players.size(), -1);
  std::vector<Index> readers(v_.size(), 0);
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    if (first_of(worst_cases_[k].constraint) != k) continue;
    for (const Index i : scopes_[k].variables) ++readers[at(i)];
  }
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const WorstCase& worst_case = worst_cases_[k];
    const Index own = row(k);
    const RobustScope& scope = scopes_[k];
    const bool shared = !worst_case.copied && std::ranges::any_of(scope.variables, [&](Index i) {
      return reads_y[at(i)] || readers[at(i)] > 1;
    });
    if (shared || worst_case.held) continue;
    if (!worst_case.copied) hold(scope.idle, worst_case);
    for (const Index i : scope.variables) served[at(variable(k, i))] = own;
    parts_[k + 1].serving = scope.constraints;
  }
}

void RobustCopies::add_entries() {
  const ProblemStructure& s = model_.structure();
  structure_.jacobian.clear();
  structure_.hessian.clear();
  for (Part& part : parts_) {
    for (Index j = 0; at(j) < part.row_of.size(); ++j) {
      if (part.row_of[at(j)] >= 0) part.rows.push_back(j);
    }
    for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
      const auto [row, col] = s.jacobian[k];
      if (part.row_of[at(row)] < 0) continue;
      part.jacobian.push_back(k);
      structure_.jacobian.push_back({part.row_of[at(row)], part.column[at(col)]});
    }
    // Zeros, for the Newton system: Y(x) moves with x, and the row's own Lagrangian with it.
    for (const auto [row, col] : s.jacobian) {
      const bool moves = s.variable_players[at(col)] == Player::Min &&
                         std::ranges::binary_search(part.serving, row);
      if (!moves) continue;
      structure_.jacobian.push_back({part.row, part.column[at(col)]});
      ++part.zeros;
    }
    std::vector<std::vector<Index>> readers(v_.size());  // rows by variable, ascending
    for (const std::size_t k : part.jacobian)
      readers[at(s.jacobian[k].col)].push_back(s.jacobian[k].row);
    for (std::vector<Index>& rows : readers) std::ranges::sort(rows);
    const auto are_read_together = [&](Triplet pair) {
      const std::vector<Index>&a = readers[at(pair.row)], &b = readers[at(pair.col)];
      return std::ranges::any_of(a, [&](Index row) { return std::ranges::binary_search(b, row); });
    };
    for (std::size_t k = 0; k < s.hessian.size(); ++k) {
      if (!part.with_objective && !are_read_together(s.hessian[k])) continue;
      part.hessian.push_back(k);
      structure_.hessian.push_back(
          {part.column[at(s.hessian[k].row)], part.column[at(s.hessian[k].col)]});
    }
  }
}

bool RobustCopies::starting_point(StartingPoint& start) {
  if (start.needs_multipliers) return false;
  const auto own = start_.empty() ? model_start(model_) : std::optional(start_);
  if (!own) return false;
  std::ranges::copy(*own, start.v.begin());
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const WorstCase& worst_case = worst_cases_[k];
    const Part& part = parts_[k + 1];
    for (std::size_t i = 0; i < own->size(); ++i) {
      if (at(part.column[i]) != i) start.v[at(part.column[i])] = worst_case.v[i];
    }
  }
  return true;
}

bool RobustCopies::user_scaling(UserScaling& scaling) {
  if (!model_.user_scaling(scaling)) return false;
  const auto extend = [](std::vector<double>& factors, const std::vector<Index>& origin) {
    if (factors.empty()) return;
    for (std::size_t i = factors.size(); i < origin.size(); ++i) {
      factors.push_back(factors[at(origin[i])]);
    }
  };
  extend(scaling.variables, model_variable_);
  extend(scaling.constraints, model_row_);
  return true;
}

/// False: the budget is interrupted.
bool RobustCopies::load(std::span<const double> v, const Part& part) {
  for (std::size_t i = 0; i < v_.size(); ++i) v_[i] = v[at(part.column[i])];
  return !budget_.interrupted();
}

void RobustCopies::load_multipliers(std::span<const double> lambda, const Part& part) {
  for (std::size_t j = 0; j < lambda_.size(); ++j) {
    lambda_[j] = part.row_of[j] >= 0 ? lambda[at(part.row_of[j])] : 0.0;
  }
}

bool RobustCopies::objective(std::span<const double> v, bool, double& f) {
  return load(v, parts_.front()) && model_.objective(v_, true, f);
}

bool RobustCopies::gradient(std::span<const double> v, bool, std::span<double> grad) {
  std::ranges::fill(grad, 0.0);
  return load(v, parts_.front()) && model_.gradient(v_, true, grad.first(v_.size()));
}

bool RobustCopies::constraints(std::span<const double> v, bool, std::span<double> g) {
  std::ranges::fill(g, 0.0);
  for (const Part& part : parts_) {
    if (part.rows.empty()) continue;
    if (!load(v, part) || !model_.constraint_rows(part.rows, v_, true, g_)) return false;
    for (const Index j : part.rows) g[at(part.row_of[at(j)])] = g_[at(j)];
  }
  return true;
}

bool RobustCopies::jacobian(std::span<const double> v, bool, std::span<double> values) {
  auto out = values.begin();
  for (const Part& part : parts_) {
    if (part.jacobian.empty()) continue;
    if (!load(v, part) || !model_.jacobian_rows(part.rows, v_, true, jacobian_)) return false;
    for (const std::size_t k : part.jacobian) *out++ = jacobian_[k];
    out = std::fill_n(out, part.zeros, 0.0);
  }
  return true;
}

bool RobustCopies::hessian(std::span<const double> v, bool, double sigma,
                           std::span<const double> lambda, bool, std::span<double> values) {
  auto out = values.begin();
  for (const Part& part : parts_) {
    load_multipliers(lambda, part);
    if (!load(v, part) ||
        !model_.hessian(v_, true, part.with_objective ? sigma : 0.0, lambda_, true, hessian_)) {
      return false;
    }
    for (const std::size_t k : part.hessian) *out++ = hessian_[k];
  }
  return true;
}

bool RobustCopies::hessian_errors(std::span<const double> v, double sigma,
                                  std::span<const double> lambda, std::span<double> row_errors) {
  std::vector<double> errors(v_.size());
  std::ranges::fill(row_errors, 0.0);
  bool inexact = false;
  for (const Part& part : parts_) {
    load_multipliers(lambda, part);
    if (!load(v, part)) break;
    std::ranges::fill(errors, 0.0);
    if (!model_.hessian_errors(v_, part.with_objective ? sigma : 0.0, lambda_, errors)) continue;
    inexact = true;
    for (std::size_t i = 0; i < errors.size(); ++i) row_errors[at(part.column[i])] += errors[i];
  }
  return inexact;
}

std::vector<double> RobustCopies::model_point(std::span<const double> v, std::size_t k) const {
  std::vector<double> point(v_.size());
  for (std::size_t i = 0; i < point.size(); ++i) point[i] = v[at(parts_[k + 1].column[i])];
  return point;
}

bool RobustCopies::is_active(const Result& result, std::size_t k) const {
  const std::size_t own = at(row(k));
  const ProblemStructure& s = structure();
  const double distance = std::min(std::abs(s.constraint_upper[own] - result.constraints[own]),
                                   std::abs(result.constraints[own] - s.constraint_lower[own]));
  return std::abs(result.lambda[own]) > distance;
}

}  // namespace ipminmax
