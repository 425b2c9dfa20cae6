// What the dense judges say of wrong certificates made by hand, lest they confirm anything.

#include <vector>

#include <gtest/gtest.h>

#include <hostile/judge_certificate.hpp>
#include <support/autodiff_problem.hpp>
#include <support/judge_result.hpp>

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min, kMax = Player::Max;

struct Claim {
  std::vector<double> v, lambda = {}, z_lower = {}, z_upper = {};
};
struct Expected {
  Verdict at_point, near_point;
  CertificateVerdict certificate;
};

void expect(const Model& model, const Claim& claim, const Expected& expected) {
  AutodiffProblem problem(model);
  Result result;
  result.v = claim.v;
  result.lambda = claim.lambda;
  result.z_lower = claim.z_lower;
  result.z_upper = claim.z_upper;
  result.lambda.resize(problem.structure().constraint_players.size(), 0.0);
  result.z_lower.resize(claim.v.size(), 0.0);
  result.z_upper.resize(claim.v.size(), 0.0);
  const DenseOptimality at_point = judge(problem, result);
  EXPECT_EQ(at_point.verdict, expected.at_point) << at_point;
  ExtendedModel extended(model);
  ExtendedProblem rounded(problem);
  for (ExtendedFunctions* functions :
       {static_cast<ExtendedFunctions*>(&extended), static_cast<ExtendedFunctions*>(&rounded)}) {
    const DenseOptimality near_point = optimality_near(*functions, result);
    EXPECT_EQ(near_point.verdict, expected.near_point) << near_point;
  }
  SolverOptions options;
  options.bound_relax_factor = 0.0;  // or what a relaxed bound holds is right
  const CertificateJudgement found = judge_certificate(problem, options, result, 1);
  EXPECT_EQ(static_cast<int>(found.verdict), static_cast<int>(expected.certificate)) << found.why;
}

constexpr Expected kRight = {Verdict::LocalMinmax, Verdict::LocalMinmax,
                             CertificateVerdict::Confirmed};
constexpr Expected kWrong = {Verdict::NotLocalMinmax, Verdict::NotLocalMinmax,
                             CertificateVerdict::False};

TEST(DenseJudges, SeeCurvature) {
  const auto game = [](double xx, double xy, double yy) {
    Model model;
    const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
    model.objective(xx * square(x) + xy * x * y + yy * square(y));
    return model;
  };
  expect(game(-2.0, 4.0, -1.0), {{0.0, 0.0}}, kRight);  // phi = 2 x^2
  expect(game(-4.0, 2.0, -1.0), {{0.0, 0.0}}, kWrong);  // phi = -3 x^2
  expect(game(1.0, 3.0, 1.0), {{0.0, 0.0}}, kWrong);    // y = 0 is a minimum over y
  expect(game(0.0, 0.0, -1.0), {{0.0, 0.0}},
         {Verdict::Undecided, Verdict::Undecided, CertificateVerdict::Doubtful});
}

TEST(DenseJudges, SeeActiveBounds) {
  const auto bounded = [](double slope, double curvature) {
    Model model;
    const Expression x = model.variable(kMin, "x", 0.0);
    model.objective(slope * x + curvature * square(x));
    return model;
  };
  const Expected undecided = {Verdict::Undecided, Verdict::LocalMinmax,
                              CertificateVerdict::Confirmed};
  expect(bounded(1.0, -1.0), {{0.0}, {}, {1.0}}, kRight);
  expect(bounded(0.0, 1.0), {{0.0}}, undecided);  // weakly active
  expect(bounded(0.0, -1.0), {{0.0}},
         {Verdict::Undecided, Verdict::NotLocalMinmax, CertificateVerdict::Doubtful});
  const Expected not_first_order = {Verdict::NotFirstOrder, Verdict::NotFirstOrder,
                                    CertificateVerdict::Doubtful};
  expect(bounded(-1.0, 0.0), {{0.0}, {}, {-1.0}}, not_first_order);  // a multiplier's sign
  expect(bounded(-1.0, 0.0), {{0.0}}, not_first_order);              // not stationary
}

TEST(DenseJudges, SeeWeaklyActiveBoundsOfTheMaximizer) {
  Model model;  // phi = -x^2 / 4 for x > 0, where y stays at its bound
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y", -kNoBound, 0.0);
  model.objective(-0.25 * square(x) + 10.0 * x * y - square(y));
  expect(model, {{0.0, 0.0}}, {Verdict::Undecided, Verdict::Undecided, CertificateVerdict::False});
}

TEST(DenseJudges, SeeDependentGradients) {
  Model model;  // an answer y at x = 0 alone
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  const Expression w = model.variable(kMax, "w");
  model.objective(square(x) - square(y) - square(w));
  model.constraint(y - x, 0.0, 0.0);
  model.constraint(y - 2.0 * x, 0.0, 0.0);
  expect(model, {{0.0, 0.0, 0.0}},
         {Verdict::Undecided, Verdict::Undecided, CertificateVerdict::Doubtful});
}

TEST(DenseJudges, SeeWhatIsNotStationary) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(exp(x) - square(y));
  expect(model, {{0.0, 0.0}},
         {Verdict::NotFirstOrder, Verdict::NotFirstOrder, CertificateVerdict::Doubtful});
  Model circle;  // the far side, a maximum
  const Expression a = circle.variable(kMin, "a"), b = circle.variable(kMin, "b");
  circle.objective(b);
  circle.constraint(square(a) + square(b), 1.0, 1.0);
  expect(circle, {{0.0, -1.0}, {0.5}}, kRight);
  expect(circle, {{0.0, 1.0}, {-0.5}}, kWrong);
}

}  // namespace
}  // namespace ipminmax::testing
