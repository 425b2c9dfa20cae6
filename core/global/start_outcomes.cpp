#include "core/global/start_outcomes.hpp"

#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/search/random_starts.hpp"

namespace ipminmax {
namespace {}  // namespace

void StartOutcomes::add(Index start, Result&& result) {
  ++statuses_[result.status];
  add_work(result);
  if (result.certificate.kind == PointKind::LocalMinmax) {
    certified_.emplace(start, std::move(result));
    return;
  }
  if (start < parameters::kRoom && !result.v.empty() && all_finite(result.v)) {
    uncertified_.emplace(start, Uncertified{result.v, result.objective});
  }
  // Equal ranks go to the earlier start, in whatever order they end.
  auto& [best_start, best] = best_uncertified_;
  if (best_start < 0 || better(result, best) || (!better(best, result) && start < best_start)) {
    best_uncertified_ = {start, std::move(result)};
  }
}

void StartOutcomes::add_work(const Result& part) { ipminmax::add_work(part, work_); }

void StartOutcomes::add_work(const Counts& part) {
  Result only;
  only.counts = part;
  add_work(only);
}

std::vector<std::pair<Index, Result>> StartOutcomes::take_certified() {
  std::vector<std::pair<Index, Result>> taken;
  for (const bool solved : {true, false}) {
    for (auto& [start, result] : certified_) {
      if ((result.status == Status::Solved) == solved) taken.emplace_back(start, std::move(result));
    }
  }
  certified_.clear();
  return taken;
}

std::pair<Index, Result> StartOutcomes::take_best_uncertified() {
  return std::exchange(best_uncertified_, {-1, {}});
}

}  // namespace ipminmax
