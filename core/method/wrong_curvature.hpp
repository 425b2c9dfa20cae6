#pragma once

#include <Eigen/Core>

#include "core/problem.hpp"

namespace ipminmax {

/// A direction from a first-order point along which its owner gains to second order: both signs do.
struct WrongCurvature {
  Player owner = Player::Min;
  Eigen::VectorXd direction;  ///< canonical variables, slacks included; for Max zero in x
};

}  // namespace ipminmax
