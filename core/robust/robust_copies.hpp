#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/model/budget.hpp"
#include "core/model/indices.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// A worst case that a solve is given.
struct GivenWorstCase {
  Index constraint = 0;   ///< robust
  std::vector<double> v;  ///< n; y in it is the start
  bool copied = true;     ///< false: the model's own y; first worst case of its constraint only
  bool held = false;      ///< y stays at v, what follows from it apart: a scenario
  int side = 0;           ///< 1: of the upper bound alone, -1: of the lower one, 0: of both
  /// Whether it is one of this bound of a constraint, or of both bounds.
  [[nodiscard]] bool is_of(Index its_constraint, int its_side) const {
    return constraint == its_constraint && side * its_side >= 0;
  }
};
using WorstCases = std::vector<GivenWorstCase>;

/// The model with copies of y for worst cases of robust constraints:
///
///     x, y, y_1, ..., y_C       g_r(x, y_k) <= 0 with r of worst case k, y_k in Y(x)
///
/// Rows of the model come first (the first worst case of a robust constraint takes its row), then
/// one row for each further worst case and the Max constraints on each copy. Max variables that
/// nothing reads any more are fixed, their constraints dropped.
class RobustCopies final : public Problem {
 public:
  /// start: n values, whose x is where it starts. scopes: of the model. reads_y: n, whether f reads
  /// a Max variable. Robust constraints without a worst case are left out. Where the budget is
  /// interrupted it is undefined: one evaluation is many of the model.
  RobustCopies(Problem& model, std::vector<double> start, WorstCases worst_cases,
               const RobustScopes& scopes, const std::vector<bool>& reads_y, Budget& budget)
      : model_(model),
        budget_(budget),
        start_(std::move(start)),
        structure_(model.structure()),
        model_variable_(numbers_below(structure_.variable_players.size())),
        model_row_(numbers_below(structure_.constraint_players.size())),
        v_(structure_.variable_players.size()),
        g_(structure_.constraint_players.size()),
        lambda_(g_.size()),
        jacobian_(structure_.jacobian.size()),
        hessian_(structure_.hessian.size()) {
    structure_.nonlinear_variables.reset();
    parts_.resize(worst_cases.size() + 1);
    for (Part& part : parts_) part.column = model_variable_;
    for (const auto k : indices(worst_cases)) {
      Part& part = parts_[k + 1];
      part.worst_case = std::move(worst_cases[k]);
      const Index row = part.worst_case.constraint;
      part.scope = part.worst_case.copied ? scopes.of(row) : scopes.all_of(row);
    }
    add_base(scopes, reads_y);
    for (std::size_t copy = 1; copy < parts_.size(); ++copy) add_worst_case(copy);
    serve_rows(reads_y);
    add_entries();
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (start.needs_multipliers) return false;
    std::ranges::copy(start_, start.v.begin());
    for (const Part& part : worst_cases()) {
      for (const auto i : indices(start_)) {
        const auto copy = at(part.column[i]);
        if (copy != i) start.v[copy] = part.worst_case.v[i];
      }
    }
    return true;
  }

  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    if (!model_.user_scaling(scaling)) return false;
    const auto extend = [](std::vector<double>& factors, std::size_t given,
                           const std::vector<Index>& origin) {
      if (factors.empty()) return;
      if (factors.size() != given)
        return factors.resize(origin.size() + 1);  // the solve refuses it
      for (std::size_t i = given; i < origin.size(); ++i) factors.push_back(factors[at(origin[i])]);
    };
    const ProblemStructure& s = model_.structure();
    extend(scaling.variables, s.variable_players.size(), model_variable_);
    extend(scaling.constraints, s.constraint_players.size(), model_row_);
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    return load(v, parts_.front()) && model_.objective(v_, true, f);
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    return load(v, parts_.front()) && model_.gradient(v_, true, grad.first(v_.size()));
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    for (const Part& part : parts_) {
      if (part.rows.empty()) continue;
      if (!load(v, part) || !model_.constraint_rows(part.rows, v_, true, g_)) return false;
      for (const Index j : part.rows) g[at(part.row_of[at(j)])] = g_[at(j)];
    }
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    auto out = values.begin();
    for (const Part& part : parts_) {
      if (part.jacobian.empty()) continue;
      if (!load(v, part) || !model_.jacobian_rows(part.rows, v_, true, jacobian_)) return false;
      for (const std::size_t k : part.jacobian) *out++ = jacobian_[k];
      out = std::fill_n(out, part.zeros, 0.0);
    }
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
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

  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    std::vector<double> errors(v_.size());
    std::ranges::fill(row_errors, 0.0);
    bool inexact = false;
    for (const Part& part : parts_) {
      load_multipliers(lambda, part);
      if (!load(v, part)) break;
      std::ranges::fill(errors, 0.0);
      if (!model_.hessian_errors(v_, part.with_objective ? sigma : 0.0, lambda_, errors)) continue;
      inexact = true;
      for (const auto i : indices(errors)) row_errors[at(part.column[i])] += errors[i];
    }
    return inexact;
  }

  /// The model evaluated at one y: its rows that count there and where they and the columns go.
  struct Part {
    GivenWorstCase worst_case;
    RobustScope scope;          ///< what it involves
    std::vector<Index> column;  ///< n: variable of this problem that stands for the model's
    std::vector<Index> row_of;  ///< m: row of this problem, -1: does not count here
    std::vector<Index> rows;    ///< of the model, that count here
    Index row = -1;             ///< of the worst case
    bool with_objective = false;
    std::vector<std::size_t> jacobian, hessian;  ///< entries of the model that count here
    std::vector<Index> serving;  ///< constraints of the model on a y that serves the row
    std::size_t zeros = 0;       ///< entries behind the others
  };
  /// The worst cases.
  [[nodiscard]] std::span<const Part> worst_cases() const { return std::span(parts_).subspan(1); }
  /// A worst case at a result's variables: x with its y, n values.
  [[nodiscard]] std::vector<double> model_point(std::span<const double> v, const Part& part) const {
    std::vector<double> point;
    for (const Index i : part.column) point.push_back(v[at(i)]);
    static_cast<void>(complete(model_, part.scope.follows, point));  // else it is none of Max's
    return point;
  }

  /// The model's variable and row that each variable and each row of this problem is, or copies.
  [[nodiscard]] const std::vector<Index>& model_variables() const { return model_variable_; }
  [[nodiscard]] const std::vector<Index>& model_rows() const { return model_row_; }
  /// Whether the row of a worst case holds x where it is: its multiplier exceeds its distance to
  /// the bound.
  [[nodiscard]] bool is_active(const Result& result, const Part& part) const {
    const std::size_t own = at(part.row);
    const double value = result.constraints[own];
    const double distance = std::min(std::abs(structure_.constraint_upper[own] - value),
                                     std::abs(value - structure_.constraint_lower[own]));
    return std::abs(result.lambda[own]) > distance;
  }

 private:
  /// The first worst case of a constraint; null: none, the constraint does not count.
  const Part* first_of(Index constraint) const {
    for (const Part& part : worst_cases()) {
      if (part.worst_case.constraint == constraint) return &part;
    }
    return nullptr;
  }

  /// The model's own y; what of them nothing reads any more is held.
  void add_base(const RobustScopes& scopes, const std::vector<bool>& reads_y) {
    Part& base = parts_.front();
    base.with_objective = true;
    base.row_of = model_row_;
    const std::vector<Index> robust = robust_constraints(model_.structure());
    for (const Index row : robust) {
      base.row_of[at(row)] = -1;  // its worst cases' part
      if (first_of(row) == nullptr) drop_constraint(structure_, row);
    }
    // Of Max's variables count those that f reads or that a robust constraint has to itself, and
    // whatever is tied to them.
    std::vector<bool> read = reads_y;
    for (const Part& part : worst_cases()) {
      if (part.worst_case.copied) continue;
      for (const Index i : part.scope.variables) read[at(i)] = true;
    }
    for (const Index row : robust) {
      const Part* first = first_of(row);
      if (first != nullptr && !first->worst_case.copied) continue;
      const RobustScope scope = scopes.all_of(row);
      if (std::ranges::any_of(scope.variables, [&](Index i) { return read[at(i)]; })) continue;
      hold(scope.variables, (first != nullptr ? *first : parts_[1]).worst_case);
      for (const Index j : scope.constraints) drop_constraint(structure_, j);
    }
  }

  void add_worst_case(std::size_t copy) {
    Part& part = parts_[copy];
    const GivenWorstCase& worst_case = part.worst_case;
    part.row_of.assign(g_.size(), -1);
    part.row = first_of(worst_case.constraint) == &part
                   ? worst_case.constraint
                   : copy_row(worst_case.constraint, copy, Player::Min);
    part.row_of[at(worst_case.constraint)] = part.row;
    if (worst_case.side > 0) structure_.constraint_lower[at(part.row)] = -kInfinity;
    if (worst_case.side < 0) structure_.constraint_upper[at(part.row)] = kInfinity;
    if (worst_case.copied) {
      const RobustScope& scope = part.scope;
      // What follows from a y that is held is Min's: Max has no choice left.
      const Player player = worst_case.held ? Player::Min : Player::Max;
      for (const Index i : scope.variables) {
        const bool irrelevant = std::ranges::binary_search(scope.irrelevant, i);
        const bool held = worst_case.held && !std::ranges::binary_search(scope.dependent, i);
        part.column[at(i)] =
            copy_variable(i, copy, player, worst_case.v[at(i)], held || irrelevant);
      }
      if (!worst_case.held || !scope.dependent.empty()) {
        for (const Index j : scope.constraints) part.row_of[at(j)] = copy_row(j, copy, player);
      }
    }
  }

  Index copy_variable(Index i, std::size_t copy, Player player, double value, bool held) {
    const ProblemStructure& s = model_.structure();
    model_variable_.push_back(i);
    if (!s.variable_units.empty()) structure_.variable_units.push_back(s.variable_units[at(i)]);
    return add_variable(structure_, player, held ? value : s.variable_lower[at(i)],
                        held ? value : s.variable_upper[at(i)],
                        label_of_copy(s.variable_names, s.variable_numbers, i, copy));
  }

  Index copy_row(Index j, std::size_t copy, Player player) {
    const ProblemStructure& s = model_.structure();
    model_row_.push_back(j);
    return add_constraint(structure_, player, s.constraint_lower[at(j)], s.constraint_upper[at(j)],
                          label_of_copy(s.constraint_names, s.constraint_numbers, j, copy));
  }

  /// Copies, and variables of the model that nothing else reads, serve the row of their worst case.
  void serve_rows(const std::vector<bool>& reads_y) {
    std::vector<Index>& served = structure_.served_constraint;
    served.assign(structure_.variable_players.size(), -1);
    std::vector<Index> readers(v_.size(), 0);
    for (const Part& part : worst_cases()) {
      if (first_of(part.worst_case.constraint) != &part) continue;
      for (const Index i : part.scope.variables) ++readers[at(i)];
    }
    for (Part& part : std::span(parts_).subspan(1)) {
      const GivenWorstCase& worst_case = part.worst_case;
      const RobustScope& scope = part.scope;
      const bool shared = !worst_case.copied && std::ranges::any_of(scope.variables, [&](Index i) {
        return reads_y[at(i)] || readers[at(i)] > 1;
      });
      if (shared || worst_case.held) continue;
      if (!worst_case.copied) hold(scope.irrelevant, worst_case);
      for (const Index i : scope.variables) served[at(part.column[at(i)])] = part.row;
      part.serving = scope.constraints;
    }
  }

  /// The model's own variables at their values in a worst case.
  void hold(const std::vector<Index>& variables, const GivenWorstCase& worst_case) {
    for (const Index i : variables) fix_variable(structure_, i, worst_case.v[at(i)]);
  }

  void add_entries() {
    const ProblemStructure& s = model_.structure();
    structure_.jacobian.clear();
    structure_.hessian.clear();
    for (Part& part : parts_) {
      for (Index j = 0; at(j) < part.row_of.size(); ++j) {
        if (part.row_of[at(j)] >= 0) part.rows.push_back(j);
      }
      for (const auto k : indices(s.jacobian)) {
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
        return std::ranges::any_of(a,
                                   [&](Index row) { return std::ranges::binary_search(b, row); });
      };
      for (const auto k : indices(s.hessian)) {
        if (!part.with_objective && !are_read_together(s.hessian[k])) continue;
        part.hessian.push_back(k);
        structure_.hessian.push_back(
            {part.column[at(s.hessian[k].row)], part.column[at(s.hessian[k].col)]});
      }
    }
  }

  /// False: the budget is interrupted.
  bool load(std::span<const double> v, const Part& part) {
    for (const auto i : indices(v_)) v_[i] = v[at(part.column[i])];
    return !budget_.interrupted();
  }

  void load_multipliers(std::span<const double> lambda, const Part& part) {
    for (const auto j : indices(lambda_)) {
      lambda_[j] = part.row_of[j] >= 0 ? lambda[at(part.row_of[j])] : 0.0;
    }
  }
  Problem& model_;
  Budget& budget_;
  std::vector<double> start_;
  ProblemStructure structure_;
  std::vector<Part> parts_;                        ///< the model's own y, then the worst cases
  std::vector<Index> model_variable_, model_row_;  ///< of each variable and row
  std::vector<double> v_, g_, lambda_, jacobian_, hessian_;  ///< in the model's shapes
};

}  // namespace ipminmax
