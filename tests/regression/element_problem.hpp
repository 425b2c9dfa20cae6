#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <typeindex>
#include <typeinfo>
#include <utility>
#include <vector>

#include "core/problem.hpp"

/// Large minimizations whose objective and constraints are sums of functions of few variables, with
/// derivatives coded by hand. Evaluations take time proportional to the number of terms.
namespace ipminmax::testing {

inline constexpr double kAbsent = 2e19;  ///< a bound that is absent
inline constexpr Index kObjective = -1;  ///< the row number of the objective

/// Value, gradient and lower triangle (row by row) of the Hessian of a function of N variables.
template <std::size_t N>
struct Local {
  double value = 0.0;
  std::array<double, N> gradient{};
  std::array<double, N*(N + 1) / 2> hessian{};
};

/// Terms of one kind, all of the objective or all of constraints.
class TermGroup {
 public:
  virtual ~TermGroup() = default;
  virtual void add_pattern(std::vector<Triplet>& jacobian, std::vector<Triplet>& hessian) const = 0;
  /// Adds each term to sums[row], or to sums[0] for the objective.
  virtual void add_values(std::span<const double> v, double* sums) const = 0;
  virtual void add_gradient(std::span<const double> v, std::span<double> gradient) const = 0;
  /// The entries of add_pattern; these return the end of what they wrote.
  virtual double* write_jacobian(std::span<const double> v, double* values) const = 0;
  virtual double* write_hessian(std::span<const double> v, double sigma,
                                std::span<const double> lambda, double* values) const = 0;
};

/// Kind: a copyable object, kArity variables, at(x) giving its Local.
template <typename Kind>
class TermGroupOf final : public TermGroup {
 public:
  static constexpr std::size_t kArity = Kind::kArity;
  using Variables = std::array<Index, kArity>;

  void add(Index row, double weight, const Variables& variables, const Kind& kind) {
    terms_.push_back({row, weight, variables, kind});
  }

  void add_pattern(std::vector<Triplet>& jacobian, std::vector<Triplet>& hessian) const override {
    for (const Term& term : terms_) {
      if (term.row != kObjective) {
        for (const Index variable : term.variables) jacobian.push_back({term.row, variable});
      }
      for (std::size_t i = 0; i < kArity; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
          hessian.push_back({term.variables[i], term.variables[j]});
        }
      }
    }
  }

  void add_values(std::span<const double> v, double* sums) const override {
    for (const Term& term : terms_) {
      sums[term.row == kObjective ? 0 : term.row] += term.weight * term.at(v).value;
    }
  }

  void add_gradient(std::span<const double> v, std::span<double> gradient) const override {
    for (const Term& term : terms_) {
      const Local<kArity> local = term.at(v);
      for (std::size_t i = 0; i < kArity; ++i) {
        gradient[static_cast<std::size_t>(term.variables[i])] += term.weight * local.gradient[i];
      }
    }
  }

  double* write_jacobian(std::span<const double> v, double* values) const override {
    for (const Term& term : terms_) {
      for (const double derivative : term.at(v).gradient) *values++ = term.weight * derivative;
    }
    return values;
  }

  double* write_hessian(std::span<const double> v, double sigma, std::span<const double> lambda,
                        double* values) const override {
    for (const Term& term : terms_) {
      const double multiplier =
          term.row == kObjective ? sigma : lambda[static_cast<std::size_t>(term.row)];
      for (const double derivative : term.at(v).hessian) {
        *values++ = multiplier * term.weight * derivative;
      }
    }
    return values;
  }

 private:
  struct Term {
    Index row;
    double weight;
    Variables variables;
    Kind kind;

    [[nodiscard]] Local<kArity> at(std::span<const double> v) const {
      std::array<double, kArity> x;
      for (std::size_t i = 0; i < kArity; ++i) x[i] = v[static_cast<std::size_t>(variables[i])];
      return kind.at(x);
    }
  };
  std::vector<Term> terms_;
};

/// The sum of its terms. Filled by the add functions, then used as a Problem.
class ElementProblem final : public Problem {
 public:
  Index add_variable(double start, double lower = -kAbsent, double upper = kAbsent) {
    structure_.variable_players.push_back(Player::Min);
    structure_.variable_lower.push_back(lower);
    structure_.variable_upper.push_back(upper);
    start_.push_back(start);
    return static_cast<Index>(start_.size()) - 1;
  }

  /// lower <= sum of the row's terms <= upper
  Index add_row(double lower, double upper) {
    structure_.constraint_players.push_back(Player::Min);
    structure_.constraint_lower.push_back(lower);
    structure_.constraint_upper.push_back(upper);
    return static_cast<Index>(structure_.constraint_lower.size()) - 1;
  }

  void add_linear(Index row, Index variable, double coefficient) {
    linear_.push_back({row, variable, coefficient});
  }

  template <typename Kind>
  void add_term(Index row, double weight, const std::array<Index, Kind::kArity>& variables,
                const Kind& kind = {}) {
    group<Kind>(row == kObjective).add(row, weight, variables, kind);
  }

  /// Call once, after everything was added.
  void finish() {
    for (const auto& [row, variable, coefficient] : linear_) {
      if (row != kObjective) structure_.jacobian.push_back({row, variable});
    }
    for (const Entry& entry : groups_) {
      entry.group->add_pattern(structure_.jacobian, structure_.hessian);
    }
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (const auto& [row, variable, coefficient] : linear_) {
      if (row == kObjective) f += coefficient * v[static_cast<std::size_t>(variable)];
    }
    for (const Entry& entry : groups_) {
      if (entry.of_objective) entry.group->add_values(v, &f);
    }
    return std::isfinite(f);
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    for (const auto& [row, variable, coefficient] : linear_) {
      if (row == kObjective) grad[static_cast<std::size_t>(variable)] += coefficient;
    }
    for (const Entry& entry : groups_) {
      if (entry.of_objective) entry.group->add_gradient(v, grad);
    }
    return all_finite(grad);
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    for (const auto& [row, variable, coefficient] : linear_) {
      if (row != kObjective) {
        g[static_cast<std::size_t>(row)] += coefficient * v[static_cast<std::size_t>(variable)];
      }
    }
    for (const Entry& entry : groups_) {
      if (!entry.of_objective) entry.group->add_values(v, g.data());
    }
    return all_finite(g);
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    double* next = values.data();
    for (const auto& [row, variable, coefficient] : linear_) {
      if (row != kObjective) *next++ = coefficient;
    }
    for (const Entry& entry : groups_) {
      if (!entry.of_objective) next = entry.group->write_jacobian(v, next);
    }
    return all_finite(values);
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    double* next = values.data();
    for (const Entry& entry : groups_) next = entry.group->write_hessian(v, sigma, lambda, next);
    return all_finite(values);
  }

 private:
  struct LinearTerm {
    Index row;
    Index variable;
    double coefficient;
  };
  struct Entry {
    std::type_index kind;
    bool of_objective;
    std::unique_ptr<TermGroup> group;
  };

  template <typename Kind>
  TermGroupOf<Kind>& group(bool of_objective) {
    auto found = std::ranges::find_if(groups_, [&](const Entry& entry) {
      return entry.kind == typeid(Kind) && entry.of_objective == of_objective;
    });
    if (found == groups_.end()) {
      groups_.push_back({typeid(Kind), of_objective, std::make_unique<TermGroupOf<Kind>>()});
      found = groups_.end() - 1;
    }
    return static_cast<TermGroupOf<Kind>&>(*found->group);
  }

  static bool all_finite(std::span<const double> values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  }

  ProblemStructure structure_;
  std::vector<double> start_;
  std::vector<LinearTerm> linear_;
  std::vector<Entry> groups_;
};

// --- Kinds of terms ------------------------------------------------------------------------------

/// A function of one number and its first two derivatives.
struct Scalar {
  double value, first, second;
};
struct Square {
  static Scalar at(double t) { return {t * t, 2.0 * t, 2.0}; }
};
struct Cube {
  static Scalar at(double t) { return {t * t * t, 3.0 * t * t, 6.0 * t}; }
};
struct FourthPower {
  static Scalar at(double t) { return {t * t * t * t, 4.0 * t * t * t, 12.0 * t * t}; }
};
struct Exponential {
  static Scalar at(double t) { return {std::exp(t), std::exp(t), std::exp(t)}; }
};
struct Cosine {
  static Scalar at(double t) { return {std::cos(t), -std::sin(t), -std::cos(t)}; }
};
struct Entropy {  ///< t log t
  static Scalar at(double t) { return {t * std::log(t), 1.0 + std::log(t), 1.0 / t}; }
};

/// phi(a' x + b)
template <typename Phi, std::size_t N>
struct Ridge {
  static constexpr std::size_t kArity = N;
  std::array<double, N> a{};
  double b = 0.0;

  [[nodiscard]] Local<N> at(const std::array<double, N>& x) const {
    double t = b;
    for (std::size_t i = 0; i < N; ++i) t += a[i] * x[i];
    const Scalar phi = Phi::at(t);
    Local<N> local{.value = phi.value};
    std::size_t entry = 0;
    for (std::size_t i = 0; i < N; ++i) {
      local.gradient[i] = phi.first * a[i];
      for (std::size_t j = 0; j <= i; ++j) local.hessian[entry++] = phi.second * a[i] * a[j];
    }
    return local;
  }
};

/// (x0^2 - x1)^2
struct SquaredValley {
  static constexpr std::size_t kArity = 2;
  [[nodiscard]] static Local<2> at(const std::array<double, 2>& x) {
    const double t = x[0] * x[0] - x[1];
    return {t * t, {4.0 * x[0] * t, -2.0 * t}, {4.0 * t + 8.0 * x[0] * x[0], -4.0 * x[0], 2.0}};
  }
};

/// x0 exp(x0 - x1)
struct TimesExponential {
  static constexpr std::size_t kArity = 2;
  [[nodiscard]] static Local<2> at(const std::array<double, 2>& x) {
    const double e = std::exp(x[0] - x[1]);
    return {
        x[0] * e, {(1.0 + x[0]) * e, -x[0] * e}, {(2.0 + x[0]) * e, -(1.0 + x[0]) * e, x[0] * e}};
  }
};

/// x0 x1^2
struct TimesSquare {
  static constexpr std::size_t kArity = 2;
  [[nodiscard]] static Local<2> at(const std::array<double, 2>& x) {
    return {x[0] * x[1] * x[1], {x[1] * x[1], 2.0 * x[0] * x[1]}, {0.0, 2.0 * x[1], 2.0 * x[0]}};
  }
};

/// Flow along a line of an electric network: with voltages x0, x1 and angles x2, x3
/// x0 x1 (c cos(x2 - x3) + s sin(x2 - x3))
struct LineFlow {
  static constexpr std::size_t kArity = 4;
  double c = 0.0;
  double s = 0.0;
  [[nodiscard]] Local<4> at(const std::array<double, 4>& x) const {
    const double cosine = std::cos(x[2] - x[3]);
    const double sine = std::sin(x[2] - x[3]);
    const double p = c * cosine + s * sine;
    const double dp = -c * sine + s * cosine;
    const double product = x[0] * x[1];
    return {product * p,
            {x[1] * p, x[0] * p, product * dp, -product * dp},
            {0.0, p, 0.0, x[1] * dp, x[0] * dp, -product * p, -x[1] * dp, -x[0] * dp, product * p,
             -product * p}};
  }
};

/// Area above a triangle: sqrt(1 + ((x0 - x1)^2 + (x0 - x2)^2) / h^2)
struct TriangleArea {
  static constexpr std::size_t kArity = 3;
  double h = 1.0;
  [[nodiscard]] Local<3> at(const std::array<double, 3>& x) const {
    const double p = (x[0] - x[1]) / h;
    const double q = (x[0] - x[2]) / h;
    const double area = std::sqrt(1.0 + p * p + q * q);
    const double pp = (1.0 + q * q) / (area * area * area * h * h);
    const double qq = (1.0 + p * p) / (area * area * area * h * h);
    const double pq = -p * q / (area * area * area * h * h);
    return {area,
            {(p + q) / (area * h), -p / (area * h), -q / (area * h)},
            {pp + 2.0 * pq + qq, -pp - pq, pp, -qq - pq, pq, qq}};
  }
};

}  // namespace ipminmax::testing
