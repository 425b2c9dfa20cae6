#include <algorithm>
#include <cmath>
#include <limits>

#include "core/point/merit.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {

void evaluate_where_defined(CanonicalProblem& canonical, Point& point) {
  constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
  const Eigen::VectorXd& v = point.iterate.v;
  Evaluation& e = point.evaluation;
  if (canonical.objective(v, e.f) != EvaluationStatus::Ok) e.f = kUndefined;
  if (canonical.constraints(v, e.c) != EvaluationStatus::Ok) e.c.setConstant(kUndefined);
  if (canonical.first_derivatives(v, e) != EvaluationStatus::Ok) {
    e.gradient.setConstant(kUndefined);
    std::ranges::fill(e.jacobian, kUndefined);
  }
  dual_residual(canonical, point.iterate, e, point.dual);
}

double barrier_objective(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double f,
                         double mu) {
  double logs = 0.0;
  for (const Index i : canonical.lower_bounded()) {
    logs += canonical.sign(i) * std::log(canonical.above_lower(i, v[i]));
  }
  for (const Index i : canonical.upper_bounded()) {
    logs += canonical.sign(i) * std::log(canonical.below_upper(i, v[i]));
  }
  return f + mu * (canonical.damping().dot(v) - logs);
}

void barrier_gradient(const CanonicalProblem& canonical, const Point& point, double mu,
                      Eigen::VectorXd& gradient) {
  gradient = point.evaluation.gradient + mu * canonical.damping();
  const Eigen::VectorXd& v = point.iterate.v;
  for (const Index i : canonical.lower_bounded()) {
    gradient[i] -= canonical.sign(i) * mu / canonical.above_lower(i, v[i]);
  }
  for (const Index i : canonical.upper_bounded()) {
    gradient[i] += canonical.sign(i) * mu / canonical.below_upper(i, v[i]);
  }
}

double violation(const Eigen::VectorXd& c, IndexRange constraints) {
  return constraints.size() > 0 ? c.segment(constraints.begin, constraints.size()).lpNorm<1>()
                                : 0.0;
}

}  // namespace ipminmax
