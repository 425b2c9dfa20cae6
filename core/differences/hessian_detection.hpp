#pragma once

#include <algorithm>
#include <random>
#include <span>
#include <vector>

#include "core/problem.hpp"
#include "linalg/array.hpp"
#include "linalg/symmetric_matrix.hpp"

namespace ipminmax {

/// First derivatives of a model at one point.
struct FirstDerivatives {
  std::vector<double> gradient;  ///< n
  std::vector<double> jacobian;  ///< in the order of the structure's triplets
};

/// Evaluates gradient and Jacobian together, in the model's own units, and counts the calls.
class FirstDerivativeSource {
 public:
  explicit FirstDerivativeSource(Problem& model) : model_(model) {}

  /// False where one of them is undefined or not finite. What is not wanted stays as it is.
  [[nodiscard]] bool evaluate(std::span<const double> v, FirstDerivatives& derivatives,
                              bool want_gradient = true, bool want_jacobian = true);

  [[nodiscard]] Index gradients() const { return gradients_; }
  [[nodiscard]] Index jacobians() const { return jacobians_; }

 private:
  Problem& model_;
  Index gradients_ = 0;
  Index jacobians_ = 0;
};

/// Groups of variables that are perturbed together, and where each entry of a symmetric matrix is
/// then read: H(row, col) from the row of the difference along the group that contains col.
struct HessianColoring {
  struct Entry {
    Index row = 0;
    Index col = 0;       ///< member of a group
    Index position = 0;  ///< in the pattern
  };
  struct Group {
    std::vector<Index> variables;
    std::vector<Entry> entries;  ///< read from this group's difference
  };
  std::vector<Group> groups;
};

/// Star colouring of the pattern's graph, restricted so that every entry is read directly: two
/// neighbours of a variable share a colour only if that colour is above the variable's own (Powell,
/// Toint, On the estimation of sparse Hessian matrices, SIAM J. Numer. Anal. 1979). A band of half
/// width b takes at most 2b + 1 groups, an arrow 2.
/// pattern: each pair once, in either order; 0 <= indices < variables.
[[nodiscard]] HessianColoring color_hessian(std::span<const Triplet> pattern, Index variables);

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
