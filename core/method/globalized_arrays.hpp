#pragma once

#include "core/method/filter.hpp"
#include "core/method/outer_block.hpp"
#include "core/method/step_method.hpp"

namespace ipminmax {

/// Ipopt's watchdog for minimizations: after shortened steps in a row, full steps that need not
/// improve on the point they leave, as long as one of the first few improves on the point where it
/// began.
struct Watchdog {
  bool active = false;
  Index trials = 0;
  Index shortened_steps = 0;  ///< in a row
  // Where it began.
  Point point;
  Step step;
  Merit from;
  double slope = 0.0;
  double alpha = 1.0;
  StepReport report;

  [[nodiscard]] bool is_due() const {
    constexpr Index kTrigger = 10;  // watchdog_shortened_iter_trigger of [Ipopt]
    return active || shortened_steps >= kTrigger;
  }
  void count(bool shortened) { shortened_steps = shortened ? shortened_steps + 1 : 0; }
  /// What it began with means nothing any more.
  void end() {
    active = false;
    shortened_steps = 0;
  }
};

/// What a GlobalizedMethod works with, kept from one to the next.
struct GlobalizedArrays {
  OuterArrays outer_arrays_;
  Filter filter_;
  Watchdog watchdog_;
};

}  // namespace ipminmax
