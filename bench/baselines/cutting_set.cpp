// (c) Cutting sets. A scenario is a choice w of the Max variables that are not states; its states
// follow from x and w by the Max equalities, so every scenario brings a copy s_k of them:
//
//   min over (x, t, s_1, s_2, ...)  t
//   subject to  g_x(x) within its bounds,  f(x, w_k, s_k) <= t,  g_y(x, w_k, s_k) = 0   for all k

#include <algorithm>
#include <cmath>

#include <support/forwarding_problem.hpp>

#include "../measure.hpp"
#include "ipopt.hpp"

namespace bench {
namespace {

using ipminmax::testing::CountingProblem;

constexpr double kInfinity = 2e19;
constexpr double kTolerance = 1e-9;  // of both problems
constexpr double kViolation = 1e-7;  // of f(x, y) <= t, relative; ends the method
constexpr std::size_t kMaxScenarios = 100;

class ScenarioProblem final : public Problem {
 public:
  ScenarioProblem(Problem& game, const std::vector<Index>& states)
      : game_(game), s_(game.structure()), players_(s_), states_(states) {
    place_.assign(s_.variable_lower.size(), -1);
    for (std::size_t i = 0; i < states.size(); ++i) place_[at(states[i])] = static_cast<Index>(i);
    for (const Index i : players_.x) {
      structure_.variable_lower.push_back(s_.variable_lower[at(i)]);
      structure_.variable_upper.push_back(s_.variable_upper[at(i)]);
    }
    structure_.variable_lower.push_back(-kInfinity);  // t
    structure_.variable_upper.push_back(kInfinity);
    for (const Index j : players_.min_constraints) {
      structure_.constraint_lower.push_back(s_.constraint_lower[at(j)]);
      structure_.constraint_upper.push_back(s_.constraint_upper[at(j)]);
    }
    if (!states.empty()) {
      for (const Index j : players_.max_constraints) {
        if (s_.constraint_lower[at(j)] == s_.constraint_upper[at(j)]) equalities_.push_back(j);
      }
    }
    row_place_.assign(s_.constraint_lower.size(), -1);
    for (std::size_t j = 0; j < equalities_.size(); ++j) {
      row_place_[at(equalities_[j])] = static_cast<Index>(j);
    }
    gradient_.resize(s_.variable_lower.size());
    g_.resize(s_.constraint_lower.size());
    lambda_.resize(s_.constraint_lower.size());
    j_.resize(s_.jacobian.size());
    h_.resize(s_.hessian.size());
  }

  /// Whether scenarios make sense: no Max constraint but the states' equations reads x.
  [[nodiscard]] bool applicable() const {
    if (equalities_.size() != states_.size()) return false;
    return std::ranges::all_of(s_.jacobian, [&](const ipminmax::Triplet& entry) {
      const bool max = s_.constraint_players[at(entry.row)] == ipminmax::Player::Max;
      const bool reads = is_x(entry.col) || place_[at(entry.col)] >= 0;
      return !max || !reads || row_place_[at(entry.row)] >= 0;
    });
  }

  [[nodiscard]] std::size_t scenarios() const { return scenarios_.size(); }

  /// v: x and states to start from, and the new scenario.
  void add_scenario(const std::vector<double>& v, double value) {
    scenarios_.push_back(v);
    start_.resize(players_.x.size() + 1);
    for (std::size_t i = 0; i < players_.x.size(); ++i) start_[i] = v[at(players_.x[i])];
    start_[players_.x.size()] = value;
    for (const std::vector<double>& scenario : scenarios_) {
      for (const Index i : states_) start_.push_back(scenario[at(i)]);
    }
    structure_.variable_lower.insert(structure_.variable_lower.end(), states_.size(), -kInfinity);
    structure_.variable_upper.insert(structure_.variable_upper.end(), states_.size(), kInfinity);
    structure_.constraint_lower.push_back(-kInfinity);
    structure_.constraint_upper.push_back(0.0);
    for (const Index j : equalities_) {
      structure_.constraint_lower.push_back(s_.constraint_lower[at(j)]);
      structure_.constraint_upper.push_back(s_.constraint_upper[at(j)]);
    }
    structure_.variable_players.assign(structure_.variable_lower.size(), ipminmax::Player::Min);
    structure_.constraint_players.assign(structure_.constraint_lower.size(), ipminmax::Player::Min);
    add_patterns();
  }

  /// The x of a point, in the game's variables.
  void put_x(std::span<const double> z, std::vector<double>& v) const {
    for (std::size_t i = 0; i < players_.x.size(); ++i) v[at(players_.x[i])] = z[i];
  }
  [[nodiscard]] double t_of(std::span<const double> z) const { return z[players_.x.size()]; }
  /// Keeps the states of an answer for the next start.
  void take_states(std::span<const double> z) {
    for (std::size_t k = 0; k < scenarios_.size(); ++k) load(k, z, scenarios_[k]);
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    return !start.needs_multipliers;
  }

  [[nodiscard]] bool objective(std::span<const double> z, bool, double& f) override {
    f = t_of(z);
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> z, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    grad[players_.x.size()] = 1.0;
    return z.size() == grad.size();
  }

  [[nodiscard]] bool constraints(std::span<const double> z, bool, std::span<double> c) override {
    std::size_t row = players_.min_constraints.size();
    for (std::size_t k = 0; k < scenarios_.size(); ++k) {
      load(k, z, v_);
      double f = 0.0;
      if (!game_.objective(v_, true, f)) return false;
      if (!g_.empty() && !game_.constraints(v_, false, g_)) return false;
      if (k == 0) {
        for (std::size_t j = 0; j < players_.min_constraints.size(); ++j) {
          c[j] = g_[at(players_.min_constraints[j])];
        }
      }
      c[row++] = f - t_of(z);
      for (const Index j : equalities_) c[row++] = g_[at(j)];
    }
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> z, bool, std::span<double> values) override {
    double* next = values.data();
    for (std::size_t k = 0; k < scenarios_.size(); ++k) {
      load(k, z, v_);
      if (!game_.gradient(v_, true, gradient_)) return false;
      if (!j_.empty() && !game_.jacobian(v_, false, j_)) return false;
      if (k == 0) {
        for (std::size_t e = 0; e < j_.size(); ++e) {
          if (is_min_row(s_.jacobian[e].row)) *next++ = j_[e];
        }
      }
      *next++ = -1.0;
      for (std::size_t i = 0; i < gradient_.size(); ++i) {
        if (is_variable(static_cast<Index>(i))) *next++ = gradient_[i];
      }
      for (std::size_t e = 0; e < j_.size(); ++e) {
        const auto [row, col] = s_.jacobian[e];
        if (row_place_[at(row)] >= 0 && is_variable(col)) *next++ = j_[e];
      }
    }
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> z, bool, double,
                             std::span<const double> multipliers, bool,
                             std::span<double> values) override {
    double* next = values.data();
    std::size_t row = players_.min_constraints.size();
    for (std::size_t k = 0; k < scenarios_.size(); ++k) {
      load(k, z, v_);
      std::ranges::fill(lambda_, 0.0);
      if (k == 0) {
        for (std::size_t j = 0; j < players_.min_constraints.size(); ++j) {
          lambda_[at(players_.min_constraints[j])] = multipliers[j];
        }
      }
      const double weight = multipliers[row++];
      for (const Index j : equalities_) lambda_[at(j)] = multipliers[row++];
      if (!game_.hessian(v_, true, weight, lambda_, true, h_)) return false;
      for (std::size_t e = 0; e < h_.size(); ++e) {
        if (is_variable(s_.hessian[e].row) && is_variable(s_.hessian[e].col)) *next++ = h_[e];
      }
    }
    return true;
  }

 private:
  [[nodiscard]] bool is_x(Index i) const {
    return s_.variable_players[at(i)] == ipminmax::Player::Min;
  }
  [[nodiscard]] bool is_variable(Index i) const { return is_x(i) || place_[at(i)] >= 0; }
  [[nodiscard]] bool is_min_row(Index j) const {
    return s_.constraint_players[at(j)] == ipminmax::Player::Min;
  }
  /// The place of a game variable of scenario k.
  [[nodiscard]] Index variable(std::size_t k, Index i) const {
    if (is_x(i)) return players_.place[at(i)];
    return static_cast<Index>(players_.x.size() + 1 + k * states_.size()) + place_[at(i)];
  }

  void load(std::size_t k, std::span<const double> z, std::vector<double>& v) const {
    v = scenarios_[k];
    put_x(z, v);
    for (const Index i : states_) v[at(i)] = z[at(variable(k, i))];
  }

  /// In the order in which jacobian and hessian write.
  void add_patterns() {
    structure_.jacobian.clear();
    structure_.hessian.clear();
    auto row = static_cast<Index>(players_.min_constraints.size());
    const auto n = static_cast<Index>(s_.variable_lower.size());
    for (std::size_t k = 0; k < scenarios_.size(); ++k) {
      if (k == 0) {
        for (const auto& [min_row, col] : s_.jacobian) {
          if (!is_min_row(min_row)) continue;
          structure_.jacobian.push_back(
              {players_.constraint_place[at(min_row)], players_.place[at(col)]});
        }
      }
      structure_.jacobian.push_back({row, static_cast<Index>(players_.x.size())});
      for (Index i = 0; i < n; ++i) {
        if (is_variable(i)) structure_.jacobian.push_back({row, variable(k, i)});
      }
      ++row;
      for (const auto& [equality, col] : s_.jacobian) {
        if (row_place_[at(equality)] < 0 || !is_variable(col)) continue;
        structure_.jacobian.push_back({row + row_place_[at(equality)], variable(k, col)});
      }
      row += static_cast<Index>(equalities_.size());
      for (const auto& [a, b] : s_.hessian) {
        if (is_variable(a) && is_variable(b)) {
          structure_.hessian.push_back({variable(k, a), variable(k, b)});
        }
      }
    }
  }

  Problem& game_;
  const ipminmax::ProblemStructure& s_;
  Players players_;
  const std::vector<Index>& states_;
  std::vector<Index> place_;       ///< of a state among the states, -1 for others
  std::vector<Index> equalities_;  ///< Max equalities, that is the states' equations
  std::vector<Index> row_place_;   ///< of an equality among them, -1 for others
  std::vector<std::vector<double>> scenarios_;
  ipminmax::ProblemStructure structure_;
  std::vector<double> start_, v_, gradient_, g_, lambda_, j_, h_;
};

/// The better of two local maxima over y: from the last worst case and from the start.
IpoptAnswer pessimize(IpoptMinimizer& ipopt, InnerProblem& inner, const std::vector<double>& v,
                      std::span<const double> start, const Players& players, double seconds) {
  inner.point() = v;
  IpoptAnswer best = ipopt.minimize(inner, seconds);
  for (const Index i : players.y) inner.point()[at(i)] = start[at(i)];
  IpoptAnswer other = ipopt.minimize(inner, seconds);
  const bool better =
      solved_well(other) && (!solved_well(best) || other.objective < best.objective - kTolerance);
  return better ? other : best;
}

}  // namespace

std::unique_ptr<Problem> scenario_problem(const Game& game,
                                          std::span<const std::vector<double>> scenarios) {
  auto problem = std::make_unique<ScenarioProblem>(*game.problem, game.states);
  for (const std::vector<double>& scenario : scenarios) problem->add_scenario(scenario, 1.0);
  return problem;
}

Answer solve_cutting_set(Game& game, std::span<const double> start, const Limits& limits) {
  const Clock clock;
  const CpuClock cpu;
  CountingProblem counted(*game.problem);
  const Players players(counted.structure());
  ScenarioProblem master(counted, game.states);
  Answer answer;
  answer.applicable = master.applicable();
  if (!answer.applicable) return answer;

  std::vector<double> v(start.begin(), start.end());
  InnerProblem inner(counted, players, v);
  IpoptMinimizer ipopt(kTolerance);
  double value = 0.0;
  if (counted.objective(v, true, value)) master.add_scenario(v, value);
  while (master.scenarios() > 0 && master.scenarios() <= kMaxScenarios) {
    const double left = limits.seconds - cpu.seconds();
    if (left <= 0.0) break;
    const IpoptAnswer outer = ipopt.minimize(master, left);
    if (!solved_well(outer)) break;
    master.take_states(outer.v);
    master.put_x(outer.v, v);
    const double t = master.t_of(outer.v);
    const IpoptAnswer worst =
        pessimize(ipopt, inner, v, start, players, limits.seconds - cpu.seconds());
    if (!solved_well(worst)) break;
    inner.point() = v;
    v = inner.point_with(worst.v);
    answer.v = v;
    answer.claims = -worst.objective <= t + kViolation * (1.0 + std::abs(t));
    if (answer.claims) break;
    master.add_scenario(v, -worst.objective);
  }
  answer.seconds = clock.seconds();
  answer.counts = counted.counts();
  return answer;
}

}  // namespace bench
