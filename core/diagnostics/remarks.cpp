#include "core/diagnostics/remarks.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/parameters.hpp"
#include "core/model/structure_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "linalg/array.hpp"

namespace ipminmax {
namespace {

std::size_t player(Player p) { return p == Player::Max ? 1 : 0; }

struct Shares {
  std::array<std::size_t, 2> free{}, open{}, equations{};
  /// Open variables of Min that several of Max's equations read: states look like that.
  std::vector<Index> shared{};
};

bool is_open(const ProblemStructure& s, std::size_t i) {
  return s.variable_lower[i] <= -kUnbounded || s.variable_upper[i] >= kUnbounded;
}

/// Equations without free variables of their owner restrict nobody's choice.
Shares count(const ProblemStructure& s) {
  Shares counts;
  std::vector<bool> fixed(s.variable_players.size());
  for (const auto i : indices(fixed)) {
    fixed[i] = s.variable_lower[i] == s.variable_upper[i];
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
  for (const auto j : indices(moved)) {
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
  sort_each_once(counts.shared);
  return counts;
}

std::string plural(std::size_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace

std::string one_player_remark(const ProblemStructure& s) {
  std::array<bool, 2> has_variables{}, has_free{};
  for (const auto i : indices(s.variable_players)) {
    const std::size_t owner = player(s.variable_players[i]);
    has_variables[owner] = true;
    if (s.variable_lower[i] != s.variable_upper[i]) has_free[owner] = true;
  }
  if (!has_variables[1]) return "Max has no variables: this is a plain minimization.";
  if (!has_variables[0]) return "Min has no variables: this is a plain maximization.";
  if (!has_free[1]) return "Max's variables are all fixed: this is a plain minimization.";
  if (!has_free[0]) return "Min's variables are all fixed: this is a plain maximization.";
  return {};
}

std::vector<std::string> split_remarks(const ProblemStructure& s) {
  const Shares counts = count(s);
  std::vector<std::string> remarks;
  if (counts.free[0] == 0 || counts.free[1] == 0) return remarks;
  if (counts.equations[1] >= counts.free[1]) {
    remarks.push_back(
        "Max has " + plural(counts.equations[1], "equality constraint") + " for " +
        plural(counts.free[1], "variable") +
        ": no choice is left to him. Do other variables belong to Max, too: the states that these "
        "equations define, or his decisions?");
  } else if (counts.equations[1] > counts.open[1] && !counts.shared.empty()) {
    remarks.push_back(
        "Max has " + plural(counts.equations[1], "equality constraint") + " for " +
        plural(counts.open[1], "variable") + " without two bounds, and " +
        plural(counts.shared.size(), "variable") + " of Min's in several of them (the first: " +
        variable_name(s, counts.shared.front()) + "). Are these states, which belong to Max, too?");
  }
  return remarks;
}

namespace {

/// Whether each constraint reads variables of (Min, Max).
template <class Counts>
std::vector<std::array<bool, 2>> readers(const ProblemStructure& s, Counts&& counts) {
  std::vector<std::array<bool, 2>> reads(s.constraint_players.size());
  for (const auto& [row, col] : s.jacobian) {
    if (counts(at(col))) reads[at(row)][player(s.variable_players[at(col)])] = true;
  }
  return reads;
}

/// Where no stationary point withstands, or branches of y end, max over y of f may have a kink.
std::string at_possible_kink(const ProblemStructure& s) {
  std::string text =
      "if another y is as good here, max over y of f has a kink: minmax_epigraph yes minimizes the "
      "largest of the maxima over y";
  const auto reads = readers(s, [](std::size_t) { return true; });
  for (const auto j : indices(reads)) {
    if (s.constraint_players[j] != Player::Max || s.constraint_lower[j] != s.constraint_upper[j] ||
        reads[j][0]) {
      continue;
    }
    return text + "\nan inequality in place of Max's equation " +
           constraint_name(s, static_cast<Index>(j)) + " may have no kink";
  }
  return text;
}

}  // namespace

std::string unmet(const ProblemStructure& s, const SolverOptions& options, const Result& result) {
  if (result.status != Status::NoLocalMinmaxFound && result.status != Status::InnerUnbounded)
    return {};
  for (const Player of : {Player::Max, Player::Min}) {
    std::size_t worst = 0;
    double most = options.constr_viol_tol;
    for (const auto j : indices(result.constraints)) {
      const double g = result.constraints[j];
      const double outside = excess(g, s.constraint_lower[j], s.constraint_upper[j]);
      if (s.constraint_players[j] == of && outside > most) most = outside, worst = j;
    }
    if (!(most > options.constr_viol_tol)) continue;
    const std::string where =
        constraint_name(s, static_cast<Index>(worst)) + " by " + number_text(most, 3);
    return of == Player::Max
               ? "Max's constraints are not met at this x, " + where +
                     ": no y may satisfy them there\n"
                     "should they restrict Min, or should one of their variables be Min's?"
               : "Min's constraints are not met where the search ended, " + where +
                     "\ncheck whether they can be met, or begin elsewhere (minmax_starts)";
  }
  return {};
}

bool joins_players(const ProblemStructure& s) {
  const auto is_joint = [&](Triplet entry) {
    return s.variable_players[at(entry.row)] != s.variable_players[at(entry.col)];
  };
  const auto reads_other = [&](Triplet entry) {
    return s.constraint_players[at(entry.row)] != s.variable_players[at(entry.col)];
  };
  return !s.has_hessian || std::ranges::any_of(s.hessian, is_joint) ||
         std::ranges::any_of(s.jacobian, reads_other);
}

std::string remedies(const ProblemStructure& s, const Result& result) {
  const std::size_t n = s.variable_players.size();
  const bool kink = result.status == Status::NoLocalMinmaxFound;
  const bool runs_away = result.status == Status::InnerUnbounded;
  const bool refuted = result.status == Status::NotLocalMinmax;
  if ((!kink && !runs_away && !refuted) || result.v.size() != n) return {};
  const Shares counts = count(s);
  if (counts.free[0] == 0 || counts.free[1] == 0) return {};
  if (refuted) return at_possible_kink(s);
  std::string text;
  for (const std::string& mistake : split_remarks(s)) text += (text.empty() ? "" : " ") + mistake;
  if (!text.empty()) return text;
  if (runs_away) {
    Index largest = -1;
    for (std::size_t i = 0; i < n; ++i) {
      if (s.variable_players[i] == Player::Max && is_open(s, i) &&
          (largest < 0 || std::abs(result.v[i]) > std::abs(result.v[at(largest)])))
        largest = static_cast<Index>(i);
    }
    if (largest >= 0)
      text = "the disturbance wins: f grows with " + variable_name(s, largest) + "\n";
    if (result.over_y.functions > 0 && !result.worst_cases.empty())  // a robust constraint
      return "what may help: bounds for Max's variables, or feedback for Min";
  }
  return text +
         "what may help: a higher price of Max's variables in f (find_price finds the least one), "
         "tighter bounds for them, feedback for Min" +
         (kink ? ", other starts (minmax_starts)\n" + at_possible_kink(s) : "");
}

std::string coupled_remark(const ProblemStructure& s) {
  const auto is_free = [&](std::size_t i) { return s.variable_lower[i] != s.variable_upper[i]; };
  const auto reads = readers(s, is_free);
  Index coupled = -1;
  for (std::size_t j = reads.size(); j-- > 0;) {
    const bool of_max = s.constraint_players[j] == Player::Max;
    if (!of_max && reads[j][1]) return {};  // robust: the user knows
    if (of_max && reads[j][0] && reads[j][1] && s.constraint_lower[j] < s.constraint_upper[j])
      coupled = static_cast<Index>(j);
  }
  if (coupled < 0) return {};
  return constraint_name(s, coupled) +
         " reads variables of both players and restricts Max. If Min must satisfy it for every y, "
         "give it to Min.";
}

}  // namespace ipminmax
