#include "core/certificate/bound_classes.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/newton.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {
namespace {

/// z / s in units above which a bound is guessed active, and its inverse below which inactive.
constexpr double kStrictRatio = 100.0;
/// Share of what an active distance (an inactive multiplier) loses with mu that makes a class certain.
constexpr double kClearTrend = 0.75;
constexpr double kDecrease = 0.05;  // of mu
constexpr int kMostSteps = 8;
constexpr double kLeastBarrier = 1e-18;
/// Distance to a bound, relative to the bound or the variable, that still has digits.
constexpr double kRounding = 1e-13;
constexpr double kTau = 0.995;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

BoundClasses no_classes(const CanonicalProblem& canonical) {
  BoundClasses classes;
  classes.of.assign(at(canonical.variables()), BoundClass::Inactive);
  classes.side.assign(at(canonical.variables()), 0);
  return classes;
}

void include(BoundClasses& classes, Index i, std::int8_t side, BoundClass found) {
  if (classes.side[at(i)] != 0 && found <= classes[i]) return;
  classes.of[at(i)] = found;
  classes.side[at(i)] = side;
}

void count_doubtful(const CanonicalProblem& canonical, BoundClasses& classes) {
  classes.weak_min = classes.weak_max = 0;
  for (Index i = 0; i < canonical.variables(); ++i) {
    if (classes[i] != BoundClass::Doubtful) continue;
    ++(canonical.owned_by_max(i) ? classes.weak_max : classes.weak_min);
  }
}

/// visit(variable, side, distance, multiplier) for every bound.
template <class Visit>
void for_each_bound(const CanonicalProblem& canonical, const Iterate& z, Visit&& visit) {
  for (const Index i : canonical.lower_bounded()) {
    visit(i, std::int8_t{-1}, z.v[i] - canonical.lower()[i], z.z_lower[i]);
  }
  for (const Index i : canonical.upper_bounded()) {
    visit(i, std::int8_t{1}, canonical.upper()[i] - z.v[i], z.z_upper[i]);
  }
}

bool has_digits(const CanonicalProblem& canonical, const Iterate& z) {
  bool all = true;
  for_each_bound(canonical, z, [&](Index i, std::int8_t side, double distance, double) {
    const double bound = side < 0 ? canonical.lower()[i] : canonical.upper()[i];
    all = all && distance > kRounding * std::max(std::abs(bound), std::abs(z.v[i]));
  });
  return all;
}

/// From the relative changes over a full step to kDecrease mu.
BoundClasses classes_by_trend(const CanonicalProblem& canonical, const Iterate& before,
                              const Iterate& after) {
  BoundClasses classes = no_classes(canonical);
  for_each_bound(canonical, before, [&](Index i, std::int8_t side, double distance, double z) {
    const double later =
        side < 0 ? after.v[i] - canonical.lower()[i] : canonical.upper()[i] - after.v[i];
    const double later_z = side < 0 ? after.z_lower[i] : after.z_upper[i];
    const double nearer = (1.0 - later / distance) / (1.0 - kDecrease);
    const double weaker = (1.0 - later_z / z) / (1.0 - kDecrease);
    const bool active = nearer >= kClearTrend && weaker <= 1.0 - kClearTrend;
    const bool inactive = weaker >= kClearTrend && nearer <= 1.0 - kClearTrend;
    include(classes, i, side,
            active     ? BoundClass::Active
            : inactive ? BoundClass::Inactive
                       : BoundClass::Doubtful);
  });
  count_doubtful(canonical, classes);
  return classes;
}

}  // namespace

double BoundClasses::distance(const CanonicalProblem& canonical, const Iterate& z, Index i) const {
  return side[at(i)] < 0 ? z.v[i] - canonical.lower()[i] : canonical.upper()[i] - z.v[i];
}

double BoundClasses::multiplier(const Iterate& z, Index i) const {
  return side[at(i)] < 0 ? z.z_lower[i] : z.z_upper[i];
}

BoundClasses guess_classes(const CanonicalProblem& canonical, const Iterate& iterate,
                           const Units& units) {
  BoundClasses classes = no_classes(canonical);
  for_each_bound(canonical, iterate, [&](Index i, std::int8_t side, double distance, double z) {
    const double ratio = z / distance * units.variable[i] * units.variable[i];
    include(classes, i, side,
            ratio > kStrictRatio         ? BoundClass::Active
            : ratio < 1.0 / kStrictRatio ? BoundClass::Inactive
                                         : BoundClass::Doubtful);
  });
  count_doubtful(canonical, classes);
  return classes;
}

BoundClasses follow_barrier(CanonicalProblem& canonical, KktSystem& kkt,
                            const SolverOptions& options, const BoundClasses& guess, Point& point,
                            double& mu) {
  BoundClasses classes = guess;
  const auto error = [&](const Point& p) {
    return kkt_error(canonical, p.iterate, p.evaluation, p.dual, options.s_max).total;
  };
  const double allowed = std::max(error(point), options.tol);
  for (int k = 0; k <= kMostSteps; ++k) {
    const double next = k == 0 ? mu : kDecrease * mu;  // to the central path first
    if (next < kLeastBarrier) break;
    Point trial = point;
    StepLength alpha;
    if (!barrier_newton_step(canonical, kkt, next, kTau, trial, alpha) ||
        !has_digits(canonical, trial.iterate) || !(error(trial) <= allowed)) {
      break;
    }
    const bool full = alpha.primal == 1.0 && alpha.dual == 1.0;
    if (k > 0 && full) classes = classes_by_trend(canonical, point.iterate, trial.iterate);
    std::swap(point, trial);
    mu = next;
    if (k > 0 && full && classes.clear()) break;
  }
  return classes;
}

}  // namespace ipminmax
