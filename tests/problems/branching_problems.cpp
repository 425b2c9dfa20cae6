#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include <problems/branching_problems.hpp>

namespace ipminmax::testing {
namespace {

/// Distributions of our own: those of the standard library differ between its implementations.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double uniform(double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  int integer(int lower, int upper) {  // both included
    return lower + static_cast<int>(generator_() % static_cast<std::uint64_t>(upper - lower + 1));
  }
  double normal() {  // Box and Muller
    const double radius = std::sqrt(-2.0 * std::log(uniform(1e-12, 1.0)));
    return radius * std::cos(uniform(0.0, 2.0 * std::numbers::pi));
  }
  Expression combination(const std::vector<Expression>& variables, double size) {
    Expression sum = 0.0;
    for (const Expression& e : variables) sum += size * normal() * e;
    return sum;
  }

 private:
  std::mt19937_64 generator_;
};

Expression tanh(const Expression& u) { return 1.0 - 2.0 / (1.0 + exp(2.0 * u)); }

void add_response(Model& model, Random& random, std::vector<Expression>& x,
                  std::vector<Expression>& y) {
  const int n_x = random.integer(2, 6), n_y = random.integer(2, 4);
  for (int i = 0; i < n_x; ++i) {
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i), -3.0, 3.0));
  }
  for (int i = 0; i < n_y; ++i) {
    y.push_back(model.variable(Player::Max, "y" + std::to_string(i), -1.0, 1.0));
  }
  Expression f = 0.0, ellipsoid = 0.0;
  for (const Expression& e : x) f += 0.5 * random.uniform(0.1, 0.5) * square(e);
  for (const Expression& e : y) ellipsoid += random.uniform(0.5, 2.0) * square(e);
  const double size_x = 1.0 / std::sqrt(n_x), size_y = 1.0 / std::sqrt(n_y);
  for (int k = 0; k < n_x + 1; ++k) {
    Expression r = random.normal() + random.combination(x, size_x);
    r += random.combination(y, 0.5 * size_y);
    for (const Expression& e : x) r += e * random.combination(y, 0.5 * size_x * size_y);
    const double amplitude = random.uniform(0.0, 0.5);
    r += amplitude * sin(random.combination(x, size_x) + random.combination(y, 1.5 * size_y));
    f += 0.5 * square(r);
  }
  model.objective(f);
  model.constraint(ellipsoid, -kNoBound, random.uniform(0.4, 0.9) * n_y);
}

void add_network(Model& model, Random& random, std::vector<Expression>& x,
                 std::vector<Expression>& y) {
  const int n = random.integer(10, 24);
  const int n_y = n / 2;
  for (int i = 0; i < n - n_y; ++i) {
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i), -2.0, 2.0));
  }
  for (int i = 0; i < n_y; ++i) {
    y.push_back(model.variable(Player::Max, "y" + std::to_string(i), -2.0, 2.0));
  }
  Expression f = 0.0;
  for (const Expression& e : x) f += 0.5 * random.uniform(0.2, 0.8) * square(e - random.normal());
  for (const Expression& e : y) f -= 0.5 * random.uniform(0.2, 0.8) * square(e);
  const double size = std::sqrt(2.0 / n);
  for (int h = 0; h < 12; ++h) {
    const double weight = 1.5 * random.normal();
    const Expression u = random.normal() + random.combination(x, size);
    f += weight * tanh(u + random.combination(y, 1.5 * size));
  }
  model.objective(f);
}

}  // namespace

BranchingProblem branching_problem(BranchingFamily family, int starts, std::uint64_t seed) {
  const bool response = family == BranchingFamily::Response;
  Random random(seed);
  BranchingProblem problem;
  problem.name = (response ? "response_" : "network_") + std::to_string(seed);
  std::vector<Expression> x, y;
  (response ? add_response : add_network)(problem.model, random, x, y);
  for (int s = 0; s < starts; ++s) {
    std::vector<double>& start = problem.starts.emplace_back();
    for (std::size_t i = 0; i < x.size(); ++i) {
      start.push_back(response ? random.uniform(-3.0, 3.0) : random.uniform(-2.0, 2.0));
    }
    for (std::size_t i = 0; i < y.size(); ++i) {
      start.push_back(response ? random.uniform(-1.0, 1.0) : random.uniform(-2.0, 2.0));
    }
  }
  return problem;
}

}  // namespace ipminmax::testing
