#pragma once

#include <string>

/// What is fuzzed: each takes any bytes and must come back. Under sanitizers, what they find in the
/// child process that reads a file first ends this process, too.
namespace ipminmax::testing {

/// An .nl file: checked, read, solved for a few iterations, and its .sol made.
void fuzz_nl(const std::string& bytes);

/// An options file, which is also read as environment, command-line arguments and lists of players.
void fuzz_options(const std::string& bytes);

/// A C problem, what its callbacks answer, and calls between its solves.
void fuzz_c(const std::string& bytes);

}  // namespace ipminmax::testing
