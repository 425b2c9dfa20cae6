// Ipopt's return values for every status of the core, and the version in the adapter's names.
#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <typeinfo>
#include <vector>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/status.hpp"

namespace ipminmax {
namespace {

TEST(Status, MapsToIpopt) {
  using S = Status;
  using Row = std::tuple<S, Ipopt::ApplicationReturnStatus, Ipopt::SolverReturn>;
  const std::vector<Row> rows = {
    {S::InternalError, Ipopt::Internal_Error, Ipopt::INTERNAL_ERROR},
    {S::Solved, Ipopt::Solve_Succeeded, Ipopt::SUCCESS},
    {S::SolvedDegenerate, Ipopt::Solve_Succeeded, Ipopt::SUCCESS},
    {S::SolvedToAcceptableLevel, Ipopt::Solved_To_Acceptable_Level,
     Ipopt::STOP_AT_ACCEPTABLE_POINT},
    {S::NotLocalMinmax, Ipopt::Search_Direction_Becomes_Too_Small, Ipopt::STOP_AT_TINY_STEP},
    {S::NoLocalMinmaxFound, Ipopt::Search_Direction_Becomes_Too_Small, Ipopt::STOP_AT_TINY_STEP},
    {S::InnerUnbounded, Ipopt::Diverging_Iterates, Ipopt::DIVERGING_ITERATES},
    {S::OuterUnbounded, Ipopt::Diverging_Iterates, Ipopt::DIVERGING_ITERATES},
    {S::DivergingIterates, Ipopt::Diverging_Iterates, Ipopt::DIVERGING_ITERATES},
    {S::LocallyInfeasible, Ipopt::Infeasible_Problem_Detected, Ipopt::LOCAL_INFEASIBILITY},
    {S::InnerInfeasible, Ipopt::Infeasible_Problem_Detected, Ipopt::LOCAL_INFEASIBILITY},
    {S::MaxIterations, Ipopt::Maximum_Iterations_Exceeded, Ipopt::MAXITER_EXCEEDED},
    {S::MaxCpuTime, Ipopt::Maximum_CpuTime_Exceeded, Ipopt::CPUTIME_EXCEEDED},
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
    {S::MaxWallTime, Ipopt::Maximum_WallTime_Exceeded, Ipopt::WALLTIME_EXCEEDED},
#else
    {S::MaxWallTime, Ipopt::Maximum_CpuTime_Exceeded, Ipopt::CPUTIME_EXCEEDED},
#endif
    {S::TinyStep, Ipopt::Search_Direction_Becomes_Too_Small, Ipopt::STOP_AT_TINY_STEP},
    {S::RestorationFailed, Ipopt::Restoration_Failed, Ipopt::RESTORATION_FAILURE},
    {S::InertiaCorrectionFailed, Ipopt::Error_In_Step_Computation,
     Ipopt::ERROR_IN_STEP_COMPUTATION},
    {S::LinearSolverFailed, Ipopt::Error_In_Step_Computation, Ipopt::ERROR_IN_STEP_COMPUTATION},
    {S::EvaluationFailed, Ipopt::Invalid_Number_Detected, Ipopt::INVALID_NUMBER_DETECTED},
    {S::InvalidNumber, Ipopt::Invalid_Number_Detected, Ipopt::INVALID_NUMBER_DETECTED},
    {S::UserStop, Ipopt::User_Requested_Stop, Ipopt::USER_REQUESTED_STOP},
    {S::InvalidProblem, Ipopt::Invalid_Problem_Definition, Ipopt::INTERNAL_ERROR},
    {S::InvalidOption, Ipopt::Invalid_Option, Ipopt::INVALID_OPTION},
    {S::TooFewDegreesOfFreedom, Ipopt::Not_Enough_Degrees_Of_Freedom,
     Ipopt::TOO_FEW_DEGREES_OF_FREEDOM},
    {S::OutOfMemory, Ipopt::Insufficient_Memory, Ipopt::OUT_OF_MEMORY},
    {S::WorstCaseNotMet, Ipopt::Search_Direction_Becomes_Too_Small, Ipopt::STOP_AT_TINY_STEP}
  };
  // The last status closes the list: a new one must get a row.
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(S::WorstCaseNotMet) + 1);
  for (const auto& [status, application, solver] : rows) {
    EXPECT_EQ(application_status(status), application) << name_of(status);
    EXPECT_EQ(solver_return(status), solver) << name_of(status);
    // Solve_Succeeded and Solved_To_Acceptable_Level are Ipopt's two successes.
    EXPECT_EQ(is_success(status), application == 0 || application == 1) << name_of(status);
  }
}

// Objects compiled against different Ipopt versions must not link.
TEST(Abi, NamesCarryTheIpoptVersion) {
  const std::string tag =
      "ipopt_" + std::to_string(IPOPT_VERSION_MAJOR) + "_" + std::to_string(IPOPT_VERSION_MINOR);
  for (const std::type_info* type :
       {&typeid(MinMaxTNLP), &typeid(SplitTNLP), &typeid(MinMaxApplication),
        &typeid(&MinMaxTNLP::get_constraint_players), &typeid(MinMaxStatistics)}) {
    EXPECT_NE(std::string(type->name()).find(tag), std::string::npos) << type->name();
  }
}

}  // namespace
}  // namespace ipminmax
