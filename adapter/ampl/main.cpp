// ipminmax [flags] stub [-AMPL] [name=value ...]: solves an AMPL model; ipminmax -? tells more.

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "adapter/application_options.hpp"
#include "adapter/minmax_application.hpp"
#include "adapter/options_documentation.hpp"
#include "nl_problem.hpp"

namespace {

using ipminmax::Status;

constexpr const char* kEnvironment = "ipminmax_options";

int solve_result(Status status) {
  switch (status) {
    case Status::Solved:
      return 0;
    case Status::SolvedDegenerate:
      return 1;
    case Status::SolvedToAcceptableLevel:
      return 100;
    case Status::LocallyInfeasible:
      return 200;
    case Status::InnerInfeasible:
      return 201;
    case Status::OuterUnbounded:
      return 300;
    case Status::InnerUnbounded:
      return 301;
    case Status::DivergingIterates:
      return 302;
    case Status::MaxIterations:
      return 400;
    case Status::MaxCpuTime:
      return 401;
    case Status::MaxWallTime:
      return 402;
    case Status::UserStop:
      return 403;
    case Status::NotLocalMinmax:
      return 500;
    case Status::NoLocalMinmaxFound:
      return 501;
    case Status::InvalidProblem:
      return 502;
    case Status::EvaluationFailed:
      return 503;
    default:
      return 510;
  }
}

/// Where options come from, later ones win.
enum class Source : std::uint8_t { File, Environment, CommandLine };

/// The options that were given, with their texts.
class Assignments {
 public:
  void add(const std::string& name, const std::string& value, Source source) {
    given_[name].push_back({source, value});
  }
  /// An argument name=value.
  void add_argument(const std::string& text) {
    const std::size_t equal = text.find('=');
    if (equal == std::string::npos || equal == 0 || equal + 1 == text.size())
      throw std::invalid_argument("bad assignment \"" + text + "\": expected name=value");
    add(text.substr(0, equal), text.substr(equal + 1), Source::CommandLine);
  }
  /// Assignments separated by blanks: name=value or name value, a value with blanks in quotes.
  void add_environment(const std::string& text);
  void name_file(std::string name) { file_ = std::move(name); }

  /// The text that counts, none when the option was not given.
  [[nodiscard]] std::optional<std::string> value(const std::string& name) const {
    const auto found = given_.find(name);
    return found == given_.end() ? std::nullopt : std::optional(winner(found->second).value);
  }
  void erase(const std::string& name) { given_.erase(name); }

  /// Says which values are overridden by another one.
  void report_overridden(std::ostream& out) const;

  /// Calls visit(name, value, place) for each option.
  template <class Visit>
  void for_each(Visit visit) const {
    for (const auto& [name, all] : given_) {
      visit(name, winner(all).value, place(winner(all).source));
    }
  }

 private:
  struct Given {
    Source source;
    std::string value;
  };
  static const Given& winner(const std::vector<Given>& all) {
    return *std::max_element(  // the last of the highest
        all.rbegin(), all.rend(),
        [](const Given& a, const Given& b) { return a.source < b.source; });
  }
  [[nodiscard]] std::string place(Source source) const {
    if (source == Source::File) return file_;
    return source == Source::Environment ? kEnvironment : "the command line";
  }

  std::map<std::string, std::vector<Given>> given_;
  std::string file_;
};

void Assignments::add_environment(const std::string& text) {
  std::size_t at = 0;
  const auto skip_blanks = [&] {
    while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at]))) ++at;
  };
  const auto word = [&](bool is_name) {
    const std::size_t begin = at;
    const char quote = !is_name && at < text.size() ? text[at] : '\0';
    if (quote == '"' || quote == '\'') {
      const std::size_t end = text.find(quote, begin + 1);
      if (end == std::string::npos)
        throw std::invalid_argument(std::string(kEnvironment) + ": a quotation never ends");
      at = end + 1;
      return text.substr(begin + 1, end - begin - 1);
    }
    while (at < text.size() && !std::isspace(static_cast<unsigned char>(text[at])) &&
           !(is_name && text[at] == '=')) {
      ++at;
    }
    return text.substr(begin, at - begin);
  };
  for (skip_blanks(); at < text.size(); skip_blanks()) {
    const std::string name = word(true);
    skip_blanks();
    if (at < text.size() && text[at] == '=') ++at;
    skip_blanks();
    if (name.empty() || at == text.size())
      throw std::invalid_argument(std::string(kEnvironment) + ": option \"" + name +
                                  "\" has no value");
    add(name, word(false), Source::Environment);
  }
}

/// Whether two texts are the same value.
bool same_value(const std::string& a, const std::string& b) {
  const auto number = [](const std::string& text) -> std::optional<double> {
    std::istringstream stream(text);
    double value = 0.0;
    if (!(stream >> value) || !stream.eof()) return std::nullopt;
    return value;
  };
  return a == b || (number(a) && number(a) == number(b));
}

void Assignments::report_overridden(std::ostream& out) const {
  for (const auto& [name, all] : given_) {
    const Given& last = winner(all);
    for (const Given& given : all) {
      if (same_value(given.value, last.value)) continue;
      out << "ipminmax: " << name << " = " << last.value << " (" << place(last.source)
          << ") overrides " << given.value << " (" << place(given.source) << ")\n";
    }
  }
}

/// Takes an integer in [lower, upper] out of the assignments.
int take_integer(Assignments& assignments, const std::string& name, int missing, int lower,
                 int upper) {
  const auto given = assignments.value(name);
  if (!given) return missing;
  std::istringstream text(*given);
  int value = 0;
  if (!(text >> value) || !text.eof() || value < lower || value > upper)
    throw std::invalid_argument(name + " = " + *given + " is not an integer in [" +
                                std::to_string(lower) + ", " + std::to_string(upper) + "]");
  assignments.erase(name);
  return value;
}

const char option_texts[] =
    "objno    objective to use, from 1; 0 for none (default 1)\n"
    "wantsol  1: write stub.sol (default 0; -AMPL and -s also write it)\n";

const char usage[] =
    "usage: ipminmax [flags] stub [-AMPL] [name=value ...]\n"
    "  -AMPL   called by AMPL: write stub.sol, print no final message\n"
    "  -s      write stub.sol, as wantsol=1 does\n"
    "  -oFILE  write FILE instead of stub.sol\n"
    "  -e      no effect: assignments are not echoed\n"
    "  -       end of flags: a stub that begins with - may follow\n"
    "  -v      version (also --version)\n"
    "  -=      all options\n"
    "  -?      this text (also -h, --help)\n"
    "Options: those of ipminmax.opt, and objno and wantsol, see -=.\n"
    "The environment variable ipminmax_options holds assignments, too (name=value or name value,\n"
    "values with blanks in quotes). The command line overrides it, and both override "
    "ipminmax.opt;\n"
    "what is overridden by another value is said on standard error.\n"
    "Exit code: 0 the solve ended, whatever its outcome (solve_result_num tells, or the message);\n"
    "1 the model cannot be used, or stub.sol not be written; 2 bad option or usage.\n";

/// Adds what the options file sets. A missing file is no error.
void add_file(Ipopt::RegisteredOptions& registry, Assignments& assignments) {
  const std::string name = assignments.value("option_file_name").value_or("ipminmax.opt");
  std::ifstream file(name);
  if (name.empty() || !file.is_open()) return;
  // Ipopt's list keeps the first of several values in a file, and says so.
  const Ipopt::SmartPtr<Ipopt::Journalist> journalist = new Ipopt::Journalist;
  journalist->AddFileJournal("errors", "stderr", Ipopt::J_WARNING);
  const Ipopt::SmartPtr<Ipopt::OptionsList> list = new Ipopt::OptionsList(&registry, journalist);
  const std::string error = ipminmax::read_options(file, name, registry, *list);
  if (!error.empty()) throw std::invalid_argument(error);
  assignments.name_file(name);
  for (const auto& [option, unused] : registry.RegisteredOptionsList()) {
    std::ostringstream text;
    text << std::setprecision(std::numeric_limits<double>::max_digits10);
    double number = 0.0;
    Ipopt::Index integer = 0;
    std::string word;
    const auto type = registry.GetOption(option)->Type();
    if (type == Ipopt::OT_Number && list->GetNumericValue(option, number, "")) {
      text << number;
    } else if (type == Ipopt::OT_Integer && list->GetIntegerValue(option, integer, "")) {
      text << integer;
    } else if (type == Ipopt::OT_String && list->GetStringValue(option, word, "")) {
      text << word;
    } else {
      continue;
    }
    assignments.add(option, text.str(), Source::File);
  }
}

/// Gives the application its options. Throws when one is unknown or has a bad value.
void set_options(ipminmax::MinMaxApplication& application, const Assignments& assignments) {
  assignments.for_each([&](const std::string& name, const std::string& value,
                           const std::string& place) {
    const std::string error =
        ipminmax::set_option(name, value, *application.RegOptions(), *application.Options(), false);
    if (!error.empty()) throw std::invalid_argument(place + ": " + error);
  });
  ipminmax::SolverOptions unused;
  const std::string error = ipminmax::solver_options(*application.Options(), unused);
  if (!error.empty()) throw std::invalid_argument(error);
}

/// What the point is, in the words of the model's sense, and how the solve ended.
std::string message_of(const ipminmax::Result& result, const ipminmax::NlProblem& problem) {
  std::ostringstream message;
  message << "Ipminmax " IPMINMAX_VERSION ": ";
  if (result.certificate.kind == ipminmax::PointKind::LocalMinmax) {
    const bool game = problem.has_max_player();
    message << "certified local "
            << (problem.maximizes() ? (game ? "maxmin" : "maximum")
                                    : (game ? "minmax" : "minimum"));
    if (result.status != Status::Solved) message << ", " << name_of(result.status);
  } else {
    message << name_of(result.status);
  }
  if (!result.message.empty() && result.message != name_of(result.status))
    message << " (" << result.message << ")";
  if (!result.v.empty()) {
    message << std::setprecision(10) << "\nobjective "
            << (problem.maximizes() ? -result.objective : result.objective) << ", "
            << result.iterations << " iterations; second-order test of "
            << (problem.has_max_player() ? "both players " : "the solution ")
            << name_of(result.certificate.second_order);
  }
  return message.str();
}

/// What the command line asks for.
struct Command {
  std::string stub;
  bool called_by_ampl = false;
  bool write = false;
  std::string solution_file;  ///< empty: stub.sol
  Assignments assignments;
};

int solve(Command command) {
  Assignments& assignments = command.assignments;
  Ipopt::SmartPtr<ipminmax::MinMaxApplication> application = new ipminmax::MinMaxApplication();
  add_file(*application->RegOptions(), assignments);
  assignments.report_overridden(std::cerr);
  const int objective = take_integer(assignments, "objno", -1, 0, 1 << 30);
  const bool write =
      take_integer(assignments, "wantsol", 0, 0, 1) == 1 || command.write || command.called_by_ampl;
  set_options(*application, assignments);
  if (application->Initialize("") != Ipopt::Solve_Succeeded) {
    throw std::invalid_argument(application->LastResult().message);
  }

  Ipopt::SmartPtr<ipminmax::NlProblem> problem = new ipminmax::NlProblem(command.stub, objective);
  const Ipopt::ApplicationReturnStatus ended =
      application->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(problem)));
  if (ended == Ipopt::Invalid_Option) return 2;
  const ipminmax::Result& result = application->LastResult();
  const std::string message = message_of(result, *problem);
  if (write)
    problem->write_solution(message, solve_result(result.status), result, command.solution_file);
  if (!command.called_by_ampl) std::cout << message << '\n';  // AMPL prints it
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Command command;
    if (const char* environment = std::getenv(kEnvironment))
      command.assignments.add_environment(environment);
    bool flags = true;
    for (int i = 1; i < argc; ++i) {
      const std::string word = argv[i];
      if (!flags || word[0] != '-') {
        if (command.stub.empty())
          command.stub = word;
        else
          command.assignments.add_argument(word);
      } else if (word == "-AMPL") {
        command.called_by_ampl = true;
      } else if (word == "-s") {
        command.write = true;
      } else if (word.starts_with("-o") && word.size() > 2) {
        command.write = true;
        command.solution_file = word.substr(2);
      } else if (word == "-" || word == "--") {
        flags = false;
      } else if (word == "-v" || word == "--version") {
        std::cout << "Ipminmax " IPMINMAX_VERSION "\n";
        return 0;
      } else if (word == "-=") {
        std::cout << option_texts << '\n' << ipminmax::options_text();
        return 0;
      } else if (word == "-?" || word == "-h" || word == "--help") {
        std::cout << usage;
        return 0;
      } else if (word != "-e") {
        throw std::invalid_argument("unknown flag " + word + "; -? lists them");
      }
    }
    if (command.stub.empty()) throw std::invalid_argument(std::string("no model given\n") + usage);
    return solve(std::move(command));
  } catch (const std::invalid_argument& error) {
    std::cerr << "ipminmax: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "ipminmax: " << error.what() << '\n';
    return 1;
  }
}
