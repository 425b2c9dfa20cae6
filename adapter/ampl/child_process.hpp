#pragma once

#include <functional>
#include <string>

namespace ipminmax {

/// AMPL's library ends the process, crashes or hangs on some files: a child process tries first.
///
/// Throws std::runtime_error with what attempt threw or, when the child ended otherwise, how it
/// ended and what it wrote on standard error; std::bad_alloc where it had too little memory.
/// seconds: of the child's processor time; ten times as long where it waits. The child ends with
/// its parent.
void try_in_child(const std::string& file, unsigned seconds, const std::function<void()>& attempt);

}  // namespace ipminmax
