// MinMaxApplication: whole solves as an Ipopt user sees them.
#include <gtest/gtest.h>

#include <IpIpoptApplication.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <new>
#include <sstream>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

SmartPtr<MinMaxApplication> silent_application() {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  return app;
}

SmartPtr<Ipopt::TNLP> split(const SmartPtr<Model>& model) {
  return new SplitTNLP(GetRawPtr(model), {1});
}

TEST(Application, SolvesAMinmaxProblem) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const Result& result = app->LastResult();
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  ASSERT_EQ(result.v.size(), 3U);
  EXPECT_NEAR(result.v[0], 4.0 / 21.0, 1e-6);
  EXPECT_NEAR(result.v[1], 2.0 / 7.0, 1e-6);
  EXPECT_NEAR(result.v[2], 17.0 / 21.0, 1e-6);

  EXPECT_EQ(model->final.count, 1);
  EXPECT_EQ(model->final.status, Ipopt::SUCCESS);
  EXPECT_TRUE(model->final.null_internals);
  EXPECT_EQ(model->final.x, result.v);
  EXPECT_EQ(model->final.lambda, result.lambda);
  EXPECT_EQ(model->final.g, result.constraints);
  EXPECT_EQ(model->final.objective, result.objective);
  EXPECT_NEAR(model->final.g[0], 1.0, 1e-6);
  EXPECT_NEAR(model->final.g[1], 2.0 / 7.0 - 4.0 / 21.0, 1e-6);
}

// Programs without a console read the message.
TEST(Application, WarningsStandInTheMessage) {
  const auto app = silent_application();
  const SmartPtr<Model> model = new Model;
  // g0, an equation, is all that Max's x0 and x1 may do; y is Min's.
  const SmartPtr<Ipopt::TNLP> game = new SplitTNLP(GetRawPtr(model), {2}, {0});
  const auto warned = [&] {
    return app->LastResult().message.find("Max has 1 equality constraint for 1 variable") !=
           std::string::npos;
  };
  app->OptimizeTNLP(game);
  EXPECT_TRUE(warned()) << app->LastResult().message;
  app->ReOptimizeTNLP(game);
  EXPECT_TRUE(warned()) << app->LastResult().message;
  ASSERT_EQ(app->OptimizeTNLP(split(new Model)), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->LastResult().message, "solved");
}

// grad f + J' lambda - z_L + z_U = 0 for every variable; a Max variable's multipliers are <= 0.
TEST(Application, SignsOfTheMultipliers) {
  class Pushed : public Model {  // y wants to be 2/7 and is kept at 0.1
   public:
    bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                         Number* g_u) override {
      const bool ok = Model::get_bounds_info(n, x_l, x_u, m, g_l, g_u);
      x_u[1] = 0.1;
      x_l[2] = 2.0;  // x1 wants to be below 1
      return ok;
    }
  };
  const SmartPtr<Model> model = new Pushed;
  model->start = {0.0, 0.0, 3.0};
  const auto app = silent_application();
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const auto& [count, status, x, z_lower, z_upper, g, lambda, f, internals, strings] = model->final;
  const std::vector<double> gradient = {4.0 * x[0] + 3.0 * x[1], 3.0 * x[0] - 2.0 * x[1],
                                        2.0 * x[2]};
  const std::vector<double> jacobian_lambda = {lambda[0] - lambda[1], lambda[1], lambda[0]};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(gradient[i] + jacobian_lambda[i] - z_lower[i] + z_upper[i], 0.0, 1e-5) << i;
  }
  EXPECT_NEAR(x[2], 2.0, 1e-6);
  EXPECT_GT(z_lower[2], 1.0);
  EXPECT_GE(z_upper[2], 0.0);
  EXPECT_LE(z_lower[1], 0.0);
  EXPECT_LE(z_upper[1], 0.0);
}

TEST(Application, MetadataSplitsAPlainModel) {
  const SmartPtr<Model> model = new Model;
  model->variable_integers["player"] = {0, 1, 0};
  const auto app = silent_application();
  ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
  EXPECT_NEAR(app->LastResult().v[1], 2.0 / 7.0, 1e-6);
}

TEST(Application, FortranIndicesGiveTheSameSolve) {
  std::vector<double> answers;
  for (const auto style : {Ipopt::TNLP::C_STYLE, Ipopt::TNLP::FORTRAN_STYLE}) {
    const SmartPtr<Model> model = new Model;
    model->style = style;
    const auto app = silent_application();
    ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
    answers.push_back(app->LastResult().v[0]);
  }
  EXPECT_EQ(answers[0], answers[1]);
}

TEST(Application, WorksWithoutInitialize) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_EQ(app->OptimizeTNLP(split(new Model)), Ipopt::Solve_Succeeded);
}

TEST(Application, ANullModelIsAnInvalidProblem) {
  const auto app = silent_application();
  EXPECT_EQ(app->OptimizeTNLP(SmartPtr<Ipopt::TNLP>()), Ipopt::Invalid_Problem_Definition);
}

TEST(Application, AWrongModelIsAnInvalidProblem) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  EXPECT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {3})),
            Ipopt::Invalid_Problem_Definition);
  EXPECT_EQ(app->LastResult().status, Status::InvalidProblem);
  EXPECT_NE(app->LastResult().message.find("max_variables[0] = 3"), std::string::npos);
  EXPECT_EQ(model->final.count, 0);
  EXPECT_TRUE(IsNull(app->Statistics()));
}

TEST(Application, AMinConstraintWithAMaxVariableIsInvalidWhereForbidden) {
  const SmartPtr<Model> model = new Model;
  model->variable_integers["player"] = {0, 1, 0};
  model->variable_strings["idx_names"] = {"thrust", "wind", "mass"};
  model->constraint_strings["idx_names"] = {"budget", "drift"};
  model->constraint_integers["player"] = {0, 0};
  const auto app = silent_application();
  app->Options()->SetStringValue("minmax_robust_constraints", "no");
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Invalid_Problem_Definition);
  EXPECT_NE(app->LastResult().message.find("drift"), std::string::npos)
      << app->LastResult().message;
  EXPECT_NE(app->LastResult().message.find("wind"), std::string::npos) << app->LastResult().message;
  EXPECT_EQ(model->final.count, 0);
}

TEST(Application, AModelWithoutVariables) {
  class Empty : public Model {
   public:
    bool get_nlp_info(Index& n, Index& m, Index& jac, Index& hess, IndexStyleEnum& s) override {
      n = m = jac = hess = 0;
      s = C_STYLE;
      return true;
    }
    bool get_bounds_info(Index, Number*, Number*, Index, Number*, Number*) override { return true; }
    bool get_starting_point(Index, bool, Number*, bool, Number*, Number*, Index, bool,
                            Number*) override {
      return true;
    }
    bool eval_f(Index, const Number*, bool, Number& f) override {
      f = 3.0;
      return true;
    }
    bool eval_grad_f(Index, const Number*, bool, Number*) override { return true; }
    bool eval_g(Index, const Number*, bool, Index, Number*) override { return true; }
    bool eval_jac_g(Index, const Number*, bool, Index, Index, Index*, Index*, Number*) override {
      return true;
    }
    bool eval_h(Index, const Number*, bool, Number, Index, const Number*, bool, Index, Index*,
                Index*, Number*) override {
      return true;
    }
  };
  const SmartPtr<Model> model = new Empty;
  const auto app = silent_application();
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded)
      << app->LastResult().message;
  EXPECT_EQ(model->final.objective, 3.0);
}

TEST(Application, IterationCallback) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const Index last = app->LastResult().iterations;
  ASSERT_EQ(model->iterations.size(), static_cast<std::size_t>(last) + 1);
  for (std::size_t i = 0; i < model->iterations.size(); ++i) {
    EXPECT_EQ(model->iterations[i], static_cast<Index>(i));
  }

  const SmartPtr<Model> stopping = new Model;
  stopping->on_iteration = [](Index iteration) { return iteration < 1; };
  EXPECT_EQ(app->OptimizeTNLP(split(stopping)), Ipopt::User_Requested_Stop);
  EXPECT_EQ(stopping->final.status, Ipopt::USER_REQUESTED_STOP);
  EXPECT_EQ(stopping->iterations, (std::vector<Index>{0, 1}));
}

TEST(Application, IterationLimit) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  app->Options()->SetIntegerValue("max_iter", 1);
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Maximum_Iterations_Exceeded);
  EXPECT_EQ(model->final.status, Ipopt::MAXITER_EXCEEDED);
}

TEST(Application, FunctionsUndefinedAtTheStart) {
  const SmartPtr<Model> model = new Model;
  model->on_call = [](const std::string& name) { return name != "eval_f"; };
  const auto app = silent_application();
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Invalid_Number_Detected);
  EXPECT_EQ(app->LastResult().status, Status::EvaluationFailed);

  // Ipopt itself.
  const SmartPtr<Model> same = new Model;
  same->on_call = model->on_call;
  const SmartPtr<Ipopt::IpoptApplication> ipopt = new Ipopt::IpoptApplication(false);
  ASSERT_EQ(ipopt->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(ipopt->OptimizeTNLP(GetRawPtr(same)), Ipopt::Invalid_Number_Detected);
  EXPECT_EQ(model->final.count, same->final.count);
  EXPECT_EQ(model->final.status, same->final.status);
  EXPECT_EQ(model->final.x, model->start);
  // Nothing is known of the rest; Ipopt gives zeros.
  for (const auto* unknown :
       {&model->final.lambda, &model->final.g, &model->final.z_lower, &model->final.z_upper}) {
    for (const double value : *unknown) EXPECT_TRUE(std::isnan(value)) << value;
  }
  EXPECT_TRUE(std::isnan(model->final.objective));
  EXPECT_EQ(app->LastResult().certificate.kind, PointKind::Unknown);
}

TEST(Application, NoStartingPoint) {
  const SmartPtr<Model> model = new Model;
  model->on_call = [](const std::string& name) { return name != "get_starting_point(100)"; };
  const auto app = silent_application();
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Invalid_Problem_Definition);
  EXPECT_NE(app->LastResult().message.find("starting point"), std::string::npos)
      << app->LastResult().message;
  EXPECT_EQ(model->final.count, 0);
}

/// Throws in one method.
template <class Exception>
SmartPtr<Model> throwing_model(std::string method, Exception exception) {
  SmartPtr<Model> model = new Model;
  model->on_call = [method = std::move(method), exception](const std::string& name) {
    if (name == method) throw exception;
    return true;
  };
  return model;
}

// The numbers of finalize_solution calls are Ipopt's (which leaks here, so it is not run).
TEST(Application, ExceptionsOfTheModelEndTheSolve) {
  const std::vector<std::pair<std::string, int>> finalized = {{"get_nlp_info", 0},
                                                              {"eval_jac_g structure", 0},
                                                              {"get_starting_point(100)", 0},
                                                              {"eval_f", 1},
                                                              {"eval_grad_f", 1},
                                                              {"eval_h", 1},
                                                              {"finalize_metadata", 0},
                                                              {"intermediate_callback", 1}};
  for (const auto& [method, count] : finalized) {
    const auto model = throwing_model(method, std::runtime_error("out of luck"));
    const auto app = silent_application();
    EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::NonIpopt_Exception_Thrown) << method;
    EXPECT_EQ(app->LastResult().message, "out of luck") << method;
    EXPECT_EQ(app->LastResult().status, Status::InternalError) << method;
    EXPECT_EQ(model->final.count, count) << method;
    if (count > 0) {
      EXPECT_EQ(model->final.status, Ipopt::INTERNAL_ERROR) << method;
      for (const double value : model->final.lambda) EXPECT_TRUE(std::isnan(value)) << method;
    }
    // The application can be used again.
    EXPECT_EQ(app->OptimizeTNLP(split(new Model)), Ipopt::Solve_Succeeded) << method;
  }
}

TEST(Application, AnExceptionOfFinalizeSolutionEndsThere) {
  const auto model = throwing_model("finalize_solution", std::runtime_error("out of luck"));
  const auto app = silent_application();
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::NonIpopt_Exception_Thrown);
  EXPECT_EQ(model->final.count, 1);
  EXPECT_EQ(model->final.status, Ipopt::SUCCESS);
}

TEST(Application, ExceptionsCanPassThrough) {
  const auto model = throwing_model("eval_grad_f", std::runtime_error("out of luck"));
  const auto app = silent_application();
  app->RethrowNonIpoptException(true);
  EXPECT_THROW(app->OptimizeTNLP(split(model)), std::runtime_error);
  EXPECT_EQ(model->final.count, 0);
  const auto other = throwing_model("eval_f", 17);  // no std::exception
  EXPECT_THROW(app->OptimizeTNLP(split(other)), int);
  app->RethrowNonIpoptException(false);
  EXPECT_EQ(app->OptimizeTNLP(split(other)), Ipopt::NonIpopt_Exception_Thrown);
  EXPECT_EQ(other->final.status, Ipopt::INTERNAL_ERROR);
}

TEST(Application, IpoptsExceptionsNeverPassThrough) {
  const auto model =
      throwing_model("eval_f", Ipopt::TNLP::INVALID_TNLP("no model", __FILE__, __LINE__));
  const auto app = silent_application();
  app->RethrowNonIpoptException(true);
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Unrecoverable_Exception);
  EXPECT_EQ(app->LastResult().message, "no model");
  EXPECT_EQ(model->final.status, Ipopt::INTERNAL_ERROR);
}

TEST(Application, OutOfMemoryInTheModel) {
  for (const std::string method : {"get_nlp_info", "eval_f"}) {
    const auto app = silent_application();
    EXPECT_EQ(app->OptimizeTNLP(split(throwing_model(method, std::bad_alloc()))),
              Ipopt::Insufficient_Memory);
    EXPECT_EQ(app->LastResult().status, Status::OutOfMemory);
  }
}

TEST(Application, NoSolveInsideItsOwnModel) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  auto inner = Ipopt::Solve_Succeeded;
  model->on_call = [&](const std::string& name) {
    if (name == "eval_f") inner = app->OptimizeTNLP(split(new Model));
    return true;
  };
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  EXPECT_EQ(inner, Ipopt::Invalid_Problem_Definition);
}

TEST(Application, AnApplicationThatItsModelReleasesEndsItsSolve) {
  const SmartPtr<Model> model = new Model;
  auto app = silent_application();
  model->on_iteration = [&](Ipopt::Index) {
    app = nullptr;
    return true;
  };
  MinMaxApplication* const solving = GetRawPtr(app);
  EXPECT_EQ(solving->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  EXPECT_EQ(model->final.status, Ipopt::SUCCESS);
}

TEST(Application, ModelsAreReleased) {
  class Counted : public Model {
   public:
    explicit Counted(int& alive) : alive_(alive) { ++alive_; }
    ~Counted() override { --alive_; }

   private:
    int& alive_;
  };
  int alive = 0;
  {
    const auto app = silent_application();
    SmartPtr<Model> model = new Counted(alive);
    model->on_call = [](const std::string& name) {
      if (name == "eval_h") throw std::runtime_error("out of luck");
      return true;
    };
    EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::NonIpopt_Exception_Thrown);
    model = new Counted(alive);
    EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
    EXPECT_EQ(alive, 1);  // the first is gone with the next solve
  }
  EXPECT_EQ(alive, 0);
}

TEST(Application, ReOptimize) {
  const auto app = silent_application();
  const SmartPtr<Model> model = new Model;
  const SmartPtr<Ipopt::TNLP> problem = split(model);
  EXPECT_THROW(app->ReOptimizeTNLP(problem), Ipopt::INVALID_WARMSTART);
  ASSERT_EQ(app->OptimizeTNLP(problem), Ipopt::Solve_Succeeded);
  const auto first = app->LastResult().v;
  EXPECT_THROW(app->ReOptimizeTNLP(split(model)), Ipopt::INVALID_WARMSTART);
  EXPECT_EQ(app->LastResult().counts.analyses, 2);
  EXPECT_EQ(app->ReOptimizeTNLP(problem), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->LastResult().v, first);
  EXPECT_EQ(app->LastResult().counts.analyses, 0);
  EXPECT_EQ(model->final.count, 2);
  EXPECT_EQ(model->count("get_bounds_info"), 4) << "bounds may have changed";

  ASSERT_EQ(app->OptimizeTNLP(problem), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->LastResult().counts.analyses, 2) << "as if for the first time";

  // A solve that an exception ended leaves nothing to go on with, and is no obstacle.
  model->on_call = [](const std::string& name) -> bool {
    if (name == "eval_h") throw std::runtime_error("no");
    return true;
  };
  EXPECT_EQ(app->ReOptimizeTNLP(problem), Ipopt::NonIpopt_Exception_Thrown);
  model->on_call = [](const std::string&) { return true; };
  EXPECT_EQ(app->ReOptimizeTNLP(problem), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->LastResult().v, first);
}

/// The model with another upper bound of y and another right-hand side of g0.
class ChangingModel : public Model {
 public:
  double upper_y = 5.0;
  double sum = 1.0;

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override {
    const bool ok = Model::get_bounds_info(n, x_l, x_u, m, g_l, g_u);
    x_u[1] = upper_y;
    g_l[0] = g_u[0] = sum;
    return ok;
  }
};

TEST(Application, ReOptimizeSeesWhatChanged) {
  const SmartPtr<ChangingModel> model = new ChangingModel;
  const SmartPtr<Ipopt::TNLP> problem = split(GetRawPtr(model));
  const auto again = silent_application();
  ASSERT_EQ(again->OptimizeTNLP(problem), Ipopt::Solve_Succeeded);
  const auto expect_as_fresh = [&](Index analyses) {
    const auto fresh = silent_application();
    EXPECT_EQ(again->ReOptimizeTNLP(problem), fresh->OptimizeTNLP(problem));
    EXPECT_EQ(again->LastResult().counts.analyses, analyses);
    ASSERT_EQ(again->LastResult().v.size(), fresh->LastResult().v.size());
    for (std::size_t i = 0; i < fresh->LastResult().v.size(); ++i) {
      EXPECT_NEAR(again->LastResult().v[i], fresh->LastResult().v[i], 1e-6);
    }
  };
  model->sum = 2.0;  // scales the solution
  expect_as_fresh(0);
  EXPECT_NEAR(again->LastResult().v[0], 8.0 / 21.0, 1e-6);
  model->upper_y = 0.25;  // active now
  expect_as_fresh(0);
  EXPECT_NEAR(again->LastResult().v[1], 0.25, 1e-6);
  model->upper_y = 1e20;  // a bound less
  expect_as_fresh(2);
  model->upper_y = -5.0;  // y is fixed
  expect_as_fresh(2);
  model->upper_y = -6.0;
  EXPECT_EQ(again->ReOptimizeTNLP(problem), Ipopt::Invalid_Problem_Definition);
  model->upper_y = 5.0;
  expect_as_fresh(2);
}

TEST(Application, WarmStartAsksForMultipliers) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  app->Options()->SetStringValue("warm_start_init_point", "yes");
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  EXPECT_EQ(model->count("get_starting_point(111)"), 1);
  EXPECT_EQ(model->count("get_starting_point(100)"), 0);
}

TEST(Application, Statistics) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  EXPECT_TRUE(IsNull(app->Statistics()));
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  const SmartPtr<MinMaxStatistics> statistics = app->Statistics();
  ASSERT_TRUE(IsValid(statistics));
  EXPECT_EQ(statistics->IterationCount(), app->LastResult().iterations);
  EXPECT_EQ(statistics->FinalObjective(), app->LastResult().objective);
  EXPECT_GE(statistics->TotalCpuTime(), 0.0);
  EXPECT_GE(statistics->TotalWallclockTime(), 0.0);
  Ipopt::Index f = 0, g = 0, gradient = 0, jacobian = 0, hessian = 0;
  statistics->NumberOfEvaluations(f, g, gradient, jacobian, hessian);
  const Counts& counts = app->LastResult().counts;
  EXPECT_EQ(f, counts.objective);
  EXPECT_EQ(g, counts.constraints);
  EXPECT_EQ(gradient, counts.gradient);
  EXPECT_EQ(jacobian, counts.jacobian);
  EXPECT_EQ(hessian, counts.hessian);
  EXPECT_GT(std::min({f, g, gradient, jacobian, hessian}), 0);
  EXPECT_LE(f, model->count("eval_f"));
  EXPECT_LE(hessian, model->count("eval_h"));
  double dual = 1.0, primal = 1.0, complementarity = 1.0, error = 1.0;
  statistics->Infeasibilities(dual, primal, complementarity, error);
  EXPECT_LE(std::max({dual, primal, complementarity}), 1e-6);
  EXPECT_EQ(error, std::max({dual, primal, complementarity}));
}

// --- What is printed -----------------------------------------------------------------------------

/// Console output of a solve.
std::string console(const std::vector<std::pair<std::string, std::string>>& options,
                    const SmartPtr<Ipopt::TNLP>& model) {
  testing::internal::CaptureStdout();
  {
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication;
    std::ostringstream text;
    for (const auto& [name, value] : options) text << name << ' ' << value << '\n';
    std::istringstream input(text.str());
    static_cast<void>(app->Initialize(input));
    static_cast<void>(app->OptimizeTNLP(model));
    app->Jnlst()->FlushBuffer();
  }
  return testing::internal::GetCapturedStdout();
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Console, PrintLevels) {
  const SmartPtr<Ipopt::TNLP> problem = split(new Model);
  EXPECT_EQ(console({{"print_level", "0"}}, problem), "");
  EXPECT_EQ(console({{"print_level", "2"}}, problem), "");

  const std::string summary = console({{"print_level", "3"}}, problem);
  EXPECT_TRUE(contains(summary, "Ipminmax"));
  EXPECT_TRUE(contains(summary, "Number of Iterations....:"));
  EXPECT_TRUE(contains(summary, "EXIT: Local Minmax Found."));
  EXPECT_FALSE(contains(summary, "Total number of variables"));
  EXPECT_FALSE(contains(summary, "inf_dx"));

  const std::string statistics = console({{"print_level", "4"}}, problem);
  EXPECT_TRUE(contains(statistics, "Total number of variables"));
  EXPECT_FALSE(contains(statistics, "inf_dx"));

  const std::string all = console({}, problem);
  EXPECT_TRUE(contains(all, "inf_dx"));
  EXPECT_TRUE(contains(all, "\n   0 "));
}

TEST(Console, APlayerWithoutVariablesIsNoticed) {
  EXPECT_TRUE(contains(console({}, new SplitTNLP(new Model, {})), "Max has no variables"));
  EXPECT_FALSE(contains(console({}, new Model), "has no variables")) << "an ordinary model";
  EXPECT_FALSE(contains(console({}, split(new Model)), "Warning"));
}

TEST(Console, BannerOptionsAndTimes) {
  const SmartPtr<Ipopt::TNLP> problem = split(new Model);
  EXPECT_TRUE(contains(console({}, problem), "This program contains Ipminmax"));
  EXPECT_FALSE(contains(console({{"sb", "yes"}}, problem), "This program contains Ipminmax"));
  const std::string options = console({{"print_user_options", "yes"}, {"tol", "1e-7"}}, problem);
  EXPECT_TRUE(contains(options, "List of user-set options:"));
  EXPECT_TRUE(contains(options, "\ntol                               1e-07"));
  EXPECT_FALSE(contains(console({}, problem), "Timing Statistics"));
  EXPECT_TRUE(
      contains(console({{"print_timing_statistics", "yes"}}, problem), "Timing Statistics"));
}

/// Iterations in the table, and how often its header stands.
struct Table {
  std::vector<int> iterations;
  int headers = 0;
  bool with_info = false;

  explicit Table(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      headers += contains(line, "inf_dx");
      int number = -1;
      if (std::sscanf(line.c_str(), "%4d %*e %*e %*e %*e", &number) == 1 && line.size() > 60) {
        iterations.push_back(number);
        with_info = contains(line, " K ") && contains(line, " Kyy ");
      }
    }
  }
};

TEST(Console, PrintFrequency) {
  const auto table = [](const std::vector<std::pair<std::string, std::string>>& options) {
    return Table(console(options, split(new Model)));
  };
  const Table all = table({});
  ASSERT_GT(all.iterations.size(), 5U);
  EXPECT_FALSE(all.with_info);
  EXPECT_EQ(all.iterations.back() + 1, static_cast<int>(all.iterations.size()));
  EXPECT_EQ(all.headers, 1 + static_cast<int>(all.iterations.size() - 1) / 10);

  const Table third = table({{"print_frequency_iter", "3"}, {"print_info_string", "yes"}});
  EXPECT_EQ(third.iterations.size(), (all.iterations.size() + 2) / 3);
  EXPECT_EQ(third.iterations[1], 3);
  EXPECT_TRUE(third.with_info);

  EXPECT_EQ(table({{"print_frequency_time", "1000"}}).iterations, std::vector<int>{0});
}

TEST(Console, NoConsole) {
  testing::internal::CaptureStdout();
  static_cast<void>(silent_application()->OptimizeTNLP(split(new Model)));
  std::fflush(stdout);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(Console, ErrorsAreSaid) {
  const std::string wrong = console({}, new SplitTNLP(new Model, {5}));
  EXPECT_TRUE(contains(wrong, "EXIT: Invalid problem definition."));
  EXPECT_TRUE(contains(wrong, "max_variables[0] = 5"));
  const std::string threw =
      console({}, split(throwing_model("eval_f", std::runtime_error("out of luck"))));
  EXPECT_TRUE(contains(threw, "out of luck"));
  EXPECT_TRUE(contains(threw, "EXIT: Exception thrown by the model."));
}

TEST(Console, OutputFile) {
  const std::string name = testing::TempDir() + "ipminmax_output.txt";
  std::remove(name.c_str());
  testing::internal::CaptureStdout();
  {
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication;
    app->Options()->SetStringValue("output_file", name);
    app->Options()->SetIntegerValue("file_print_level", 5);
    app->Options()->SetIntegerValue("print_level", 0);
    EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
    EXPECT_EQ(app->OptimizeTNLP(split(new Model)), Ipopt::Solve_Succeeded);
    app->Jnlst()->FlushBuffer();
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  std::ifstream file(name);
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_TRUE(contains(text.str(), "inf_dy"));
  EXPECT_TRUE(contains(text.str(), "EXIT: "));
  std::remove(name.c_str());
}

TEST(Console, AnOutputFileThatCannotBeOpened) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("output_file", "/no/such/folder/file.txt");
  EXPECT_EQ(app->Initialize(""), Ipopt::Invalid_Option);
  EXPECT_FALSE(app->OpenOutputFile("/no/such/folder/file.txt", Ipopt::J_SUMMARY));
}

}  // namespace
}  // namespace ipminmax
