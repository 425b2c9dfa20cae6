#include <algorithm>
#include <cmath>

#include "core/search/best_point.hpp"
#include "core/search/first_order_test.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

PointRank rank_of(const CanonicalProblem& canonical, const SolverOptions& options,
                  const Point& point) {
  const auto or_last = [](double value) { return std::isnan(value) ? kInfinity : value; };
  const bool minimization = canonical.max_size() == 0;
  constexpr double kOfTol = 1e-2;
  const bool is_met = minimization && is_within_tolerances(point.error, options) &&
                      point.error.dual_min <= kOfTol * options.dual_inf_tol;
  return {.is_unmet = !is_met,
          .violation = std::max(or_last(point.error.primal), options.constr_viol_tol),
          .value = or_last(minimization ? point.evaluation.f : point.error.total),
          .error = or_last(point.error.total)};
}

void BestPoint::see(const PointRank& its_rank, const Point& its_point, double its_mu,
                    Index its_iteration) {
  if (any && !(its_rank < rank)) return;
  any = true;
  rank = its_rank;
  point = its_point;
  mu = its_mu;
  iteration = its_iteration;
}

}  // namespace ipminmax
