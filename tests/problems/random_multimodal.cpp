#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include <problems/random_multimodal.hpp>

namespace ipminmax::testing {
namespace {

/// Distributions of our own: those of the standard library differ between its implementations.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double uniform(double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  double normal() {  // Box and Muller
    const double radius = std::sqrt(-2.0 * std::log(uniform(1e-12, 1.0)));
    return radius * std::cos(uniform(0.0, 2.0 * std::numbers::pi));
  }

 private:
  std::mt19937_64 generator_;
};

void add_constraints(Model& model, const std::vector<Expression>& x,
                     const std::vector<Expression>& y, Random& random) {
  const double size = 0.5 * static_cast<double>(x.size());
  Expression ball_y = 0.0, coupled = 0.0, ball_x = 0.0;
  for (const Expression& e : y) ball_y += square(e);
  for (const Expression& e : x) ball_x += square(e);
  for (const Expression& e : x) coupled += random.normal() * e;
  for (const Expression& e : y) coupled += random.normal() * e;
  coupled += 0.3 * sin(x.front() * y.front());
  model.constraint(ball_y, -kNoBound, random.uniform(1.0, 4.0) * size);
  model.constraint(coupled, -kNoBound, random.uniform(0.5, 2.0));
  model.constraint(ball_x, -kNoBound, random.uniform(2.0, 5.0) * size);
}

}  // namespace

MultimodalProblem random_multimodal(MultimodalKind kind, int n, int starts, std::uint64_t seed) {
  constexpr double kHalfWidth = 3.0;
  constexpr int kWaves = 6;
  Random random(seed);
  MultimodalProblem problem;
  const double bound = kind == MultimodalKind::Free ? kNoBound : kHalfWidth;
  std::vector<Expression> x, y;
  for (int i = 0; i < n; ++i) {
    x.push_back(problem.model.variable(Player::Min, "x" + std::to_string(i), -bound, bound));
  }
  for (int i = 0; i < n; ++i) {
    y.push_back(problem.model.variable(Player::Max, "y" + std::to_string(i), -bound, bound));
  }
  Expression f = 0.0;
  for (const Expression& e : x) f += 0.5 * random.uniform(0.2, 1.0) * square(e);
  for (const Expression& e : y) f -= 0.5 * random.uniform(0.2, 1.0) * square(e);
  for (const Expression& a : x) {
    for (const Expression& b : y) f += 0.5 * random.normal() * a * b;
  }
  for (int k = 0; k < kWaves; ++k) {
    Expression phase = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double amplitude = random.uniform(0.3, 1.5);
    const double frequency = std::sqrt(2.0 / n);
    for (const Expression& e : x) phase += frequency * random.normal() * e;
    for (const Expression& e : y) phase += frequency * random.normal() * e;
    f += amplitude * sin(phase);
  }
  problem.model.objective(f);
  if (kind == MultimodalKind::Constrained) add_constraints(problem.model, x, y, random);
  for (int s = 0; s < starts; ++s) {
    std::vector<double>& start = problem.starts.emplace_back();
    for (int i = 0; i < 2 * n; ++i) start.push_back(random.uniform(-kHalfWidth, kHalfWidth));
  }
  return problem;
}

}  // namespace ipminmax::testing
