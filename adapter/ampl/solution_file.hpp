#pragma once

#include <optional>
#include <string>
#include <vector>

namespace ipminmax {

/// What a .sol file says, in AMPL's signs.
struct SolutionFile {
  std::string message;
  std::vector<int> options;  ///< those of the .nl file's first line, their number first
  std::optional<double> bound_tolerance;  ///< where the .nl file's first line gives one
  int constraints = 0, variables = 0;     ///< of the model
  std::vector<double> duals, primals;     ///< of all, or empty
  bool has_status = true;                 ///< the modelling system reads all that follows
  int objective = 0;                      ///< from 0
  int solve_result = 0;
  struct Suffix {
    std::string name;
    std::vector<double> values;  ///< of all variables; zeros are not written
  };
  std::vector<Suffix> variable_suffixes;
  int detailed_result = 0;  ///< suffix minmax_result of the problem; not written where 0

  /// Numbers in the shortest form that reads back as the same.
  [[nodiscard]] std::string text() const;
  /// As AMPL's library answers binary .nl files.
  [[nodiscard]] std::string binary() const;
};

}  // namespace ipminmax
