#include "core/model/structure_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string_view>

#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

std::string named(std::string_view kind, const std::vector<std::string>& names,
                  const std::vector<Index>& numbers, Index i) {
  const std::string name = at(i) < names.size() ? names[at(i)] : std::string();
  const Index number = at(i) < numbers.size() ? numbers[at(i)] : i;
  std::ostringstream text;
  text << kind << ' ';
  if (number < 0) {
    text << name;
  } else {
    text << number;
    if (!name.empty()) text << " (" << name << ')';
  }
  return text.str();
}

/// What is wrong with a Jacobian entry of Min's constraint in Max's variable, if anything.
std::string check_robust(const ProblemStructure& s, const SolverOptions& options, Triplet entry) {
  if (s.constraint_players[at(entry.row)] != Player::Min ||
      s.variable_players[at(entry.col)] != Player::Max) {
    return {};
  }
  const bool equality = s.constraint_lower[at(entry.row)] == s.constraint_upper[at(entry.row)];
  if (options.minmax_robust_constraints && !equality) return {};
  std::string text = constraint_name(s, entry.row) +
                     " belongs to the Min player but depends on the Max player's " +
                     variable_name(s, entry.col);
  if (equality) text += ", and an equality cannot hold for every value of it";
  return text;
}

/// constraints: the rows are constraints, else variables.
std::string check_range(std::string_view matrix, const std::vector<Triplet>& entries, Index rows,
                        bool constraints, Index cols) {
  for (const auto k : indices(entries)) {
    const auto [row, col] = entries[k];
    if (row >= 0 && row < rows && col >= 0 && col < cols) continue;
    std::ostringstream text;
    text << "entry " << k << " of the " << matrix << "'s structure is at row " << row << ", column "
         << col << ", outside ";
    if (constraints) text << rows << " constraints and ";
    text << cols << " variables (0-based)";
    return text.str();
  }
  return {};
}

}  // namespace

std::string variable_name(const ProblemStructure& structure, Index i) {
  return named("variable", structure.variable_names, structure.variable_numbers, i);
}

std::string constraint_name(const ProblemStructure& structure, Index i) {
  return named("constraint", structure.constraint_names, structure.constraint_numbers, i);
}

std::string number_text(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

bool has_max_variables(const ProblemStructure& structure) {
  return std::ranges::find(structure.variable_players, Player::Max) !=
         structure.variable_players.end();
}

std::string check_indices(const ProblemStructure& s) {
  const auto n = static_cast<Index>(s.variable_players.size());
  const auto m = static_cast<Index>(s.constraint_players.size());
  if (s.variable_lower.size() != at(n) || s.variable_upper.size() != at(n)) {
    return "the bounds of the variables do not have one entry per variable";
  }
  if (m == 0 && !s.constraint_lower.empty()) {
    return "constraint_players is empty for " + std::to_string(s.constraint_lower.size()) +
           " constraints: fill it, as constraint_players = implied_constraint_players(structure) "
           "does once the Jacobian's structure is there";
  }
  if (s.constraint_lower.size() != at(m) || s.constraint_upper.size() != at(m)) {
    return "the bounds of the constraints do not have one entry per constraint";
  }
  auto error = check_range("Jacobian", s.jacobian, m, true, n);
  return error.empty() ? check_range("Hessian", s.hessian, n, false, n) : error;
}

std::string check_structure(const ProblemStructure& s, const SolverOptions& options) {
  if (auto error = check_indices(s); !error.empty()) return error;
  // What is wrong with a variable or constraint, if anything.
  const auto fault = [&](Player player, double lower, double upper) -> std::string {
    if (player != Player::Min && player != Player::Max) return " is owned by no player";
    if (std::isnan(lower) || std::isnan(upper)) return " has a bound that is NaN";
    if (lower > upper) {
      return " has inconsistent bounds: lower " + number_text(lower) + " above upper " +
             number_text(upper);
    }
    if (lower >= options.nlp_upper_bound_inf || upper <= options.nlp_lower_bound_inf) {
      return lower > 0.0 ? " has the lower bound " + number_text(lower) + ", which means +infinity"
                         : " has the upper bound " + number_text(upper) + ", which means -infinity";
    }
    return {};
  };
  for (const auto i : indices(s.variable_players)) {
    const auto error = fault(s.variable_players[i], s.variable_lower[i], s.variable_upper[i]);
    if (!error.empty()) return variable_name(s, static_cast<Index>(i)) + error;
  }
  for (const auto j : indices(s.constraint_players)) {
    const auto error = fault(s.constraint_players[j], s.constraint_lower[j], s.constraint_upper[j]);
    if (!error.empty()) return constraint_name(s, static_cast<Index>(j)) + error;
  }
  for (const Triplet entry : s.jacobian) {
    if (auto error = check_robust(s, options, entry); !error.empty()) return error;
  }
  return {};
}

namespace {

/// Player and kind of bounds.
std::uint8_t kind_of(Player player, double lower, double upper, const SolverOptions& options) {
  enum : unsigned { kMax = 1, kLower = 2, kUpper = 4, kEqual = 8 };
  unsigned kind = 0;
  if (player == Player::Max) kind |= kMax;
  if (lower > options.nlp_lower_bound_inf) kind |= kLower;
  if (upper < options.nlp_upper_bound_inf) kind |= kUpper;
  if (lower == upper) kind |= kEqual;
  return static_cast<std::uint8_t>(kind);
}

std::vector<std::uint8_t> kinds(const std::vector<Player>& players,
                                const std::vector<double>& lower, const std::vector<double>& upper,
                                const SolverOptions& options) {
  std::vector<std::uint8_t> result(players.size());
  for (const auto i : indices(players)) {
    result[i] = kind_of(players[i], lower[i], upper[i], options);
  }
  return result;
}

bool are_kinds(const std::vector<std::uint8_t>& kinds, const std::vector<Player>& players,
               const std::vector<double>& lower, const std::vector<double>& upper,
               const SolverOptions& options) {
  if (kinds.size() != players.size()) return false;
  for (const auto i : indices(players)) {
    if (kinds[i] != kind_of(players[i], lower[i], upper[i], options)) return false;
  }
  return true;
}

}  // namespace

bool has_shape(const ProblemStructure& s, const SolverOptions& options, const ModelShape& shape) {
  return are_kinds(shape.variables, s.variable_players, s.variable_lower, s.variable_upper,
                   options) &&
         are_kinds(shape.constraints, s.constraint_players, s.constraint_lower, s.constraint_upper,
                   options) &&
         shape.jacobian == s.jacobian && shape.hessian == s.hessian &&
         shape.fixed_variable_treatment == options.fixed_variable_treatment;
}

ModelShape shape_of(const ProblemStructure& s, const SolverOptions& options) {
  return {
      .variables = kinds(s.variable_players, s.variable_lower, s.variable_upper, options),
      .constraints = kinds(s.constraint_players, s.constraint_lower, s.constraint_upper, options),
      .jacobian = s.jacobian,
      .hessian = s.hessian,
      .fixed_variable_treatment = options.fixed_variable_treatment};
}

}  // namespace ipminmax
