#pragma once

#include "inertia.hpp"

namespace IPMINMAX_API ipminmax {

/// Place of one matrix entry, 0-based.
struct Triplet {
  Index row = 0;
  Index col = 0;
  friend bool operator==(const Triplet&, const Triplet&) = default;
};

}  // namespace ipminmax
