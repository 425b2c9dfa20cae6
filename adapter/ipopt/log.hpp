#pragma once

#include <chrono>
#include <string>

#include "../../core/diagnostics/derivative_test.hpp"
#include "../../core/multistart.hpp"
#include "../../core/options.hpp"
#include "../../core/problem.hpp"
#include "../../core/result.hpp"
#include "../../core/robust.hpp"
#include "../../core/solver.hpp"

/// @file
/// The texts of the console log, in Ipopt's layout. Plain ASCII; every text ends with a line end.
namespace ipminmax::log {

/// As std::printf prints it.
[[nodiscard, gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Name, version and licence of the program.
[[nodiscard]] std::string banner();

/// Sizes of the problem per player. Bounds count as absent outside the options'
/// (nlp_lower_bound_inf, nlp_upper_bound_inf).
[[nodiscard]] std::string problem_statistics(const ProblemStructure& structure,
                                             const SolverOptions& options);

/// What the derivative test found: one line per wrong entry (* in front) or, with
/// derivative_test_print_all, per entry.
[[nodiscard]] std::string derivative_test(const DerivativeReport& report,
                                          const ProblemStructure& structure);

/// Headings of the iteration table:
///   iter       iteration, 0 is the starting point
///   objective  f, unscaled
///   inf_pr     violation of constraints and bounds
///   inf_dx     gradient of the Lagrangian in the Min variables
///   inf_dy     gradient of the Lagrangian in the Max variables
///   lg(mu)     log10 of the barrier parameter
///   ||d||      primal step
///   lg(rgx)    log10 of the Hessian shift of the Min variables
///   lg(rgy)    log10 of the Hessian shift of the Max variables
///   alpha_du   step length of the bound multipliers
///   alpha_pr   step length of everything else, with one letter for the kind of step
///   ls         trial points of the line search
/// Norms are infinity norms, unscaled. A dash stands where nothing was done.
[[nodiscard]] std::string iteration_header();

/// One line of the iteration table. with_info: ends with the factorizations of K and of K_yy since
/// the iteration before, as "K 1 Kyy 3" (print_info_string).
[[nodiscard]] std::string iteration_row(const IterationInfo& info, bool with_info = false);

/// The same in Ipopt's ten columns, for programs that read its log (print_ipopt_log). inf_du and
/// lg(rg) are the larger of both players'. The letter is one of Ipopt's, or n if Ipopt has none for
/// this step. An r after the row's number, from 0, marks a restoration.
[[nodiscard]] std::string ipopt_iteration_header();
[[nodiscard]] std::string ipopt_iteration_row(const IterationInfo& info, Index number);

/// The final errors as Ipopt prints them. Both columns are unscaled, but for the last line's first:
/// the scaled overall error.
[[nodiscard]] std::string ipopt_errors(const Result& result);

/// Headings of the table of a multistart:
///   start      0 is the model's starting point
///   objective  f at its end, unscaled
///   error      overall scaled error
///   iter       iterations
///   cert       "yes": certified local minmax
///   status     why it ended
[[nodiscard]] std::string start_header();

/// One line of that table.
[[nodiscard]] std::string start_row(Index start, const Result& result);

/// How far a multistart is: "Multistart: 12 of 100 starts, 9 certified, best value ..., 34 s left",
/// without line end.
class StartsProgress {
 public:
  /// larger_is_better: a maximization.
  StartsProgress(Index starts, bool larger_is_better)
      : starts_(starts), larger_is_better_(larger_is_better) {}
  void add(const Result& result);
  [[nodiscard]] std::string line() const;
  /// Seconds since line() was last due, or since the beginning.
  [[nodiscard]] bool due(double seconds);
  [[nodiscard]] bool complete() const { return done_ >= starts_; }

 private:
  using Clock = std::chrono::steady_clock;
  Index starts_, done_ = 0, certified_ = 0;
  bool larger_is_better_;
  double best_ = 0.0;
  Clock::time_point begin_ = Clock::now(), last_ = begin_;
};

/// Distinct certified points, smallest local minmax value first, and how often each status
/// occurred.
[[nodiscard]] std::string multistart_summary(const MultistartResult& result);

/// "y = 0.5, w = -1": the first few of the Max variables that say where a worst case is.
[[nodiscard]] std::string place_of(const RobustWorstCase& found, const ProblemStructure& structure);

/// The worst cases of robust constraints: constraint, its value there, multiplier, place, and how
/// far the search over y has come.
[[nodiscard]] std::string robust_summary(const Result& result, const ProblemStructure& structure);

/// Objective and errors at the returned point, then the certificate. iterations: those that
/// count.
[[nodiscard]] std::string summary(const Result& result, const ProblemStructure& structure,
                                  Index iterations);

/// Numbers of evaluations, factorizations and solves, and the time used.
[[nodiscard]] std::string work(const Result& result);

/// The same with Ipopt's names, equations and inequalities apart, for programs that read its log
/// (print_ipopt_log). The times have the names of the Ipopt that this was built with.
[[nodiscard]] std::string ipopt_work(const Result& result, const ProblemStructure& structure);

/// Seconds by stage.
[[nodiscard]] std::string timing(const Timing& timing);

/// The last line, "EXIT: ...": what the returned point is, in words, and the core's message when
/// that says more.
[[nodiscard]] std::string exit_line(const Result& result);
/// The same after Ipopt's words for that end.
[[nodiscard]] std::string ipopt_exit_line(const Result& result);

/// "This is ..., running with linear solver mumps.", which programs look for in Ipopt's log.
[[nodiscard]] std::string ipopt_solver_line(const std::string& linear_solver);

}  // namespace ipminmax::log
