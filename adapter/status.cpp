#include <algorithm>
#include <array>

#include "adapter/status.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// What belongs together.
struct IpoptStatus {
  Ipopt::ApplicationReturnStatus status;
  Ipopt::SolverReturn returned;
  std::string_view name;
};

constexpr std::array kIpoptStatuses = std::to_array<IpoptStatus>({
  {Ipopt::Solve_Succeeded, Ipopt::SUCCESS, "Solve_Succeeded"},
      {Ipopt::Solved_To_Acceptable_Level, Ipopt::STOP_AT_ACCEPTABLE_POINT,
       "Solved_To_Acceptable_Level"},
      {Ipopt::Infeasible_Problem_Detected, Ipopt::LOCAL_INFEASIBILITY,
       "Infeasible_Problem_Detected"},
      {Ipopt::Search_Direction_Becomes_Too_Small, Ipopt::STOP_AT_TINY_STEP,
       "Search_Direction_Becomes_Too_Small"},
      {Ipopt::Diverging_Iterates, Ipopt::DIVERGING_ITERATES, "Diverging_Iterates"},
      {Ipopt::User_Requested_Stop, Ipopt::USER_REQUESTED_STOP, "User_Requested_Stop"},
      {Ipopt::Feasible_Point_Found, Ipopt::FEASIBLE_POINT_FOUND, "Feasible_Point_Found"},
      {Ipopt::Maximum_Iterations_Exceeded, Ipopt::MAXITER_EXCEEDED, "Maximum_Iterations_Exceeded"},
      {Ipopt::Restoration_Failed, Ipopt::RESTORATION_FAILURE, "Restoration_Failed"},
      {Ipopt::Error_In_Step_Computation, Ipopt::ERROR_IN_STEP_COMPUTATION,
       "Error_In_Step_Computation"},
      {Ipopt::Maximum_CpuTime_Exceeded, Ipopt::CPUTIME_EXCEEDED, "Maximum_CpuTime_Exceeded"},
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
      {Ipopt::Maximum_WallTime_Exceeded, Ipopt::WALLTIME_EXCEEDED, "Maximum_WallTime_Exceeded"},
#endif
      {Ipopt::Not_Enough_Degrees_Of_Freedom, Ipopt::TOO_FEW_DEGREES_OF_FREEDOM,
       "Not_Enough_Degrees_Of_Freedom"},
      {Ipopt::Invalid_Problem_Definition, Ipopt::INTERNAL_ERROR, "Invalid_Problem_Definition"},
      {Ipopt::Invalid_Option, Ipopt::INVALID_OPTION, "Invalid_Option"},
      {Ipopt::Invalid_Number_Detected, Ipopt::INVALID_NUMBER_DETECTED, "Invalid_Number_Detected"},
      {Ipopt::Unrecoverable_Exception, Ipopt::INTERNAL_ERROR, "Unrecoverable_Exception"},
      {Ipopt::NonIpopt_Exception_Thrown, Ipopt::INTERNAL_ERROR, "NonIpopt_Exception_Thrown"},
      {Ipopt::Insufficient_Memory, Ipopt::OUT_OF_MEMORY, "Insufficient_Memory"},
      {Ipopt::Internal_Error, Ipopt::INTERNAL_ERROR, "Internal_Error"},
});

}  // namespace

Ipopt::ApplicationReturnStatus application_status(Status status) {
  switch (status) {
    case Status::Solved:
    case Status::SolvedDegenerate:
      return Ipopt::Solve_Succeeded;
    case Status::SolvedToAcceptableLevel:
      return Ipopt::Solved_To_Acceptable_Level;
    case Status::NotLocalMinmax:
    case Status::NoLocalMinmaxFound:
    case Status::WorstCaseNotMet:
    case Status::TinyStep:
      return Ipopt::Search_Direction_Becomes_Too_Small;
    case Status::InnerUnbounded:
    case Status::OuterUnbounded:
    case Status::DivergingIterates:
      return Ipopt::Diverging_Iterates;
    case Status::LocallyInfeasible:
    case Status::InnerInfeasible:
      return Ipopt::Infeasible_Problem_Detected;
    case Status::MaxIterations:
      return Ipopt::Maximum_Iterations_Exceeded;
    case Status::MaxCpuTime:
      return Ipopt::Maximum_CpuTime_Exceeded;
    case Status::MaxWallTime:
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
      return Ipopt::Maximum_WallTime_Exceeded;
#else
      return Ipopt::Maximum_CpuTime_Exceeded;
#endif
    case Status::RestorationFailed:
      return Ipopt::Restoration_Failed;
    case Status::InertiaCorrectionFailed:
    case Status::LinearSolverFailed:
      return Ipopt::Error_In_Step_Computation;
    case Status::EvaluationFailed:
    case Status::InvalidNumber:
      return Ipopt::Invalid_Number_Detected;
    case Status::UserStop:
      return Ipopt::User_Requested_Stop;
    case Status::InvalidProblem:
      return Ipopt::Invalid_Problem_Definition;
    case Status::InvalidOption:
      return Ipopt::Invalid_Option;
    case Status::TooFewDegreesOfFreedom:
      return Ipopt::Not_Enough_Degrees_Of_Freedom;
    case Status::OutOfMemory:
      return Ipopt::Insufficient_Memory;
    case Status::InternalError:
      return Ipopt::Internal_Error;
  }
  return Ipopt::Internal_Error;
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
