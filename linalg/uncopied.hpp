#pragma once

namespace ipminmax {

/// Base of what is neither copied nor moved.
struct Uncopied {
  Uncopied() = default;
  Uncopied(const Uncopied&) = delete;
  Uncopied& operator=(const Uncopied&) = delete;
};

}  // namespace ipminmax
