#include "core/reduction/reduced_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "core/model/extended_structure.hpp"
#include "core/model/model_start.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Label label_of_copy(const std::vector<std::string>& names, const std::vector<Index>& numbers,
                    Index i, std::size_t copy) {
  const bool named = at(i) < names.size() && !names[at(i)].empty();
  return {.number = at(i) < numbers.size() ? numbers[at(i)] : i,
          .name = (named ? names[at(i)] + "@" : "copy ") + std::to_string(copy)};
}

/// The side of a robust constraint that a worst case is of, where that is not said: the bounded
/// one, of two the one that the value at its y is nearer to.
double side_of(Problem& model, const RobustCopies::WorstCase& worst_case) {
  if (worst_case.side != 0) return worst_case.side;
  const ProblemStructure& s = model.structure();
  const double lower = s.constraint_lower[at(worst_case.constraint)];
  const double upper = s.constraint_upper[at(worst_case.constraint)];
  if (!(lower > -1e19)) return 1.0;
  if (!(upper < 1e19)) return -1.0;
  std::vector<double> g(s.constraint_players.size());
  if (!model.constraints(worst_case.v, true, g)) return 1.0;
  return g[at(worst_case.constraint)] >= 0.5 * (lower + upper) ? 1.0 : -1.0;
}

}  // namespace

ReducedRows::ReducedRows(Problem& model, std::vector<WorstCase> worst_cases,
                         const std::vector<bool>& reads_y, const SolverOptions& options,
                         Budget& budget)
    : model_(model),
      structure_(model.structure()),
      reduced_(structure_.constraint_players.size(), false),
      lambda_(structure_.constraint_players.size()),
      jacobian_(structure_.jacobian.size()) {
  structure_.nonlinear_variables.reset();
  const ProblemStructure& s = model.structure();
  std::vector<bool> read = reads_y;
  for (const WorstCase& one : worst_cases) {
    if (one.copied) continue;
    for (const Index i : robust_scope(s, one.constraint).variables) read[at(i)] = true;
  }
  drop_unread(read);
  for (std::size_t k = 0; k < worst_cases.size(); ++k) {
    WorstCase& one = worst_cases[k];
    const Index r = one.constraint;
    if (!one.copied) {
      rows_.push_back(r);
      maxima_.push_back(nullptr);
      continue;
    }
    const double side = side_of(model, one);
    const double lower = side > 0.0 ? -kInfinity : s.constraint_lower[at(r)];
    const double upper = side > 0.0 ? s.constraint_upper[at(r)] : kInfinity;
    if (!reduced_[at(r)]) {
      reduced_[at(r)] = true;
      structure_.constraint_lower[at(r)] = lower;
      structure_.constraint_upper[at(r)] = upper;
      rows_.push_back(r);
    } else {
      rows_.push_back(
          add_constraint(structure_, Player::Min, lower, upper,
                         label_of_copy(s.constraint_names, s.constraint_numbers, r, k + 1)));
      added_rows_.push_back(r);
    }
    maxima_.push_back(std::make_unique<RowMaximum>(
        model, RowMaximum::Row{r, side, std::move(one.v), one.held}, options, budget));
  }
  add_entries();
}

/// Of Max's variables stay those that f reads and whatever Max constraints tie to them.
void ReducedRows::drop_unread(const std::vector<bool>& reads_y) {
  const ProblemStructure& s = model_.structure();
  std::vector<bool> in = reads_y;
  std::vector<bool> row_in(s.constraint_players.size(), false);
  for (bool grown = true; grown;) {
    grown = false;
    for (const auto [row, col] : s.jacobian) {
      if (s.constraint_players[at(row)] != Player::Max ||
          s.variable_players[at(col)] != Player::Max) {
        continue;
      }
      if (in[at(col)] && !row_in[at(row)]) row_in[at(row)] = grown = true;
      if (row_in[at(row)] && !in[at(col)]) in[at(col)] = grown = true;
    }
  }
  std::vector<double> start = model_start(model_).value_or(std::vector<double>(in.size(), 0.0));
  for (std::size_t i = 0; i < in.size(); ++i) {
    if (s.variable_players[i] != Player::Max || in[i]) continue;
    structure_.variable_lower[i] = structure_.variable_upper[i] = start[i];
  }
  std::vector<bool> reads_max(row_in.size(), false);
  for (const auto [row, col] : s.jacobian) {
    if (s.variable_players[at(col)] == Player::Max) reads_max[at(row)] = true;
  }
  for (std::size_t j = 0; j < row_in.size(); ++j) {
    if (s.constraint_players[j] != Player::Max || row_in[j] || !reads_max[j]) continue;
    structure_.constraint_lower[j] = -kInfinity;
    structure_.constraint_upper[j] = kInfinity;
  }
}

void ReducedRows::add_entries() {
  const ProblemStructure& s = model_.structure();
  structure_.jacobian.clear();
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    if (reduced_[at(s.jacobian[k].row)]) continue;
    jacobian_entries_.push_back(k);
    structure_.jacobian.push_back(s.jacobian[k]);
  }
  std::size_t largest = 0;
  block_of_.assign(maxima_.size(), 0);
  for (std::size_t k = 0; k < maxima_.size(); ++k) {
    if (!maxima_[k]) continue;
    const std::vector<Index>& x = maxima_[k]->x();
    largest = std::max(largest, x.size());
    for (const Index i : x) structure_.jacobian.push_back({rows_[k], i});
    const auto same = std::ranges::find(blocks_, x, &Block::x);
    block_of_[k] = static_cast<std::size_t>(same - blocks_.begin());
    if (same == blocks_.end()) {
      blocks_.push_back({x, std::vector<double>(x.size() * (x.size() + 1) / 2)});
    }
  }
  gradient_.resize(largest);
  if (!structure_.has_hessian) return;
  for (const Block& block : blocks_) {
    for (std::size_t a = 0; a < block.x.size(); ++a) {
      for (std::size_t b = 0; b <= a; ++b) structure_.hessian.push_back({block.x[a], block.x[b]});
    }
  }
}

bool ReducedRows::starting_point(StartingPoint& start) {
  if (start.needs_multipliers) return false;
  const auto own = start_.empty() ? model_start(model_) : std::optional(start_);
  if (!own) return false;
  std::ranges::copy(*own, start.v.begin());
  return true;
}

bool ReducedRows::user_scaling(UserScaling& scaling) {
  if (!model_.user_scaling(scaling)) return false;
  if (scaling.constraints.empty()) return true;
  for (const Index r : added_rows_) scaling.constraints.push_back(scaling.constraints[at(r)]);
  return true;
}

bool ReducedRows::objective(std::span<const double> v, bool new_v, double& f) {
  static_cast<void>(new_v);
  return model_.objective(v, true, f);
}

bool ReducedRows::gradient(std::span<const double> v, bool, std::span<double> grad) {
  return model_.gradient(v, true, grad);
}

/// All worst cases at the x of v.
bool ReducedRows::move_to(std::span<const double> v) {
  for (std::size_t k = 0; k < maxima_.size(); ++k) {
    if (!maxima_[k] || maxima_[k]->move_to(v)) continue;
    failure_ = maxima_[k]->failure();
    return false;
  }
  return true;
}

bool ReducedRows::constraints(std::span<const double> v, bool, std::span<double> g) {
  if (!model_.constraints(v, true, g.first(at(model_rows())))) return false;
  if (!move_to(v)) return false;
  for (std::size_t k = 0; k < maxima_.size(); ++k) {
    if (maxima_[k]) g[at(rows_[k])] = maxima_[k]->side() * maxima_[k]->value();
  }
  return true;
}

bool ReducedRows::jacobian(std::span<const double> v, bool, std::span<double> values) {
  if (!model_.jacobian(v, true, jacobian_)) return false;
  auto out = values.begin();
  for (const std::size_t k : jacobian_entries_) *out++ = jacobian_[k];
  if (!move_to(v)) return false;
  for (const auto& maximum : maxima_) {
    if (!maximum) continue;
    const auto own = std::span(gradient_).first(maximum->x().size());
    if (!maximum->gradient(own)) return false;
    maximum->accept();
    for (const double slope : own) *out++ = maximum->side() * slope;
  }
  return true;
}

bool ReducedRows::hessian(std::span<const double> v, bool, double sigma,
                          std::span<const double> lambda, bool, std::span<double> values) {
  for (std::size_t j = 0; j < lambda_.size(); ++j) lambda_[j] = reduced_[j] ? 0.0 : lambda[j];
  const std::size_t own = model_.structure().hessian.size();
  if (!model_.hessian(v, true, sigma, lambda_, true, values.first(own))) return false;
  if (!move_to(v)) return false;
  for (Block& block : blocks_) std::ranges::fill(block.values, 0.0);
  for (std::size_t k = 0; k < maxima_.size(); ++k) {
    if (!maxima_[k]) continue;
    const double weight = lambda[at(rows_[k])] * maxima_[k]->side();
    if (weight == 0.0) continue;
    if (!maxima_[k]->add_hessian(weight, blocks_[block_of_[k]].values)) return false;
  }
  auto out = values.begin() + static_cast<std::ptrdiff_t>(own);
  for (const Block& block : blocks_) out = std::ranges::copy(block.values, out).out;
  return true;
}

bool ReducedRows::hessian_errors(std::span<const double> v, double sigma,
                                 std::span<const double> lambda, std::span<double> row_errors) {
  for (std::size_t j = 0; j < lambda_.size(); ++j) lambda_[j] = lambda[j];
  return model_.hessian_errors(v, sigma, lambda_, row_errors);
}

bool ReducedRows::follow_barrier(double mu) {
  bool changed = false;
  for (const auto& maximum : maxima_) {
    if (maximum && maximum->follow_barrier(mu)) changed = true;
  }
  return changed;
}

Index ReducedRows::variable(std::size_t k, Index i) const {
  const ProblemStructure& s = model_.structure();
  if (!maxima_[k] || s.variable_players[at(i)] == Player::Min) return i;
  return static_cast<Index>((k + 1) * s.variable_players.size()) + i;
}

Result ReducedRows::with_worst_cases(Result result) const {
  const std::size_t n = model_.structure().variable_players.size();
  if (result.v.size() != n) return result;
  for (std::size_t k = 0; k < maxima_.size(); ++k) {
    // y as it is where nothing was maximized.
    result.v.resize((k + 2) * n);
    result.z_lower.resize((k + 2) * n);
    result.z_upper.resize((k + 2) * n);
    if (!maxima_[k]) continue;
    const RowPoint& point = maxima_[k]->point();
    const double weight = result.lambda[at(rows_[k])] * maxima_[k]->side();
    for (std::size_t i = 0; i < n; ++i) {
      result.v[(k + 1) * n + i] = point.v[i];
      result.z_lower[(k + 1) * n + i] = weight * point.z_lower[i];
      result.z_upper[(k + 1) * n + i] = weight * point.z_upper[i];
    }
  }
  return result;
}

std::vector<double> ReducedRows::model_point(std::span<const double> v, std::size_t k) const {
  std::vector<double> point(model_.structure().variable_players.size());
  for (std::size_t i = 0; i < point.size(); ++i) {
    point[i] = v[at(variable(k, static_cast<Index>(i)))];
  }
  return point;
}

}  // namespace ipminmax
