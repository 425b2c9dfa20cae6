#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "../linalg/triplet.hpp"

/// Exact sparse first and second derivatives of formulas that are written once for any number type.
/// What users write stands in autodiff_problem.hpp and in adapter/stages.hpp; this is what both are
/// made of.
///
/// A recording keeps of every operation its partial derivatives; which operands it has is compared
/// with a *program* that was made at the first recording: the entries of Jacobian and Hessian, and
/// where each term goes. So structure is found once, branches that the formulas take are noticed,
/// and numbers in the formulas may change between recordings.
///
///   Jacobian  one sweep back per output over the operations that it depends on
///   Hessian   of w' outputs: sum over operations k with second derivatives of
///             wbar_k (k_aa da da' + k_ab (da db' + db da') + k_bb db db'),
///             wbar_k the weighted outputs' derivative by k, da, db the sparse gradients of k's
///             operands in the inputs; or, where few inputs are nested deeply, one sweep forward
///             and one back with all directions at once, if that is less work
namespace ipminmax {

namespace autodiff {

/// What second derivatives an operation has.
enum class Bend : std::uint8_t {
  None,     ///< linear
  Product,  ///< k_ab
  Unary,    ///< k_aa
  Binary    ///< k_aa, k_ab, k_bb
};

/// Operands and kind of an operation in one word; an operand is an input, an earlier operation or
/// -1: none.
class Operation {
 public:
  Operation() = default;
  Operation(Index a, Index b, Bend bend)
      : word_(static_cast<std::uint64_t>(a + 1) << 33U | static_cast<std::uint64_t>(b + 1) << 2U |
              static_cast<std::uint64_t>(bend)) {}
  [[nodiscard]] Index a() const { return static_cast<Index>(word_ >> 33U) - 1; }
  [[nodiscard]] Index b() const { return static_cast<Index>(word_ >> 2U & 0x7fffffffU) - 1; }
  [[nodiscard]] Bend bend() const { return static_cast<Bend>(word_ & 3U); }
  friend bool operator==(const Operation&, const Operation&) = default;

 private:
  std::uint64_t word_ = 0;
};

struct Slopes {
  double a = 0.0, b = 0.0;
};

/// The operations of one run of the formulas: inputs are 0, ..., n - 1, operations follow.
class Recording {
 public:
  /// Forgets the last run. known: operations that are expected, or empty.
  void begin(Index inputs, std::span<const Operation> known) {
    inputs_ = inputs;
    count_ = 0;
    known_ = known;
    own_.clear();
    bend_count_ = 0;
    if (slopes_.size() < known.size()) slopes_.resize(known.size());
  }
  [[nodiscard]] Index add(Operation operation, Slopes slopes) {
    if (count_ < known_.size() && known_[count_] == operation) {
      slopes_[count_] = slopes;
    } else {
      add_unknown(operation, slopes);
    }
    return inputs_ + static_cast<Index>(count_++);
  }
  /// A second derivative of the operation that is added next.
  void bend(double second) {
    if (bend_count_ == bends_.size()) bends_.resize(2 * bend_count_ + 64);
    bends_[bend_count_++] = second;
  }

  [[nodiscard]] bool as_known() const { return count_ == known_.size() && own_.empty(); }
  /// All operations of a run that did not go as known.
  [[nodiscard]] std::vector<Operation> operations() const {
    if (!own_.empty()) return own_;
    return {known_.begin(), known_.begin() + static_cast<std::ptrdiff_t>(count_)};
  }
  [[nodiscard]] const Slopes& slopes(std::size_t k) const { return slopes_[k]; }
  [[nodiscard]] const std::vector<double>& bends() const { return bends_; }

 private:
  void add_unknown(Operation operation, Slopes slopes) {
    if (count_ >= static_cast<std::size_t>(std::numeric_limits<Index>::max() - inputs_ - 1)) {
      throw std::length_error("formulas with more than 2^31 operations");
    }
    if (own_.empty()) own_ = operations();
    known_ = {};
    own_.push_back(operation);
    slopes_.resize(std::max(slopes_.size(), count_));
    if (slopes_.size() == count_)
      slopes_.push_back(slopes);
    else
      slopes_[count_] = slopes;
  }

  Index inputs_ = 0;
  std::size_t count_ = 0;
  std::span<const Operation> known_;
  std::vector<Operation> own_;
  std::vector<Slopes> slopes_;
  std::size_t bend_count_ = 0;
  std::vector<double> bends_;
};

/// Of this thread, while formulas run.
inline constinit thread_local Recording* recording = nullptr;

}  // namespace autodiff

/// A number that remembers how it was computed: a constant, or a constant plus factor times an input
/// or operation.
class Taped {
 public:
  Taped(double constant = 0.0) : value_(constant) {}  // NOLINT: conversion is the point
  Taped(double value, Index node, double factor = 1.0)
      : value_(value), factor_(factor), node_(node) {}

  [[nodiscard]] double value() const { return value_; }
  [[nodiscard]] Index node() const { return node_; }  ///< -1: a constant
  [[nodiscard]] double factor() const { return factor_; }

  friend Taped operator+(const Taped& a, const Taped& b) {
    const double value = a.value_ + b.value_;
    if (b.node_ < 0) return {value, a.node_, a.factor_};
    if (a.node_ < 0) return {value, b.node_, b.factor_};
    return linear(a, b, value, b.factor_);
  }
  friend Taped operator-(const Taped& a, const Taped& b) {
    const double value = a.value_ - b.value_;
    if (b.node_ < 0) return {value, a.node_, a.factor_};
    if (a.node_ < 0) return {value, b.node_, -b.factor_};
    return linear(a, b, value, -b.factor_);
  }
  friend Taped operator*(const Taped& a, const Taped& b) {
    const double value = a.value_ * b.value_;
    if (b.node_ < 0) return {value, a.node_, a.factor_ * b.value_};
    if (a.node_ < 0) return {value, b.node_, b.factor_ * a.value_};
    autodiff::recording->bend(a.factor_ * b.factor_);
    return {value, autodiff::recording->add({a.node_, b.node_, autodiff::Bend::Product},
                                            {b.value_ * a.factor_, a.value_ * b.factor_})};
  }
  friend Taped operator/(const Taped& a, const Taped& b) {
    const double inverse = 1.0 / b.value_;
    const double ratio = a.value_ * inverse;
    if (b.node_ < 0) return {ratio, a.node_, a.factor_ * inverse};
    if (a.node_ < 0) return unary(b, ratio, -ratio * inverse, 2.0 * ratio * inverse * inverse);
    return binary(a, b, ratio, {inverse, -ratio * inverse}, 0.0, -inverse * inverse,
                  2.0 * ratio * inverse * inverse);
  }
  friend Taped operator-(const Taped& a) { return {-a.value_, a.node_, -a.factor_}; }
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
    return binary(y, x, std::atan2(y.value_, x.value_), {x.value_ * d, -y.value_ * d}, -bend,
                  (y.value_ * y.value_ - x.value_ * x.value_) * d * d, bend);
  }
  friend Taped hypot(const Taped& a, const Taped& b) {
    const double r = std::hypot(a.value_, b.value_);
    const double p = a.value_ / r, q = b.value_ / r;
    return binary(a, b, r, {p, q}, q * q / r, -p * q / r, p * p / r);
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
  static Taped linear(const Taped& a, const Taped& b, double value, double factor_of_b) {
    return {value, autodiff::recording->add({a.node_, b.node_, autodiff::Bend::None},
                                            {a.factor_, factor_of_b})};
  }
  static Taped unary(const Taped& a, double value, double slope, double second) {
    if (a.node_ < 0) return value;
    autodiff::recording->bend(second * a.factor_ * a.factor_);
    return {value, autodiff::recording->add({a.node_, -1, autodiff::Bend::Unary},
                                            {slope * a.factor_, 0.0})};
  }
  static Taped binary(const Taped& a, const Taped& b, double value, autodiff::Slopes slopes,
                      double aa, double ab, double bb) {
    if (b.node_ < 0) return unary(a, value, slopes.a, aa);
    if (a.node_ < 0) return unary(b, value, slopes.b, bb);
    autodiff::recording->bend(aa * a.factor_ * a.factor_);
    autodiff::recording->bend(ab * a.factor_ * b.factor_);
    autodiff::recording->bend(bb * b.factor_ * b.factor_);
    return {value, autodiff::recording->add({a.node_, b.node_, autodiff::Bend::Binary},
                                            {slopes.a * a.factor_, slopes.b * b.factor_})};
  }

  double value_ = 0.0;
  double factor_ = 1.0;
  Index node_ = -1;
};

/// A double under the names of Taped: formulas that call sin(x), abs(x), square(x) mean these.
class Plain {
 public:
  Plain(double value = 0.0) : value_(value) {}  // NOLINT: conversion is the point
  [[nodiscard]] double value() const { return value_; }

  friend Plain operator+(Plain a, Plain b) { return a.value_ + b.value_; }
  friend Plain operator-(Plain a, Plain b) { return a.value_ - b.value_; }
  friend Plain operator*(Plain a, Plain b) { return a.value_ * b.value_; }
  friend Plain operator/(Plain a, Plain b) { return a.value_ / b.value_; }
  friend Plain operator-(Plain a) { return -a.value_; }
  friend Plain operator+(Plain a) { return a; }
  Plain& operator+=(Plain b) { return *this = *this + b; }
  Plain& operator-=(Plain b) { return *this = *this - b; }
  Plain& operator*=(Plain b) { return *this = *this * b; }
  Plain& operator/=(Plain b) { return *this = *this / b; }
  friend auto operator<=>(Plain a, Plain b) { return a.value_ <=> b.value_; }
  friend bool operator==(Plain a, Plain b) { return a.value_ == b.value_; }

  friend Plain sqrt(Plain a) { return std::sqrt(a.value_); }
  friend Plain exp(Plain a) { return std::exp(a.value_); }
  friend Plain log(Plain a) { return std::log(a.value_); }
  friend Plain sin(Plain a) { return std::sin(a.value_); }
  friend Plain cos(Plain a) { return std::cos(a.value_); }
  friend Plain tan(Plain a) { return std::tan(a.value_); }
  friend Plain asin(Plain a) { return std::asin(a.value_); }
  friend Plain acos(Plain a) { return std::acos(a.value_); }
  friend Plain atan(Plain a) { return std::atan(a.value_); }
  friend Plain atan2(Plain y, Plain x) { return std::atan2(y.value_, x.value_); }
  friend Plain hypot(Plain a, Plain b) { return std::hypot(a.value_, b.value_); }
  friend Plain sinh(Plain a) { return std::sinh(a.value_); }
  friend Plain cosh(Plain a) { return std::cosh(a.value_); }
  friend Plain tanh(Plain a) { return std::tanh(a.value_); }
  friend Plain abs(Plain a) { return std::abs(a.value_); }
  friend Plain fabs(Plain a) { return std::abs(a.value_); }
  friend Plain square(Plain a) { return a.value_ * a.value_; }
  friend Plain pow(Plain a, double p) { return std::pow(a.value_, p); }
  friend Plain pow(Plain a, int p) { return std::pow(a.value_, static_cast<double>(p)); }
  friend Plain pow(Plain a, Plain p) { return std::pow(a.value_, p.value_); }

 private:
  double value_ = 0.0;
};

namespace autodiff {

/// Entries that may differ from zero.
struct Pattern {
  std::vector<Triplet> jacobian;  ///< output, input; by rows
  std::vector<Triplet> hessian;   ///< lower triangle, by columns
  friend bool operator==(const Pattern&, const Pattern&) = default;
};

/// Entries of either.
[[nodiscard]] inline Pattern united(const Pattern& a, const Pattern& b) {
  const auto merge = [](const auto& s, const auto& t, auto less) {
    std::vector<Triplet> both;
    std::ranges::set_union(s, t, std::back_inserter(both), less);
    return both;
  };
  return {
      merge(a.jacobian, b.jacobian,
            [](Triplet s, Triplet t) { return std::pair(s.row, s.col) < std::pair(t.row, t.col); }),
      merge(a.hessian, b.hessian, [](Triplet s, Triplet t) {
        return std::pair(s.col, s.row) < std::pair(t.col, t.row);
      })};
}

/// What follows from the operations alone: the pattern, and the order in which derivatives are
/// accumulated.
class Program {
 public:
  /// outputs: their places, -1 for constants.
  Program(std::vector<Operation> operations, Index inputs, std::vector<Index> outputs)
      : operations_(std::move(operations)), inputs_(inputs), outputs_(std::move(outputs)) {
    find_rows();
    find_gradients();
    find_hessian();
    choose_sweep();
  }

  [[nodiscard]] const std::vector<Operation>& operations() const { return operations_; }
  [[nodiscard]] const std::vector<Index>& outputs() const { return outputs_; }
  [[nodiscard]] const Pattern& pattern() const { return pattern_; }

  /// Entries go to their places in `whole`; false: it lacks some.
  [[nodiscard]] bool place_in(const Pattern& whole) {
    const auto places = [](const std::vector<Triplet>& part, const std::vector<Triplet>& all,
                           std::vector<std::size_t>& to) {
      to.clear();
      std::size_t k = 0;
      for (const Triplet& entry : part) {  // in the same order
        while (k < all.size() && all[k] != entry) ++k;
        if (k == all.size()) return false;
        to.push_back(k);
      }
      return true;
    };
    return places(pattern_.jacobian, whole.jacobian, jacobian_places_) &&
           places(pattern_.hessian, whole.hessian, hessian_places_);
  }

  struct Arrays {
    std::vector<double> adjoint;  ///< zero between calls
    std::vector<double> gradients, second;
  };

  /// Derivatives of outputs first, ..., last - 1; other entries of values stay. values as long as
  /// the whole pattern. results: the outputs of the run.
  void jacobian(const Recording& run, std::span<const Taped> results, std::size_t first,
                std::size_t last, Arrays& work, std::span<double> values) const {
    std::vector<double>& adjoint = work.adjoint;
    adjoint.resize(static_cast<std::size_t>(inputs_) + operations_.size(), 0.0);
    for (std::size_t j = first; j < last; ++j) {
      const Index output = outputs_[j];
      if (output < 0) continue;
      adjoint[at(output)] = results[j].factor();
      for (std::size_t r = row_begin_[j]; r < row_begin_[j + 1]; ++r) {
        const std::size_t k = rows_[r];
        const double weight = std::exchange(adjoint[at(inputs_) + k], 0.0);
        if (weight == 0.0) continue;
        const Slopes& slopes = run.slopes(k);
        adjoint[at(operations_[k].a())] += slopes.a * weight;
        if (const Index b = operations_[k].b(); b >= 0) adjoint[at(b)] += slopes.b * weight;
      }
      for (std::size_t e = entry_begin_[j]; e < entry_begin_[j + 1]; ++e) {
        values[jacobian_places_[e]] = std::exchange(adjoint[at(pattern_.jacobian[e].col)], 0.0);
      }
    }
  }

  /// Adds the Hessian of weights' outputs to values.
  void hessian(const Recording& run, std::span<const Taped> results,
               std::span<const double> weights, Arrays& work, std::span<double> values) const {
    std::vector<double>& adjoint = work.adjoint;
    adjoint.resize(at(inputs_) + operations_.size(), 0.0);
    for (std::size_t j = 0; j < outputs_.size(); ++j) {
      if (outputs_[j] >= 0) adjoint[at(outputs_[j])] += weights[j] * results[j].factor();
    }
    work.second.assign(pattern_.hessian.size(), 0.0);
    if (by_directions_)
      sweep_directions(run, work);
    else
      sweep_terms(run, work);
    for (std::size_t e = 0; e < work.second.size(); ++e) {
      values[hessian_places_[e]] += work.second[e];
    }
    std::fill_n(adjoint.begin(), inputs_, 0.0);
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  /// Of each output: the operations that it depends on, last first, and the inputs.
  void find_rows() {
    std::vector<std::uint32_t> seen(at(inputs_) + operations_.size(), 0);
    std::vector<Index> todo;
    live_.assign(operations_.size(), false);
    row_begin_ = entry_begin_ = {0};
    for (std::size_t j = 0; j < outputs_.size(); ++j) {
      const auto mark = static_cast<std::uint32_t>(j + 1);
      std::vector<Index> columns;
      const auto visit = [&](Index node) {
        if (node < 0 || std::exchange(seen[at(node)], mark) == mark) return;
        if (node < inputs_)
          columns.push_back(node);
        else
          todo.push_back(node - inputs_);
      };
      visit(outputs_[j]);
      while (!todo.empty()) {
        const std::size_t k = at(todo.back());
        todo.pop_back();
        live_[k] = true;
        rows_.push_back(static_cast<std::uint32_t>(k));
        visit(operations_[k].a());
        visit(operations_[k].b());
      }
      std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(row_begin_.back()), rows_.end(),
                std::greater<>());
      std::ranges::sort(columns);
      for (const Index col : columns) {
        pattern_.jacobian.push_back({static_cast<Index>(j), col});
      }
      row_begin_.push_back(rows_.size());
      entry_begin_.push_back(pattern_.jacobian.size());
    }
    jacobian_places_.resize(pattern_.jacobian.size());
    std::iota(jacobian_places_.begin(), jacobian_places_.end(), 0U);
  }

  /// The sparse gradient of a number: inputs in ascending order and where its values stand.
  struct Gradient {
    std::size_t begin = 0, size = 0;
  };
  [[nodiscard]] std::span<const Index> inputs_of(const Gradient& g) const {
    return std::span(gradient_inputs_).subspan(g.begin, g.size);
  }

  /// One gradient from those of its operands.
  struct GradientStep {
    std::size_t operation = 0;
    Gradient to{}, a{}, b{};
    std::size_t map_a = 0, map_b = 0;  ///< in maps_
  };

  /// Gradients are taken of operands of operations with second derivatives, and of what these
  /// depend on.
  void find_gradients() {
    std::vector<bool> wanted(operations_.size(), false);
    std::vector<bool> used(at(inputs_), false);
    const auto want = [&](Index node) {
      if (node >= inputs_)
        wanted[at(node - inputs_)] = true;
      else if (node >= 0)
        used[at(node)] = true;
    };
    for (std::size_t k = operations_.size(); k-- > 0;) {
      if (!live_[k] || (operations_[k].bend() == Bend::None && !wanted[k])) continue;
      want(operations_[k].a());
      want(operations_[k].b());
    }
    gradients_.assign(at(inputs_) + operations_.size(), {});
    for (Index i = 0; i < inputs_; ++i) {
      if (!used[at(i)]) continue;
      gradients_[at(i)] = {gradient_inputs_.size(), 1};
      gradient_inputs_.push_back(i);
    }
    units_ = gradient_inputs_.size();
    for (std::size_t k = 0; k < operations_.size(); ++k) {
      if (wanted[k]) add_gradient(k);
    }
  }
  void add_gradient(std::size_t k) {
    const auto none = Gradient{};
    GradientStep step{.operation = k};
    step.a = gradients_[at(operations_[k].a())];
    step.b = operations_[k].b() < 0 ? none : gradients_[at(operations_[k].b())];
    std::vector<Index> both;
    std::ranges::set_union(inputs_of(step.a), inputs_of(step.b), std::back_inserter(both));
    step.to = {gradient_inputs_.size(), both.size()};
    const auto map = [&](const Gradient& from) {
      const std::size_t begin = maps_.size();
      for (const Index i : inputs_of(from)) {
        const auto place = std::ranges::lower_bound(both, i) - both.begin();
        maps_.push_back(static_cast<std::uint32_t>(place));
      }
      return begin;
    };
    step.map_a = map(step.a);
    step.map_b = map(step.b);
    gradient_inputs_.insert(gradient_inputs_.end(), both.begin(), both.end());
    gradients_[at(inputs_) + k] = step.to;
    steps_.push_back(step);
  }

  void sweep_gradients(const Recording& run, std::vector<double>& values) const {
    values.resize(gradient_inputs_.size());
    std::fill_n(values.begin(), units_, 1.0);
    for (const GradientStep& step : steps_) {
      const Slopes& slopes = run.slopes(step.operation);
      double* const to = values.data() + step.to.begin;
      const double* a = values.data() + step.a.begin;
      const double* b = values.data() + step.b.begin;
      if (step.a.size == step.to.size) {
        for (std::size_t i = 0; i < step.to.size; ++i) to[i] = slopes.a * a[i];
      } else {
        std::fill_n(to, step.to.size, 0.0);
        const std::uint32_t* map = maps_.data() + step.map_a;
        for (std::size_t i = 0; i < step.a.size; ++i) to[map[i]] = slopes.a * a[i];
      }
      const std::uint32_t* map = maps_.data() + step.map_b;
      for (std::size_t i = 0; i < step.b.size; ++i) to[map[i]] += slopes.b * b[i];
    }
  }

  /// An operation with second derivatives.
  struct BendStep {
    std::size_t operation = 0;
    Bend bend = Bend::None;
    Gradient a{}, b{};
    std::size_t numbers = 0;  ///< where its second derivatives stand in the recording
    std::size_t targets = 0;  ///< where its terms go, in targets_
  };

  /// Pairs of inputs in the order of add_bend. term(i, j, ...) for each.
  template <class Emit>
  static void each_square(std::span<const Index> a, Emit emit) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) emit(a[i], a[j]);
    }
  }
  template <class Emit>
  static void each_product(std::span<const Index> a, std::span<const Index> b, Emit emit) {
    for (const Index i : a) {
      for (const Index j : b) emit(std::max(i, j), std::min(i, j));
    }
  }

  void find_hessian() {
    constexpr std::size_t kMost = std::size_t{1} << 31U;
    std::vector<std::uint64_t> pairs;  // column and row, of every term
    const auto emit = [&](Index row, Index col) {
      if (pairs.size() >= kMost) throw std::length_error("a Hessian with more than 2^31 terms");
      pairs.push_back(static_cast<std::uint64_t>(col) << 32U | static_cast<std::uint64_t>(row));
    };
    std::size_t numbers = 0;
    for (std::size_t k = 0; k < operations_.size(); ++k) {
      const Bend bend = operations_[k].bend();
      const std::size_t own_numbers = numbers;
      numbers += bend == Bend::None ? 0 : bend == Bend::Binary ? 3 : 1;
      if (bend == Bend::None || !live_[k]) continue;
      BendStep step{.operation = k, .bend = bend, .numbers = own_numbers, .targets = pairs.size()};
      step.a = gradients_[at(operations_[k].a())];
      if (operations_[k].b() >= 0) step.b = gradients_[at(operations_[k].b())];
      const std::span<const Index> a = inputs_of(step.a), b = inputs_of(step.b);
      if (bend != Bend::Product) each_square(a, emit);
      if (bend != Bend::Unary) each_product(a, b, emit);
      if (bend == Bend::Binary) each_square(b, emit);
      bends_.push_back(step);
    }
    std::vector<std::uint64_t> entries = pairs;
    std::ranges::sort(entries);
    entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
    for (const std::uint64_t entry : entries) {
      pattern_.hessian.push_back(
          {static_cast<Index>(entry & 0xffffffffU), static_cast<Index>(entry >> 32U)});
    }
    targets_.reserve(pairs.size());
    for (const std::uint64_t pair : pairs) {
      const auto place = std::ranges::lower_bound(entries, pair) - entries.begin();
      targets_.push_back(static_cast<std::uint32_t>(place));
    }
    hessian_places_.resize(pattern_.hessian.size());
    std::iota(hessian_places_.begin(), hessian_places_.end(), 0U);
  }

  /// By sums over operations with second derivatives.
  void sweep_terms(const Recording& run, Arrays& work) const {
    sweep_gradients(run, work.gradients);
    std::vector<double>& adjoint = work.adjoint;
    std::size_t next = bends_.size();
    for (std::size_t k = operations_.size(); k-- > 0;) {
      const double weight = std::exchange(adjoint[at(inputs_) + k], 0.0);
      const bool bends = next > 0 && bends_[next - 1].operation == k;
      if (bends) --next;
      if (weight == 0.0) continue;
      const Slopes& slopes = run.slopes(k);
      adjoint[at(operations_[k].a())] += slopes.a * weight;
      if (const Index b = operations_[k].b(); b >= 0) adjoint[at(b)] += slopes.b * weight;
      if (bends) add_bend(bends_[next], run.bends(), weight, work);
    }
  }

  /// Whether all inputs with second derivatives at once are less work; about nanoseconds.
  void choose_sweep() {
    std::vector<bool> bent(at(inputs_), false);
    for (const auto& [row, col] : pattern_.hessian) bent[at(row)] = bent[at(col)] = true;
    direction_.assign(at(inputs_), -1);
    for (std::size_t i = 0; i < bent.size(); ++i) {
      if (bent[i]) direction_[i] = static_cast<Index>(directions_++);
    }
    const auto count = [](std::size_t n) { return static_cast<double>(n); };
    const double terms = 1.3 * count(targets_.size()) + count(gradient_inputs_.size()) +
                         8.0 * count(bends_.size() + steps_.size());
    const double sweeps = count(operations_.size()) * (4.0 + 1.5 * count(directions_));
    by_directions_ = sweeps < terms;
    if (!by_directions_) return;
    steps_ = {};
    maps_ = targets_ = {};
  }

  /// Derivatives of all numbers along all directions, then those of the adjoints.
  void sweep_directions(const Recording& run, Arrays& work) const {
    const std::size_t d = directions_, n = at(inputs_), size = n + operations_.size();
    work.gradients.assign(2 * size * d, 0.0);
    double* const along = work.gradients.data();
    double* const back = along + size * d;
    for (std::size_t i = 0; i < n; ++i) {
      if (direction_[i] >= 0) along[i * d + at(direction_[i])] = 1.0;
    }
    for (std::size_t k = 0; k < operations_.size(); ++k) {
      const Slopes slopes = run.slopes(k);
      double* const to = along + (n + k) * d;
      const double* const a = along + at(operations_[k].a()) * d;
      if (operations_[k].b() < 0) {
        for (std::size_t i = 0; i < d; ++i) to[i] = slopes.a * a[i];
      } else {
        const double* const b = along + at(operations_[k].b()) * d;
        for (std::size_t i = 0; i < d; ++i) to[i] = slopes.a * a[i] + slopes.b * b[i];
      }
    }
    std::size_t next = bends_.size();
    for (std::size_t k = operations_.size(); k-- > 0;) {
      const double weight = std::exchange(work.adjoint[n + k], 0.0);
      const bool bends = next > 0 && bends_[next - 1].operation == k;
      if (bends) --next;
      if (live_[k])  // a weight of zero may have derivatives
        pull_back(run, k, bends ? &bends_[next] : nullptr, weight, work.adjoint, along, back);
    }
    for (std::size_t e = 0; e < pattern_.hessian.size(); ++e) {
      const auto& [row, col] = pattern_.hessian[e];
      work.second[e] = back[at(row) * d + at(direction_[at(col)])];
    }
  }
  /// Operation k's adjoint, the weight, and its derivatives to the operands.
  void pull_back(const Recording& run, std::size_t k, const BendStep* bend, double weight,
                 std::vector<double>& adjoint, const double* along, double* back) const {
    const std::size_t d = directions_;
    const Slopes slopes = run.slopes(k);
    const std::size_t a = at(operations_[k].a());
    const double* const from = back + (at(inputs_) + k) * d;
    const double* const along_a = along + a * d;
    double* const to_a = back + a * d;
    double aa = 0.0, ab = 0.0, bb = 0.0;
    if (bend != nullptr) {
      const double* const numbers = run.bends().data() + bend->numbers;
      if (bend->bend == Bend::Product)
        ab = weight * numbers[0];
      else
        aa = weight * numbers[0];
      if (bend->bend == Bend::Binary) ab = weight * numbers[1], bb = weight * numbers[2];
    }
    adjoint[a] += slopes.a * weight;
    if (operations_[k].b() < 0) {
      for (std::size_t i = 0; i < d; ++i) to_a[i] += slopes.a * from[i] + aa * along_a[i];
      return;
    }
    const std::size_t b = at(operations_[k].b());
    const double* const along_b = along + b * d;
    double* const to_b = back + b * d;
    adjoint[b] += slopes.b * weight;
    if (bend == nullptr) {
      for (std::size_t i = 0; i < d; ++i) to_a[i] += slopes.a * from[i];
      for (std::size_t i = 0; i < d; ++i) to_b[i] += slopes.b * from[i];
      return;
    }
    for (std::size_t i = 0; i < d; ++i)
      to_a[i] += slopes.a * from[i] + aa * along_a[i] + ab * along_b[i];
    for (std::size_t i = 0; i < d; ++i)
      to_b[i] += slopes.b * from[i] + ab * along_a[i] + bb * along_b[i];
  }

  void add_bend(const BendStep& step, const std::vector<double>& numbers, double weight,
                Arrays& work) const {
    const double* const a = work.gradients.data() + step.a.begin;
    const double* const b = work.gradients.data() + step.b.begin;
    const std::uint32_t* target = targets_.data() + step.targets;
    double* const to = work.second.data();
    const auto add_square = [&](const double* g, std::size_t size, double factor) {
      for (std::size_t i = 0; i < size; ++i) {
        const double row = factor * g[i];
        for (std::size_t j = 0; j <= i; ++j) to[*target++] += row * g[j];
      }
    };
    const auto add_product = [&](double factor) {
      // A pair of different inputs comes once from each order; one of equal ones has both at once.
      const std::span<const Index> ia = inputs_of(step.a), ib = inputs_of(step.b);
      for (std::size_t i = 0; i < ia.size(); ++i) {
        const double row = factor * a[i];
        for (std::size_t j = 0; j < ib.size(); ++j) {
          to[*target++] += (ia[i] == ib[j] ? 2.0 * row : row) * b[j];
        }
      }
    };
    if (step.bend == Bend::Product) {
      add_product(weight * numbers[step.numbers]);
    } else if (step.bend == Bend::Unary) {
      add_square(a, step.a.size, weight * numbers[step.numbers]);
    } else {
      add_square(a, step.a.size, weight * numbers[step.numbers]);
      add_product(weight * numbers[step.numbers + 1]);
      add_square(b, step.b.size, weight * numbers[step.numbers + 2]);
    }
  }

  std::vector<Operation> operations_;
  Index inputs_ = 0;
  std::vector<Index> outputs_;
  Pattern pattern_;
  std::vector<std::size_t> jacobian_places_, hessian_places_;
  std::vector<bool> live_;
  std::vector<std::uint32_t> rows_;
  std::vector<std::size_t> row_begin_, entry_begin_;  ///< of each output, and the end
  std::vector<Gradient> gradients_;  ///< of inputs and operations; size 0: not taken
  std::vector<Index> gradient_inputs_;
  std::size_t units_ = 0;  ///< gradients of inputs, which stand first
  std::vector<GradientStep> steps_;
  std::vector<std::uint32_t> maps_, targets_;
  std::vector<BendStep> bends_;
  std::vector<Index> direction_;  ///< of each input; -1: without second derivatives
  std::size_t directions_ = 0;
  bool by_directions_ = false;
};

/// Formulas from n inputs to m outputs at one point after another.
class Tape {
 public:
  Tape(Index inputs, std::size_t outputs) : inputs_(inputs), outputs_(outputs) {}

  /// Runs formulas(std::span<const Taped> inputs, std::span<Taped> outputs) at v.
  template <class Formulas>
  void record(std::span<const double> v, Formulas&& formulas) {
    variables_.clear();
    for (std::size_t i = 0; i < v.size(); ++i) variables_.emplace_back(v[i], static_cast<Index>(i));
    results_.assign(outputs_, Taped());
    run_.begin(inputs_, current_ ? std::span<const Operation>(current_->operations())
                                 : std::span<const Operation>());
    {
      const Active active(run_);
      formulas(std::span<const Taped>(variables_), std::span<Taped>(results_));
    }
    if (!current_ || !run_.as_known() || !has_outputs_of(*current_)) find_program();
  }

  [[nodiscard]] double value(std::size_t output) const { return results_[output].value(); }
  /// Of the formulas as they ran last.
  [[nodiscard]] const Pattern& pattern() const { return current_->pattern(); }
  /// From now on values are in the order of this pattern, and formulas that run with other entries
  /// throw std::logic_error.
  void set_pattern(Pattern pattern) {
    whole_ = std::make_shared<const Pattern>(std::move(pattern));
    std::erase_if(programs_, [&](const auto& program) { return !program->place_in(*whole_); });
    current_ = programs_.empty() ? nullptr : programs_.front().get();
  }

  /// Rows first, ..., last - 1 of the Jacobian into values, which is as long as the pattern and zero
  /// where the run has no entries.
  void jacobian(std::size_t first, std::size_t last, std::span<double> values) {
    current_->jacobian(run_, results_, first, last, work_, values);
  }
  /// Adds the Hessian of weights' outputs.
  void hessian(std::span<const double> weights, std::span<double> values) {
    current_->hessian(run_, results_, weights, work_, values);
  }

 private:
  /// Formulas inside formulas, as a model that is made while another runs, put back what was.
  class Active {
   public:
    explicit Active(Recording& run) : before_(std::exchange(recording, &run)) {}
    ~Active() { recording = before_; }
    Active(const Active&) = delete;
    Active& operator=(const Active&) = delete;

   private:
    Recording* before_;
  };

  [[nodiscard]] bool has_outputs_of(const Program& program) const {
    return std::ranges::equal(program.outputs(), results_, [](Index known, const Taped& result) {
      return known == result.node();
    });
  }

  /// Where a branch of the formulas went elsewhere: that program, made once.
  void find_program() {
    const std::vector<Operation> operations = run_.operations();
    for (const auto& program : programs_) {
      if (program->operations() == operations && has_outputs_of(*program)) {
        current_ = program.get();
        return;
      }
    }
    std::vector<Index> places;
    for (const Taped& result : results_) places.push_back(result.node());
    auto program = std::make_unique<Program>(operations, inputs_, std::move(places));
    if (whole_ && !program->place_in(*whole_)) {
      current_ = nullptr;
      throw std::logic_error("a branch in the model's formulas changes which variables they read");
    }
    if (programs_.size() == kMostPrograms) programs_.erase(programs_.begin());
    programs_.push_back(std::move(program));
    current_ = programs_.back().get();
  }

  /// Kept at a time.
  static constexpr std::size_t kMostPrograms = 16;

  Index inputs_;
  std::size_t outputs_;
  std::shared_ptr<const Pattern> whole_;  ///< null: that of the run
  std::vector<std::unique_ptr<Program>> programs_;
  Program* current_ = nullptr;
  Recording run_;
  std::vector<Taped> variables_, results_;
  Program::Arrays work_;
};

}  // namespace autodiff
}  // namespace ipminmax
