#pragma once

#include <algorithm>
#include <array>
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

#include "../../linalg/triplet.hpp"
#include "numbers.hpp"

/// @file
/// Exact sparse first and second derivatives of formulas that are written once for any number type.
/// What users write stands in autodiff_problem.hpp and in adapter/stages.hpp; this is what both are
/// made of.
///
/// A recording keeps of every operation its partial derivatives; which operands it has is compared
/// with a *program* that was made at the first recording: the entries of Jacobian and Hessian, and
/// where each term goes. So structure is found once, branches that the formulas take are noticed,
/// and numbers in the formulas may change between recordings.
///
///     Jacobian  one sweep back per output over the operations that it depends on
///     Hessian   of w' outputs: sum over operations k with second derivatives of
///               wbar_k (k_aa da da' + k_ab (da db' + db da') + k_bb db db'),
///               wbar_k the weighted outputs' derivative by k, da, db the sparse gradients of k's
///               operands in the inputs
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

/// Numbers of L evaluations side by side.
template <std::size_t L>
using Lanes = std::array<double, L>;

/// The operations of one run of the formulas at L points at once: inputs are 0, ..., n - 1,
/// operations follow.
template <std::size_t L>
class Recording {
 public:
  /// Forgets the last run. known: operations that are expected, or empty.
  void begin(Index inputs, std::span<const Operation> known) {
    inputs_ = inputs;
    count_ = 0;
    known_ = known;
    own_.clear();
    bend_count_ = 0;
    splits_ = false;
    if (slopes_.size() < 2 * known.size()) slopes_.resize(2 * known.size());
  }
  [[nodiscard]] Index add(Operation operation, const Lanes<L>& a, const Lanes<L>& b) {
    if (count_ >= known_.size() || known_[count_] != operation) add_unknown(operation);
    slopes_[2 * count_] = a;
    slopes_[2 * count_ + 1] = b;
    return inputs_ + static_cast<Index>(count_++);
  }
  /// A second derivative of the operation that is added next.
  void bend(const Lanes<L>& second) {
    if (bend_count_ == bends_.size()) bends_.resize(2 * bend_count_ + 64);
    bends_[bend_count_++] = second;
  }
  /// A branch was asked for that differs between the points.
  void split() { splits_ = true; }
  [[nodiscard]] bool splits() const { return splits_; }

  [[nodiscard]] bool as_known() const { return count_ == known_.size() && own_.empty(); }
  /// All operations of the run.
  [[nodiscard]] std::vector<Operation> operations() const {
    if (!own_.empty()) return own_;
    return {known_.begin(), known_.begin() + static_cast<std::ptrdiff_t>(count_)};
  }
  /// Of operation k to its first and second operand.
  [[nodiscard]] const Lanes<L>& slope_a(std::size_t k) const { return slopes_[2 * k]; }
  [[nodiscard]] const Lanes<L>& slope_b(std::size_t k) const { return slopes_[2 * k + 1]; }
  [[nodiscard]] const Lanes<L>* bends() const { return bends_.data(); }

 private:
  void add_unknown(Operation operation) {
    if (count_ >= static_cast<std::size_t>(std::numeric_limits<Index>::max() - inputs_ - 1)) {
      throw std::length_error("formulas with more than 2^31 operations");
    }
    if (own_.empty()) own_ = operations();
    known_ = {};
    own_.push_back(operation);
    if (slopes_.size() < 2 * own_.size()) slopes_.resize(4 * own_.size());
  }

  Index inputs_ = 0;
  std::size_t count_ = 0;
  std::span<const Operation> known_;
  std::vector<Operation> own_;
  std::vector<Lanes<L>> slopes_;  ///< two of each operation
  std::size_t bend_count_ = 0;
  std::vector<Lanes<L>> bends_;
  bool splits_ = false;
};

/// Of this thread, while formulas run.
template <std::size_t L>
inline constinit thread_local Recording<L>* recording = nullptr;

/// Value and derivatives of a function of two numbers.
struct Binary {
  double value, a, b, aa, ab, bb;
};

/// A number that remembers how it was computed, at L points at once: a constant, or a constant plus
/// factor times an input or operation. Comparisons compare values.
template <std::size_t L>
class TapedLanes : public Differentiated<TapedLanes<L>> {
 public:
  TapedLanes(double constant = 0.0) { value_.fill(constant); }  // NOLINT: conversion is the point
  TapedLanes(const Lanes<L>& value, Index node, double factor = 1.0)
      : value_(value), factor_(factor), node_(node) {}

  /// Of the first point; the others follow one by one where formulas ask for it.
  [[nodiscard]] double value() const {
    if (L > 1 && recording<L> != nullptr) recording<L>->split();
    return value_[0];
  }
  [[nodiscard]] Index node() const { return node_; }  ///< -1: a constant
  [[nodiscard]] double factor() const { return factor_; }

  friend TapedLanes operator+(const TapedLanes& a, const TapedLanes& b) { return sum(a, b, 1.0); }
  friend TapedLanes operator-(const TapedLanes& a, const TapedLanes& b) { return sum(a, b, -1.0); }
  friend TapedLanes operator*(const TapedLanes& a, const TapedLanes& b) {
    Lanes<L> value;
    for (std::size_t l = 0; l < L; ++l) value[l] = a.value_[l] * b.value_[l];
    if (b.node_ < 0) return a.scaled(value, b.value_[0]);
    if (a.node_ < 0) return b.scaled(value, a.value_[0]);
    Lanes<L> slope_a, slope_b, second;
    for (std::size_t l = 0; l < L; ++l) {
      slope_a[l] = b.value_[l] * a.factor_;
      slope_b[l] = a.value_[l] * b.factor_;
      second[l] = a.factor_ * b.factor_;
    }
    recording<L>->bend(second);
    return {value, recording<L>->add({a.node_, b.node_, Bend::Product}, slope_a, slope_b)};
  }
  friend TapedLanes operator/(const TapedLanes& a, const TapedLanes& b) {
    if (b.node_ < 0) return a * TapedLanes(1.0 / b.value_[0]);
    if (a.node_ < 0) {
      const double numerator = a.value_[0];
      return unary(b, [numerator](double x) {
        const double inverse = 1.0 / x, ratio = numerator * inverse;
        return Unary<double>{ratio, -ratio * inverse, 2.0 * ratio * inverse * inverse};
      });
    }
    return binary(a, b, [](double x, double y) {
      const double inverse = 1.0 / y, ratio = x * inverse;
      return Binary{ratio,
                    inverse,
                    -ratio * inverse,
                    0.0,
                    -inverse * inverse,
                    2.0 * ratio * inverse * inverse};
    });
  }
  friend TapedLanes operator-(const TapedLanes& a) { return a * TapedLanes(-1.0); }
  friend std::partial_ordering operator<=>(const TapedLanes& a, const TapedLanes& b) {
    const std::partial_ordering first = a.value_[0] <=> b.value_[0];
    for (std::size_t l = 1; l < L; ++l) {
      if ((a.value_[l] <=> b.value_[l]) != first) recording<L>->split();
    }
    return first;
  }
  friend bool operator==(const TapedLanes& a, const TapedLanes& b) { return (a <=> b) == 0; }

  friend TapedLanes tan(const TapedLanes& a) {
    return unary(a, [](double x) {
      const double t = std::tan(x);
      return Unary<double>{t, 1.0 + t * t, 2.0 * t * (1.0 + t * t)};
    });
  }
  friend TapedLanes atan2(const TapedLanes& a, const TapedLanes& b) {
    return binary(a, b, [](double y, double x) {
      const double d = 1.0 / (x * x + y * y), bend = 2.0 * x * y * d * d;
      return Binary{std::atan2(y, x), x * d, -y * d, -bend, (y * y - x * x) * d * d, bend};
    });
  }
  friend TapedLanes hypot(const TapedLanes& a, const TapedLanes& b) {
    return binary(a, b, [](double x, double y) {
      const double r = std::hypot(x, y), p = x / r, q = y / r;
      return Binary{r, p, q, q * q / r, -p * q / r, p * p / r};
    });
  }
  /// Not differentiable at 0, where the derivative is that of a.
  friend TapedLanes abs(const TapedLanes& a) { return a < TapedLanes(0.0) ? -a : a; }
  friend TapedLanes pow(const TapedLanes& a, double p) {
    if (p == 0.0) return 1.0;
    if (p == 1.0) return a;
    return unary(a, [p](double x) { return table::derivatives_of_pow(x, p); });
  }
  /// a > 0.
  friend TapedLanes pow(const TapedLanes& a, const TapedLanes& b) {
    return b.node_ < 0 ? pow(a, b.value_[0]) : exp(b * log(a));
  }

 private:
  friend Differentiated<TapedLanes>;
  [[nodiscard]] TapedLanes scaled(const Lanes<L>& value, double by) const {
    return {value, node_, factor_ * by};
  }
  static TapedLanes sum(const TapedLanes& a, const TapedLanes& b, double sign) {
    Lanes<L> value;
    for (std::size_t l = 0; l < L; ++l) value[l] = a.value_[l] + sign * b.value_[l];
    if (b.node_ < 0) return {value, a.node_, a.factor_};
    if (a.node_ < 0) return {value, b.node_, sign * b.factor_};
    Lanes<L> slope_a, slope_b;
    slope_a.fill(a.factor_);
    slope_b.fill(sign * b.factor_);
    return {value, recording<L>->add({a.node_, b.node_, Bend::None}, slope_a, slope_b)};
  }
  template <class F>
  static TapedLanes unary(const TapedLanes& a, F f) {
    Lanes<L> value, slope, second;
    for (std::size_t l = 0; l < L; ++l) {
      const Unary<double> at = f(a.value_[l]);
      value[l] = at.value;
      slope[l] = at.a * a.factor_;
      second[l] = at.aa * a.factor_ * a.factor_;
    }
    if (a.node_ < 0) return {value, -1};
    recording<L>->bend(second);
    return {value, recording<L>->add({a.node_, -1, Bend::Unary}, slope, slope)};
  }
  template <class F>
  static TapedLanes binary(const TapedLanes& a, const TapedLanes& b, F f) {
    if (b.node_ < 0) {
      return unary(a, [&](double x) {
        const Binary at = f(x, b.value_[0]);
        return Unary<double>{at.value, at.a, at.aa};
      });
    }
    if (a.node_ < 0) {
      return unary(b, [&](double y) {
        const Binary at = f(a.value_[0], y);
        return Unary<double>{at.value, at.b, at.bb};
      });
    }
    Lanes<L> value, slope_a, slope_b, aa, ab, bb;
    for (std::size_t l = 0; l < L; ++l) {
      const Binary at = f(a.value_[l], b.value_[l]);
      value[l] = at.value;
      slope_a[l] = at.a * a.factor_;
      slope_b[l] = at.b * b.factor_;
      aa[l] = at.aa * a.factor_ * a.factor_;
      ab[l] = at.ab * a.factor_ * b.factor_;
      bb[l] = at.bb * b.factor_ * b.factor_;
    }
    for (const Lanes<L>* numbers : {&aa, &ab, &bb}) recording<L>->bend(*numbers);
    return {value, recording<L>->add({a.node_, b.node_, Bend::Binary}, slope_a, slope_b)};
  }

  Lanes<L> value_{};
  double factor_ = 1.0;
  Index node_ = -1;
};

}  // namespace autodiff

/// A number that remembers how it was computed.
using Taped = autodiff::TapedLanes<1>;

#define IPMINMAX_FUNCTIONS_OF_ONE(use) IPMINMAX_TABLE(use) use(tan) use(abs)

/// A double under the names of Taped: formulas that call sin(x), abs(x), square(x) mean these.
class Plain : public autodiff::Number<Plain> {
 public:
  Plain(double value = 0.0) : value_(value) {}  // NOLINT: conversion is the point
  [[nodiscard]] double value() const { return value_; }

  friend Plain operator+(Plain a, Plain b) { return a.value_ + b.value_; }
  friend Plain operator-(Plain a, Plain b) { return a.value_ - b.value_; }
  friend Plain operator*(Plain a, Plain b) { return a.value_ * b.value_; }
  friend Plain operator/(Plain a, Plain b) { return a.value_ / b.value_; }
  friend Plain operator-(Plain a) { return -a.value_; }
  friend auto operator<=>(Plain a, Plain b) { return a.value_ <=> b.value_; }
  friend bool operator==(Plain a, Plain b) { return a.value_ == b.value_; }

#define IPMINMAX_PLAIN(function) \
  friend Plain function(Plain a) { return std::function(a.value_); }
  IPMINMAX_FUNCTIONS_OF_ONE(IPMINMAX_PLAIN)
#undef IPMINMAX_PLAIN
  friend Plain atan2(Plain y, Plain x) { return std::atan2(y.value_, x.value_); }
  friend Plain hypot(Plain a, Plain b) { return std::hypot(a.value_, b.value_); }
  friend Plain square(Plain a) { return a.value_ * a.value_; }
  friend Plain pow(Plain a, double p) { return std::pow(a.value_, p); }
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
    gradients_ = std::vector<Gradient>();  // a model may keep a program for each row
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

  template <std::size_t L>
  struct Arrays {
    std::vector<Lanes<L>> adjoint;  ///< zero between calls
    std::vector<Lanes<L>> gradients, second;
  };

  /// Derivatives of outputs first, ..., last - 1; other entries of values stay. values as long as
  /// the whole pattern. results: the outputs of the run.
  template <std::size_t L>
  void jacobian(const Recording<L>& run, std::span<const TapedLanes<L>> results, std::size_t first,
                std::size_t last, Arrays<L>& work, std::span<Lanes<L>> values) const {
    std::vector<Lanes<L>>& adjoint = work.adjoint;
    adjoint.resize(at(inputs_) + operations_.size(), Lanes<L>{});
    for (std::size_t j = first; j < last; ++j) {
      const Index output = outputs_[j];
      if (output < 0) continue;
      adjoint[at(output)].fill(results[j].factor());
      for (std::size_t r = row_begin_[j]; r < row_begin_[j + 1]; ++r) {
        const std::size_t k = rows_[r];
        const Lanes<L> weight = std::exchange(adjoint[at(inputs_) + k], Lanes<L>{});
        if (L == 1 && weight[0] == 0.0) continue;
        add(adjoint[at(operations_[k].a())], run.slope_a(k), weight);
        if (const Index b = operations_[k].b(); b >= 0) add(adjoint[at(b)], run.slope_b(k), weight);
      }
      for (std::size_t e = entry_begin_[j]; e < entry_begin_[j + 1]; ++e) {
        values[jacobian_places_[e]] =
            std::exchange(adjoint[at(pattern_.jacobian[e].col)], Lanes<L>{});
      }
    }
  }

  /// Adds the Hessian of weights' outputs to values.
  template <std::size_t L>
  void hessian(const Recording<L>& run, std::span<const TapedLanes<L>> results,
               std::span<const Lanes<L>> weights, Arrays<L>& work,
               std::span<Lanes<L>> values) const {
    std::vector<Lanes<L>>& adjoint = work.adjoint;
    adjoint.resize(at(inputs_) + operations_.size(), Lanes<L>{});
    for (std::size_t j = 0; j < outputs_.size(); ++j) {
      if (outputs_[j] >= 0) add(adjoint[at(outputs_[j])], results[j].factor(), weights[j]);
    }
    work.second.assign(pattern_.hessian.size(), Lanes<L>{});
    sweep_terms(run, work);
    for (std::size_t e = 0; e < work.second.size(); ++e) {
      add(values[hessian_places_[e]], 1.0, work.second[e]);
    }
    for (const Triplet& entry : pattern_.jacobian) adjoint[at(entry.col)] = Lanes<L>{};
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  /// to += a b in each lane. They may be the same for all that a compiler knows: it takes lanes
  /// together where the sum has its own place.
  template <std::size_t L>
  static void add(Lanes<L>& to, const Lanes<L>& a, const Lanes<L>& b) {
    Lanes<L> sum;
    for (std::size_t l = 0; l < L; ++l) sum[l] = to[l] + a[l] * b[l];
    to = sum;
  }
  template <std::size_t L>
  static void add(Lanes<L>& to, double a, const Lanes<L>& b) {
    for (std::size_t l = 0; l < L; ++l) to[l] += a * b[l];
  }
  template <std::size_t L>
  static Lanes<L> product(const Lanes<L>& a, const Lanes<L>& b) {
    Lanes<L> result;
    for (std::size_t l = 0; l < L; ++l) result[l] = a[l] * b[l];
    return result;
  }

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

  template <std::size_t L>
  void sweep_gradients(const Recording<L>& run, std::vector<Lanes<L>>& values) const {
    values.resize(gradient_inputs_.size());
    for (std::size_t i = 0; i < units_; ++i) values[i].fill(1.0);
    for (const GradientStep& step : steps_) {
      const Lanes<L>&slope_a = run.slope_a(step.operation), &slope_b = run.slope_b(step.operation);
      Lanes<L>* const to = values.data() + step.to.begin;
      const Lanes<L>* a = values.data() + step.a.begin;
      const Lanes<L>* b = values.data() + step.b.begin;
      if (step.a.size == step.to.size) {
        for (std::size_t i = 0; i < step.to.size; ++i) to[i] = product(slope_a, a[i]);
      } else {
        std::fill_n(to, step.to.size, Lanes<L>{});
        const std::uint32_t* map = maps_.data() + step.map_a;
        for (std::size_t i = 0; i < step.a.size; ++i) to[map[i]] = product(slope_a, a[i]);
      }
      const std::uint32_t* map = maps_.data() + step.map_b;
      for (std::size_t i = 0; i < step.b.size; ++i) add(to[map[i]], slope_b, b[i]);
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
  template <std::size_t L>
  void sweep_terms(const Recording<L>& run, Arrays<L>& work) const {
    sweep_gradients(run, work.gradients);
    std::vector<Lanes<L>>& adjoint = work.adjoint;
    std::size_t next = bends_.size();
    for (std::size_t k = operations_.size(); k-- > 0;) {
      const Lanes<L> weight = std::exchange(adjoint[at(inputs_) + k], Lanes<L>{});
      const bool bends = next > 0 && bends_[next - 1].operation == k;
      if (bends) --next;
      if (!live_[k] || (L == 1 && weight[0] == 0.0)) continue;
      add(adjoint[at(operations_[k].a())], run.slope_a(k), weight);
      if (const Index b = operations_[k].b(); b >= 0) add(adjoint[at(b)], run.slope_b(k), weight);
      if (bends) add_bend(bends_[next], run.bends() + bends_[next].numbers, weight, work);
    }
  }
  template <std::size_t L>
  void add_bend(const BendStep& step, const Lanes<L>* numbers, const Lanes<L>& weight,
                Arrays<L>& work) const {
    const Lanes<L>* const a = work.gradients.data() + step.a.begin;
    const Lanes<L>* const b = work.gradients.data() + step.b.begin;
    const std::uint32_t* target = targets_.data() + step.targets;
    Lanes<L>* const to = work.second.data();
    const auto add_square = [&](const Lanes<L>* g, std::size_t size, const Lanes<L>& number) {
      const Lanes<L> factor = product(weight, number);
      for (std::size_t i = 0; i < size; ++i) {
        const Lanes<L> row = product(factor, g[i]);
        for (std::size_t j = 0; j <= i; ++j) add(to[*target++], row, g[j]);
      }
    };
    const auto add_product = [&](const Lanes<L>& number) {
      // A pair of different inputs comes once from each order; one of equal ones has both at once.
      const std::span<const Index> ia = inputs_of(step.a), ib = inputs_of(step.b);
      const Lanes<L> factor = product(weight, number);
      for (std::size_t i = 0; i < ia.size(); ++i) {
        const Lanes<L> row = product(factor, a[i]);
        for (std::size_t j = 0; j < ib.size(); ++j) {
          Lanes<L>& entry = to[*target++];
          add(entry, row, b[j]);
          if (ia[i] == ib[j]) add(entry, row, b[j]);
        }
      }
    };
    if (step.bend == Bend::Product) {
      add_product(numbers[0]);
    } else if (step.bend == Bend::Unary) {
      add_square(a, step.a.size, numbers[0]);
    } else {
      add_square(a, step.a.size, numbers[0]);
      add_product(numbers[1]);
      add_square(b, step.b.size, numbers[2]);
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
};

/// Formulas from n inputs to m outputs, at L points at once, one time after another.
template <std::size_t L>
class TapeOf {
 public:
  using Number = TapedLanes<L>;
  /// What tapes of the same inputs may share: inputs, and memory that is free between calls.
  struct Work {
    std::vector<Number> variables;
    Program::Arrays<L> arrays;
  };

  TapeOf(Index inputs, std::size_t outputs, std::shared_ptr<Work> work = std::make_shared<Work>())
      : inputs_(inputs), outputs_(outputs), work_(std::move(work)) {}

  /// Sets the inputs of the next runs.
  void set_inputs(std::span<const Lanes<L>> v) {
    work_->variables.clear();
    for (std::size_t i = 0; i < v.size(); ++i)
      work_->variables.emplace_back(v[i], static_cast<Index>(i));
  }
  /// Runs formulas(std::span<const Number> inputs, std::span<Number> outputs) at v. False: a branch
  /// differs between the points, and there are no derivatives.
  template <class Formulas>
  [[nodiscard]] bool record_at(std::span<const Lanes<L>> v, Formulas&& formulas) {
    set_inputs(v);
    return run(formulas);
  }
  /// The same at the inputs that were set last.
  template <class Formulas>
  [[nodiscard]] bool run(Formulas&& formulas) {
    results_.assign(outputs_, Number());
    run_.begin(inputs_, current_ ? std::span<const Operation>(current_->operations())
                                 : std::span<const Operation>());
    {
      const Active active(run_);
      formulas(std::span<const Number>(work_->variables), std::span<Number>(results_));
    }
    if (run_.splits()) return false;
    if (!current_ || !run_.as_known() || !has_outputs_of(*current_)) find_program();
    return true;
  }

  /// Of the formulas as they ran last.
  [[nodiscard]] const Pattern& pattern() const { return current_->pattern(); }
  /// From now on values are in the order of this pattern, and formulas that run with other entries
  /// throw std::logic_error.
  void set_pattern(Pattern pattern) {
    whole_ = std::make_shared<const Pattern>(std::move(pattern));
    std::erase_if(programs_, [&](const auto& program) { return !program->place_in(*whole_); });
    current_ = programs_.empty() ? nullptr : programs_.front().get();
  }

  /// Rows first, ..., last - 1 of the Jacobian into values, which is as long as the pattern and
  /// zero where the run has no entries.
  void jacobian_at(std::size_t first, std::size_t last, std::span<Lanes<L>> values) {
    current_->template jacobian<L>(run_, results_, first, last, work_->arrays, values);
  }
  /// Adds the Hessian of weights' outputs.
  void hessian_at(std::span<const Lanes<L>> weights, std::span<Lanes<L>> values) {
    current_->template hessian<L>(run_, results_, weights, work_->arrays, values);
  }

 private:
  /// Formulas inside formulas, as a model that is made while another runs, put back what was.
  class Active {
   public:
    explicit Active(Recording<L>& run) : before_(std::exchange(recording<L>, &run)) {}
    ~Active() { recording<L> = before_; }
    Active(const Active&) = delete;
    Active& operator=(const Active&) = delete;

   private:
    Recording<L>* before_;
  };

  [[nodiscard]] bool has_outputs_of(const Program& program) const {
    return std::ranges::equal(program.outputs(), results_, [](Index known, const Number& result) {
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
    for (const Number& result : results_) places.push_back(result.node());
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
  Recording<L> run_;
  std::vector<Number> results_;
  std::shared_ptr<Work> work_;
};

/// The same at one point, in plain numbers.
class Tape : public TapeOf<1> {
 public:
  using TapeOf<1>::TapeOf;
  template <class Formulas>
  void record(std::span<const double> v, Formulas&& formulas) {
    static_cast<void>(record_at(lanes(v), formulas));
  }
  void set_point(std::span<const double> v) { set_inputs(lanes(v)); }
  void jacobian(std::size_t first, std::size_t last, std::span<double> values) {
    jacobian_at(first, last, lanes(values));
  }
  void hessian(std::span<const double> weights, std::span<double> values) {
    hessian_at(lanes(weights), lanes(values));
  }

 private:
  static_assert(sizeof(Lanes<1>) == sizeof(double));
  /// An array of one number each is laid out as the numbers.
  static std::span<const Lanes<1>> lanes(std::span<const double> v) {
    return {reinterpret_cast<const Lanes<1>*>(v.data()), v.size()};
  }
  static std::span<Lanes<1>> lanes(std::span<double> v) {
    return {reinterpret_cast<Lanes<1>*>(v.data()), v.size()};
  }
};

template <class T>
concept IsFormulaNumber = requires {
  typename T::FormulaNumber;
};

}  // namespace autodiff
}  // namespace ipminmax

// Formulas that call std::sin mean the number type's own function, as those that call sin.
namespace std {
#define IPMINMAX_OF_ONE(function)                  \
  template <ipminmax::autodiff::IsFormulaNumber T> \
  T function(const T& a) {                         \
    return function(a);                            \
  }
#define IPMINMAX_OF_TWO(function)                  \
  template <ipminmax::autodiff::IsFormulaNumber T> \
  T function(const T& a, const T& b) {             \
    return function(a, b);                         \
  }                                                \
  template <ipminmax::autodiff::IsFormulaNumber T> \
  T function(const T& a, double b) {               \
    return function(a, T(b));                      \
  }                                                \
  template <ipminmax::autodiff::IsFormulaNumber T> \
  T function(double a, const T& b) {               \
    return function(T(a), b);                      \
  }
IPMINMAX_FUNCTIONS_OF_ONE(IPMINMAX_OF_ONE)
IPMINMAX_OF_ONE(fabs) IPMINMAX_OF_TWO(pow) IPMINMAX_OF_TWO(atan2) IPMINMAX_OF_TWO(hypot)
#undef IPMINMAX_OF_ONE
#undef IPMINMAX_OF_TWO
#undef IPMINMAX_FUNCTIONS_OF_ONE
#undef IPMINMAX_TABLE
}  // namespace std
