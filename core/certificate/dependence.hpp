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
  Vector weights;
  bool vanishing = false;  ///< the gradient is zero, at active bounds too
  /// The same combination of the constraints themselves is zero not at the point alone but wherever
  /// it was tried, up to rounding and what bounds were relaxed by: the row says nothing beside the
  /// others.
  bool identical = false;
};

struct Dependences {
  std::vector<Dependence> found;
  bool complete = true;  ///< false: there are more, or they could not be told from others
  [[nodiscard]] bool independent(const CanonicalProblem& canonical, Player player) const;
  /// Per constraint: those that say nothing beside others, so that the model without them is the
  /// same model.
  [[nodiscard]] std::vector<bool> redundant(const CanonicalProblem& canonical) const;
};

}  // namespace ipminmax
