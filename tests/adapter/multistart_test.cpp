// minmax_starts in the application.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

/// The model's f plus a double well in x0, so that there are two local minmax points.
class TwoWells : public Model {
 public:
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override {
    const bool ok = Model::get_bounds_info(n, x_l, x_u, m, g_l, g_u);
    x_l[0] = -3.0;
    x_u[0] = 3.0;
    g_l[0] = -10.0;  // x0 + x1 between -10 and 10: x1 is free to be 0
    g_u[0] = 10.0;
    g_u[1] = 100.0;
    return ok;
  }
  bool eval_f(Index n, const Number* x, bool fresh, Number& f) override {
    const bool ok = Model::eval_f(n, x, fresh, f);
    f += std::pow(x[0] * x[0] - 4.0, 2.0) + x[0];
    return ok;
  }
  bool eval_grad_f(Index n, const Number* x, bool fresh, Number* grad) override {
    const bool ok = Model::eval_grad_f(n, x, fresh, grad);
    grad[0] += 4.0 * x[0] * (x[0] * x[0] - 4.0) + 1.0;
    return ok;
  }
  bool eval_h(Index n, const Number* x, bool fresh, Number sigma, Index m, const Number* lambda,
              bool fresh_lambda, Index entries, Index* rows, Index* cols, Number* values) override {
    const bool ok =
        Model::eval_h(n, x, fresh, sigma, m, lambda, fresh_lambda, entries, rows, cols, values);
    if (values != nullptr) values[0] += sigma * (12.0 * x[0] * x[0] - 16.0);
    return ok;
  }
};

SmartPtr<MinMaxApplication> application(int starts) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_TRUE(app->Options()->SetIntegerValue("minmax_starts", starts));
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  return app;
}

SmartPtr<Ipopt::TNLP> split(const SmartPtr<Model>& model) {
  return new SplitTNLP(GetRawPtr(model), {1});
}

SmartPtr<Model> two_wells() {
  const SmartPtr<Model> model = new TwoWells;
  model->start = {1.5, 0.5, 0.0};
  return model;
}

TEST(Application, LooksForTheWorstCaseWhenAsked) {
  const SmartPtr<Model> model = two_wells();
  auto app = application(1);
  EXPECT_TRUE(app->Options()->SetIntegerValue("minmax_worst_case_starts", 6));
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const WorstCase& found = app->LastResult().worst_case;
  EXPECT_EQ(found.starts, 6);
  EXPECT_FALSE(found.higher);
  EXPECT_TRUE(found.single_branch) << "y enters as -(y - x)^2";
  EXPECT_NEAR(found.value, app->LastResult().objective, 1e-6);
}

TEST(ApplicationMultistart, ReturnsTheBestCertifiedPoint) {
  // phi(x0) = 17/4 x0^2 + (x0^2 - 4)^2 + x0: the wells are where 4 x0^3 - 15/2 x0 + 1 = 0.
  const SmartPtr<Model> model = two_wells();
  auto app = application(1);
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const Result one = app->LastResult();
  EXPECT_GT(one.v[0], 1.0);

  app = application(12);
  const SmartPtr<Model> again = two_wells();
  ASSERT_EQ(app->OptimizeTNLP(split(again)), Ipopt::Solve_Succeeded);
  const Result& best = app->LastResult();
  EXPECT_LT(best.v[0], -1.0);
  EXPECT_NEAR(4.0 * std::pow(best.v[0], 3.0) - 7.5 * best.v[0] + 1.0, 0.0, 1e-5);
  EXPECT_NEAR(best.v[1], 1.5 * best.v[0], 1e-6);
  EXPECT_LT(best.objective, one.objective - 1.0);
  EXPECT_EQ(best.certificate.kind, PointKind::LocalMinmax);
  EXPECT_EQ(again->final.count, 1);
  EXPECT_EQ(again->final.x, best.v);
  EXPECT_EQ(again->final.objective, best.objective);
  EXPECT_EQ(again->count("finalize_metadata"), 1);
  EXPECT_EQ(again->count("get_starting_point(100)"), 1);
  EXPECT_EQ(std::count(again->iterations.begin(), again->iterations.end(), 0), 12);
  EXPECT_EQ(again->count("eval_f"), best.counts.objective);
  EXPECT_EQ(app->Statistics()->IterationCount(), best.iterations);
}

TEST(ApplicationMultistart, GoesTogetherWithRobustConstraints) {
  // g1, y - x0 <= 100 for every y in [-5, 5], is Min's and holds in both wells.
  const SmartPtr<Model> model = two_wells();
  auto app = application(12);
  EXPECT_TRUE(app->Options()->SetStringValue("minmax_min_constraints", "1"));
  EXPECT_TRUE(app->Options()->SetIntegerValue("minmax_worst_case_starts", 3));
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const Result& best = app->LastResult();
  EXPECT_LT(best.v[0], -1.0);
  EXPECT_NEAR(4.0 * std::pow(best.v[0], 3.0) - 7.5 * best.v[0] + 1.0, 0.0, 1e-5);
  EXPECT_EQ(best.certificate.kind, PointKind::LocalMinmax) << best.message;
  EXPECT_EQ(model->final.count, 1);
  EXPECT_EQ(model->final.x, best.v);
}

TEST(ApplicationMultistart, CallbackStopsAllStarts) {
  const SmartPtr<Model> model = two_wells();
  int begun = 0;
  model->on_iteration = [&](Ipopt::Index iteration) {
    begun += iteration == 0 ? 1 : 0;
    return begun < 3;
  };
  const auto app = application(50);
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::User_Requested_Stop);
  EXPECT_EQ(begun, 3);
  EXPECT_EQ(model->final.count, 1);
  EXPECT_EQ(model->final.status, Ipopt::USER_REQUESTED_STOP);
  EXPECT_EQ(app->LastResult().certificate.kind, PointKind::FirstOrderPoint);
  EXPECT_EQ(app->LastResult().certificate.second_order, SecondOrder::Satisfied);
  EXPECT_EQ(app->LastResult().over_x.asked, 50);
  EXPECT_EQ(model->final.x, app->LastResult().v);
}

TEST(ApplicationMultistart, ExceptionsEndItAsInOneSolve) {
  const auto throw_late = [](const SmartPtr<Model>& model) {
    model->on_iteration = [n = 0](Ipopt::Index) mutable -> bool {
      if (++n == 30) throw std::runtime_error("no more");
      return true;
    };
  };
  auto model = two_wells();
  throw_late(model);
  const auto app = application(50);
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::NonIpopt_Exception_Thrown);
  EXPECT_EQ(app->LastResult().message, "no more");
  EXPECT_EQ(model->final.count, 1);
  EXPECT_EQ(model->final.status, Ipopt::INTERNAL_ERROR);
  model = two_wells();
  throw_late(model);
  app->RethrowNonIpoptException(true);
  EXPECT_THROW(app->OptimizeTNLP(split(model)), std::runtime_error);
}

TEST(ApplicationMultistart, NothingCertifiedKeepsAnHonestStatus) {
  const SmartPtr<Model> model = two_wells();
  const auto app = application(3);
  app->Options()->SetIntegerValue("max_iter", 1);
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Maximum_Iterations_Exceeded);
  EXPECT_EQ(model->final.count, 1);
  EXPECT_EQ(model->final.status, Ipopt::MAXITER_EXCEEDED);
  EXPECT_NE(app->LastResult().certificate.kind, PointKind::LocalMinmax);
}

TEST(ApplicationMultistart, PrintsTheDistinctPoints) {
  const SmartPtr<Model> model = two_wells();
  const auto app = application(12);
  const std::string file = ::testing::TempDir() + "ipminmax_multistart.out";
  ASSERT_TRUE(app->OpenOutputFile(file, Ipopt::J_ITERSUMMARY));
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::remove(file.c_str());
  EXPECT_NE(text.str().find("Multistart: 12 starts, 2 distinct certified points"),
            std::string::npos)
      << text.str();
}

TEST(ApplicationMultistart, OptionsAreChecked) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  std::istringstream options("minmax_starts 0\n");
  EXPECT_EQ(app->Initialize(options), Ipopt::Invalid_Option);
}

}  // namespace
}  // namespace ipminmax
