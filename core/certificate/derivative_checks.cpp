#include <algorithm>
#include <cmath>

#include "core/certificate/trial.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/model/iterate.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

/// A direction of little curvature of both matrices, by two inverse iterations each.
struct CurvatureSearch {
  TestContext& c;
  const ActiveSetSystem* system;
  Parts parts;
  NewtonResidual& rhs = parts.step();
  Step& solution = parts.step();
  Step& more = parts.step();
  Vector& direction = more.v;  ///< canonical lengths
  LittleCurvature& found = c.arrays.curvature;

  /// Variables at active bounds, and slacks.
  bool is_held(Index i) const { return system ? !system->is_free(i) : is_slack(c.canonical, i); }

  /// Adds a direction of little curvature of one player, the other one answering.
  void add(const Evaluation& assembled, bool inner) {
    const IndexRange own = inner ? c.canonical.y() : c.canonical.x();
    if (own.size() == 0) return;
    set_zero(c.canonical, rhs);
    set_zero(c.canonical, solution);
    // Of these solutions only the size and the direction matter, and the factors have been tested.
    const auto solve = [&](const NewtonResidual& right, Step& step) {
      return inner ? c.kkt.solve_inner(assembled, right, step, kUnrefined)
                   : c.kkt.solve(assembled, right, step, kUnrefined);
    };
    const auto prepare = [&](Vector& d) {
      for (const Index i : indices(d)) {
        if (is_held(i)) d[i] = 0.0;
      }
    };
    const auto stop = [&](int k, double growth) {
      if (k > 0 && (1.0 / growth < found.least || found.variable < 0)) {
        found.least = std::min(found.least, 1.0 / growth);
        solution.v.segment(own.begin, own.size()).cwiseAbs().maxCoeff(&found.variable);
        found.variable += own.begin;
      }
      return k > 0;
    };
    if (!turn_to_curvature({.variables = own, .iterations = 2}, rhs, solution, solve, prepare,
                           stop)) {
      return;
    }
    const double length = max_norm(solution.v);
    if (length > 0.0) direction += solution.v / length;
  }

  /// The direction, with a generic part, so that errors of all rows show. assembled: null if there
  /// are no factors.
  void find(const Evaluation* assembled) {
    direction.setZero(c.canonical.variables());
    found = {};
    for (const bool inner : {false, true}) {
      if (assembled) add(*assembled, inner);
    }
    for (const Index i : each_variable(c.canonical)) {
      if (!is_held(i)) direction[i] += generic_entry(i);
    }
    if (system) direction.array() *= system->scaling.variable.array();
  }

  /// Compares W with a difference of gradients along the direction, to a tenth of its curvature.
  /// Returns the row of W that disagrees most; empty: none, or the model is undefined on both sides
  /// of the point. lambda: for which W was evaluated.
  std::optional<Deviation> wrong_row(const Point& point, const Vector& lambda,
                                     const VariableScaling& scaling) {
    const Vector& v = point.iterate.v;
    const double longest = max_norm(direction.cwiseQuotient(scaling.variable));
    if (!(longest > 0.0)) return std::nullopt;
    const double size = ipminmax::longest(c.canonical, v, scaling);
    Vector &step = more.z_lower, &largest = more.z_upper;
    step = (kNearby + kRootOfRounding * size) / longest * direction;
    largest = kMostFar * v.array().abs().max(1.0);
    step = step.cwiseMax(-largest).cwiseMin(largest);
    keep_within_bounds(c.canonical, v, kShareOfRoom, step);
    return compare_second_derivatives(
        c.canonical, v, lambda, point.evaluation, step, scaling.variable,
        std::clamp(kMinorShare * found.least, kLeastError, kLargestError),
        {.first = rhs, .second = solution, .end = parts.point().evaluation});
  }
};

/// A vertex of one player, of_max, or the other.
struct CornerCheck {
  TestContext& c;
  const TrialPoint& trial;
  const Point& point;
  CanonicalProblem& canonical = c.canonical;
  const ActiveBounds& set = trial.set;
  Parts parts = c.parts;
  Step &first = parts.step(), &second = parts.step();
  Vector &here = first.v, &there = first.z_lower;  ///< gradients of the Lagrangian
  Vector& balanced = first.z_upper;  ///< what active bounds and inequalities balance of the first
  Vector &step = second.v, &predicted = second.z_lower, &longest = second.lambda;
  Evaluation& scratch = parts.point().evaluation;
  double off = 0.0;  ///< of active bounds, over the variable's own size

  bool is_active(Index i) const { return set[i] == BoundClass::Active && set.side_of(i) != 0; }
  double size(Index i) const { return own_size(canonical, point.iterate.v[i], i, trial.scaling); }
  void take_gradient(const Evaluation& evaluation, Vector& gradient) const {
    gradient = evaluation.gradient;
    add_transposed_product(canonical, evaluation, point.iterate.lambda, gradient);
  }
  /// f(row, col, entry) of active inequalities.
  template <class Visit>
  void for_each_active(Visit&& visit) const {
    for_each_in_jacobian(canonical, point.evaluation, [&](Index row, Index col, double value) {
      const Index slack = canonical.slack_of(row);
      if (slack >= 0 && is_active(slack) && !set.is_left_out(row)) visit(row, col, value);
    });
  }

  /// Whether curvature says something of a player: he has more variables, but for free ones that
  /// nothing reads, than active bounds and rows.
  bool has_free_variable(bool of_max) const {
    Vector& read = step;
    read.setZero(canonical.variables());
    for_each_in_hessian(canonical, point.evaluation, [&](Index i, Index j, double value) {
      if (value != 0.0) read[i] = read[j] = 1.0;
    });
    for_each_in_jacobian(canonical, point.evaluation, [&](Index, Index col, double value) {
      if (value != 0.0) read[col] = 1.0;
    });
    Index free = 0;
    for (const Index i : each_variable(canonical)) {
      if (canonical.owned_by_max(i) != of_max) continue;
      const bool active = set[i] == BoundClass::Active;
      if (is_slack(canonical, i)) {
        free -= active ? 1 : 0;
      } else {
        free += !active && read[i] != 0.0 ? 1 : 0;
      }
    }
    return free > 0;
  }

  void balance() {
    take_gradient(point.evaluation, here);
    balanced.setZero(canonical.variables());
    for_each_active([&](Index row, Index col, double value) {
      balanced[col] = std::max(balanced[col], std::abs(point.iterate.lambda[row] * value));
    });
    for (const Index i : each_variable(canonical)) {
      if (!is_active(i)) continue;
      off = std::max(off, (set.distance(canonical, point.iterate, i) +
                           relaxation_of(canonical, i, set.side_of(i), c.options)) /
                              size(i));
      if (!is_slack(canonical, i)) balanced[i] = set.multiplier(point.iterate, i);
    }
  }

  /// Beyond what the point and bound_relax_factor keep from any of the bounds.
  double reach(Index i) const {
    constexpr double kBeyond = 10.0, kFarthest = 1e-2;
    return size(i) * std::min(kNearby + kBeyond * off, kFarthest);
  }

  /// The first direction goes far in every other variable, the second one in those between.
  void step_inside(bool of_max, int number) const {
    constexpr double kShort = 0.05;
    step.setZero(canonical.variables());
    longest.setZero(canonical.constraints());
    const auto next = [&] { return number++ % 2 == 0 ? 1.0 : kShort; };
    for (const Index i : each_variable(canonical)) {
      if (is_active(i) && !is_slack(canonical, i) && canonical.owned_by_max(i) == of_max)
        step[i] = -set.side_of(i) * reach(i) * next();
    }
    const auto for_each_slope = [&](auto&& visit) {
      for_each_active([&](Index row, Index col, double value) {
        if (!is_active(col) && canonical.owned_by_max(col) == of_max &&
            canonical.max_constraints().contains(row) == of_max) {
          visit(row, col, value * trial.scaling.variable[col]);
        }
      });
    };
    for_each_slope([&](Index row, Index, double slope) {
      longest[row] = std::max(longest[row], std::abs(slope));
    });
    for (double& length : longest) length = length > 0.0 ? next() / length : 0.0;
    for_each_slope([&](Index row, Index col, double slope) {
      step[col] -= set.side_of(canonical.slack_of(row)) * longest[row] * slope * reach(col);
    });
  }

  Index lost_along(bool of_max, int number) const {
    step_inside(of_max, number);
    if (step.isZero(0.0)) return -1;
    // Of the answers of Max his own multipliers have to stay, of a step of Min all.
    const auto is_tested = [&](Index i) {
      return balanced[i] > 0.0 && (canonical.owned_by_max(i) || !of_max);
    };
    predicted.setZero(step.size());
    add_hessian_product(canonical, point.evaluation, step, predicted);
    double shorter = 1.0;
    for (const Index i : indices(step)) {
      const double most = kMinorShare * balanced[i];
      if (is_tested(i) && std::abs(predicted[i]) > most)
        shorter = std::min(shorter, most / std::abs(predicted[i]));
    }
    scratch = point.evaluation;
    Vector& change = there;
    change = point.iterate.v + shorter * step;
    if (!canonical.first_derivatives(change, scratch)) return -1;
    take_gradient(scratch, change);
    change -= here;
    for (const Index i : indices(step)) {
      if (!is_tested(i)) continue;
      // Of a bound's multiplier what it gains is no matter.
      const double lost =
          is_active(i) ? set.side_of(i) * canonical.sign(i) * change[i] : std::abs(change[i]);
      if (!(lost <= (1.0 - kMinorShare) * balanced[i])) return i;
    }
    return -1;
  }
};

}  // namespace

void TestContext::examine_curvature(const Point& point, const Vector& lambda,
                                    const ActiveSetSystem* system, const Evaluation* assembled) {
  if (!system) scale_variables(canonical, point.iterate.v, point.evaluation, parts, arrays.scaling);
  const VariableScaling& scaling = system ? system->scaling : arrays.scaling;
  CurvatureSearch search{*this, system, system ? system->parts : parts};
  search.find(system ? &system->assembled() : assembled);
  // Differences have errors of their own, which the tests allow for.
  if (!hessian_error) wrong_row = search.wrong_row(point, lambda, scaling);
}

Index multiplier_lost_inside(TestContext& c, const TrialPoint& trial, const Point& point) {
  // A minimization is compared with Ipopt, which looks at no corner.
  if (c.canonical.max_size() == 0) return -1;
  CornerCheck check{c, trial, point};
  const bool x = !check.has_free_variable(false), y = !check.has_free_variable(true);
  if (x || y) check.balance();
  for (const bool of_max : {true, false}) {
    for (int number = 0; number < 2 && (of_max ? y : x); ++number) {
      const Index lost = check.lost_along(of_max, number);
      if (lost >= 0) return lost;
    }
  }
  return -1;
}

}  // namespace ipminmax
