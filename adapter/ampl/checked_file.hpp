#pragma once

#include <string>

namespace ipminmax {

/// Writes the file as a whole or not at all: into a temporary file beside it, which then takes its
/// name. Devices and pipes are written to directly. Every write and close is checked: throws
/// std::runtime_error, "cannot write FILE: no space left on device".
void write_file(const std::string& file, const std::string& content);

/// Removes a regular file, so that what a failed run leaves is not taken for its answer. Throws
/// std::runtime_error when it is there and cannot be removed.
void remove_stale_file(const std::string& file);

}  // namespace ipminmax
