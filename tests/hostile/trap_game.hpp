#pragma once

#include <cstdint>

#include <problems/random_game.hpp>

namespace ipminmax::testing {

/// A game made to be certified wrongly: curvatures from 1e-9 to 1e4, some of the wrong sign, that
/// inactive constraints, higher powers, coupling or units hide, from a start on the stationary
/// point or near it.
[[nodiscard]] RandomGame trap_game(std::uint64_t seed);

}  // namespace ipminmax::testing
