#pragma once

#include <limits>
#include <ostream>
#include <span>

#include <Eigen/Core>

#include "core/problem.hpp"

/// First- and second-order conditions of a local minmax by dense linear algebra: least-squares
/// multipliers, null spaces and eigenvalues. Shares no code with the library, for judging answers.
namespace ipminmax::testing {

enum class Verdict : std::uint8_t {
  NotFirstOrder,   ///< infeasible, not stationary, or a multiplier of the wrong sign
  LocalMinmax,     ///< the sufficient conditions hold
  Undecided,       ///< singular curvature, dependent or weakly active constraints
  NotLocalMinmax,  ///< curvature of a definite wrong sign
};

inline std::ostream& operator<<(std::ostream& out, Verdict verdict) {
  switch (verdict) {
    case Verdict::NotFirstOrder:
      return out << "NotFirstOrder";
    case Verdict::LocalMinmax:
      return out << "LocalMinmax";
    case Verdict::Undecided:
      return out << "Undecided";
    case Verdict::NotLocalMinmax:
      return out << "NotLocalMinmax";
  }
  return out;
}

/// Multipliers with the signs of Result.
struct Multipliers {
  Eigen::VectorXd lambda, z_lower, z_upper;
};

struct DenseOptimality {
  Verdict verdict = Verdict::NotFirstOrder;
  double infeasibility = std::numeric_limits<double>::infinity();
  double stationarity = std::numeric_limits<double>::infinity();  ///< largest entry, both players
  double wrong_sign = 0.0;       ///< largest multiplier of the wrong sign
  double inner_curvature = 0.0;  ///< largest eigenvalue of the reduced Hessian in y; want < 0
  double outer_curvature = 0.0;  ///< smallest eigenvalue of the reduced Schur complement; want > 0
  int weakly_active = 0;
  bool independent = true;  ///< active gradients of each player

  friend std::ostream& operator<<(std::ostream& out, const DenseOptimality& d) {
    return out << d.verdict << " infeasibility " << d.infeasibility << " stationarity "
               << d.stationarity << " wrong sign " << d.wrong_sign << " inner curvature "
               << d.inner_curvature << " outer curvature " << d.outer_curvature << " weakly active "
               << d.weakly_active << " independent " << d.independent;
  }
};

struct DenseTolerances {
  double first_order = 1e-6;  ///< relative to 1 + the largest entry of the objective's gradient
  double active = 1e-6;       ///< distance below which a bound is active
  double inactive = 1e-3;     ///< distance above which it is inactive; in between weakly active
  double multiplier = 1e-5;   ///< below which an active bound is weakly active
  double curvature = 1e-6;    ///< relative to 1 + the largest entry of the Hessian
};

/// Dense values of a problem at a point. ok is false where the problem is undefined.
struct DenseEvaluation {
  bool ok = false;
  double objective = 0.0;
  Eigen::VectorXd gradient, constraints;
  Eigen::MatrixXd jacobian;

  DenseEvaluation(Problem& problem, const Eigen::VectorXd& v);
};

/// Hessian of sigma f + lambda' g, both triangles.
[[nodiscard]] Eigen::MatrixXd dense_hessian(Problem& problem, const Eigen::VectorXd& v,
                                            double sigma, const Eigen::VectorXd& lambda);

/// With given multipliers, or with the least-squares multipliers of the active constraints.
[[nodiscard]] DenseOptimality dense_optimality(Problem& problem, std::span<const double> v,
                                               const Multipliers* given = nullptr,
                                               const DenseTolerances& tolerances = {});

}  // namespace ipminmax::testing
