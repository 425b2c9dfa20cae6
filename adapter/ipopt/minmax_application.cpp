#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/ipopt_library.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/log.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/optional_players.hpp"
#include "adapter/ipopt/options_documentation.hpp"
#include "adapter/ipopt/output_file.hpp"
#include "adapter/ipopt/point_arrays.hpp"
#include "adapter/ipopt/status.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/answer.hpp"
#include "core/diagnostics/diagnosis.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/search/outcome.hpp"
#include "core/solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

using Ipopt::ApplicationReturnStatus;
using Ipopt::EJournalCategory;
using Ipopt::EJournalLevel;
using Ipopt::SmartPtr;
using enum ApplicationReturnStatus;
using enum EJournalCategory;
using enum EJournalLevel;

namespace {

/// What the options say of the iteration table.
struct RowSettings {
  Index every = 1;
  double pause = 0.0;
  bool with_info = false, as_ipopt = false;
};

/// All that a solve takes from the options.
struct Settings {
  std::string error;  ///< what is wrong with them, empty: nothing
  SolverOptions solver;
  PlayerOptions players;
  RowSettings rows;
  EJournalLevel print_level = J_NONE;
  bool without_banner = false, list_options = false, document_options = false, time_stages = false;
  std::string points_file;           ///< empty: none
  std::vector<std::string> ignored;  ///< messages about options without effect
};

/// The option that names the solver's library; empty: it is built in.
std::string library_option(LinearSolver solver) {
  using enum LinearSolver;
  switch (solver) {
    case Ma57:
    case Ma97:
      return "hsllib";
    case Spral:
      return "minmax_spral_library";
    case Pardiso:
    case PardisoMkl:
      return "pardisolib";
    default:
      return "";
  }
}

/// The library of a solver that is loaded. Ipopt's users have linear_solver ma57 in their files:
/// where nobody names a library and there is none, it means auto; one that is named has to be
/// there.
void choose_solver_library(const OptionsList& list, Settings& settings) {
  LinearSolver& solver = settings.solver.linear_solver;
  const std::string option = library_option(solver);
  if (option.empty()) return;
  std::string file;
  const bool is_named = get_option(list, option, file);
  if (!is_named && solver == LinearSolver::PardisoMkl) file = "libmkl_rt.so";
  use_solver_library(solver, file);
  const std::string reason = missing_solver_library(solver);
  if (reason.empty()) return;
  if (is_named) {
    settings.error = concat(option, " = ", file, " cannot be used: ", reason);
    return;
  }
  std::string name;
  get_option(list, "linear_solver", name);
  settings.ignored.push_back(
      concat("linear_solver = ", name, " has no effect: ", reason, "; auto is used, see ", option));
  solver = LinearSolver::Auto;
}

/// How much is printed on the console, or into the output file.
EJournalLevel print_level(const OptionsList& list, bool of_file = false) {
  Index level = J_ITERSUMMARY;
  read_option(list, "print_level", level);
  if (of_file) read_option(list, "file_print_level", level);
  return static_cast<EJournalLevel>(level);
}

Settings read_settings(const OptionsList& list) {
  Settings settings;
  settings.print_level = print_level(list);
  read_option(list, "sb", settings.without_banner);
  settings.error = solver_options(list, settings.solver);
  if (!settings.error.empty()) return settings;
  settings.players = player_options(list);
  read_option(list, "print_frequency_iter", settings.rows.every);
  read_option(list, "print_frequency_time", settings.rows.pause);
  read_option(list, "print_info_string", settings.rows.with_info);
  read_option(list, "print_ipopt_log", settings.rows.as_ipopt);
  read_option(list, "print_user_options", settings.list_options);
  read_option(list, "print_options_documentation", settings.document_options);
  read_option(list, "print_timing_statistics", settings.time_stages);
  read_option(list, "minmax_points_file", settings.points_file);
  settings.ignored = ignored_ipopt_options(list);
  choose_solver_library(list, settings);
  return settings;
}

/// The iteration table: which rows are printed, and when the header is repeated.
class IterationRows {
 public:
  explicit IterationRows(const RowSettings& settings) : settings_(settings) {}

  /// Empty when the iteration is not due. told: iterations of the solve before it, which Ipopt's
  /// log numbers its rows by, restorations included.
  [[nodiscard]] std::string text(const IterationInfo& info, Index told) {
    constexpr Index kRowsPerHeader = 10;
    const auto now = std::chrono::steady_clock::now();
    const bool as_ipopt = settings_.as_ipopt;
    if (info.over_y || (info.restoration && !as_ipopt)) return {};
    if ((as_ipopt ? told : info.iteration) % settings_.every != 0) return {};
    if (rows_ > 0 && std::chrono::duration<double>(now - last_).count() < settings_.pause)
      return {};
    last_ = now;
    std::string text;
    if (rows_ % kRowsPerHeader == 0)
      text = (rows_ > 0 ? "\n" : "") +
             (as_ipopt ? log::ipopt_iteration_header() : log::iteration_header());
    ++rows_;
    return text + (as_ipopt ? log::ipopt_iteration_row(info, told)
                            : log::iteration_row(info, settings_.with_info));
  }

 private:
  RowSettings settings_;
  Index rows_ = 0;
  std::chrono::steady_clock::time_point last_;
};

/// The application whose model's intermediate_callback this thread is in.
thread_local const MinMaxApplication* calling = nullptr;

bool is_finite(const Violations& v) {
  return all_finite(v.lower_bound) && all_finite(v.upper_bound) &&
         all_finite(v.lower_complementarity) && all_finite(v.upper_complementarity) &&
         all_finite(v.lagrangian_gradient) && all_finite(v.constraint) &&
         all_finite(v.constraint_complementarity);
}

double system_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_stime.tv_usec);
}

/// Largest violation of the variables' own bounds.
double bound_violation(const ProblemStructure& structure, const std::vector<double>& v) {
  double largest = 0.0;
  for (const auto i : indices(v)) {
    largest =
        std::max({largest, structure.variable_lower[i] - v[i], v[i] - structure.variable_upper[i]});
  }
  return largest;
}

/// Whether the standard output is shown on a terminal. mpirun gives each rank a terminal of its own
/// and passes on what is written there: its own output counts.
bool stdout_is_terminal(bool over_ranks) {
  if (isatty(STDOUT_FILENO) != 1) return false;
  if (!over_ranks || std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr) return true;
  const std::string output = concat("/proc/", getppid(), "/fd/1");
  std::error_code error;
  const std::string target = std::filesystem::read_symlink(output, error).string();
  return target.starts_with("/dev/pts/") || target.starts_with("/dev/tty");
}

/// A model may stop because Ipopt's own methods have nothing to tell it.
std::string stop_note(Ipopt::TNLP& model, const Result& result) {
  const bool may_have_asked = IPMINMAX_IPOPT_AT_LEAST(3, 14) && result.status == Status::UserStop &&
                              result.iterations == 0 &&
                              dynamic_cast<ObservableTNLP*>(&model) == nullptr;
  return may_have_asked ? "\nif because get_curr_iterate or get_curr_violations returned false: "
                          "those of ipminmax::ObservableTNLP answer"
                        : "";
}

}  // namespace

struct MinMaxApplication::Implementation {
  MinMaxApplication& application;
  SmartPtr<Ipopt::Journalist> journalist = new Ipopt::Journalist();
  SmartPtr<RegisteredOptions> registry = new OptionRegistry();
  SmartPtr<OptionsList> list = new ExactOptionsList(registry, journalist);
  SmartPtr<Ipopt::TNLP> model;
  std::optional<MinMaxStatistics::Extra> solved;  ///< with result for statistics
  SmartPtr<MinMaxStatistics> statistics;          ///< once asked for
  RepeatedSolver solver;
  Result result;
  ResultArrays room;  ///< for the next result
  std::unique_ptr<TnlpProblem> last_problem;
  std::vector<DistinctPoint> points;
  std::optional<Settings> settings;    ///< as last read
  std::uint64_t settings_read_at = 0;  ///< changes of the list before that
  bool banner_printed = false;
  bool documentation_printed = false;
  std::set<std::string> ignored_options;  ///< messages already printed
  bool model_is_known = false;            ///< it was solved just before
  std::vector<std::string> warnings;      ///< about who owns what, of the model when it was new
  bool rethrow = false;
  bool over_ranks = false;
  bool silent = false;  ///< not the rank that prints
  bool solving = false;
  Index told = 0;  ///< iterations of the solve so far, without those of maximizations over y
  /// What intermediate_callback and finalize_solution may ask about, while they run.
  struct Current {
    TnlpProblem& problem;
    const SolverOptions& options;
    const IterationInfo* info = nullptr;  ///< null in finalize_solution
    const Result* answer = nullptr;       ///< there
    std::optional<Result> result{};       ///< of the iteration, once asked for
    [[nodiscard]] const Result& at() {
      if (answer != nullptr) return *answer;
      if (!result) result = info->result();
      return *result;
    }
  };
  std::optional<Current> current;
  UserScaling factors, asked;  ///< of the solve, as told at its first iterate; of what is current
  bool factors_known = false;  ///< whether they are those of the answer

  [[nodiscard]] bool may_ask(bool scaled) {
    return current && !current->at().v.empty() && (!scaled || current_factors() != nullptr);
  }

  double system_seconds_before = 0.0;

  [[nodiscard]] std::string exit_line() {
    return current_settings().rows.as_ipopt ? log::ipopt_exit_line(result) : log::exit_line(result);
  }
  void print(EJournalLevel level, EJournalCategory category, const std::string& text) const {
    if (!silent) journalist->Printf(level, category, "%s", text.c_str());
  }
  [[nodiscard]] bool is_printed(EJournalLevel level, EJournalCategory category) const {
    return !silent && journalist->ProduceOutput(level, category);
  }
  /// make() gives the text, which is made only where it is printed.
  template <class Make>
  void print_made(EJournalLevel level, EJournalCategory category, Make&& make) const {
    if (is_printed(level, category)) print(level, category, make());
  }

  Implementation(MinMaxApplication& owner, bool create_console_out) : application(owner) {
    if (create_console_out) {
      journalist->AddFileJournal("console", "stdout", J_ITERSUMMARY);
      set_console_level(print_level(*list));
    }
  }

  // --- Options and output
  // ---------------------------------------------------------------------------

  [[nodiscard]] const Settings& current_settings() {
    // Another class of list does not tell when it changes.
    const auto* counting = dynamic_cast<const ExactOptionsList*>(GetRawPtr(list));
    if (!settings || counting == nullptr || settings_read_at != counting->changes()) {
      settings = read_settings(*list);
      settings_read_at = counting != nullptr ? counting->changes() : 0;
    }
    return *settings;
  }

  void set_console_level(EJournalLevel level) {
    const SmartPtr<Ipopt::Journal> console = journalist->GetJournal("console");
    if (IsNull(console)) return;
    console->SetAllPrintLevels(level);
    console->SetPrintLevel(J_DBG, J_NONE);
  }

  [[nodiscard]] bool open_output_file(const std::string& file_name, EJournalLevel level,
                                      bool append) {
    const std::string journal_name = "OutputFile:" + file_name;
    SmartPtr<Ipopt::Journal> journal = journalist->GetJournal(journal_name);
    if (IsNull(journal)) {
      const SmartPtr<OutputFile> file = new OutputFile(journal_name, level);
      journal = GetRawPtr(file);
      if (!file->open(file_name, append).empty() || !journalist->AddJournal(journal)) return false;
    }
    journal->SetAllPrintLevels(level);
    journal->SetPrintLevel(J_DBG, J_NONE);
    return true;
  }

  [[nodiscard]] ApplicationReturnStatus set_up_output() {
    set_console_level(print_level(*list));
    std::string file_name;
    bool append = false;
    read_option(*list, "output_file", file_name);
    read_option(*list, "file_append", append);
    if (file_name.empty() || open_output_file(file_name, print_level(*list, true), append))
      return Solve_Succeeded;
    return refuse_option("Error opening output file \"" + file_name + "\"", "");
  }

  [[nodiscard]] ApplicationReturnStatus refuse_option(std::string error,
                                                      const char* heading = "Invalid option: ") {
    print(J_ERROR, J_INITIALIZATION, heading + error + "\n");
    result = {};
    result.status = Status::InvalidOption;
    result.message = std::move(error);
    return Invalid_Option;
  }

  [[nodiscard]] ApplicationReturnStatus initialize_from_file(const std::string& name,
                                                             bool allow_clobber, bool must_exist) {
    try {
      std::ifstream file;
      if (!name.empty()) file.open(name);
      std::error_code unknown;
      if (!name.empty() && !file.is_open() &&
          (must_exist || std::filesystem::exists(name, unknown))) {
        return refuse_option("the options file \"" + name + "\" cannot be opened");
      }
      return initialize(file, name, allow_clobber);
    } catch (...) {
      return report_exception();
    }
  }

  [[nodiscard]] ApplicationReturnStatus initialize(std::istream& options, const std::string& source,
                                                   bool allow_clobber) {
    try {
      std::string error = read_options(options, source, *registry, *list, allow_clobber);
      if (error.empty()) {
        SolverOptions unused;
        error = solver_options(*list, unused);
      }
      if (!error.empty()) return refuse_option(std::move(error));
      const ApplicationReturnStatus status = set_up_output();
      if (status == Solve_Succeeded) print_options_documentation();
      return status;
    } catch (...) {
      return report_exception();
    }
  }

  void print_banner() {
    print(J_SUMMARY, J_MAIN, log::banner());
    banner_printed = true;
  }

  void print_options_documentation() {
    if (documentation_printed || !current_settings().document_options) return;
    print(J_SUMMARY, J_MAIN, "\n# List of options\n");
    std::istringstream lines(options_text());  // line by line: journals of Ipopt may have a buffer
    for (std::string line; std::getline(lines, line);) {
      print(J_SUMMARY, J_MAIN, line + "\n");
    }
    documentation_printed = true;
  }

  void print_ignored_options() {
    for (const std::string& message : current_settings().ignored) {
      if (!ignored_options.insert(message).second) continue;
      print(J_STRONGWARNING, J_MAIN, "Option " + message + ".\n");
    }
  }

  // --- Solve
  // ----------------------------------------------------------------------------------------

  /// To be called while an exception is handled: says what it is and returns Ipopt's status, or
  /// passes it on.
  [[nodiscard]] ApplicationReturnStatus report_exception() {
    result.status = Status::InternalError;
    try {
      throw;
    } catch (const Ipopt::IpoptException& error) {
      result.message = error.Message();
      error.ReportException(*journalist);
      print(J_SUMMARY, J_MAIN, "\nEXIT: Some uncaught Ipopt exception encountered.\n");
      return Unrecoverable_Exception;
    } catch (const std::bad_alloc&) {
      return stop(Status::OutOfMemory, "out of memory");
    } catch (...) {
      if (rethrow) {
        journalist->FlushBuffer();
        throw;
      }
      result.message = "unknown exception";
      try {
        throw;
      } catch (const std::exception& error) {
        result.message = error.what();
      } catch (...) {  // keeps the message above
      }
      print(J_ERROR, J_MAIN, "Exception of the model: " + result.message + "\n");
      print(J_SUMMARY, J_MAIN, "\nEXIT: Exception thrown by the model.\n");
      return NonIpopt_Exception_Thrown;
    }
  }

  [[nodiscard]] ApplicationReturnStatus stop(Status status, std::string message) {
    result.status = status;
    result.message = std::move(message);
    print(J_ERROR, J_MAIN, exit_line());
    return application_status(status);
  }

  /// Calls a method of the model, which may ask about what is current.
  template <class Call>
  decltype(auto) let_ask(Current about, Call&& call) {
    struct Reset {
      std::optional<Current>& current;
      const MinMaxApplication* caller;
      ~Reset() {
        current.reset();
        calling = caller;
      }
    } const reset{current, calling};
    calling = &application;
    current.emplace(std::move(about));
    return call();
  }

  /// The factors of what is current; null where they are not known.
  [[nodiscard]] const UserScaling* current_factors() {
    if (current->info != nullptr) {
      if (!current->info->scaling) return nullptr;
      current->info->scaling(asked);
    } else if (!factors_known) {
      return nullptr;
    } else {
      asked = factors;
    }
    const ProblemStructure& structure = current->problem.structure();
    const bool fits = asked.variables.size() == structure.variable_players.size() &&
                      asked.constraints.size() == structure.constraint_players.size();
    return fits ? &asked : nullptr;  // robust constraints make another problem
  }

  /// Prints what a solve tells, and passes it on to the model.
  struct Audience {
    Implementation& owner;
    TnlpProblem& problem;
    const SolverOptions& options;
    IterationRows rows{owner.current_settings().rows};

    /// As long as this lives. One reference is all that it holds: no more fits into a std::function
    /// without an allocation.
    [[nodiscard]] SolveObserver observer() {
      return {.on_iteration = [this](const IterationInfo& info) { return tell(info); },
              .message =
                  [this](std::string_view text) {
                    owner.print(J_WARNING, J_MAIN, concat(text, "\n"));
                  }};
    }
    [[nodiscard]] bool tell(const IterationInfo& info, EJournalLevel level = J_ITERSUMMARY) {
      owner.print_made(level, J_MAIN, [&] { return rows.text(info, owner.told); });
      if (!info.over_y) ++owner.told;
      if (info.iteration == 0 && !info.restoration && !info.over_y && info.scaling) {
        info.scaling(owner.factors);
        owner.factors_known = true;
      }
      if (info.over_y) return problem.report(info);  // not about the point of the solve
      return owner.let_ask({.problem = problem, .options = options, .info = &info},
                           [&] { return problem.report(info); });
    }
  };

  /// From many starts, or with a file for the points that were found.
  [[nodiscard]] Result solve_for_points(TnlpProblem& problem, const SolverOptions& options) {
    const bool many = options.minmax_starts > 1 || over_ranks;
    const EJournalLevel level = many ? J_DETAILED : J_ITERSUMMARY;
    Audience audience{*this, problem, options};
    MultistartObserver observer;
    observer.on_iteration = [&](Index, const IterationInfo& info) {
      if (many && info.iteration == 0) audience.rows = IterationRows(current_settings().rows);
      return audience.tell(info, level);
    };
    const bool as_ipopt = current_settings().rows.as_ipopt;  // whose log has no such tables
    // One line that is refreshed on a terminal, else one line per start.
    const bool on_terminal = prints_to_terminal();
    const auto& players = problem.structure().variable_players;
    log::StartsProgress progress(options.minmax_starts,
                                 std::ranges::count(players, Player::Min) == 0);
    observer.on_result = [&, rows = on_terminal ? J_DETAILED : J_ITERSUMMARY](Index start,
                                                                              const Result& found) {
      if (as_ipopt || !many) return;
      if (start == 0) print(rows, J_MAIN, log::start_header());
      print(rows, J_MAIN, log::start_row(start, found));
      progress.add(found);
      show_progress(progress, on_terminal);
    };
    observer.message = [this](Index, std::string_view text) {
      print(J_WARNING, J_MAIN, concat(text, "\n"));
    };
    Answer found = over_ranks ? multistart_over_ranks(
                                    [&] { return std::make_unique<ForwardingProblem>(problem); }, 1,
                                    options, observer)
                              : ipminmax::run(problem, options, observer);
    write_points(found);
    if (many && has_iterate(found.best.status) && !as_ipopt) {
      print(J_SUMMARY, J_SOLUTION, log::multistart_summary(found));
    }
    points = std::move(found.points);
    return std::move(found.best);
  }

  [[nodiscard]] bool prints_to_terminal() const {
    const SmartPtr<Ipopt::Journal> console = journalist->GetJournal("console");
    return !silent && IsValid(console) && console->IsAccepted(J_MAIN, J_ITERSUMMARY) &&
           stdout_is_terminal(over_ranks);
  }

  void show_progress(log::StartsProgress& progress, bool on_terminal) const {
    constexpr double kRefresh = 0.1;  // seconds
    constexpr double kPlainLines = 10.0;
    if (!progress.due(on_terminal ? kRefresh : kPlainLines) &&
        !(on_terminal && progress.complete())) {
      return;
    }
    if (!on_terminal) {
      print(J_ITERSUMMARY, J_MAIN, progress.line() + "\n");
      return;
    }
    journalist->FlushBuffer();
    std::printf("\r%-79s%s", progress.line().c_str(), progress.complete() ? "\n" : "");
    std::fflush(stdout);
  }

  void write_points(Answer& found) {
    const std::string& name = current_settings().points_file;
    if (name.empty() || silent) return;
    OutputFile file(name, J_ITERSUMMARY);
    std::string error = file.open(name, false);
    file.Print(J_MAIN, J_ITERSUMMARY, points_as_csv(found).c_str());
    if (error.empty()) error = file.close();
    if (error.empty()) return;
    error.insert(0, kPointsNotWritten);
    found.best.message += "; " + error;  // also where nothing is printed
    print(J_ERROR, J_MAIN, "E" + error.substr(1) + "\n");
  }

  /// A model that is solved again, step by step, is not looked at again unless it is printed.
  void remark_on_split(const ProblemStructure& structure, const SolverOptions& options) {
    const bool printed = is_printed(J_WARNING, J_MAIN);
    if (!printed && model_is_known) return;
    warnings.clear();
    const bool distributes = dynamic_cast<const MinMaxTNLP*>(GetRawPtr(model)) != nullptr &&
                             dynamic_cast<const OptionalPlayers*>(GetRawPtr(model)) == nullptr;
    if (!distributes && !has_max_variables(structure)) {  // an ordinary model
      print(J_WARNING, J_MAIN,
            options.obj_scaling_factor < 0.0 ? "Note: no Max variable: a maximization.\n\n"
                                             : "Note: no Max variable: a minimization.\n\n");
      return;
    }
    const auto warn = [&](const std::string& text) {
      if (!text.empty()) print(J_WARNING, J_MAIN, "Warning: " + text + "\n\n");
    };
    warn(one_player_remark(structure));
    warnings = split_remarks(structure);
    std::ranges::for_each(warnings, warn);
  }

  /// Not where the solver that was asked for is not built in: programs find out so whether it is.
  void print_linear_solver() {
    std::string name = "auto";
    read_option(*list, "linear_solver", name);
    if (name != "auto" && current_settings().solver.linear_solver == LinearSolver::Auto) return;
    print(J_ITERSUMMARY, J_MAIN, log::ipopt_solver_line(name));
  }
  [[nodiscard]] ApplicationReturnStatus finish(TnlpProblem& problem, const SolverOptions& options) {
    result.message += stop_note(*model, result);
    for (const std::string& text : warnings) {  // where there is no console, too
      if (result.message.find(text) == std::string::npos) result.message += "\n" + text;
    }
    if (!has_iterate(result.status)) {
      print(J_ERROR, J_MAIN, exit_line());
      return application_status(result.status);
    }
    const bool as_ipopt = current_settings().rows.as_ipopt;
    const auto printed = [&](EJournalCategory category, auto&& make) {
      print_made(J_SUMMARY, category, make);
    };
    if (!result.worst_cases.empty()) {
      printed(J_SOLUTION, [&] { return log::robust_summary(result, problem.structure()); });
    }
    printed(J_SOLUTION, [&] {
      return log::summary(result, problem.structure(), as_ipopt ? told - 1 : result.iterations);
    });
    const auto* players = dynamic_cast<const OptionalPlayers*>(GetRawPtr(model));
    const bool is_known = players != nullptr && players->gives_constraints_to_max();
    if (!is_known) {
      printed(J_SOLUTION, [&] {
        const std::string text = coupled_remark(problem.structure());
        return text.empty() ? "" : concat("Note: ", text, "\n");
      });
    }
    if (as_ipopt) printed(J_SOLUTION, [&] { return log::ipopt_errors(result); });
    printed(J_STATISTICS, [&] {
      return as_ipopt ? log::ipopt_work(result, problem.structure()) : log::work(result);
    });
    if (current_settings().time_stages) {
      printed(J_TIMING_STATISTICS, [&] { return log::timing(result.timing); });
    }
    printed(J_MAIN, [&] { return exit_line(); });
    solved = {.bound_violation = bound_violation(problem.structure(), result.v),
              .system_seconds = system_seconds() - system_seconds_before};
    if (problem.started()) {
      let_ask({.problem = problem, .options = options, .answer = &result},
              [&] { problem.finalize(solver_return(result.status), result); });
    }
    return application_status(result.status);
  }

  [[nodiscard]] ApplicationReturnStatus run() {
    if (!banner_printed && !current_settings().without_banner) print_banner();
    if (!current_settings().error.empty()) {
      return stop(Status::InvalidOption, current_settings().error);
    }
    // A copy: the model may change options while it is called.
    const SolverOptions options = current_settings().solver;
    if (current_settings().list_options)
      print(J_ERROR, J_MAIN, "\nList of user-set options:\n\n" + user_options_text(*list) + "\n");
    print_options_documentation();
    print_ignored_options();
    if (IsNull(model)) return stop(Status::InvalidProblem, "the model is null");

    // Taken out, so that an exception leaves nothing half made.
    std::unique_ptr<TnlpProblem> own = std::move(last_problem);
    const PlayerOptions& players = current_settings().players;
    model_is_known = own && own->is_of(model, players, options.hessian_approximation);
    if (!model_is_known) {
      if (auto error = ipopt_library_error(*model); !error.empty()) {
        return stop(Status::InvalidProblem, std::move(error));
      }
      own = std::make_unique<TnlpProblem>(model, players, options.hessian_approximation);
    }
    try {
      if (auto error = own->load(); !error.empty()) {
        const ApplicationReturnStatus status = stop(Status::InvalidProblem, std::move(error));
        return own->has_no_jacobian() ? Unrecoverable_Exception : status;  // as in Ipopt
      }
    } catch (const Ipopt::OPTION_INVALID& error) {
      return stop(Status::InvalidOption, error.Message());
    }
    const ApplicationReturnStatus status = solve(*own, options);
    last_problem = std::move(own);
    return status;
  }

  [[nodiscard]] ApplicationReturnStatus solve(TnlpProblem& problem, const SolverOptions& options) {
    if (current_settings().rows.as_ipopt) print_linear_solver();
    print_made(J_WARNING, J_STATISTICS,
               [&] { return log::problem_statistics(problem.structure(), options); });
    remark_on_split(problem.structure(), options);
    try {
      if (options.derivative_test != DerivativeTest::None) {
        print(J_SUMMARY, J_NLP,
              log::derivative_test(test_derivatives(problem, options), problem.structure()));
      }
      if (options.minmax_starts > 1 || over_ranks || !current_settings().points_file.empty()) {
        result = solve_for_points(problem, options);
      } else {
        Audience audience{*this, problem, options};
        room.give_to(result);
        solver.solve(problem, options, audience.observer(), result);
      }
      if (!model_is_known) check_first_derivatives(problem, options, result);
      if (result.over_y.functions > 0 || result.over_x.made > 1) factors_known = false;
    } catch (...) {
      const ApplicationReturnStatus status = report_exception();
      if (problem.started()) {
        problem.finalize(
            status == Insufficient_Memory ? Ipopt::OUT_OF_MEMORY : Ipopt::INTERNAL_ERROR, result);
      }
      return status;
    }
    return finish(problem, options);
  }

  [[nodiscard]] ApplicationReturnStatus optimize() {
    room.take_from(result);
    points.clear();
    factors_known = false;
    told = 0;
    solved.reset();
    statistics = nullptr;
    system_seconds_before = system_seconds();
    ApplicationReturnStatus status = Internal_Error;
    try {
      try {
        set_console_level(current_settings().print_level);
        status = run();
      } catch (...) {
        status = report_exception();
      }
      journalist->FlushBuffer();
    } catch (const std::bad_alloc&) {  // not even for the report
      result.status = Status::OutOfMemory;
      status = Insufficient_Memory;
    }
    return status;
  }

  /// One solve at a time, and the application lives until it ends, whatever the model releases.
  [[nodiscard]] ApplicationReturnStatus optimize(const SmartPtr<Ipopt::TNLP>& of, bool keep,
                                                 bool by_all_ranks = false) {
    if (solving) {
      print(J_ERROR, J_MAIN, "A solve inside its own model's functions is refused.\n");
      return Invalid_Problem_Definition;
    }
    const SmartPtr<MinMaxApplication> alive =
        application.ReferenceCount() > 0 ? &application : nullptr;
    struct End {
      Implementation& here;
      ~End() { here.solving = here.over_ranks = here.silent = false; }
    } const end{*this};
    solving = true;
    model = of;
    if (!keep) solver.reset();
    if (by_all_ranks) {
      try {
        silent = join_ranks_for_starts().rank > 0;
      } catch (const SolverUnavailable& error) {
        result = {};
        return stop(Status::InvalidOption, error.what());
      }
      over_ranks = true;
    }
    return optimize();
  }
};

// --- Public methods
// -------------------------------------------------------------------------------

MinMaxApplication::MinMaxApplication(bool create_console_out, bool create_empty)
    : implementation_(
          std::make_unique<Implementation>(*this, create_console_out && !create_empty)) {}

MinMaxApplication::MinMaxApplication(const SmartPtr<RegisteredOptions>& registry,
                                     const SmartPtr<OptionsList>& options,
                                     const SmartPtr<Ipopt::Journalist>& journalist)
    : implementation_(std::make_unique<Implementation>(*this, false)) {
  implementation_->registry = registry;
  implementation_->list = options;
  implementation_->journalist = journalist;
}

MinMaxApplication::~MinMaxApplication() = default;

SmartPtr<MinMaxApplication> MinMaxApplication::clone() const {
  const SmartPtr<ExactOptionsList> options =
      new ExactOptionsList(implementation_->registry, implementation_->journalist);
  options->copy(*implementation_->list);
  return new MinMaxApplication(implementation_->registry, GetRawPtr(options),
                               implementation_->journalist);
}

void MinMaxApplication::RegisterAllIpoptOptions(const SmartPtr<RegisteredOptions>& registry) {
  register_options(*registry);
}

void MinMaxApplication::RegisterOptions(const SmartPtr<RegisteredOptions>& registry) {
  register_options(*registry);
}

ApplicationReturnStatus MinMaxApplication::Initialize(bool allow_clobber) {
  std::string file_name;
  const bool is_set = get_option(*implementation_->list, "option_file_name", file_name);
  // print_level may have been set by now.
  implementation_->set_console_level(print_level(*implementation_->list));
  if (!file_name.empty() && file_name != "ipminmax.opt") {
    implementation_->print(J_SUMMARY, J_MAIN, "Using option file \"" + file_name + "\".\n\n");
  }
  return implementation_->initialize_from_file(file_name, allow_clobber, is_set);
}

ApplicationReturnStatus MinMaxApplication::Initialize(const std::string& options_file,
                                                      bool allow_clobber) {
  return implementation_->initialize_from_file(options_file, allow_clobber, true);
}

ApplicationReturnStatus MinMaxApplication::Initialize(const char* options_file,
                                                      bool allow_clobber) {
  return Initialize(std::string(options_file != nullptr ? options_file : ""), allow_clobber);
}

ApplicationReturnStatus MinMaxApplication::Initialize(std::istream& options, bool allow_clobber) {
  return implementation_->initialize(options, "options", allow_clobber);
}

SmartPtr<OptionsList> MinMaxApplication::Options() { return implementation_->list; }

SmartPtr<const OptionsList> MinMaxApplication::Options() const {
  return ConstPtr(implementation_->list);
}

SmartPtr<Ipopt::Journalist> MinMaxApplication::Jnlst() { return implementation_->journalist; }

SmartPtr<RegisteredOptions> MinMaxApplication::RegOptions() {
  static_cast<void>(implementation_->registry->RegisteredOptionsList());  // all are in it
  return implementation_->registry;
}

ApplicationReturnStatus MinMaxApplication::OptimizeTNLP(const SmartPtr<Ipopt::TNLP>& model) {
  return implementation_->optimize(model, false);
}

ApplicationReturnStatus MinMaxApplication::OptimizeTNLPOverRanks(
    const SmartPtr<Ipopt::TNLP>& model) {
  return implementation_->optimize(model, false, true);
}

ApplicationReturnStatus MinMaxApplication::ReOptimizeTNLP(const SmartPtr<Ipopt::TNLP>& model) {
  if (IsNull(implementation_->model)) {
    THROW_EXCEPTION(Ipopt::INVALID_WARMSTART, "ReOptimizeTNLP called before OptimizeTNLP.");
  }
  if (GetRawPtr(model) != GetRawPtr(implementation_->model)) {
    THROW_EXCEPTION(Ipopt::INVALID_WARMSTART, "ReOptimizeTNLP called for different TNLP.");
  }
  return implementation_->optimize(model, true);
}

ApplicationReturnStatus MinMaxApplication::OptimizeNLP(const SmartPtr<Ipopt::NLP>&) {
  implementation_->result = {};
  implementation_->solved.reset();
  implementation_->statistics = nullptr;
  return implementation_->stop(Status::InvalidProblem,
                               "OptimizeNLP is not available: only a TNLP says which variables are "
                               "whose; OptimizeTNLP takes one");
}

ApplicationReturnStatus MinMaxApplication::OptimizeNLP(const SmartPtr<Ipopt::NLP>& nlp,
                                                       SmartPtr<Ipopt::AlgorithmBuilder>&) {
  return OptimizeNLP(nlp);
}

ApplicationReturnStatus MinMaxApplication::ReOptimizeNLP(const SmartPtr<Ipopt::NLP>& nlp) {
  return OptimizeNLP(nlp);
}

bool MinMaxApplication::GetCurrentIterate(Result& iterate, bool scaled) const {
  Implementation& here = *implementation_;
  if (!here.may_ask(scaled)) return false;
  iterate = here.current->at();
  if (scaled) scale(here.current->problem.structure(), *here.current_factors(), iterate);
  return true;
}

bool MinMaxApplication::GetCurrentViolations(Violations& violations, bool scaled) const {
  Implementation& here = *implementation_;
  if (!here.may_ask(scaled)) return false;
  Implementation::Current& current = *here.current;
  auto found = violations_at(current.problem, current.at(), current.options,
                             scaled ? here.current_factors() : nullptr);
  if (!found || !is_finite(*found)) return false;
  violations = std::move(*found);
  return true;
}

const Result& MinMaxApplication::LastResult() const { return implementation_->result; }

const std::vector<RobustWorstCase>& MinMaxApplication::LastWorstCases() const {
  return implementation_->result.worst_cases;
}

const std::vector<DistinctPoint>& MinMaxApplication::LastPoints() const {
  return implementation_->points;
}

std::string MinMaxApplication::UpdateSensitivity(Sensitivity& sensitivity) const {
  const Implementation& here = *implementation_;
  if (IsNull(here.model)) return "nothing has been solved";
  if (std::ranges::count_if(here.result.worst_cases, [&](const RobustWorstCase& c) {
        return c.active && c.constraint == static_cast<Index>(here.result.lambda.size());
      }) > 1) {
    return "the answer is a kink of max over y, where several worst cases of f share the value: it "
           "has no derivatives there";
  }
  SolverOptions options;
  if (auto error = solver_options(*here.list, options); !error.empty()) return error;
  TnlpProblem problem(here.model, player_options(*here.list));
  if (auto error = problem.load(); !error.empty()) return error;
  return sensitivity.update(problem, here.result, options);
}

namespace {

/// Loads the model and asks about it; returns why that cannot be done, empty when it was.
template <class Ask>
std::string ask_about(const SmartPtr<Ipopt::TNLP>& model, const OptionsList& list, const Ask& ask) {
  if (IsNull(model)) return "the model is null";
  SolverOptions options;
  if (auto error = solver_options(list, options); !error.empty()) return error;
  if (auto error = ipopt_library_error(*model); !error.empty()) return error;
  TnlpProblem problem(model, player_options(list), options.hessian_approximation);
  if (auto error = problem.load(); !error.empty()) return error;
  try {
    ask(problem, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

}  // namespace

std::string MinMaxApplication::CheckWorstCase(const SmartPtr<Ipopt::TNLP>& model,
                                              std::span<const double> v, Index starts,
                                              WorstCaseCheck& check) const {
  if (starts < 1) return "a worst case is looked for from at least one start";
  return ask_about(model, *implementation_->list,
                   [&](Problem& problem, const SolverOptions& options) {
                     check = check_worst_case(problem, v, options, starts);
                   });
}

std::string MinMaxApplication::FindGap(const SmartPtr<Ipopt::TNLP>& model,
                                       std::span<const double> v, DualityGap& gap) const {
  return ask_about(model, *implementation_->list,
                   [&](Problem& problem, const SolverOptions& options) {
                     gap = duality_gap(problem, v, options);
                   });
}

SmartPtr<MinMaxStatistics> MinMaxApplication::Statistics() const {
  Implementation& here = *implementation_;
  if (here.solved && IsNull(here.statistics)) {
    here.statistics = new MinMaxStatistics(here.result, *here.solved);
  }
  return here.statistics;
}

bool MinMaxApplication::OpenOutputFile(const std::string& file_name, EJournalLevel print_level,
                                       bool append) {
  return implementation_->open_output_file(file_name, print_level, append);
}

void MinMaxApplication::PrintCopyrightMessage() { implementation_->print_banner(); }

bool MinMaxApplication::RethrowNonIpoptException(bool dorethrow) {
  return std::exchange(implementation_->rethrow, dorethrow);
}

// --- What models ask in their callback
// ------------------------------------------------------------

bool get_current_iterate(bool scaled, Index n, double* x, double* z_L, double* z_U, Index m,
                         double* g, double* lambda) {
  Result here;
  if (calling == nullptr || !calling->GetCurrentIterate(here, scaled)) return false;
  if (here.v.size() != at(n) || here.constraints.size() != at(m)) {
    return false;
  }
  fill({x, z_L, z_U, g, lambda}, here);
  return true;
}

bool get_current_violations(bool scaled, Index n, double* x_L_violation, double* x_U_violation,
                            double* compl_x_L, double* compl_x_U, double* grad_lag_x, Index m,
                            double* nlp_constraint_violation, double* compl_g) {
  Violations found;
  if (calling == nullptr || !calling->GetCurrentViolations(found, scaled)) return false;
  if (found.lower_bound.size() != at(n) || found.constraint.size() != at(m)) {
    return false;
  }
  fill({x_L_violation, x_U_violation, compl_x_L, compl_x_U, grad_lag_x, nlp_constraint_violation,
        compl_g},
       found);
  return true;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
