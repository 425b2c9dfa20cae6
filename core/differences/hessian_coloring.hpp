#pragma once

#include <span>
#include <vector>

#include "linalg/symmetric_matrix.hpp"

namespace ipminmax {

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

}  // namespace ipminmax
