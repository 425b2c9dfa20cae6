#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <support/dice.hpp>
#include <support/forwarding_problem.hpp>

#include "core/result.hpp"

namespace ipminmax::testing {

/// A problem with what models have that were not written by hand: f has squared hinges, t|t| and
/// |t|^3, whose second derivatives jump or have a kink; rows stand there twice, or repeat a bound;
/// nobody reads the last variables.
class OddProblem final : public ForwardingProblem {
 public:
  /// plain: with the pieces of f alone, for a judge that asks for independent gradients and a best y.
  OddProblem(Problem& problem, std::uint64_t seed, bool plain = false)
      : ForwardingProblem(problem),
        structure_(problem.structure()),
        variables_(structure_.variable_players.size()),
        rows_(structure_.constraint_players.size()),
        entries_(structure_.jacobian.size()),
        curvatures_(structure_.hessian.size()) {
    structure_.variable_names.clear();
    structure_.constraint_names.clear();
    Dice dice(seed);
    add_pieces(dice);
    if (plain) return;
    add_rows(dice);
    for (int k = dice.below(3); k > 0; --k) add_unused(dice);
  }

  /// The result as one of the plain problem: multipliers of rows go to what they repeat.
  [[nodiscard]] Result plain(Result result) const {
    for (std::size_t k = 0; k < repeated_.size(); ++k) {
      const auto& [of_variable, of, factor] = repeated_[k];
      const double force = factor * result.lambda[rows_ + k];
      // z of Max are negative.
      const bool at_upper =
          (force > 0.0) == (structure_.variable_players[of_variable ? of : 0] == Player::Min);
      if (!of_variable) result.lambda[of] += force;
      if (of_variable && at_upper) result.z_upper[of] += force;
      if (of_variable && !at_upper) result.z_lower[of] -= force;
    }
    result.lambda.resize(rows_);
    for (std::vector<double>* values : {&result.v, &result.z_lower, &result.z_upper})
      values->resize(variables_);
    return result;
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (start.needs_multipliers) return false;
    StartingPoint inner = start;
    inner.v = start.v.first(variables_);
    std::fill(start.v.begin(), start.v.end(), 0.25);
    return ForwardingProblem::starting_point(inner);
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    if (!ForwardingProblem::objective(v.first(variables_), new_v, f)) return false;
    for (const Piece& piece : pieces_) f += piece.value(v[piece.variable]);
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    std::fill(grad.begin(), grad.end(), 0.0);
    if (!ForwardingProblem::gradient(v.first(variables_), new_v, grad.first(variables_)))
      return false;
    for (const Piece& piece : pieces_) grad[piece.variable] += piece.slope(v[piece.variable]);
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    if (rows_ > 0 && !ForwardingProblem::constraints(v.first(variables_), new_v, g.first(rows_)))
      return false;
    for (std::size_t k = 0; k < repeated_.size(); ++k) {
      const Repeated& row = repeated_[k];
      g[rows_ + k] = row.factor * (row.of_variable ? v[row.of] : g[row.of]);
    }
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    if (entries_ > 0 &&
        !ForwardingProblem::jacobian(v.first(variables_), new_v, values.first(entries_)))
      return false;
    std::size_t next = entries_;
    for (const Repeated& row : repeated_) {
      if (row.of_variable) values[next++] = row.factor;
      for (std::size_t k = 0; !row.of_variable && k < entries_; ++k) {
        const bool same = static_cast<std::size_t>(structure_.jacobian[k].row) == row.of;
        if (same) values[next++] = row.factor * values[k];
      }
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    std::vector<double> sums(lambda.begin(), lambda.begin() + static_cast<std::ptrdiff_t>(rows_));
    for (std::size_t k = 0; k < repeated_.size(); ++k) {
      const Repeated& row = repeated_[k];
      if (!row.of_variable) sums[row.of] += row.factor * lambda[rows_ + k];
    }
    if (!ForwardingProblem::hessian(v.first(variables_), new_v, sigma, sums, true,
                                    values.first(curvatures_)))
      return false;
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      values[curvatures_ + k] = sigma * pieces_[k].curvature(v[pieces_[k].variable]);
    }
    return true;
  }

 private:
  static constexpr double kNone = 1e20;  ///< bound
  /// s max(0, t)^2, s t|t| or s |t|^3 of t = v - b.
  struct Piece {
    std::size_t variable;
    int kind;
    double s, b;
    [[nodiscard]] double value(double v) const {
      const double t = v - b, size = kind == 0 ? std::max(t, 0.0) : std::abs(t);
      return s * (kind == 0 ? size * size : kind == 1 ? t * size : size * size * size);
    }
    [[nodiscard]] double slope(double v) const {
      const double t = v - b, size = kind == 0 ? std::max(t, 0.0) : std::abs(t);
      return s * (kind == 2 ? 3.0 * t * size : 2.0 * size);
    }
    [[nodiscard]] double curvature(double v) const {
      const double t = v - b;
      if (kind == 2) return 6.0 * s * std::abs(t);
      return 2.0 * s * (t > 0.0 ? 1.0 : kind == 0 ? 0.0 : -1.0);
    }
  };
  struct Repeated {
    bool of_variable;
    std::size_t of;
    double factor;
  };

  void add_pieces(Dice& dice) {
    for (int k = dice.below(3); k > 0; --k) {
      const auto i = static_cast<std::size_t>(dice.below(static_cast<int>(variables_)));
      const double right = structure_.variable_players[i] == Player::Min ? 1.0 : -1.0;
      const double s =
          (dice.chance(0.8) ? right : -right) * std::pow(10.0, dice.between(-3.0, 2.0));
      pieces_.push_back({i, dice.below(3), s, dice.chance(0.5) ? 0.0 : dice.between(-1.0, 1.0)});
      structure_.hessian.push_back({static_cast<Index>(i), static_cast<Index>(i)});
    }
  }
  void add_rows(Dice& dice) {
    const auto add = [&](Repeated row, Player player, double lower, double upper) {
      structure_.constraint_players.push_back(player);
      lower *= std::abs(lower) < 1e19 ? row.factor : row.factor > 0.0 ? 1.0 : -1.0;
      upper *= std::abs(upper) < 1e19 ? row.factor : row.factor > 0.0 ? 1.0 : -1.0;
      if (row.factor < 0.0) std::swap(lower, upper);
      structure_.constraint_lower.push_back(lower);
      structure_.constraint_upper.push_back(upper);
      const auto number = static_cast<Index>(rows_ + repeated_.size());
      if (row.of_variable) structure_.jacobian.push_back({number, static_cast<Index>(row.of)});
      for (std::size_t k = 0; !row.of_variable && k < entries_; ++k) {
        const Triplet entry = structure_.jacobian[k];
        if (static_cast<std::size_t>(entry.row) == row.of)
          structure_.jacobian.push_back({number, entry.col});
      }
      repeated_.push_back(row);
    };
    for (std::size_t j = 0; j < rows_; ++j) {
      if (!dice.chance(0.3)) continue;
      add({false, j, dice.one_of({1.0, -1.0, 2.0, 1e-3})}, structure_.constraint_players[j],
          structure_.constraint_lower[j], structure_.constraint_upper[j]);
    }
    for (std::size_t i = 0; i < variables_; ++i) {
      if (!dice.chance(0.3)) continue;
      add({true, i, dice.one_of({1.0, -1.0, 2.0})}, structure_.variable_players[i],
          structure_.variable_lower[i], structure_.variable_upper[i]);
    }
  }
  void add_unused(Dice& dice) {
    structure_.variable_players.push_back(dice.chance(0.7) ? Player::Max : Player::Min);
    const bool bounded = dice.chance(0.5);
    structure_.variable_lower.push_back(bounded ? -1.0 : -kNone);
    structure_.variable_upper.push_back(bounded ? 1.0 : kNone);
  }

  ProblemStructure structure_;
  std::size_t variables_, rows_, entries_, curvatures_;
  std::vector<Piece> pieces_;
  std::vector<Repeated> repeated_;
};

}  // namespace ipminmax::testing
