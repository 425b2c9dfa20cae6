#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "autodiff.hpp"
#include "problem.hpp"

/// @file
/// Models written as formulas, with exact derivatives and sparsity, for those who do not want
/// to write derivatives. Functions are templates of the number type:
///
///     struct Game {
///       template <class T> T objective(std::span<const T> v) const {
///         return v[0] * v[0] - v[1] * v[1];
///       }
///       template <class T> void constraints(std::span<const T> v, std::span<T> g) const {
///         g[0] = v[0] + sin(v[1]);
///       }
///     };
///     using ipminmax::Player;
///     ipminmax::AutodiffProblem problem(Game{}, {.players = {Player::Min, Player::Max},
///                                                .start = {1.0, 0.0},
///                                                .constraint_lower = {-1e20},
///                                                .constraint_upper = {2.0}});
///
/// Structure is found once, at the start (autodiff.hpp). Values are the formulas' with plain
/// numbers; derivatives at a new point take one recording of their operations and sweeps over them.
/// Branches on values (comparisons compare values) are allowed where they do not change which
/// variables a function reads.
namespace ipminmax {

/// Everything of a model but its functions.
struct ModelData {
  std::vector<Player> players;                                 ///< n
  std::vector<double> start;                                   ///< n
  std::vector<double> lower{}, upper{};                        ///< n, or empty: no bounds
  std::vector<double> constraint_lower{}, constraint_upper{};  ///< m
  std::vector<Player> constraint_players{};  ///< m, or empty: as the formulas imply
  std::vector<std::string> variable_names{}, constraint_names{};  ///< n, m, or empty
};

/// The problem of Functions with members
///
///     template <class T> T objective(std::span<const T> v) const;                       // v: n
///     template <class T> void constraints(std::span<const T> v, std::span<T> g) const;  // g: m
///
/// the second only where m > 0.
/// Values that are not finite make an evaluation undefined (false).
template <class Functions>
class AutodiffProblem : public Problem {
 public:
  /// std::invalid_argument: the lengths of data do not fit together, or the start's do not.
  AutodiffProblem(Functions functions, ModelData data)
      : functions_(std::move(functions)), start_(std::move(data.start)) {
    constexpr double kNone = 2e19;
    const std::size_t n = data.players.size();
    const std::size_t m = data.constraint_lower.size();
    if (data.lower.empty()) data.lower.assign(n, -kNone);
    if (data.upper.empty()) data.upper.assign(n, kNone);
    if (start_.size() != n || data.lower.size() != n || data.upper.size() != n ||
        data.constraint_upper.size() != m ||
        (!data.constraint_players.empty() && data.constraint_players.size() != m)) {
      throw std::invalid_argument("players, start and bounds of a model do not fit together");
    }
    structure_.variable_players = std::move(data.players);
    structure_.variable_lower = std::move(data.lower);
    structure_.variable_upper = std::move(data.upper);
    structure_.constraint_lower = std::move(data.constraint_lower);
    structure_.constraint_upper = std::move(data.constraint_upper);
    structure_.variable_names = std::move(data.variable_names);
    structure_.constraint_names = std::move(data.constraint_names);
    tape_.emplace(static_cast<Index>(n), m + 1);
    record(start_);
    find_structure();
    structure_.constraint_players = data.constraint_players.empty()
                                        ? implied_constraint_players(structure_)
                                        : std::move(data.constraint_players);
  }

  [[nodiscard]] const Functions& functions() const { return functions_; }
  /// For the next solves: other numbers, read by the functions; formulas that read the same
  /// variables.
  [[nodiscard]] Functions& functions() {
    point_.clear();
    return functions_;
  }
  void set_start(std::vector<double> start) {
    if (start.size() != start_.size()) throw std::invalid_argument("length of a start");
    start_ = std::move(start);
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    return !start.needs_multipliers;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = functions_.template objective<Plain>(plain(v)).value();
    return std::isfinite(f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    record(v);
    const std::size_t m = structure_.constraint_lower.size();
    derivatives_.assign(structure_.jacobian.size() + gradient_columns_.size(), 0.0);
    tape_->jacobian(m, m + 1, derivatives_);
    std::ranges::fill(grad, 0.0);
    for (std::size_t k = 0; k < gradient_columns_.size(); ++k) {
      grad[at(gradient_columns_[k])] = derivatives_[structure_.jacobian.size() + k];
    }
    return all_finite(grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    plain_results_.resize(g.size());
    run_constraints(plain(v), std::span(plain_results_));
    for (std::size_t j = 0; j < g.size(); ++j) g[j] = plain_results_[j].value();
    return all_finite(g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    record(v);
    std::ranges::fill(values, 0.0);
    tape_->jacobian(0, structure_.constraint_lower.size(), values);
    return all_finite(values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    record(v);
    weights_.assign(lambda.begin(), lambda.end());
    weights_.push_back(sigma);
    std::ranges::fill(values, 0.0);
    tape_->hessian(weights_, values);
    return all_finite(values);
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  static bool all_finite(std::span<const double> values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  }

  std::span<const Plain> plain(std::span<const double> v) {
    plain_.assign(v.begin(), v.end());
    return plain_;
  }
  template <class T>
  void run_constraints(std::span<const T> v, std::span<T> g) const {
    if constexpr (requires { functions_.template constraints<T>(v, g); }) {
      functions_.template constraints<T>(v, g);
    } else if (!g.empty()) {
      throw std::invalid_argument("a model with bounds of constraints has no constraints()");
    }
  }

  /// The operations at v: of the constraints, then of the objective.
  void record(std::span<const double> v) {
    if (std::ranges::equal(v, point_)) return;
    point_.clear();
    tape_->record(v, [&](std::span<const Taped> arguments, std::span<Taped> outputs) {
      outputs.back() = functions_.template objective<Taped>(arguments);
      run_constraints(arguments, outputs.first(outputs.size() - 1));
    });
    point_.assign(v.begin(), v.end());
  }

  void find_structure() {
    autodiff::Pattern pattern = tape_->pattern();
    structure_.hessian = pattern.hessian;
    structure_.jacobian = pattern.jacobian;
    const Index m = static_cast<Index>(structure_.constraint_lower.size());
    while (!structure_.jacobian.empty() && structure_.jacobian.back().row == m) {
      gradient_columns_.push_back(structure_.jacobian.back().col);
      structure_.jacobian.pop_back();
    }
    std::ranges::reverse(gradient_columns_);
    tape_->set_pattern(std::move(pattern));
  }

  Functions functions_;
  ProblemStructure structure_;
  std::vector<double> start_;
  std::vector<double> point_;  ///< of the tape; empty: none
  std::optional<autodiff::Tape> tape_;
  std::vector<Index> gradient_columns_;  ///< variables that the objective reads
  std::vector<double> derivatives_, weights_;
  std::vector<Plain> plain_, plain_results_;
};

}  // namespace ipminmax
