#include <array>
#include <cstddef>

#include "core/model/status_table.hpp"

namespace ipminmax {
namespace {

using Group = StatusRow::Group;

/// In the order of the enumerators.
constexpr std::array kRows = {
    StatusRow{Status::InternalError, "internal error", "Internal error.", 510, Group::End,
              "report this with the model and the log"},
    StatusRow{Status::Solved, "solved", "Local Minmax Found.", 0, Group::Solution},
    StatusRow{Status::SolvedDegenerate, "solved, second-order test undecided",
              "First-order point found; the second-order test is undecided (degenerate point).", 1,
              Group::Solution},
    StatusRow{Status::SolvedToAcceptableLevel, "solved to acceptable level",
              "Solved To Acceptable Level.", 100, Group::Solution},
    StatusRow{Status::NotLocalMinmax, "first-order point, not a local minmax",
              "First-order point found, but it is not a local minmax.", 500, Group::Failure,
              "begin elsewhere, or make several starts (minmax_starts)"},
    StatusRow{Status::NoLocalMinmaxFound, "no local minmax found",
              "No local minmax found from this starting point.", 501, Group::Failure},
    StatusRow{Status::InnerUnbounded, "maximization looks unbounded",
              "The maximization over y looks unbounded.", 301, Group::Failure,
              "give y bounds, or check the sign of the objective"},
    StatusRow{Status::OuterUnbounded, "minimization looks unbounded",
              "The minimization over x looks unbounded.", 300, Group::Failure,
              "give x bounds, or check the sign of the objective"},
    StatusRow{Status::DivergingIterates, "iterates diverge",
              "Iterates diverging; problem might be unbounded.", 302, Group::Failure,
              "give the variables bounds, or check the sign of the objective"},
    StatusRow{Status::LocallyInfeasible, "locally infeasible",
              "Converged to a point of local infeasibility. Problem may be infeasible.", 200,
              Group::Failure,
              "check whether the constraints can be met, or begin elsewhere (minmax_starts)"},
    StatusRow{Status::InnerInfeasible, "maximizer's constraints cannot be met",
              "The maximizer's constraints cannot be met near the returned point. Problem may be "
              "infeasible.",
              201, Group::Failure,
              "check Max's constraints; give Min those that x must meet for every y"},
    StatusRow{Status::MaxIterations, "maximum number of iterations",
              "Maximum Number of Iterations Exceeded.", 400, Group::End,
              "raise the limit reached (max_iter, minmax_max_factorizations), or begin nearer the "
              "answer"},
    StatusRow{Status::MaxCpuTime, "maximum CPU time", "Maximum CPU time exceeded.", 401, Group::End,
              "raise max_cpu_time, or begin nearer to the answer"},
    StatusRow{Status::MaxWallTime, "maximum wall time", "Maximum wallclock time exceeded.", 402,
              Group::End, "raise max_wall_time, or begin nearer to the answer"},
    StatusRow{
        Status::TinyStep, "steps became too small", "Search Direction is becoming Too Small.", 510,
        Group::Failure,
        "check the derivatives (derivative_test second-order), or begin elsewhere (minmax_starts)"},
    StatusRow{Status::RestorationFailed, "restoration failed", "Restoration Failed!", 510,
              Group::Failure,
              "check the constraints and their derivatives (derivative_test), or begin elsewhere"},
    StatusRow{Status::InertiaCorrectionFailed, "inertia correction failed",
              "Error in step computation: no regularization gives the expected inertia.", 510,
              Group::Failure,
              "give the variables bounds, or check the derivatives (derivative_test second-order)"},
    StatusRow{Status::LinearSolverFailed, "linear solver failed",
              "Error in step computation: linear solver failed.", 510, Group::Failure,
              "choose another linear_solver"},
    StatusRow{Status::EvaluationFailed, "evaluation failed",
              "A function of the model could not be evaluated.", 503, Group::Failure,
              "begin where all functions are defined, and keep them defined by bounds"},
    StatusRow{Status::InvalidNumber, "invalid number from the model",
              "Invalid number in function or derivative detected.", 510, Group::Failure,
              "begin where all functions are finite, and keep them finite by bounds"},
    StatusRow{Status::UserStop, "stopped by the user",
              "Stopping optimization at current point as requested by user.", 403},
    StatusRow{Status::InvalidProblem, "invalid problem definition", "Invalid problem definition.",
              502},
    StatusRow{Status::InvalidOption, "invalid option", "Invalid option encountered."},
    StatusRow{Status::TooFewDegreesOfFreedom, "too few degrees of freedom",
              "Problem has too few degrees of freedom.", 510, Group::End,
              "give that player more variables or fewer equations"},
    StatusRow{Status::OutOfMemory, "out of memory", "Not enough memory."},
    StatusRow{Status::WorstCaseNotMet, "a worst case over y is not met",
              "The worst case over y is not met, or not known to be.", 504, Group::End,
              "make more starts over y (minmax_worst_case_starts), or begin elsewhere"}};

constexpr bool is_in_order() {
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    if (static_cast<std::size_t>(kRows[i].status) != i) return false;
  }
  return true;
}
static_assert(is_in_order() &&
              kRows.size() == static_cast<std::size_t>(Status::WorstCaseNotMet) + 1);

constexpr StatusRow kUnknown{Status::InternalError, "unknown", "Internal error."};

}  // namespace

const StatusRow& row_of(Status status) {
  const auto i = static_cast<std::size_t>(status);
  return i < kRows.size() ? kRows[i] : kUnknown;
}

std::string_view name_of(Status status) { return row_of(status).name; }

bool is_success(Status status) { return row_of(status).group == StatusRow::Group::Solution; }

}  // namespace ipminmax
