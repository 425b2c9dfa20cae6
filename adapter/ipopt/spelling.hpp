#pragma once

#include <cstddef>
#include <string>

namespace ipminmax {

/// Capital letters of ASCII are made small.
[[nodiscard]] std::string lower_case(std::string text);

/// Insertions, deletions, changes and swaps of neighbours that make one text the other.
[[nodiscard]] std::size_t edit_distance(const std::string& a, const std::string& b);

}  // namespace ipminmax
