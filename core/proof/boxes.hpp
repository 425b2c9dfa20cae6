#pragma once

#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/formulas/interval.hpp"
#include "core/model/compare.hpp"
#include "core/proof.hpp"

namespace ipminmax {

/// The objective of a problem as a function of its free variables y, the others held, and the
/// constraints that y has to meet.
class FunctionOfBoxes {
 public:
  /// A constraint with its bounds, infinite where it has none.
  struct Row {
    Index constraint;
    double lower, upper;
    /// Of its value at a point, whose interval is rounding.
    [[nodiscard]] bool is_met(const Interval& g) const {
      return g.lower() <= upper && g.upper() >= lower;
    }
  };
  /// What is known of all points of a box.
  struct BoxValues {
    IntervalJet value;
    std::vector<IntervalJet> rows;  ///< in the order of rows()
  };

  /// v: n. constraints: m, of which rows count. The functions outlive this.
  FunctionOfBoxes(const BoxFunctions& functions, std::span<const double> v, std::size_t constraints,
                  std::vector<Index> variables, std::vector<Row> rows);

  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] bool is_concurrent() const { return functions_.is_concurrent(); }
  /// y: as many as variables.
  void evaluate(std::span<const Interval> y, BoxValues& found);
  /// By the formulas alone, for any number of variables.
  [[nodiscard]] Interval value_over(std::span<const Interval> y);

 private:
  const BoxFunctions& functions_;
  std::vector<Index> variables_;
  std::vector<Row> rows_;
  std::vector<IntervalJet> v_, g_;
};

/// What the model's functions themselves are at some points, with rounding: whatever is said of a
/// box that holds one has to agree.
struct KnownValues {
  struct Point {
    std::vector<double> y;
    Interval value;
    std::vector<Interval> rows;
    bool is_met;  ///< all rows are
  };
  std::vector<Point> points;
  std::vector<ValueRange> rows;
};

/// A function over boxes, the objective (-1) or a constraint, is not the one at points.
class WrongOverBoxes : public std::domain_error {
 public:
  WrongOverBoxes(Index function, const Interval& over, double value);
  Index constraint;
};

/// Throws WrongOverBoxes where what is said of a box cannot be what is known of a point inside.
void agree(Index function, const Interval& over, const Interval& known);

/// A point and a value that the function has there at least.
struct BestSeen {
  std::vector<double> y;                                    ///< empty: none
  double value = -std::numeric_limits<double>::infinity();  ///< then
  ValueRange range{};                                       ///< of all points seen
};

struct BoxBound {
  double proved;  ///< no point has more; -infinity: there is no point
  Index boxes = 0, left = 0;
};

/// When branch and bound ends, and by how many threads.
struct BoxEffort {
  double tolerance;  ///< gap over the range of values seen at which a box is left alone
  /// Asked with the boxes looked at and the bound: false ends it.
  std::function<bool(Index, double)> go_on;
  int threads = 1;  ///< where the functions can be called by several
};

/// Branch and bound over a domain, best bound first. best: improved on the way. The same for any
/// number of threads.
[[nodiscard]] BoxBound bound_over_boxes(const FunctionOfBoxes& function,
                                        const std::vector<Interval>& domain,
                                        const KnownValues& values, const BoxEffort& effort,
                                        BestSeen& best);

}  // namespace ipminmax
