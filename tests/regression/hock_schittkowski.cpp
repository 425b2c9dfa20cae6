#include <regression/hock_schittkowski.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <random>
#include <stdexcept>

#include <regression/hock_schittkowski_groups.hpp>

namespace ipminmax::testing {

const std::vector<MinimizationProblem>& hock_schittkowski() {
  static const std::vector<MinimizationProblem> problems = [] {
    std::vector<MinimizationProblem> all;
    for (auto group :
         {hock_schittkowski_001_to_050(), hock_schittkowski_051_to_100(),
          hock_schittkowski_101_to_119(), schittkowski_from_201(), hock_schittkowski_variants()}) {
      std::ranges::move(group, std::back_inserter(all));
    }
    return all;
  }();
  return problems;
}

const MinimizationProblem& hock_schittkowski(const std::string& name) {
  const auto& problems = hock_schittkowski();
  const auto found = std::ranges::find(problems, name, &MinimizationProblem::name);
  if (found == problems.end()) throw std::out_of_range("no problem " + name);
  return *found;
}

std::vector<double> perturbed_start(const MinimizationProblem& problem, unsigned draw) {
  constexpr std::array<double, 4> kSizes = {0.1, 0.3, 1.0, 3.0};
  std::mt19937 random(draw + 1);
  std::vector<double> v = problem.start;
  for (double& value : v) {
    const double u =
        2.0 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 1.0;
    value += kSizes[draw % kSizes.size()] * (1.0 + std::abs(value)) * u;
  }
  return v;
}

Model twin(const Model& model, Player owner, const std::vector<double>& v) {
  Model game = model.owned_by(owner);
  const double sign = owner == Player::Min ? 1.0 : -1.0;
  Expression sum = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) sum += game.variable(i) - v[i];
  const Expression other =
      game.variable(owner == Player::Min ? Player::Max : Player::Min, "other", -10.0, 10.0);
  game.objective(sign * game.objective() + other * sum - sign * 0.5 * square(other));
  return game;
}

}  // namespace ipminmax::testing
