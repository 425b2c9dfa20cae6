#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/interval.hpp"
#include "core/proof.hpp"

namespace ipminmax {

/// sign times f or a constraint as a function of Max's free variables y, x held, and the constraints
/// that y has to meet.
class FunctionOfBoxes {
 public:
  /// A constraint of Max's with its bounds, infinite where it has none.
  struct Row {
    Index constraint;
    double lower, upper;
  };
  /// What is known of all points of a box.
  struct Look {
    IntervalJet value;
    std::vector<IntervalJet> rows;  ///< in the order of rows()
  };

  /// constraint: -1 for f. variables, rows: Max's that count. v: n. The functions outlive this.
  FunctionOfBoxes(const BoxFunctions& functions, std::span<const double> v, std::size_t constraints,
                  Index constraint, double sign, std::vector<Index> variables,
                  std::vector<Row> rows);

  [[nodiscard]] std::size_t dimension() const { return variables_.size(); }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  /// y: as many as variables.
  void look(std::span<const Interval> y, Look& look);

 private:
  const BoxFunctions& functions_;
  Index constraint_;
  double sign_;
  std::vector<Index> variables_;
  std::vector<Row> rows_;
  std::vector<IntervalJet> v_, g_;
};

/// A point and a value that the function has there at least.
struct BestSeen {
  std::vector<double> y;  ///< empty: none
  double value;           ///< -infinity then
};

struct BoxBound {
  double proved;  ///< no point has more; -infinity: there is no point
  Index boxes = 0, left = 0;
};

/// Branch and bound over a domain, best bound first. best: improved on the way. tolerance: relative
/// gap at which a box is left alone. go_on(boxes, bound): false ends it.
[[nodiscard]] BoxBound bound_over_boxes(FunctionOfBoxes& function,
                                        const std::vector<Interval>& domain, double tolerance,
                                        BestSeen& best,
                                        const std::function<bool(Index, double)>& go_on);

}  // namespace ipminmax
