#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/model/canonical_problem.hpp"

namespace ipminmax {

/// A derivative along a direction beside a difference of what it is the derivative of.
struct Deviation {
  Index index = -1;  ///< canonical constraint (-1: the objective) or, of W, canonical variable
  double exact = 0.0;
  double difference = 0.0;
};

/// What compare_second_derivatives works with.
struct DifferenceArrays {
  Step &first, &second;
  Evaluation& end;
};

/// The row of W step that differs most from the change of the gradient of the Lagrangian, slacks
/// apart, by more than tolerance times the longest entry of the step and than the differences'
/// own error explains; both in lengths, one per canonical variable. W and J are those of the
/// evaluation at v, lambda. One gradient and Jacobian where they agree, two to six else. Empty:
/// no difference, or the model is undefined at v + step and v - step.
[[nodiscard]] std::optional<Deviation> compare_second_derivatives(
    CanonicalProblem& canonical, const Eigen::VectorXd& v, const Eigen::VectorXd& lambda,
    const Evaluation& evaluation, const Eigen::VectorXd& step, const Eigen::VectorXd& lengths,
    double tolerance, const DifferenceArrays& arrays);

/// The objective or constraint whose slope along the step differs most, relative to the size of its
/// terms, from the change of its value. Four values of the functions. Empty: no difference beyond
/// the differences' own error, or the model is undefined nearby.
[[nodiscard]] std::optional<Deviation> compare_first_derivatives(CanonicalProblem& canonical,
                                                                 const Eigen::VectorXd& v,
                                                                 const Evaluation& evaluation,
                                                                 const Eigen::VectorXd& step);

/// A step from v in generic directions, shorter than a tenth of the distances to bounds; slacks
/// stay. relative: longest entry over the size of its variable.
[[nodiscard]] Eigen::VectorXd generic_step(const CanonicalProblem& canonical,
                                           const Eigen::VectorXd& v, double relative);

/// v moved by up to that part of its entries' sizes, slacks apart, to where all have room to
/// bounds: along each the way with more of it.
[[nodiscard]] Eigen::VectorXd aside(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                    double relative);

/// Cuts entries of the step to a share of the distances to bounds.
void keep_within_bounds(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double share,
                        Eigen::VectorXd& step);

}  // namespace ipminmax
