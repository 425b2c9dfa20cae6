#include "core/certificate/hessian_check.hpp"

#include <algorithm>

#include "core/certificate/parameters.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

/// Adds a direction of little curvature of one player to the one found, the other one answering.
void add_little_curvature(const CanonicalProblem& canonical, KktSystem& kkt,
                          const CurvatureTrial& trial, bool inner, CurvatureArrays& arrays) {
  LittleCurvature& found = arrays.found;
  const IndexRange own = inner ? canonical.y() : canonical.x();
  set_zero(canonical, arrays.rhs);
  set_zero(canonical, arrays.solution);
  // Of these solutions only the size and the direction matter, and the factors have been tested.
  const auto solve = [&](const NewtonResidual& rhs, Step& step) {
    return inner ? kkt.solve_inner(*trial.assembled, rhs, step, kUnrefined)
                 : kkt.solve(*trial.assembled, rhs, step, kUnrefined);
  };
  const auto prepare = [&](Eigen::VectorXd& d) {
    for (Index i = 0; i < d.size(); ++i) {
      if (arrays.held[at(i)]) d[i] = 0.0;
    }
  };
  const auto stop = [&](int k, double growth) {
    if (k == 0) return false;
    if (1.0 / growth < found.least || found.variable < 0) {
      found.least = std::min(found.least, 1.0 / growth);
      arrays.solution.v.segment(own.begin, own.size()).cwiseAbs().maxCoeff(&found.variable);
      found.variable += own.begin;
    }
    return true;
  };
  if (!turn_to_curvature({.variables = own, .iterations = 2}, arrays.rhs, arrays.solution, solve,
                         prepare, stop)) {
    return;
  }
  const double length = max_norm(arrays.solution.v);
  if (length > 0.0) found.direction += arrays.solution.v / length;
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
    if (canonical.x().size() > 0) add_little_curvature(canonical, kkt, trial, false, arrays);
    if (canonical.y().size() > 0) add_little_curvature(canonical, kkt, trial, true, arrays);
  }
  for (Index i = 0; i < canonical.variables(); ++i) {
    if (!arrays.held[at(i)]) found.direction[i] += generic_entry(i);
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
  step = (parameter::kHardly + parameter::kRootOfRounding * size) / longest * curvature.direction;
  arrays.largest = parameter::kMostFar * point.iterate.v.array().abs().max(1.0);
  step.array() = step.array().max(-arrays.largest).min(arrays.largest);
  keep_within_bounds(canonical, point.iterate.v, parameter::kLittle, step);
  return compare_second_derivatives(canonical, point.iterate.v, lambda, point.evaluation, step,
                                    units.variable,
                                    std::clamp(parameter::kLittle * curvature.least,
                                               parameter::kLeastError, parameter::kLargestError),
                                    arrays.differences);
}

}  // namespace ipminmax
