#pragma once

#include <Eigen/Core>

#include <support/dense_judge.hpp>

#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

/// What dense linear algebra says of a returned point, with the returned multipliers.
inline DenseOptimality judge(Problem& problem, const Result& result,
                             const DenseTolerances& tolerances = {.curvature = 1e-5}) {
  const auto vector = [](const std::vector<double>& values) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXd>(values.data(),
                                             static_cast<Eigen::Index>(values.size()));
  };
  const Multipliers multipliers{vector(result.lambda), vector(result.z_lower),
                                vector(result.z_upper)};
  return dense_optimality(problem, result.v, &multipliers, tolerances);
}

/// Whether the result claims no more than dense linear algebra confirms or at least leaves open.
inline bool is_sound(const Result& result, const DenseOptimality& found) {
  const bool claims = is_success(result.status) ||
                      result.certificate.kind == PointKind::LocalMinmax ||
                      result.certificate.second_order == SecondOrder::Satisfied;
  const bool consistent =
      (result.status == Status::Solved) <= (result.certificate.kind == PointKind::LocalMinmax);
  return consistent &&
         (!claims || found.verdict == Verdict::LocalMinmax || found.verdict == Verdict::Undecided);
}

}  // namespace ipminmax::testing
