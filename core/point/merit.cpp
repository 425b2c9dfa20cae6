#include <cmath>

#include "core/point/merit.hpp"

namespace ipminmax {

namespace {

/// Sum of the logarithms of distances with the signs of their players, of copies or of the others.
double logs(const CanonicalProblem& canonical, const Eigen::VectorXd& v, bool of_copies) {
  double sum = 0.0;
  for (const Index i : canonical.lower_bounded()) {
    if ((canonical.served_slack(i) >= 0) != of_copies) continue;
    sum += canonical.sign(i) * std::log(canonical.above_lower(i, v[i]));
  }
  for (const Index i : canonical.upper_bounded()) {
    if ((canonical.served_slack(i) >= 0) != of_copies) continue;
    sum += canonical.sign(i) * std::log(canonical.below_upper(i, v[i]));
  }
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
