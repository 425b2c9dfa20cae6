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
class BestPoint {
 public:
  /// As one that has seen none; the point keeps its room.
  void begin_anew() { any_ = false; }
  /// Takes the point where it is the best so far.
  void see(const PointRank& rank, const Point& point, double mu, Index iteration);

  [[nodiscard]] const PointRank& rank() const { return rank_; }
  [[nodiscard]] const Point& point() const { return point_; }
  [[nodiscard]] double mu() const { return mu_; }
  [[nodiscard]] Index iteration() const { return iteration_; }

 private:
  bool any_ = false;
  PointRank rank_;
  Point point_;
  double mu_ = 0.0;
  Index iteration_ = 0;
};

}  // namespace ipminmax
