#include <utility>

#include "core/search/outcome.hpp"

namespace ipminmax {

bool search_failed(Status status) {
  switch (status) {
    case Status::NotLocalMinmax:
    case Status::NoLocalMinmaxFound:
    case Status::InnerUnbounded:
    case Status::OuterUnbounded:
    case Status::DivergingIterates:
    case Status::LocallyInfeasible:
    case Status::InnerInfeasible:
    case Status::TinyStep:
    case Status::RestorationFailed:
    case Status::InertiaCorrectionFailed:
    case Status::LinearSolverFailed:
    case Status::EvaluationFailed:
    case Status::InvalidNumber:
      return true;
    default:
      return false;
  }
}

SearchOutcome better(SearchOutcome earlier, SearchOutcome later) {
  if (is_success(later.status) || later.status == Status::UserStop) return later;
  return is_success(earlier.status) || search_failed(later.status) ? std::move(earlier)
                                                                   : std::move(later);
}

}  // namespace ipminmax
