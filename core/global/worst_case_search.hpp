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
  /// Where a search begins.
  struct From {
    const std::vector<double>& v;
    Index starts;
    const WorstCases& known;
  };
  /// What the search of one side uses, which no other thread does.
  struct Own {
    Problem& form;  ///< the solved one, or a clone of it
    Result& work;
    Witnesses& witnesses;
  };

  [[nodiscard]] bool have_clones(std::size_t threads);
  [[nodiscard]] MaximaOverY maximize(const RobustBound& bound, const From& from,
                                     const Own& own) const;
  [[nodiscard]] MaximaOverY maximize_in(const RobustScope& scope, const RobustBound& of,
                                        const From& from, const Own& own) const;

  RobustProgram& program_;
  std::vector<RobustWorstCase> followed_;
  Index searches_ = 0;                            ///< made
  std::vector<std::unique_ptr<Problem>> clones_;  ///< of the solved form, one for each thread
  Workers workers_;
};

}  // namespace ipminmax
