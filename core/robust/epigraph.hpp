#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/problem.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// min t subject to the model's constraints and f(x, y) - t <= 0, a robust constraint; or, for the
/// least violation, t >= 0 subject to the model's constraints, robust ones with one bound relaxed
/// by t: g - t <= upper for every y, or g + t >= lower. The variable t is the last one, the
/// constraint on f too.
class Epigraph final : public ByRows<ForwardingProblem>, private BoxesOf {
 public:
  /// reads_y: n, whether f reads a Max variable, as far as is known; none: it may read all.
  Epigraph(Problem& model, const std::vector<bool>& reads_y)
      : ByRows(model),
        BoxesOf(model.over_boxes()),
        structure_(model.structure()),
        of_objective_(true) {
    n_ = add_variable(structure_, Player::Min, -kInfinity, kInfinity, {-1, "t"});
    m_ = add_constraint(structure_, Player::Min, -kInfinity, 0.0, {-1, "f - t"});
    entries_ = structure_.jacobian.size();
    const bool known = std::ranges::find(reads_y, true) != reads_y.end();
    for (Index i = 0; i < n_; ++i) {
      const bool max = structure_.variable_players[at(i)] == Player::Max;
      (max && known && !reads_y[at(i)] ? unread_ : read_).push_back(i);
    }
    for (const Index i : read_) structure_.jacobian.push_back({m_, i});
    relax(m_, -1.0);
    gradient_.resize(at(n_));
  }

  /// Of the least violation.
  explicit Epigraph(Problem& model)
      : ByRows(model),
        BoxesOf(nullptr),
        structure_(model.structure()),
        of_objective_(false),
        m_(static_cast<Index>(structure_.constraint_players.size())),
        entries_(structure_.jacobian.size()) {
    n_ = add_variable(structure_, Player::Min, 0.0, kInfinity, {-1, "violation"});
    for (const Index row : robust_constraints(model.structure())) {
      const bool lower = structure_.constraint_lower[at(row)] > -kUnbounded;
      const bool upper = structure_.constraint_upper[at(row)] < kUnbounded;
      if (lower != upper) relax(row, upper ? -1.0 : 1.0);
    }
  }

  /// Whether there is a constraint that t is in.
  [[nodiscard]] bool relaxes_any() const { return !relaxed_.empty(); }
  /// Whether a gradient of f has shown that it reads more Max variables.
  [[nodiscard]] bool reads_more() const { return *reads_more_; }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (start.needs_multipliers) return false;
    const auto own = model_start(model());
    if (!own) return false;
    std::ranges::copy(*own, start.v.begin());
    double f = 0.0;
    if (all_finite(*own) && model().objective(*own, true, f) && std::isfinite(f))
      start.v.back() = f;
    return true;
  }

  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    if (!of_objective_ || !model().user_scaling(scaling)) return false;
    if (!scaling.variables.empty()) scaling.variables.push_back(std::abs(scaling.objective));
    if (!scaling.constraints.empty()) scaling.constraints.push_back(std::abs(scaling.objective));
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = v.back();
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    grad.back() = 1.0;
    return true;
  }

  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                     std::span<double> g) override {
    const auto own = v.first(at(n_));
    const auto asked = of_model(rows);
    if (!asked.empty() && !model().constraint_rows(asked, own, true, g.first(at(m_)))) return false;
    if (asked.size() < rows.size() && !model().objective(own, asked.empty(), g.back()))
      return false;
    for (const auto& [row, sign] : relaxed_) {
      if (std::ranges::binary_search(rows, row)) g[at(row)] += sign * v.back();
    }
    return true;
  }

  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                   std::span<double> values) override {
    const auto own = v.first(at(n_));
    const auto asked = of_model(rows);
    if (!asked.empty() && !model().jacobian_rows(asked, own, true, values.first(entries_)))
      return false;
    for (const auto k : indices(relaxed_))
      values[values.size() - relaxed_.size() + k] = relaxed_[k].sign;
    if (asked.size() == rows.size()) return true;
    if (!model().gradient(own, asked.empty(), gradient_)) return false;
    for (const auto k : indices(read_)) values[entries_ + k] = gradient_[at(read_[k])];
    if (std::ranges::any_of(unread_, [&](Index i) { return gradient_[at(i)] != 0.0; }))
      *reads_more_ = true;
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    return model().hessian(v.first(at(n_)), true, of_objective_ ? lambda.back() : 0.0,
                           lambda.first(at(m_)), true, values);
  }

  [[nodiscard]] bool hessian_errors(std::span<const double> v, double,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    row_errors.back() = 0.0;
    return model().hessian_errors(v.first(at(n_)), of_objective_ ? lambda.back() : 0.0,
                                  lambda.first(at(m_)), row_errors.first(at(n_)));
  }

  [[nodiscard]] const BoxFunctions* over_boxes() const override { return if_known(); }
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    auto copy = cloned(*this);
    if (copy && model_boxes != nullptr) copy->model_boxes = copy->model().over_boxes();
    return copy;
  }

 private:
  // t, and the model's constraints with f - t.
  IntervalJet objective_over(std::span<const IntervalJet> v) const override { return v.back(); }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    g.back() = model_boxes->all_over(v.first(at(n_)), g.first(at(m_))) - v.back();
  }
  void determine(std::span<double> v) const override { model_boxes->determine(v.first(at(n_))); }

  /// Of these rows the model's.
  std::span<const Index> of_model(std::span<const Index> rows) const {
    return rows.first(rows.size() - (!rows.empty() && rows.back() == m_ ? 1 : 0));
  }

  struct Relaxed {
    Index row;
    double sign;  ///< of t in it
  };
  void relax(Index row, double sign) {
    relaxed_.push_back({row, sign});
    structure_.jacobian.push_back({row, n_});
    structure_.nonlinear_variables.reset();
  }
  ProblemStructure structure_;
  bool of_objective_;
  Index n_, m_;                       ///< of the model
  std::vector<Relaxed> relaxed_;      ///< ascending
  std::size_t entries_ = 0;           ///< of the model's Jacobian
  std::vector<Index> read_, unread_;  ///< variables that the row f - t has entries of, and others
  std::vector<double> gradient_;
  /// Of all clones.
  std::shared_ptr<std::atomic<bool>> reads_more_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace ipminmax
