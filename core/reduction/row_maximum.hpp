#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/model/row_over_y.hpp"
#include "core/result.hpp"
#include "core/search/kept_work.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// One worst case of a robust constraint g as a function of x alone:
///
///     phi(x) = local max over y in Y(x) of  side g(x, y) + mu average of ln(distances of y)
///
/// y is found to rounding by a solve over y, which begins at the y of the last point accepted, so
/// one branch of maxima is followed. With l = side g + nu' h, h the Max constraints,
///
///     grad phi = grad_x l,    hess phi = l_xx - B' M^-1 B,
///     M = | l_yy - S   h_y' |     B = | l_yx |     S, D of the barrier, M has n_y negative and
///         | h_y        D    |         | h_x  |     m_y positive eigenvalues at a local maximum
///
/// (implicit function theorem; Fiacco 1976). Where y jumps from bound to bound as x moves, phi has
/// a kink, which mu rounds: y then comes to rest inside a face. mu is that of the problem in x.
class RowMaximum {
 public:
  struct Row {
    Index constraint = 0;   ///< robust
    double side = 1.0;      ///< 1 for the upper bound, -1 for the lower one
    std::vector<double> v;  ///< n; y in it is where the first maximization begins
    bool held = false;      ///< y stays there
  };
  /// options: of the problem in x.
  RowMaximum(Problem& model, Row row, const SolverOptions& options, Budget& budget);

  /// Min variables on which phi depends, ascending.
  [[nodiscard]] const std::vector<Index>& x() const { return x_; }
  /// y at this x (n values, of which x is read). False: no certain local maximum was found near the
  /// last point; then nothing has changed.
  [[nodiscard]] bool move_to(std::span<const double> v);
  /// The next points are near this one.
  void accept() { accepted_ = here_; }
  /// Of the barrier. Whether phi has changed.
  [[nodiscard]] bool follow_barrier(double mu);

  [[nodiscard]] Index constraint() const { return constraint_; }
  [[nodiscard]] double side() const { return side_; }
  [[nodiscard]] bool is_held() const { return whole_.variables.empty(); }
  [[nodiscard]] double value() const { return here_.value; }
  /// Per x(). False: a function is undefined.
  [[nodiscard]] bool gradient(std::span<double> out);
  /// Adds weight times the lower triangle, by rows: (0,0), (1,0), (1,1), ... False: a function is
  /// undefined, or M has another inertia.
  [[nodiscard]] bool add_hessian(double weight, std::span<double> out);

  /// x and y, n values.
  [[nodiscard]] const RowPoint& point() const { return here_.point; }
  /// Why the last move_to failed.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] Index solves() const { return solves_; }
  [[nodiscard]] Index iterations() const { return iterations_; }

  /// A local maximum at the x accepted last that is not the one followed: that to which the last
  /// points lead whose y lay elsewhere, n values; empty: none is known.
  [[nodiscard]] std::vector<double> other_branch(double distinct_tol);

  /// Maximizes without barrier from here, over all of y that is tied to the row, with a
  /// certificate.
  [[nodiscard]] Result settle();

 private:
  struct Place {
    RowPoint point;
    double value = 0.0;  ///< of phi
  };
  [[nodiscard]] bool maximize(const RowPoint& from, bool warm, Place& to);
  [[nodiscard]] SolverOptions inner_options(bool warm) const;
  [[nodiscard]] bool same_x(std::span<const double> v, const Place& place) const;
  struct Barrier {
    double logarithms = 0.0;  ///< sum of ln(distance / length)
    double gap = 0.0;         ///< sum of distance * multiplier over active bounds
  };
  [[nodiscard]] Barrier barrier_at(const RowPoint& point, std::span<const double> g) const;
  struct Bound {
    double distance = 0.0;
    double multiplier = 0.0;  ///< >= 0
    double length = 1.0;      ///< at which its logarithm is zero
  };
  template <class Use>
  void for_each_bound(const RowPoint& point, std::span<const double> g, Use use) const;
  /// Of the logarithms in phi.
  [[nodiscard]] double weight() const { return mu_ / scale_; }
  [[nodiscard]] double distance(double distance, double multiplier) const;
  [[nodiscard]] bool is_maximum(const RowPoint& point);
  [[nodiscard]] bool factorize(const RowPoint& point);
  void make_pattern();

  Problem& model_;
  RobustScope whole_;  ///< empty: y is held
  RobustScope scope_;  ///< what of it decides the row
  Index constraint_;
  double side_;
  SolverOptions options_;
  RowOverY over_y_;
  Budget& budget_;
  std::unique_ptr<KeptWork> kept_;
  double mu_;  ///< of the solves over y, in their units: its share for each bound
  Index bounds_ = 0;
  double scale_ = 1.0;    ///< of the objective of the solves over y
  bool started_ = false;  ///< here_ is a maximum
  Place here_, accepted_;
  std::vector<double> elsewhere_;  ///< y of the last point that was not accepted, n values
  double offset_ = 0.0;            ///< taken off phi
  std::string failure_;
  Index solves_ = 0, iterations_ = 0;

  std::vector<Index> x_;
  std::vector<Index> x_place_, y_place_, h_place_;  ///< n, n, m: place in x_, row of M; -1: none
  std::vector<Index> y_, h_;                        ///< variables and constraints that M is of
  SymmetricMatrix matrix_;
  std::vector<std::int8_t> signs_;
  std::unique_ptr<SymmetricSolver> linear_solver_;
  bool analyzed_ = false;
  std::vector<double> g_, lambda_, jacobian_, hessian_, scaling_, right_, solution_;
  bool factorized_ = false;  ///< M at here_
};

}  // namespace ipminmax
