#pragma once

#include <iosfwd>
#include <string>

#include "core/result.hpp"
#include "nl_problem.hpp"

namespace ipminmax {

/// AMPL's solve_result_num: that of Ipopt's executable where it ends so.
[[nodiscard]] int solve_result(const Result& result);

/// The same in more detail, the suffix minmax_result of the problem.
[[nodiscard]] int detailed_result(const Result& result);

/// What the point is, in the words of the model's sense, and how the solve ended.
[[nodiscard]] std::string message_of(const Result& result, NlProblem& problem);

/// A message in the lines of Ipopt's .sol files, an empty one and another, because some programs
/// count them.
[[nodiscard]] std::string one_line(const std::string& message);

/// That the model's integer variables are continuous here. Empty where it has none.
[[nodiscard]] std::string integer_warning(const NlProblem& problem);

/// What is odd about the split: a player without variables where the model or the options speak of
/// players. Empty when nothing is.
[[nodiscard]] std::string split_warning(const NlProblem& problem);

/// A table of the variables with their players.
void print_variables(std::ostream& out, const Result& result, const NlProblem& problem);

/// A table of the constraints with their duals, in AMPL's signs.
void print_duals(std::ostream& out, const Result& result, const NlProblem& problem);

}  // namespace ipminmax
