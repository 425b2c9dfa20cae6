#pragma once

#include <compare>

#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// How good a point is for one who has to make do with it. Less is better.
struct PointRank {
  /// Of a minimization: not within the tolerances, with a gradient of the Lagrangian far below
  /// dual_inf_tol in the model's units.
  bool is_unmet = true;
  double violation = 0.0;  ///< of the model's constraints, at least constr_viol_tol
  double value = 0.0;      ///< of a minimization the objective, else the first-order error
  double error = 0.0;      ///< of first order

  auto operator<=>(const PointRank&) const = default;
};

/// Of a measured point. What is NaN ranks last.
[[nodiscard]] PointRank rank_of(const CanonicalProblem& canonical, const SolverOptions& options,
                                const Point& point);

/// The best point that the searches of a solve have seen, for the case that they fail.
struct BestPoint {
  bool any = false;  ///< have seen one; else the point is room for it
  PointRank rank;
  Point point;
  double mu = 0.0;
  Index iteration = 0;

  /// Takes the point where it is the best so far.
  void see(const PointRank& its_rank, const Point& its_point, double its_mu, Index its_iteration);
};

}  // namespace ipminmax
