// Derivatives of the problems that only benchmarks use, against central differences.

#include <cmath>

#include <gtest/gtest.h>
#include <support/dense_judge.hpp>

#include <examples/sequential_chauffeur.hpp>
#include "baselines/game.hpp"
#include "planted_problem.hpp"

namespace bench {
namespace {

using ipminmax::testing::dense_hessian;
using ipminmax::testing::DenseEvaluation;

/// Largest error of gradient, Jacobian and Hessian, relative to 1 + |derivative|, near the start.
double derivative_error(Problem& problem) {
  constexpr double kStep = 1e-6, kSigma = 0.7;
  const std::size_t n = problem.structure().variable_lower.size();
  Eigen::VectorXd v = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
  ipminmax::StartingPoint start;
  start.v = {v.data(), n};
  EXPECT_TRUE(problem.starting_point(start));
  Random random(7);
  for (double& value : v) value += uniform(random, -0.05, 0.15);
  const DenseEvaluation here(problem, v);
  EXPECT_TRUE(here.ok);
  Eigen::VectorXd lambda(here.constraints.size());
  for (double& value : lambda) value = uniform(random, -1.0, 1.0);
  const Eigen::MatrixXd hessian = dense_hessian(problem, v, kSigma, lambda);

  double error = 0.0;
  const auto compare = [&error](double derivative, double difference) {
    const double relative = std::abs(derivative - difference) / (1.0 + std::abs(derivative));
    if (!(relative <= error)) error = relative;  // NaN too
  };
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(v.size(), j);
    const DenseEvaluation up(problem, v + step);
    const DenseEvaluation down(problem, v - step);
    EXPECT_TRUE(up.ok && down.ok);
    compare(here.gradient[j], (up.objective - down.objective) / (2.0 * kStep));
    const Eigen::VectorXd column = (up.constraints - down.constraints) / (2.0 * kStep);
    for (Eigen::Index i = 0; i < column.size(); ++i) compare(here.jacobian(i, j), column[i]);
    const Eigen::VectorXd curvature = (kSigma * (up.gradient - down.gradient) +
                                       (up.jacobian - down.jacobian).transpose() * lambda) /
                                      (2.0 * kStep);
    for (Eigen::Index i = 0; i < v.size(); ++i) compare(hessian(i, j), curvature[i]);
  }
  return error;
}

constexpr double kTolerance = 1e-6;
constexpr std::size_t kLargest = 200;  // variables; differences of more take long

TEST(Derivatives, SequentialChauffeur) {
  for (const auto& parameters : {chauffeur::refined(7), chauffeur::refined_in_rates(7)}) {
    chauffeur::SequentialChauffeur problem(parameters, {},
                                           std::vector<chauffeur::Control>(7, {0.1, 0.02, -0.01}));
    EXPECT_LE(derivative_error(problem), kTolerance);
  }
}

TEST(Derivatives, PlantedProblems) {
  EXPECT_LE(derivative_error(*quartic_chain(9)), kTolerance);
  EXPECT_LE(derivative_error(*quartic_grid(3)), kTolerance);
  EXPECT_LE(derivative_error(*elliptic_grid(3)), kTolerance);
}

TEST(Derivatives, SingleLevelProblems) {
  Random random(1);
  for (const Game& game : games()) {
    const auto problem = single_level_problem(game, game.random_start(random));
    if (problem->structure().variable_lower.size() > kLargest) continue;
    EXPECT_LE(derivative_error(*problem), kTolerance) << game.name;
  }
}

TEST(Derivatives, ScenarioProblems) {
  Random random(2);
  for (const Game& game : games()) {
    const std::vector<std::vector<double>> scenarios = {game.random_start(random),
                                                        game.random_start(random)};
    if (game.name == "attack_ball") continue;  // Y depends on x
    const auto problem = scenario_problem(game, scenarios);
    if (problem->structure().variable_lower.size() > kLargest) continue;
    EXPECT_LE(derivative_error(*problem), kTolerance) << game.name;
  }
}

}  // namespace
}  // namespace bench
