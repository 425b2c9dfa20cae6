// (d) Projected gradient descent ascent and extragradient, with constant steps for x and y.

#include <algorithm>
#include <array>
#include <cmath>

#include <support/forwarding_problem.hpp>

#include "../measure.hpp"
#include "ipopt.hpp"

namespace bench {
namespace {

using ipminmax::testing::CountingProblem;

constexpr double kTolerance = 1e-7;  // of the natural residual |P(z - F(z)) - z|
constexpr int kMaxSteps = 200000;
constexpr int kTuningSteps = 2000;
constexpr int kTuningStarts = 2;

class FirstOrderMethod {
 public:
  FirstOrderMethod(Game& game, Problem& problem)
      : game_(game), problem_(problem), players_(problem.structure().variable_players) {
    for (auto* v : {&g_, &middle_, &next_}) v->resize(players_.size());
  }

  /// Steps from z until the residual is small; returns the last one, infinite when z ran away.
  double run(std::vector<double>& z, const Game::Steps& steps, bool extragradient, int count,
             double seconds) {
    const CpuClock clock;
    game_.project(z);
    double residual = INFINITY;
    for (int k = 0; k < count; ++k) {
      if (!gradient(z)) return INFINITY;
      step(z, {1.0, 1.0}, next_);
      residual = distance(next_, z);
      if (!std::isfinite(residual) || residual > 1e10) return INFINITY;
      if (residual <= kTolerance) return residual;
      if (k % 256 == 255 && clock.seconds() > seconds) return residual;
      step(z, steps, middle_);
      if (extragradient) {
        if (!gradient(middle_)) return INFINITY;
        step(z, steps, middle_);
      }
      z.swap(middle_);
    }
    return residual;
  }

 private:
  bool gradient(const std::vector<double>& z) { return problem_.gradient(z, true, g_); }

  /// to = P(z -+ steps g)
  void step(const std::vector<double>& z, const Game::Steps& steps, std::vector<double>& to) {
    for (std::size_t i = 0; i < z.size(); ++i) {
      to[i] = z[i] + (players_[i] == ipminmax::Player::Min ? -steps.x * g_[i] : steps.y * g_[i]);
    }
    game_.project(to);
  }

  static double distance(const std::vector<double>& a, const std::vector<double>& b) {
    double largest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double d = std::abs(a[i] - b[i]);
      if (!(d <= largest)) largest = d;  // NaN too
    }
    return largest;
  }

  Game& game_;
  Problem& problem_;
  const std::vector<ipminmax::Player>& players_;
  std::vector<double> g_, middle_, next_;
};

Problem& first_order_problem(Game& game) { return game.reduced ? *game.reduced : *game.problem; }

std::vector<double> first_order_start(const Game& game, std::span<const double> start) {
  return game.reduce ? game.reduce(start) : std::vector<double>(start.begin(), start.end());
}

Answer solve(Game& game, std::span<const double> start, const Limits& limits, bool extragradient) {
  Answer answer;
  answer.applicable = static_cast<bool>(game.project);
  if (!answer.applicable) return answer;
  const Clock clock;
  CountingProblem counted(first_order_problem(game));
  FirstOrderMethod method(game, counted);
  std::vector<double> z = first_order_start(game, start);
  const Game::Steps& steps = extragradient ? game.extragradient : game.gda;
  answer.claims = method.run(z, steps, extragradient, kMaxSteps, limits.seconds) <= kTolerance;
  answer.v = game.lift ? game.lift(z) : z;
  answer.seconds = clock.seconds();
  answer.counts = counted.counts();
  return answer;
}

}  // namespace

Answer solve_gda(Game& game, std::span<const double> start, const Limits& limits) {
  return solve(game, start, limits, false);
}

Answer solve_extragradient(Game& game, std::span<const double> start, const Limits& limits) {
  return solve(game, start, limits, true);
}

void tune_first_order(Game& game, Random& random) {
  if (!game.project) return;
  FirstOrderMethod method(game, first_order_problem(game));
  std::vector<std::vector<double>> starts;
  for (int k = 0; k < kTuningStarts; ++k) {
    starts.push_back(first_order_start(game, game.random_start(random)));
  }
  for (const bool extragradient : {false, true}) {
    double best = INFINITY;
    Game::Steps& steps = extragradient ? game.extragradient : game.gda;
    for (double x = 100.0; x > 0.5e-4; x /= std::sqrt(10.0)) {
      for (const double ratio : {0.1, 1.0, 10.0}) {
        double score = 0.0;  // sum of the logarithms of the residuals that are left
        for (const std::vector<double>& start : starts) {
          std::vector<double> z = start;
          const double residual = method.run(z, {x, ratio * x}, extragradient, kTuningSteps, 1e9);
          score += std::log(std::min(residual, 1e30));
        }
        if (score < best) {
          best = score;
          steps = {x, ratio * x};
        }
      }
    }
  }
}

}  // namespace bench
