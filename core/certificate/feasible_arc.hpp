#pragma once

#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/method/step_method.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Arcs from a point: steps brought back to the constraints that the system counts and to the inner
/// maximum, with the matrix at hand. They tell what the value does along a direction.
class FeasibleArc {
 public:
  struct End {
    bool reached = false;  ///< corrections converged, inside all bounds
    double change = 0.0;   ///< of the value, what a violation left over is worth included
    double left = 0.0;     ///< that worth
    double moved = 0.0;    ///< longest entry of the way, in units
  };

  /// Max: y moves, x is held, with K_yy; Min: x moves, y answers, with K. The system as assembled,
  /// its matrix factorized and left so. stationary: directions other than the free ones are brought
  /// back to where the value is stationary along them.
  FeasibleArc(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
              Player owner, bool stationary)
      : canonical_(canonical),
        system_(system),
        point_(point),
        inner_(owner == Player::Max),
        stationary_(stationary),
        own_(inner_ ? canonical.y() : canonical.x()) {}

  /// In units, orthonormal in the variables of whom they belong to.
  void set_free_directions(const std::vector<Eigen::VectorXd>& directions) { free_ = directions; }

  /// step: canonical variables; corrections end below negligible times length, squared where not
  /// stationary.
  [[nodiscard]] End take(const Eigen::VectorXd& step, double length);

  /// A direction in units as a step of canonical variables; slacks of open inequalities move along.
  [[nodiscard]] Eigen::VectorXd step_along(const Eigen::VectorXd& direction) const;

 private:
  struct Trial {
    Eigen::VectorXd v, lambda;
    Evaluation evaluation;
  };
  [[nodiscard]] bool evaluate(Trial& trial);
  [[nodiscard]] bool correct(Trial& trial, double& residual);
  [[nodiscard]] NewtonResidual residual_of(const Trial& trial) const;
  [[nodiscard]] double lagrangian(const Evaluation& evaluation) const;
  [[nodiscard]] bool is_inside(const Eigen::VectorXd& v, const Eigen::VectorXd& c) const;
  [[nodiscard]] bool corrects(Index constraint) const {
    return system_.counts(constraint) &&
           !(inner_ && constraint < canonical_.max_constraints().begin);
  }

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const Point& point_;
  bool inner_, stationary_;
  IndexRange own_;
  std::vector<Eigen::VectorXd> free_;
};

}  // namespace ipminmax
