#include "answer.hpp"

#include "core/version.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <iomanip>
#include <map>
#include <ostream>
#include <sstream>
#include <string_view>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/log.hpp"
#include "adapter/ipopt/status.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/answer.hpp"
#include "core/model/status_table.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// How Ipopt's executable ends where this one ends so: solve_result_num, and the words that
/// programs look for in the message.
struct IpoptEnd {
  int number;
  const char* words;
};

IpoptEnd ipopt_end(Status status) {
  using enum Ipopt::ApplicationReturnStatus;
  // Ipopt 3.11 has no code of its own for it.
  if (status == Status::MaxWallTime) return {402, "Maximum Wallclock Time Exceeded"};
  switch (application_status(status)) {
    case Solve_Succeeded:
      return {0, "Optimal Solution Found"};
    case Solved_To_Acceptable_Level:
      return {1, "Solved To Acceptable Level"};
    case Infeasible_Problem_Detected:
      return {200, "Converged to a locally infeasible point. Problem may be infeasible"};
    case Diverging_Iterates:
      return {300, "Iterates diverging; problem might be unbounded"};
    case Maximum_Iterations_Exceeded:
      return {400, "Maximum Number of Iterations Exceeded"};
    case Maximum_CpuTime_Exceeded:
      return {401, "Maximum CPU Time Exceeded"};
    case User_Requested_Stop:
      return {403, "User requested stop"};
    case Search_Direction_Becomes_Too_Small:
      return {500, "Search Direction becomes Too Small"};
    case Restoration_Failed:
      return {501, "Restoration Phase Failed"};
    case Error_In_Step_Computation:
      return {502, "Error in step computation"};
    case Invalid_Number_Detected:
      return {550, "Invalid number in NLP function or derivative detected"};
    case Not_Enough_Degrees_Of_Freedom:
      return {551, "NLP has too few degrees of freedom"};
    case Invalid_Problem_Definition:
      return {554, "Invalid problem definition"};
    case Invalid_Option:
      return {552, "Invalid option setting"};
    case Insufficient_Memory:
      return {553, "Out of memory"};
    default:
      return {554, "Internal error"};
  }
}

/// Statuses that core names from the side of the minimizer of -f, in the words of a model that
/// maximizes f.
std::string status_text(Status status, bool maximizes, bool game) {
  using enum Status;
  if (maximizes) {
    if (status == OuterUnbounded) return "maximization looks unbounded";
    if (status == InnerUnbounded) return "minimization looks unbounded";
    if (status == InnerInfeasible) return "minimizer's constraints cannot be met";
    if (status == NotLocalMinmax)
      return game ? "first-order point, not a local maxmin" : "first-order point, not a maximum";
    if (status == NoLocalMinmaxFound)
      return game ? "no local maxmin found" : "no local maximum found";
  } else if (!game) {
    if (status == NotLocalMinmax) return "first-order point, not a minimum";
    if (status == NoLocalMinmaxFound) return "no local minimum found";
  }
  return std::string(name_of(status));
}

std::string name_of_optimum(bool maximizes, const NlProblem& problem) {
  if (!problem.has_player(Player::Max)) return maximizes ? "maximum" : "minimum";
  if (!problem.has_player(Player::Min)) return maximizes ? "minimum" : "maximum";
  return maximizes ? "maxmin" : "minmax";
}

/// The end of the model's name, or of a copy's, that begins at a place in a message of core, which
/// writes "variable 3 (name)", "constraint 3 (name)" and "variable 3 (name in worst case 2)"; that
/// place where there is none.
std::size_t end_of_name(const std::string& message, std::size_t begin, const NlProblem& problem) {
  constexpr std::size_t kShortest = 4, kMostDigits = 9;  // "0 (", and of an int
  if (begin < kShortest || message.compare(begin - 2, 2, " (") != 0) return begin;
  const std::size_t space = begin - 2, before = message.find_last_not_of("0123456789", space - 1);
  if (before == std::string::npos || before + 1 == space || space - before > kMostDigits)
    return begin;
  const std::string_view kind = std::string_view(message).substr(0, before + 1);
  const bool is_variable = kind.ends_with("variable ");
  if (!is_variable && !kind.ends_with("constraint ")) return begin;
  const int i = std::stoi(message.substr(before + 1, space - before - 1));
  if (i >= (is_variable ? static_cast<int>(problem.players().size()) : problem.constraints()))
    return begin;
  const std::string name = is_variable ? problem.variable_name(i) : problem.constraint_name(i);
  if (message.compare(begin, name.size(), name) != 0) return begin;
  return std::min(message.find(')', begin + name.size()), message.size());
}

/// A message of core about minimizing -f, of which f is to be spoken: its players change roles.
/// Names of the model stay.
std::string mirrored(const std::string& message, const NlProblem& problem) {
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
                                                         {"Min", "Max"},
                                                         {"Min's", "Max's"}};
    for (const auto& [ours, theirs] : std::map(both)) both.emplace(theirs, ours);
    return both;
  }();
  static constexpr std::array<std::string_view, 4> kAsTheyAre = {
      "violation of the constraints is at a local minimum", "maximum number of", "maximum CPU time",
      "maximum wall time"};
  const auto is_letter = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '\'' || c == '[';
  };
  std::string text;
  for (std::size_t at = 0; at < message.size();) {
    const auto* const kept = std::ranges::find_if(kAsTheyAre, [&](std::string_view text_as_it_is) {
      return message.compare(at, text_as_it_is.size(), text_as_it_is) == 0;
    });
    std::size_t end =
        kept != kAsTheyAre.end() ? at + kept->size() : end_of_name(message, at, problem);
    if (end > at) {
      text += message.substr(at, end - at);
      at = end;
      continue;
    }
    while (end < message.size() && is_letter(message[end])) ++end;
    const std::string_view word = std::string_view(message).substr(at, end - at);
    const auto found = kMirrored.find(word);
    text += found != kMirrored.end() ? found->second : word;
    if (end < message.size()) text += message[end];
    at = end + 1;
  }
  return text;
}

/// Lines that say where the robust constraints that x rests on are worst. Of others y is any.
void print_worst_cases(std::ostream& out, const std::vector<RobustWorstCase>& worst_cases,
                       NlProblem& problem) {
  constexpr std::size_t kMost = 20;
  std::size_t active = 0;
  if (worst_cases.empty()) return;
  TnlpProblem loaded(&problem);
  static_cast<void>(loaded.load());
  for (const RobustWorstCase& found : worst_cases) {
    if (!found.active || ++active > kMost) continue;
    const bool is_f = found.constraint >= problem.constraints();
    out << "\nworst case of "
        << (is_f ? "the objective" : problem.constraint_name(found.constraint)) << ": "
        << std::setprecision(10) << (is_f && problem.maximizes() ? -found.value : found.value)
        << " at " << log::place_of(found, loaded.structure());
  }
  if (active > kMost) out << "\n... and " << active - kMost << " more";
}

/// headings: of the names, of what follows. between: what stands between name and value.
template <class Name, class Between>
void print_table(std::ostream& out, const std::array<std::string, 2>& headings,
                 const std::vector<double>& values, const Name& name, const Between& between) {
  const int rows = static_cast<int>(values.size());
  std::size_t width = headings[0].size();
  for (int i = 0; i < rows; ++i) width = std::max(width, name(i).size());
  const auto column = std::setw(static_cast<int>(width));
  out << std::left << column << headings[0] << headings[1] << '\n';
  for (int i = 0; i < rows; ++i)
    out << column << name(i) << between(i) << std::setprecision(10) << values[at(i)] << '\n';
}

}  // namespace

int solve_result(const Result& result) { return ipopt_end(result.status).number; }

int detailed_result(const Result& result) {
  // First-order conditions that hold: a bounded value, approached at infinity.
  constexpr int kAtInfinity = 101;
  const bool at_infinity = result.status == Status::DivergingIterates &&
                           result.certificate.kind == PointKind::FirstOrderPoint;
  return at_infinity ? kAtInfinity : row_of(result.status).solve_result;
}

std::string message_of(const Result& result, NlProblem& problem) {
  std::ostringstream message;
  const bool game = problem.has_player(Player::Max) && problem.has_player(Player::Min);
  const bool maximizes = problem.maximizes();
  const auto spoken = [&](const std::string& text) {
    return maximizes ? mirrored(text, problem) : text;
  };
  message << "Ipminmax " IPMINMAX_VERSION ": " << ipopt_end(result.status).words << ": ";
  const std::string status = status_text(result.status, maximizes, game);
  const auto [why, point, over_y, over_x] = statements(result);
  const std::string first = why.substr(0, why.find('\n'));
  if (result.certificate.kind == PointKind::LocalMinmax) {
    message << "certified local " << name_of_optimum(maximizes, problem);
    if (result.status != Status::Solved) message << ", " << status;
  } else {
    message << status;
  }
  const std::string_view name = name_of(result.status);
  if (first.starts_with(concat(name, ": ")))
    message << " (" << spoken(first.substr(name.size() + 2)) << ")";
  else if (first != name)
    message << " (" << spoken(first) << ")";
  if (!problem.has_player(Player::Max) && split_warning(problem).empty())
    message << (maximizes ? "; no Min variable: a maximization"
                          : "; no Max variable: a minimization")
            << " (neither suffix player nor minmax_max_variables names one; Pyomo: "
               "Suffix(direction=Suffix.EXPORT))";
  message << spoken(why.substr(first.size()));
  if (!result.v.empty() || problem.players().empty()) {
    message << std::setprecision(10) << "\nobjective "
            << (maximizes ? -result.objective : result.objective) << ", " << result.iterations
            << " iterations; ";
    if (result.certificate.second_order == SecondOrder::NotTested) {
      message << "no second-order test was made";
    } else {
      message << "second-order test of " << (game ? "both players " : "the solution ")
              << name_of(result.certificate.second_order);
    }
  }
  constexpr std::size_t kMostReasons = 5;
  std::size_t shown = 0;
  for (const CertificateReason& reason : result.certificate.reasons)
    if (shown++ < kMostReasons) message << "\nreason: " << spoken(reason.text);
  print_worst_cases(message, result.worst_cases, problem);
  if (game) {
    message << "\nover all " << (maximizes ? "y, of the negative objective: " : "y: ") << over_y
            << "\nover x: " << over_x;
  }
  for (const std::string& warning : {integer_warning(problem), split_warning(problem)})
    if (!warning.empty()) message << "\nWARNING: " << warning;
  return message.str();
}

std::string one_line(const std::string& message) {
  std::string text = " \n";  // Ipopt's begins with an empty line
  for (const char c : message) text += c == '\n' ? "; " : std::string(1, c);
  return text;
}

std::string integer_warning(const NlProblem& problem) {
  const std::string name = problem.integer_variable();
  if (name.empty()) return {};
  return concat("variable ", name, " is integer: integer variables are treated as continuous.");
}

std::string split_warning(const NlProblem& problem) {
  const bool has_min = problem.has_player(Player::Min), has_max = problem.has_player(Player::Max);
  if ((has_min && has_max) || problem.players().empty()) return {};
  const char* const cause =
      " Was a variable eliminated before the model was written (Pyomo: linear_presolve=False)?";
  const char* const plain = problem.maximizes() == has_min ? ": this is a plain maximization."
                                                           : ": this is a plain minimization.";
  if (!has_min)
    return concat("all variables have player 1, none is left for player 0", plain, cause);
  if (const std::string name = problem.misspelt_suffix(); !name.empty())
    return concat("the variables have a suffix ", name, ", but none player", plain,
                  " Did you mean player?");
  if (problem.has_player_suffix())
    return concat("there is a suffix player, but no variable has player 1", plain, cause);
  return {};
}

void print_variables(std::ostream& out, const Result& result, const NlProblem& problem) {
  print_table(
      out, {"variable", "  player  value"}, result.v,
      [&](int i) { return problem.variable_name(i); },
      [&](int i) {
        // Player 0 of a model that maximizes is the maximizer.
        const bool maximizer = (problem.players()[at(i)] == Player::Max) != problem.maximizes();
        return maximizer ? "  Max     " : "  Min     ";
      });
}

void print_duals(std::ostream& out, const Result& result, const NlProblem& problem) {
  print_table(
      out, {"constraint", "  dual"}, problem.solution_file(result).duals,
      [&](int i) { return problem.constraint_name(i); }, [](int) { return "  "; });
}

}  // namespace ipminmax
