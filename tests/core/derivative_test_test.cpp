// The derivative test: right models pass, every kind of mistake is found and named.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/autodiff_problem.hpp>
#include <support/without_hessian.hpp>

#include "core/diagnostics/derivative_test.hpp"

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

SolverOptions test_of(DerivativeTest kind) {
  SolverOptions options;
  options.derivative_test = kind;
  return options;
}

std::vector<std::string> described(const DerivativeReport& report,
                                   const ProblemStructure& structure) {
  std::vector<std::string> texts;
  for (const DerivativeEntry& entry : report.entries) texts.push_back(describe(entry, structure));
  return texts;
}

/// A model whose derivatives are changed on the way.
class Tampered final : public Problem {
 public:
  explicit Tampered(const Model& model, std::vector<double> start = {})
      : problem_(model, std::move(start)),
        structure_(problem_.structure()),
        jacobian_(structure_.jacobian),
        hessian_(structure_.hessian) {}

  std::function<void(std::span<double>)> on_gradient = [](std::span<double>) {};
  std::function<void(std::span<double>)> on_jacobian = on_gradient;
  std::function<void(std::span<double>)> on_hessian = on_gradient;

  ProblemStructure& mutable_structure() { return structure_; }
  void hide_jacobian(Index row, Index col) { hide(structure_.jacobian, row, col); }
  void hide_hessian(Index row, Index col) { hide(structure_.hessian, row, col); }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    return problem_.starting_point(start);
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool n, double& f) override {
    return problem_.objective(v, n, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool n, std::span<double> grad) override {
    const bool ok = problem_.gradient(v, n, grad);
    on_gradient(grad);
    return ok;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool n, std::span<double> g) override {
    return problem_.constraints(v, n, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool n,
                              std::span<double> values) override {
    std::vector<double> all(jacobian_.size());
    const bool ok = problem_.jacobian(v, n, all);
    select(jacobian_, all, structure_.jacobian, values);
    on_jacobian(values);
    return ok;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool n, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    std::vector<double> all(hessian_.size());
    const bool ok = problem_.hessian(v, n, sigma, lambda, new_lambda, all);
    select(hessian_, all, structure_.hessian, values);
    on_hessian(values);
    return ok;
  }

 private:
  static void hide(std::vector<Triplet>& structure, Index row, Index col) {
    std::erase_if(structure,
                  [&](const Triplet& entry) { return entry.row == row && entry.col == col; });
  }
  static void select(const std::vector<Triplet>& from, const std::vector<double>& all,
                     const std::vector<Triplet>& to, std::span<double> values) {
    for (std::size_t k = 0; k < to.size(); ++k) {
      for (std::size_t l = 0; l < from.size(); ++l) {
        if (from[l].row == to[k].row && from[l].col == to[k].col) values[k] = all[l];
      }
    }
  }

  AutodiffProblem problem_;
  ProblemStructure structure_;
  std::vector<Triplet> jacobian_, hessian_;
};

/// v = (x0, x1 | y), f = x0^2 x1 + y x0 - y^2, limit: x0 + x1^2, reach: y^2 + x0.
Model game() {
  Model model;
  const Expression x0 = model.variable(kMin, "x0", -2.0, 2.0), x1 = model.variable(kMin, "x1");
  const Expression y = model.variable(kMax, "y", -3.0, 3.0);
  model.objective(square(x0) * x1 + y * x0 - square(y));
  model.constraint(x0 + square(x1), 0.0, 1.0);
  model.constraint(square(y) + x0, -kNoBound, 4.0);
  return model;
}

const std::vector<double> kStart{1.0, 0.5, 0.5};

TEST(DerivativeTest, RightModelsPass) {
  for (const SmallProblem& known : small_problems()) {
    AutodiffProblem problem(known.model, known.starts.front());
    SolverOptions options = test_of(DerivativeTest::SecondOrder);
    options.point_perturbation_radius = 0.5;
    const DerivativeReport report = test_derivatives(problem, options);
    EXPECT_EQ(report.failure, "");
    EXPECT_EQ(described(report, problem.structure()), std::vector<std::string>{}) << known.name;
    EXPECT_GT(report.first_tested, 0);
    EXPECT_EQ(report.first_wrong + report.second_wrong, 0);
  }
}

TEST(DerivativeTest, CountsWhatItCompares) {
  AutodiffProblem problem(game(), kStart);
  const auto report_of = [&](DerivativeTest kind) {
    return test_derivatives(problem, test_of(kind));
  };
  // Gradient 3, Jacobian 4; Hessian structure of 5 entries for each of 3 functions.
  const std::size_t hessian = problem.structure().hessian.size();
  EXPECT_EQ(report_of(DerivativeTest::FirstOrder).first_tested, 7);
  EXPECT_EQ(report_of(DerivativeTest::FirstOrder).second_tested, 0);
  EXPECT_EQ(report_of(DerivativeTest::OnlySecondOrder).first_tested, 0);
  EXPECT_EQ(report_of(DerivativeTest::OnlySecondOrder).second_tested,
            static_cast<Index>(3 * hessian));
  EXPECT_EQ(report_of(DerivativeTest::SecondOrder).first_tested, 7);
}

TEST(DerivativeTest, NamesWrongEntries) {
  Tampered problem(game(), kStart);
  problem.on_gradient = [](std::span<double> grad) { grad[2] += 0.5; };
  DerivativeReport report = test_derivatives(problem, test_of(DerivativeTest::FirstOrder));
  ASSERT_EQ(described(report, problem.structure()),
            std::vector<std::string>{"gradient of the objective in variable 2 (y) of Max"});
  EXPECT_EQ(report.entries[0].finding, DerivativeFinding::Differs);
  EXPECT_NEAR(report.entries[0].exact - report.entries[0].approximate, 0.5, 1e-5);
  EXPECT_EQ(report.first_wrong, 1);

  problem.on_gradient = [](std::span<double>) {};
  problem.on_jacobian = [](std::span<double> values) { values[1] *= -1.0; };
  problem.mutable_structure().variable_names.clear();
  report = test_derivatives(problem, test_of(DerivativeTest::FirstOrder));
  EXPECT_EQ(described(report, problem.structure()),
            std::vector<std::string>{"Jacobian of constraint 0 (g1) of Min in variable 1 of Min"});
}

TEST(DerivativeTest, NamesWrongSecondDerivatives) {
  Tampered problem(game(), kStart);
  const auto structure = problem.structure().hessian;
  const auto place = static_cast<std::size_t>(
      std::ranges::find_if(structure, [](const Triplet& e) { return e.row == 2 && e.col == 0; }) -
      structure.begin());
  ASSERT_LT(place, structure.size());
  problem.on_hessian = [&](std::span<double> values) { values[place] = 7.0; };
  const DerivativeReport report = test_derivatives(problem, test_of(DerivativeTest::SecondOrder));
  EXPECT_EQ(
      described(report, problem.structure()),
      (std::vector<std::string>{
          "Hessian of the objective in variable 2 (y) of Max and variable 0 (x0) of Min",
          "Hessian of constraint 0 (g1) of Min in variable 2 (y) of Max and variable 0 (x0) of Min",
          "Hessian of constraint 1 (g2) of Max in variable 2 (y) of Max and variable 0 (x0) of "
          "Min"}));
  EXPECT_EQ(report.first_wrong, 0);
  EXPECT_EQ(report.second_wrong, 3);
}

TEST(DerivativeTest, FindsEntriesThatTheStructureMisses) {
  Tampered problem(game(), kStart);
  problem.hide_jacobian(1, 0);
  problem.hide_hessian(1, 0);
  const DerivativeReport report = test_derivatives(problem, test_of(DerivativeTest::SecondOrder));
  EXPECT_EQ(described(report, problem.structure()),
            (std::vector<std::string>{
                "Jacobian of constraint 1 (g2) of Max in variable 0 (x0) of Min",
                "Hessian of the objective in variable 1 (x1) of Min and variable 0 (x0) of Min"}));
  for (const DerivativeEntry& entry : report.entries) {
    EXPECT_EQ(entry.finding, DerivativeFinding::Missing);
    EXPECT_FALSE(entry.crosses_players);
    EXPECT_EQ(entry.exact, 0.0);
    EXPECT_NE(entry.approximate, 0.0);
  }
}

TEST(DerivativeTest, FindsAMinConstraintThatVariesWithMax) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + 0.1 * y, 0.0, 1.0);
  Tampered problem(model, {1.0, 1.0});
  problem.hide_jacobian(0, 1);
  problem.mutable_structure().constraint_players = {kMin};
  const DerivativeReport report = test_derivatives(problem, test_of(DerivativeTest::FirstOrder));
  ASSERT_EQ(described(report, problem.structure()),
            std::vector<std::string>{"Jacobian of constraint 0 (g1) of Min in variable 1 (y) of "
                                     "Max"});
  EXPECT_TRUE(report.entries[0].crosses_players);
}

TEST(DerivativeTest, PrintsAllOnRequest) {
  AutodiffProblem problem(game(), kStart);
  SolverOptions options = test_of(DerivativeTest::SecondOrder);
  options.derivative_test_print_all = true;
  const DerivativeReport report = test_derivatives(problem, options);
  EXPECT_EQ(static_cast<Index>(report.entries.size()), report.first_tested + report.second_tested);
}

TEST(DerivativeTest, FirstIndexIsAVariableThenAConstraint) {
  AutodiffProblem problem(game(), kStart);
  const auto hessian = static_cast<Index>(problem.structure().hessian.size());
  SolverOptions options = test_of(DerivativeTest::FirstOrder);
  options.derivative_test_first_index = 2;
  EXPECT_EQ(test_derivatives(problem, options).first_tested, 2);  // grad f and g2 in y
  options.derivative_test = DerivativeTest::OnlySecondOrder;
  options.derivative_test_first_index = 0;
  EXPECT_EQ(test_derivatives(problem, options).second_tested, 2 * hessian);
  options.derivative_test_first_index = -1;
  EXPECT_EQ(test_derivatives(problem, options).second_tested, 3 * hessian);
  options.derivative_test_first_index = 100;
  EXPECT_EQ(test_derivatives(problem, options).second_tested, 0);
}

TEST(DerivativeTest, ToleranceAndStepAreTheOptions) {
  Tampered problem(game(), kStart);
  problem.on_gradient = [](std::span<double> grad) { grad[1] += 1e-3; };
  SolverOptions options = test_of(DerivativeTest::FirstOrder);
  options.point_perturbation_radius = 0.0;
  EXPECT_EQ(test_derivatives(problem, options).first_wrong, 1);
  options.derivative_test_tol = 1e-2;
  EXPECT_EQ(test_derivatives(problem, options).first_wrong, 0);
  // A long step sees the curvature too.
  options.derivative_test_perturbation = 0.1;
  EXPECT_GT(test_derivatives(problem, options).first_wrong, 0);
}

TEST(DerivativeTest, ThePointStaysInItsBoxAndBounds) {
  AutodiffProblem problem(game(), kStart);
  SolverOptions options = test_of(DerivativeTest::FirstOrder);
  const auto v = test_derivatives(problem, options).v;
  ASSERT_EQ(v.size(), 3U);
  EXPECT_NE(v, kStart);
  EXPECT_LE(std::abs(v[0]), 2.0);
  EXPECT_LE(std::abs(v[1] - 0.5), 10.0);
  EXPECT_LE(std::abs(v[2]), 3.0);
  options.point_perturbation_radius = 0.0;
  EXPECT_EQ(test_derivatives(problem, options).v, kStart);
}

TEST(DerivativeTest, RespectsBoundsAndUndefinedPoints) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 1.0), y = model.variable(kMax, "y");
  const Expression fixed = model.variable(kMin, "fixed", 2.0, 2.0);
  model.objective(sqrt(1.0 - x) * 0.5 + sqrt(x + 1.0) - square(y) + log(y) + square(fixed));
  AutodiffProblem problem(model, {1.0 - 1e-12, 0.1, 2.0});
  SolverOptions options = test_of(DerivativeTest::FirstOrder);
  const DerivativeReport report = test_derivatives(problem, options);  // y < 0 is undefined
  EXPECT_EQ(report.failure, "");
  EXPECT_EQ(described(report, problem.structure()), std::vector<std::string>{});
  EXPECT_EQ(report.first_tested, 3);
}

TEST(DerivativeTest, LargeValuesDoNotRaiseFalseAlarms) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(1e9 + 0.5 * square(x));
  AutodiffProblem problem(model, {1.0});
  EXPECT_EQ(test_derivatives(problem, test_of(DerivativeTest::FirstOrder)).first_wrong, 0);
}

TEST(DerivativeTest, SaysWhenThereAreNoSecondDerivatives) {
  AutodiffProblem problem(game(), kStart);
  WithoutHessian blind(problem);
  const DerivativeReport report = test_derivatives(blind, test_of(DerivativeTest::SecondOrder));
  EXPECT_EQ(report.remarks,
            std::vector<std::string>{"The model has no second derivatives to test."});
  EXPECT_EQ(report.first_tested, 7);
}

TEST(DerivativeTest, NaNCountsAsWrong) {
  Tampered problem(game(), kStart);
  problem.on_hessian = [](std::span<double> values) { values[0] = std::nan(""); };
  EXPECT_EQ(test_derivatives(problem, test_of(DerivativeTest::OnlySecondOrder)).second_wrong, 3);
}

TEST(DerivativeTest, FailuresAreNamed) {
  AutodiffProblem no_start(game());
  EXPECT_EQ(test_derivatives(no_start, test_of(DerivativeTest::FirstOrder)).failure,
            "the model gives no starting point");
  Model model;
  model.objective(log(model.variable(kMin, "x")));
  AutodiffProblem undefined(model, {-100.0});
  EXPECT_NE(test_derivatives(undefined, test_of(DerivativeTest::FirstOrder)).failure, "");
  Tampered wrong(game(), kStart);
  wrong.mutable_structure().jacobian[0].row = 9;
  EXPECT_NE(test_derivatives(wrong, test_of(DerivativeTest::FirstOrder)).failure.find("Jacobian"),
            std::string::npos);
}

}  // namespace
}  // namespace ipminmax::testing
