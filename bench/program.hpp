#pragma once

#include <cstdio>
#include <exception>
#include <functional>
#include <string>

#include <examples/command_line.hpp>

#include "measure.hpp"

namespace bench {

/// The options that all programs share.
inline void add_settings(CommandLine& command_line, Settings& settings) {
  command_line.add("--seconds", settings.seconds, "time to spend, about");
  command_line.add("--csv", "FOLDER", "writes every table as CSV too",
                   [&settings](const std::string& folder) { settings.csv = folder; });
}

/// main: parses the command line, prints the environment, runs; 2 on an error.
inline int run_program(int argc, char** argv, CommandLine& command_line, Settings& settings,
                       const std::function<void()>& program) {
  try {
    add_settings(command_line, settings);
    if (!command_line.parse(argc, argv)) return 0;
    program();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}

}  // namespace bench
