#include <algorithm>
#include <numeric>
#include <stdexcept>

#include <Eigen/Dense>
#include <examples/chauffeur_tnlp.hpp>
#include <problems/scalable_problems.hpp>
#include <problems/small_problems.hpp>

#include <examples/sequential_chauffeur.hpp>
#include "adapter/ipopt/tnlp_problem.hpp"
#include "game.hpp"

namespace bench {
namespace {

using ipminmax::Player;

std::function<void(std::span<double>)> projection_on_bounds(
    const ipminmax::ProblemStructure& structure) {
  return [lower = structure.variable_lower, upper = structure.variable_upper](auto v) {
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = std::clamp(v[i], lower[i], upper[i]);
  };
}

/// Onto the ball of the given radius.
void project_on_ball(std::span<double> v, double radius) {
  const double length = std::sqrt(std::inner_product(v.begin(), v.end(), v.begin(), 0.0));
  if (length <= radius) return;
  for (double& value : v) value *= radius / length;
}

// --- The homicidal chauffeur ---------------------------------------------------------------------

Game chauffeur_game(int horizon) {
  const chauffeur::Parameters p = chauffeur::refined(horizon);
  const chauffeur::State state;
  Game game{.name = "chauffeur T=" + std::to_string(horizon)};
  auto problem = std::make_unique<ipminmax::TnlpProblem>(
      new chauffeur::ChauffeurTNLP(p, state, chauffeur::Control{}));
  if (const std::string error = problem->load(); !error.empty()) throw std::runtime_error(error);
  game.problem = std::move(problem);
  auto sequential = std::make_unique<chauffeur::SequentialChauffeur>(
      p, state, std::vector<chauffeur::Control>(at(horizon)));
  game.reduced = std::move(sequential);

  // Stage i of the game: u, p (3), d (2), e (2); reduced: all u, then all d.
  const auto T = at(horizon);
  game.reduce = [T](std::span<const double> v) {
    std::vector<double> z(3 * T);
    for (std::size_t i = 0; i < T; ++i) {
      z[i] = v[8 * i];
      z[T + 2 * i] = v[8 * i + 4];
      z[T + 2 * i + 1] = v[8 * i + 5];
    }
    return z;
  };
  game.lift = [T, p, state](std::span<const double> z) {
    std::vector<double> v;
    chauffeur::State s = state;
    for (std::size_t i = 0; i < T; ++i) {
      const chauffeur::Control c{z[i], z[T + 2 * i], z[T + 2 * i + 1]};
      s = advance(s, c, p.speed);
      v.insert(v.end(), {c.u, s.px, s.py, s.heading, c.dx, c.dy, s.ex, s.ey});
    }
    return v;
  };
  game.project = [T, p](std::span<double> z) {
    for (std::size_t i = 0; i < T; ++i) {
      z[i] = std::clamp(z[i], -p.u_max, p.u_max);
      project_on_ball(z.subspan(T + 2 * i, 2), p.d_max);
    }
  };
  game.random_start = [T, p, lift = game.lift](Random& random) {
    std::vector<double> z(3 * T);
    for (std::size_t k = 0; k < z.size(); ++k) {
      const double largest = 0.5 * (k < T ? p.u_max : p.d_max);
      z[k] = uniform(random, -largest, largest);
    }
    return lift(z);
  };
  for (Index i = 0; i < horizon; ++i) {  // the evader's position
    game.states.push_back(8 * i + 6);
    game.states.push_back(8 * i + 7);
  }
  return game;
}

// --- Linear dynamics -----------------------------------------------------------------------------

/// A quadratic game with linear Max equalities without these and their states: dense, and with
/// gradients only, for first-order methods.
class EliminatedProblem final : public Problem {
 public:
  EliminatedProblem(Problem& game, const std::vector<Index>& states) {
    const ipminmax::ProblemStructure& s = game.structure();
    const auto n = static_cast<Eigen::Index>(s.variable_lower.size());
    const auto m = static_cast<Eigen::Index>(s.constraint_lower.size());
    std::vector<bool> is_state(at(static_cast<Index>(n)), false);
    for (const Index i : states) is_state[at(i)] = true;
    for (Index i = 0; i < n; ++i) {
      if (is_state[at(i)]) continue;
      free_.push_back(i);
      structure_.variable_players.push_back(s.variable_players[at(i)]);
      structure_.variable_lower.push_back(s.variable_lower[at(i)]);
      structure_.variable_upper.push_back(s.variable_upper[at(i)]);
    }
    // f = c + q'v + v'Hv/2, J v + g0 = b
    const std::vector<double> zero(at(static_cast<Index>(n)), 0.0);
    const std::vector<double> no_multipliers(at(static_cast<Index>(m)), 0.0);
    std::vector<double> h(s.hessian.size()), j(s.jacobian.size());
    Eigen::VectorXd q(n), g0(m);
    const bool ok = game.objective(zero, true, constant_) &&
                    game.gradient(zero, false, {q.data(), at(static_cast<Index>(n))}) &&
                    game.constraints(zero, false, {g0.data(), at(static_cast<Index>(m))}) &&
                    game.jacobian(zero, false, j) &&
                    game.hessian(zero, false, 1.0, no_multipliers, true, h);
    if (!ok) throw std::logic_error("the game cannot be evaluated at 0");
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n), jacobian = Eigen::MatrixXd::Zero(m, n);
    for (std::size_t k = 0; k < h.size(); ++k) {
      const auto [row, col] = s.hessian[k];
      hessian(row, col) += h[k];
      if (row != col) hessian(col, row) += h[k];
    }
    for (std::size_t k = 0; k < j.size(); ++k)
      jacobian(s.jacobian[k].row, s.jacobian[k].col) += j[k];
    const Eigen::Map<const Eigen::VectorXd> b(s.constraint_upper.data(), m);

    // v = Z z + v0
    const auto nz = static_cast<Eigen::Index>(free_.size());
    const Eigen::PartialPivLU<Eigen::MatrixXd> lu(jacobian(Eigen::all, states));
    const Eigen::MatrixXd follow = -lu.solve(jacobian(Eigen::all, free_));
    const Eigen::VectorXd offset = lu.solve(b - g0);
    lift_ = Eigen::MatrixXd::Zero(n, nz);
    offset_ = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 0; k < nz; ++k) lift_(free_[static_cast<std::size_t>(k)], k) = 1.0;
    for (std::size_t k = 0; k < states.size(); ++k) {
      lift_.row(states[k]) = follow.row(static_cast<Eigen::Index>(k));
      offset_[states[k]] = offset[static_cast<Eigen::Index>(k)];
    }
    hessian_ = lift_.transpose() * hessian * lift_;
    linear_ = lift_.transpose() * (q + hessian * offset_);
    constant_ += q.dot(offset_) + 0.5 * offset_.dot(hessian * offset_);
  }

  [[nodiscard]] std::vector<double> reduce(std::span<const double> v) const {
    std::vector<double> z;
    for (const Index i : free_) z.push_back(v[at(i)]);
    return z;
  }
  [[nodiscard]] std::vector<double> lift(std::span<const double> z) const {
    const Eigen::VectorXd v = lift_ * map(z) + offset_;
    return {v.begin(), v.end()};
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint&) override { return true; }
  [[nodiscard]] bool objective(std::span<const double> z, bool, double& f) override {
    f = constant_ + map(z).dot(linear_ + 0.5 * (hessian_ * map(z)));
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> z, bool, std::span<double> grad) override {
    Eigen::Map<Eigen::VectorXd>(grad.data(), std::ssize(grad)).noalias() =
        linear_ + hessian_ * map(z);
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double>) override {
    return true;  // bounds only
  }
  [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double>) override {
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double>) override {
    return false;
  }

 private:
  static Eigen::Map<const Eigen::VectorXd> map(std::span<const double> z) {
    return {z.data(), std::ssize(z)};
  }

  std::vector<Index> free_;
  ipminmax::ProblemStructure structure_;
  Eigen::MatrixXd lift_, hessian_;
  Eigen::VectorXd offset_, linear_;
  double constant_ = 0.0;
};

/// states: the last ones of the variables. Starts: random controls within bounds (unbounded ones
/// in [-1, 1]) and the states that follow.
Game linear_dynamics_game(std::string name, std::unique_ptr<Problem> problem, Index states) {
  Game game{.name = std::move(name), .problem = std::move(problem)};
  const auto n = static_cast<Index>(game.problem->structure().variable_lower.size());
  for (Index i = n - states; i < n; ++i) game.states.push_back(i);
  const auto eliminated = std::make_shared<EliminatedProblem>(*game.problem, game.states);
  game.reduced = std::make_unique<EliminatedProblem>(*eliminated);
  game.reduce = [eliminated](std::span<const double> v) { return eliminated->reduce(v); };
  game.lift = [eliminated](std::span<const double> z) { return eliminated->lift(z); };
  game.project = projection_on_bounds(game.reduced->structure());
  game.random_start = [eliminated](Random& random) {
    const ipminmax::ProblemStructure& s = eliminated->structure();
    std::vector<double> z;
    for (std::size_t i = 0; i < s.variable_lower.size(); ++i) {
      const bool bounded = s.variable_upper[i] < 1e19;
      z.push_back(bounded ? uniform(random, s.variable_lower[i], s.variable_upper[i])
                          : uniform(random, -1.0, 1.0));
    }
    return eliminated->lift(z);
  };
  return game;
}

Game mpc_game(int horizon) {
  return linear_dynamics_game("robust MPC T=" + std::to_string(horizon),
                              ipminmax::testing::f17_mpc_box(horizon).problem, 2 * horizon);
}

Game elliptic_control_game(int nodes) {
  return linear_dynamics_game("elliptic control " + std::to_string(nodes),
                              ipminmax::testing::f19_pde(nodes).problem, nodes);
}

// --- Others --------------------------------------------------------------------------------------

/// Least squares whose data an adversary moves within a ball.
Game regression_game(int rows, int n) {
  Game game{.name = "robust regression " + std::to_string(rows) + "x" + std::to_string(n)};
  game.problem = ipminmax::testing::f12_robust_ls(rows, n).problem;
  const ipminmax::ProblemStructure& s = game.problem->structure();
  const double radius = std::sqrt(2.0 * s.constraint_upper.front());
  const std::size_t size = s.variable_lower.size();
  game.project = [n, radius](std::span<double> v) { project_on_ball(v.subspan(at(n)), radius); };
  game.random_start = [n, radius, size](Random& random) {
    std::vector<double> v;
    for (std::size_t i = 0; i < size; ++i) v.push_back(uniform(random, -1.0, 1.0));
    project_on_ball(std::span(v).subspan(at(n)), 0.5 * radius);
    return v;
  };
  return game;
}

Game small_game(const std::string& name, bool projectable) {
  const ipminmax::testing::SmallProblem& small = ipminmax::testing::small_problem(name);
  Game game{.name = name};
  game.problem = std::make_unique<ipminmax::testing::AutodiffProblem>(small.model, small.starts[0]);
  if (projectable) game.project = projection_on_bounds(game.problem->structure());
  game.random_start = [box = small.random_start_box](Random& random) {
    std::vector<double> v;
    for (const auto& [lower, upper] : box) v.push_back(uniform(random, lower, upper));
    return v;
  };
  return game;
}

/// A family with bounds at most; starts within `distance` of its planted solution and the bounds.
Game planted_game(ipminmax::testing::ScalableProblem planted, double distance) {
  Game game{.name = planted.name};
  game.problem = std::move(planted.problem);
  game.project = projection_on_bounds(game.problem->structure());
  game.random_start = [v0 = planted.v, distance, project = game.project](Random& random) {
    std::vector<double> v = v0;
    for (double& value : v) value += uniform(random, -distance, distance);
    project(v);
    return v;
  };
  return game;
}

}  // namespace

std::vector<Game> games() {
  std::vector<Game> all;
  all.push_back(chauffeur_game(20));
  all.push_back(regression_game(30, 10));
  all.push_back(mpc_game(20));
  all.push_back(mpc_game(60));
  all.push_back(elliptic_control_game(50));
  all.push_back(small_game("paper_f3", true));
  all.push_back(small_game("rh7", true));
  all.push_back(small_game("attack_ball", false));  // Y depends on x
  all.push_back(planted_game(ipminmax::testing::f05_trig(100), 1.0));
  all.push_back(planted_game(ipminmax::testing::f03_quad_box(120), 1.0));
  return all;
}

}  // namespace bench
