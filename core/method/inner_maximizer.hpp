#pragma once

#include <algorithm>
#include <cmath>

#include "core/method/filter.hpp"
#include "core/method/step_method.hpp"
#include "core/model/kept.hpp"
#include "core/point/point.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

/// Newton step of the inner maximization at fixed x.
struct InnerDirection {
  Step step;
  double mu = -1.0;          ///< barrier parameter of the step
  double gain = 0.0;         ///< q: predicted increase of the barrier objective
  double copies_gain = 0.0;  ///< the same of the constraints that copies serve, together
  Regularization shift;      ///< of K_yy
  KktFactors factors;        ///< of K_yy
  std::uint64_t jacobian_call = 0, hessian_call = 0;  ///< of the point's derivatives

  /// Of no point, a step of zeros.
  void clear(const CanonicalProblem& canonical) {
    set_zero(canonical, step);
    mu = -1.0;
    gain = copies_gain = 0.0;
    shift = {};
    factors = {};
    jacobian_call = hessian_call = 0;
  }
  [[nodiscard]] double largest_gain() const {
    return std::max(std::abs(gain), std::abs(copies_gain));
  }
  /// Whether it is the step from a point, with some mu.
  [[nodiscard]] bool is_at(const Point& point) const {
    return hessian_call != 0 && hessian_call == point.evaluation.hessian_call &&
           jacobian_call == point.evaluation.jacobian_call;
  }
};

/// What an InnerMaximizer works with, kept from one to the next.
struct InnerArrays {
  Filter filter_;
  Point trial_;
  NewtonResidual rhs_;
  Step correction_step_;
  Eigen::VectorXd gradient_;                 ///< of the value
  Eigen::VectorXd along_;                    ///< direction of leave in y, s_y
  std::vector<std::size_t> robust_entries_;  ///< of the Jacobian: robust constraints in y
  Eigen::VectorXd corrected_c_;              ///< right-hand side of second-order corrections
  Eigen::VectorXd start_v_;                  ///< where maximize began
};

/// Maximizes the barrier objective over (y, s_y) at fixed x: Newton steps from K_yy alone, filter
/// on (violation of the Max constraints, minus value), second-order correction. Robust constraints,
/// which Max tries to violate, enter the value as lambda_r' c_r with lambda_r held, so that a copy
/// of y that belongs to one of them maximizes it whether Min satisfies it or not.
class InnerMaximizer : Kept<InnerArrays> {
 public:
  /// first: where the search begins.
  InnerMaximizer(const MethodContext& context, const Point& first, InnerArrays& arrays);

  enum class Outcome : std::uint8_t {
    Maximum,     ///< in sight, and the gain at most the target
    AboveBound,  ///< feasible with a value above the bound: phi(x) is larger still
    NotFound,    ///< no maximum within the allowed steps or the time limit
    Unbounded    ///< y runs away
  };

  /// Assembles K_yy at the point and factorizes it, shifted as needed, unless that was the last
  /// factorization; false: no shift helps.
  [[nodiscard]] bool direction(const Point& point, double mu, InnerDirection& out);
  /// The same where a maximum is in sight; false where none is.
  [[nodiscard]] bool unshifted_direction(const Point& point, double mu, InnerDirection& out);
  /// Whether K_yy is right at the point, up to what InertiaCorrection::factorize_unshifted adds.
  [[nodiscard]] bool has_maximum_in_sight(const Point& point, double mu, Regularization& shift);

  /// Moves y, s_y and their multipliers of the point; out is the direction at its end, and is used
  /// at its beginning where it is_known there.
  [[nodiscard]] Outcome maximize(Point& point, double mu, double target, int max_steps,
                                 double upper_bound, InnerDirection& out);
  /// Whether it is the direction at the point, with its factors at hand.
  [[nodiscard]] bool is_known(const InnerDirection& direction, const Point& point) const {
    return direction.is_at(point) && kkt_.are_current_inner(direction.factors);
  }

  /// leave along the direction of the largest curvature, by the factors of K_yy.
  [[nodiscard]] bool escape(Point& point, double mu, const KktFactors& factors);
  /// Moves y, s_y along a direction (or against it) in which the value rises to second order; x
  /// stays. False: it does not.
  [[nodiscard]] bool leave(Point& point, double mu, const Eigen::VectorXd& direction);

  /// Whether the Max constraints hold closely enough to compare values.
  [[nodiscard]] bool feasible(const Point& point, double mu) const;

  /// Error of the inner first-order conditions at mu.
  [[nodiscard]] double error(const Point& point, double mu) const;

 private:
  [[nodiscard]] bool solve(const Point& point, double mu, InnerDirection& out);
  struct Block;
  [[nodiscard]] Merit merit(const Point& point, double mu) const;
  [[nodiscard]] bool search(Point& point, double mu, const InnerDirection& direction);
  [[nodiscard]] bool evaluate_merit(Point& trial, double mu, Merit& merit);
  [[nodiscard]] double value(const Point& point, double mu) const;
  void value_gradient(const Point& point, double mu);
  [[nodiscard]] double own_weight(Index robust, const Iterate& iterate) const;
  void divide_gain(const Point& point, InnerDirection& out) const;
  void move(const Point& from, const Step& step, StepLength alpha, double mu, Point& to) const;

  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  InertiaCorrection& correction_;
  const SolverOptions& options_;
  TimeLimit& limit_;
};

}  // namespace ipminmax
