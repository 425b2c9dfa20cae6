#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_scope.hpp"

namespace ipminmax {

/// Some variables held where v has them; it starts at v.
class Held final : public Restructured {
 public:
  Held(Problem& model, const std::vector<std::size_t>& variables, std::vector<double> v)
      : Restructured(model), v_(std::move(v)) {
    for (const std::size_t i : variables) fix_variable(changed, static_cast<Index>(i), v_[i]);
  }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    return !start.needs_multipliers;
  }

 private:
  std::vector<double> v_;
};

/// One player's problem: the other's variables are fixed, his constraints absent. v: n values.
[[nodiscard]] inline Held alone(Problem& model, Player player, std::span<const double> v) {
  const Player other = player == Player::Max ? Player::Min : Player::Max;
  Held held(model, variables_of(model.structure(), other), {v.begin(), v.end()});
  for (const auto j : indices(held.changed.constraint_players)) {
    if (held.changed.constraint_players[j] == other)
      drop_constraint(held.changed, static_cast<Index>(j));
  }
  return held;
}

}  // namespace ipminmax
