// (b) An outer minimizer whose objective is the value of an inner maximization.

#include <algorithm>

#include <support/forwarding_problem.hpp>

#include "../measure.hpp"
#include "ipopt.hpp"

namespace bench {
namespace {

using ipminmax::testing::CountingProblem;

constexpr double kInnerTolerance = 1e-9;
constexpr double kOuterTolerance = 1e-7;  // what the inner tolerance leaves of the gradient

/// min over x of phi(x) = max over y of f(x, y). Every new x costs an inner solve, started from the
/// last y; with the inner multipliers lambda, phi' = f_x + J_yx' lambda.
class OuterProblem final : public Problem {
 public:
  OuterProblem(Problem& game, std::vector<double> start, double seconds)
      : game_(game),
        players_(game.structure()),
        inner_(game, players_, std::move(start)),
        seconds_(seconds) {
    const ipminmax::ProblemStructure& s = game.structure();
    for (const Index i : players_.x) {
      structure_.variable_lower.push_back(s.variable_lower[at(i)]);
      structure_.variable_upper.push_back(s.variable_upper[at(i)]);
    }
    for (const Index j : players_.min_constraints) {
      structure_.constraint_lower.push_back(s.constraint_lower[at(j)]);
      structure_.constraint_upper.push_back(s.constraint_upper[at(j)]);
    }
    structure_.variable_players.assign(players_.x.size(), ipminmax::Player::Min);
    structure_.constraint_players.assign(players_.min_constraints.size(), ipminmax::Player::Min);
    for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
      const auto [row, col] = s.jacobian[k];
      if (s.constraint_players[at(row)] != ipminmax::Player::Min) continue;
      jacobian_entries_.push_back(k);
      structure_.jacobian.push_back({players_.constraint_place[at(row)], players_.place[at(col)]});
    }
    gradient_.resize(s.variable_lower.size());
    constraints_.resize(s.constraint_lower.size());
    jacobian_.resize(s.jacobian.size());
  }

  /// The point of x with its inner maximum; empty when that was not found.
  [[nodiscard]] std::vector<double> point_of(std::span<const double> x) {
    return maximize(x) ? inner_.point() : std::vector<double>{};
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    for (std::size_t i = 0; i < players_.x.size(); ++i) {
      start.v[i] = inner_.point()[at(players_.x[i])];
    }
    return !start.needs_multipliers;
  }

  [[nodiscard]] bool objective(std::span<const double> x, bool, double& phi) override {
    if (!maximize(x)) return false;
    phi = phi_;
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> x, bool, std::span<double> grad) override {
    if (!maximize(x) || !game_.gradient(inner_.point(), true, gradient_) ||
        !game_.jacobian(inner_.point(), false, jacobian_)) {
      return false;
    }
    for (std::size_t i = 0; i < x.size(); ++i) grad[i] = gradient_[at(players_.x[i])];
    const ipminmax::ProblemStructure& s = game_.structure();
    for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
      const auto [row, col] = s.jacobian[k];
      const bool of_max = s.constraint_players[at(row)] == ipminmax::Player::Max;
      if (!of_max || s.variable_players[at(col)] != ipminmax::Player::Min) continue;
      // Ipopt's multipliers belong to -f.
      grad[at(players_.place[at(col)])] -=
          jacobian_[k] * lambda_[at(players_.constraint_place[at(row)])];
    }
    return true;
  }

  [[nodiscard]] bool constraints(std::span<const double> x, bool, std::span<double> g) override {
    if (!game_.constraints(with_x(x), true, constraints_)) return false;
    for (std::size_t j = 0; j < g.size(); ++j) {
      g[j] = constraints_[at(players_.min_constraints[j])];
    }
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> x, bool, std::span<double> values) override {
    if (!game_.jacobian(with_x(x), true, jacobian_)) return false;
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = jacobian_[jacobian_entries_[k]];
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double>) override {
    return false;  // limited memory
  }

 private:
  [[nodiscard]] std::vector<double> with_x(std::span<const double> x) {
    std::vector<double> v = inner_.point();
    for (std::size_t i = 0; i < x.size(); ++i) v[at(players_.x[i])] = x[i];
    return v;
  }

  bool maximize(std::span<const double> x) {
    if (std::ranges::equal(x, last_x_)) return last_ok_;
    last_x_.assign(x.begin(), x.end());
    last_ok_ = false;
    const double left = seconds_ - clock_.seconds();
    if (left <= 0.0) return false;
    const std::vector<double> before = inner_.point();
    inner_.point() = with_x(x);
    const IpoptAnswer answer = ipopt_.minimize(inner_, left);
    if (!solved_well(answer)) {
      inner_.point() = before;
      return false;
    }
    inner_.point() = inner_.point_with(answer.v);
    phi_ = -answer.objective;
    lambda_ = answer.lambda;
    return last_ok_ = true;
  }

  Problem& game_;
  Players players_;
  InnerProblem inner_;
  IpoptMinimizer ipopt_{kInnerTolerance};
  CpuClock clock_;
  double seconds_;
  ipminmax::ProblemStructure structure_;
  std::vector<std::size_t> jacobian_entries_;
  std::vector<double> last_x_, lambda_, gradient_, constraints_, jacobian_;
  double phi_ = 0.0;
  bool last_ok_ = false;
};

}  // namespace

Answer solve_nested_ipopt(Game& game, std::span<const double> start, const Limits& limits) {
  const Clock clock;
  CountingProblem counted(*game.problem);
  OuterProblem problem(counted, {start.begin(), start.end()}, limits.seconds);
  IpoptMinimizer outer(kOuterTolerance);
  outer.options().SetStringValue("hessian_approximation", "limited-memory");
  const IpoptAnswer found = outer.minimize(problem, limits.seconds);
  Answer answer;
  if (!found.v.empty()) answer.v = problem.point_of(found.v);
  answer.claims = solved_well(found) && !answer.v.empty();
  answer.seconds = clock.seconds();
  answer.counts = counted.counts();
  return answer;
}

}  // namespace bench
