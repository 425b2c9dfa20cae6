#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "multistart.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// A local maximum over y of f(x, y) at fixed x.
struct WorstCaseMaximum {
  std::vector<double> v;   ///< n: x and the maximizing y
  double value = 0.0;      ///< f there
  bool certified = false;  ///< whether the second-order test shows that y is a local maximum
  Index found = 0;         ///< number of maximizations that ended here
};

/// What a search for the worst case over y at fixed x has found.
struct WorstCaseCheck {
  WorstCase found;                       ///< as in Result::worst_case
  std::vector<WorstCaseMaximum> maxima;  ///< distinct maxima, the largest value first
  std::optional<Status> interrupted;     ///< set if the observer or a time limit ended the search
};

/// Searches for the worst case over all of y at the x of v (n values). It maximizes f over y from
/// `starts` starting points (at least 1): the y of v, those of the given points (n values each),
/// then random ones as in multistart(). A certificate says that y is a local maximum; this search
/// looks for a higher one. The largest value found is a lower bound of max over y of f(x, y), not a
/// proof. Min's constraints do not restrict y and are left out.
///
/// The observer gets the iterations of all maximizations, as those of start 0. Limits of time hold
/// for the whole search, max_iter and tolerances for each maximization. Throws
/// std::invalid_argument if v has not n values or its x is not finite. Exceptions of the model pass
/// through.
[[nodiscard]] WorstCaseCheck check_worst_case(Problem& problem, std::span<const double> v,
                                              const SolverOptions& options, Index starts,
                                              const std::vector<std::vector<double>>& given = {},
                                              const MultistartObserver& observer = {});

/// Calls check_worst_case at result.v with minmax_worst_case_starts starts, and stores what it
/// found in result.worst_case. The default, -1, stands for 8 starts with minmax_epigraph or
/// minmax_worst_case_proof, otherwise for none. solve and multistart do the same themselves, but
/// with minmax_epigraph they search f as a robust constraint (-1: 3 to 100 starts). Does nothing
/// without starts, Max variables or a point, or if the factor of the objective is negative.
void add_worst_case(Problem& problem, const SolverOptions& options, Result& result,
                    const MultistartObserver& observer = {});

/// Returns result.worst_case in words, on one or more lines without a last line end; empty if there
/// was no search.
[[nodiscard]] std::string describe_worst_case(const Result& result);

}  // namespace ipminmax
