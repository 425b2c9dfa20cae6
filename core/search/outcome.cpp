#include <utility>

#include "core/model/status_table.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {

bool search_failed(Status status) { return row_of(status).group == StatusRow::Group::Failure; }

bool stopped_from_outside(Status status) {
  return status == Status::UserStop || status == Status::MaxCpuTime ||
         status == Status::MaxWallTime || status == Status::OutOfMemory;
}

SearchOutcome better(SearchOutcome earlier, SearchOutcome later) {
  if (is_success(later.status) || later.status == Status::UserStop) return later;
  return is_success(earlier.status) || search_failed(later.status) ? std::move(earlier)
                                                                   : std::move(later);
}

}  // namespace ipminmax
