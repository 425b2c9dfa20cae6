#include "core/result.hpp"

namespace ipminmax {

Timing& Timing::operator+=(const Timing& part) {
  evaluations += part.evaluations;
  assembly += part.assembly;
  analysis += part.analysis;
  factorization += part.factorization;
  solves += part.solves;
  return *this;
}

Counts& Counts::operator+=(const Counts& part) {
  objective += part.objective;
  gradient += part.gradient;
  constraints += part.constraints;
  jacobian += part.jacobian;
  hessian += part.hessian;
  factorizations_full += part.factorizations_full;
  factorizations_inner += part.factorizations_inner;
  factorizations_complement += part.factorizations_complement;
  for (std::size_t cause = 0; cause < kFactorizationCauses; ++cause) {
    by_cause[cause].full += part.by_cause[cause].full;
    by_cause[cause].inner += part.by_cause[cause].inner;
  }
  solves += part.solves;
  analyses += part.analyses;
  instability_raises += part.instability_raises;
  restoration_iterations += part.restoration_iterations;
  return *this;
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

std::string_view name_of(FactorizationCause cause) {
  switch (cause) {
    case FactorizationCause::Step:
      return "steps";
    case FactorizationCause::Shifts:
      return "other shifts";
    case FactorizationCause::TrialPoint:
      return "trial points";
    case FactorizationCause::InnerAscent:
      return "inner ascent";
    case FactorizationCause::Curvature:
      return "escapes";
    case FactorizationCause::Barrier:
      return "barrier parameter";
    case FactorizationCause::Multipliers:
      return "multipliers";
    case FactorizationCause::Certificate:
      return "certificate";
    case FactorizationCause::Restoration:
      return "restoration";
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
    case InnerAnswer::BestNotUnique:
      return "best, not unique";
  }
  return "unknown";
}

}  // namespace ipminmax
