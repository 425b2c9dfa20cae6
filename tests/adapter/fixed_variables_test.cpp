// Variables with equal bounds, in every fixed_variable_treatment: the answer, its multipliers, and
// Ipopt's.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/dense_judge.hpp>
#include <support/forwarding_problem.hpp>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/problem_tnlp.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;
using testing::StartedProblem;
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

const std::vector<std::string> kTreatments = {"make_parameter", "make_parameter_nodual",
                                              "make_constraint", "relax_bounds"};

/// Each player has a fixed variable on which objective and constraints depend with either sign.
Model game(double sign) {
  Model model;
  const Expression x = model.variable(kMin, "x", -4.0, 4.0);
  const Expression a = model.variable(kMin, "a", 0.5, 0.5);
  const Expression y = model.variable(kMax, "y", -4.0, 4.0);
  const Expression b = model.variable(kMax, "b", -0.25, -0.25);
  model.objective(square(x - 1.0) + x * y - square(y) + sign * (3.0 * a * x + 2.0 * b * y) +
                  sign * (a - b));
  model.constraint(x + sign * a, -kNoBound, 0.9);
  model.constraint(y + a * b + sign * b * x, -0.1, 0.1);
  return model;
}

/// Takes finalize_solution's multipliers as they come.
struct Final {
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  Result result;
  std::vector<double> x, z_lower, z_upper, lambda;
};

class Recorder final : public ProblemTnlp {
 public:
  Recorder(Problem& problem, Final& final) : ProblemTnlp(problem), final_(final) {}
  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index n, const double* x, const double* z_L,
                         const double* z_U, Ipopt::Index m, const double*, const double* lambda,
                         double, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    final_.x.assign(x, x + n);
    final_.z_lower.assign(z_L, z_L + n);
    final_.z_upper.assign(z_U, z_U + n);
    final_.lambda.assign(lambda, lambda + m);
  }

 private:
  Final& final_;
};

Final solve_game(double sign, const std::string& treatment) {
  AutodiffProblem problem(game(sign), {0.3, 0.5, 0.1, -0.25});
  Final final;
  const SmartPtr<Ipopt::TNLP> model = new Recorder(problem, final);
  const SmartPtr<Ipopt::TNLP> split = new SplitTNLP(model, {2, 3});
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("fixed_variable_treatment", treatment);
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  final.status = app->OptimizeTNLP(split);
  final.result = app->LastResult();
  return final;
}

/// grad f + J'lambda - z_L + z_U per variable.
std::vector<double> stationarity(double sign, const Final& final) {
  AutodiffProblem problem(game(sign));
  const ProblemStructure& s = problem.structure();
  std::vector<double> r(final.x.size());
  EXPECT_TRUE(problem.gradient(final.x, true, r));
  std::vector<double> values(s.jacobian.size());
  EXPECT_TRUE(problem.jacobian(final.x, false, values));
  for (std::size_t k = 0; k < values.size(); ++k) {
    r[static_cast<std::size_t>(s.jacobian[k].col)] +=
        values[k] * final.lambda[static_cast<std::size_t>(s.jacobian[k].row)];
  }
  for (std::size_t i = 0; i < r.size(); ++i) r[i] += final.z_upper[i] - final.z_lower[i];
  return r;
}

TEST(FixedVariables, StationarityHoldsForThemToo) {
  for (const double sign : {1.0, -1.0}) {
    for (const std::string& treatment : kTreatments) {
      const Final final = solve_game(sign, treatment);
      ASSERT_EQ(final.status, Ipopt::Solve_Succeeded) << treatment << final.result.message;
      EXPECT_EQ(final.result.certificate.kind, PointKind::LocalMinmax) << treatment;
      EXPECT_NEAR(final.x[1], 0.5, 1e-7) << treatment;
      EXPECT_NEAR(final.x[3], -0.25, 1e-7) << treatment;
      const std::vector<double> r = stationarity(sign, final);
      for (const std::size_t i : {0U, 1U, 2U, 3U}) {
        const bool fixed = i == 1 || i == 3;
        if (fixed && treatment == "make_parameter_nodual") {
          EXPECT_EQ(final.z_lower[i], 0.0);
          EXPECT_EQ(final.z_upper[i], 0.0);
        } else {
          EXPECT_NEAR(r[i], 0.0, 1e-6) << treatment << ", variable " << i;
        }
        const double owner = i < 2 ? 1.0 : -1.0;
        EXPECT_GE(owner * final.z_lower[i], 0.0) << treatment << ", variable " << i;
        EXPECT_GE(owner * final.z_upper[i], 0.0) << treatment << ", variable " << i;
      }
    }
  }
}

TEST(FixedVariables, EveryTreatmentGivesTheSameAnswer) {
  for (const double sign : {1.0, -1.0}) {
    const Final first = solve_game(sign, "make_parameter");
    for (const char* treatment : {"make_constraint", "relax_bounds"}) {
      const Final other = solve_game(sign, treatment);
      for (std::size_t i = 0; i < first.x.size(); ++i) {
        EXPECT_NEAR(other.x[i], first.x[i], 1e-6) << treatment << ", variable " << i;
        EXPECT_NEAR(other.z_lower[i] - other.z_upper[i], first.z_lower[i] - first.z_upper[i], 1e-5)
            << treatment << ", variable " << i;
      }
      for (std::size_t j = 0; j < first.lambda.size(); ++j) {
        EXPECT_NEAR(other.lambda[j], first.lambda[j], 1e-5) << treatment << ", constraint " << j;
      }
    }
  }
}

/// A minimization with a fixed variable, with a start off its value.
Model minimization() {
  Model model;
  const Expression x0 = model.variable(kMin, "x0", 0.0, kNoBound);
  const Expression x1 = model.variable(kMin, "x1", 2.0, 2.0);
  const Expression x2 = model.variable(kMin, "x2");
  model.objective(square(x0 - 3.0) + pow(x1, 3.0) + square(x2 - x1) - 5.0 * x1);
  model.constraint(x0 + x1 + x2, -kNoBound, 5.0);
  return model;
}

TEST(FixedVariables, AreAsIpoptHasThem) {
  for (const char* treatment : {"make_constraint", "relax_bounds"}) {
    AutodiffProblem problem(minimization(), {1.0, 1.5, 0.0});
    const IpoptAnswer ipopt = solve_with_ipopt(problem, [&](Ipopt::OptionsList& list) {
      list.SetStringValue("fixed_variable_treatment", treatment);
    });
    ASSERT_TRUE(ipopt.solved()) << treatment;
    SolverOptions options;
    options.fixed_variable_treatment = std::string(treatment) == "make_constraint"
                                           ? FixedVariableTreatment::MakeConstraint
                                           : FixedVariableTreatment::RelaxBounds;
    const Result ours = solve(problem, options);
    ASSERT_EQ(ours.status, Status::Solved) << ours.message;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(ours.v[i], ipopt.v[i], 1e-6) << treatment;
      EXPECT_NEAR(ours.z_lower[i] - ours.z_upper[i], ipopt.z_lower[i] - ipopt.z_upper[i], 1e-5)
          << treatment << ", variable " << i;
    }
    EXPECT_NEAR(ours.lambda[0], ipopt.lambda[0], 1e-6);
    EXPECT_NEAR(ours.z_lower[1] - ours.z_upper[1],
                3.0 * 4.0 - 5.0 + ours.lambda[0] + 2.0 * (2.0 - ours.v[2]), 1e-6);
  }
}

TEST(FixedVariables, OneMoreGradientIsTheirPrice) {
  SolverOptions options;
  AutodiffProblem problem(minimization(), {1.0, 1.5, 0.0});
  const Result with = solve(problem, options);
  options.fixed_variable_treatment = FixedVariableTreatment::MakeParameterNodual;
  const Result without = solve(problem, options);
  EXPECT_EQ(with.iterations, without.iterations);
  EXPECT_EQ(with.counts.gradient, without.counts.gradient + 1);
  EXPECT_EQ(with.counts.jacobian, without.counts.jacobian + 1);
}

TEST(FixedVariables, AWarmStartTakesTheirMultipliers) {
  // Newton from the solution: the very first iterate is the answer.
  for (const auto treatment :
       {FixedVariableTreatment::MakeConstraint, FixedVariableTreatment::RelaxBounds}) {
    SolverOptions options;
    options.fixed_variable_treatment = treatment;
    AutodiffProblem cold(game(1.0), {0.3, 0.5, 0.1, -0.25});
    const Result first = solve(cold, options);
    ASSERT_EQ(first.status, Status::Solved);

    StartedProblem again(cold, first);
    options.warm_start_init_point = true;
    options.warm_start_bound_push = options.warm_start_bound_frac = 1e-12;
    options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = 1e-12;
    options.warm_start_mult_bound_push = 1e-12;
    options.mu_init = 1e-9;
    double first_error = 1.0;
    const Result warm = solve(again, options, [&](const IterationInfo& info) {
      if (info.iteration == 0) first_error = std::max(info.error.dual_min, info.error.dual_max);
      return true;
    });
    EXPECT_EQ(warm.status, Status::Solved);
    EXPECT_LT(first_error, 1e-6);
    EXPECT_LE(warm.iterations, 2);
  }
}

TEST(FixedVariables, OnlyTheyAndNoConstraints) {
  Model model;
  const Expression x = model.variable(kMin, "x", 3.0, 3.0);
  model.objective(square(x));
  for (const auto treatment :
       {FixedVariableTreatment::MakeParameter, FixedVariableTreatment::MakeConstraint,
        FixedVariableTreatment::RelaxBounds}) {
    AutodiffProblem problem(model, {1.0});
    SolverOptions options;
    options.fixed_variable_treatment = treatment;
    const Result result = solve(problem, options);
    EXPECT_TRUE(is_success(result.status)) << name_of(result.status);
    EXPECT_NEAR(result.v[0], 3.0, 1e-7);
    EXPECT_NEAR(result.z_lower[0] - result.z_upper[0], 6.0, 1e-5);
  }
}

TEST(FixedVariables, RelaxedBoundsNeedARelaxation) {
  AutodiffProblem problem(minimization(), {1.0, 1.5, 0.0});
  SolverOptions options;
  options.fixed_variable_treatment = FixedVariableTreatment::RelaxBounds;
  options.bound_relax_factor = 0.0;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::InvalidOption);
  EXPECT_NE(result.message.find("bound_relax_factor"), std::string::npos);
}

TEST(FixedVariables, ValuesInThemAreReadWhenTheyAreVariables) {
  // sqrt(x - 2) at x = 2: no derivative there, which matters only to a variable.
  Model model;
  const Expression x0 = model.variable(kMin, "x0");
  const Expression x1 = model.variable(kMin, "x1", 2.0, 2.0);
  model.objective(square(x0 - 1.0) + pow(x1 - 2.0, 0.5));
  class Loose final : public Problem {  // passes infinite derivatives on
   public:
    explicit Loose(const Model& m) : base_(m, {0.0, 2.0}) {}
    const ProblemStructure& structure() const override { return base_.structure(); }
    bool starting_point(StartingPoint& start) override { return base_.starting_point(start); }
    bool objective(std::span<const double> v, bool fresh, double& f) override {
      return base_.objective(v, fresh, f);
    }
    bool gradient(std::span<const double> v, bool, std::span<double> out) override {
      out[0] = 2.0 * (v[0] - 1.0);
      out[1] = 0.5 / std::sqrt(v[1] - 2.0);
      return true;
    }
    bool constraints(std::span<const double>, bool, std::span<double>) override { return true; }
    bool jacobian(std::span<const double>, bool, std::span<double>) override { return true; }
    bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>, bool,
                 std::span<double> out) override {
      for (std::size_t k = 0; k < out.size(); ++k) {
        const auto [i, j] = base_.structure().hessian[k];
        out[k] = i != j ? 0.0 : sigma * (i == 0 ? 2.0 : -0.25 * std::pow(v[1] - 2.0, -1.5));
      }
      return true;
    }

   private:
    AutodiffProblem base_;
  };
  SolverOptions options;
  Loose taken_out(model);
  const Result good = solve(taken_out, options);
  EXPECT_EQ(good.status, Status::Solved) << good.message;
  EXPECT_NEAR(good.v[0], 1.0, 1e-7);
  EXPECT_EQ(good.z_lower[1], 0.0) << "no derivative, no multiplier";
  options.fixed_variable_treatment = FixedVariableTreatment::MakeConstraint;
  Loose kept(model);
  const Result bad = solve(kept, options);
  EXPECT_EQ(bad.status, Status::InvalidNumber) << bad.message;
  EXPECT_NE(bad.message.find("variable 1"), std::string::npos) << bad.message;
}

}  // namespace
}  // namespace ipminmax
