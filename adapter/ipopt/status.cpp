#include <algorithm>
#include <array>

#include "adapter/ipopt/status.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// What belongs together.
struct IpoptStatus {
  Ipopt::ApplicationReturnStatus status;
  Ipopt::SolverReturn returned;
  std::string_view name;
};

constexpr auto kIpoptStatuses = [] {
  using enum Ipopt::ApplicationReturnStatus;
  using enum Ipopt::SolverReturn;
  return std::to_array<IpoptStatus>({
    {Solve_Succeeded, SUCCESS, "Solve_Succeeded"},
        {Solved_To_Acceptable_Level, STOP_AT_ACCEPTABLE_POINT, "Solved_To_Acceptable_Level"},
        {Infeasible_Problem_Detected, LOCAL_INFEASIBILITY, "Infeasible_Problem_Detected"},
        {Search_Direction_Becomes_Too_Small, STOP_AT_TINY_STEP,
         "Search_Direction_Becomes_Too_Small"},
        {Diverging_Iterates, DIVERGING_ITERATES, "Diverging_Iterates"},
        {User_Requested_Stop, USER_REQUESTED_STOP, "User_Requested_Stop"},
        {Feasible_Point_Found, FEASIBLE_POINT_FOUND, "Feasible_Point_Found"},
        {Maximum_Iterations_Exceeded, MAXITER_EXCEEDED, "Maximum_Iterations_Exceeded"},
        {Restoration_Failed, RESTORATION_FAILURE, "Restoration_Failed"},
        {Error_In_Step_Computation, ERROR_IN_STEP_COMPUTATION, "Error_In_Step_Computation"},
        {Maximum_CpuTime_Exceeded, CPUTIME_EXCEEDED, "Maximum_CpuTime_Exceeded"},
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
        {Maximum_WallTime_Exceeded, WALLTIME_EXCEEDED, "Maximum_WallTime_Exceeded"},
#endif
        {Not_Enough_Degrees_Of_Freedom, TOO_FEW_DEGREES_OF_FREEDOM,
         "Not_Enough_Degrees_Of_Freedom"},
        {Invalid_Problem_Definition, INTERNAL_ERROR, "Invalid_Problem_Definition"},
        {Invalid_Option, INVALID_OPTION, "Invalid_Option"},
        {Invalid_Number_Detected, INVALID_NUMBER_DETECTED, "Invalid_Number_Detected"},
        {Unrecoverable_Exception, INTERNAL_ERROR, "Unrecoverable_Exception"},
        {NonIpopt_Exception_Thrown, INTERNAL_ERROR, "NonIpopt_Exception_Thrown"},
        {Insufficient_Memory, OUT_OF_MEMORY, "Insufficient_Memory"},
        {Internal_Error, INTERNAL_ERROR, "Internal_Error"},
  });
}();

}  // namespace

Ipopt::ApplicationReturnStatus application_status(Status status) {
  using enum Ipopt::ApplicationReturnStatus;
  using enum Status;
  switch (status) {
    case Solved:
    case SolvedDegenerate:
      return Solve_Succeeded;
    case SolvedToAcceptableLevel:
      return Solved_To_Acceptable_Level;
    case NotLocalMinmax:
    case NoLocalMinmaxFound:
    case WorstCaseNotMet:
    case TinyStep:
      return Search_Direction_Becomes_Too_Small;
    case InnerUnbounded:
    case OuterUnbounded:
    case DivergingIterates:
      return Diverging_Iterates;
    case LocallyInfeasible:
    case InnerInfeasible:
      return Infeasible_Problem_Detected;
    case MaxIterations:
      return Maximum_Iterations_Exceeded;
    case MaxCpuTime:
      return Maximum_CpuTime_Exceeded;
    case MaxWallTime:
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
      return Maximum_WallTime_Exceeded;
#else
      return Maximum_CpuTime_Exceeded;
#endif
    case RestorationFailed:
      return Restoration_Failed;
    case InertiaCorrectionFailed:
    case LinearSolverFailed:
      return Error_In_Step_Computation;
    case EvaluationFailed:
    case InvalidNumber:
      return Invalid_Number_Detected;
    case UserStop:
      return User_Requested_Stop;
    case InvalidProblem:
      return Invalid_Problem_Definition;
    case InvalidOption:
      return Invalid_Option;
    case TooFewDegreesOfFreedom:
      return Not_Enough_Degrees_Of_Freedom;
    case OutOfMemory:
      return Insufficient_Memory;
    case InternalError:
      return Internal_Error;
  }
  return Internal_Error;
}

Ipopt::SolverReturn solver_return(Status status) {
  return std::ranges::find(kIpoptStatuses, application_status(status), &IpoptStatus::status)
      ->returned;
}

std::string_view name_of(Ipopt::ApplicationReturnStatus status) {
  const auto* const found = std::ranges::find(kIpoptStatuses, status, &IpoptStatus::status);
  return found != kIpoptStatuses.end() ? found->name : "unknown";
}

bool has_iterate(Status status) {
  return status != Status::InvalidProblem && status != Status::InvalidOption &&
         status != Status::TooFewDegreesOfFreedom;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
