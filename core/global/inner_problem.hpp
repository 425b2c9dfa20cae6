#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/global/witnesses.hpp"
#include "core/model/compare.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/robust/extended_structure.hpp"

// The problem over y at one x: which y there are, and where maximizations begin.
namespace ipminmax {

/// Some variables held where v has them; it starts at v.
class Held final : public Restructured {
 public:
  Held(Problem& model, const std::vector<std::size_t>& variables, std::vector<double> v)
      : Restructured(model), v_(std::move(v)) {
    for (const std::size_t i : variables) fix_variable(changed, static_cast<Index>(i), v_[i]);
  }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    return !start.needs_multipliers;
  }

 private:
  std::vector<double> v_;
};

/// One player's problem: the other's variables are fixed, his constraints absent. v: n values.
[[nodiscard]] Held alone(Problem& model, Player player, std::span<const double> v);

/// Whether the constraints hold; false where they are undefined.
[[nodiscard]] bool is_feasible(Problem& inner, const SolverOptions& options,
                               std::span<const double> v);

/// Options of a solve that is not to forget where it begins: from a large barrier parameter the
/// central path leads to the same maxima whatever the start.
[[nodiscard]] SolverOptions staying_near(const SolverOptions& options);

/// A problem over y, which are its variables that are not fixed.
struct InnerProblem {
  InnerProblem(Problem& problem, const SolverOptions& options, Counts& counts);

  /// None of the variables can run away.
  [[nodiscard]] bool is_box() const { return boxed.size() == free.size(); }
  /// A box, and states that equations determine from variables in it. Otherwise Y may consist of
  /// several parts, and the starts may reach a few of them only.
  [[nodiscard]] bool is_connected() const {
    return s.constraint_lower.empty() ||
           (!has_inequalities && !boxed.empty() && equations + boxed.size() <= free.size());
  }
  /// The same, and the equations determine all that has not two bounds.
  [[nodiscard]] bool is_determined_by_box() const {
    return is_connected() && equations + boxed.size() == free.size();
  }
  /// The value at v; none: the constraints do not hold, or the function is undefined.
  [[nodiscard]] std::optional<double> value_at(const std::vector<double>& v) const;

  /// The start with the boxed variables at bounds: is_upper(k) says whether the k-th is at its
  /// upper one.
  template <class IsUpper>
  [[nodiscard]] std::vector<double> at_bounds(const IsUpper& is_upper) const {
    std::vector<double> v = start;
    for (std::size_t k = 0; k < boxed.size(); ++k)
      v[boxed[k]] = (is_upper(k) ? s.variable_upper : s.variable_lower)[boxed[k]];
    return v;
  }
  /// Vertices of the box have numbers below this: bit k says at which bound the k-th variable is.
  [[nodiscard]] std::size_t vertices() const { return std::size_t{1} << boxed.size(); }
  [[nodiscard]] std::vector<double> vertex(std::size_t number) const {
    return at_bounds([&](std::size_t k) { return (number >> k & 1U) != 0; });
  }

  Problem& model;
  const ProblemStructure& s;
  SolverOptions options;
  Counts& counts;                  ///< evaluations are added
  std::vector<double> start;       ///< where the problem starts; empty: nowhere
  ProblemStructure sampled;        ///< s with all bounds that are known
  std::vector<std::size_t> free;   ///< y
  std::vector<std::size_t> boxed;  ///< of these with two bounds
  std::size_t equations = 0;       ///< constraints that are equations
  bool has_inequalities = false;
};

/// The vertex with the largest value; empty: Y is no box, or of too many variables.
[[nodiscard]] std::vector<double> best_vertex(const InnerProblem& inner);

/// The best of random points of Y, from number `first` on, if its value exceeds `highest` clearly;
/// empty: none does.
[[nodiscard]] std::vector<double> higher_sample(const InnerProblem& inner, Index first,
                                                const ValueRange& range, double highest);

/// From the middle of the box of y, or from the center, a point of a convex Y, where that is not in
/// Y, towards the corner next to a random point, as far as Max's constraints hold; then along
/// single variables to bounds while f grows, and back into Y. Below a convex function the start
/// decides which of many vertices is reached, and random points of a box of many variables are far
/// outside of the half spaces that cut it.
[[nodiscard]] std::vector<double> start_above(const InnerProblem& inner,
                                              std::span<const double> center,
                                              std::vector<double> random, Index start);

/// Beside a maximum: one variable of it moved to another bound, `most` points at most, those with
/// the highest f + lambda'g first. What follows the move may make up for a loss.
[[nodiscard]] Points next_to(const InnerProblem& inner, std::vector<double> v,
                             const std::vector<double>& lambda, std::size_t most);

}  // namespace ipminmax
