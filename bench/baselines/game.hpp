#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/problem.hpp"
#include "core/result.hpp"

/// Ways to solve a minmax problem, with one signature: Answer method(Game&, start, Limits).
namespace bench {

using ipminmax::Index;
using ipminmax::Problem;

inline std::size_t at(Index i) { return static_cast<std::size_t>(i); }

using Random = std::mt19937;
/// The same numbers with every standard library.
inline double uniform(Random& random, double lower, double upper) {
  return lower + (upper - lower) * static_cast<double>(random()) / 0x1p32;
}

/// A problem, and what some methods have to be told about it.
struct Game {
  std::string name{};
  std::unique_ptr<Problem> problem{};
  std::function<std::vector<double>(Random&)> random_start{};

  /// Max variables that the Max equalities determine from everything else (states of shared
  /// dynamics); the cutting-set method lets them follow in every scenario.
  std::vector<Index> states{};

  /// The same game without states and with sets that can be projected on, for first-order methods.
  /// project: to the nearest point of both players' sets; empty: no such form is known.
  std::unique_ptr<Problem> reduced{};  ///< null: the problem itself
  std::function<std::vector<double>(std::span<const double>)> reduce{}, lift{};
  std::function<void(std::span<double>)> project{};
  /// Steps that tuning has found, by method.
  struct Steps {
    double x = 0.0, y = 0.0;
  };
  Steps gda{}, extragradient{};
};

struct Limits {
  double seconds = 5.0;  ///< CPU time
};

struct Answer {
  bool applicable = true;
  bool claims = false;     ///< its own stopping test was met
  bool certified = false;  ///< it comes with a certificate of the library
  std::vector<double> v{};
  double seconds = 0.0;
  ipminmax::Counts counts{};  ///< of the model's functions
};

using Method = std::function<Answer(Game&, std::span<const double>, const Limits&)>;

/// The games of the comparison.
[[nodiscard]] std::vector<Game> games();

/// (ours) with the given options; with pure Newton or without globalization it is a baseline too.
[[nodiscard]] Answer solve_filter(Game& game, std::span<const double> start, const Limits& limits);
[[nodiscard]] Answer solve_algorithm_one(Game& game, std::span<const double> start,
                                         const Limits& limits);
[[nodiscard]] Answer solve_pure_newton(Game& game, std::span<const double> start,
                                       const Limits& limits);

/// (a) One level: Ipopt minimizes f subject to the first-order conditions of the inner
/// maximization, complementarity relaxed to <= t, t = 0.1 to 1e-9 with primal-dual warm starts
/// (Scholtes 2001).
[[nodiscard]] Answer solve_single_level(Game& game, std::span<const double> start,
                                        const Limits& limits);

/// (b) Nested: Ipopt with a limited-memory Hessian minimizes phi(x) = max over y, each value and
/// gradient (envelope theorem) from an inner solve by Ipopt with exact derivatives.
[[nodiscard]] Answer solve_nested_ipopt(Game& game, std::span<const double> start,
                                        const Limits& limits);

/// (c) Cutting sets (Mutapcic, Boyd 2009): Ipopt minimizes the largest of f(x, y_k), then Ipopt
/// maximizes over y, and the new y joins. Not applicable when Y depends on x other than by states.
[[nodiscard]] Answer solve_cutting_set(Game& game, std::span<const double> start,
                                       const Limits& limits);

/// (d) Projected gradient descent ascent and extragradient with constant steps.
[[nodiscard]] Answer solve_gda(Game& game, std::span<const double> start, const Limits& limits);
[[nodiscard]] Answer solve_extragradient(Game& game, std::span<const double> start,
                                         const Limits& limits);
/// Finds the steps of both: the best of a grid, on starts of their own.
void tune_first_order(Game& game, Random& random);

/// The problems that (a) and (c) hand to Ipopt, for tests of their derivatives. game must outlive
/// them; the last needs applicable scenarios.
[[nodiscard]] std::unique_ptr<Problem> single_level_problem(const Game& game,
                                                            std::span<const double> start);
[[nodiscard]] std::unique_ptr<Problem> scenario_problem(
    const Game& game, std::span<const std::vector<double>> scenarios);

/// Whether a local minmax that the library certifies lies within 1e-3 max(1, |v|) of a point:
/// solves from there with small barrier parameters.
[[nodiscard]] bool is_local_minmax(Problem& problem, const std::vector<double>& v);

}  // namespace bench
