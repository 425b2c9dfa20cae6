// Sensitivities through the application and the C interface, and those of the pursuit.
#include <gtest/gtest.h>
#include <ipminmax.h>

#include <IpOptionsList.hpp>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/c_callbacks.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

SmartPtr<MinMaxApplication> application(double tol) {
  SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  app->Options()->SetNumericValue("tol", tol);
  app->Options()->SetNumericValue("bound_relax_factor", 0.0);
  return app;
}

TEST(Sensitivity, OfTheApplicationsLastAnswer) {
  const SmartPtr<Model> model = new Model;
  const auto app = application(1e-10);
  Sensitivity sensitivity;
  EXPECT_EQ(app->UpdateSensitivity(sensitivity), "nothing has been solved");
  ASSERT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {1})), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app->UpdateSensitivity(sensitivity), "");
  // x0 + x1 = b: v = b (4/21, 2/7, 17/21), f = 17/21 b^2.
  const SolutionDerivative d =
      sensitivity.derivative({.constraint_lower = {1.0, 0.0}, .constraint_upper = {1.0, 0.0}});
  const std::vector<double> expected = {4.0 / 21.0, 2.0 / 7.0, 17.0 / 21.0};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(d.v[i], expected[i], 1e-8);
  EXPECT_NEAR(d.objective, 34.0 / 21.0, 1e-7);
  EXPECT_NEAR(d.objective_curvature, 34.0 / 21.0, 1e-7);
  EXPECT_NEAR(d.lambda[0], -34.0 / 21.0, 1e-7);
}

TEST(Sensitivity, OfAModelThatIsSplitByAnOption) {
  const SmartPtr<Model> model = new Model;
  const auto app = application(1e-10);
  app->Options()->SetStringValue("minmax_max_variables", "1");
  ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
  Sensitivity sensitivity;
  ASSERT_EQ(app->UpdateSensitivity(sensitivity), "");
  EXPECT_NEAR(sensitivity.reaction(std::vector<double>{1.0, 0.0, 0.0}).v[1], 1.5, 1e-8);
}

/// Differences of the fourth order of solutions of the pursuit along a path of present states.
std::vector<double> differences(chauffeur::ChauffeurTNLP& model, MinMaxApplication& app,
                                const std::function<chauffeur::State(double)>& path) {
  constexpr double h = 1e-3;
  std::vector<double> derivative(app.LastResult().v.size(), 0.0);
  for (const auto& [times, weight] :
       {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
    model.set_state(path(times * h));
    EXPECT_EQ(app.ReOptimizeTNLP(&model), Ipopt::Solve_Succeeded);
    EXPECT_EQ(app.LastResult().certificate.kind, PointKind::LocalMinmax);
    for (std::size_t i = 0; i < derivative.size(); ++i) {
      derivative[i] += weight / (12.0 * h) * app.LastResult().v[i];
    }
  }
  return derivative;
}

TEST(Sensitivity, OfThePursuitToItsPresentStatesIsThatOfDifferences) {
  // d_max 0.03: the evader walks at full speed for a while, so that constraints are active.
  for (const double d_max : {0.06, 0.03}) {
    chauffeur::Parameters parameters;
    parameters.d_max = d_max;
    parameters.gamma_d = 400.0;
    const chauffeur::State now{0.0, 0.0, 0.0, 0.5, 0.5};
    const SmartPtr<chauffeur::ChauffeurTNLP> model =
        new chauffeur::ChauffeurTNLP(parameters, now, {0.01, 0.002, 0.001});
    const auto app = application(1e-12);
    ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
    ASSERT_EQ(app->LastResult().certificate.kind, PointKind::LocalMinmax);
    Sensitivity sensitivity;
    ASSERT_EQ(app->UpdateSensitivity(sensitivity), "");
    EXPECT_TRUE(sensitivity.weakly_active().empty());
    int active = 0;
    const std::vector<double>& lambda = app->LastResult().lambda;
    for (std::size_t j = 6; j < lambda.size(); j += 7) active += std::abs(lambda[j]) > 1e-6 ? 1 : 0;
    EXPECT_EQ(active > 0, d_max < 0.05) << active;

    using chauffeur::State;
    for (double State::*component :
         {&State::px, &State::py, &State::heading, &State::ex, &State::ey}) {
      // For the heading the constants move along a curve, of which the derivative sees the tangent.
      const auto path = [&](double by) {
        State state = now;
        state.*component += by;
        return state;
      };
      model->set_state(now);
      constexpr double tiny = 1e-6;
      BoundChange tangent = model->state_change(path(tiny));
      const BoundChange back = model->state_change(path(-tiny));
      for (std::size_t j = 0; j < tangent.constraint_lower.size(); ++j) {
        tangent.constraint_lower[j] =
            (tangent.constraint_lower[j] - back.constraint_lower[j]) / (2.0 * tiny);
      }
      tangent.constraint_upper = tangent.constraint_lower;
      const std::vector<double> found = sensitivity.derivative(tangent).v;
      const std::vector<double> expected = differences(*model, *app, path);
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_NEAR(found[i], expected[i], 1e-6 * std::max(1.0, std::abs(expected[i]))) << i;
      }
    }
  }
}

TEST(Sensitivity, PredictionsOfThePursuitHaveSecondOrderErrors) {
  const chauffeur::State now{0.0, 0.0, 0.0, 0.5, 0.5};
  const SmartPtr<chauffeur::ChauffeurTNLP> model =
      new chauffeur::ChauffeurTNLP({}, now, {0.01, 0.002, 0.001});
  const auto app = application(1e-10);
  ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
  Sensitivity sensitivity;
  ASSERT_EQ(app->UpdateSensitivity(sensitivity), "");
  std::array<double, 2> error{}, value_error{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double by = k == 0 ? 2e-2 : 1e-2;
    const chauffeur::State other{by, -by, by, 0.5 + by, 0.5 - 2.0 * by};
    model->set_state(now);
    const Prediction predicted = sensitivity.predict(model->state_change(other));
    EXPECT_EQ(predicted.share, 1.0);
    model->set_state(other);
    ASSERT_EQ(app->ReOptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
    const Result& exact = app->LastResult();
    for (std::size_t i = 0; i < exact.v.size(); ++i) {
      error[k] = std::max(error[k], std::abs(predicted.v[i] - exact.v[i]));
    }
    value_error[k] = std::abs(predicted.objective - exact.objective);
  }
  EXPECT_LT(error[1], 0.3 * error[0]);               // 1/4
  EXPECT_LT(value_error[1], 0.16 * value_error[0]);  // 1/8
}

// --- The C interface -----------------------------------------------------------------------------

using Callbacks = CCallbacks<Model>;

class CSensitivity : public ::testing::Test {
 protected:
  void SetUp() override {
    constexpr std::array<double, 3> x_L{-10.0, -5.0, -1e20}, x_U{1e20, 5.0, 1e20};
    constexpr std::array<double, 2> g_L{1.0, -1e20}, g_U{1.0, 4.0};
    constexpr std::array<int, 3> players{IPMINMAX_MIN, IPMINMAX_MAX, IPMINMAX_MIN};
    problem_ = IpminmaxCreate(3, x_L.data(), x_U.data(), 2, g_L.data(), g_U.data(), 4, 4, 0,
                              Callbacks::eval_f, Callbacks::eval_g, Callbacks::eval_grad_f,
                              Callbacks::eval_jac_g, Callbacks::eval_h, players.data(), nullptr);
    ASSERT_NE(problem_, nullptr);
    IpminmaxAddIntOption(problem_, "print_level", 0);
    IpminmaxAddNumOption(problem_, "bound_relax_factor", 0.0);
  }
  void TearDown() override { IpminmaxFree(problem_); }
  IpminmaxReturnStatus solve() {
    x_ = {1.0, 0.5, 0.0};
    return IpminmaxSolve(problem_, x_.data(), nullptr, nullptr, nullptr, nullptr, nullptr,
                         GetRawPtr(model_));
  }
  SmartPtr<Model> model_ = new Model;
  IpminmaxProblem problem_ = nullptr;
  std::array<double, 3> x_{};
};

TEST_F(CSensitivity, DerivativesAndReactions) {
  ASSERT_EQ(solve(), IPMINMAX_SOLVE_SUCCEEDED);
  ASSERT_EQ(IpminmaxUpdateSensitivity(problem_), 1) << IpminmaxMessage(problem_);
  const std::array<double, 2> one{1.0, 0.0};
  std::array<double, 3> dx{};
  std::array<double, 2> dlambda{};
  double slope = 0.0, curvature = 0.0;
  ASSERT_EQ(IpminmaxGetDerivative(problem_, nullptr, nullptr, one.data(), one.data(), dx.data(),
                                  dlambda.data(), nullptr, nullptr, &slope, &curvature),
            1)
      << IpminmaxMessage(problem_);
  EXPECT_NEAR(dx[0], 4.0 / 21.0, 1e-7);
  EXPECT_NEAR(dx[1], 2.0 / 7.0, 1e-7);
  EXPECT_NEAR(dlambda[0], -34.0 / 21.0, 1e-7);
  EXPECT_NEAR(slope, 34.0 / 21.0, 1e-7);
  EXPECT_NEAR(curvature, 34.0 / 21.0, 1e-7);

  const std::array<double, 3> move{1.0, 99.0, 0.0};  // Max's entry is not read
  ASSERT_EQ(IpminmaxGetReaction(problem_, move.data(), dx.data(), nullptr, nullptr, nullptr, &slope,
                                nullptr),
            1);
  EXPECT_NEAR(dx[1], 1.5, 1e-7);
  EXPECT_NEAR(slope, 34.0 / 21.0, 1e-7);  // of 17/4 x0^2 at 4/21
}

TEST_F(CSensitivity, PredictionsNameTheActiveSetsChanges) {
  ASSERT_EQ(solve(), IPMINMAX_SOLVE_SUCCEEDED);
  ASSERT_EQ(IpminmaxUpdateSensitivity(problem_), 1);
  const std::array<double, 3> far{10.0, 0.0, 0.0};
  std::array<double, 3> x{};
  double f = 0.0, share = 0.0;
  ASSERT_EQ(IpminmaxPredictReaction(problem_, far.data(), x.data(), nullptr, nullptr, nullptr, &f,
                                    &share),
            1);
  EXPECT_EQ(share, 1.0);
  EXPECT_NEAR(x[1], 5.0, 1e-7);
  IpminmaxActiveSetChange change{};
  ASSERT_EQ(IpminmaxGetActiveSetChanges(problem_, 1, &change), 1);
  EXPECT_EQ(change.of_constraint, 0);
  EXPECT_EQ(change.index, 1);
  EXPECT_EQ(change.upper, 1);
  EXPECT_EQ(change.enters, 1);
  EXPECT_NEAR(change.share, (5.0 - 2.0 / 7.0) / 15.0, 1e-7);

  const std::array<double, 3> beyond{1e308, 0.0, 0.0};  // f overflows
  ASSERT_EQ(IpminmaxPredictReaction(problem_, beyond.data(), x.data(), nullptr, nullptr, nullptr,
                                    &f, &share),
            1);
  EXPECT_LT(share, 1.0);
  EXPECT_TRUE(std::isfinite(x[1]) && std::isfinite(f));
  EXPECT_EQ(IpminmaxGetReaction(problem_, beyond.data(), x.data(), nullptr, nullptr, nullptr, &f,
                                nullptr),
            0);

  const std::array<double, 2> one{1.0, 0.0};
  ASSERT_EQ(IpminmaxPredict(problem_, nullptr, nullptr, one.data(), one.data(), x.data(), nullptr,
                            nullptr, nullptr, &f, &share),
            1);
  EXPECT_NEAR(x[0], 8.0 / 21.0, 1e-7);
  EXPECT_NEAR(f, 4.0 * 17.0 / 21.0, 1e-6);  // quadratic: exact
  EXPECT_EQ(IpminmaxGetActiveSetChanges(problem_, 0, nullptr), 0);
}

TEST_F(CSensitivity, SaysWhatIsWrong) {
  const auto message = [&] { return std::string(IpminmaxMessage(problem_)); };
  const std::array<double, 2> one{1.0, 0.0};
  const auto derivative = [&](const double* g_L, const double* g_U) {
    return IpminmaxGetDerivative(problem_, nullptr, nullptr, g_L, g_U, nullptr, nullptr, nullptr,
                                 nullptr, nullptr, nullptr);
  };
  EXPECT_EQ(IpminmaxUpdateSensitivity(problem_), 0);
  EXPECT_EQ(message(), "no solve has reached a first iterate");
  EXPECT_EQ(derivative(one.data(), one.data()), 0);
  EXPECT_NE(message().find("IpminmaxUpdateSensitivity"), std::string::npos);
  ASSERT_EQ(solve(), IPMINMAX_SOLVE_SUCCEEDED);
  ASSERT_EQ(IpminmaxUpdateSensitivity(problem_), 1);
  EXPECT_EQ(derivative(one.data(), nullptr), 0);
  EXPECT_EQ(message(), "the equal bounds of constraint 0 must be moved alike");
  const std::array<double, 2> nan{std::nan(""), 0.0};
  EXPECT_EQ(derivative(nan.data(), nan.data()), 0);
  EXPECT_EQ(message(), "dg_L[0] is NaN");
  EXPECT_EQ(
      IpminmaxGetReaction(problem_, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr),
      0);
  EXPECT_EQ(message(), "dx_min is NULL");
  EXPECT_EQ(derivative(one.data(), one.data()), 1);
  ASSERT_EQ(solve(), IPMINMAX_SOLVE_SUCCEEDED);  // the sensitivity was the last solution's
  EXPECT_EQ(derivative(one.data(), one.data()), 0);
  EXPECT_EQ(IpminmaxUpdateSensitivity(nullptr), 0);
}

}  // namespace
}  // namespace ipminmax
