#include "adapter/status.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
constexpr auto kWallTimeStatus = Ipopt::Maximum_WallTime_Exceeded;
constexpr auto kWallTimeReturn = Ipopt::WALLTIME_EXCEEDED;
#else
constexpr auto kWallTimeStatus = Ipopt::Maximum_CpuTime_Exceeded;
constexpr auto kWallTimeReturn = Ipopt::CPUTIME_EXCEEDED;
#endif

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
      return kWallTimeStatus;
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
  switch (status) {
    case Status::Solved:
    case Status::SolvedDegenerate:
      return Ipopt::SUCCESS;
    case Status::SolvedToAcceptableLevel:
      return Ipopt::STOP_AT_ACCEPTABLE_POINT;
    case Status::NotLocalMinmax:
    case Status::NoLocalMinmaxFound:
    case Status::WorstCaseNotMet:
    case Status::TinyStep:
      return Ipopt::STOP_AT_TINY_STEP;
    case Status::InnerUnbounded:
    case Status::OuterUnbounded:
    case Status::DivergingIterates:
      return Ipopt::DIVERGING_ITERATES;
    case Status::LocallyInfeasible:
    case Status::InnerInfeasible:
      return Ipopt::LOCAL_INFEASIBILITY;
    case Status::MaxIterations:
      return Ipopt::MAXITER_EXCEEDED;
    case Status::MaxCpuTime:
      return Ipopt::CPUTIME_EXCEEDED;
    case Status::MaxWallTime:
      return kWallTimeReturn;
    case Status::RestorationFailed:
      return Ipopt::RESTORATION_FAILURE;
    case Status::InertiaCorrectionFailed:
    case Status::LinearSolverFailed:
      return Ipopt::ERROR_IN_STEP_COMPUTATION;
    case Status::EvaluationFailed:
    case Status::InvalidNumber:
      return Ipopt::INVALID_NUMBER_DETECTED;
    case Status::UserStop:
      return Ipopt::USER_REQUESTED_STOP;
    case Status::InvalidOption:
      return Ipopt::INVALID_OPTION;
    case Status::TooFewDegreesOfFreedom:
      return Ipopt::TOO_FEW_DEGREES_OF_FREEDOM;
    case Status::OutOfMemory:
      return Ipopt::OUT_OF_MEMORY;
    case Status::InvalidProblem:
    case Status::InternalError:
      return Ipopt::INTERNAL_ERROR;
  }
  return Ipopt::INTERNAL_ERROR;
}

std::string_view name_of(Ipopt::ApplicationReturnStatus status) {
  switch (static_cast<int>(status)) {  // Ipopt 3.11 and 3.14 have different enumerators
    case Ipopt::Solve_Succeeded:
      return "Solve_Succeeded";
    case Ipopt::Solved_To_Acceptable_Level:
      return "Solved_To_Acceptable_Level";
    case Ipopt::Infeasible_Problem_Detected:
      return "Infeasible_Problem_Detected";
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return "Search_Direction_Becomes_Too_Small";
    case Ipopt::Diverging_Iterates:
      return "Diverging_Iterates";
    case Ipopt::User_Requested_Stop:
      return "User_Requested_Stop";
    case Ipopt::Feasible_Point_Found:
      return "Feasible_Point_Found";
    case Ipopt::Maximum_Iterations_Exceeded:
      return "Maximum_Iterations_Exceeded";
    case Ipopt::Restoration_Failed:
      return "Restoration_Failed";
    case Ipopt::Error_In_Step_Computation:
      return "Error_In_Step_Computation";
    case Ipopt::Maximum_CpuTime_Exceeded:
      return "Maximum_CpuTime_Exceeded";
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
    case Ipopt::Maximum_WallTime_Exceeded:
      return "Maximum_WallTime_Exceeded";
#endif
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return "Not_Enough_Degrees_Of_Freedom";
    case Ipopt::Invalid_Problem_Definition:
      return "Invalid_Problem_Definition";
    case Ipopt::Invalid_Option:
      return "Invalid_Option";
    case Ipopt::Invalid_Number_Detected:
      return "Invalid_Number_Detected";
    case Ipopt::Unrecoverable_Exception:
      return "Unrecoverable_Exception";
    case Ipopt::NonIpopt_Exception_Thrown:
      return "NonIpopt_Exception_Thrown";
    case Ipopt::Insufficient_Memory:
      return "Insufficient_Memory";
    case Ipopt::Internal_Error:
      return "Internal_Error";
    default:
      return "unknown";
  }
}

bool has_iterate(Status status) {
  return status != Status::InvalidProblem && status != Status::InvalidOption &&
         status != Status::TooFewDegreesOfFreedom;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
