#pragma once

#include <algorithm>
#include <vector>

#include "core/certificate/active_set.hpp"

namespace ipminmax {

/// An active constraint whose gradient is a combination of those of other active constraints and
/// bounds of its owner, in the owner's variables.
struct Dependence {
  Index row = -1;  ///< canonical constraint that the others make redundant, or contradict
  /// Per canonical constraint; 1 for row. The sum of weights times gradients is zero except at
  /// active bounds.
  Vector weights;
  bool vanishing = false;  ///< the gradient is zero, at active bounds too
  /// The same combination of the constraints is zero at all points that were tried, up to rounding
  /// and relaxed bounds: the row is redundant.
  bool identical = false;
};

struct Dependences {
  std::vector<Dependence> found;
  bool complete = true;  ///< false: there may be more
  [[nodiscard]] bool independent(const CanonicalProblem& canonical, Player player) const {
    return complete && std::ranges::none_of(found, [&](const Dependence& d) {
             return canonical.max_constraints().contains(d.row) == (player == Player::Max);
           });
  }
  /// Per constraint: whether it is redundant, so that the model without it is the same.
  [[nodiscard]] std::vector<bool> redundant(const CanonicalProblem& canonical) const {
    std::vector<bool> rows(at(canonical.constraints()), false);
    for (const Dependence& dependence : found) rows[at(dependence.row)] = dependence.identical;
    return rows;
  }
};

}  // namespace ipminmax
