#pragma once

#include <optional>
#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/certificate/dependence.hpp"
#include "core/model/iterate.hpp"
#include "core/options.hpp"

namespace ipminmax {

/// A point with other multipliers that balance the same gradient, and without the inequalities
/// whose multiplier is zero then.
struct BasicMultipliers {
  Iterate iterate;
  BoundClasses classes;
  /// Of Max beside an x: the answers in which the rows of the null vectors are constant, another
  /// set of active bounds. Holds his variables in these rows and leaves the rows out.
  std::optional<BoundClasses> narrow{};
};

/// Where gradients of active constraints and bounds depend on each other the multipliers are a
/// polyhedron. At its vertices the gradients of those that are not zero are independent
/// [Caratheodory]. A few of these, each from the multipliers given along every null vector in turn
/// to where the first inequality's is zero: this one becomes BoundClass::Dropped. Of one player,
/// max or not; of Max beside an x only where no row in the null vectors reads that.
///
/// system: assembled as it was for the dependences. Empty where only equations depend on each
/// other.
[[nodiscard]] std::vector<BasicMultipliers> basic_multipliers(const ActiveSetSystem& system,
                                                              const Point& point,
                                                              const Dependences& dependences,
                                                              const SolverOptions& options,
                                                              bool max);

}  // namespace ipminmax
