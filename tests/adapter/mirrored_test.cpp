// A negative factor of the objective: Ipopt documents that it maximizes. Here Min then maximizes
// and Max minimizes, so that a model of -f with the factor -1 is the model of f, multipliers
// negated.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

/// The model of model.hpp, or its objective with the opposite sign; y <= 0.1 and g1 are active.
class Signed : public Model {
 public:
  explicit Signed(double sign) : sign_(sign) {}
  double user_factor = 1.0;

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override {
    const bool ok = Model::get_bounds_info(n, x_l, x_u, m, g_l, g_u);
    g_l[1] = -8.0;
    g_u[1] = 0.02;  // y - x0 wants to be 0.05
    x_l[2] = 0.9;   // x1 wants to be 17/21
    return ok;
  }
  bool get_scaling_parameters(Number& obj_scaling, bool& use_x_scaling, Index, Number*,
                              bool& use_g_scaling, Index, Number*) override {
    obj_scaling = user_factor;
    use_x_scaling = use_g_scaling = false;
    return true;
  }
  bool eval_f(Index n, const Number* x, bool new_x, Number& f) override {
    const bool ok = Model::eval_f(n, x, new_x, f);
    f *= sign_;
    return ok;
  }
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* grad) override {
    const bool ok = Model::eval_grad_f(n, x, new_x, grad);
    for (Index i = 0; i < n; ++i) grad[i] *= sign_;
    return ok;
  }
  bool eval_h(Index n, const Number* x, bool new_x, Number sigma, Index m, const Number* lambda,
              bool new_lambda, Index entries, Index* row, Index* col, Number* values) override {
    return Model::eval_h(n, x, new_x, sign_ * sigma, m, lambda, new_lambda, entries, row, col,
                         values);
  }

 private:
  double sign_;
};

struct Solve {
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  Result result;
  std::vector<Violations> violations;
  std::string console;
};

Solve solve(const SmartPtr<Signed>& model, const std::string& option, double factor) {
  Solve solve;
  testing::internal::CaptureStdout();
  {
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication;
    app->Options()->SetStringValue("sb", "yes");
    if (option == "obj_scaling_factor") app->Options()->SetNumericValue(option, factor);
    if (option == "user-scaling") {
      app->Options()->SetStringValue("nlp_scaling_method", option);
      model->user_factor = factor;
    }
    EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
    model->on_iteration = [&](Index) {
      EXPECT_TRUE(app->GetCurrentViolations(solve.violations.emplace_back()));
      return true;
    };
    const SmartPtr<Ipopt::TNLP> game = new SplitTNLP(GetRawPtr(model), {1});
    solve.status = app->OptimizeTNLP(game);
    solve.result = app->LastResult();
  }
  solve.console = testing::internal::GetCapturedStdout();
  return solve;
}

void expect_negated(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], -b[i], 1e-12) << i;
}

TEST(NegativeFactor, MirrorsThePlayers) {
  for (const std::string option : {"obj_scaling_factor", "user-scaling"}) {
    const Solve plain = solve(new Signed(1.0), option, 1.0);
    const Solve mirrored = solve(new Signed(-1.0), option, -1.0);
    ASSERT_EQ(plain.status, Ipopt::Solve_Succeeded) << plain.console;
    ASSERT_EQ(mirrored.status, Ipopt::Solve_Succeeded) << mirrored.console;
    EXPECT_EQ(mirrored.result.v, plain.result.v);
    EXPECT_EQ(mirrored.result.objective, -plain.result.objective);
    EXPECT_GT(plain.result.objective_scale, 0.0);
    EXPECT_EQ(mirrored.result.objective_scale, -plain.result.objective_scale);
    EXPECT_EQ(mirrored.result.certificate.kind, PointKind::LocalMinmax);

    // x1 of Min at its lower bound, g1 of Max at its upper bound.
    EXPECT_GT(plain.result.z_lower[2], 0.1);
    EXPECT_LT(plain.result.lambda[1], -0.01);
    expect_negated(mirrored.result.lambda, plain.result.lambda);
    expect_negated(mirrored.result.z_lower, plain.result.z_lower);
    expect_negated(mirrored.result.z_upper, plain.result.z_upper);

    EXPECT_NE(mirrored.console.find("Min maximizes and Max minimizes"), std::string::npos)
        << mirrored.console;
    EXPECT_EQ(plain.console.find("Min maximizes and Max minimizes"), std::string::npos);
  }
}

/// compl_g is taken at the bound that the multiplier presses against.
TEST(NegativeFactor, ViolationsAreMirrored) {
  const Solve plain = solve(new Signed(1.0), "obj_scaling_factor", 1.0);
  const Solve mirrored = solve(new Signed(-1.0), "obj_scaling_factor", -1.0);
  ASSERT_EQ(plain.violations.size(), mirrored.violations.size());
  for (std::size_t k = 0; k < plain.violations.size(); ++k) {
    const Violations& a = plain.violations[k];
    const Violations& b = mirrored.violations[k];
    expect_negated(b.lower_complementarity, a.lower_complementarity);
    expect_negated(b.lagrangian_gradient, a.lagrangian_gradient);
    EXPECT_EQ(b.constraint, a.constraint);
  }
  // Of a range the bound is told by the sign of the multiplier, as by Ipopt, in both.
  EXPECT_LT(std::abs(plain.violations.back().constraint_complementarity[1]), 1e-7);
}

TEST(NegativeFactor, OfInsaneSizeIsRefused) {
  for (const double factor : {5e-324, -1e300}) {
    const Solve refused = solve(new Signed(1.0), "user-scaling", factor);
    EXPECT_EQ(refused.status, Ipopt::Invalid_Problem_Definition) << factor;
    EXPECT_NE(refused.result.message.find("scaling factor of the objective"), std::string::npos)
        << refused.result.message;
  }
}

}  // namespace
}  // namespace ipminmax
