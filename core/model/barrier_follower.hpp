#pragma once

namespace ipminmax {

/// A problem whose functions are smoothed by the barrier parameter of the solve.
class BarrierFollower {
 public:
  virtual ~BarrierFollower() = default;
  /// Told of the parameter before each step. True: functions have changed and are evaluated anew.
  [[nodiscard]] virtual bool follow_barrier(double mu) = 0;
};

}  // namespace ipminmax
