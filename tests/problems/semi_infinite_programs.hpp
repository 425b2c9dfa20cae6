#pragma once

#include <functional>
#include <limits>
#include <ostream>
#include <string>
#include <support/autodiff_problem.hpp>
#include <utility>
#include <vector>

namespace ipminmax::testing {

/// A semi-infinite program, min f(x) with g(x, t) <= 0 for every t in a box of one or two
/// dimensions.
struct SemiInfinite {
  using Variables = const std::vector<Expression>&;
  using Point = std::vector<double>;

  std::string name;
  Point start;
  std::function<Expression(Variables x)> objective;
  std::vector<std::function<Expression(Variables x, Variables t)>> rows;  ///< each <= 0 for every t
  Point lower{0.0}, upper{1.0};                                           ///< of t
  double optimum =
      std::numeric_limits<double>::quiet_NaN();  ///< as published or exact, to tolerance
  double tolerance = 1e-6;                       ///< relative to max(1, |optimum|)
  Point x_lower{}, x_upper{};                    ///< empty: free
  /// The worst t stands at a bound without a slope there, or is nearly equalled by others: nothing
  /// strict is shown.
  bool weakly_active = false;
};

/// Names a problem in a test's output.
inline void PrintTo(const SemiInfinite& problem, std::ostream* out) { *out << problem.name; }

[[nodiscard]] std::vector<SemiInfinite> semi_infinite_programs();

/// With t as Max variables behind x and the rows as robust constraints.
[[nodiscard]] Model model_of(const SemiInfinite& program);
/// The program's start, t in the middle of its box.
[[nodiscard]] std::vector<double> start_of(const SemiInfinite& program);

/// Values of the rows.
class SemiInfiniteRows {
 public:
  using Point = std::vector<double>;
  explicit SemiInfiniteRows(const SemiInfinite& program);

  /// x may have more values behind. Throws std::domain_error where a row is undefined.
  [[nodiscard]] const std::vector<double>& at(const Point& x, const Point& t);
  /// The largest value of a row over t and where it is: on a grid, and from its 20 largest values
  /// by smaller and smaller grids.
  [[nodiscard]] std::pair<double, Point> largest(const Point& x, std::size_t row);

 private:
  void refine(const Point& x, std::size_t row, Point step, std::pair<double, Point>& found);

  const SemiInfinite& program_;
  AutodiffProblem problem_;
  std::vector<double> g_;
  Point v_;
};

/// A lower bound of the optimum near x: constraints at the worst t only, added until none is
/// violated by more than 1e-9, so that it is the optimum. NaN when that fails.
[[nodiscard]] double cutting_plane_bound(const SemiInfinite& program, std::vector<double> x);

}  // namespace ipminmax::testing
