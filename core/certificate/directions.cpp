#include <algorithm>
#include <cmath>
#include <vector>

#include "core/certificate/trial.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/model/indices.hpp"
#include "core/model/iterate.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

/// One player's directions, and arcs along them: steps brought back to the constraints that the
/// system counts and to the inner maximum, with the matrix at hand. They tell what the value does
/// along a direction. Max: y moves, x is held, with K_yy; Min: x moves, y answers, with K.
struct DirectionSearch {
  TestContext& c;
  ActiveSetSystem& system;
  const Point& point;
  Player owner;
  /// Arcs are brought back to where the value is stationary in all directions but those found.
  bool stationary;
  CanonicalProblem& canonical = c.canonical;
  bool inner = owner == Player::Max;
  IndexRange own = inner ? canonical.y() : canonical.x();
  std::vector<Vector> found{};      ///< scaled, owned parts orthonormal
  std::optional<Vector> descent{};  ///< of a minimization: a step to smaller values

  struct Arc {
    bool reached = false;  ///< corrections converged, inside all bounds
    double change = 0.0;   ///< of the value, what a violation left over is worth included
    double left = 0.0;     ///< that worth
    double moved = 0.0;    ///< longest entry of the way, scaled
  };
  struct Moved {
    Vector v, lambda;
    Evaluation evaluation;
  };

  /// The owned part of a vector.
  auto part(const Vector& d) const { return d.segment(own.begin, own.size()); }
  double length(const Vector& v) const { return longest(canonical, v, system.scaling); }
  double curvature(const Vector& d) const {
    return curvature_along(canonical, system.assembled(), d);
  }
  bool right_with(const Regularization& shift) const {
    KktSystem& kkt = system.kkt;
    return inner ? kkt.has_expected_inner_inertia(kkt.factorize_inner(shift))
                 : kkt.has_expected_inertia(kkt.factorize(shift));
  }

  /// Orthogonal to those found, scaled, with an owned part of length one. Without a tangent
  /// direction, or with curvature along all, solutions grow little: empty.
  std::optional<Vector> least_curvature(double least_growth, int most_solves) const {
    NewtonResidual rhs = zero_step(canonical);
    Step step = zero_step(canonical);
    const auto solve = [&](const NewtonResidual& right, Step& solution) {
      return system.solve(inner, right, solution);
    };
    const auto prepare = [&](Vector& d) {
      for (const Index i : indices(d)) {
        if (!system.is_free(i)) d[i] = 0.0;
      }
      for (const Vector& other : found) d -= part(other).dot(part(d)) * other;
    };
    constexpr double kSettled = 1e-2;  // change of the curvature
    bool grew = true;
    double last = 0.0;
    const auto stop = [&](int k, double growth) {
      grew = k == 0 || growth >= least_growth;
      const double now = (inner ? 1.0 : -1.0) * curvature(step.v);
      const bool settled = k > 1 && now > 0.0 && std::abs(now - last) <= kSettled * now;
      last = now;
      return !grew || settled;
    };
    const InverseIteration how{
        .variables = own, .iterations = most_solves, .number = static_cast<int>(found.size())};
    if (!turn_to_curvature(how, rhs, step, solve, prepare, stop) || !grew) return {};
    return std::move(step.v);
  }

  // --- Arcs --------------------------------------------------------------------------------------

  /// A scaled direction as a step of canonical variables; slacks of open inequalities move along.
  Vector step_along(const Vector& direction) const {
    Vector step = direction.cwiseProduct(system.scaling.variable);
    for_each_in_jacobian(canonical, point.evaluation, [&](Index row, Index col, double value) {
      const Index slack = canonical.slack_of(row);
      if (slack >= 0 && !system.is_fixed(slack)) step[slack] += value * step[col];
    });
    return step;
  }

  /// Bounds and open inequalities, of which c tells by how much their slack is off.
  bool is_inside(Vector v, const Vector& values) const {
    for_each_slack(canonical, [&](Index j, Index slack) {
      if (!system.is_fixed(slack)) v[slack] += values[j];
    });
    bool inside = true;
    for_each_bound(canonical, v, [&](Index i, int side, double) {
      inside = inside && (side < 0 ? v[i] >= canonical.lower()[i] : v[i] <= canonical.upper()[i]);
    });
    return inside;
  }

  /// Without f, which corrections do not need.
  bool evaluate(Moved& trial) const {
    return canonical.constraints(trial.v, trial.evaluation.c) &&
           canonical.first_derivatives(trial.v, trial.evaluation);
  }

  /// f with what the violation left over is worth.
  double lagrangian(const Evaluation& evaluation) const {
    double value = evaluation.f;
    for (const Index j : each_constraint(canonical)) {
      if (system.counts(j)) value += point.iterate.lambda[j] * evaluation.c[j];
    }
    return value;
  }

  bool corrects(Index constraint) const {
    return system.counts(constraint) && !(inner && constraint < canonical.max_constraints().begin);
  }

  /// Of the constraints and the stationarity of those who answer, negative, scaled.
  NewtonResidual residual_of(const Moved& trial) const {
    NewtonResidual rhs = zero_step(canonical);
    for (const Index j : each_constraint(canonical)) {
      if (corrects(j)) rhs.lambda[j] = -system.scaling.constraint[j] * trial.evaluation.c[j];
    }
    if (inner && !stationary) return rhs;
    Vector gradient = trial.evaluation.gradient;
    for_each_in_jacobian(canonical, trial.evaluation, [&](Index row, Index col, double value) {
      if (system.counts(row) || system.set.is_redundant(row))
        gradient[col] += value * trial.lambda[row];
    });
    for (const Index i : indices(gradient)) {
      const bool answers = canonical.y().contains(i) || (!inner && stationary);
      if (answers && system.is_free(i)) rhs.v[i] = -system.scaling.variable[i] * gradient[i];
    }
    auto rest = rhs.v.segment(own.begin, own.size());
    for (const Vector& direction : found) rest -= part(direction).dot(rest) * part(direction);
    return rhs;
  }

  /// One Newton step with the matrix at hand. residual: what was left before, scaled.
  bool correct(Moved& trial, double& residual) const {
    const NewtonResidual rhs = residual_of(trial);
    residual = std::max(max_norm(rhs.v), max_norm(rhs.lambda));
    if (residual == 0.0) return true;
    Step step = zero_step(canonical);
    if (!system.solve(inner, rhs, step)) return false;
    for (Index i = inner ? own.begin : 0; i < canonical.variables(); ++i) {
      if (system.is_free(i)) trial.v[i] += system.scaling.variable[i] * step.v[i];
    }
    for (const Index j : each_constraint(canonical)) {
      if (corrects(j)) trial.lambda[j] += system.scaling.constraint[j] * step.lambda[j];
    }
    return evaluate(trial);
  }

  /// step: canonical variables; corrections end below negligible times the length, squared where
  /// not stationary.
  Arc take(const Vector& step, double along) const {
    Arc arc;
    Moved trial{point.iterate.v + along * step, point.iterate.lambda, point.evaluation};
    const Vector none = Vector::Zero(canonical.constraints());
    if (!is_inside(trial.v, none) || !evaluate(trial)) return arc;  // corrections are small
    const double scale = stationary ? std::abs(along) : along * along;
    constexpr double kFeasible = 1e-2;  // over the square of the step
    const double small = stationary ? kRootOfRounding : kFeasible;
    const double negligible = stationary ? kSafety * kRootOfRounding : kNegligible;
    double residual = 0.0, before = kInfinity;
    constexpr int kMostRefinements = 6;
    // Corrections that hardly contract do not arrive.
    for (int k = 0; k < kMostRefinements; ++k, before = residual) {
      if (!correct(trial, residual)) return arc;
      if (residual <= negligible * scale || !(residual <= kConfirmed * before)) break;
    }
    if (!(residual <= small * scale) || !canonical.objective(trial.v, trial.evaluation.f)) {
      return arc;
    }
    arc.reached = is_inside(trial.v, trial.evaluation.c);
    arc.change = lagrangian(trial.evaluation) - lagrangian(point.evaluation);
    arc.left = std::abs(arc.change - (trial.evaluation.f - point.evaluation.f));
    arc.moved = length(trial.v - point.iterate.v);
    return arc;
  }

  // --- Directions that refute a point ------------------------------------------------------------

  /// Whether the value changes as the curvature, of the wrong sign, says over an arc of this
  /// length.
  bool gains(const Vector& step, double wrong, double along) const {
    const double predicted = 0.5 * along * along * wrong;
    if (!(predicted > kRounding * std::abs(point.evaluation.f))) return false;
    const Arc arc = take(step, along);
    // Where gradients are dependent a violation may be all that the gain is worth.
    return arc.reached && arc.moved >= kConfirmed * std::abs(along) * length(step) &&
           arc.left <= kConfirmed * std::abs(arc.change) &&
           (inner ? arc.change : -arc.change) >= kMinorShare * predicted;
  }

  /// With a shift that makes the matrix right, a smaller one where that finds nothing.
  std::optional<WrongCurvature> refute(double margin, double distance) const {
    for (const double first : {1e-2, 1e-4, 1e-6}) {
      double shift = first;
      const auto is_right = [&] {
        return right_with({.x = inner ? 0.0 : shift,
                           .y = inner ? shift : 0.0,
                           .lambda_x = kDualShift,
                           .lambda_y = kDualShift});
      };
      constexpr int kMostShifts = 16, kIterations = 16;
      constexpr double kLeastGrowth = 1e-3;  // over that of a vanishing eigenvalue
      for (int k = 0; !is_right(); ++k, shift *= kGrowth) {
        if (k == kMostShifts) return {};
      }
      if (const auto direction = least_curvature(kLeastGrowth / shift, kIterations)) {
        const double wrong = (inner ? 1.0 : -1.0) * curvature(*direction);
        if (wrong > 0.0) {
          double least = kClearlyWrong * margin * direction->squaredNorm();
          // Differences may be wrong by as much.
          if (c.hessian_error)
            least += c.scaled_hessian_error(system.scaling).dot(direction->cwiseAbs2());
          if (!(wrong > least)) return {};
          return try_steps(step_along(*direction), wrong, distance);
        }
      }
      if (shift > first) return {};
    }
    return {};
  }

  std::optional<WrongCurvature> try_steps(const Vector& step, double wrong, double distance) const {
    double along = kShareOfSize * std::max(1.0, length(point.iterate.v));
    constexpr int kLengths = 16;
    for (int k = 0; k < kLengths && along >= distance / kSafety; ++k, along *= kShorter) {
      // In both directions, so that no slope left over counts.
      if (gains(step, wrong, along) && gains(step, wrong, -along))
        return WrongCurvature{owner, step};
    }
    return {};
  }

  // --- Directions without curvature --------------------------------------------------------------

  /// Of the value, over a step of length one: bounds that are relaxed give it multipliers' changes.
  double change_by_relaxation(const Vector& step) const {
    Vector change = Vector::Zero(step.size());
    add_hessian_product(canonical, point.evaluation, step, change);
    double sum = 0.0;
    for (const Index i : indices(step)) {
      const int side = system.set.side_of(i);
      if (system.is_fixed(i) && side != 0)
        sum += std::abs(change[i]) * relaxation_of(canonical, i, side, c.options);
    }
    return sum;
  }

  /// At the end of an arc that does not stay at the same value, or on the other side, unless the
  /// curvature explains most of a rise: then it rises there, too.
  void look_for_descent(const Vector& step, double along, double bend, const Arc& arc) {
    const double explained = 0.5 * bend * along * along;
    if (canonical.y().size() > 0 ||
        (explained > 0.0 && std::abs(arc.change - explained) <= kConfirmed * explained)) {
      return;
    }
    const auto falls = [&](const Arc& a) {
      return a.reached && a.change < -kNegligible * (std::abs(point.evaluation.f) + along * along);
    };
    if (falls(arc)) {
      descent = along * step;
    } else if (along > 0.0 && falls(take(step, -along))) {
      descent = -along * step;
    }
  }

  bool is_flat(const Vector& step, double bend) {
    // As far as the start, if that is farther: lengths may be short beside the variables. Bounds
    // that are near leave shorter arcs.
    const double most =
        kShareOfSize * std::max(1.0, size_of_problem(canonical, point.iterate.v, system.scaling));
    const double rounding =
        kEpsilon * point.evaluation.gradient.cwiseProduct(point.iterate.v).lpNorm<1>();
    const double relaxed = change_by_relaxation(step);
    int constant = 0;
    for (double along = most; along >= kLeastFar * most; along *= kShorter) {
      const double value = std::abs(point.evaluation.f) + along * along;
      for (const double sign : {1.0, -1.0}) {
        const Arc arc = take(step, sign * along);
        if (!arc.reached) continue;
        if (arc.moved < kConfirmed * (length(step) * along)) return false;
        if (!(std::abs(arc.change) <= kConstant * value + rounding + relaxed * along)) {
          look_for_descent(step, sign * along, bend, arc);
          return false;
        }
        constexpr int kAgreeing = 3;
        if (++constant == kAgreeing) return true;
      }
    }
    return false;
  }

  /// Those with little curvature. proximal: of Max's where x moves.
  void collect(double margin, double proximal = 0.0) {
    if (!right_with({.x = inner ? 0.0 : margin, .y = inner ? margin : proximal - margin})) return;
    const double most = margin / kSafety;
    constexpr std::size_t kMostDirections = 6;
    constexpr int kIterations = 4;
    while (found.size() < kMostDirections) {
      auto direction = least_curvature(kSafety / most, kIterations);
      if (!direction || std::abs(curvature(*direction)) > most * direction->squaredNorm()) break;
      found.push_back(std::move(*direction));
    }
  }

  FlatDirections look_for_flat(double margin) {
    collect(margin);
    if (found.empty()) return {};
    FlatDirections answer{true, step_along(found.front())};
    std::vector<Vector> tried = {found.front()};
    if (found.size() > 1) {  // all together, as each costs evaluations
      tried.push_back(Vector::Zero(canonical.variables()));
      for (const auto k : indices(found))
        tried.back() += std::cos(1.0 + static_cast<double>(k)) * found[k];
    }
    for (const Vector& direction : tried) {
      const double size = direction.squaredNorm(), bend = curvature(direction);
      double own_curvature = 0.0;  // what the variables alone would have
      for_each_in_hessian(canonical, system.assembled(), [&](Index i, Index j, double value) {
        if (i == j) own_curvature += std::abs(value) * direction[i] * direction[i];
      });
      // Beside x, an answer of Max is as good where it is better than those next to it.
      const bool none = std::abs(bend) <= kNegligible * own_curvature + kRounding * size ||
                        (inner && canonical.x().size() > 0 && bend < 0.0);
      const Vector step = step_along(direction);
      if ((none || bend <= margin * size) && is_flat(step, bend) && none) continue;
      return {false, step, std::move(descent)};
    }
    return answer;
  }
};

}  // namespace

std::optional<WrongCurvature> find_refuting_direction(TestContext& c, ActiveSetSystem& system,
                                                      const TrialPoint& trial, Player owner) {
  system.assemble({.min_fixed = true, .max_fixed = owner == Player::Max});
  return DirectionSearch{c, system, trial.point, owner, false}.refute(c.margin(),
                                                                      trial.newton.step);
}

FlatDirections find_flat_directions(TestContext& c, ActiveSetSystem& system, const Point& point,
                                    double margin, Player owner) {
  system.assemble({.min_fixed = true, .max_fixed = true});
  return DirectionSearch{c, system, point, owner, true}.look_for_flat(margin);
}

std::vector<Vector> find_uncurved_directions(TestContext& c, ActiveSetSystem& system,
                                             const TrialPoint& trial) {
  system.assemble({.min_fixed = true, .max_fixed = true});
  DirectionSearch search{c, system, trial.point, Player::Min, true};
  search.collect(c.margin(), trial.proximal);
  return std::move(search.found);
}

}  // namespace ipminmax
