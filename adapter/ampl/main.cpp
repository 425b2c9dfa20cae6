// ipminmax [flags] stub [-AMPL] [name=value ...]: solves an AMPL model; ipminmax -? tells more.

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <IpoptConfig.h>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/options_documentation.hpp"
#include "adapter/ipopt/output_file.hpp"
#include "answer.hpp"
#include "assignments.hpp"
#include "checked_file.hpp"
#include "core/multistart.hpp"
#include "core/version.h"
#include "nl_problem.hpp"

using namespace ipminmax;  // this file ends here

using Ipopt::SmartPtr;

namespace {

// Modelling systems look for Ipopt's name and a version that they know.
const char version_text[] = "Ipopt " IPOPT_VERSION " interface: Ipminmax " IPMINMAX_VERSION
                            ", solver for minmax problems\n";

const char option_texts[] =
    "objno               objective to use, from 1; 0 for none (default 1)\n"
    "wantsol             sum of 1: write stub.sol (-AMPL and -s do, too); 2: print the variables;\n"
    "                    4: print the duals; 8: print no final message (default: up to 20\n"
    "                    variables are printed unless print_level = 0)\n"
    "halt_on_ampl_error  yes: a function that is undefined at a point ends the solve; no: the\n"
    "                    step is cut (default no)\n"
    "maxit, outlev       max_iter, print_level\n";

const char usage[] =
    "usage: ipminmax [flags] stub [-AMPL] [name=value ...]\n"
    "\n"
    "Solves the minmax problem, or the minimization, in stub.nl (AMPL's format, text or binary).\n"
    "Integer suffix player, 1 for the maximizer's variables, says who owns what; so do the "
    "options\n"
    "minmax_max_variables and minmax_max_constraints, with indices from 0 or names from stub.col\n"
    "and stub.row. A constraint on the maximizer's variables that is listed with player 0, or has\n"
    "integer suffix robust 1, must hold for all of their values (minmax_min_constraints).\n"
    "\n"
    "Flags:\n"
    "  -AMPL   called by AMPL: write stub.sol, print no final message\n"
    "  -s      write stub.sol, as wantsol=1 does\n"
    "  -oFILE  write FILE instead of stub.sol\n"
    "  -e      no effect: assignments are not echoed\n"
    "  -       end of flags: a stub that begins with - may follow\n"
    "  -v      version, after that of the Ipopt whose interface this is (also --version)\n"
    "  -=      all options\n"
    "  -?      this text (also -h, --help)\n"
    "\n"
    "Options:\n"
    "  Those of ipminmax.opt, and objno, wantsol, halt_on_ampl_error, see -=. They are read from\n"
    "  the options file (ipminmax.opt when there is one, or option_file_name, which must be "
    "there),\n"
    "  from the environment variable ipminmax_options (name=value or name value, values with\n"
    "  blanks in quotes) and from the command line. The command line overrides the environment,\n"
    "  and both override the file; what is overridden by another value is said on standard error.\n"
    "\n"
    "Signals:\n"
    "  SIGINT and SIGTERM stop the solve at the next iteration, and stub.sol is written with the\n"
    "  point reached. A second one ends the program at once.\n"
    "\n"
    "Exit code:\n"
    "  0 the solve ended, whatever its outcome (solve_result_num tells, or the message);\n"
    "  1 the model cannot be used, or stub.sol, a log file or standard output not be written;\n"
    "  2 bad option or usage.\n";

/// Gives the application its options. Throws when one is unknown or has a bad value.
void set_options(MinMaxApplication& application, const Assignments& assignments) {
  assignments.for_each(
      [&](const std::string& name, const std::string& value, const std::string& place) {
        const std::string error =
            set_option(name, value, *application.RegOptions(), *application.Options(), false);
        if (!error.empty()) throw std::invalid_argument(place + ": " + error);
      });
  SolverOptions unused;
  const std::string error = solver_options(*application.Options(), unused);
  if (!error.empty()) throw std::invalid_argument(error);
}

/// What the command line asks for.
struct Command {
  std::string stub;
  bool called_by_ampl = false;
  bool write = false;
  std::string solution_file;  ///< empty: stub.sol
  Assignments assignments;
};

/// Options that only the executable has.
struct RunOptions {
  int objective = -1;
  bool halt_on_error = false;
  bool write = false, print_variables = false, print_duals = false, print_message = true;
  bool few_variables = false;  ///< print the variables when there are few
  PlayerOptions players;
};

RunOptions take_run_options(Command& command) {
  Assignments& assignments = command.assignments;
  RunOptions options;
  assignments.rename("maxit", "max_iter");
  assignments.rename("outlev", "print_level");
  options.objective = assignments.take_integer("objno", -1, 0, 1 << 30);
  options.halt_on_error = assignments.take_flag("halt_on_ampl_error");
  constexpr int kNotGiven = 16;
  const int wanted = assignments.take_integer("wantsol", kNotGiven, 0, kNotGiven - 1);
  options.write = (wanted & 1) != 0 || command.write || command.called_by_ampl;
  options.print_variables = (wanted & 2) != 0;
  options.print_duals = (wanted & 4) != 0;
  options.print_message = (wanted & 8) == 0 && !command.called_by_ampl;  // AMPL prints it
  options.few_variables = wanted == kNotGiven && !command.called_by_ampl;
  options.players = {assignments.take("minmax_max_variables"),
                     assignments.take("minmax_max_constraints"),
                     assignments.take("minmax_min_constraints")};
  return options;
}

volatile std::sig_atomic_t stop_requested = 0;

void stop_on_signals() {
  struct sigaction action = {};
  action.sa_handler = [](int) { stop_requested = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;  // the second one ends it
  for (const int number : {SIGINT, SIGTERM}) {
    struct sigaction before = {};
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      sigaction(number, &action, nullptr);
  }
}

void require_none(const std::string& error) {
  if (!error.empty()) throw std::runtime_error(error);
}

/// The log file of option output_file, opened; null when there is none. The application finds it by
/// its name and sets its level.
SmartPtr<OutputFile> open_log(MinMaxApplication& application) {
  std::string file;
  read_option(*application.Options(), "output_file", file);
  if (file.empty() || file == "stdout" || file == "stderr") return nullptr;
  bool append = false;
  read_option(*application.Options(), "file_append", append);
  const SmartPtr<OutputFile> log = new OutputFile("OutputFile:" + file, Ipopt::J_ITERSUMMARY);
  require_none(log->open(file, append));
  application.Jnlst()->AddJournal(GetRawPtr(log));
  return log;
}

void require_standard_output() {
  std::cout.flush();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout)
    throw std::runtime_error("cannot write standard output");
}

void print_answer(const RunOptions& options, int print_level, const std::string& message,
                  const Result& result, const NlProblem& problem) {
  constexpr std::size_t kMostPrinted = 20;
  if (options.print_message) std::cout << message << '\n';
  const bool by_hand = options.few_variables && print_level > 0 && !result.v.empty();
  const bool few = result.v.size() <= kMostPrinted;
  if (options.print_variables || (by_hand && few)) {
    std::cout << '\n';
    print_variables(std::cout, result, problem);
  } else if (by_hand) {
    std::cout << "wantsol=2 prints the " << result.v.size() << " variables, -s writes them.\n";
  }
  if (options.print_duals) {
    std::cout << '\n';
    print_duals(std::cout, result, problem);
  }
}

void write_solution(const NlProblem& problem, const std::string& file, const std::string& message,
                    const Result& result) {
  SolutionFile solution = problem.solution_file(result);
  const bool game = problem.has_player(Player::Max);
  solution.message = game ? " \n" + message : one_line(message);
  solution.solve_result = solve_result(result);
  solution.detailed_result = detailed_result(result);
  write_file(file, problem.is_binary() ? solution.binary() : solution.text());
}

/// Processes that mpirun (or srun) has started together with this one; 1 where nothing did. MPI
/// itself is not asked: without a launcher it is not needed.
int launched_processes() {
  const auto number = [](const char* name) {
    const char* text = std::getenv(name);
    return text == nullptr ? 1 : std::max(1, std::atoi(text));
  };
  const bool by_srun = std::getenv("PMIX_RANK") != nullptr;  // salloc sets the others as well
  return std::max({number("OMPI_COMM_WORLD_SIZE"), number("PMI_SIZE"),
                   by_srun ? number("SLURM_STEP_NUM_TASKS") : 1});
}

/// The rank of this process among those that share the starts; none: it is alone, or rank 0 with
/// workers.
std::optional<int> rank_of_starts(const Assignments& assignments) {
  // The linear solver finds its workers itself.
  if (launched_processes() == 1 || assignments.value("linear_solver") == "mumps_mpi")
    return std::nullopt;
  return join_ranks_for_starts().rank;
}

/// Throws where a file would be written over the model. by: what names the file.
void require_another_file(const std::string& by, const std::string& file, const std::string& stub) {
  for (const std::string& model : {stub, stub + ".nl"}) {
    std::error_code unknown;
    if (std::filesystem::is_regular_file(model, unknown) &&
        std::filesystem::equivalent(file, model, unknown))
      throw std::invalid_argument(by + file + " would write over the model " + model);
  }
}

/// A minimization with integer variables is relaxed, as Ipopt does; the relaxation of a game bounds
/// its value from neither side.
void require_continuous_game(const NlProblem& problem) {
  const std::string integer = problem.integer_variable();
  if (!integer.empty() && problem.has_player(Player::Min) && problem.has_player(Player::Max))
    throw std::runtime_error("variable " + integer +
                             " is integer: only continuous variables are supported in games");
}

int solve(Command command) {
  const std::string solution_file =
      command.solution_file.empty() ? solution_file_name(command.stub) : command.solution_file;
  require_another_file("-o", solution_file, command.stub);
  if (command.write || command.called_by_ampl) remove_stale_file(solution_file);
  Assignments& assignments = command.assignments;
  SmartPtr<MinMaxApplication> application = new MinMaxApplication();
  add_file(*application->RegOptions(), assignments);
  assignments.report_overridden(std::cerr);
  for (const std::string option : {"output_file", "minmax_points_file"})
    require_another_file(option + " = ", assignments.value(option).value_or(""), command.stub);
  const RunOptions options = take_run_options(command);
  if (options.write) remove_stale_file(solution_file);
  if (command.called_by_ampl && !assignments.value("print_ipopt_log"))
    application->Options()->SetStringValue("print_ipopt_log", "yes");  // programs read it
  set_options(*application, assignments);
  stop_on_signals();  // before MPI is begun, which passes the launcher's signal on
  const auto rank = rank_of_starts(assignments);
  const bool silent = rank.value_or(0) > 0;
  if (silent) application->Options()->SetStringValue("output_file", "");
  const auto log = open_log(*application);
  if (application->Initialize("") != Ipopt::Solve_Succeeded)
    throw std::invalid_argument(application->LastResult().message);

  SmartPtr<NlProblem> problem = new NlProblem(command.stub, options.objective);
  problem->set_players(options.players);
  if (options.halt_on_error) {
    problem->halt_on_error();
    application->RethrowNonIpoptException(true);
  }
  require_continuous_game(*problem);
  for (const std::string& warning : {integer_warning(*problem), split_warning(*problem)}) {
    if (!warning.empty() && !silent) std::cerr << "ipminmax: WARNING: " << warning << '\n';
  }
  problem->stop_when(stop_requested);
  const SmartPtr<Ipopt::TNLP> model = GetRawPtr(problem);
  const Ipopt::ApplicationReturnStatus ended =
      rank ? application->OptimizeTNLPOverRanks(model) : application->OptimizeTNLP(model);
  if (ended == Ipopt::Invalid_Option)
    throw std::invalid_argument(application->LastResult().message);
  if (ended != Ipopt::Solve_Succeeded && ended != Ipopt::Solved_To_Acceptable_Level)
    problem->halt_where_undefined();
  if (silent) return 0;
  const Result& result = application->LastResult();
  const std::string message = message_of(result, *problem);
  int print_level = 0;
  get_option(*application->Options(), "print_level", print_level);
  // Where Ipopt leaves no file its callers look into the log, if there is one.
  const bool as_ipopt_none =
      command.called_by_ampl && print_level > 0 && result.status == Status::TooFewDegreesOfFreedom;
  if (options.write && !as_ipopt_none) write_solution(*problem, solution_file, message, result);
  print_answer(options, print_level, message, result, *problem);
  if (IsValid(log)) require_none(log->close());
  const std::size_t unwritten = result.message.find(kPointsNotWritten);
  if (unwritten != std::string::npos) throw std::runtime_error(result.message.substr(unwritten));
  return 0;
}

/// Standard descriptors that are closed are taken, so that no file gets their numbers: writing to
/// them fails, as it should.
void take_closed_descriptors() {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor)
    if (fcntl(descriptor, F_GETFD) < 0 && errno == EBADF)
      static_cast<void>(open("/dev/null", O_RDONLY));
}

/// Carries out the flags that only print. Returns whether the word is one.
bool print_only(const std::string& word) {
  if (word == "-v" || word == "--version") {
    std::cout << version_text;
  } else if (word == "-=") {
    std::cout << option_texts << '\n' << options_text();
  } else if (word == "-?" || word == "-h" || word == "--help") {
    std::cout << usage;
  } else {
    return false;
  }
  return true;
}

int run(int argc, char** argv) {
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
    } else if (print_only(word)) {
      return 0;
    } else if (word != "-e") {
      throw std::invalid_argument("unknown flag " + word + "; -? lists them");
    }
  }
  if (command.stub.empty()) throw std::invalid_argument(concat("no model given\n", usage));
  return solve(std::move(command));
}

/// Programs that call Ipopt look for its words.
void say_as_ipopt(const std::string& error) {
  const std::string_view unknown = "unknown option \"";
  const auto name = error.find(unknown);
  if (name == std::string::npos) return;
  const auto begin = name + unknown.size();
  std::cerr << "OPTION_INVALID: Read Option: \""
            << error.substr(begin, error.find('"', begin) - begin)
            << "\". It is not a valid option.\n";
}

}  // namespace

int main(int argc, char** argv) {
  take_closed_descriptors();
  // Writing then fails with an error that is reported.
  for (const int number : {SIGXFSZ, SIGPIPE}) std::signal(number, SIG_IGN);
  try {
    const int code = run(argc, argv);
    require_standard_output();
    return code;
  } catch (const std::invalid_argument& error) {
    std::cerr << "ipminmax: " << error.what() << '\n';
    say_as_ipopt(error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    std::cerr << "ipminmax: out of memory\n";
    return 1;
  } catch (const std::exception& error) {
    std::cerr << "ipminmax: " << error.what() << '\n';
    return 1;
  }
}
