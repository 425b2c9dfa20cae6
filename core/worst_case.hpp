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

/// A local maximum over y of f(x, y), x held.
struct WorstCaseMaximum {
  std::vector<double> v;   ///< n: x and the maximizing y
  double value = 0.0;      ///< f there
  bool certified = false;  ///< second-order test of the maximization passed
  Index found = 0;         ///< maximizations that ended here
};

/// What maximizing over y from many starts, x held, has found.
struct WorstCaseCheck {
  WorstCase found;                       ///< what a Result carries of it
  std::vector<WorstCaseMaximum> maxima;  ///< distinct ones, the largest value first
  std::optional<Status> interrupted;     ///< by the observer or a time limit
};

/// The worst case over all of y at the x of v, searched for from `starts` starting points of y (at
/// least 1): that of v, the given points' (n values each, their x is not read), then random ones as
/// in multistart(). A certified local minmax says that y is a local maximum at x; this asks whether
/// another branch of y is higher. What is found is a lower bound of max_y f(x, y), no proof that
/// nothing higher exists. Min constraints do not restrain y and are left out.
///
/// The observer is told of all maximizations in the name of start 0.
///
/// v: n values, x among them finite, else std::invalid_argument. Time limits hold for the whole
/// check, max_iter and tolerances for each maximization. Exceptions of the model pass through.
[[nodiscard]] WorstCaseCheck check_worst_case(Problem& problem, std::span<const double> v,
                                              const SolverOptions& options, Index starts,
                                              const std::vector<std::vector<double>>& given = {},
                                              const MultistartObserver& observer = {});

/// The check with minmax_worst_case_starts for a result that solve or multistart returned; kept in
/// result.worst_case; solve and multistart do it themselves. Nothing happens without Max variables,
/// without a point or where no starts are asked for.
void add_worst_case(Problem& problem, const SolverOptions& options, Result& result,
                    const MultistartObserver& observer = {});

/// One or more sentences about result.worst_case for people, without line end; empty when it was
/// not checked.
[[nodiscard]] std::string describe_worst_case(const Result& result);

}  // namespace ipminmax
