#pragma once

#include <vector>

#include <support/autodiff_problem.hpp>

#include "core/options.hpp"

/// The questions that every door is asked, and the model.
namespace ipminmax::testing {

inline const std::vector<double> kDoorStart{1.0, -0.9};

/// Two maxima over y, and on request a robust constraint with two worst cases.
inline Model door_model(bool robust) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -5.0, 5.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(square(x - 0.3) - 4.0 * square(square(y) - 1.0) + 0.4 * x * y);
  if (robust) {
    model.constraint(x + 2.0 + square(square(y) - 1.0) - 0.5 * y, 0.0, kNoBound, Player::Min);
  }
  return model;
}

struct DoorQuestion {
  int starts;       ///< of x
  int starts_of_y;  ///< -1: the default
  bool epigraph;
  bool at_kinks;
  bool robust;  ///< of the model

  [[nodiscard]] SolverOptions options() const {
    SolverOptions options;
    options.minmax_starts = starts;
    options.minmax_worst_case_starts = starts_of_y;
    options.minmax_epigraph = epigraph;
    options.minmax_epigraph_at_kinks = at_kinks;
    return options;
  }
};

inline std::vector<DoorQuestion> door_questions() {
  std::vector<DoorQuestion> questions;
  for (const int starts : {1, 4}) {
    for (const int starts_of_y : {-1, 0, 5}) {
      for (const int flags : {0, 1, 2, 3, 4, 5, 6, 7}) {
        questions.push_back(
            {starts, starts_of_y, (flags & 1) != 0, (flags & 2) != 0, (flags & 4) != 0});
      }
    }
  }
  return questions;
}

}  // namespace ipminmax::testing
