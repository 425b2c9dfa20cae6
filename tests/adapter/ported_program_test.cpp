// What programs written for IpoptApplication of 3.11 and 3.14 call, by Ipopt's names.
#include "adapter/ipopt/minmax_fwd.hpp"  // first, as in a header of the program

namespace program {
/// A class that only names the application, as programs do with Ipopt's.
struct Wrapper {
  ipminmax::MinMaxApplication* application = nullptr;
  ipminmax::MinMaxTNLP* model = nullptr;
};
}  // namespace program

#include <cmath>
#include <cstdio>
#include <fstream>
#include <new>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <IpNLP.hpp>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/ipopt_library.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

TEST(PortedProgram, EveryOverloadOfInitialize) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false, false);
  EXPECT_EQ(app->Initialize(), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->Initialize(true), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->Initialize("", true), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->Initialize(std::string(), false), Ipopt::Solve_Succeeded);
  std::istringstream options("max_iter 7");
  EXPECT_EQ(app->Initialize(options, true), Ipopt::Solve_Succeeded);
  EXPECT_TRUE(app->Options()->SetIntegerValue("max_iter", 8));
  Ipopt::Index value = 0;
  app->Options()->GetIntegerValue("max_iter", value, "");
  EXPECT_EQ(value, 8);
}

TEST(PortedProgram, ForwardDeclarationsAreOfTheSameClasses) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  const program::Wrapper wrapper{GetRawPtr(app), nullptr};
  EXPECT_EQ(wrapper.application->Initialize(""), Ipopt::Solve_Succeeded);
}

// Ipopt since 3.14.13 does not go on without a structure; indices that are wrong it does not see.
TEST(PortedProgram, AJacobianWithoutStructureHasIpoptsStatus) {
  const SmartPtr<Model> model = new Model;
  model->on_call = [](const std::string& name) { return name != "eval_jac_g structure"; };
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Unrecoverable_Exception);
  EXPECT_EQ(app->LastResult().status, Status::InvalidProblem);
  EXPECT_EQ(model->final.count, 0);
}

TEST(PortedProgram, OptionsOfItsOwn) {
  const SmartPtr<Ipopt::RegisteredOptions> registry = new Ipopt::RegisteredOptions;
  MinMaxApplication::RegisterAllIpoptOptions(registry);
  const SmartPtr<Ipopt::Journalist> journalist = new Ipopt::Journalist;
  const SmartPtr<Ipopt::OptionsList> list = new Ipopt::OptionsList(registry, journalist);
  list->SetIntegerValue("max_iter", 1);
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(registry, list, journalist);
  EXPECT_EQ(GetRawPtr(app->Options()), GetRawPtr(list));
  EXPECT_EQ(GetRawPtr(app->RegOptions()), GetRawPtr(registry));
  EXPECT_EQ(GetRawPtr(app->Jnlst()), GetRawPtr(journalist));
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(new Model), Ipopt::Maximum_Iterations_Exceeded);

  const SmartPtr<MinMaxApplication> twin = app->clone();
  app->Options()->SetIntegerValue("max_iter", 100);
  EXPECT_EQ(twin->OptimizeTNLP(new Model), Ipopt::Maximum_Iterations_Exceeded);
  EXPECT_EQ(app->OptimizeTNLP(new Model), Ipopt::Solve_Succeeded);
}

TEST(PortedProgram, AnNlpIsRefused) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  const SmartPtr<Ipopt::NLP> nlp;
  EXPECT_EQ(app->OptimizeNLP(nlp), Ipopt::Invalid_Problem_Definition);
  EXPECT_NE(app->LastResult().message.find("OptimizeNLP is not available"), std::string::npos);
  EXPECT_EQ(app->ReOptimizeNLP(nlp), Ipopt::Invalid_Problem_Definition);
}

TEST(PortedProgram, OutputFilesMayBeContinued) {
  const std::string name = testing::TempDir() + "ipminmax_append.log";
  const auto text = [&] {
    std::ifstream file(name);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  for (const bool append : {false, true, true, false}) {
    const std::size_t before = text().size();
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
    ASSERT_TRUE(app->OpenOutputFile(name, Ipopt::J_ITERSUMMARY, append));
    EXPECT_EQ(app->OptimizeTNLP(new Model), Ipopt::Solve_Succeeded);
    const std::string now = text();
    EXPECT_NE(now.find("EXIT:"), std::string::npos);
    if (append) {
      EXPECT_GT(now.size(), before + 500);
    }
  }
  const std::size_t once = text().size();
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("output_file", name);
  app->Options()->SetStringValue("file_append", "yes");
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(new Model), Ipopt::Solve_Succeeded);
  EXPECT_GT(text().size(), once + 500);
  std::remove(name.c_str());
  EXPECT_FALSE(app->OpenOutputFile("/no/such/folder/file", Ipopt::J_SUMMARY, true));
}

TEST(PortedProgram, Statistics) {
  const SmartPtr<Model> model = new Model;
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetNumericValue("obj_scaling_factor", 0.25);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_FALSE(app->RethrowNonIpoptException(true));
  EXPECT_TRUE(app->RethrowNonIpoptException(false));
  ASSERT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {1})), Ipopt::Solve_Succeeded);
  const SmartPtr<MinMaxStatistics> statistics = app->Statistics();
  EXPECT_EQ(statistics->IterationCount(), model->iterations.back());
  EXPECT_EQ(statistics->FinalScaledObjective(), 0.25 * statistics->FinalObjective());
  EXPECT_GE(statistics->TotalSysTime(), 0.0);
  double dual = -1.0, violation = -1.0, bounds = -1.0, complementarity = -1.0, error = -1.0;
  statistics->Infeasibilities(dual, violation, bounds, complementarity, error);
  EXPECT_EQ(bounds, 0.0);
  EXPECT_LT(error, 1e-7);
  double scaled_dual = -1.0, scaled_complementarity = -1.0;
  statistics->ScaledInfeasibilities(scaled_dual, violation, bounds, scaled_complementarity, error);
  EXPECT_NEAR(scaled_dual, 0.25 * dual, 1e-15);
  EXPECT_NEAR(scaled_complementarity, 0.25 * complementarity, 1e-15);
  EXPECT_EQ(error, app->LastResult().error.total);
  statistics->ScaledInfeasibilities(scaled_dual, violation, scaled_complementarity, error);
  EXPECT_EQ(violation, app->LastResult().error.scaled_primal);
}

/// A bound outside of which the solution may lie by bound_relax_factor.
TEST(PortedProgram, StatisticsSayByHowMuchBoundsAreViolated) {
  class AtItsBound : public Model {
   public:
    bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                         Number* g_u) override {
      const bool ok = Model::get_bounds_info(n, x_l, x_u, m, g_l, g_u);
      x_l[2] = 2.0;
      return ok;
    }
  };
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  app->Options()->SetNumericValue("bound_relax_factor", 1e-6);
  ASSERT_EQ(app->OptimizeTNLP(new SplitTNLP(new AtItsBound, {1})), Ipopt::Solve_Succeeded);
  double dual = 0.0, violation = 0.0, bounds = 0.0, complementarity = 0.0, error = 0.0;
  app->Statistics()->Infeasibilities(dual, violation, bounds, complementarity, error);
  EXPECT_EQ(bounds, 2.0 - app->LastResult().v[2]);
  EXPECT_GT(bounds, 1e-7);
}

// --- get_curr_iterate and get_curr_violations ----------------------------------------------------

/// A model that asks as one for Ipopt 3.14 does, and stops when there is no answer.
class Asking : public ObservableTNLP {
 public:
  explicit Asking(Model* model) : model_(model) {}
  std::vector<Result> iterates;
  std::vector<Violations> violations;
  bool scaled = false;

  bool intermediate_callback(Ipopt::AlgorithmMode, Ipopt::Index, Ipopt::Number, Ipopt::Number,
                             Ipopt::Number, Ipopt::Number, Ipopt::Number, Ipopt::Number,
                             Ipopt::Number, Ipopt::Number, Ipopt::Index,
                             const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* cq) override {
    Result& at = iterates.emplace_back();
    for (auto* values : {&at.v, &at.z_lower, &at.z_upper}) values->assign(3, -7.0);
    for (auto* values : {&at.constraints, &at.lambda}) values->assign(2, -7.0);
    Violations& by = violations.emplace_back();
    for (auto* values : {&by.lower_bound, &by.upper_bound, &by.lower_complementarity,
                         &by.upper_complementarity, &by.lagrangian_gradient}) {
      values->assign(3, -7.0);
    }
    for (auto* values : {&by.constraint, &by.constraint_complementarity}) values->assign(2, -7.0);
    EXPECT_FALSE(
        get_curr_iterate(data, cq, scaled, 4, nullptr, nullptr, nullptr, 2, nullptr, nullptr));
    return get_curr_iterate(data, cq, scaled, 3, at.v.data(), at.z_lower.data(), at.z_upper.data(),
                            2, at.constraints.data(), at.lambda.data()) &&
           get_curr_violations(data, cq, scaled, 3, by.lower_bound.data(), by.upper_bound.data(),
                               by.lower_complementarity.data(), by.upper_complementarity.data(),
                               by.lagrangian_gradient.data(), 2, by.constraint.data(),
                               by.constraint_complementarity.data());
  }

  // The rest is the model's.
  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& jac, Ipopt::Index& hess,
                    IndexStyleEnum& style) override {
    return model_->get_nlp_info(n, m, jac, hess, style);
  }
  bool get_bounds_info(Ipopt::Index n, Ipopt::Number* x_l, Ipopt::Number* x_u, Ipopt::Index m,
                       Ipopt::Number* g_l, Ipopt::Number* g_u) override {
    return model_->get_bounds_info(n, x_l, x_u, m, g_l, g_u);
  }
  bool get_starting_point(Ipopt::Index n, bool init_x, Ipopt::Number* x, bool init_z,
                          Ipopt::Number* z_L, Ipopt::Number* z_U, Ipopt::Index m, bool init_lambda,
                          Ipopt::Number* lambda) override {
    return model_->get_starting_point(n, init_x, x, init_z, z_L, z_U, m, init_lambda, lambda);
  }
  bool eval_f(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Number& f) override {
    return model_->eval_f(n, x, new_x, f);
  }
  bool eval_grad_f(Ipopt::Index n, const Ipopt::Number* x, bool new_x,
                   Ipopt::Number* grad) override {
    return model_->eval_grad_f(n, x, new_x, grad);
  }
  bool eval_g(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Index m,
              Ipopt::Number* g) override {
    return model_->eval_g(n, x, new_x, m, g);
  }
  bool eval_jac_g(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Index m,
                  Ipopt::Index entries, Ipopt::Index* row, Ipopt::Index* col,
                  Ipopt::Number* values) override {
    return model_->eval_jac_g(n, x, new_x, m, entries, row, col, values);
  }
  bool eval_h(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Number sigma,
              Ipopt::Index m, const Ipopt::Number* lambda, bool new_lambda, Ipopt::Index entries,
              Ipopt::Index* row, Ipopt::Index* col, Ipopt::Number* values) override {
    return model_->eval_h(n, x, new_x, sigma, m, lambda, new_lambda, entries, row, col, values);
  }
  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index, const Ipopt::Number*,
                         const Ipopt::Number*, const Ipopt::Number*, Ipopt::Index,
                         const Ipopt::Number*, const Ipopt::Number*, Ipopt::Number,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  SmartPtr<Model> model_;
};

TEST(ObservableTnlp, AnswersInTheCallbackOfAModelThatIsSplitFromOutside) {
  const SmartPtr<Asking> model = new Asking(new Model);
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {1})), Ipopt::Solve_Succeeded);
  ASSERT_GT(model->iterates.size(), 3U);
  EXPECT_EQ(model->iterates.front().v, (std::vector{1.0, 0.5, 0.0}));
  const Result& last = model->iterates.back();
  const Result& answer = app->LastResult();
  EXPECT_EQ(last.v, answer.v);
  EXPECT_EQ(last.z_lower, answer.z_lower);
  EXPECT_EQ(last.lambda, answer.lambda);
  EXPECT_EQ(last.constraints, answer.constraints);
  for (const double value : model->violations.back().lagrangian_gradient) {
    EXPECT_NEAR(value, 0.0, 1e-7);
  }
  EXPECT_NEAR(model->violations.front().constraint[0], 0.0, 1e-12);
}

TEST(ObservableTnlp, HasNothingToSayElsewhere) {
  const SmartPtr<Asking> model = new Asking(new Model);
  double untouched = 3.0;
  EXPECT_FALSE(model->get_curr_iterate(nullptr, nullptr, false, 3, &untouched, nullptr, nullptr, 2,
                                       nullptr, nullptr));
  EXPECT_EQ(untouched, 3.0);
  EXPECT_FALSE(get_current_violations(false, 3, &untouched, nullptr, nullptr, nullptr, nullptr, 2,
                                      nullptr, nullptr));
  // In the units of several solves: none is the answer's.
  model->scaled = true;
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("minmax_max_variables", "1");
  app->Options()->SetStringValue("minmax_min_constraints", "1");
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::User_Requested_Stop);
}

TEST(ObservableTnlp, IsNamedToAModelThatStopsAtOnce) {
  const SmartPtr<Model> model = new Model;
  model->on_iteration = [](Ipopt::Index) { return false; };
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::User_Requested_Stop);
  const bool named = app->LastResult().message.find("ObservableTNLP") != std::string::npos;
  EXPECT_EQ(named, IPMINMAX_IPOPT_AT_LEAST(3, 14)) << app->LastResult().message;
}

TEST(GetCurrentViolations, AreFiniteOrFalse) {
  const SmartPtr<Model> model = new Model;
  bool nan = false;
  class NanGradient : public Model {
   public:
    bool* nan = nullptr;
    bool eval_grad_f(Index n, const Number* x, bool new_x, Number* grad) override {
      const bool ok = Model::eval_grad_f(n, x, new_x, grad);
      if (*nan) grad[0] = std::nan("");
      return ok;
    }
  };
  const SmartPtr<NanGradient> bad = new NanGradient;
  bad->nan = &nan;
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  bad->on_iteration = [&](Ipopt::Index) {
    Violations violations;
    EXPECT_TRUE(app->GetCurrentViolations(violations));
    nan = true;
    EXPECT_FALSE(app->GetCurrentViolations(violations));
    for (const double value : violations.lagrangian_gradient) EXPECT_TRUE(std::isfinite(value));
    nan = false;
    return true;
  };
  EXPECT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(bad), {1})), Ipopt::Solve_Succeeded);
}

// --- Which Ipopt is loaded -----------------------------------------------------------------------

TEST(IpoptLibrary, TheLoadedOneFits) {
  const SmartPtr<Model> model = new Model;
  EXPECT_EQ(ipopt_library_error(*model), "");
}

TEST(IpoptLibrary, AnotherVersionOrTwoAreNamed) {
  const auto as_built = [](const std::string&) -> bool { return IPMINMAX_IPOPT_AT_LEAST(3, 14); };
  const auto other = [](const std::string&) -> bool { return !IPMINMAX_IPOPT_AT_LEAST(3, 14); };
  EXPECT_EQ(ipopt_library_error({"/usr/lib/libipopt.so.1"}, as_built), "");
  EXPECT_EQ(ipopt_library_error({}, other), "");
  const std::string wrong = ipopt_library_error({"/usr/lib/libipopt.so.1"}, other);
  EXPECT_NE(wrong.find("/usr/lib/libipopt.so.1 is of Ipopt 3."), std::string::npos) << wrong;
  const std::string two = ipopt_library_error({"/a/libipopt.so.1", "/b/libipopt.so.3"}, as_built);
  EXPECT_NE(two.find("/a/libipopt.so.1, /b/libipopt.so.3"), std::string::npos) << two;
}

}  // namespace
}  // namespace ipminmax
