// ipminmax stub [-AMPL] [-s] [name=value ...]: solves an AMPL model.
// Exit code: 0 when the solve ended, whatever its outcome (solve_result_num in stub.sol tells); 1 for
// a model that cannot be used; 2 for a bad option or usage.

#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <stdexcept>

#include <ipminmax/adapter/application_options.hpp>
#include <ipminmax/adapter/minmax_application.hpp>
#include <ipminmax/adapter/options_documentation.hpp>

#include "nl_problem.hpp"

namespace {

using ipminmax::Status;
using Assignments = std::map<std::string, std::string>;

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

/// Adds the assignment name=value; later ones win.
void assign(const std::string& text, Assignments& assignments) {
  const std::size_t equal = text.find('=');
  if (equal == std::string::npos || equal == 0 || equal + 1 == text.size())
    throw std::invalid_argument("bad assignment \"" + text + "\": expected name=value");
  const std::string name = text.substr(0, equal), value = text.substr(equal + 1);
  if (text.find_first_of("\"\n") != std::string::npos)
    throw std::invalid_argument("option " + name + ": quotes and line ends cannot be used");
  assignments[name] = value;
}

/// Takes an integer in [lower, upper] out of the assignments.
int take_integer(Assignments& assignments, const std::string& name, int missing, int lower,
                 int upper) {
  const auto found = assignments.find(name);
  if (found == assignments.end()) return missing;
  std::istringstream text(found->second);
  int value = 0;
  if (!(text >> value) || !text.eof() || value < lower || value > upper)
    throw std::invalid_argument(name + " = " + found->second + " is not an integer in [" +
                                std::to_string(lower) + ", " + std::to_string(upper) + "]");
  assignments.erase(found);
  return value;
}

const char option_texts[] =
    "objno    objective to use, from 1; 0 for none (default 1)\n"
    "wantsol  1: write stub.sol (default 0; -AMPL and -s also write it)\n";

const char usage[] =
    "usage: ipminmax stub [-AMPL] [-s] [name=value ...]\n"
    "  -AMPL  called by AMPL: write stub.sol\n"
    "  -s     write stub.sol, as wantsol=1 does\n"
    "  -v     version\n"
    "  -=     all options\n"
    "  -?     this text\n"
    "Options: those of ipminmax.opt, and objno and wantsol, see -=.\n"
    "The environment variable ipminmax_options holds assignments too; the command line overrides\n"
    "it, and both override ipminmax.opt.\n";

/// Sets an option as a line of an options file would. Throws when it is unknown or has a bad value.
void set_option(ipminmax::MinMaxApplication& application, const std::string& name,
                const std::string& value) {
  std::istringstream line(name + " \"" + value + "\"\n");
  std::string error =
      ipminmax::read_options(line, "", *application.RegOptions(), *application.Options());
  if (!error.empty()) error.erase(0, error.find(": ") + 2);  // "line 1" says nothing here
  ipminmax::SolverOptions unused;
  if (error.empty()) error = ipminmax::solver_options(*application.Options(), unused);
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

int solve(const std::string& stub, bool called_by_ampl, bool write, Assignments assignments) {
  const int objective = take_integer(assignments, "objno", -1, 0, 1 << 30);
  write = take_integer(assignments, "wantsol", 0, 0, 1) == 1 || write || called_by_ampl;

  Ipopt::SmartPtr<ipminmax::MinMaxApplication> application = new ipminmax::MinMaxApplication();
  for (const auto& [name, value] : assignments) set_option(*application, name, value);
  if (application->Initialize() != Ipopt::Solve_Succeeded) {
    throw std::invalid_argument(application->LastResult().message);
  }

  Ipopt::SmartPtr<ipminmax::NlProblem> problem = new ipminmax::NlProblem(stub, objective);
  const Ipopt::ApplicationReturnStatus ended =
      application->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(problem)));
  if (ended == Ipopt::Invalid_Option) return 2;
  const ipminmax::Result& result = application->LastResult();
  const std::string message = message_of(result, *problem);
  if (write)
    problem->write_solution(message, solve_result(result.status), result);  // AMPL prints it
  if (!called_by_ampl) std::cout << message << '\n';
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::string stub;
    bool called_by_ampl = false, write = false;
    Assignments assignments;
    if (const char* environment = std::getenv("ipminmax_options")) {
      std::istringstream words(environment);
      for (std::string word; words >> word;) assign(word, assignments);
    }
    for (int i = 1; i < argc; ++i) {
      const std::string word = argv[i];
      if (word == "-AMPL") {
        called_by_ampl = true;
      } else if (word == "-s") {
        write = true;
      } else if (word == "-v") {
        std::cout << "Ipminmax " IPMINMAX_VERSION "\n";
        return 0;
      } else if (word == "-=") {
        std::cout << option_texts << '\n' << ipminmax::options_text();
        return 0;
      } else if (word == "-?") {
        std::cout << usage;
        return 0;
      } else if (word[0] == '-') {
        throw std::invalid_argument("unknown flag " + word);
      } else if (stub.empty()) {
        stub = word;
      } else {
        assign(word, assignments);
      }
    }
    if (stub.empty()) throw std::invalid_argument(std::string("no model given\n") + usage);
    return solve(stub, called_by_ampl, write, std::move(assignments));
  } catch (const std::invalid_argument& error) {
    std::cerr << "ipminmax: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "ipminmax: " << error.what() << '\n';
    return 1;
  }
}
