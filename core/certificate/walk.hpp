#pragma once

#include <cstdint>
#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/point/merit.hpp"

namespace ipminmax {

/// Trial steps from a point, brought back to the constraints that the system counts and to the
/// inner maximum with the matrix at hand: what the value does along a direction.
class Walk {
 public:
  enum class Kind : std::uint8_t {
    Inner,        ///< y moves, x is held: K_yy is used
    Outer,        ///< x moves, y answers: K
    InnerValley,  ///< as Inner, directions other than the free ones brought back to stationarity
    Valley        ///< as Outer, directions other than the free ones brought back to stationarity
  };
  struct End {
    bool reached = false;  ///< corrections converged, inside all bounds
    double change = 0.0;   ///< of the value, what a violation left over is worth included
    double left = 0.0;     ///< that worth
    double moved = 0.0;    ///< longest entry of the way, in units
  };

  /// The system as assembled, its matrix factorized and left so while walking.
  Walk(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point, Kind kind);

  /// Of a valley, in units, orthonormal in the variables of whom it belongs to.
  void set_free_directions(const std::vector<Eigen::VectorXd>& directions) { free_ = directions; }

  /// step: canonical variables; corrections end below negligible times length (squared but in a
  /// valley).
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

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const Point& point_;
  [[nodiscard]] bool inner() const { return kind_ == Kind::Inner || kind_ == Kind::InnerValley; }
  [[nodiscard]] bool valley() const { return kind_ == Kind::Valley || kind_ == Kind::InnerValley; }

  Kind kind_;
  Index begin_;  ///< first variable that moves
  std::vector<Eigen::VectorXd> free_;
};

}  // namespace ipminmax
