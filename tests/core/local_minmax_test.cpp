// Proofs that a certified answer is near an exact local minmax (minmax_certificate proved).

#include <cmath>
#include <new>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/tape_over_boxes.hpp>

#include "core/answer.hpp"
#include "core/proof/local_minmax.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

SolverOptions proving() {
  SolverOptions options;
  options.minmax_certificate = CertificateEffort::Proved;
  return options;
}

/// What is said of a point with multipliers for bounds that a solve claims to have certified.
Certificate proof_of(Problem& problem, const std::vector<double>& v,
                     const std::vector<double>& z_lower = {},
                     const std::vector<double>& z_upper = {}) {
  Result claimed;
  const std::size_t m = problem.structure().constraint_lower.size();
  claimed.v = v;
  claimed.lambda.assign(m, 0.0);
  claimed.constraints.assign(m, 0.0);
  claimed.z_lower = z_lower.empty() ? std::vector<double>(v.size()) : z_lower;
  claimed.z_upper = z_upper.empty() ? std::vector<double>(v.size()) : z_upper;
  claimed.certificate.kind = PointKind::LocalMinmax;
  prove_local_minmax(
      problem, {}, [] { return true; }, claimed);
  return claimed.certificate;
}

Model of_two(auto formula, double x_lower = -2.0) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", x_lower, 2.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(formula(x, y));
  return model;
}

TEST(ProvedCertificate, OfAGameWithActiveBoundsAndConstraints) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", 0.5, 3.0);
  const Expression z = model.variable(Player::Min, "z");
  const Expression y = model.variable(Player::Max, "y");
  const Expression w = model.variable(Player::Max, "w", -1.0, 1.0);  // active above
  model.objective(exp(x) + square(z - y) * 3.0 + z * z - 4.0 * square(y) + y * x + w);
  model.constraint(x + y * y + w, -kNoBound, 4.0);
  model.constraint(z + x * x, 1.0, 1.0);
  ProvableModel game(model, {1.0, 0.3, 0.2, 0.1});
  const Result result = solve(game, proving());
  ASSERT_TRUE(is_success(result.status)) << result.message;
  EXPECT_TRUE(result.certificate.proved) << result.certificate.proof;
  EXPECT_NEAR(result.v[1], 1.0 - result.v[0] * result.v[0], 1e-7);
  EXPECT_NEAR(result.v[2], 0.5 * result.v[0] - 3.0 * result.v[1], 1e-6);  // f_y = 0
  EXPECT_NEAR(result.v[3], 1.0, 1e-7);
  EXPECT_GT(result.certificate.proved_within, 0.0);
  EXPECT_LT(result.certificate.proved_within, 1e-6);
  EXPECT_NE(statements(result)[1].find("proved: a strict local minmax"), std::string::npos);
}

TEST(ProvedCertificate, TheBallHoldsTheSolution) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  int proved = 0;
  for (int game = 0; game < 200; ++game) {
    const double a = number(random), b = number(random), c = number(random);
    // Stationary at (a, b), where cos and exp have their known values.
    const Model model = of_two([&](const Expression& x, const Expression& y) {
      return exp(c * (x - a)) - c * (x - a) + square(x - a) + cos(y - b) +
             0.3 * number(random) * (x - a) * (y - b);
    });
    ProvableModel problem(model, {number(random), number(random)});
    const Result result = solve(problem, proving());
    const Certificate& certificate = result.certificate;
    if (!certificate.proved) continue;
    ++proved;
    EXPECT_LE(std::abs(result.v[0] - a), certificate.proved_within);
    EXPECT_LE(std::abs(result.v[1] - b), certificate.proved_within);
    EXPECT_LT(certificate.proved_within, 1e-6);
  }
  EXPECT_EQ(proved, 200);
}

TEST(ProvedCertificate, WhatIsNoneIsNotProved) {
  using E = const Expression&;
  const std::vector<double> origin = {0.0, 0.0};
  const auto of = [&](auto formula) {
    ProvableModel problem(of_two(formula));
    return proof_of(problem, origin);
  };
  EXPECT_TRUE(of([](E x, E y) { return square(x) + x * y - square(y); }).proved);
  const Certificate maximum = of([](E x, E y) { return -1.0 * square(x) - square(y); });
  EXPECT_FALSE(maximum.proved);
  EXPECT_NE(maximum.proof.find("inertia of K is"), std::string::npos) << maximum.proof;
  const Certificate minimizing = of([](E x, E y) { return square(y) - square(x); });
  EXPECT_FALSE(minimizing.proved);
  EXPECT_NE(minimizing.proof.find("inertia of K_yy"), std::string::npos) << minimizing.proof;
  EXPECT_FALSE(of([](E x, E y) { return pow(x, 4.0) - square(y); }).proved);
  EXPECT_FALSE(of([](E x, E y) { return square(x) + x * y - pow(y, 4.0); }).proved);
  EXPECT_FALSE(of([](E x, E y) { return sqrt(square(x)) - square(y); }).proved);
  // Stationary nowhere near.
  const Certificate elsewhere = of([](E x, E y) { return exp(x) - square(y); });
  EXPECT_FALSE(elsewhere.proved);
}

TEST(ProvedCertificate, WeaklyActiveBoundsAreNot) {
  using E = const Expression&;
  ProvableModel weak(of_two([](E x, E y) { return square(x) - square(y); }, 0.0));
  const Certificate said = proof_of(weak, {0.0, 0.0}, {1e-9, 0.0});
  EXPECT_FALSE(said.proved);
  EXPECT_NE(said.proof.find("weakly active"), std::string::npos) << said.proof;
  EXPECT_NE(said.proof.find("x"), std::string::npos);
  ProvableModel strict(of_two([](E x, E y) { return x + square(x) - square(y); }, 0.0));
  EXPECT_TRUE(proof_of(strict, {0.0, 0.0}, {1.0, 0.0}).proved);
  // The same point, with a multiplier of the wrong sign: x = 0 maximizes.
  ProvableModel wrong(of_two([](E x, E y) { return square(x) - x - square(y); }, 0.0));
  EXPECT_FALSE(proof_of(wrong, {0.0, 0.0}, {-1.0, 0.0}).proved);
}

/// In a corner a kink has another slope to each side: y = 0 is the worst of Max's answers at x = 0.
TEST(ProvedCertificate, KinksInACornerAreNot) {
  const auto proved = [](auto formula) {
    Model model;
    const Expression x = model.variable(Player::Min, "x", 0.0, 1.0);
    const Expression y = model.variable(Player::Max, "y", 0.0, 1.0);
    model.objective(formula(x, y) + 0.5 * x - 0.5 * y);
    ProvableModel problem(model);
    return proof_of(problem, {0.0, 0.0}, {0.5, -0.5}).proved;
  };
  using E = const Expression&;
  EXPECT_FALSE(proved([](E x, E y) { return sqrt(square(x - y)); }));
  EXPECT_FALSE(proved([](E x, E y) { return pow(square(x - y), 0.5); }));
  EXPECT_TRUE(proved([](E x, E y) { return square(x - y); }));
}

TEST(ProvedCertificate, OfMaximizationsOverX) {
  using E = const Expression&;
  ProvableModel mirrored(of_two([](E x, E y) { return square(y - 0.3) - exp(x) + x; }), {0.5, 0.5});
  SolverOptions options = proving();
  options.obj_scaling_factor = -1.0;
  const Result result = solve(mirrored, options);
  EXPECT_TRUE(result.certificate.proved) << result.message << result.certificate.proof;
}

TEST(ProvedCertificate, AsksForFormulas) {
  using E = const Expression&;
  AutodiffProblem plain(of_two([](E x, E y) { return square(x) - square(y); }), {1.0, 1.0});
  const Result refused = solve(plain, proving());
  EXPECT_EQ(refused.status, Status::InvalidOption);
  EXPECT_NE(refused.message.find("minmax_certificate"), std::string::npos);
}

/// A certificate that stands is not lost with the proof.
TEST(ProvedCertificate, MayEndForWantOfTimeOrMemory) {
  using E = const Expression&;
  ProvableModel game(of_two([](E x, E y) { return square(x) + x * y - square(y); }), {1.0, 1.0});
  const Result certified = solve(game, {});
  Result result = certified;
  prove_local_minmax(
      game, {}, [] { return false; }, result);
  EXPECT_EQ(result.certificate.proof, "not proved: cut short");
  prove_local_minmax(
      game, {}, []() -> bool { throw std::bad_alloc(); }, result);
  EXPECT_EQ(result.certificate.proof, "not proved: out of memory");
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_FALSE(result.certificate.proved);
  EXPECT_EQ(result.v, certified.v);
}

TEST(ProvedCertificate, SaysWhatItDoesNotCover) {
  Model robust;
  const Expression x = robust.variable(Player::Min, "x", -1.0, 3.0);
  const Expression y = robust.variable(Player::Max, "y", -1.0, 1.0);
  robust.objective(square(x));
  robust.constraint(x + y, 0.5, kNoBound, Player::Min);
  ProvableModel problem(robust, {2.0, 0.0});
  const Result result = solve(problem, proving());
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_FALSE(result.certificate.proved);
  EXPECT_NE(result.certificate.proof.find("robust constraints"), std::string::npos);
}

}  // namespace
}  // namespace ipminmax::testing
