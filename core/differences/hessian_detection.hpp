#pragma once

#include <random>
#include <span>
#include <vector>

#include "core/differences/first_derivatives.hpp"
#include "core/problem.hpp"

namespace ipminmax {

/// Random points of a model's domain around a starting point, strictly between the bounds.
class PointSampler {
 public:
  /// start: n values, clamped to the bounds.
  PointSampler(const ProblemStructure& structure, std::span<const double> start);

  /// Each free variable uniform within radius max(1, |start|) of the start and inside its bounds.
  [[nodiscard]] std::vector<double> sample(double radius);
  /// A sample where the first derivatives are defined, the radius halved until there is one; false
  /// when none was found.
  [[nodiscard]] bool sample_defined(FirstDerivativeSource& source, std::vector<double>& point,
                                    FirstDerivatives& derivatives);

 private:
  const ProblemStructure& structure_;
  std::vector<double> start_;
  std::mt19937_64 random_{20230517};
};

/// Sparsity of the Hessian of sigma f + lambda' g, from first derivatives at random points: each
/// pair once, row >= col, free variables only. Contains, for every constraint that is nonlinear in
/// a few variables, all pairs of them; for the objective and for constraints in many variables, the
/// pairs (i, j) for which the derivative in i changes when j alone moves. Groups of variables are
/// moved together and halved, groups that act on different rows in one evaluation, so that a band
/// takes O(log n) evaluations. Empty when no point could be evaluated.
///
/// variables: where to look, sorted. most_evaluations: what has not been resolved after so many
/// counts as coupled. No test at points can prove an entry to be zero everywhere;
/// whoever relies on the pattern has to check it where it is used.
[[nodiscard]] std::vector<Triplet> detect_hessian_pattern(const ProblemStructure& structure,
                                                          FirstDerivativeSource& source,
                                                          PointSampler& sampler,
                                                          std::span<const Index> variables,
                                                          Index most_evaluations);

}  // namespace ipminmax
