#pragma once

#include <map>
#include <utility>
#include <vector>

#include "core/multistart.hpp"

namespace ipminmax {

/// What the starts of a multistart left, in whatever order they ended; the answer is the best of
/// this list.
class StartOutcomes {
 public:
  /// A start that no certified point came of.
  struct Uncertified {
    std::vector<double> v;
    double objective;
  };

  /// Each start once.
  void add(Index start, Result&& result);
  /// Work that is no start's.
  void add_work(const Result& part);
  void add_work(const Counts& part);

  [[nodiscard]] bool has_certified() const { return !certified_.empty(); }
  /// By their starts. Of the first kRoom starts, whose y may be worse elsewhere.
  [[nodiscard]] const std::map<Index, Uncertified>& uncertified() const { return uncertified_; }
  /// Certified results in the order of their starts, those to full tolerance first: they stand for
  /// others to the acceptable level. The list has them no more.
  [[nodiscard]] std::vector<std::pair<Index, Result>> take_certified();
  /// Of results without certificate, the earlier start's among equals; start -1: there is none.
  [[nodiscard]] std::pair<Index, Result> take_best_uncertified();
  [[nodiscard]] const std::map<Status, Index>& statuses() const { return statuses_; }
  /// Iterations, factorizations, counts and times of all.
  [[nodiscard]] const Result& work() const { return work_; }

 private:
  std::map<Index, Result> certified_;
  std::map<Index, Uncertified> uncertified_;
  std::pair<Index, Result> best_uncertified_{-1, {}};
  std::map<Status, Index> statuses_;
  Result work_;
};

}  // namespace ipminmax
