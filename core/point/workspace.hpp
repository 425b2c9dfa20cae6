#pragma once

#include <array>
#include <cstddef>

#include "core/point/point.hpp"

namespace ipminmax {

/// Arrays in the shapes of a solve's points, kept from solve to solve. The step method writes over
/// them and, between its steps, the certificate: nothing in them lasts from one to the other.
struct Workspace {
  std::array<Point, 4> points;
  std::array<Step, 11> steps;
};

/// Hands out the parts of a workspace, each once. What is taken from a copy is free again when the
/// copy is gone.
class Parts {
 public:
  explicit Parts(Workspace& all) : all_(all) {}
  [[nodiscard]] Point& point() { return all_.points.at(points_++); }
  [[nodiscard]] Step& step() { return all_.steps.at(steps_++); }

 private:
  Workspace& all_;
  std::size_t points_ = 0, steps_ = 0;
};

}  // namespace ipminmax
