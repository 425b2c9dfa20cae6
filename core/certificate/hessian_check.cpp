#include "core/certificate/hessian_check.hpp"

#include <algorithm>
#include <cmath>

#include "core/model/norms.hpp"

namespace ipminmax {
namespace {

/// Longest entry of the step, in units, for a small point, and its growth with the point's size:
/// the rounding of gradients grows with it.
constexpr double kStep = 1e-6;
constexpr double kStepOfSize = 1e-8;
/// Largest entry over the size of the variable, at least 1: lengths may be errors of a W that
/// cancels.
constexpr double kLargestEntry = 1e-4;
/// Share of the distance to a bound.
constexpr double kShareOfDistance = 0.1;
/// Error of W, in units, that counts: a share of the least curvature seen, within limits.
constexpr double kShareOfCurvature = 0.1;
constexpr double kLeastError = 1e-5, kLargestError = 1e-3;
constexpr int kInverseIterations = 2;
/// Of their solutions only the size and the direction matter, and the factors have been tested.
constexpr Accuracy kRough{.ratio = 1.0};

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Inverse iteration from a generic vector, in the lengths of the matrices; adds its normalized
/// end to the direction found.
void add_inverse_iteration(const CanonicalProblem& canonical, KktSystem& kkt,
                           const CurvatureTrial& trial, bool inner, CurvatureArrays& arrays) {
  const Index n = canonical.variables();
  LittleCurvature& found = arrays.found;
  Eigen::VectorXd& direction = arrays.direction;
  direction.setZero(n);
  const Eigen::VectorXd& sines = arrays.generic.sines(n);
  for (Index i = inner ? canonical.y().begin : 0; i < n; ++i) {
    if (!arrays.held[at(i)]) direction[i] = sines[i];
  }
  for (int k = 0; k < kInverseIterations; ++k) {
    const double length = max_norm(direction);
    if (!(length > 0.0)) break;
    NewtonResidual& rhs = arrays.rhs;
    Step& step = arrays.solution;
    set_zero(canonical, rhs);
    set_zero(canonical, step);
    rhs.v = direction / length;
    const bool solved = inner ? kkt.solve_inner(*trial.assembled, rhs, step, kRough)
                              : kkt.solve(*trial.assembled, rhs, step, kRough);
    if (!solved || !step.v.allFinite()) break;
    for (Index i = 0; i < n; ++i) {
      if (arrays.held[at(i)]) step.v[i] = 0.0;
    }
    Index longest = 0;
    const double growth = step.v.cwiseAbs().maxCoeff(&longest);
    if (!(growth > 0.0)) break;
    direction = step.v;
    if (1.0 / growth < found.least || found.variable < 0) {
      found.least = std::min(found.least, 1.0 / growth);
      found.variable = longest;
    }
  }
  const double length = max_norm(direction);
  if (length > 0.0) direction /= length;
  found.direction += direction;
}

}  // namespace

void find_little_curvature(const CanonicalProblem& canonical, KktSystem& kkt,
                           const CurvatureTrial& trial, CurvatureArrays& arrays) {
  LittleCurvature& found = arrays.found;
  found.direction.setZero(canonical.variables());
  found.least = 1.0;
  found.variable = -1;
  arrays.held.resize(at(canonical.variables()));
  for (Index i = 0; i < canonical.variables(); ++i) arrays.held[at(i)] = trial.is_held(i);
  if (trial.assembled) {
    add_inverse_iteration(canonical, kkt, trial, false, arrays);
    if (canonical.y().size() > 0 && canonical.x().size() > 0) {
      add_inverse_iteration(canonical, kkt, trial, true, arrays);
    }
  }
  const Eigen::VectorXd& cosines = arrays.generic.cosines(canonical.variables());
  for (Index i = 0; i < canonical.variables(); ++i) {
    if (!arrays.held[at(i)]) found.direction[i] += cosines[i];
  }
  if (trial.in_units) found.direction.array() *= trial.units.variable.array();
}

std::optional<Deviation> find_wrong_row(CanonicalProblem& canonical, const Point& point,
                                        const Eigen::VectorXd& lambda, const Units& units,
                                        CurvatureArrays& arrays) {
  const LittleCurvature& curvature = arrays.found;
  const double longest = max_norm(curvature.direction.cwiseQuotient(units.variable));
  if (!(longest > 0.0)) return std::nullopt;
  const double size = ipminmax::longest(canonical, point.iterate.v, units);
  Eigen::VectorXd& step = arrays.step;
  step = (kStep + kStepOfSize * size) / longest * curvature.direction;
  arrays.largest = kLargestEntry * point.iterate.v.array().abs().max(1.0);
  step.array() = step.array().max(-arrays.largest).min(arrays.largest);
  keep_within_bounds(canonical, point.iterate.v, kShareOfDistance, step);
  return compare_second_derivatives(
      canonical, point.iterate.v, lambda, point.evaluation, step, units.variable,
      std::clamp(kShareOfCurvature * curvature.least, kLeastError, kLargestError),
      arrays.differences);
}

}  // namespace ipminmax
