#pragma once

#include <memory>
#include <vector>

#include "core/global/robust_program.hpp"
#include "linalg/workers.hpp"

namespace ipminmax {

/// The worst-case searches of a robust program: each maximizes every bounded side of every robust
/// constraint over all of y at one x.
class WorstCaseSearch {
 public:
  explicit WorstCaseSearch(RobustProgram& program) : program_(program) {}

  /// At the x of v (n values), from so many starts of y for each side and from the known worst
  /// cases.
  [[nodiscard]] MaximaOfRows run(const std::vector<double>& v, Index starts,
                                 const WorstCases& known);

  /// Of each side the highest worst case of the last solve, from which alone the next searches
  /// begin, unless its full search is among the oldest: then it is searched fully.
  void follow(std::vector<RobustWorstCase> last);
  void follow_none() { followed_.clear(); }

 private:
  /// The search of one side: where it begins, and what no other thread uses.
  struct Side {
    const RobustBound& bound;
    const std::vector<double>& v;
    Index starts;
    const WorstCases& known;
    Problem& form;  ///< the solved one, or a clone of it
    Result& work;
    Witnesses& witnesses;
  };

  bool have_clones(std::size_t threads);
  MaximaOverY maximize(const Side& side) const;
  MaximaOverY maximize_in(const RobustScope& scope, const Side& of) const;

  RobustProgram& program_;
  std::vector<RobustWorstCase> followed_;
  Index searches_ = 0;                            ///< made
  std::vector<std::unique_ptr<Problem>> clones_;  ///< of the solved form, one for each thread
  Workers workers_;
};

}  // namespace ipminmax
