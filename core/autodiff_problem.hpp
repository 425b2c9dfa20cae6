#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "problem.hpp"

/// Small models written as formulas, with exact derivatives and sparsity, for those who do not want
/// to write derivatives. Functions are templates of the number type:
///
///   struct Game {
///     template <class T> T objective(std::span<const T> v) const {
///       return v[0] * v[0] - v[1] * v[1];
///     }
///     template <class T> void constraints(std::span<const T> v, std::span<T> g) const {
///       g[0] = v[0] + sin(v[1]);
///     }
///   };
///   using ipminmax::Player;
///   ipminmax::AutodiffProblem problem(Game{}, {.players = {Player::Min, Player::Max},
///                                              .start = {1.0, 0.0},
///                                              .constraint_lower = {-1e20},
///                                              .constraint_upper = {2.0}});
///
/// Each evaluation at a new point records the operations. A gradient is one sweep over them, a
/// Hessian two sweeps per variable: some hundred variables are few enough. Branches on values
/// (comparisons compare values) are allowed where they do not change which variables a function
/// reads.
namespace ipminmax {

/// An operation with partial derivatives in its operands; -1: no operand.
struct TapeNode {
  Index a = -1, b = -1;
  double da = 0.0, db = 0.0;
  double daa = 0.0, dab = 0.0, dbb = 0.0;
  bool bends_a = false, bends_ab = false,
       bends_b = false;  ///< where second derivatives may be nonzero
};
using Tape = std::vector<TapeNode>;

/// A number that remembers how it was computed, or a constant.
class Taped {
 public:
  Taped(double constant = 0.0) : value_(constant) {}  // NOLINT: conversion is the point
  Taped(Tape& tape, double value, const TapeNode& node)
      : value_(value), tape_(&tape), node_(static_cast<Index>(tape.size())) {
    tape.push_back(node);
  }

  [[nodiscard]] double value() const { return value_; }
  [[nodiscard]] Index node() const { return node_; }  ///< -1: a constant

  friend Taped operator+(const Taped& a, const Taped& b) {
    return binary(a, b, a.value_ + b.value_, {.da = 1.0, .db = 1.0});
  }
  friend Taped operator-(const Taped& a, const Taped& b) {
    return binary(a, b, a.value_ - b.value_, {.da = 1.0, .db = -1.0});
  }
  friend Taped operator*(const Taped& a, const Taped& b) {
    return binary(a, b, a.value_ * b.value_,
                  {.da = b.value_, .db = a.value_, .dab = 1.0, .bends_ab = true});
  }
  friend Taped operator/(const Taped& a, const Taped& b) {
    const double inverse = 1.0 / b.value_;
    const double ratio = a.value_ * inverse;
    return binary(a, b, ratio,
                  {.da = inverse,
                   .db = -ratio * inverse,
                   .dab = -inverse * inverse,
                   .dbb = 2.0 * ratio * inverse * inverse,
                   .bends_ab = true,
                   .bends_b = true});
  }
  friend Taped operator-(const Taped& a) { return 0.0 - a; }
  friend Taped operator+(const Taped& a) { return a; }
  Taped& operator+=(const Taped& b) { return *this = *this + b; }
  Taped& operator-=(const Taped& b) { return *this = *this - b; }
  Taped& operator*=(const Taped& b) { return *this = *this * b; }
  Taped& operator/=(const Taped& b) { return *this = *this / b; }
  friend auto operator<=>(const Taped& a, const Taped& b) { return a.value_ <=> b.value_; }
  friend bool operator==(const Taped& a, const Taped& b) { return a.value_ == b.value_; }

  friend Taped sqrt(const Taped& a) {
    const double root = std::sqrt(a.value_);
    return unary(a, root, 0.5 / root, -0.25 / (root * a.value_));
  }
  friend Taped exp(const Taped& a) {
    const double e = std::exp(a.value_);
    return unary(a, e, e, e);
  }
  friend Taped log(const Taped& a) {
    const double inverse = 1.0 / a.value_;
    return unary(a, std::log(a.value_), inverse, -inverse * inverse);
  }
  friend Taped sin(const Taped& a) {
    const double s = std::sin(a.value_);
    return unary(a, s, std::cos(a.value_), -s);
  }
  friend Taped cos(const Taped& a) {
    const double c = std::cos(a.value_);
    return unary(a, c, -std::sin(a.value_), -c);
  }
  friend Taped tan(const Taped& a) {
    const double t = std::tan(a.value_);
    return unary(a, t, 1.0 + t * t, 2.0 * t * (1.0 + t * t));
  }
  friend Taped asin(const Taped& a) {
    const double c = 1.0 - a.value_ * a.value_;
    return unary(a, std::asin(a.value_), 1.0 / std::sqrt(c), a.value_ / (c * std::sqrt(c)));
  }
  friend Taped acos(const Taped& a) {
    const double c = 1.0 - a.value_ * a.value_;
    return unary(a, std::acos(a.value_), -1.0 / std::sqrt(c), -a.value_ / (c * std::sqrt(c)));
  }
  friend Taped atan(const Taped& a) {
    const double d = 1.0 / (1.0 + a.value_ * a.value_);
    return unary(a, std::atan(a.value_), d, -2.0 * a.value_ * d * d);
  }
  friend Taped atan2(const Taped& y, const Taped& x) {
    const double d = 1.0 / (x.value_ * x.value_ + y.value_ * y.value_);
    const double bend = 2.0 * x.value_ * y.value_ * d * d;
    return binary(y, x, std::atan2(y.value_, x.value_),
                  {.da = x.value_ * d,
                   .db = -y.value_ * d,
                   .daa = -bend,
                   .dab = (y.value_ * y.value_ - x.value_ * x.value_) * d * d,
                   .dbb = bend,
                   .bends_a = true,
                   .bends_ab = true,
                   .bends_b = true});
  }
  friend Taped sinh(const Taped& a) {
    const double s = std::sinh(a.value_);
    return unary(a, s, std::cosh(a.value_), s);
  }
  friend Taped cosh(const Taped& a) {
    const double c = std::cosh(a.value_);
    return unary(a, c, std::sinh(a.value_), c);
  }
  friend Taped tanh(const Taped& a) {
    const double t = std::tanh(a.value_);
    return unary(a, t, 1.0 - t * t, -2.0 * t * (1.0 - t * t));
  }
  /// Not differentiable at 0, where the derivative is that of a.
  friend Taped abs(const Taped& a) { return a.value_ < 0.0 ? -a : a; }
  friend Taped fabs(const Taped& a) { return abs(a); }
  friend Taped square(const Taped& a) { return unary(a, a.value_ * a.value_, 2.0 * a.value_, 2.0); }
  friend Taped pow(const Taped& a, double p) {
    if (p == 0.0) return 1.0;
    if (p == 1.0) return a;
    return unary(a, std::pow(a.value_, p), p * std::pow(a.value_, p - 1.0),
                 p == 2.0 ? 2.0 : p * (p - 1.0) * std::pow(a.value_, p - 2.0));
  }
  friend Taped pow(const Taped& a, int p) { return pow(a, static_cast<double>(p)); }
  /// a > 0.
  friend Taped pow(const Taped& a, const Taped& b) {
    return b.node_ < 0 ? pow(a, b.value_) : exp(b * log(a));
  }

 private:
  static Taped unary(const Taped& a, double value, double slope, double bend) {
    if (a.node_ < 0) return value;
    return {*a.tape_, value, {.a = a.node_, .da = slope, .daa = bend, .bends_a = true}};
  }
  static Taped binary(const Taped& a, const Taped& b, double value, TapeNode node) {
    if (a.node_ < 0 && b.node_ < 0) return value;
    node.a = a.node_;
    node.b = b.node_;
    return {a.node_ < 0 ? *b.tape_ : *a.tape_, value, node};
  }

  double value_ = 0.0;
  Tape* tape_ = nullptr;
  Index node_ = -1;
};

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
///   template <class T> T objective(std::span<const T> v) const;                       // v: n
///   template <class T> void constraints(std::span<const T> v, std::span<T> g) const;  // g: m
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
    outputs_.resize(m + 1);
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
    record(v);
    f = outputs_.back().value();
    return std::isfinite(f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    record(v);
    sweep_back(outputs_.back());
    std::copy_n(adjoint_.begin(), grad.size(), grad.begin());
    return all_finite(grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    record(v);
    for (std::size_t j = 0; j < g.size(); ++j) g[j] = outputs_[j].value();
    return all_finite(g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    record(v);
    std::size_t k = 0;
    while (k < values.size()) {
      const Index row = structure_.jacobian[k].row;
      sweep_back(outputs_[at(row)]);
      for (; k < values.size() && structure_.jacobian[k].row == row; ++k) {
        values[k] = adjoint_[at(structure_.jacobian[k].col)];
      }
    }
    return all_finite(values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    record(v);
    std::fill(weights_.begin(), weights_.end(), 0.0);
    for (std::size_t j = 0; j < outputs_.size(); ++j) {
      const double weight = j + 1 == outputs_.size() ? sigma : lambda[j];
      if (outputs_[j].node() >= 0) weights_[at(outputs_[j].node())] += weight;
    }
    std::size_t k = 0;
    while (k < values.size()) {
      const Index col = structure_.hessian[k].col;
      second_sweeps(col);
      for (; k < values.size() && structure_.hessian[k].col == col; ++k) {
        values[k] = adjoint_tangent_[at(structure_.hessian[k].row)];
      }
    }
    return all_finite(values);
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  static bool all_finite(std::span<const double> values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  }

  /// The operations at v; variables are the first n nodes.
  void record(std::span<const double> v) {
    if (std::ranges::equal(v, point_)) return;
    tape_.clear();
    variables_.clear();
    for (const double value : v) variables_.emplace_back(tape_, value, TapeNode{});
    const std::span<const Taped> arguments(variables_);
    outputs_.back() = functions_.template objective<Taped>(arguments);
    if constexpr (requires(std::span<Taped> g) {
                    functions_.template constraints<Taped>(arguments, g);
                  }) {
      functions_.template constraints<Taped>(arguments,
                                             std::span<Taped>(outputs_).first(outputs_.size() - 1));
    } else if (outputs_.size() > 1) {
      throw std::invalid_argument("a model with bounds of constraints has no constraints()");
    }
    point_.assign(v.begin(), v.end());
    adjoint_.resize(tape_.size());
    tangent_.resize(tape_.size());
    adjoint_tangent_.resize(tape_.size());
    weights_.resize(tape_.size());
    if (!operands_.empty() && !has_known_operands()) check_structure();
  }

  [[nodiscard]] bool has_known_operands() const {
    return std::ranges::equal(tape_, operands_, [](const TapeNode& node, const auto& known) {
      return node.a == known.first && node.b == known.second;
    });
  }
  void remember_operands() {
    operands_.clear();
    for (const TapeNode& node : tape_) operands_.emplace_back(node.a, node.b);
  }

  using Words = std::vector<std::uint64_t>;  ///< a set of variables
  static bool contains(const Words& set, std::size_t i) {
    return (set[i / 64] >> (i % 64) & 1U) != 0;
  }
  static void include(Words& set, const Words& other) {
    for (std::size_t w = 0; w < set.size(); ++w) set[w] |= other[w];
  }

  struct Pattern {
    std::vector<Triplet> jacobian, hessian;  ///< by rows; lower triangle, by columns
  };
  /// Which variables each function reads, and which pairs it may bend in.
  [[nodiscard]] Pattern pattern() const {
    const std::size_t n = variables_.size();
    const Words none((n + 63) / 64, 0);
    std::vector<Words> reads(tape_.size(), none);
    std::vector<Words> pairs(n, none);
    const auto cross = [&](const Words& first, const Words& second) {
      for (std::size_t i = 0; i < n; ++i) {
        if (contains(first, i)) include(pairs[i], second);
        if (contains(second, i)) include(pairs[i], first);
      }
    };
    for (std::size_t k = 0; k < tape_.size(); ++k) {
      if (k < n) {
        reads[k][k / 64] |= std::uint64_t{1} << (k % 64);
        continue;
      }
      const TapeNode& node = tape_[k];
      if (node.a >= 0) include(reads[k], reads[at(node.a)]);
      if (node.b >= 0) include(reads[k], reads[at(node.b)]);
      if (node.a >= 0 && node.bends_a) cross(reads[at(node.a)], reads[at(node.a)]);
      if (node.b >= 0 && node.bends_b) cross(reads[at(node.b)], reads[at(node.b)]);
      if (node.a >= 0 && node.b >= 0 && node.bends_ab) cross(reads[at(node.a)], reads[at(node.b)]);
    }
    Pattern found;
    for (std::size_t j = 0; j + 1 < outputs_.size(); ++j) {
      if (outputs_[j].node() < 0) continue;
      for (std::size_t i = 0; i < n; ++i) {
        if (!contains(reads[at(outputs_[j].node())], i)) continue;
        found.jacobian.push_back({static_cast<Index>(j), static_cast<Index>(i)});
      }
    }
    for (std::size_t col = 0; col < n; ++col) {
      for (std::size_t row = col; row < n; ++row) {
        if (!contains(pairs[col], row)) continue;
        found.hessian.push_back({static_cast<Index>(row), static_cast<Index>(col)});
      }
    }
    return found;
  }
  void find_structure() {
    Pattern found = pattern();
    structure_.jacobian = std::move(found.jacobian);
    structure_.hessian = std::move(found.hessian);
    remember_operands();
  }
  /// Other operations than at the start: they may not read more.
  void check_structure() {
    const Pattern now = pattern();
    const auto within = [](const std::vector<Triplet>& part, const std::vector<Triplet>& whole) {
      return std::ranges::all_of(part, [&](const Triplet& entry) {
        return std::ranges::any_of(whole, [&](const Triplet& known) {
          return known.row == entry.row && known.col == entry.col;
        });
      });
    };
    if (!within(now.jacobian, structure_.jacobian) || !within(now.hessian, structure_.hessian)) {
      point_.clear();
      throw std::logic_error("a branch in the model's formulas changes which variables they read");
    }
    remember_operands();
  }

  void sweep_back(const Taped& output) {
    std::ranges::fill(adjoint_, 0.0);
    if (output.node() < 0) return;
    adjoint_[at(output.node())] = 1.0;
    for (std::size_t k = at(output.node()) + 1; k-- > variables_.size();) {
      const double weight = adjoint_[k];
      if (weight == 0.0) continue;
      const TapeNode& node = tape_[k];
      if (node.a >= 0) adjoint_[at(node.a)] += node.da * weight;
      if (node.b >= 0) adjoint_[at(node.b)] += node.db * weight;
    }
  }

  /// Derivatives along variable col, then their gradient: a column of the Hessian.
  void second_sweeps(Index col) {
    const std::size_t n = variables_.size();
    for (std::size_t k = 0; k < tape_.size(); ++k) {
      const TapeNode& node = tape_[k];
      tangent_[k] = k < n ? (k == at(col) ? 1.0 : 0.0)
                          : (node.a >= 0 ? node.da * tangent_[at(node.a)] : 0.0) +
                                (node.b >= 0 ? node.db * tangent_[at(node.b)] : 0.0);
    }
    std::ranges::copy(weights_, adjoint_.begin());
    std::ranges::fill(adjoint_tangent_, 0.0);
    for (std::size_t k = tape_.size(); k-- > n;) {
      const double weight = adjoint_[k];
      const double slope = adjoint_tangent_[k];
      if (weight == 0.0 && slope == 0.0) continue;
      const TapeNode& node = tape_[k];
      const double ta = node.a >= 0 ? tangent_[at(node.a)] : 0.0;
      const double tb = node.b >= 0 ? tangent_[at(node.b)] : 0.0;
      if (node.a >= 0) {
        adjoint_[at(node.a)] += node.da * weight;
        adjoint_tangent_[at(node.a)] += node.da * slope + (node.daa * ta + node.dab * tb) * weight;
      }
      if (node.b >= 0) {
        adjoint_[at(node.b)] += node.db * weight;
        adjoint_tangent_[at(node.b)] += node.db * slope + (node.dab * ta + node.dbb * tb) * weight;
      }
    }
  }

  Functions functions_;
  ProblemStructure structure_;
  std::vector<double> start_;
  std::vector<double> point_;  ///< of the tape; empty: none
  Tape tape_;
  std::vector<Taped> variables_;
  std::vector<Taped> outputs_;  ///< constraints, then the objective
  std::vector<std::pair<Index, Index>> operands_;
  std::vector<double> adjoint_, tangent_, adjoint_tangent_, weights_;
};

}  // namespace ipminmax
