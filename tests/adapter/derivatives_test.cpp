// Models without second derivatives and the derivative test, as an Ipopt user meets them.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using Ipopt::SmartPtr;

SmartPtr<MinMaxApplication> silent_application() {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  return app;
}

SmartPtr<Ipopt::TNLP> split(const SmartPtr<Model>& model) {
  return new SplitTNLP(GetRawPtr(model), {1});
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// What a solve prints at level 4 and above.
std::string printed(const SmartPtr<Ipopt::TNLP>& model, const std::string& options) {
  testing::internal::CaptureStdout();
  {
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication;
    std::istringstream stream(options);
    EXPECT_EQ(app->Initialize(stream), Ipopt::Solve_Succeeded);
    static_cast<void>(app->OptimizeTNLP(model));
  }
  return testing::internal::GetCapturedStdout();
}

// --- Without second derivatives ------------------------------------------------------------------

/// As a TNLP that does not override eval_h.
class WithoutEvalH : public Model {
 public:
  std::optional<std::vector<Index>> nonlinear;
  bool eval_h(Index, const Number*, bool, Number, Index, const Number*, bool, Index, Index*, Index*,
              Number*) override {
    ++hessian_calls;
    return false;
  }
  Index get_number_of_nonlinear_variables() override {
    return nonlinear ? static_cast<Index>(nonlinear->size()) : -1;
  }
  bool get_list_of_nonlinear_variables(Index count, Index* list) override {
    std::copy_n(nonlinear->begin(), count, list);
    return true;
  }
  int hessian_calls = 0;
};

TEST(NoSecondDerivatives, AreReplacedByDifferences) {
  for (const auto style : {Ipopt::TNLP::C_STYLE, Ipopt::TNLP::FORTRAN_STYLE}) {
    const SmartPtr<WithoutEvalH> model = new WithoutEvalH;
    model->style = style;
    const auto app = silent_application();
    ASSERT_EQ(app->OptimizeTNLP(split(GetRawPtr(model))), Ipopt::Solve_Succeeded)
        << app->LastResult().message;
    const Result& result = app->LastResult();
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_TRUE(result.certificate.finite_differences);
    EXPECT_NEAR(result.v[0], 4.0 / 21.0, 1e-6);
    EXPECT_NEAR(result.v[1], 2.0 / 7.0, 1e-6);
    EXPECT_NEAR(result.v[2], 17.0 / 21.0, 1e-6);
    EXPECT_EQ(model->hessian_calls, 1);  // for the structure
    EXPECT_EQ(model->count("get_starting_point(100)"), 1);
    EXPECT_EQ(model->final.count, 1);
    EXPECT_EQ(model->final.x, result.v);
    EXPECT_EQ(result.counts.gradient, model->count("eval_grad_f"));
    EXPECT_EQ(result.counts.jacobian, model->count("eval_jac_g"));
  }
}

TEST(NoSecondDerivatives, TheLogSaysSo) {
  const SmartPtr<Model> model = new WithoutEvalH;
  const std::string text = printed(split(model), "");
  EXPECT_TRUE(contains(text,
                       "Second derivatives from finite differences: 4 entries by 2 groups of "
                       "variables."))
      << text;
  EXPECT_TRUE(contains(text, "Second derivatives......: finite differences, error estimate "));
  EXPECT_TRUE(contains(text, "EXIT: Local Minmax Found."));
  EXPECT_FALSE(contains(printed(split(new Model), ""), "finite differences"));
}

TEST(NoSecondDerivatives, ExactIsAnErrorWhenItWasSet) {
  const SmartPtr<Model> model = new WithoutEvalH;
  const auto app = silent_application();
  app->Options()->SetStringValue("hessian_approximation", "exact");
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Invalid_Option);
  EXPECT_TRUE(contains(app->LastResult().message, "hessian_approximation = exact"));
  EXPECT_TRUE(contains(app->LastResult().message, "finite-difference-values"));
  EXPECT_EQ(model->evaluations, 0);
  EXPECT_EQ(app->OptimizeTNLP(split(new Model)), Ipopt::Solve_Succeeded);
}

/// Also of a model whose structure of the Hessian is empty because nobody should ask for it.
TEST(NoSecondDerivatives, LimitedMemoryMeansDifferencesForGamesAndNeverCallsEvalH) {
  for (const bool game : {false, true}) {
    const SmartPtr<Model> model = new Model;
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication;
    testing::internal::CaptureStdout();
    app->Options()->SetStringValue("hessian_approximation", "limited-memory");
    ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
    const SmartPtr<Ipopt::TNLP> plain = Ipopt::GetRawPtr(model);
    if (!game) {  // concave in variable 1: with bounds only
      app->Options()->SetStringValue("minmax_max_variables", "");
    }
    const auto status = app->OptimizeTNLP(game ? split(model) : plain);
    app->Jnlst()->FlushBuffer();
    const std::string text = testing::internal::GetCapturedStdout();
    EXPECT_EQ(status, Ipopt::Solve_Succeeded) << text;
    EXPECT_TRUE(contains(text, "hessian_approximation = limited-memory")) << text;
    EXPECT_EQ(contains(text, "finite differences, error estimate"), game) << text;
    const Certificate& certificate = app->LastResult().certificate;
    EXPECT_EQ(certificate.finite_differences, game);
    EXPECT_EQ(certificate.second_order, game ? SecondOrder::Satisfied : SecondOrder::NotTested);
    EXPECT_EQ(model->count("eval_h structure") + model->count("eval_h"), 0);
  }
}

TEST(NoSecondDerivatives, DifferencesMayBeChosen) {
  const SmartPtr<Model> model = new Model;
  const auto app = silent_application();
  app->Options()->SetStringValue("hessian_approximation", "finite-difference-values");
  ASSERT_EQ(app->OptimizeTNLP(split(model)), Ipopt::Solve_Succeeded);
  EXPECT_TRUE(app->LastResult().certificate.finite_differences);
  EXPECT_EQ(model->count("eval_h structure"), 1);
  EXPECT_EQ(model->count("eval_h"), 0);
}

TEST(NoSecondDerivatives, TheListOfNonlinearVariablesIsRead) {
  for (const auto style : {Ipopt::TNLP::C_STYLE, Ipopt::TNLP::FORTRAN_STYLE}) {
    const Index first = style == Ipopt::TNLP::C_STYLE ? 0 : 1;
    const SmartPtr<WithoutEvalH> model = new WithoutEvalH;
    model->style = style;
    model->nonlinear = {first + 2, first};
    TnlpProblem problem(GetRawPtr(model));
    ASSERT_EQ(problem.load(), "");
    EXPECT_FALSE(problem.structure().has_hessian);
    EXPECT_EQ(problem.structure().nonlinear_variables, (std::vector<Index>{2, 0}));

    model->nonlinear = {first + 3};
    EXPECT_TRUE(
        contains(TnlpProblem(GetRawPtr(model)).load(),
                 "get_list_of_nonlinear_variables lists variable " + std::to_string(first + 3)));
    model->nonlinear = std::vector<Index>(4, first);
    EXPECT_TRUE(contains(TnlpProblem(GetRawPtr(model)).load(),
                         "get_number_of_nonlinear_variables returned 4 of 3"));
  }
}

/// Hock and Schittkowski 71 without second derivatives: an ordinary minimization.
class HS071 : public Ipopt::TNLP {
 public:
  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = 4;
    m = 2;
    nnz_jac_g = 8;
    nnz_h_lag = 10;  // whatever it says: eval_h does not exist
    index_style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l, Number* g_u) override {
    std::fill_n(x_l, 4, 1.0);
    std::fill_n(x_u, 4, 5.0);
    g_l[0] = 25.0;
    g_u[0] = 2e19;
    g_l[1] = g_u[1] = 40.0;
    return true;
  }
  bool get_starting_point(Index, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override {
    x[0] = x[3] = 1.0;
    x[1] = x[2] = 5.0;
    return true;
  }
  bool eval_f(Index, const Number* x, bool, Number& f) override {
    f = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
    return true;
  }
  bool eval_grad_f(Index, const Number* x, bool, Number* grad) override {
    grad[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
    grad[1] = x[0] * x[3];
    grad[2] = x[0] * x[3] + 1.0;
    grad[3] = x[0] * (x[0] + x[1] + x[2]);
    return true;
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    g[0] = x[0] * x[1] * x[2] * x[3];
    g[1] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3];
    return true;
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    for (Index k = 0; k < 8 && values == nullptr; ++k) {
      rows[k] = k / 4;
      cols[k] = k % 4;
    }
    for (Index k = 0; k < 4 && values != nullptr; ++k) {
      values[k] = 1.0;
      for (Index l = 0; l < 4; ++l) values[k] *= l == k ? 1.0 : x[l];
      values[4 + k] = 2.0 * x[k];
    }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*,
                         Index, const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}
};

TEST(NoSecondDerivatives, HS071IsSolved) {
  const auto app = silent_application();
  ASSERT_EQ(app->OptimizeTNLP(new HS071), Ipopt::Solve_Succeeded);
  const Result& result = app->LastResult();
  EXPECT_NEAR(result.objective, 17.0140172891520, 1e-6);
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_TRUE(result.certificate.finite_differences);
  EXPECT_LE(result.iterations, 12);
}

/// The pursuit game over 300 stages, 8 variables each: the number of differences does not grow with
/// the horizon, and neither do the iterations.
class Chauffeur : public chauffeur::ChauffeurTNLP {
 public:
  Chauffeur(Index horizon, bool structure)
      : ChauffeurTNLP(chauffeur::refined(horizon), {}, {0.01, 0.002, 0.001}),
        structure_(structure) {}
  bool eval_h(Index n, const Number* x, bool new_x, Number sigma, Index m, const Number* lambda,
              bool new_lambda, Index entries, Index* rows, Index* cols, Number* values) override {
    if (!structure_ || values != nullptr) return false;
    return ChauffeurTNLP::eval_h(n, x, new_x, sigma, m, lambda, new_lambda, entries, rows, cols,
                                 values);
  }

 private:
  bool structure_;
};

TEST(NoSecondDerivatives, ALongPursuitIsSolved) {
  constexpr Index kHorizon = 300;
  const auto app = silent_application();
  ASSERT_EQ(app->OptimizeTNLP(new chauffeur::ChauffeurTNLP(chauffeur::refined(kHorizon), {},
                                                           {0.01, 0.002, 0.001})),
            Ipopt::Solve_Succeeded);
  const Result exact = app->LastResult();
  for (const bool structure : {true, false}) {
    const auto blind = silent_application();
    blind->Options()->SetStringValue("hessian_approximation", "finite-difference-values");
    ASSERT_EQ(blind->OptimizeTNLP(new Chauffeur(kHorizon, structure)), Ipopt::Solve_Succeeded);
    const Result& result = blind->LastResult();
    EXPECT_EQ(result.certificate.kind, exact.certificate.kind);
    EXPECT_TRUE(result.certificate.finite_differences);
    EXPECT_NEAR(result.objective, exact.objective, 1e-6 * std::abs(exact.objective));
    EXPECT_EQ(result.iterations, exact.iterations);
    // Of 2400 variables.
    EXPECT_LE(result.counts.gradient, structure ? 300 : 500);
  }
}

// --- Derivative test -----------------------------------------------------------------------------

/// The gradient in y and the second derivative in x0 and y may be wrong.
class Wrong : public Model {
 public:
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* grad) override {
    const bool ok = Model::eval_grad_f(n, x, new_x, grad);
    grad[1] += gradient_error;
    return ok;
  }
  bool eval_h(Index n, const Number* x, bool new_x, Number sigma, Index m, const Number* lambda,
              bool new_lambda, Index entries, Index* rows, Index* cols, Number* values) override {
    const bool ok =
        Model::eval_h(n, x, new_x, sigma, m, lambda, new_lambda, entries, rows, cols, values);
    if (values != nullptr) values[1] += hessian_error * sigma;
    return ok;
  }
  double gradient_error = 0.0, hessian_error = 0.0;
};

TEST(DerivativeTest, RightModelsAreConfirmedAndSolved) {
  for (const std::string kind : {"first-order", "second-order", "only-second-order"}) {
    const SmartPtr<Model> model = new Model;
    const std::string text = printed(split(model), "derivative_test " + kind);
    EXPECT_TRUE(contains(text, "No errors detected by derivative test.")) << text;
    EXPECT_TRUE(contains(text, "EXIT: Local Minmax Found."));
  }
  EXPECT_FALSE(contains(printed(split(new Model), "derivative_test none"), "erivative test"));
}

TEST(DerivativeTest, WrongEntriesAreNamedAndTheSolveGoesOn) {
  const SmartPtr<Wrong> model = new Wrong;
  model->hessian_error = 1.0;
  model->variable_strings["idx_names"] = {"x0", "y", "x1"};
  const std::string text = printed(split(GetRawPtr(model)), "derivative_test second-order");
  EXPECT_TRUE(contains(text,
                       "* Hessian of the objective in variable 1 (y) of Max and variable 0 (x0) of "
                       "Min:  4.0"))
      << text;
  EXPECT_TRUE(contains(text, "Derivative test detected 1 error(s).")) << text;
  EXPECT_TRUE(contains(text, "EXIT:"));
  EXPECT_EQ(model->final.count, 1);

  const SmartPtr<Wrong> nameless = new Wrong;
  nameless->gradient_error = 2.0;
  EXPECT_TRUE(
      contains(printed(split(GetRawPtr(nameless)), "derivative_test first-order\nmax_iter 2"),
               "* gradient of the objective in variable 1 of Max: "));
}

TEST(DerivativeTest, ExceptionsOfTheModelEndTheSolve) {
  const SmartPtr<Model> model = new Model;
  model->on_call = [](const std::string& name) {
    if (name == "eval_g") throw std::runtime_error("no g");
    return true;
  };
  const auto app = silent_application();
  app->Options()->SetStringValue("derivative_test", "first-order");
  EXPECT_EQ(app->OptimizeTNLP(split(model)), Ipopt::NonIpopt_Exception_Thrown);
  EXPECT_EQ(model->final.count, 1);
}

}  // namespace
}  // namespace ipminmax
