// (a) The inner maximization is replaced by its first-order conditions. With the inner Lagrangian
// L = f + sum_j lambda_j g_j over the Max constraints,
//
//   min over (v, e, kappa, zeta >= 0)  f(v)
//   subject to  g(v) within its bounds
//               dL/dy_i - (zeta of the upper bound) + (zeta of the lower bound) = 0
//               kappa (bound - g) <= t, zeta (bound - y) <= t     for every finite side
//
// with lambda_j = e_j for an equality and -kappa_upper + kappa_lower for an inequality. Second
// derivatives of the stationarity rows are third derivatives of the game. With their multipliers w
// they are the derivative of the Hessian of L and of J along w; central differences along this one
// direction give them in sparse form at the cost of two Hessians and two Jacobians.

#include <algorithm>
#include <cmath>

#include <support/forwarding_problem.hpp>

#include "../measure.hpp"
#include "ipopt.hpp"

namespace bench {
namespace {

using ipminmax::testing::CountingProblem;

constexpr double kInfinity = 1e19;
constexpr double kFirstRelaxation = 0.1;
constexpr double kLastRelaxation = 1e-9;

class SingleLevelProblem final : public Problem {
 public:
  SingleLevelProblem(Problem& game, std::vector<double> start)
      : game_(game), s_(game.structure()), players_(s_), start_(std::move(start)) {
    n_ = static_cast<Index>(s_.variable_lower.size());
    m_ = static_cast<Index>(s_.constraint_lower.size());
    structure_.variable_lower = s_.variable_lower;
    structure_.variable_upper = s_.variable_upper;
    structure_.constraint_lower = s_.constraint_lower;
    structure_.constraint_upper = s_.constraint_upper;
    add_multipliers();
    structure_.constraint_lower.insert(structure_.constraint_lower.end(), players_.y.size(), 0.0);
    structure_.constraint_upper.insert(structure_.constraint_upper.end(), players_.y.size(), 0.0);
    for (const Multiplier& k : multipliers_) {
      if (k.side == 0.0) continue;
      structure_.constraint_lower.push_back(-2.0 * kInfinity);
      structure_.constraint_upper.push_back(0.0);  // t, by relax()
    }
    structure_.variable_players.assign(structure_.variable_lower.size(), ipminmax::Player::Min);
    structure_.constraint_players.assign(structure_.constraint_lower.size(), ipminmax::Player::Min);
    add_patterns();
    for (auto* v : {&plus_, &minus_}) v->resize(at(n_));
    for (auto* h : {&h_, &h_plus_, &h_minus_}) h->resize(s_.hessian.size());
    for (auto* j : {&j_, &j_plus_, &j_minus_}) j->resize(s_.jacobian.size());
    g_.resize(at(m_));
    lambda_.resize(at(m_));
    start_.resize(structure_.variable_lower.size(), 0.0);
    start_lambda_.assign(structure_.constraint_lower.size(), 0.0);
    start_z_lower_.assign(start_.size(), 1.0);
    start_z_upper_.assign(start_.size(), 1.0);
    start_multipliers();
  }

  void relax(double t) {
    for (std::size_t row = at(m_) + players_.y.size(); row < structure_.constraint_upper.size();
         ++row) {
      structure_.constraint_upper[row] = t;
    }
  }
  void start_from(const IpoptAnswer& answer) {
    start_ = answer.v;
    start_lambda_ = answer.lambda;
    start_z_lower_ = answer.z_lower;
    start_z_upper_ = answer.z_upper;
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    if (!start.lambda.empty()) std::ranges::copy(start_lambda_, start.lambda.begin());
    if (!start.z_lower.empty()) std::ranges::copy(start_z_lower_, start.z_lower.begin());
    if (!start.z_upper.empty()) std::ranges::copy(start_z_upper_, start.z_upper.begin());
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> z, bool, double& f) override {
    return game_.objective(game_part(z), true, f);
  }

  [[nodiscard]] bool gradient(std::span<const double> z, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    return game_.gradient(game_part(z), true, grad.first(at(n_)));
  }

  [[nodiscard]] bool constraints(std::span<const double> z, bool, std::span<double> c) override {
    const auto v = game_part(z);
    std::vector<double>& grad = plus_;
    if (!game_.constraints(v, true, c.first(at(m_))) || !game_.gradient(v, false, grad) ||
        !game_.jacobian(v, false, j_)) {
      return false;
    }
    inner_multipliers(z);
    for (std::size_t i = 0; i < players_.y.size(); ++i) {
      c[at(m_) + i] = grad[at(players_.y[i])];
    }
    for (std::size_t k = 0; k < s_.jacobian.size(); ++k) {
      const auto [row, col] = s_.jacobian[k];
      if (is_max(col)) c[stationarity(col)] += lambda_[at(row)] * j_[k];
    }
    for (const Multiplier& k : multipliers_) {
      if (k.constraint < 0) c[stationarity(k.variable)] -= k.side * z[at(k.place)];
      if (k.side != 0.0) c[at(k.row)] = z[at(k.place)] * gap(k, v, c);
    }
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> z, bool, std::span<double> values) override {
    const auto v = game_part(z);
    inner_multipliers(z);
    if (!game_.jacobian(v, true, j_) || !game_.constraints(v, false, g_) ||
        !game_.hessian(v, false, 1.0, lambda_, true, h_)) {
      return false;
    }
    double* next = std::ranges::copy(j_, values.data()).out;
    for (std::size_t k = 0; k < s_.hessian.size(); ++k) {
      const auto [row, col] = s_.hessian[k];
      if (is_max(row)) *next++ = h_[k];
      if (is_max(col) && row != col) *next++ = h_[k];
    }
    for (const Multiplier& k : multipliers_) {
      const double factor = k.side == 0.0 ? 1.0 : -k.side;  // of the multiplier in lambda
      if (k.constraint < 0) {
        *next++ = factor;
        *next++ = gap(k, v, g_);
        *next++ = -k.side * z[at(k.place)];
        continue;
      }
      for (const std::size_t entry : row_entries_[at(k.constraint)]) {
        if (is_max(s_.jacobian[entry].col)) *next++ = factor * j_[entry];
      }
      if (k.side == 0.0) continue;
      *next++ = gap(k, v, g_);
      for (const std::size_t entry : row_entries_[at(k.constraint)]) {
        *next++ = -k.side * z[at(k.place)] * j_[entry];
      }
    }
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> z, bool, double sigma,
                             std::span<const double> weights, bool,
                             std::span<double> values) override {
    const auto v = game_part(z);
    std::vector<double> direct(weights.begin(), weights.begin() + m_);  // multipliers of g
    for (const Multiplier& k : multipliers_) {
      if (k.constraint >= 0 && k.side != 0.0) {
        direct[at(k.constraint)] -= k.side * weights[at(k.row)] * z[at(k.place)];
      }
    }
    if (!game_.hessian(v, true, sigma, direct, true, h_) || !game_.jacobian(v, false, j_)) {
      return false;
    }
    if (!differences_along(v, z, weights)) return false;

    double* next = values.data();
    for (std::size_t k = 0; k < h_.size(); ++k) *next++ = h_[k] + h_plus_[k];
    for (const Multiplier& k : multipliers_) {
      if (k.constraint < 0) {
        *next++ = -k.side * weights[at(k.row)];
        continue;
      }
      const double factor = k.side == 0.0 ? 1.0 : -k.side;
      for (const std::size_t entry : row_entries_[at(k.constraint)]) {
        *next = factor * j_plus_[entry];
        if (k.side != 0.0) *next -= k.side * weights[at(k.row)] * j_[entry];
        ++next;
      }
    }
    return true;
  }

 private:
  /// Of a Max constraint or of a bound of a Max variable.
  struct Multiplier {
    Index constraint = -1, variable = -1;  ///< one of them
    double side = 0.0;                     ///< +1 upper, -1 lower, 0 equality
    double bound = 0.0;
    Index place = 0;  ///< its variable
    Index row = -1;   ///< its complementarity constraint
  };

  [[nodiscard]] bool is_max(Index variable) const {
    return s_.variable_players[at(variable)] == ipminmax::Player::Max;
  }
  [[nodiscard]] std::size_t stationarity(Index variable) const {
    return at(m_ + players_.place[at(variable)]);
  }
  [[nodiscard]] std::span<const double> game_part(std::span<const double> z) const {
    return z.first(at(n_));
  }
  /// Distance to the bound, >= 0 when feasible; g: values of the constraints.
  [[nodiscard]] static double gap(const Multiplier& k, std::span<const double> v,
                                  std::span<const double> g) {
    return k.side * (k.bound - (k.constraint >= 0 ? g[at(k.constraint)] : v[at(k.variable)]));
  }

  void add_multipliers() {
    Index row = m_ + static_cast<Index>(players_.y.size());
    const auto add = [&](Multiplier k) {
      k.place = static_cast<Index>(structure_.variable_lower.size());
      structure_.variable_lower.push_back(k.side == 0.0 ? -2.0 * kInfinity : 0.0);
      structure_.variable_upper.push_back(2.0 * kInfinity);
      if (k.side != 0.0) k.row = row++;
      multipliers_.push_back(k);
    };
    for (const Index j : players_.max_constraints) {
      const double lower = s_.constraint_lower[at(j)], upper = s_.constraint_upper[at(j)];
      if (lower == upper) {
        add({.constraint = j});
        continue;
      }
      if (upper < kInfinity) add({.constraint = j, .side = 1.0, .bound = upper});
      if (lower > -kInfinity) add({.constraint = j, .side = -1.0, .bound = lower});
    }
    for (const Index i : players_.y) {
      const double lower = s_.variable_lower[at(i)], upper = s_.variable_upper[at(i)];
      if (upper < kInfinity) add({.variable = i, .side = 1.0, .bound = upper});
      if (lower > -kInfinity) add({.variable = i, .side = -1.0, .bound = lower});
    }
    row_entries_.resize(at(m_));
    for (std::size_t k = 0; k < s_.jacobian.size(); ++k) {
      row_entries_[at(s_.jacobian[k].row)].push_back(k);
    }
  }

  /// In the order in which jacobian and hessian write.
  void add_patterns() {
    structure_.jacobian = s_.jacobian;
    structure_.hessian = s_.hessian;
    const auto row_of = [&](Index variable) { return static_cast<Index>(stationarity(variable)); };
    for (const auto& [row, col] : s_.hessian) {
      if (is_max(row)) structure_.jacobian.push_back({row_of(row), col});
      if (is_max(col) && row != col) structure_.jacobian.push_back({row_of(col), row});
    }
    for (const Multiplier& k : multipliers_) {
      if (k.constraint < 0) {
        structure_.jacobian.push_back({row_of(k.variable), k.place});
        structure_.jacobian.push_back({k.row, k.place});
        structure_.jacobian.push_back({k.row, k.variable});
        structure_.hessian.push_back({k.place, k.variable});
        continue;
      }
      for (const std::size_t entry : row_entries_[at(k.constraint)]) {
        const Index col = s_.jacobian[entry].col;
        if (is_max(col)) structure_.jacobian.push_back({row_of(col), k.place});
        structure_.hessian.push_back({k.place, col});
      }
      if (k.side == 0.0) continue;
      structure_.jacobian.push_back({k.row, k.place});
      for (const std::size_t entry : row_entries_[at(k.constraint)]) {
        structure_.jacobian.push_back({k.row, s_.jacobian[entry].col});
      }
    }
  }

  /// lambda of the inner Lagrangian, zero for Min constraints.
  void inner_multipliers(std::span<const double> z) {
    std::ranges::fill(lambda_, 0.0);
    for (const Multiplier& k : multipliers_) {
      if (k.constraint < 0) continue;
      lambda_[at(k.constraint)] += (k.side == 0.0 ? 1.0 : -k.side) * z[at(k.place)];
    }
  }

  /// h_plus_ and j_plus_: derivatives of the Hessian of L and of J along the stationarity weights.
  bool differences_along(std::span<const double> v, std::span<const double> z,
                         std::span<const double> weights) {
    double largest = 0.0, size = 1.0;
    for (std::size_t i = 0; i < players_.y.size(); ++i) {
      largest = std::max(largest, std::abs(weights[at(m_) + i]));
      size = std::max(size, std::abs(v[at(players_.y[i])]));
    }
    if (largest == 0.0) {
      std::ranges::fill(h_plus_, 0.0);
      std::ranges::fill(j_plus_, 0.0);
      return true;
    }
    const double step = 1e-5 * size / largest;
    std::ranges::copy(v, plus_.begin());
    std::ranges::copy(v, minus_.begin());
    for (std::size_t i = 0; i < players_.y.size(); ++i) {
      plus_[at(players_.y[i])] += step * weights[at(m_) + i];
      minus_[at(players_.y[i])] -= step * weights[at(m_) + i];
    }
    inner_multipliers(z);
    if (!game_.hessian(plus_, true, 1.0, lambda_, true, h_plus_) ||
        !game_.jacobian(plus_, false, j_plus_) ||
        !game_.hessian(minus_, true, 1.0, lambda_, true, h_minus_) ||
        !game_.jacobian(minus_, false, j_minus_)) {
      return false;
    }
    const auto difference = [step](std::vector<double>& plus, const std::vector<double>& minus) {
      for (std::size_t k = 0; k < plus.size(); ++k) plus[k] = (plus[k] - minus[k]) / (2.0 * step);
    };
    difference(h_plus_, h_minus_);
    difference(j_plus_, j_minus_);
    return true;
  }

  /// kappa = t / gap where the gap is clear, at most 1.
  void start_multipliers() {
    const std::span<const double> v(start_.data(), at(n_));
    if (!game_.constraints(v, true, g_)) return;
    for (const Multiplier& k : multipliers_) {
      if (k.side == 0.0) continue;
      start_[at(k.place)] = std::min(1.0, kFirstRelaxation / std::max(gap(k, v, g_), 1e-2));
    }
  }

  Problem& game_;
  const ipminmax::ProblemStructure& s_;
  Players players_;
  Index n_ = 0, m_ = 0;
  ipminmax::ProblemStructure structure_;
  std::vector<Multiplier> multipliers_;
  std::vector<std::vector<std::size_t>> row_entries_;  ///< Jacobian entries of each constraint
  std::vector<double> start_, start_lambda_, start_z_lower_, start_z_upper_;
  std::vector<double> plus_, minus_, g_, lambda_;
  std::vector<double> h_, h_plus_, h_minus_, j_, j_plus_, j_minus_;
};

}  // namespace

std::unique_ptr<Problem> single_level_problem(const Game& game, std::span<const double> start) {
  return std::make_unique<SingleLevelProblem>(*game.problem,
                                              std::vector<double>(start.begin(), start.end()));
}

Answer solve_single_level(Game& game, std::span<const double> start, const Limits& limits) {
  const Clock clock;
  const CpuClock cpu;
  CountingProblem counted(*game.problem);
  SingleLevelProblem problem(counted, {start.begin(), start.end()});
  IpoptMinimizer ipopt(1e-8);
  for (const char* push :
       {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
        "warm_start_slack_bound_frac", "warm_start_mult_bound_push"}) {
    ipopt.options().SetNumericValue(push, 1e-9);
  }
  Answer answer;
  for (double t = kFirstRelaxation; t > 0.5 * kLastRelaxation; t *= 0.1) {
    problem.relax(t);
    ipopt.options().SetNumericValue("tol", std::min(1e-8, t));
    const IpoptAnswer found = ipopt.minimize(problem, limits.seconds - cpu.seconds());
    answer.claims = solved_well(found);
    if (!found.v.empty()) answer.v.assign(found.v.begin(), found.v.begin() + std::ssize(start));
    if (!answer.claims) break;
    problem.start_from(found);
    ipopt.options().SetStringValue("warm_start_init_point", "yes");
    ipopt.options().SetNumericValue("mu_init", 0.1 * t);
  }
  answer.seconds = clock.seconds();
  answer.counts = counted.counts();
  return answer;
}

}  // namespace bench
