#include "core/problem.hpp"

namespace ipminmax {

std::vector<Player> implied_constraint_players(const ProblemStructure& structure) {
  std::vector<Player> players;
  implied_constraint_players(structure, players);
  return players;
}

void implied_constraint_players(const ProblemStructure& structure, std::vector<Player>& players) {
  players.assign(structure.constraint_lower.size(), Player::Min);
  for (const auto& [row, col] : structure.jacobian) {
    if (structure.variable_players[static_cast<std::size_t>(col)] == Player::Max) {
      players[static_cast<std::size_t>(row)] = Player::Max;
    }
  }
}

}  // namespace ipminmax
