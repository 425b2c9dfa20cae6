#pragma once

#include <vector>

#include <support/autodiff_problem.hpp>

namespace ipminmax::testing {

/// Free rows, fixed variables of both players, inequalities and equations of both.
inline Model mixed_model() {
  Model model;
  const Expression a = model.variable(Player::Min, "a", -3.0, 4.0);
  const Expression p = model.variable(Player::Min, "p", 0.5, 0.5);
  const Expression y = model.variable(Player::Max, "y", -kNoBound, 2.0);
  const Expression q = model.variable(Player::Max, "q", -1.0, -1.0);
  const Expression b = model.variable(Player::Min, "b", 0.1);
  const Expression w = model.variable(Player::Max, "w");
  model.objective(square(a - 1.0) + 3.0 * a * y - square(y) * 2.0 + exp(b) + p * a + q * y -
                  square(w) + w * b);
  model.constraint(a * b + p, -kNoBound, kNoBound);
  model.constraint(a + b, -kNoBound, 1.5);
  model.constraint(square(a) + y, -4.0, 8.0);
  model.constraint(w + 2.0 * y + q, 0.25, 0.25);
  model.constraint(square(y) + square(w), -kNoBound, kNoBound);
  model.constraint(y + w, -5.0, kNoBound);
  return model;
}

inline const std::vector<double> kMixedStart{0.0, 0.5, 0.0, -1.0, 0.5, 0.0};

}  // namespace ipminmax::testing
