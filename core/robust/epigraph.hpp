#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/formulas/interval.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/problem.hpp"

namespace ipminmax {

/// min t subject to the model's constraints and f(x, y) - t <= 0, a robust constraint; or, for the
/// least violation, t >= 0 subject to the model's constraints, robust ones with one bound relaxed by
/// t: g - t <= upper for every y, or g + t >= lower. The variable t is the last one, the constraint
/// on f too.
class Epigraph final : public ByRows<Problem> {
 public:
  /// reads_y: n, whether f reads a Max variable, as far as is known; none: it may read all.
  Epigraph(Problem& model, const std::vector<bool>& reads_y);
  /// Of the least violation.
  explicit Epigraph(Problem& model);

  /// Whether there is a constraint that t is in.
  [[nodiscard]] bool relaxes_any() const { return !relaxed_.empty(); }
  /// Whether a gradient of f has shown that it reads more Max variables.
  [[nodiscard]] bool reads_more() const { return reads_more_; }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> grad) override;
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                     std::span<double> g) override;
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                   std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override;
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override;
  [[nodiscard]] const BoxFunctions* over_boxes() const override {
    return boxes_ ? &*boxes_ : nullptr;
  }

 private:
  /// t, and the model's constraints with f - t.
  class Boxes final : public BoxFunctions {
   public:
    explicit Boxes(const BoxFunctions& model) : model_(model) {}
    [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
      return v.back();
    }
    void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
      g.back() = model_.all_over(v.first(v.size() - 1), g.first(g.size() - 1)) - v.back();
    }
    [[nodiscard]] bool is_concurrent() const override { return model_.is_concurrent(); }
    [[nodiscard]] Determined determined() const override { return model_.determined(); }
    void determine(std::span<double> v) const override { model_.determine(v.first(v.size() - 1)); }

   private:
    const BoxFunctions& model_;
  };

  static std::size_t size(Index i) { return static_cast<std::size_t>(i); }
  /// Of these rows the model's.
  [[nodiscard]] std::span<const Index> of_model(std::span<const Index> rows) const {
    return rows.first(rows.size() - (!rows.empty() && rows.back() == m_ ? 1 : 0));
  }

  struct Relaxed {
    Index row;
    double sign;  ///< of t in it
  };
  void relax(Index row, double sign);

  Problem& model_;
  ProblemStructure structure_;
  bool of_objective_;
  Index n_, m_;                       ///< of the model
  std::vector<Relaxed> relaxed_;      ///< ascending
  std::size_t entries_ = 0;           ///< of the model's Jacobian
  std::vector<Index> read_, unread_;  ///< variables that the row f - t has entries of, and others
  std::vector<double> gradient_;
  bool reads_more_ = false;
  std::optional<Boxes> boxes_;
};

}  // namespace ipminmax
