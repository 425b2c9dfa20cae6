#pragma once

#include <cstddef>
#include <limits>

#include "linalg/inertia.hpp"

namespace ipminmax {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();  // 2^-52

/// Position in an array of what an index numbers.
[[nodiscard]] constexpr std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace ipminmax
