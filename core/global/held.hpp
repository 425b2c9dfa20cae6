#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Some variables held where v has them; it starts at v.
class Held final : public Restructured {
 public:
  Held(Problem& model, const std::vector<std::size_t>& variables, std::vector<double> v)
      : Restructured(model), v_(std::move(v)) {
    for (const std::size_t i : variables) {
      changed.variable_lower[i] = changed.variable_upper[i] = v_[i];
    }
  }

  void drop_constraints_of(Player player) {
    for (std::size_t j = 0; j < changed.constraint_players.size(); ++j) {
      if (changed.constraint_players[j] != player) continue;
      changed.constraint_lower[j] = -kInfinity;
      changed.constraint_upper[j] = kInfinity;
    }
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
  const std::vector<Player>& players = model.structure().variable_players;
  std::vector<std::size_t> of_other;
  for (std::size_t i = 0; i < players.size(); ++i) {
    if (players[i] == other) of_other.push_back(i);
  }
  Held held(model, of_other, {v.begin(), v.end()});
  held.drop_constraints_of(other);
  return held;
}

}  // namespace ipminmax
