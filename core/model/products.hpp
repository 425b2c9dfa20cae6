#pragma once

#include "core/model/canonical_problem.hpp"

namespace ipminmax {

/// product += W d, slacks apart: they have no entries.
void add_hessian_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         const Eigen::VectorXd& d, Eigen::VectorXd& product);
/// d'Wd
[[nodiscard]] double curvature_along(const CanonicalProblem& canonical,
                                     const Evaluation& evaluation, const Eigen::VectorXd& d);
/// product += J' lambda, slacks apart.
void add_transposed_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& lambda, Eigen::VectorXd& product);
/// product += J d, - d of a constraint's slack included.
void add_constraint_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& d, Eigen::VectorXd& product);

/// sums += |change_k| d_i d_j of the entries k of W in each row; change: per entry.
void add_row_sums(const CanonicalProblem& canonical, const std::vector<double>& change,
                  const Eigen::VectorXd& d, Eigen::VectorXd& sums);

}  // namespace ipminmax
