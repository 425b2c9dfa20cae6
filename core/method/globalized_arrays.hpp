#pragma once

#include "core/method/filter.hpp"
#include "core/method/outer_block.hpp"

namespace ipminmax {

/// What a GlobalizedMethod works with, kept from one to the next.
struct GlobalizedArrays {
  OuterArrays outer_arrays_;
  Filter filter_;
};

}  // namespace ipminmax
