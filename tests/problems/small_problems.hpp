#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <support/autodiff_problem.hpp>

namespace ipminmax::testing {

/// What a problem has to offer.
enum class Expectation : std::uint8_t {
  Local,       ///< strict local minmax points, none of them known to be the global minmax
  Global,      ///< strict local minmax points, the global minmax among them
  Degenerate,  ///< a solution at which the second-order conditions cannot decide
  None         ///< no local minmax: a gap (kink) only, or an unbounded maximization
};

/// A solution; multipliers with the signs of Result.
struct KnownSolution {
  std::vector<double> v{};
  double objective = 0.0;
  std::vector<double> lambda{};   ///< m
  std::vector<double> z_lower{};  ///< n, or empty: all zero
  std::vector<double> z_upper{};  ///< n, or empty: all zero
  bool global = false;            ///< proven to be the global minmax
};

struct Interval {
  double lower = 0.0;
  double upper = 0.0;
};

struct SmallProblem {
  std::string name{};
  Expectation expectation = Expectation::Local;
  Model model{};
  std::vector<std::vector<double>> starts{};
  std::vector<KnownSolution> solutions{};  ///< none for Expectation::None
  /// First-order points that are not local minmax.
  std::vector<std::vector<double>> not_minmax{};
  std::vector<Interval> random_start_box{};  ///< n
};

/// Problems with known answers, from the literature and constructed. Made once.
[[nodiscard]] const std::vector<SmallProblem>& small_problems();

/// Throws std::out_of_range when there is none.
[[nodiscard]] const SmallProblem& small_problem(const std::string& name);

}  // namespace ipminmax::testing
