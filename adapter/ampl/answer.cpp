#include "answer.hpp"

#include "core/version.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <functional>
#include <iomanip>
#include <map>
#include <ostream>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "adapter/log.hpp"
#include "core/model/status_table.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

/// Statuses that core names from the side of the minimizer of -f, in the words of a model that
/// maximizes f.
std::string status_text(Status status, bool maximizes, bool game) {
  if (maximizes) {
    if (status == Status::OuterUnbounded) return "maximization looks unbounded";
    if (status == Status::InnerUnbounded) return "minimization looks unbounded";
    if (status == Status::InnerInfeasible) return "minimizer's constraints cannot be met";
    if (status == Status::NotLocalMinmax)
      return game ? "first-order point, not a local maxmin" : "first-order point, not a maximum";
    if (status == Status::NoLocalMinmaxFound)
      return game ? "no local maxmin found" : "no local maximum found";
  } else if (!game) {
    if (status == Status::NotLocalMinmax) return "first-order point, not a minimum";
    if (status == Status::NoLocalMinmaxFound) return "no local minimum found";
  }
  return std::string(name_of(status));
}

std::string name_of_optimum(bool maximizes, const NlProblem& problem) {
  if (!problem.has_player(Player::Max)) return maximizes ? "maximum" : "minimum";
  if (!problem.has_player(Player::Min)) return maximizes ? "minimum" : "maximum";
  return maximizes ? "maxmin" : "minmax";
}

/// A message of core about minimizing -f, of which f is to be spoken: its players change roles.
/// Names of the model, which follow "variable 3 " and the like in parentheses, stay.
std::string mirrored(const std::string& message) {
  static const std::map<std::string_view, std::string_view> kMirrored = [] {
    std::map<std::string_view, std::string_view> both = {{"minimization", "maximization"},
                                                         {"minimizer", "maximizer"},
                                                         {"minimizer's", "maximizer's"},
                                                         {"minimize", "maximize"},
                                                         {"minimizes", "maximizes"},
                                                         {"minimizing", "maximizing"},
                                                         {"minimum", "maximum"},
                                                         {"minima", "maxima"},
                                                         {"minmax", "maxmin"},
                                                         {"Min", "Max"}};
    for (const auto& [ours, theirs] : std::map(both)) both.emplace(theirs, ours);
    return both;
  }();
  static constexpr std::string_view kAsItIs = "violation of the constraints is at a local minimum";
  const auto is_letter = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '\'' || c == '[';
  };
  std::string text;
  for (std::size_t at = 0; at < message.size();) {
    if (message.compare(at, kAsItIs.size(), kAsItIs) == 0) {
      text += kAsItIs;
      at += kAsItIs.size();
      continue;
    }
    std::size_t end = at;
    while (end < message.size() && is_letter(message[end])) ++end;
    const std::string_view word = std::string_view(message).substr(at, end - at);
    const auto found = kMirrored.find(word);
    const bool is_name =
        at > 0 && message[at - 1] == '(' && end < message.size() && message[end] == ')';
    text += found != kMirrored.end() && !is_name ? found->second : word;
    if (end < message.size()) text += message[end];
    at = end + 1;
  }
  return text;
}

/// Lines that say where the robust constraints that x rests on are worst. Of others y is any.
void print_worst_cases(std::ostream& out, const std::vector<RobustWorstCase>& worst_cases,
                       const NlProblem& problem) {
  constexpr std::size_t kMost = 20;
  std::size_t active = 0;
  for (const RobustWorstCase& found : worst_cases) {
    if (!found.active || ++active > kMost) continue;
    const bool is_f = found.constraint >= problem.constraints();
    std::vector<std::pair<std::string, double>> values;
    for (const int i : problem.max_variables_of(found.constraint))
      values.emplace_back(problem.variable_name(i), found.v[static_cast<std::size_t>(i)]);
    out << "\nworst case of "
        << (is_f ? "the objective" : problem.constraint_name(found.constraint)) << ": "
        << std::setprecision(10) << (is_f && problem.maximizes() ? -found.value : found.value)
        << " at " << log::place_text(values);
  }
  if (active > kMost) out << "\n... and " << active - kMost << " more";
}

/// Width of a column with this heading.
std::size_t width_of(const char* heading, int rows, const std::function<std::string(int)>& text) {
  std::size_t width = std::string(heading).size();
  for (int i = 0; i < rows; ++i) width = std::max(width, text(i).size());
  return width;
}

}  // namespace

int solve_result(const Result& result) {
  // First-order conditions that hold: a bounded value, approached at infinity.
  constexpr int kAtInfinity = 101;
  const bool at_infinity = result.status == Status::DivergingIterates &&
                           result.certificate.kind == PointKind::FirstOrderPoint;
  return at_infinity ? kAtInfinity : row_of(result.status).solve_result;
}

std::string message_of(const Result& result, const std::vector<RobustWorstCase>& worst_cases,
                       const NlProblem& problem) {
  std::ostringstream message;
  const bool game = problem.has_player(Player::Max) && problem.has_player(Player::Min);
  message << "Ipminmax " IPMINMAX_VERSION ": ";
  const std::string status = status_text(result.status, problem.maximizes(), game);
  const bool has_details = !result.message.empty() && result.message != name_of(result.status);
  if (result.certificate.kind == PointKind::LocalMinmax) {
    message << "certified local " << name_of_optimum(problem.maximizes(), problem);
    if (result.status != Status::Solved) message << ", " << status;
  } else {
    message << status;
  }
  if (has_details)
    message << " (" << (problem.maximizes() ? mirrored(result.message) : result.message) << ")";
  if (!result.v.empty() || problem.players().empty()) {
    message << std::setprecision(10) << "\nobjective "
            << (problem.maximizes() ? -result.objective : result.objective) << ", "
            << result.iterations << " iterations; second-order test of "
            << (game ? "both players " : "the solution ")
            << name_of(result.certificate.second_order);
  }
  constexpr std::size_t kMostReasons = 5;
  const auto& reasons = result.certificate.reasons;
  for (std::size_t k = 0; k < std::min(kMostReasons, reasons.size()); ++k) {
    message << "\nreason: " << reasons[k].text;
  }
  print_worst_cases(message, worst_cases, problem);
  if (const std::string worst = describe_worst_case(result); !worst.empty()) {
    message << "\nworst case over "
            << (problem.maximizes() ? "y of the negative objective: " : "y: ") << worst;
  }
  const std::string warning = split_warning(problem);
  if (!warning.empty()) {
    message << "\nWARNING: " << warning;
  } else if (!problem.has_player(Player::Max)) {
    message << "\nA plain " << (problem.maximizes() ? "maximization" : "minimization")
            << ": no variable has suffix player = 1, and minmax_max_variables names none.";
  }
  return message.str();
}

std::string split_warning(const NlProblem& problem) {
  const bool has_min = problem.has_player(Player::Min), has_max = problem.has_player(Player::Max);
  if ((has_min && has_max) || problem.players().empty()) return {};
  const char* const cause =
      " Was a variable eliminated before the model was written (Pyomo: linear_presolve=False)?";
  const auto plain = [&](bool maximization) {
    return std::string("this is a plain ") + (maximization ? "maximization." : "minimization.");
  };
  if (!has_min)
    return "all variables have player 1, none is left for player 0: " +
           plain(!problem.maximizes()) + cause;
  if (const std::string name = problem.misspelt_suffix(); !name.empty())
    return "the variables have a suffix " + name +
           ", but none player: " + plain(problem.maximizes()) + " Did you mean player?";
  if (problem.has_player_suffix())
    return "there is a suffix player, but no variable has player 1: " + plain(problem.maximizes()) +
           cause;
  return {};
}

void print_variables(std::ostream& out, const Result& result, const NlProblem& problem) {
  const auto name = [&](int i) { return problem.variable_name(i); };
  const int rows = static_cast<int>(result.v.size());
  const int width = static_cast<int>(width_of("variable", rows, name));
  out << std::left << std::setw(width) << "variable"
      << "  player  value\n";
  for (int i = 0; i < rows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    // Player 0 of a model that maximizes is the maximizer.
    const bool maximizer = (problem.players()[at] == Player::Max) != problem.maximizes();
    out << std::setw(width) << name(i) << (maximizer ? "  Max     " : "  Min     ")
        << std::setprecision(10) << result.v[at] << '\n';
  }
}

void print_duals(std::ostream& out, const Result& result, const NlProblem& problem) {
  const auto name = [&](int i) { return problem.constraint_name(i); };
  const std::vector<double> duals = problem.solution_file(result).duals;
  const int rows = static_cast<int>(duals.size());
  const int width = static_cast<int>(width_of("constraint", rows, name));
  out << std::left << std::setw(width) << "constraint"
      << "  dual\n";
  for (int i = 0; i < rows; ++i)
    out << std::setw(width) << name(i) << "  " << std::setprecision(10)
        << duals[static_cast<std::size_t>(i)] << '\n';
}

}  // namespace ipminmax
