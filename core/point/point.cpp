#include "core/point/point.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/numbers.hpp"

namespace ipminmax {

Point unevaluated_point(const CanonicalProblem& canonical, const Iterate& iterate) {
  Point point;
  begin_at(canonical, iterate, point);
  return point;
}

void begin_at(const CanonicalProblem& canonical, const Iterate& iterate, Point& point) {
  point.iterate = iterate;
  point.evaluation.f = 0.0;
  point.evaluation.jacobian_call = point.evaluation.hessian_call = 0;
  point.error = KktError::unknown();
  point.evaluation.c.setZero(canonical.constraints());
  point.evaluation.gradient.setZero(canonical.variables());
  point.evaluation.jacobian.assign(canonical.jacobian().size(), 0.0);
  point.evaluation.hessian.assign(canonical.hessian().size(), 0.0);
  point.evaluation.low_rank = nullptr;
  point.dual.setZero(canonical.variables());
}

bool evaluate_values(CanonicalProblem& canonical, Point& point) {
  return canonical.values(point.iterate.v, point.evaluation.f, point.evaluation.c);
}

bool evaluate_first_derivatives(CanonicalProblem& canonical, Point& point) {
  if (!canonical.first_derivatives(point.iterate.v, point.evaluation)) return false;
  renew_dual(canonical, point);
  return true;
}

bool evaluate_second_derivatives(CanonicalProblem& canonical, Point& point) {
  return canonical.second_derivatives(point.iterate.v, point.iterate.lambda, point.evaluation);
}

bool evaluate_derivatives(CanonicalProblem& canonical, Point& point) {
  return evaluate_first_derivatives(canonical, point) &&
         evaluate_second_derivatives(canonical, point);
}

void evaluate_where_defined(CanonicalProblem& canonical, Point& point) {
  const Eigen::VectorXd& v = point.iterate.v;
  Evaluation& e = point.evaluation;
  if (!canonical.objective(v, e.f)) e.f = kNaN;
  if (!canonical.constraints(v, e.c)) e.c.setConstant(kNaN);
  if (!canonical.first_derivatives(v, e)) {
    e.gradient.setConstant(kNaN);
    std::ranges::fill(e.jacobian, kNaN);
  }
  renew_dual(canonical, point);
}

void measure(const CanonicalProblem& canonical, const SolverOptions& options, Point& point) {
  point.parts = error_parts(canonical, point, options.s_max);
  point.error = kkt_error(canonical, point, options.mu_target);
}

void measure_anew(const CanonicalProblem& canonical, const SolverOptions& options, Point& point) {
  renew_dual(canonical, point);
  measure(canonical, options, point);
}

namespace {

/// Sum of the logarithms of distances with the signs of their players, of copies or of the others.
double logs(const CanonicalProblem& canonical, const Eigen::VectorXd& v, bool of_copies) {
  double sum = 0.0;
  for_each_bound(canonical, v, [&](Index i, int, double distance) {
    if ((canonical.robust_slack(i) >= 0) != of_copies) return;
    sum += canonical.sign(i) * std::log(distance);
  });
  return sum;
}

}  // namespace

double barrier_objective(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double f,
                         double mu) {
  return f + mu * (canonical.damping().dot(v) - logs(canonical, v, false));
}

double barrier_of_copies(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double mu) {
  return canonical.has_copies() ? -mu * logs(canonical, v, true) : 0.0;
}

void barrier_gradient(const CanonicalProblem& canonical, const Point& point, double mu,
                      Eigen::VectorXd& gradient) {
  gradient = point.evaluation.gradient + mu * canonical.damping();
  for_each_bound(canonical, point.iterate.v, [&](Index i, int side, double distance) {
    gradient[i] += side * canonical.sign(i) * mu / distance;
  });
}

double violation(const Eigen::VectorXd& c, IndexRange constraints) {
  return constraints.size() > 0 ? c.segment(constraints.begin, constraints.size()).lpNorm<1>()
                                : 0.0;
}

}  // namespace ipminmax
