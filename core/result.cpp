#include "core/result.hpp"

namespace ipminmax {

std::string_view name_of(Status status) {
  switch (status) {
    case Status::InternalError:
      return "internal error";
    case Status::Solved:
      return "solved";
    case Status::SolvedDegenerate:
      return "solved, second-order test undecided";
    case Status::SolvedToAcceptableLevel:
      return "solved to acceptable level";
    case Status::NotLocalMinmax:
      return "first-order point, not a local minmax";
    case Status::NoLocalMinmaxFound:
      return "no local minmax found";
    case Status::InnerUnbounded:
      return "maximization looks unbounded";
    case Status::OuterUnbounded:
      return "minimization looks unbounded";
    case Status::DivergingIterates:
      return "iterates diverge";
    case Status::LocallyInfeasible:
      return "locally infeasible";
    case Status::InnerInfeasible:
      return "maximizer's constraints cannot be met";
    case Status::MaxIterations:
      return "maximum number of iterations";
    case Status::MaxCpuTime:
      return "maximum CPU time";
    case Status::MaxWallTime:
      return "maximum wall time";
    case Status::TinyStep:
      return "steps became too small";
    case Status::RestorationFailed:
      return "restoration failed";
    case Status::InertiaCorrectionFailed:
      return "inertia correction failed";
    case Status::LinearSolverFailed:
      return "linear solver failed";
    case Status::EvaluationFailed:
      return "evaluation failed";
    case Status::InvalidNumber:
      return "invalid number from the model";
    case Status::UserStop:
      return "stopped by the user";
    case Status::InvalidProblem:
      return "invalid problem definition";
    case Status::InvalidOption:
      return "invalid option";
    case Status::TooFewDegreesOfFreedom:
      return "too few degrees of freedom";
    case Status::OutOfMemory:
      return "out of memory";
  }
  return "unknown";
}

bool is_success(Status status) {
  return status == Status::Solved || status == Status::SolvedDegenerate ||
         status == Status::SolvedToAcceptableLevel;
}

std::string_view name_of(PointKind kind) {
  switch (kind) {
    case PointKind::LocalMinmax:
      return "local minmax";
    case PointKind::FirstOrderPoint:
      return "first-order point";
    case PointKind::FeasiblePoint:
      return "feasible point";
    case PointKind::InfeasiblePoint:
      return "infeasible point";
    case PointKind::Unknown:
      return "unknown";
  }
  return "unknown";
}

std::string_view name_of(SecondOrder outcome) {
  switch (outcome) {
    case SecondOrder::NotTested:
      return "not tested";
    case SecondOrder::Satisfied:
      return "satisfied";
    case SecondOrder::Undecided:
      return "undecided";
    case SecondOrder::Violated:
      return "violated";
    case SecondOrder::Flat:
      return "flat";
  }
  return "unknown";
}

std::string_view name_of(InnerAnswer answer) {
  switch (answer) {
    case InnerAnswer::Unknown:
      return "unknown";
    case InnerAnswer::StrictlyBest:
      return "strictly best to this x";
    case InnerAnswer::Unique:
      return "unique near this x";
    case InnerAnswer::Smooth:
      return "smooth in x";
  }
  return "unknown";
}

}  // namespace ipminmax
