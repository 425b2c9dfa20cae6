#include "core/proof/boxes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include <Eigen/Dense>

#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Within which, relative to max(1, |bound|), a constraint or bound may have a multiplier.
constexpr double kActive = 1e-6;
/// A side that is this much longer, over the domain's, than that which promises most is cut first.
constexpr double kLongest = 8.0;

using Box = std::vector<Interval>;

struct Waiting {
  Box box;
  double bound;
  std::size_t side;      ///< to cut; the dimension: none
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
  for (std::size_t i = 0; i < box.size(); ++i) {
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
  Multipliers(FunctionOfBoxes& function, const Box& domain, const std::vector<double>& y)
      : lambda_(function.rows().size(), 0.0) {
    const Box point(y.begin(), y.end());
    FunctionOfBoxes::Look here;
    function.look(point, here);
    std::vector<std::size_t> between, active;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const double margin = kActive * std::max(1.0, std::abs(y[i]));
      if (y[i] > domain[i].lower() + margin && y[i] < domain[i].upper() - margin) {
        between.push_back(i);
      }
    }
    for (std::size_t k = 0; k < lambda_.size(); ++k) {
      if (side(function.rows()[k], here.rows[k].value().middle()) != 0) active.push_back(k);
    }
    const auto n = static_cast<Eigen::Index>(between.size());
    while (!active.empty() && n > 0) {
      Eigen::MatrixXd a(n, static_cast<Eigen::Index>(active.size()));
      Eigen::VectorXd f(n);
      for (Eigen::Index i = 0; i < n; ++i) {
        const std::size_t variable = between[static_cast<std::size_t>(i)];
        f[i] = here.value.gradient(variable).middle();
        for (std::size_t k = 0; k < active.size(); ++k) {
          a(i, static_cast<Eigen::Index>(k)) = here.rows[active[k]].gradient(variable).middle();
        }
      }
      if (!a.allFinite() || !f.allFinite()) return;
      const Eigen::VectorXd solution = a.completeOrthogonalDecomposition().solve(f);
      std::size_t wrong = active.size();
      double worst = 0.0;
      for (std::size_t k = 0; k < active.size(); ++k) {
        const auto& row = function.rows()[active[k]];
        if (row.lower == row.upper) continue;
        const double out = solution[static_cast<Eigen::Index>(k)] *
                           side(row, here.rows[active[k]].value().middle());
        if (out < worst) {
          worst = out;
          wrong = k;
        }
      }
      if (wrong < active.size()) {
        active.erase(active.begin() + static_cast<std::ptrdiff_t>(wrong));
        continue;
      }
      for (std::size_t k = 0; k < active.size(); ++k) {
        lambda_[active[k]] = solution[static_cast<Eigen::Index>(k)];
      }
      return;
    }
  }

  /// value + sum lambda (bound - g), which on Y(x) is no less than the value: lambda > 0 goes with
  /// the upper bound, lambda < 0 with the lower.
  [[nodiscard]] IntervalJet lagrangian(const FunctionOfBoxes& function,
                                       const FunctionOfBoxes::Look& look) const {
    IntervalJet l = look.value;
    for (std::size_t k = 0; k < lambda_.size(); ++k) {
      const double bound = lambda_[k] > 0.0 ? function.rows()[k].upper : function.rows()[k].lower;
      if (lambda_[k] == 0.0 || !std::isfinite(bound)) continue;
      l += IntervalJet(lambda_[k]) * (IntervalJet(bound) - look.rows[k]);
    }
    return l;
  }
  [[nodiscard]] bool any() const {
    return std::ranges::any_of(lambda_, [](double value) { return value != 0.0; });
  }

 private:
  /// 1: the upper bound is active, -1: the lower one, 0: none.
  static int side(const FunctionOfBoxes::Row& row, double g) {
    if (row.upper - g <= kActive * std::max(1.0, std::abs(row.upper))) return 1;
    return g - row.lower <= kActive * std::max(1.0, std::abs(row.lower)) ? -1 : 0;
  }

  std::vector<double> lambda_;
};

class BranchAndBound {
 public:
  BranchAndBound(FunctionOfBoxes& function, const Box& domain, double tolerance, BestSeen& best)
      : function_(function), domain_(domain), tolerance_(tolerance), best_(best) {
    if (!best.y.empty()) multipliers_.emplace(function, domain, best.y);
  }

  BoxBound run(const std::function<bool(Index, double)>& go_on) {
    BoxBound result{.proved = kInfinity};
    put(domain_);
    while (!waiting_.empty()) {
      const double bound = waiting_.top().bound;
      if (bound <= good_enough() || !go_on(boxes_, bound)) break;
      const Waiting next = waiting_.top();
      waiting_.pop();
      cut(next);
    }
    result.boxes = boxes_;
    if (!waiting_.empty()) {
      settled_ = std::max(settled_, waiting_.top().bound);
      if (waiting_.top().bound > good_enough()) result.left = static_cast<Index>(waiting_.size());
    }
    result.proved = std::max(settled_, best_.value);
    return result;
  }

 private:
  [[nodiscard]] double good_enough() const {
    if (best_.value == -kInfinity) return -kInfinity;
    return best_.value + tolerance_ * std::max(1.0, std::abs(best_.value));
  }

  void cut(const Waiting& parent) {
    const std::size_t i = parent.side;
    if (i == parent.box.size()) {  // nothing between the numbers that it holds
      settled_ = std::max(settled_, parent.bound);
      return;
    }
    const double middle = parent.box[i].middle();
    for (const bool upper : {false, true}) {
      Box child = parent.box;
      child[i] = upper ? Interval(middle, child[i].upper()) : Interval(child[i].lower(), middle);
      put(std::move(child), parent.bound);
    }
  }

  /// Looks at a box that is a part of one with that bound; what may hold more waits.
  void put(Box box, double bound = kInfinity) {
    for (;;) {
      ++boxes_;
      const Box center = center_of(box);
      function_.look(box, over_);
      function_.look(center, at_);
      bool feasible = true;
      for (std::size_t k = 0; k < function_.rows().size(); ++k) {
        const Interval g = enclosure(over_.rows[k], at_.rows[k], box, center);
        const auto& [constraint, lower, upper] = function_.rows()[k];
        if (g.lower() > upper || g.upper() < lower) return;
        feasible = feasible && g.lower() >= lower && g.upper() <= upper;
      }
      bound = std::min(bound, enclosure(over_.value, at_.value, box, center).upper());
      if (multipliers_ && multipliers_->any()) {
        bound = std::min(bound, enclosure(multipliers_->lagrangian(function_, over_),
                                          multipliers_->lagrangian(function_, at_), box, center)
                                    .upper());
      }
      see(center);
      if (bound <= good_enough()) {
        settled_ = std::max(settled_, bound);
        return;
      }
      if (!feasible) break;
      const std::optional<bool> smaller = leave_what_is_no_maximum(box);
      if (!smaller) return;
      if (!*smaller) break;
    }
    const std::size_t side = side_to_cut(box);
    waiting_.push({std::move(box), bound, side, ++number_});
  }

  /// A point where all constraints hold for certain.
  void see(const Box& center) {
    for (std::size_t k = 0; k < function_.rows().size(); ++k) {
      const Interval& g = at_.rows[k].value();
      if (g.lower() < function_.rows()[k].lower || g.upper() > function_.rows()[k].upper) return;
    }
    if (!(at_.value.value().lower() > best_.value)) return;
    const bool clearly = at_.value.value().lower() > good_enough();
    best_.value = at_.value.value().lower();
    best_.y.clear();
    for (const Interval& side : center) best_.y.push_back(side.lower());
    if (clearly) multipliers_.emplace(function_, domain_, best_.y);
  }

  /// Of a box where all constraints hold: none, it has no maximum but those of its neighbours; true:
  /// its maxima are in what is left of it. At a maximum the slope along a variable between its
  /// domain's ends is zero and the curvature is not positive, if one can go on either way: over a
  /// face the neighbour decides, which is either kept or such a box, too.
  std::optional<bool> leave_what_is_no_maximum(Box& box) const {
    for (std::size_t i = 0; i < box.size(); ++i) {
      if (box[i].lower() == box[i].upper()) continue;
      const Interval& slope = over_.value.gradient(i);
      const bool at_lower = box[i].lower() == domain_[i].lower();
      const bool at_upper = box[i].upper() == domain_[i].upper();
      const bool rises = slope.lower() > 0.0, falls = slope.upper() < 0.0;
      if (rises || falls) {
        if (!(rises ? at_upper : at_lower)) return std::nullopt;
        box[i] = rises ? domain_[i].upper() : domain_[i].lower();
        return true;
      }
      if (over_.value.hessian(i, i).lower() > 0.0) {
        if (!at_lower && !at_upper) return std::nullopt;
        if (at_lower && at_upper) continue;  // both ends: cutting comes to it
        box[i] = at_lower ? domain_[i].lower() : domain_[i].upper();
        return true;
      }
    }
    return false;
  }

  /// Of the box looked at last: along which the bound has most to gain; the dimension: none can be
  /// cut.
  [[nodiscard]] std::size_t side_to_cut(const Box& box) const {
    const IntervalJet gained =
        multipliers_ ? multipliers_->lagrangian(function_, over_) : over_.value;
    std::size_t best = box.size(), longest = box.size();
    double most = -1.0, length = 0.0;
    const auto share = [&](std::size_t i) {
      return (box[i].upper() - box[i].lower()) / (domain_[i].upper() - domain_[i].lower());
    };
    for (std::size_t i = 0; i < box.size(); ++i) {
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

  FunctionOfBoxes& function_;
  const Box& domain_;
  double tolerance_;
  BestSeen& best_;
  std::optional<Multipliers> multipliers_;
  std::priority_queue<Waiting> waiting_;
  double settled_ = -kInfinity;  ///< largest bound of what was left alone
  Index boxes_ = 0;
  std::uint64_t number_ = 0;
  FunctionOfBoxes::Look over_, at_;
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

void FunctionOfBoxes::look(std::span<const Interval> y, Look& look) {
  for (std::size_t k = 0; k < variables_.size(); ++k) {
    v_[at(variables_[k])] = {y[k], k, variables_.size()};
  }
  look.value = functions_.objective_over(v_);
  look.rows.clear();
  if (rows_.empty()) return;
  functions_.constraints_over(v_, g_);
  for (const Row& row : rows_) look.rows.push_back(g_[at(row.constraint)]);
}

Interval FunctionOfBoxes::value_over(std::span<const Interval> y) {
  for (std::size_t k = 0; k < variables_.size(); ++k) {
    v_[at(variables_[k])] = IntervalJet(y[k]);
  }
  return functions_.objective_over(v_).value();
}

BoxBound bound_over_boxes(FunctionOfBoxes& function, const std::vector<Interval>& domain,
                          double tolerance, BestSeen& best,
                          const std::function<bool(Index, double)>& go_on) {
  return BranchAndBound(function, domain, tolerance, best).run(go_on);
}

}  // namespace ipminmax
