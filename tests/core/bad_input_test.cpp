#include <cmath>
#include <functional>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <problems/quadratic_problem.hpp>
#include <support/autodiff_problem.hpp>

#include "core/kkt/block.hpp"
#include "core/sensitivity.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// A good problem: min over price in [-4, 4], max over load of a saddle, with a Min constraint
/// (budget) and a Max constraint (link). Starts away from its solution.
Model good_model() {
  Model model;
  const Expression x = model.variable(kMin, "x", -4.0, 4.0);
  const Expression y = model.variable(kMax, "y", -4.0, 4.0);
  model.objective(square(x - 1.0) + x * y - square(y) + 0.1 * pow(x, 4.0));
  model.constraint(x + square(x), -kNoBound, 10.0);
  model.constraint(y + x * y, -3.0, 3.0);
  return model;
}

/// A good problem that goes wrong where it is told to.
class Faulty final : public Problem {
 public:
  explicit Faulty(const Model& model = good_model(), std::vector<double> start = {2.0, 1.5})
      : model_(model, std::move(start)), shape(model_.structure()) {
    shape.variable_names = {"price", "load"};
    shape.constraint_names = {"budget", "link"};
  }

 private:
  AutodiffProblem model_;

 public:
  ProblemStructure shape;
  std::function<void(const std::string& function)> before = [](const std::string&) {};
  std::string undefined;  ///< function that returns false
  std::string poisoned;   ///< function whose entry 'entry' is 'poison'
  std::size_t entry = 0;
  double poison = kNaN;
  int good_calls = 0;  ///< of the faulty function before it fails
  /// Where the functions are undefined; empty: by good_calls.
  std::function<bool(std::span<const double>)> forbidden;

  const ProblemStructure& structure() const override { return shape; }
  bool starting_point(StartingPoint& start) override {
    before("starting_point");
    const bool ok = undefined != "starting_point" && model_.starting_point(start);
    if (poisoned == "starting_point") start.v[entry] = poison;
    if (poisoned == "start lambda") start.lambda[entry] = poison;
    if (poisoned == "start z_lower") start.z_lower[entry] = poison;
    if (poisoned == "start z_upper") start.z_upper[entry] = poison;
    return ok;
  }
  bool objective(std::span<const double> v, bool fresh, double& f) override {
    return run("objective", v, [&] { return model_.objective(v, fresh, f); }, {&f, 1});
  }
  bool gradient(std::span<const double> v, bool fresh, std::span<double> out) override {
    return run(
        "gradient", v, [&] { return model_.gradient(v, fresh, out); }, out);
  }
  bool constraints(std::span<const double> v, bool fresh, std::span<double> out) override {
    return run(
        "constraints", v, [&] { return model_.constraints(v, fresh, out); }, out);
  }
  bool jacobian(std::span<const double> v, bool fresh, std::span<double> out) override {
    return run(
        "jacobian", v, [&] { return model_.jacobian(v, fresh, out); }, out);
  }
  bool hessian(std::span<const double> v, bool fresh, double sigma, std::span<const double> lambda,
               bool fresh_lambda, std::span<double> out) override {
    return run(
        "hessian", v, [&] { return model_.hessian(v, fresh, sigma, lambda, fresh_lambda, out); },
        out);
  }

 private:
  template <class Call>
  bool run(const std::string& function, std::span<const double> v, Call call,
           std::span<double> out) {
    before(function);
    const bool ok = call();
    const bool is_due = function == undefined || function == poisoned;
    if (!is_due) return ok;
    if (forbidden ? !forbidden(v) : good_calls-- > 0) return ok;
    if (function == poisoned) out[entry] = poison;
    return function != undefined;
  }
};

const std::vector<std::string> kFunctions = {"objective", "gradient", "constraints", "jacobian",
                                             "hessian"};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

SolverOptions with(Globalization globalization) {
  SolverOptions options;
  options.minmax_globalization = globalization;
  return options;
}

TEST(GoodInput, IsSolved) {
  for (const auto globalization : {Globalization::None, Globalization::Filter}) {
    Faulty problem;
    const Result result = solve(problem, with(globalization));
    EXPECT_EQ(result.status, Status::Solved) << result.message;
    EXPECT_GT(result.iterations, 3) << "the faults below have to have a chance to strike";
  }
}

// --- Structure -----------------------------------------------------------------------------------

/// Result for a structure changed by a function; the model's functions must not be called.
Result solve_changed(const std::function<void(ProblemStructure&)>& change) {
  Faulty problem;
  change(problem.shape);
  problem.before = [](const std::string& function) {
    ADD_FAILURE() << function << " called although the structure is invalid";
  };
  SolverOptions options;
  options.minmax_robust_constraints = false;
  return solve(problem, options);
}

TEST(InvalidStructure, AMinConstraintMayNotReadAMaxVariable) {
  const Result result = solve_changed([](ProblemStructure& s) {
    s.constraint_players = {kMin, kMin};
  });
  EXPECT_EQ(result.status, Status::InvalidProblem);
  EXPECT_TRUE(contains(result.message, "constraint 1 (link)")) << result.message;
  EXPECT_TRUE(contains(result.message, "variable 1 (load)")) << result.message;
  EXPECT_TRUE(contains(result.message, "Min")) << result.message;
  EXPECT_TRUE(contains(result.message, "Max")) << result.message;
}

TEST(InvalidStructure, WithoutNamesTheIndicesAreGiven) {
  const Result result = solve_changed([](ProblemStructure& s) {
    s.constraint_players = {kMin, kMin};
    s.variable_names.clear();
    s.constraint_names.clear();
  });
  EXPECT_TRUE(contains(result.message, "constraint 1 ")) << result.message;
  EXPECT_TRUE(contains(result.message, "variable 1")) << result.message;
  EXPECT_FALSE(contains(result.message, "(")) << result.message;
}

TEST(InvalidStructure, AMaxConstraintMayReadMinVariablesOnly) {
  Faulty problem;
  problem.shape.constraint_players = {kMax, kMax};
  const Result result = solve(problem, {});
  EXPECT_NE(result.status, Status::InvalidProblem) << result.message;
}

TEST(InvalidStructure, IndicesOutOfRangeAreNamed) {
  struct Case {
    bool hessian;
    Triplet entry;
    const char* part;
  };
  for (const Case& c : {Case{false, {2, 0}, "row 2"}, Case{false, {-1, 0}, "row -1"},
                        Case{false, {0, 2}, "column 2"}, Case{false, {0, -7}, "column -7"},
                        Case{true, {2, 0}, "row 2"}, Case{true, {0, -1}, "column -1"}}) {
    const Result result = solve_changed(
        [&](ProblemStructure& s) { (c.hessian ? s.hessian : s.jacobian)[1] = c.entry; });
    EXPECT_EQ(result.status, Status::InvalidProblem);
    EXPECT_TRUE(contains(result.message, c.part)) << result.message;
    EXPECT_TRUE(contains(result.message, "entry 1")) << result.message;
    EXPECT_TRUE(contains(result.message, c.hessian ? "Hessian" : "Jacobian")) << result.message;
  }
}

TEST(InvalidStructure, BoundsHaveToMatchInNumber) {
  for (const auto& member :
       {&ProblemStructure::variable_lower, &ProblemStructure::variable_upper,
        &ProblemStructure::constraint_lower, &ProblemStructure::constraint_upper}) {
    const Result result = solve_changed([&](ProblemStructure& s) { (s.*member).pop_back(); });
    EXPECT_EQ(result.status, Status::InvalidProblem);
    EXPECT_TRUE(contains(result.message, "bounds")) << result.message;
  }
}

TEST(InvalidBounds, AreNamed) {
  struct Case {
    std::vector<double> ProblemStructure::*member;
    double value;
    const char* name;
    const char* what;
  };
  for (const Case& c :
       {Case{&ProblemStructure::variable_lower, kNaN, "variable 1 (load)", "NaN"},
        Case{&ProblemStructure::variable_upper, kNaN, "variable 1 (load)", "NaN"},
        Case{&ProblemStructure::constraint_lower, kNaN, "constraint 1 (link)", "NaN"},
        Case{&ProblemStructure::constraint_upper, kNaN, "constraint 1 (link)", "NaN"},
        Case{&ProblemStructure::variable_lower, 4.5, "variable 1 (load)", "4.5"},
        Case{&ProblemStructure::constraint_upper, -3.5, "constraint 1 (link)", "-3.5"},
        Case{&ProblemStructure::variable_lower, kInf, "variable 1 (load)", "inf"},
        Case{&ProblemStructure::constraint_upper, -kInf, "constraint 1 (link)", "inf"}}) {
    const Result result = solve_changed([&](ProblemStructure& s) { (s.*c.member)[1] = c.value; });
    EXPECT_EQ(result.status, Status::InvalidProblem) << c.value;
    EXPECT_TRUE(contains(result.message, c.name)) << result.message;
    EXPECT_TRUE(contains(result.message, c.what)) << result.message;
  }
}

TEST(InvalidBounds, BothInfiniteOnTheSameSideAreRefused) {
  for (const double value : {kInf, -kInf}) {
    const Result result = solve_changed(
        [&](ProblemStructure& s) { s.variable_lower[0] = s.variable_upper[0] = value; });
    EXPECT_EQ(result.status, Status::InvalidProblem);
    EXPECT_TRUE(contains(result.message, "variable 0 (price)")) << result.message;
  }
}

TEST(InvalidBounds, TrueInfinitiesAreAbsentBounds) {
  Faulty problem;
  problem.shape.variable_lower = {-kInf, -kInf};
  problem.shape.variable_upper = {kInf, kInf};
  problem.shape.constraint_lower[0] = -kInf;
  EXPECT_EQ(solve(problem, {}).status, Status::Solved);
}

TEST(TooFewDegreesOfFreedom, AreCountedPerPlayer) {
  for (const Player player : {kMin, kMax}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y");
    model.objective(square(x) - square(y));
    const Expression& own = player == kMin ? x : y;
    model.constraint(1.0 * own, 1.0, 1.0, player);
    model.constraint(square(own), 1.0, 1.0, player);
    AutodiffProblem problem(model, {0.0, 0.0});
    const Result result = solve(problem, {});
    EXPECT_EQ(result.status, Status::TooFewDegreesOfFreedom);
    EXPECT_TRUE(contains(result.message, player == kMin ? "Min player" : "Max player"))
        << result.message;
    EXPECT_TRUE(contains(result.message, "1 free")) << result.message;
    EXPECT_TRUE(contains(result.message, "2 equality")) << result.message;
  }
}

TEST(TooFewDegreesOfFreedom, FixedVariablesAreKeptWhereThatHelps) {
  // x + z = 3 and x z = 2 say the same of x where z = 1.
  for (const double z_fixed : {1.0, 1.5}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression z = model.variable(kMin, "z", z_fixed, z_fixed);
    const Expression y = model.variable(kMax, "y");
    model.objective(square(x) + x * y - square(y));
    model.constraint(x + z, 3.0, 3.0);
    model.constraint(x * z, 2.0, 2.0);
    AutodiffProblem problem(model, {0.5, z_fixed, 0.0});
    SolverOptions options;
    std::string told;
    const Result result =
        solve(problem, options,
              SolveObserver{.on_iteration = {}, .message = [&](auto text) { told += text; }});
    if (z_fixed == 1.0) {
      EXPECT_TRUE(is_success(result.status)) << name_of(result.status) << result.message;
      EXPECT_NEAR(result.v.at(0), 2.0, 1e-6);
      EXPECT_NEAR(result.v.at(1), 1.0, 1e-7);
      EXPECT_NEAR(result.v.at(2), 1.0, 1e-5);
      EXPECT_TRUE(contains(told, "relax_bounds")) << told;
      EXPECT_TRUE(result.fixed_variables_relaxed);
    } else {
      EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
      EXPECT_NE(result.status, Status::TooFewDegreesOfFreedom);
    }
    options.bound_relax_factor = 0.0;
    EXPECT_EQ(solve(problem, options).status, Status::TooFewDegreesOfFreedom);
  }
}

// --- Start ---------------------------------------------------------------------------------------

TEST(BadStart, MissingIsInvalid) {
  Faulty problem;
  problem.undefined = "starting_point";
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::InvalidProblem);
  EXPECT_TRUE(contains(result.message, "starting point")) << result.message;
}

TEST(BadStart, NumbersHaveToBeFinite) {
  for (const double value : {kNaN, kInf, -kInf}) {
    Faulty problem;
    problem.poisoned = "starting_point";
    problem.entry = 1;
    problem.poison = value;
    const Result result = solve(problem, {});
    EXPECT_EQ(result.status, Status::InvalidNumber);
    EXPECT_TRUE(contains(result.message, "starting point")) << result.message;
    EXPECT_TRUE(contains(result.message, "variable 1 (load)")) << result.message;
  }
}

TEST(BadStart, MultipliersHaveToBeFinite) {
  struct Case {
    const char* array;
    const char* name;
  };
  for (const Case& c : {Case{"start lambda", "multiplier of constraint 1 (link)"},
                        Case{"start z_lower", "lower bound of variable 1 (load)"},
                        Case{"start z_upper", "upper bound of variable 1 (load)"}}) {
    for (const double value : {kNaN, kInf, -kInf}) {
      for (const auto globalization : {Globalization::None, Globalization::Filter}) {
        Faulty problem;
        problem.poisoned = c.array;
        problem.entry = 1;
        problem.poison = value;
        SolverOptions options = with(globalization);
        EXPECT_EQ(solve(problem, options).status, Status::Solved) << "a cold start reads none";
        options.warm_start_init_point = true;
        const Result result = solve(problem, options);
        EXPECT_EQ(result.status, Status::InvalidNumber) << name_of(result.status);
        EXPECT_TRUE(contains(result.message, "starting multiplier")) << result.message;
        EXPECT_TRUE(contains(result.message, c.name)) << result.message;
      }
    }
  }
}

TEST(BadStart, MultipliersOfAbsentBoundsAreNotRead) {
  for (const char* array : {"start z_lower", "start z_upper"}) {
    Faulty problem;
    problem.shape.variable_lower[1] = -kInf;
    problem.shape.variable_upper[1] = kInf;
    problem.poisoned = array;
    problem.entry = 1;
    SolverOptions options;
    options.warm_start_init_point = true;
    EXPECT_EQ(solve(problem, options).status, Status::Solved);
  }
}

/// Undefined where x is not positive.
Model logarithms(double lower) {
  Model model;
  const Expression x = model.variable(kMin, "x", lower, 9.0);
  const Expression z = model.variable(kMin, "z", -1.0, 1.0);
  model.objective(square(x - 2.0) - log(x) + square(z));
  model.constraint(log(x) + z, -kNoBound, 1.0);
  return model;
}

TEST(StartOutsideTheBounds, FunctionsNeedNotBeDefinedThere) {
  for (const auto scaling : {Scaling::None, Scaling::GradientBased}) {
    for (const double x : {-0.05, 0.0}) {
      AutodiffProblem problem(logarithms(1e-6), {x, 0.25});
      SolverOptions options;
      options.nlp_scaling_method = scaling;
      const Result result = solve(problem, options);
      EXPECT_EQ(result.status, Status::Solved) << result.message;
    }
  }
}

TEST(StartOutsideTheBounds, IsStillAnErrorWithoutBounds) {
  for (const auto scaling : {Scaling::None, Scaling::GradientBased}) {
    AutodiffProblem problem(logarithms(-kNoBound), {-0.05, 0.25});
    SolverOptions options;
    options.nlp_scaling_method = scaling;
    EXPECT_EQ(solve(problem, options).status, Status::EvaluationFailed);
  }
}

// --- Evaluations ---------------------------------------------------------------------------------

/// Values that the solve has no use for are not checked, as in Ipopt: derivatives in a fixed
/// variable may not even exist (a root at zero).
TEST(UnusedValues, OfFixedVariablesMayBeAnything) {
  for (const double value : {kNaN, kInf, -kInf}) {
    for (const auto scaling : {Scaling::None, Scaling::GradientBased}) {
      for (const std::string function : {"gradient", "jacobian", "hessian"}) {
        Faulty problem;
        problem.shape.variable_lower[1] = problem.shape.variable_upper[1] = 0.5;
        const auto& triplets =
            function == "jacobian" ? problem.shape.jacobian : problem.shape.hessian;
        for (problem.entry = 0; function != "gradient" && triplets[problem.entry].col != 1;) {
          ++problem.entry;
        }
        if (function == "gradient") problem.entry = 1;
        problem.poisoned = function;
        problem.poison = value;
        SolverOptions options;
        options.nlp_scaling_method = scaling;
        const Result result = solve(problem, options);
        EXPECT_EQ(result.status, Status::Solved) << function << ": " << result.message;
        for (const auto* multipliers : {&result.lambda, &result.z_lower, &result.z_upper}) {
          for (const double z : *multipliers) EXPECT_TRUE(std::isfinite(z)) << function;
        }
      }
    }
  }
}

/// Every combination of function, method and scaling.
struct Setting {
  std::string function;
  Globalization globalization = Globalization::Filter;
  Scaling scaling = Scaling::GradientBased;
  [[nodiscard]] SolverOptions options() const {
    SolverOptions options = with(globalization);
    options.nlp_scaling_method = scaling;
    return options;
  }
};

std::vector<Setting> settings() {
  std::vector<Setting> all;
  for (const std::string& function : kFunctions) {
    for (const auto globalization : {Globalization::None, Globalization::Filter}) {
      for (const auto scaling : {Scaling::None, Scaling::GradientBased}) {
        all.push_back({function, globalization, scaling});
      }
    }
  }
  return all;
}

/// What messages call a function.
std::string in_words(const std::string& function) {
  if (function == "gradient") return "gradient of the objective";
  if (function == "constraints") return "constraint";
  if (function == "jacobian") return "Jacobian";
  if (function == "hessian") return "Hessian";
  return function;
}

class BadEvaluation : public ::testing::TestWithParam<Setting> {};

TEST_P(BadEvaluation, UndefinedAtTheStartIsNamed) {
  Faulty problem;
  problem.undefined = GetParam().function;
  const Result result = solve(problem, GetParam().options());
  EXPECT_EQ(result.status, Status::EvaluationFailed) << name_of(result.status);
  EXPECT_TRUE(contains(result.message, in_words(GetParam().function))) << result.message;
  EXPECT_TRUE(contains(result.message, "undefined at the starting point")) << result.message;
}

TEST_P(BadEvaluation, NotANumberAtTheStartIsNamed) {
  for (const double value : {kNaN, kInf, -kInf}) {
    Faulty problem;
    problem.poisoned = GetParam().function;
    problem.poison = value;
    const Result result = solve(problem, GetParam().options());
    EXPECT_EQ(result.status, Status::InvalidNumber) << name_of(result.status);
    EXPECT_TRUE(contains(result.message, in_words(GetParam().function))) << result.message;
    EXPECT_TRUE(contains(result.message, "at the starting point")) << result.message;
    if (GetParam().function == "gradient" || GetParam().function == "hessian") {
      EXPECT_TRUE(contains(result.message, "variable 0 (price)")) << result.message;
    }
    if (GetParam().function == "constraints" || GetParam().function == "jacobian") {
      EXPECT_TRUE(contains(result.message, "constraint 0 (budget)")) << result.message;
    }
  }
}

TEST_P(BadEvaluation, TheLastEntryIsLookedAtToo) {
  Faulty problem;
  problem.poisoned = GetParam().function;
  const ProblemStructure& s = problem.shape;
  problem.entry = GetParam().function == "gradient"      ? 1
                  : GetParam().function == "constraints" ? 1
                  : GetParam().function == "jacobian"    ? s.jacobian.size() - 1
                  : GetParam().function == "hessian"     ? s.hessian.size() - 1
                                                         : 0;
  const Result result = solve(problem, GetParam().options());
  EXPECT_EQ(result.status, Status::InvalidNumber) << name_of(result.status);
}

TEST_P(BadEvaluation, LaterFailuresEndWithoutSuccessOrCrash) {
  for (int good_calls = 1; good_calls <= 5; ++good_calls) {
    for (const bool undefined : {false, true}) {
      Faulty problem;
      (undefined ? problem.undefined : problem.poisoned) = GetParam().function;
      problem.good_calls = good_calls;
      SolverOptions options = GetParam().options();
      options.max_iter = 100;
      const Result result = solve(problem, options);
      EXPECT_FALSE(is_success(result.status)) << good_calls;
      EXPECT_FALSE(result.message.empty());
      for (const double value : result.v) EXPECT_TRUE(std::isfinite(value));
    }
  }
}

TEST_P(BadEvaluation, ExceptionsPassThrough) {
  for (const int after : {0, 1, 2, 4}) {
    Faulty problem;
    int calls = 0;
    problem.before = [&](const std::string& function) {
      if (function == GetParam().function && calls++ >= after) {
        throw std::domain_error("from the model");
      }
    };
    try {
      static_cast<void>(solve(problem, GetParam().options()));
      ADD_FAILURE() << "no exception after " << after;
    } catch (const std::domain_error& error) {
      EXPECT_STREQ(error.what(), "from the model");
    }
  }
}

TEST_P(BadEvaluation, ANewSolveAfterAnExceptionIsAsGoodAsTheFirst) {
  Faulty problem;
  int calls = 0;
  problem.before = [&](const std::string& function) {
    if (function == GetParam().function && ++calls == 2) throw 42;
  };
  EXPECT_THROW(static_cast<void>(solve(problem, GetParam().options())), int);
  EXPECT_EQ(solve(problem, GetParam().options()).status, Status::Solved);
}

TEST_P(BadEvaluation, OutOfMemoryIsAStatus) {
  Faulty problem;
  problem.before = [&](const std::string& function) {
    if (function == GetParam().function) throw std::bad_alloc();
  };
  EXPECT_EQ(solve(problem, GetParam().options()).status, Status::OutOfMemory);
}

// As where the factors of the active set's matrix do not fit, though those of the steps did.
TEST(Memory, ThatEndsInTheCertificateLeavesTheSolution) {
  Faulty problem;
  const Result solved = solve(problem, SolverOptions{});
  ASSERT_EQ(solved.status, Status::Solved) << solved.message;
  int left = solved.iterations + 1;  // calls for the steps
  problem.before = [&](const std::string& function) {
    if (function == "hessian" && --left == -1) throw FactorsOutOfMemory();
  };
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::SolvedDegenerate) << name_of(result.status);
  EXPECT_NEAR(result.objective, solved.objective, 1e-8);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::Undecided);
  ASSERT_FALSE(result.certificate.reasons.empty());
  EXPECT_EQ(result.certificate.reasons.front().text, "the test ran out of memory");
}

INSTANTIATE_TEST_SUITE_P(EveryFunction, BadEvaluation, ::testing::ValuesIn(settings()),
                         [](const auto& instance) {
                           const Setting& s = instance.param;
                           return s.function +
                                  (s.globalization == Globalization::None ? "None" : "Filter") +
                                  (s.scaling == Scaling::None ? "Unscaled" : "Scaled");
                         });

class UndefinedRegion : public ::testing::TestWithParam<Globalization> {};

TEST_P(UndefinedRegion, IsLeftByCuttingTheStep) {
  // The Newton step from the convex side of 1/x + x/4 overshoots, whatever the shift.
  for (const bool nan : {false, true}) {
    for (const std::string function : {"objective", "constraints"}) {
      Model model;
      const Expression x = model.variable(kMin, "x");
      const Expression y = model.variable(kMax, "y");
      model.objective(pow(x, -1.0) + 0.25 * x - square(y));
      model.constraint(x + y, -100.0, 100.0);
      model.constraint(1.0 * y, -100.0, 100.0);
      Faulty problem(model, {GetParam() == Globalization::None ? 0.7 : 9.0, 0.5});
      (nan ? problem.poisoned : problem.undefined) = function;
      int refused = 0;
      problem.forbidden = [&](std::span<const double> v) {
        const bool outside = v[0] <= 0.5 || v[0] > 9.5 || (v[0] > 0.99 && v[0] < 1.2);
        refused += outside;
        return outside;
      };
      const Result result = solve(problem, with(GetParam()));
      EXPECT_EQ(result.status, Status::Solved) << result.message;
      EXPECT_NEAR(result.v[0], 2.0, 1e-5);
      EXPECT_GT(refused, 0) << "the step has to have left the domain";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Globalizations, UndefinedRegion,
                         ::testing::Values(Globalization::None, Globalization::Filter));

// --- Degenerate problems -------------------------------------------------------------------------

class Degenerate : public ::testing::TestWithParam<Globalization> {};

TEST_P(Degenerate, DuplicateEqualitiesOfEitherPlayerLeaveTheModelAsItIs) {
  for (const Player player : {kMin, kMax}) {
    Model model;
    const Expression x0 = model.variable(kMin, "x0");
    const Expression x1 = model.variable(kMin, "x1");
    const Expression y0 = model.variable(kMax, "y0");
    const Expression y1 = model.variable(kMax, "y1");
    model.objective(square(x0 - 1.0) + square(x1) - square(y0 - 2.0) - square(y1) + x0 * y0);
    const Expression sum = player == kMin ? x0 + x1 : y0 + y1;
    model.constraint(sum, 1.0, 1.0);
    model.constraint(2.0 * sum, 2.0, 2.0);
    AutodiffProblem problem(model, {0.3, 0.1, 0.2, -0.4});
    const Result result = solve(problem, with(GetParam()));
    EXPECT_TRUE(is_success(result.status)) << name_of(result.status) << ' ' << result.message;
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_EQ(result.certificate.licq_min, player == kMax);
    EXPECT_EQ(result.certificate.licq_max, player == kMin);
    EXPECT_NEAR(result.constraints[0], 1.0, 1e-6);
  }
}

TEST_P(Degenerate, ContradictingEqualitiesAreNoSuccess) {
  for (const Player player : {kMin, kMax}) {
    Model model;
    const Expression x0 = model.variable(kMin, "x0");
    const Expression x1 = model.variable(kMin, "x1");
    const Expression y0 = model.variable(kMax, "y0");
    const Expression y1 = model.variable(kMax, "y1");
    model.objective(square(x0) + square(x1) - square(y0) - square(y1));
    const Expression sum = player == kMin ? x0 + x1 : y0 + y1;
    model.constraint(sum, 1.0, 1.0);
    model.constraint(sum, 2.0, 2.0);
    AutodiffProblem problem(model, {0.3, 0.1, 0.2, -0.4});
    SolverOptions options = with(GetParam());
    options.max_iter = 200;
    const Result result = solve(problem, options);
    EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
    EXPECT_EQ(result.certificate.kind, PointKind::InfeasiblePoint);
    for (const double value : result.v) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST_P(Degenerate, AnIntervalWithoutInteriorIsSurvived) {
  // Bounds that differ by less than rounding can use, for a variable and for a constraint.
  for (const Player player : {kMin, kMax}) {
    Model model;
    const double upper = 1.0 + 1e-12;
    const Expression t = model.variable(player, "t", 1.0, upper);
    const Expression s = model.variable(player, "s");
    const double sign = player == kMin ? 1.0 : -1.0;
    model.objective(sign * (square(t) + square(s - 3.0)));
    model.constraint(1.0 * s, 2.0, 2.0 + 1e-12);
    AutodiffProblem problem(model, {0.0, 0.0});
    const Result result = solve(problem, with(GetParam()));
    EXPECT_NEAR(result.v[0], 1.0, 1e-6);
    EXPECT_NEAR(result.v[1], 2.0, 1e-2);
    EXPECT_FALSE(result.message.empty());
    // Algorithm 1 has no line search and promises no more than a status.
    if (GetParam() == Globalization::None) continue;
    EXPECT_TRUE(is_success(result.status)) << name_of(result.status) << ' ' << result.message;
    EXPECT_NEAR(result.v[1], 2.0, 1e-6);
  }
}

TEST_P(Degenerate, NoVariablesAtAll) {
  AutodiffProblem problem{Model{}};
  const Result result = solve(problem, with(GetParam()));
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_EQ(result.iterations, 0);
  EXPECT_TRUE(result.v.empty());
}

TEST_P(Degenerate, NoConstraints) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + x * y - square(y) + x);
  AutodiffProblem problem(model, {1.0, 1.0});
  const Result result = solve(problem, with(GetParam()));
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_TRUE(result.lambda.empty());
  EXPECT_EQ(result.counts.constraints, 0);
  EXPECT_EQ(result.counts.jacobian, 0);
}

TEST_P(Degenerate, AllVariablesFixed) {
  Faulty problem;
  problem.shape.variable_lower = problem.shape.variable_upper = {0.5, 0.25};
  const Result result = solve(problem, with(GetParam()));
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_EQ(result.v, (std::vector<double>{0.5, 0.25}));
  // grad f = (2 (x - 1) + y + 0.4 x^3, x - 2y) = (-0.7, 0); a Min multiplier is >= 0.
  EXPECT_NEAR(result.z_upper[0] - result.z_lower[0], 0.7, 1e-6);
  EXPECT_GE(result.z_upper[0], 0.0);
}

TEST_P(Degenerate, AllVariablesFixedAtAnInfeasiblePoint) {
  Faulty problem;
  problem.shape.variable_lower = problem.shape.variable_upper = {3.5, 0.25};  // budget: 15.75 > 10
  const Result result = solve(problem, with(GetParam()));
  EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
  EXPECT_EQ(result.v, (std::vector<double>{3.5, 0.25}));
  EXPECT_EQ(result.certificate.kind, PointKind::InfeasiblePoint);
}

TEST_P(Degenerate, OnePlayerFixed) {
  for (const std::size_t fixed : {0U, 1U}) {
    Faulty problem;
    problem.shape.variable_lower[fixed] = problem.shape.variable_upper[fixed] = 0.5;
    const Result result = solve(problem, with(GetParam()));
    EXPECT_EQ(result.status, Status::Solved) << result.message;
    EXPECT_EQ(result.v[fixed], 0.5);
  }
}

TEST_P(Degenerate, OnlyFreeRows) {
  Faulty problem;
  problem.shape.constraint_lower = {-kInf, -kInf};
  problem.shape.constraint_upper = {kInf, kInf};
  const Result result = solve(problem, with(GetParam()));
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_EQ(result.lambda, (std::vector<double>{0.0, 0.0}));
  EXPECT_EQ(result.constraints.size(), 2U);
}

TEST_P(Degenerate, AConstraintThatReadsNothing) {
  for (const bool satisfied : {true, false}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    model.objective(square(x));
    model.constraint(Expression(0.5), satisfied ? 0.0 : 1.0, 2.0);
    AutodiffProblem problem(model, {1.0});
    SolverOptions options = with(GetParam());
    options.max_iter = 200;
    const Result result = solve(problem, options);
    EXPECT_EQ(is_success(result.status), satisfied) << name_of(result.status);
    EXPECT_FALSE(result.message.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Globalizations, Degenerate,
                         ::testing::Values(Globalization::None, Globalization::Filter),
                         [](const auto& instance) {
                           return instance.param == Globalization::None ? "None" : "Filter";
                         });

// --- Options, limits, callback -------------------------------------------------------------------

TEST(InvalidOptions, AreRefusedBeforeTheModelIsCalled) {
  Faulty problem;
  problem.before = [](const std::string& function) { ADD_FAILURE() << function << " called"; };
  SolverOptions options;
  options.tol = kNaN;
  Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::InvalidOption);
  EXPECT_EQ(result.message, "tol = nan is not in (0, inf)");
  EXPECT_TRUE(result.v.empty());
  options = {};
  options.max_iter = -3;
  result = solve(problem, options);
  EXPECT_EQ(result.status, Status::InvalidOption);
  EXPECT_TRUE(contains(result.message, "max_iter = -3")) << result.message;
  // Of a solve over branches only one start is made.
  for (bool SolverOptions::*form :
       {&SolverOptions::minmax_epigraph, &SolverOptions::minmax_epigraph_at_kinks}) {
    options = {};
    options.*form = true;
    options.minmax_starts = 0;
    result = solve(problem, options);
    EXPECT_EQ(result.status, Status::InvalidOption);
    EXPECT_TRUE(contains(result.message, "minmax_starts = 0")) << result.message;
  }
}

TEST(Limits, NoIterationsReturnTheStartingPoint) {
  Faulty problem;
  SolverOptions options;
  options.max_iter = 0;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::MaxIterations);
  EXPECT_EQ(result.iterations, 0);
  EXPECT_EQ(result.v, (std::vector<double>{2.0, 1.5}));
  EXPECT_EQ(result.constraints, (std::vector<double>{6.0, 4.5}));
  EXPECT_NEAR(result.objective, 1.0 + 3.0 - 2.25 + 1.6, 1e-12);
}

TEST(Limits, ATinyWallTimeStopsEarly) {
  for (const auto globalization : {Globalization::None, Globalization::Filter}) {
    Faulty problem;
    SolverOptions options = with(globalization);
    options.max_wall_time = 1e-9;
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, Status::MaxWallTime);
    EXPECT_EQ(result.iterations, 0);
    EXPECT_EQ(result.counts.analyses, 0);
    EXPECT_EQ(result.v, (std::vector<double>{2.0, 1.5}));
    EXPECT_FALSE(result.message.empty());
  }
}

TEST(Limits, ATinyCpuTimeStopsEarly) {
  Faulty problem;
  double sum = 0.0;
  problem.before = [&](const std::string&) {
    for (int k = 1; k < 100000; ++k) sum += std::sqrt(k);
  };
  SolverOptions options;
  options.max_cpu_time = 1e-6;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::MaxCpuTime) << sum;
  EXPECT_LE(result.iterations, 1);
}

// Before MUMPS, which ends the process, is called. On a cube of unknowns fronts are large.
TEST(Limits, OfMemoryAreSaidBeforeTheyAreReached) {
  constexpr Index kSide = 24;
  testing::QuadraticProblem problem(kSide * kSide * kSide, 0);
  for (Index i = 0; i < kSide * kSide * kSide; ++i) {
    problem.f().add_linear(i, 1.0);
    problem.f().add(i, i, 7.0);
    for (const Index stride : {Index{1}, kSide, kSide * kSide}) {
      if (i / stride % kSide > 0) problem.f().add(i, i - stride, -1.0);
    }
  }
  problem.finish();
  SolverOptions options;
  options.linear_solver = LinearSolver::Mumps;
  options.max_memory = 1.0;  // MB, less than the process has
  const Result refused = solve(problem, options);
  EXPECT_EQ(refused.status, Status::OutOfMemory) << name_of(refused.status);
  EXPECT_TRUE(refused.message.starts_with("out of memory")) << refused.message;
  EXPECT_EQ(refused.iterations, 0);

  options.max_memory = SolverOptions{}.max_memory;
  const Result solved = solve(problem, options);
  ASSERT_EQ(solved.status, Status::Solved) << solved.message;
  options.max_memory = 1.0;
  EXPECT_EQ(Sensitivity().update(problem, solved, options), "out of memory");
}

TEST(Callback, AStopReturnsTheCurrentPointIntact) {
  for (const auto globalization : {Globalization::None, Globalization::Filter}) {
    for (const Index at : {0, 1, 3}) {
      Faulty problem;
      std::vector<double> seen;
      KktError error;
      double objective = 0.0;
      const Result result = solve(problem, with(globalization), [&](const IterationInfo& info) {
        seen.assign(info.v.begin(), info.v.end());
        error = info.error;
        objective = info.objective;
        return info.iteration < at;
      });
      EXPECT_EQ(result.status, Status::UserStop);
      EXPECT_EQ(result.iterations, at);
      EXPECT_EQ(result.v, seen);
      EXPECT_EQ(result.error.total, error.total);
      EXPECT_NEAR(result.objective, objective, 1e-12);
      EXPECT_EQ(result.lambda.size(), 2U);
      EXPECT_EQ(result.certificate.second_order, SecondOrder::NotTested);
      EXPECT_FALSE(result.message.empty());
    }
  }
}

TEST(Callback, ExceptionsPassThrough) {
  Faulty problem;
  EXPECT_THROW(static_cast<void>(solve(problem, {},
                                       [](const IterationInfo& info) -> bool {
                                         if (info.iteration == 2)
                                           throw std::runtime_error("enough");
                                         return true;
                                       })),
               std::runtime_error);
}

TEST(CallersData, StaysUntouched) {
  Faulty problem;
  const ProblemStructure before = problem.shape;
  const SolverOptions options;
  static_cast<void>(solve(problem, options));
  const ProblemStructure& after = problem.shape;
  EXPECT_EQ(after.variable_lower, before.variable_lower);
  EXPECT_EQ(after.variable_upper, before.variable_upper);
  EXPECT_EQ(after.constraint_lower, before.constraint_lower);
  EXPECT_EQ(after.constraint_upper, before.constraint_upper);
  EXPECT_EQ(after.variable_names, before.variable_names);
  EXPECT_EQ(after.variable_players, before.variable_players);
  EXPECT_EQ(after.constraint_players, before.constraint_players);
}

}  // namespace
}  // namespace ipminmax
