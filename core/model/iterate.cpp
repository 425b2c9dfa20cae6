#include "core/model/iterate.hpp"

#include <cmath>

#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"

namespace ipminmax {

void add_hessian_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         const Eigen::VectorXd& d, Eigen::VectorXd& product) {
  for (const auto k : indices(evaluation.hessian)) {
    const auto [i, j] = canonical.hessian()[k];
    product[i] += evaluation.hessian[k] * d[j];
    if (i != j) product[j] += evaluation.hessian[k] * d[i];
  }
}

double curvature_along(const CanonicalProblem& canonical, const Evaluation& evaluation,
                       const Eigen::VectorXd& d) {
  double sum = 0.0;
  for (const auto k : indices(evaluation.hessian)) {
    const auto [i, j] = canonical.hessian()[k];
    sum += (i == j ? 1.0 : 2.0) * evaluation.hessian[k] * d[i] * d[j];
  }
  return sum;
}

void add_transposed_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& lambda, Eigen::VectorXd& product) {
  for (const auto k : indices(evaluation.jacobian)) {
    const auto [row, col] = canonical.jacobian()[k];
    product[col] += evaluation.jacobian[k] * lambda[row];
  }
}

void add_constraint_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& d, Eigen::VectorXd& product) {
  for (const auto k : indices(evaluation.jacobian)) {
    const auto [row, col] = canonical.jacobian()[k];
    product[row] += evaluation.jacobian[k] * d[col];
  }
  for (Index j = 0; j < product.size(); ++j) {
    if (const Index s = canonical.slack_of(j); s >= 0) product[j] -= d[s];
  }
}

void add_row_sums(const CanonicalProblem& canonical, const std::vector<double>& change,
                  const Eigen::VectorXd& d, Eigen::VectorXd& sums) {
  for (const auto k : indices(change)) {
    const auto [i, j] = canonical.hessian()[k];
    const double entry = d[i] * d[j] * std::abs(change[k]);
    sums[i] += entry;
    if (i != j) sums[j] += entry;
  }
}

}  // namespace ipminmax
