#pragma once

#include <cmath>

#include "core/method/filter.hpp"
#include "core/method/parameters.hpp"

namespace ipminmax {

/// Inverse iteration on the variables of one player's block.
struct InverseIteration {
  IndexRange variables{};
  int iterations = 6;  ///< 4 and 60 find the same directions
  int number = 0;      ///< of the generic vector that it begins with
};

/// Turns the step to the direction of the curvature with the wrong sign, or of the least, by
/// inverse iteration with the block's matrix, solve(rhs, step). A shift far above what the matrix
/// needs makes it slow. prepare(v) takes out of v what it must not have; stop(k, growth) ends
/// it after solution k, whose part in the block is growth long. The step has length one there.
/// False: no direction.
template <class Solve, class Prepare, class Stop>
bool turn_to_curvature(const InverseIteration& how, NewtonResidual& rhs, Step& step, Solve solve,
                       Prepare prepare, Stop stop) {
  const Index begin = how.variables.begin;
  const Index n = how.variables.size();
  set_zero(rhs);
  for (Index i = 0; i < n; ++i)
    rhs.v[begin + i] = std::sin(1.0 + how.number + (1 + how.number) * i);
  prepare(rhs.v);
  for (int k = 0; k < how.iterations; ++k) {
    if (!solve(rhs, step)) return false;
    prepare(step.v);
    const double norm = step.v.segment(begin, n).norm();
    if (!(norm > 0.0 && std::isfinite(norm))) return false;
    rhs.v.segment(begin, n) = step.v.segment(begin, n) / norm;
    step.v /= norm;
    if (stop(k, norm)) break;
  }
  return true;
}
template <class Solve>
bool turn_to_curvature(const InverseIteration& how, NewtonResidual& rhs, Step& step, Solve solve) {
  return turn_to_curvature(
      how, rhs, step, solve, [](Eigen::VectorXd&) {}, [](int, double) { return false; });
}

/// A move along a curvature, to both sides.
struct CurvatureMove {
  Merit from{};
  double size = 0.0;     ///< of the variables: lengths from a tenth of it down are tried [G]
  double penalty = 0.0;  ///< of the violation against phi
};

/// Moves a block's trial point along the direction, whose first sense is the better one, until the
/// merit improves. A block has
///   set_trial(direction, length)  the trial point as far along as bounds allow
///   evaluate_move(length)         its merit
///   improve(trial)                brings it closer to the constraints: its merit then
///   complete()                    as in filter_search
template <class Block>
bool move_along_curvature(Block& block, const CurvatureMove& move, const auto& direction,
                          SolveLimit& limit) {
  const auto gains = [&](const Trial& trial) {
    // A violation left over may not pay for the decrease.
    const double change =
        trial.merit.phi - move.from.phi + move.penalty * (trial.merit.theta - move.from.theta);
    return trial.usable &&
           change < -parameters::escape::kLeastGain * (1.0 + std::abs(move.from.phi));
  };
  constexpr double kFirst = 0.1, kLast = 1e-6;  // of the size; of the first
  const double first = kFirst * move.size;
  for (double t = first; t > kLast * first && !limit.expired(); t *= 0.5) {
    for (const double sign : {1.0, -1.0}) {
      block.set_trial(direction, sign * t);
      const Trial trial = block.improve(block.evaluate_move(t));
      if (gains(trial) && block.complete()) return true;
    }
  }
  return false;
}

}  // namespace ipminmax
