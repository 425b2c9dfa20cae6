#include "core/proof/boxes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include <Eigen/Dense>

#include "core/model/indices.hpp"
#include "core/model/parameters.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"
#include "linalg/workers.hpp"

namespace ipminmax {
namespace {

/// A side that is this much longer, over the domain's, than that which promises most is cut first.
constexpr double kLongest = 8.0;

using Box = std::vector<Interval>;

struct Waiting {
  Box box;
  double bound;
  std::size_t side;      ///< to cut
  std::uint64_t number;  ///< the earlier first among equals
  friend bool operator<(const Waiting& a, const Waiting& b) {
    return a.bound != b.bound ? a.bound < b.bound : a.number > b.number;
  }
};

Box center_of(const Box& box) {
  Box center;
  for (const Interval& side : box) center.emplace_back(side.middle());
  return center;
}

/// What a function is in a box at most and at least, by its derivatives there and at the center.
Interval enclosure(const IntervalJet& over, const IntervalJet& at, const Box& box,
                   const Box& center) {
  Interval mean = at.value(), second = at.value();
  for (const auto i : indices(box)) {
    if (box[i].lower() == box[i].upper()) continue;
    const Interval d = box[i] - center[i];
    mean += over.gradient(i) * d;
    second += at.gradient(i) * d + Interval(0.5) * over.hessian(i, i) * square(d);
    for (std::size_t j = 0; j < i; ++j) {
      if (box[j].lower() == box[j].upper()) continue;
      second += over.hessian(i, j) * d * (box[j] - center[j]);
    }
  }
  return intersection(intersection(over.value(), mean), second);
}

/// Where y is at neither end, by which a multiplier has to hold the value.
class Multipliers {
 public:
  /// Of the value at y by least squares over the rows that are active there; those of a wrong sign
  /// go, one by one.
  Multipliers(FunctionOfBoxes& function, const Box& domain, const std::vector<ValueRange>& ranges,
              const std::vector<double>& y)
      : lambda_(function.rows().size(), 0.0) {
    const Box point(y.begin(), y.end());
    FunctionOfBoxes::BoxValues here;
    function.evaluate(point, here);
    std::vector<std::size_t> between, active;
    for (const auto i : indices(y)) {
      const double margin = parameters::kHardly * (domain[i].upper() - domain[i].lower());
      if (y[i] > domain[i].lower() + margin && y[i] < domain[i].upper() - margin) {
        between.push_back(i);
      }
    }
    for (const auto k : indices(lambda_)) {
      if (side(function.rows()[k], ranges[k], here.rows[k].value().middle()) != 0) {
        active.push_back(k);
      }
    }
    const auto n = static_cast<Eigen::Index>(between.size());
    while (!active.empty() && n > 0) {
      Eigen::MatrixXd a(n, static_cast<Eigen::Index>(active.size()));
      Eigen::VectorXd f(n);
      for (Eigen::Index i = 0; i < n; ++i) {
        const std::size_t variable = between[static_cast<std::size_t>(i)];
        f[i] = here.value.gradient(variable).middle();
        for (const auto k : indices(active)) {
          a(i, static_cast<Eigen::Index>(k)) = here.rows[active[k]].gradient(variable).middle();
        }
      }
      if (!a.allFinite() || !f.allFinite()) return;
      const Eigen::VectorXd solution = a.completeOrthogonalDecomposition().solve(f);
      std::size_t wrong = active.size();
      double worst = 0.0;
      for (const auto k : indices(active)) {
        const auto& row = function.rows()[active[k]];
        if (row.lower == row.upper) continue;
        const double out = solution[static_cast<Eigen::Index>(k)] *
                           side(row, ranges[active[k]], here.rows[active[k]].value().middle());
        if (out < worst) {
          worst = out;
          wrong = k;
        }
      }
      if (wrong < active.size()) {
        active.erase(active.begin() + static_cast<std::ptrdiff_t>(wrong));
        continue;
      }
      for (const auto k : indices(active)) {
        lambda_[active[k]] = solution[static_cast<Eigen::Index>(k)];
      }
      return;
    }
  }

  /// value + sum lambda (bound - g), which on Y(x) is no less than the value: lambda > 0 goes with
  /// the upper bound, lambda < 0 with the lower.
  [[nodiscard]] IntervalJet lagrangian(const FunctionOfBoxes& function,
                                       const FunctionOfBoxes::BoxValues& found) const {
    IntervalJet l = found.value;
    for (const auto k : indices(lambda_)) {
      const double bound = lambda_[k] > 0.0 ? function.rows()[k].upper : function.rows()[k].lower;
      if (lambda_[k] == 0.0 || !std::isfinite(bound)) continue;
      l += IntervalJet(lambda_[k]) * (IntervalJet(bound) - found.rows[k]);
    }
    return l;
  }
  [[nodiscard]] bool any() const {
    return std::ranges::any_of(lambda_, [](double value) { return value != 0.0; });
  }

 private:
  /// 1: the upper bound is active, -1: the lower one, 0: none.
  static int side(const FunctionOfBoxes::Row& row, const ValueRange& range, double g) {
    const double margin = range.resolution(parameters::kHardly);
    if (row.upper - g <= margin) return 1;
    return g - row.lower <= margin ? -1 : 0;
  }

  std::vector<double> lambda_;
};

/// What is known when a batch of boxes begins.
struct Known {
  const Box& domain;
  const KnownValues& values;
  double highest;  ///< seen
  double gap;      ///< above the highest at which a box is left alone
  std::optional<Multipliers> multipliers;
};

/// A part of a box that waits; none has more than `bound`.
struct Part {
  Box box;
  double bound;
};

/// What was found in one part.
struct PartResult {
  std::optional<Waiting> rest;  ///< what may hold more
  double settled = -kInfinity;  ///< bound of what was left alone
  BestSeen best;
  Index boxes = 0;
};

/// Looks at one part at a time, for one thread.
class PartBounder {
 public:
  explicit PartBounder(const FunctionOfBoxes& function) : function_(function) {}

  [[nodiscard]] PartResult bound(Part part, const Known& known) {
    PartResult result;
    Box& box = part.box;
    for (;;) {
      ++result.boxes;
      const Box center = center_of(box);
      function_.evaluate(box, over_);
      function_.evaluate(center, at_);
      std::vector<const KnownValues::Point*> inside;
      for (const KnownValues::Point& point : known.values.points) {
        if (holds(box, point.y)) inside.push_back(&point);
      }
      bool feasible = true, defined = true;
      for (const auto k : indices(function_.rows())) {
        const Interval g = enclosure(over_.rows[k], at_.rows[k], box, center);
        const FunctionOfBoxes::Row& row = function_.rows()[k];
        for (const auto* point : inside) agree(row.constraint, g, point->rows[k]);
        if (!row.is_met(g)) return result;
        feasible = feasible && g.lower() >= row.lower && g.upper() <= row.upper;
        defined = defined && row.is_met(at_.rows[k].value());
      }
      bound_value(box, center, known, part.bound);
      for (const auto* point : inside) {
        agree(-1, enclosure(over_.value, at_.value, box, center), point->value);
        if (point->is_met) agree(-1, {-kInfinity, part.bound + known.gap}, point->value);
      }
      see(center, std::max(known.highest, result.best.value), result.best);
      // Without a bound at a point no boxes around it have one.
      const bool hopeless =
          defined && std::isinf(part.bound) && std::isinf(at_.value.value().upper());
      if (hopeless || part.bound <= std::max(known.highest, result.best.value) + known.gap) {
        result.settled = part.bound;
        return result;
      }
      if (!feasible) break;
      const std::optional<bool> smaller = leave_what_is_no_maximum(box, known.domain);
      if (!smaller) return result;
      if (!*smaller) break;
    }
    const std::size_t side = side_to_cut(box, known);
    if (side == box.size()) {  // nothing between the numbers that it holds
      result.settled = part.bound;
    } else {
      result.rest = Waiting{std::move(box), part.bound, side, 0};
    }
    return result;
  }

 private:
  static bool holds(const Box& box, const std::vector<double>& y) {
    return std::ranges::equal(
        box, y, [](const Interval& side, double value) { return side.contains(value); });
  }

  void bound_value(const Box& box, const Box& center, const Known& known, double& bound) const {
    bound = std::min(bound, enclosure(over_.value, at_.value, box, center).upper());
    if (!known.multipliers || !known.multipliers->any()) return;
    bound = std::min(bound, enclosure(known.multipliers->lagrangian(function_, over_),
                                      known.multipliers->lagrangian(function_, at_), box, center)
                                .upper());
  }

  /// A point where all constraints hold for certain, if it has more than that.
  void see(const Box& center, double highest, BestSeen& best) const {
    for (const auto k : indices(function_.rows())) {
      const Interval& g = at_.rows[k].value();
      if (g.lower() < function_.rows()[k].lower || g.upper() > function_.rows()[k].upper) return;
    }
    if (!(at_.value.value().lower() > highest)) return;
    best.value = at_.value.value().lower();
    best.y.clear();
    for (const Interval& side : center) best.y.push_back(side.lower());
  }

  /// Of a box where all constraints hold: none, it has no maximum but those of its neighbours;
  /// true: its maxima are in what is left of it. At a maximum the slope along a variable between
  /// its domain's ends is zero and the curvature not positive, if one can go on either way: over a
  /// face the neighbour decides, which is either kept or such a box, too.
  std::optional<bool> leave_what_is_no_maximum(Box& box, const Box& domain) const {
    for (const auto i : indices(box)) {
      if (box[i].lower() == box[i].upper()) continue;
      const Interval& slope = over_.value.gradient(i);
      const bool at_lower = box[i].lower() == domain[i].lower();
      const bool at_upper = box[i].upper() == domain[i].upper();
      const bool rises = slope.lower() > 0.0, falls = slope.upper() < 0.0;
      if (rises || falls) {
        if (!(rises ? at_upper : at_lower)) return std::nullopt;
        box[i] = rises ? domain[i].upper() : domain[i].lower();
        return true;
      }
      if (over_.value.hessian(i, i).lower() > 0.0) {
        if (!at_lower && !at_upper) return std::nullopt;
        if (at_lower && at_upper) continue;  // both ends: cutting comes to it
        box[i] = at_lower ? domain[i].lower() : domain[i].upper();
        return true;
      }
    }
    return false;
  }

  /// Of the box looked at last: along which the bound has most to gain; the dimension: none can be
  /// cut.
  [[nodiscard]] std::size_t side_to_cut(const Box& box, const Known& known) const {
    const IntervalJet gained =
        known.multipliers ? known.multipliers->lagrangian(function_, over_) : over_.value;
    std::size_t best = box.size(), longest = box.size();
    double most = -1.0, length = 0.0;
    const auto share = [&](std::size_t i) {
      return (box[i].upper() - box[i].lower()) /
             (known.domain[i].upper() - known.domain[i].lower());
    };
    for (const auto i : indices(box)) {
      const double middle = box[i].middle();
      if (!(box[i].lower() < middle && middle < box[i].upper())) continue;
      const double width = box[i].upper() - box[i].lower();
      const double gain =
          std::min(gained.gradient(i).magnitude() * width, std::numeric_limits<double>::max());
      if (gain > most) {
        most = gain;
        best = i;
      }
      if (share(i) > length) {
        length = share(i);
        longest = i;
      }
    }
    return best < box.size() && length > kLongest * share(best) ? longest : best;
  }

  FunctionOfBoxes function_;
  FunctionOfBoxes::BoxValues over_, at_;
};

/// Boxes that promise most are cut in batches, whose parts threads share; what they find is put
/// together in their order, so that it is the same for any number of threads.
class BranchAndBound {
 public:
  BranchAndBound(const FunctionOfBoxes& function, const Box& domain, const KnownValues& values,
                 const BoxEffort& effort, BestSeen& best)
      : effort_(effort),
        best_(best),
        function_(function),
        known_{domain, values, best.value, 0.0, {}},
        bounders_(function.is_concurrent() ? at(std::max<Index>(effort.threads, 1)) : 1,
                  PartBounder(function)) {
    if (!best.y.empty()) known_.multipliers.emplace(function_, domain, values.rows, best.y);
  }

  BoxBound run() {
    parts_ = {{known_.domain, kInfinity}};
    bound_parts();
    while (!waiting_.empty() && waiting_.top().bound > enough() && settled_ < kInfinity &&
           effort_.go_on(boxes_, waiting_.top().bound)) {
      parts_.clear();
      // Enough for some threads; more are cut in vain where bounds improve.
      constexpr std::size_t kPartsOfARound = 32;
      while (parts_.size() < kPartsOfARound && !waiting_.empty() &&
             waiting_.top().bound > enough()) {
        cut(waiting_.top());
        waiting_.pop();
      }
      bound_parts();
    }
    BoxBound result{.proved = kInfinity, .boxes = boxes_};
    if (!waiting_.empty()) {
      settled_ = std::max(settled_, waiting_.top().bound);
      if (waiting_.top().bound > enough()) result.left = static_cast<Index>(waiting_.size());
    }
    result.proved = std::max(settled_, best_.value);
    return result;
  }

 private:
  [[nodiscard]] double gap() const { return best_.range.resolution(effort_.tolerance); }
  [[nodiscard]] double enough() const { return best_.value + gap(); }

  void cut(const Waiting& parent) {
    const Interval& side = parent.box[parent.side];
    const double middle = side.middle();
    for (const Interval& half : {Interval(side.lower(), middle), Interval(middle, side.upper())}) {
      parts_.push_back({parent.box, parent.bound});
      parts_.back().box[parent.side] = half;
    }
  }

  void bound_parts() {
    known_.highest = best_.value;
    known_.gap = gap();
    std::vector<PartResult> results(parts_.size());
    share_tasks(workers_, bounders_.size(), parts_.size(), [&](std::size_t k, std::size_t thread) {
      results[k] = bounders_[thread].bound(std::move(parts_[k]), known_);
    });
    for (PartResult& result : results) take(result);
  }

  void take(PartResult& result) {
    boxes_ += result.boxes;
    settled_ = std::max(settled_, result.settled);
    if (result.best.value > best_.value) {
      const bool clearly = result.best.value > enough();
      best_.y = std::move(result.best.y);
      best_.value = result.best.value;
      best_.range.see(best_.value);
      if (clearly) {
        known_.multipliers.emplace(function_, known_.domain, known_.values.rows, best_.y);
      }
    }
    if (!result.rest) return;
    result.rest->number = ++number_;
    waiting_.push(std::move(*result.rest));
  }

  const BoxEffort& effort_;
  BestSeen& best_;
  FunctionOfBoxes function_;
  Known known_;
  std::vector<PartBounder> bounders_;  ///< one for each thread
  Workers workers_;
  std::vector<Part> parts_;
  std::priority_queue<Waiting> waiting_;
  double settled_ = -kInfinity;  ///< largest bound of what was left alone
  Index boxes_ = 0;
  std::uint64_t number_ = 0;
};

}  // namespace

FunctionOfBoxes::FunctionOfBoxes(const BoxFunctions& functions, std::span<const double> v,
                                 std::size_t constraints, std::vector<Index> variables,
                                 std::vector<Row> rows)
    : functions_(functions),
      variables_(std::move(variables)),
      rows_(std::move(rows)),
      v_(v.begin(), v.end()),
      g_(constraints) {}

void FunctionOfBoxes::evaluate(std::span<const Interval> y, BoxValues& found) {
  for (const auto k : indices(variables_)) {
    v_[at(variables_[k])] = {y[k], k, variables_.size()};
  }
  found.rows.clear();
  if (rows_.empty()) {
    found.value = functions_.objective_over(v_);
    return;
  }
  found.value = functions_.all_over(v_, g_);
  for (const Row& row : rows_) found.rows.push_back(g_[at(row.constraint)]);
}

Interval FunctionOfBoxes::value_over(std::span<const Interval> y) {
  for (const auto k : indices(variables_)) {
    v_[at(variables_[k])] = IntervalJet(y[k]);
  }
  return functions_.objective_over(v_).value();
}

WrongOverBoxes::WrongOverBoxes(Index function, const Interval& over, double value)
    : std::domain_error("over boxes is in [" + number_text(over.lower(), 6) + ", " +
                        number_text(over.upper(), 6) + "], at a point inside " +
                        number_text(value, 10)),
      constraint(function) {}

void agree(Index function, const Interval& over, const Interval& known) {
  if (over.lower() <= known.upper() && over.upper() >= known.lower()) return;
  throw WrongOverBoxes(function, over, known.middle());
}

BoxBound bound_over_boxes(const FunctionOfBoxes& function, const std::vector<Interval>& domain,
                          const KnownValues& values, const BoxEffort& effort, BestSeen& best) {
  return BranchAndBound(function, domain, values, effort, best).run();
}

}  // namespace ipminmax
