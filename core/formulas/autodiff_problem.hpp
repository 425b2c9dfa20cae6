#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

#include "../problem.hpp"
#include "autodiff.hpp"

/// @file
/// Models written as formulas; derivatives and sparsity are exact and found automatically.
/// Functions are templates of the number type:
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
/// The structure is found once, at the start (autodiff.hpp). Values are computed with plain
/// numbers; derivatives at a new point take one recording of the operations and sweeps over it.
/// Formulas may branch on values if that does not change which variables a function reads.
namespace ipminmax {

/// A model without its functions.
struct ModelData {
  std::vector<Player> players;                                 ///< n
  std::vector<double> start;                                   ///< n
  std::vector<double> lower{}, upper{};                        ///< n, or empty: no bounds
  std::vector<double> constraint_lower{}, constraint_upper{};  ///< m
  std::vector<Player> constraint_players{};  ///< m, or empty: implied_constraint_players
  std::vector<std::string> variable_names{}, constraint_names{};  ///< n, m, or empty
};

/// The problem of Functions with members
///
///     template <class T> T objective(std::span<const T> v) const;                       // v: n
///     template <class T> void constraints(std::span<const T> v, std::span<T> g) const;  // g: m
///
/// The second is needed only if m > 0. Instead of it
///
///     template <class T> T constraint(std::size_t j, std::span<const T> v) const;       // g_j
///
/// may be given: then only the constraints that are needed are evaluated. If a value is not finite,
/// the evaluation returns false.
template <class Functions>
class AutodiffProblem : public Problem {
 public:
  /// Throws std::invalid_argument if the lengths of players, start and bounds differ.
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
    for (std::size_t j = 0; j < m; ++j) all_rows_.push_back(static_cast<Index>(j));
    if constexpr (kByRows) {
      const auto work = std::make_shared<autodiff::Tape::Work>();
      for (std::size_t j = 0; j <= m; ++j) parts_.push_back({{static_cast<Index>(n), 1, work}, j});
    } else {
      parts_.push_back({{static_cast<Index>(n), m + 1}, 0});
    }
    find_structure();
    structure_.constraint_players = data.constraint_players.empty()
                                        ? implied_constraint_players(structure_)
                                        : std::move(data.constraint_players);
  }

  [[nodiscard]] const Functions& functions() const { return functions_; }
  /// Gives access to the functions, to change numbers in them for the next solves. They must read
  /// the same variables as before.
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
    const std::size_t m = structure_.constraint_lower.size();
    derivatives_.assign(begin_.back(), 0.0);
    visit(v);
    slopes(m, derivatives_);
    std::ranges::fill(grad, 0.0);
    for (std::size_t k = 0; k < gradient_columns_.size(); ++k) {
      grad[at(gradient_columns_[k])] = derivatives_[begin_[m] + k];
    }
    return all_finite(grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    return constraint_rows(all_rows_, v, new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    return jacobian_rows(all_rows_, v, new_v, values);
  }
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                     std::span<double> g) override {
    const std::span<const Plain> in = plain(v);
    if constexpr (kByRows) {
      for (const Index j : rows)
        g[at(j)] = functions_.template constraint<Plain>(at(j), in).value();
    } else {
      plain_results_.resize(g.size());
      run_constraints(in, std::span(plain_results_));
      for (const Index j : rows) g[at(j)] = plain_results_[at(j)].value();
    }
    return std::ranges::all_of(rows, [&](Index j) { return std::isfinite(g[at(j)]); });
  }
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                   std::span<double> values) override {
    visit(v);
    return std::ranges::all_of(rows, [&](Index j) {
      const auto own = values.subspan(begin_[at(j)], begin_[at(j) + 1] - begin_[at(j)]);
      std::ranges::fill(own, 0.0);
      slopes(at(j), values);
      return all_finite(own);
    });
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    weights_.assign(lambda.begin(), lambda.end());
    weights_.push_back(sigma);
    std::ranges::fill(values, 0.0);
    visit(v);
    for (Part& part : parts_) {
      const auto own = kByRows ? std::span(weights_).subspan(part.first, 1) : std::span(weights_);
      if (kByRows && own[0] == 0.0) continue;
      record(part);
      derivatives_.assign(part.hessian.size(), 0.0);
      part.tape.hessian(own, derivatives_);
      for (std::size_t e = 0; e < part.hessian.size(); ++e)
        values[part.hessian[e]] += derivatives_[e];
    }
    return all_finite(values);
  }
  /// Copies the functions, of which a copy must not write what others read; null for a derived
  /// class that does not override it.
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    if (typeid(*this) != typeid(AutodiffProblem)) return nullptr;
    return std::make_unique<AutodiffProblem>(functions_, data());
  }

 protected:
  /// What it was made from, with the present start.
  [[nodiscard]] ModelData data() const {
    const ProblemStructure& s = structure_;
    return {s.variable_players,   start_,
            s.variable_lower,     s.variable_upper,
            s.constraint_lower,   s.constraint_upper,
            s.constraint_players, s.variable_names,
            s.constraint_names};
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

  /// Whether each constraint has a formula of its own.
  static constexpr bool kByRows = requires(const Functions& f, std::span<const Plain> v) {
    f.template constraint<Plain>(std::size_t{}, v);
  };
  /// Outputs that are recorded together, of all constraints and, the last, of the objective: all,
  /// or one.
  struct Part {
    autodiff::Tape tape;
    std::size_t first = 0;
    std::size_t visit = 0;               ///< number of the point that it recorded; 0: none
    std::vector<std::size_t> hessian{};  ///< where its entries stand
  };
  /// Sets the point of the next recordings.
  void visit(std::span<const double> v) {
    if (std::ranges::equal(v, point_) && visits_ > 0) return;
    parts_.front().tape.set_point(v);
    point_.assign(v.begin(), v.end());
    ++visits_;
  }
  void record(Part& part) {
    if (part.visit == visits_) return;
    part.visit = 0;
    static_cast<void>(part.tape.run([&](std::span<const Taped> in, std::span<Taped> out) {
      if constexpr (kByRows) {
        out[0] = part.first < all_rows_.size()
                     ? functions_.template constraint<Taped>(part.first, in)
                     : functions_.template objective<Taped>(in);
      } else {
        out.back() = functions_.template objective<Taped>(in);
        run_constraints(in, out.first(out.size() - 1));
      }
    }));
    part.visit = visits_;
  }
  /// Of one output at the point, to their places among those of all.
  void slopes(std::size_t output, std::span<double> values) {
    Part& part = parts_[kByRows ? output : 0];
    record(part);
    if constexpr (kByRows)
      part.tape.jacobian(0, 1, values.subspan(begin_[output]));
    else
      part.tape.jacobian(output, output + 1, values);
  }

  void find_structure() {
    const auto before = [](Triplet s, Triplet t) {
      return std::pair(s.col, s.row) < std::pair(t.col, t.row);
    };
    std::vector<Triplet>& all = structure_.hessian;
    visit(start_);
    for (Part& part : parts_) {
      record(part);
      const autodiff::Pattern& own = part.tape.pattern();
      all.insert(all.end(), own.hessian.begin(), own.hessian.end());
      for (const auto& [row, col] : own.jacobian)
        structure_.jacobian.push_back({row + static_cast<Index>(part.first), col});
    }
    std::ranges::sort(all, before);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (Part& part : parts_) {
      autodiff::Pattern own = part.tape.pattern();
      for (const Triplet& entry : own.hessian)
        part.hessian.push_back(
            static_cast<std::size_t>(std::ranges::lower_bound(all, entry, before) - all.begin()));
      part.tape.set_pattern(std::move(own));
    }
    const Index m = static_cast<Index>(all_rows_.size());
    begin_.assign(at(m) + 2, 0);
    for (const auto& [row, col] : structure_.jacobian) begin_[at(row) + 1] += 1;
    for (std::size_t j = 0; j <= at(m); ++j) begin_[j + 1] += begin_[j];
    while (!structure_.jacobian.empty() && structure_.jacobian.back().row == m) {
      gradient_columns_.push_back(structure_.jacobian.back().col);
      structure_.jacobian.pop_back();
    }
    std::ranges::reverse(gradient_columns_);
  }

  Functions functions_;
  ProblemStructure structure_;
  std::vector<double> start_;
  std::vector<Index> all_rows_;
  std::vector<Part> parts_;
  std::vector<double> point_;            ///< of the last derivatives; empty: none
  std::size_t visits_ = 0;               ///< points so far
  std::vector<std::size_t> begin_;       ///< of each output's slopes among those of all
  std::vector<Index> gradient_columns_;  ///< variables that the objective reads
  std::vector<double> derivatives_, weights_;
  std::vector<Plain> plain_, plain_results_;
};

}  // namespace ipminmax
