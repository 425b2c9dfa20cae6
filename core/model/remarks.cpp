#include "core/model/remarks.hpp"
#include "core/model/structure_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

namespace ipminmax {
namespace {

/// Share of the way from the middle of an interval to its ends up to which a variable stays away
/// from both.
constexpr double kFarFromBounds = 0.1;

/// Bounds from here on are none, as nlp_upper_bound_inf has it by default.
constexpr double kNoBound = 1e19;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }
std::size_t player(Player p) { return p == Player::Max ? 1 : 0; }

struct Shares {
  std::array<std::size_t, 2> variables{}, free{}, open{}, equations{};
  /// Open variables of Min that several of Max's equations read: states look like that.
  std::vector<Index> shared{};
};

bool is_open(const ProblemStructure& s, std::size_t i) {
  return s.variable_lower[i] <= -kNoBound || s.variable_upper[i] >= kNoBound;
}

/// Equations without free variables of their owner restrict nobody's choice.
Shares count(const ProblemStructure& s) {
  Shares counts;
  std::vector<bool> fixed(s.variable_players.size());
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    fixed[i] = s.variable_lower[i] == s.variable_upper[i];
    ++counts.variables[player(s.variable_players[i])];
    if (!fixed[i]) ++counts.free[player(s.variable_players[i])];
    if (!fixed[i] && is_open(s, i)) ++counts.open[player(s.variable_players[i])];
  }
  std::vector<bool> moved(s.constraint_players.size(), false);
  for (const auto& [row, col] : s.jacobian) {
    if (!fixed[at(col)] && s.variable_players[at(col)] == s.constraint_players[at(row)])
      moved[at(row)] = true;
  }
  const auto equation = [&](std::size_t j) {
    return moved[j] && s.constraint_lower[j] == s.constraint_upper[j];
  };
  for (std::size_t j = 0; j < moved.size(); ++j) {
    if (equation(j)) ++counts.equations[player(s.constraint_players[j])];
  }
  std::vector<Index> last_reader(fixed.size(), -1);
  for (const auto& [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] != Player::Max || !equation(at(row)) || fixed[at(col)] ||
        s.variable_players[at(col)] != Player::Min || !is_open(s, at(col))) {
      continue;
    }
    if (last_reader[at(col)] >= 0 && last_reader[at(col)] != row) counts.shared.push_back(col);
    last_reader[at(col)] = row;
  }
  std::ranges::sort(counts.shared);
  counts.shared.erase(std::unique(counts.shared.begin(), counts.shared.end()), counts.shared.end());
  return counts;
}

std::string plural(std::size_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string stem(const std::string& name) { return name.substr(0, name.find_first_of("[({")); }

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g %%", 100.0 * share);
  return text;
}

}  // namespace

std::vector<std::string> split_remarks(const ProblemStructure& structure) {
  const Shares counts = count(structure);
  std::vector<std::string> remarks;
  if (counts.variables[1] == 0) {
    remarks.emplace_back("Max has no variables: this is a plain minimization.");
  } else if (counts.variables[0] == 0) {
    remarks.emplace_back("Min has no variables: this is a plain maximization.");
  } else if (counts.free[1] == 0) {
    remarks.emplace_back("Max's variables are all fixed: this is a plain minimization.");
  } else if (counts.free[0] == 0) {
    remarks.emplace_back("Min's variables are all fixed: this is a plain maximization.");
  } else if (counts.equations[1] >= counts.free[1]) {
    remarks.push_back(
        "Max has " + plural(counts.equations[1], "equality constraint") + " for " +
        plural(counts.free[1], "variable") +
        ": no choice is left to him. Do other variables belong to Max, too: the states that these "
        "equations define, or his decisions?");
  } else if (counts.equations[1] > counts.open[1] && !counts.shared.empty()) {
    remarks.push_back("Max has " + plural(counts.equations[1], "equality constraint") + " for " +
                      plural(counts.open[1], "variable") + " without two bounds, and " +
                      plural(counts.shared.size(), "variable") +
                      " of Min's in several of them (the first: " +
                      variable_name(structure, counts.shared.front()) +
                      "). Are these states, which belong to Max, too?");
  }
  return remarks;
}

std::vector<std::string> idle_bound_remarks(const ProblemStructure& structure,
                                            const SolverOptions& options, const Result& result) {
  struct Group {
    Index variables = 0;
    double nearest = 0.0;  ///< to a bound: 0 in the middle, 1 at an end
  };
  std::map<std::string, Group> groups;
  const std::size_t n = structure.variable_players.size();
  if (result.v.size() != n || std::ranges::count(structure.variable_players, Player::Min) == 0) {
    return {};
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double lower = structure.variable_lower[i], upper = structure.variable_upper[i];
    if (structure.variable_players[i] != Player::Max || !(lower < upper) ||
        lower <= options.nlp_lower_bound_inf || upper >= options.nlp_upper_bound_inf) {
      continue;
    }
    const bool named = i < structure.variable_names.size();
    Group& group = groups[named ? stem(structure.variable_names[i]) : std::string()];
    ++group.variables;
    const double half = 0.5 * (upper - lower);
    const double share = std::abs(result.v[i] - lower - half) / half;
    group.nearest = std::max(group.nearest, std::isnan(share) ? 1.0 : share);
  }
  std::vector<std::string> remarks;
  for (const auto& [name, group] : groups) {
    if (group.nearest >= kFarFromBounds) continue;
    remarks.push_back("Max's bounded variables" + (name.empty() ? "" : " " + name) + " (" +
                      std::to_string(group.variables) + ") use " + percent(group.nearest) +
                      " of their range: the objective, not the bounds, holds them back. Is their "
                      "price too high?");
  }
  return remarks;
}

}  // namespace ipminmax
