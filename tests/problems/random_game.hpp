#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <support/autodiff_problem.hpp>
#include <support/forwarding_problem.hpp>

#include "core/options.hpp"

namespace ipminmax::testing {

/// A random small problem with random options: sums of powers, products, exp, sin, log, square
/// roots and reciprocals in one to five variables of either player, bounds of every kind, up to
/// three constraints. Many have no solution, some are undefined at their start.
struct RandomGame {
  Model model;
  std::vector<double> start;
  SolverOptions options;
  int stop_at = std::numeric_limits<int>::max();  ///< call of the iteration callback that stops
  /// From that call of the functions on one of them fails, never with 0.
  int fails_from = 0;
  int failing_function = 0;  ///< 0 to 4: objective, gradient, constraints, Jacobian, Hessian
  bool fails_with_nan = false;
};

/// The same seed gives the same game everywhere.
[[nodiscard]] RandomGame random_game(std::uint64_t seed);

/// The same with curvature of the right sign added in most variables, so that many have a local
/// minmax; it is neither stopped nor fails.
[[nodiscard]] RandomGame tame_game(std::uint64_t seed);

/// A model that fails as the game says, and watches where it is asked.
class FailingProblem final : public ForwardingProblem {
 public:
  FailingProblem(Problem& model, const RandomGame& game) : ForwardingProblem(model), game_(game) {}

  /// Calls with a variable or multiplier that was NaN or infinite.
  [[nodiscard]] int calls_not_finite() const { return calls_not_finite_; }

  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    const bool good = look(v) && ForwardingProblem::objective(v, new_v, f);
    return passes(0, good, {&f, 1});
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    const bool good = look(v) && ForwardingProblem::gradient(v, new_v, grad);
    return passes(1, good, grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    const bool good = look(v) && ForwardingProblem::constraints(v, new_v, g);
    return passes(2, good, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    const bool good = look(v) && ForwardingProblem::jacobian(v, new_v, values);
    return passes(3, good, values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    const bool good = look(v) && look(lambda) &&
                      ForwardingProblem::hessian(v, new_v, sigma, lambda, new_lambda, values);
    return passes(4, good, values);
  }

 private:
  [[nodiscard]] bool look(std::span<const double> numbers) {
    for (const double number : numbers) {
      if (std::isfinite(number)) continue;
      ++calls_not_finite_;
      return false;
    }
    return true;
  }
  [[nodiscard]] bool passes(int function, bool good, std::span<double> values) {
    ++calls_;
    if (!good || game_.fails_from == 0 || calls_ < game_.fails_from ||
        function != game_.failing_function) {
      return good;
    }
    if (!game_.fails_with_nan || values.empty()) return false;
    values.back() = std::numeric_limits<double>::quiet_NaN();
    return true;
  }

  const RandomGame& game_;
  int calls_ = 0, calls_not_finite_ = 0;
};

}  // namespace ipminmax::testing
