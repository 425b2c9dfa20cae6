#pragma once

#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// An active constraint whose gradient is a combination of those of other active constraints and
/// bounds of its owner, in the owner's variables.
struct Dependence {
  Index row = -1;  ///< canonical constraint that the others make redundant or contradict
  /// Per canonical constraint, one for row: the sum of weights times gradients has entries at
  /// active bounds alone.
  Eigen::VectorXd weights;
  bool vanishing = false;  ///< the gradient is zero, at active bounds too
  /// The same combination of the constraints themselves is zero not at the point alone but wherever
  /// it was tried, up to rounding and what bounds were relaxed by: the row says nothing beside the
  /// others.
  bool identical = false;
};

struct Dependences {
  std::vector<Dependence> found;
  bool complete = true;   ///< false: there are more, or they could not be told from others
  bool too_many = false;  ///< not complete, for there are more than are worth finding
  [[nodiscard]] bool independent(const CanonicalProblem& canonical, Player player) const;
  /// Per constraint: those that say nothing beside others, so that the model without them is the
  /// same model.
  [[nodiscard]] std::vector<bool> redundant(const CanonicalProblem& canonical) const;
};

/// Looks for all of them among the constraints that the system counts, weakly active bounds as in
/// its last assemble: inverse iteration with [I J'; J -delta I], one factorization. Constraints are
/// evaluated at a few points nearby. The matrices are left at other values.
[[nodiscard]] Dependences find_dependences(CanonicalProblem& canonical, ActiveSetSystem& system,
                                           const Point& point, const SolverOptions& options);

}  // namespace ipminmax
