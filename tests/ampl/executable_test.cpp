// What the executable accepts and refuses, and what it answers.

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <answer.hpp>
#include <nl_problem.hpp>
#include <support/nl_writer.hpp>

namespace ipminmax::testing {
namespace {

/// Parts of a small text file. Every formula reads variable 0; all coefficients of linear parts are
/// zero.
struct Parts {
  struct Objective {
    bool maximize = false;
    std::string formula;
  };
  std::vector<Objective> objectives;
  std::vector<std::string> constraints;  ///< formulas
  std::string rows;                      ///< lines of segment r
  std::string sizes = "0 0";             ///< ranges and equations, logical constraints
  std::string complementarity;
  std::string nonlinear = "1 1 1";     ///< variables in constraints, objectives, both
  std::string functions = "0";         ///< number
  std::string integers = "0 0 0 0 0";  ///< binary, integer, nonlinear integers in both, con, obj
  std::string segments;                ///< S, F, x, d
  std::string bounds = "3";

  [[nodiscard]] std::string text() const {
    const std::string m = std::to_string(constraints.size()),
                      objs = std::to_string(objectives.size());
    std::string text = "g3 1 1 0\n 1 " + m + " " + objs + " " + sizes + "\n " + m + " " + objs +
                       complementarity + "\n 0 0\n " + nonlinear + "\n 0 " + functions + " 0 1\n " +
                       integers + "\n " + m + " " + objs + "\n 0 0\n 0 0 0 0 0\n" + segments;
    for (std::size_t i = 0; i < constraints.size(); ++i)
      text += "C" + std::to_string(i) + "\n" + constraints[i];
    for (std::size_t i = 0; i < objectives.size(); ++i)
      text += "O" + std::to_string(i) + (objectives[i].maximize ? " 1\n" : " 0\n") +
              objectives[i].formula;
    if (!constraints.empty()) text += "r\n" + rows;
    text += "b\n" + bounds + "\nk0\n";
    for (std::size_t i = 0; i < constraints.size(); ++i)
      text += "J" + std::to_string(i) + " 1\n0 0\n";
    for (std::size_t i = 0; i < objectives.size(); ++i)
      text += "G" + std::to_string(i) + " 1\n0 0\n";
    return text;
  }
};

const std::string kSquare = "o5\no0\nv0\nn-3\nn2\n";              // (v - 3)^2
const std::string kNegativeSquare = "o16\no5\no0\nv0\nn4\nn2\n";  // -(v + 4)^2
const std::string kLog = "o43\nv0\n";

Parts minimize(const std::string& formula) {
  Parts parts;
  parts.objectives = {{.maximize = false, .formula = formula}};
  return parts;
}

class AmplExecutable : public Ampl {
 protected:
  int solve(const Parts& parts, const std::string& arguments = "",
            const std::string& environment = "") {
    put("model.nl", parts.text());
    return run("model.nl -s print_level=0 " + arguments, environment);
  }
  /// Whether the model is refused with all these words.
  ::testing::AssertionResult refused(const Parts& parts, const std::vector<std::string>& words) {
    const int code = solve(parts);
    if (code != 1 || std::filesystem::exists(path("model.sol")))
      return ::testing::AssertionFailure() << "exit code " << code;
    for (const std::string& word : words)
      if (err_.find(word) == std::string::npos)
        return ::testing::AssertionFailure() << "no \"" << word << "\" in " << err_;
    return ::testing::AssertionSuccess();
  }
  [[nodiscard]] bool printed(const std::string& text) const {
    return out_.find(text) != std::string::npos;
  }
  [[nodiscard]] bool solution_has(const std::string& text) const {
    return get("model.sol").find(text) != std::string::npos;
  }
};

// min over x, max over y of x^2 + 2 x + x y - y^2, x + y <= 10 for Max: y = x / 2, x = -0.8. The
// linear terms and the constraint stand in segments G and J.
TEST_F(AmplExecutable, LinearPartsCount) {
  std::filesystem::copy(IPMINMAX_SOURCE_DIR "/tests/package/saddle.nl", path("model.nl"));
  ASSERT_EQ(run("model.nl -s print_level=0 tol=1e-10"), 0) << err_;
  EXPECT_TRUE(printed("certified local minmax")) << out_;
  NlProblem problem(path("model.nl"), -1);
  const double v[] = {3.0, 5.0};
  double f = 0.0, g = 0.0, gradient[2], jacobian[2];
  ASSERT_TRUE(problem.eval_f(2, v, true, f) && problem.eval_g(2, v, true, 1, &g) &&
              problem.eval_grad_f(2, v, true, gradient) &&
              problem.eval_jac_g(2, v, true, 1, 2, nullptr, nullptr, jacobian));
  EXPECT_EQ(f, 9.0 + 6.0 + 15.0 - 25.0);
  EXPECT_EQ(gradient[0], 6.0 + 2.0 + 5.0);
  EXPECT_EQ(gradient[1], 3.0 - 10.0);
  EXPECT_EQ(g, 8.0);
  EXPECT_EQ(jacobian[0], 1.0);
  EXPECT_EQ(jacobian[1], 1.0);
  const std::string solution = get("model.sol");
  EXPECT_NE(solution.find("objno 0 0"), std::string::npos);
  EXPECT_TRUE(printed("objective -0.8,")) << out_;
}

TEST_F(AmplExecutable, IntegerVariablesOfAMinimizationAreContinuousWithAWarning) {
  put("model.col", "machines\n");
  const std::string warning =
      "WARNING: variable machines is integer: integer variables are treated as continuous.";
  const auto is_relaxed = [&](const std::string& nonlinear, const std::string& integers) {
    SCOPED_TRACE(integers);
    Parts parts = minimize(nonlinear == "0 0 0" ? "n0\n" : "o5\no0\nv0\nn-3.5\nn2\n");
    parts.nonlinear = nonlinear;
    parts.integers = integers;
    ASSERT_EQ(solve(parts), 0) << err_;
    EXPECT_NE(err_.find(warning), std::string::npos) << err_;
    EXPECT_TRUE(solution_has(warning));
    if (nonlinear != "0 0 0") {
      EXPECT_TRUE(solution_has("\n3.5")) << get("model.sol");
    }
  };
  is_relaxed("1 1 1", "0 0 1 0 0");
  is_relaxed("1 0 0", "0 0 0 1 0");
  is_relaxed("0 1 0", "0 0 0 0 1");
  is_relaxed("0 0 0", "0 1 0 0 0");
  is_relaxed("0 0 0", "1 0 0 0 0");
}

TEST_F(AmplExecutable, IntegerVariablesOfAGameAreRefusedByName) {
  put("model.col", "x\ny\n");
  // min over x, max over y of (x - 3)^2 - y, y in [0, 1], an integer
  const auto game = [](const std::string& integers) {
    return "g3 1 1 0\n 2 0 1 0 0\n 0 1\n 0 0\n 0 1 0\n 0 0 0 1\n " + integers +
           "\n 0 2\n 0 0\n 0 0 0 0 0\nS0 1 player\n1 1\nO0 0\n" + kSquare +
           "b\n3\n0 0 1\nk1\n0\nG0 2\n0 0\n1 -1\n";
  };
  put("model.nl", game("0 0 0 0 0"));
  ASSERT_EQ(run("model.nl -s print_level=0"), 0) << err_;
  put("model.nl", game("1 0 0 0 0"));
  EXPECT_EQ(run("model.nl -s print_level=0"), 1);
  EXPECT_NE(err_.find("variable y is integer"), std::string::npos) << err_;
  EXPECT_FALSE(std::filesystem::exists(path("model.sol")));
}

TEST_F(AmplExecutable, UnsupportedModelsAreRefused) {
  Parts complementary = minimize(kSquare);
  complementary.constraints = {"v0\n"};
  complementary.rows = "5 1 1\n";
  EXPECT_TRUE(refused(complementary, {"cannot read"}));  // the header counts none
  complementary.complementarity = " 0 1 0 0";
  EXPECT_TRUE(refused(complementary, {"complementarity"}));
  Parts logical = minimize(kSquare);
  logical.sizes = "0 0 1";
  EXPECT_TRUE(refused(logical, {"logical"}));
  Parts imported = minimize("f0 1\nv0\n");
  imported.functions = "1";
  imported.segments = "F0 1 1 mystery\n";
  EXPECT_TRUE(refused(imported, {"function mystery", "not available"}));
  Parts sets = minimize(kSquare);
  sets.segments = "S0 1 sosno\n0 1\n";
  EXPECT_TRUE(refused(sets, {"special ordered sets"}));
}

TEST_F(AmplExecutable, BadSuffixValuesAreRefusedByName) {
  put("model.col", "toll\n");
  put("model.row", "budget\n");
  Parts parts = minimize(kSquare);
  parts.segments = "S0 1 player\n0 2\n";
  EXPECT_TRUE(refused(parts, {"variable toll", "player is 2"}));
  parts.constraints = {"v0\n"};
  parts.rows = "1 9\n";
  parts.segments = "S1 1 player\n0 -1\n";
  EXPECT_TRUE(refused(parts, {"constraint budget", "player is -1"}));
}

TEST_F(AmplExecutable, ConstraintSuffixGivesTheOwner) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) - square(y) + x * y);
  model.constraint(x, -5.0, 5.0);
  model.constraint(x, -kNoBound, 9.0, Player::Max);
  model.constraint(x + y, -kNoBound, 9.0);
  const std::string file =
      put("model.nl", NlWriter(model, {1.0, 1.0}, NlWriter::Format::Text).write());
  NlProblem problem(file, -1);
  std::vector<Player> players(3, Player::Min);
  ASSERT_TRUE(problem.get_constraint_players(3, players.data()));
  EXPECT_EQ(players, (std::vector{Player::Min, Player::Max, Player::Max}));
  ASSERT_EQ(run("model.nl -s print_level=0"), 0);
  EXPECT_TRUE(printed("certified local minmax")) << out_;
}

TEST_F(AmplExecutable, UndefinedValuesAndDerivativesDoNotEndIt) {
  Parts parts = minimize(kLog);
  parts.segments = "x1\n0 -1\n";
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("evaluation failed")) << out_;
  EXPECT_TRUE(solution_has("objno 0 550"));
  EXPECT_TRUE(solution_has("minmax_result\n0 503\n")) << get("model.sol");
  // The message names what is undefined: the constraint log(v0) >= 0, not the objective.
  Parts of_constraint = minimize(kSquare);
  of_constraint.constraints = {kLog};
  of_constraint.rows = "2 0\n";
  of_constraint.segments = "x1\n0 -1\n";
  EXPECT_EQ(solve(of_constraint), 0);
  EXPECT_TRUE(printed("the Jacobian of constraint 0 (_scon[1]) is undefined")) << out_;
  // At 0 sqrt(v) has a value and no derivative.
  parts = minimize("o0\no39\nv0\no5\nv0\nn2\n");
  parts.segments = "x1\n0 0\n";
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("evaluation failed")) << out_;
  NlProblem problem(path("model.nl"), -1);
  const double zero = 0.0, four = 4.0;
  double value = 0.0;
  EXPECT_FALSE(problem.eval_grad_f(1, &zero, true, &value));
  EXPECT_FALSE(problem.eval_h(1, &zero, true, 1.0, 0, nullptr, true, 1, nullptr, nullptr, &value));
  ASSERT_TRUE(problem.eval_h(1, &four, true, 1.0, 0, nullptr, true, 1, nullptr, nullptr, &value));
  EXPECT_NEAR(value, 2.0 - 0.25 / 8.0, 1e-14);
  // The first Newton step of v - 10 log v from 25 goes below zero.
  parts = minimize("o0\nv0\no2\nn-10\n" + kLog);
  parts.segments = "x1\n0 25\n";
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("certified local minimum")) << out_;
}

TEST_F(AmplExecutable, ObjectiveIsChosen) {
  Parts parts = minimize(kSquare);
  parts.objectives.push_back({.maximize = true, .formula = kNegativeSquare});
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("certified local minimum")) << out_;
  EXPECT_TRUE(solution_has("\n3\nobjno 0 0\n")) << get("model.sol");
  ASSERT_EQ(solve(parts, "objno=2"), 0) << err_;
  EXPECT_TRUE(printed("certified local maximum")) << out_;
  EXPECT_TRUE(solution_has("\n-4\nobjno 1 0\n")) << get("model.sol");
  ASSERT_EQ(solve(parts, "objno=0"), 0) << err_;
  EXPECT_TRUE(solution_has("\nobjno 0 ")) << get("model.sol");
  EXPECT_EQ(solve(parts, "objno=3"), 1);
  EXPECT_NE(err_.find("has 2 objectives"), std::string::npos) << err_;
  EXPECT_EQ(solve(parts, "objno=x"), 2);
  EXPECT_NE(err_.find("objno = x"), std::string::npos) << err_;
}

TEST_F(AmplExecutable, NoObjectiveIsFeasibility) {
  Parts parts;
  parts.constraints = {"o5\nv0\nn2\n"};
  parts.rows = "4 4\n";
  parts.segments = "x1\n0 1\n";
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(solution_has("\nobjno 0 0\n")) << get("model.sol");
  EXPECT_TRUE(printed("objective 0,")) << out_;
}

TEST_F(AmplExecutable, StartAndMultipliersAreAmpls) {
  for (const bool maximize : {false, true}) {
    Parts parts;
    parts.objectives = {{.maximize = maximize, .formula = maximize ? "o16\n" + kSquare : kSquare}};
    parts.constraints = {"v0\n"};
    parts.rows = "1 2\n";
    parts.segments = "d1\n0 0.5\nx1\n0 1.5\n";
    const std::string file = put("model.nl", parts.text());
    NlProblem problem(file, -1);
    EXPECT_EQ(problem.maximizes(), maximize);
    double v = 0.0, lambda = 0.0, z_lower = 0.0, z_upper = 0.0;
    ASSERT_TRUE(
        problem.get_starting_point(1, true, &v, true, &z_lower, &z_upper, 1, true, &lambda));
    EXPECT_EQ(v, 1.5);
    EXPECT_EQ(lambda, maximize ? 0.5 : -0.5);
    // v <= 2: the optimal value +-(v - 3)^2 changes by -+2 per unit of the bound.
    ASSERT_EQ(run("model -AMPL print_level=0 tol=1e-10"), 0);
    EXPECT_TRUE(solution_has(maximize ? "\n1\n1\n1\n1\n2.0" : "\n1\n1\n1\n1\n-2.0") ||
                solution_has(maximize ? "\n1\n1\n1\n1\n1.9999" : "\n1\n1\n1\n1\n-1.9999"))
        << get("model.sol");
  }
}

// The number is that of Ipopt's executable, the suffix says more.
TEST_F(AmplExecutable, SolveResultsTellTheOutcome) {
  using Numbers = std::pair<int, int>;
  const auto outcome = [&](const Parts& parts, const std::string& arguments) {
    EXPECT_EQ(solve(parts, arguments), 0) << err_;
    const std::string text = get("model.sol");
    const std::string objno = "\nobjno 0 ", suffix = "\nsuffix 3 1 14 0 0\nminmax_result\n0 ";
    const std::size_t at = text.find(objno), more = text.find(suffix);
    return Numbers(at == std::string::npos ? -1 : std::stoi(text.substr(at + objno.size())),
                   more == std::string::npos ? 0 : std::stoi(text.substr(more + suffix.size())));
  };
  EXPECT_EQ(outcome(minimize(kSquare), ""), Numbers(0, 0));
  Parts parts = minimize(kSquare);
  parts.constraints = {"o5\nv0\nn2\n"};
  parts.rows = "1 -1\n";
  EXPECT_EQ(outcome(parts, ""), Numbers(200, 200));
  EXPECT_EQ(outcome(minimize("v0\n"), ""), Numbers(300, 302));
  EXPECT_EQ(outcome(minimize(kLog), "max_iter=0"), Numbers(550, 503));  // no start given: log 0
  EXPECT_EQ(outcome(minimize(kSquare), "max_iter=0"), Numbers(400, 400));
  EXPECT_EQ(outcome(minimize("n2\n"), ""), Numbers(0, 0));  // any point is as good
  parts = minimize(kSquare);
  parts.segments = "S0 1 player\n0 1\n";
  EXPECT_EQ(outcome(parts, ""), Numbers(300, 301));
  // No acceptable point is left by a smaller tolerance than there are digits.
  parts = minimize("o44\n" + kSquare);
  EXPECT_EQ(outcome(parts,
                    "acceptable_tol=1e3 acceptable_iter=1 acceptable_compl_inf_tol=1e9 "
                    "acceptable_dual_inf_tol=1e9 tol=1e-14"),
            Numbers(1, 100));
}

TEST_F(AmplExecutable, TooFewDegreesOfFreedomLeaveIpoptsTraces) {
  Parts parts = minimize(kSquare);
  parts.constraints = {"o5\nv0\nn2\n", "o5\nv0\nn3\n"};
  parts.rows = "4 4\n4 8\n";
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(solution_has("\nobjno 0 551\n")) << get("model.sol");
  // Ipopt writes no file for AMPL; Pyomo looks into the log.
  ASSERT_EQ(run("model.nl -AMPL"), 0) << err_;
  EXPECT_FALSE(std::filesystem::exists(path("model.sol")));
  const std::size_t line = out_.find("TOO_FEW_DEGREES_OF_FREEDOM");
  ASSERT_NE(line, std::string::npos) << out_;
  const std::size_t first = out_.find(':', line), second = out_.find(':', first + 1);
  EXPECT_EQ(out_.compare(second, 31, ": Too few degrees of freedom.\n\n", 31), 0) << out_;
  EXPECT_TRUE(printed("EXIT: Problem has too few degrees of freedom.")) << out_;
}

// An infimum that is bounded and not attained is not called unbounded.
TEST_F(AmplExecutable, AnInfimumThatIsNotAttainedHasAResultOfItsOwn) {
  for (const bool maximize : {false, true}) {
    Parts parts = minimize("o44\no16\nv0\n");  // exp(-v)
    if (maximize) {
      parts.objectives[0].maximize = true;
      parts.objectives[0].formula = "o16\n" + parts.objectives[0].formula;
    }
    ASSERT_EQ(solve(parts), 0) << err_;
    EXPECT_TRUE(solution_has("\nobjno 0 300\n")) << get("model.sol");
    EXPECT_TRUE(solution_has("minmax_result\n0 101\n")) << get("model.sol");
    EXPECT_TRUE(printed("diverge while the gradient goes to zero")) << out_;
  }
}

// min over x, max over y of x^2 + x y - y^2 with nothing for y to choose.
TEST_F(AmplExecutable, AnEmptySetOfTheMaximizerIsInfeasible) {
  const std::string x2 = "o5\nv0\nn2\n", y2 = "o5\nv1\nn2\n";
  const std::string file =
      "g3 1 1 0\n 2 1 1 0 0\n 1 1\n 0 0\n 2 2 2\n 0 0 0 1\n 0 0 0 0 0\n 2 2\n 0 0\n 0 0 0 0 0\n"
      "S0 1 player\n1 1\nC0\no0\n" +
      x2 + y2 + "O0 0\no54\n3\n" + x2 + "o2\nv0\nv1\no16\n" + y2 +
      "x2\n0 1\n1 0.5\nr\n1 -1\nb\n0 -2 2\n3\nk1\n1\nJ0 2\n0 0\n1 0\nG0 2\n0 0\n1 0\n";
  put("model.nl", file);
  ASSERT_EQ(run("model.nl -s print_level=0"), 0) << err_;
  EXPECT_TRUE(solution_has("\nobjno 0 200\n")) << get("model.sol");
  EXPECT_TRUE(solution_has("minmax_result\n0 201\n")) << get("model.sol");
  EXPECT_TRUE(printed("constraint 0")) << out_;
}

// 5 with the constraint 2 in [lower, 3].
TEST_F(AmplExecutable, AModelWithoutVariablesIsSolvedOrInfeasibleAsItsValuesSay) {
  const std::string header =
      "3 1 1 0\n 0 1 1 1 0\n 0 0\n 0 0\n 0 0 0\n 0 0 0 1\n 0 0 0 0 0\n 0 0\n 0 0\n 0 0 0 0 0\n";
  const auto bytes = [](double value) {
    std::string raw(sizeof value, '\0');
    std::memcpy(raw.data(), &value, sizeof value);
    return raw;
  };
  for (const double lower : {1.0, 2.5}) {
    const std::string text =
        "g" + header + "C0\nn2\nO0 1\nn5\nr\n0 " + std::to_string(lower) + " 3\nb\nk0\n";
    const std::string zero(4, '\0'), one = {'\1', '\0', '\0', '\0'};
    const std::string binary = "b" + header + "C" + zero + "n" + bytes(2.0) + "O" + zero + one +
                               "n" + bytes(5.0) + "r0" + bytes(lower) + bytes(3.0) + "b";
    for (const std::string& content : {text, binary}) {
      put("model.nl", content);
      ASSERT_EQ(run("model.nl -s print_level=0"), 0) << err_;
      EXPECT_TRUE(printed(lower < 2.0 ? "certified local maximum" : "locally infeasible")) << out_;
      EXPECT_TRUE(printed("objective 5,")) << out_;
      EXPECT_FALSE(printed("WARNING")) << out_;
      if (content == text) {
        EXPECT_TRUE(solution_has(lower < 2.0 ? "\nobjno 0 0\n" : "\nobjno 0 200\n"))
            << get("model.sol");
      }
    }
  }
}

// min -x, 2 x y - y^2 <= 4 for every y in [-10, 10]: x = 2 = y. suffixes: of the constraint.
std::string limit_for_every_y(const std::string& suffixes) {
  return "g3 1 1 0\n 2 1 1 0 0\n 1 0\n 0 0\n 2 0 0\n 0 0 0 1\n 0 0 0 0 0\n 2 1\n 5 1\n 0 0 0 0 0\n"
         "S0 1 player\n1 1\n" +
         suffixes +
         "C0\no0\no2\nn2\no2\nv0\nv1\no16\no5\nv1\nn2\nO0 0\nn0\n"
         "x2\n0 0.5\n1 0.1\nr\n1 4\nb\n0 -10 10\n0 -10 10\nk1\n1\nJ0 2\n0 0\n1 0\nG0 1\n0 -1\n";
}

TEST_F(AmplExecutable, ConstraintsOfMinThatReadMaxHoldForEveryY) {
  put("model.row", "limit\n");
  put("model.col", "x\ny\n");
  const auto expect_robust = [&](const std::string& arguments) {
    ASSERT_EQ(run("model.nl -s print_level=5 " + arguments), 0) << err_;
    EXPECT_TRUE(printed("certified local minmax\nobjective -2.0000000")) << out_;
    EXPECT_TRUE(printed("Robust constraints: 1 worst case")) << out_;
    for (const std::string& text : {out_, get("model.sol")}) {
      EXPECT_NE(text.find("worst case of limit: 4.0000000"), std::string::npos) << text;
      EXPECT_NE(text.find(" at y = 2\n"), std::string::npos) << text;
    }
  };
  for (const char* suffixes : {"S1 1 player\n0 0\n", "S1 1 robust\n0 1\n"}) {
    put("model.nl", limit_for_every_y(suffixes));
    for (const char* arguments : {"", "minmax_worst_case_starts=5"}) expect_robust(arguments);
  }
  EXPECT_EQ(run("model.nl minmax_max_constraints=limit"), 2);
  EXPECT_NE(err_.find("gives constraint 0 (limit) to Max, the file's suffix gives it to "
                      "Min"),
            std::string::npos)
      << err_;
  ASSERT_EQ(run("model.nl -s print_level=0 minmax_robust_constraints=no"), 0) << err_;
  EXPECT_TRUE(printed("constraint 0 (limit) belongs to the Min player but depends on")) << out_;
  EXPECT_TRUE(solution_has("\nobjno 0 554\n"));
  EXPECT_TRUE(solution_has("minmax_result\n0 502\n"));
  put("model.nl", limit_for_every_y(""));
  expect_robust("minmax_min_constraints=limit");
  put("model.nl", limit_for_every_y("S1 1 player\n0 1\n"));
  EXPECT_EQ(run("model.nl minmax_min_constraints=limit"), 2);
  EXPECT_NE(err_.find("gives constraint 0 (limit) to Min, the suffix player gives it to Max"),
            std::string::npos)
      << err_;
}

TEST_F(AmplExecutable, ARobustEqualityIsRefusedByName) {
  std::string model = limit_for_every_y("S1 1 robust\n0 1\n");
  const std::string upper = "r\n1 4\n";
  ASSERT_NE(model.find(upper), std::string::npos);
  model.replace(model.find(upper), upper.size(), "r\n4 4\n");
  put("model.nl", model);
  put("model.row", "limit\n");
  put("model.col", "x\ny\n");
  ASSERT_EQ(run("model.nl -s print_level=0"), 0) << err_;
  EXPECT_TRUE(printed("Invalid problem definition")) << out_;
  EXPECT_TRUE(
      printed("constraint 0 (limit) belongs to the Min player but depends on the Max "
              "player's variable 1 (y), and an equality"))
      << out_;
}

// min -x, s = x + w of Max, w in [-1, 1], s <= 3 for every w: x = 2.
TEST_F(AmplExecutable, WorstCasesNameTheDisturbance) {
  put("model.nl",
      "g3 1 1 0\n 3 2 1 0 1\n 0 0\n 0 0\n 0 0 0\n 0 0 0 1\n 0 0 0 0 0\n 4 1\n 5 1\n 0 0 0 0 0\n"
      "S0 2 player\n1 1\n2 1\nS1 1 robust\n1 1\nC0\nn0\nC1\nn0\nO0 0\nn0\nr\n4 0\n1 3\n"
      "b\n3\n0 -1 1\n3\nk2\n1\n2\nJ0 3\n0 -1\n1 -1\n2 1\nJ1 1\n2 1\nG0 1\n0 -1\n");
  put("model.row", "follow\nlimit\n");
  put("model.col", "x\nw\ns\n");
  ASSERT_EQ(run("model.nl -s print_level=5"), 0) << err_;
  EXPECT_NE(get("model.sol").find("worst case of limit: 3"), std::string::npos);
  EXPECT_NE(get("model.sol").find(" at w = 1\n"), std::string::npos) << get("model.sol");
  EXPECT_TRUE(printed("  w = 1\n")) << out_;
}

// ASL refuses tanh'(1000), which is zero, by ending the process unless told otherwise.
TEST_F(AmplExecutable, ADerivativeThatAslRefusesEndsNothing) {
  put("model.nl",
      "g3 1 1 0\n 2 1 1 0 0\n 1 0\n 0 0\n 1 0 0\n 0 0 0 1\n 0 0 0 0 0\n 2 1\n 0 0\n 0 0 0 0 0\n"
      "S0 1 player\n0 1\nS1 1 robust\n0 1\nC0\no37\no2\nn1000\nv0\nO0 0\nn0\nr\n1 1\nb\n0 -1 1\n"
      "3\nk1\n1\nJ0 2\n0 0\n1 1\nG0 1\n1 -1\n");
  EXPECT_EQ(run("model.nl -AMPL"), 0) << err_;
  EXPECT_NE(get("model.sol").find("Ipminmax"), std::string::npos);
  EXPECT_EQ(err_.find("can't evaluate"), std::string::npos) << err_;
}

TEST_F(AmplExecutable, IpoptsLogHasARowForEachIterationThatItCounts) {
  Parts infeasible = minimize(kSquare);
  infeasible.constraints = {kSquare};
  infeasible.rows = "1 -1\n";
  for (const std::string& model : {limit_for_every_y("S1 1 robust\n0 1\n"), infeasible.text()}) {
    put("model.nl", model);
    ASSERT_EQ(run("model.nl -AMPL print_level=5 minmax_worst_case_starts=3"), 0) << err_;
    std::istringstream lines(out_);
    int iterations = -1, rows = 0, restorations = 0;
    for (std::string line; std::getline(lines, line);) {
      int number = -1;
      char mark = 0;
      if (line.starts_with("Number of Iter"))
        iterations = std::stoi(line.substr(line.find(':') + 1));
      if (std::sscanf(line.c_str(), "%4d%c", &number, &mark) != 2 || line.size() < 60) continue;
      EXPECT_EQ(number, rows++) << line;
      restorations += mark == 'r';
    }
    EXPECT_EQ(rows, iterations + 1) << out_;
    EXPECT_EQ(restorations > 0, model == infeasible.text()) << out_;
  }
}

TEST_F(AmplExecutable, IpoptsSuffixesAreRead) {
  Parts parts = minimize(kSquare);
  parts.constraints = {kSquare};
  parts.rows = "3\n";
  parts.segments =
      "S4 1 scaling_factor\n0 2\nS5 1 scaling_factor\n0 0.5\n"
      "S6 1 scaling_factor\n0 5\nS4 1 ipopt_zL_in\n0 3\nS4 1 ipopt_zU_in\n0 -4\n";
  for (const bool maximize : {false, true}) {
    parts.objectives[0].maximize = maximize;
    NlProblem problem(put("model.nl", parts.text()), -1);
    double f = 0.0, x = 0.0, g = 0.0, lower = 0.0, upper = 0.0;
    bool of_x = false, of_g = false;
    ASSERT_TRUE(problem.get_scaling_parameters(f, of_x, 1, &x, of_g, 1, &g));
    EXPECT_TRUE(of_x && of_g);
    EXPECT_EQ(std::vector({f, x, g}), std::vector({5.0, 2.0, 0.5}));
    ASSERT_TRUE(problem.get_starting_point(1, true, &x, true, &lower, &upper, 1, true, &g));
    const double sign = maximize ? -1.0 : 1.0;
    EXPECT_EQ(std::vector({lower, upper}), std::vector({sign * 3.0, sign * 4.0}));
  }
}

TEST_F(AmplExecutable, SuffixesOfAConstraintThatContradictAreRefused) {
  put("model.nl", limit_for_every_y("S1 1 player\n0 1\nS1 1 robust\n0 1\n"));
  EXPECT_EQ(run("model.nl"), 1);
  EXPECT_NE(err_.find("suffix robust gives it to player 0, suffix player to player 1"),
            std::string::npos)
      << err_;
  put("model.nl", limit_for_every_y("S1 1 robust\n0 2\n"));
  EXPECT_EQ(run("model.nl"), 1);
  EXPECT_NE(err_.find("suffix robust is 2, not 0 or 1"), std::string::npos) << err_;
}

TEST_F(AmplExecutable, CommandLineOverridesEnvironmentOverridesFile) {
  const Parts parts = minimize(kSquare);
  const auto stopped = [&] { return printed("maximum number of iterations"); };
  put("ipminmax.opt", "max_iter 0\n");
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(stopped()) << out_;
  ASSERT_EQ(solve(parts, "", "ipminmax_options=max_iter=50"), 0) << err_;
  EXPECT_FALSE(stopped()) << out_;
  ASSERT_EQ(solve(parts, "max_iter=0", "ipminmax_options=max_iter=50"), 0) << err_;
  EXPECT_TRUE(stopped()) << out_;
  put("ipminmax.opt", "max_iter 50\n");
  ASSERT_EQ(solve(parts, "", "ipminmax_options='tol=1e-6 max_iter=0'"), 0) << err_;
  EXPECT_TRUE(stopped()) << out_;
}

TEST_F(AmplExecutable, OverriddenValuesAreSaidOnce) {
  const Parts parts = minimize(kSquare);
  put("ipminmax.opt", "max_iter 50\ntol 1e-7\n");
  ASSERT_EQ(solve(parts, "max_iter=40", "ipminmax_options='max_iter=30 tol=1e-07'"), 0) << err_;
  EXPECT_EQ(err_,
            "ipminmax: max_iter = 40 (the command line) overrides 30 (ipminmax_options)\n"
            "ipminmax: max_iter = 40 (the command line) overrides 50 (ipminmax.opt)\n");
  EXPECT_EQ(out_.find("WARNING"), std::string::npos) << out_;
  ASSERT_EQ(solve(parts, "max_iter=0 max_iter=50"), 0);  // the file says 50, too
  EXPECT_EQ(err_, "ipminmax: max_iter = 50 (the command line) overrides 0 (the command line)\n");
  EXPECT_FALSE(printed("maximum number of iterations")) << out_;
  put("ipminmax.opt", "max_iter 50\nmax_iter 0\n");  // Ipopt keeps the first
  ASSERT_EQ(solve(parts), 0);
  EXPECT_NE(err_.find("max_iter"), std::string::npos);
  EXPECT_FALSE(printed("maximum number of iterations")) << out_;
  put("other.opt", "max_iter 0\n");
  ASSERT_EQ(solve(parts, "option_file_name=other.opt max_iter=3"), 0);
  EXPECT_EQ(err_, "ipminmax: max_iter = 3 (the command line) overrides 0 (other.opt)\n");
  ASSERT_EQ(solve(parts, "option_file_name="), 2);
  EXPECT_NE(err_.find("expected name=value"), std::string::npos);
}

TEST_F(AmplExecutable, TheEnvironmentMayUseBlanksAndQuotes) {
  const Parts parts = minimize(kSquare);
  const auto stopped = [&] { return printed("maximum number of iterations"); };
  ASSERT_EQ(solve(parts, "", "ipminmax_options='max_iter 0  tol  =  1e-6'"), 0) << err_;
  EXPECT_TRUE(stopped()) << out_;
  ASSERT_EQ(solve(parts, "", "ipminmax_options='output_file=\"a log.txt\" max_iter=0'"), 0) << err_;
  EXPECT_TRUE(stopped()) << out_;
  EXPECT_TRUE(std::filesystem::exists(path("a log.txt")));
  ASSERT_EQ(solve(parts, "'output_file=b log.txt'"), 0) << err_;
  EXPECT_TRUE(std::filesystem::exists(path("b log.txt")));
  EXPECT_EQ(solve(parts, "", "ipminmax_options='max_iter=0 tol'"), 2);
  EXPECT_NE(err_.find("ipminmax_options: option \"tol\" has no value"), std::string::npos) << err_;
  EXPECT_EQ(solve(parts, "", "ipminmax_options='output_file=\"a'"), 2);
  EXPECT_NE(err_.find("quotation never ends"), std::string::npos) << err_;
}

TEST_F(AmplExecutable, BadOptionsAreNamed) {
  const auto refusal = [&](const std::string& arguments, const std::string& environment = "") {
    EXPECT_EQ(solve(minimize(kSquare), arguments, environment), 2) << out_;
    return err_ + out_;
  };
  EXPECT_NE(refusal("tol=abc").find("tol = abc"), std::string::npos);
  EXPECT_NE(refusal("tox=1").find("unknown option \"tox\""), std::string::npos);
  EXPECT_NE(refusal("tox=1").find("did you mean tol?"), std::string::npos) << err_;
  EXPECT_NE(
      refusal("tox=1").find("OPTION_INVALID: Read Option: \"tox\". It is not a valid option."),
      std::string::npos);
  EXPECT_NE(refusal("max_itre=1").find("did you mean max_iter?"), std::string::npos) << err_;
  EXPECT_NE(refusal("linear_solvr=mumps").find("did you mean linear_solver?"), std::string::npos);
  EXPECT_EQ(refusal("quite_another_thing=1").find("did you mean"), std::string::npos) << err_;
  EXPECT_NE(refusal("tol").find("expected name=value"), std::string::npos);
  EXPECT_NE(refusal("", "ipminmax_options=tux=1").find("ipminmax_options: unknown option \"tux\""),
            std::string::npos);
  EXPECT_NE(refusal("tux=1").find("the command line: unknown option \"tux\""), std::string::npos);
  EXPECT_NE(refusal("wantsol=x").find("wantsol = x"), std::string::npos);
  EXPECT_NE(refusal("-x").find("unknown flag -x"), std::string::npos);
  EXPECT_EQ(run(""), 2);
  EXPECT_EQ(run("none"), 1);
  EXPECT_NE(err_.find("cannot open none"), std::string::npos);
  put("notes.txt", "hello\n");
  EXPECT_EQ(run("notes.txt"), 1);
  EXPECT_NE(err_.find("notes.txt, line 2: no .nl file"), std::string::npos) << err_;
  put("model.txt", minimize(kSquare).text());
  EXPECT_EQ(run("model.txt"), 1);
  EXPECT_NE(err_.find("does not end in .nl"), std::string::npos) << err_;
  // An options file that is named must be there; ipminmax.opt must be readable when it is there.
  EXPECT_NE(refusal("option_file_name=none.opt").find("cannot read the options file none.opt"),
            std::string::npos);
  EXPECT_NE(refusal("", "ipminmax_options=option_file_name=none.opt").find("none.opt"),
            std::string::npos);
  std::filesystem::create_directory(path("ipminmax.opt"));
  EXPECT_NE(refusal("").find("ipminmax.opt: it is a folder"), std::string::npos);
  EXPECT_NE(refusal("option_file_name=.").find("it is a folder"), std::string::npos);
  EXPECT_NE(refusal("option_file_name=/proc/self/mem").find("/proc/self/mem cannot be read"),
            std::string::npos);
  std::filesystem::remove(path("ipminmax.opt"));
  EXPECT_NE(refusal("halt_on_ampl_error=maybe").find("halt_on_ampl_error = maybe"),
            std::string::npos);
  EXPECT_NE(refusal("wantsol=16").find("wantsol = 16"), std::string::npos);
  put("ipminmax.opt", "tol 1e-6\nmax_itr 5\n");
  EXPECT_NE(refusal("").find("ipminmax.opt, line 2"), std::string::npos);
}

TEST_F(AmplExecutable, QuotesAroundValuesAreTakenOff) {
  const Parts parts = minimize(kSquare);
  put("other.opt", "max_iter 0\n");
  ASSERT_EQ(solve(parts, "'option_file_name=\"other.opt\"'"), 0) << err_;
  EXPECT_TRUE(printed("maximum number of iterations")) << out_;
  ASSERT_EQ(solve(parts, "\"linear_solver='mumps'\" 'nlp_scaling_method=\"none\"'"), 0) << err_;
  EXPECT_TRUE(printed("certified local minimum")) << out_;
  EXPECT_EQ(solve(parts, "'linear_solver=\"mumps'"), 2) << out_;
}

TEST_F(AmplExecutable, OptionsOfIpoptsExecutable) {
  const Parts parts = minimize(kSquare);
  ASSERT_EQ(solve(parts, "maxit=0"), 0) << err_;
  EXPECT_TRUE(printed("maximum number of iterations")) << out_;
  put("model.nl", parts.text());
  ASSERT_EQ(run("model.nl outlev=0"), 0) << err_;
  EXPECT_EQ(out_.find("EXIT"), std::string::npos) << out_;
  Parts undefined = minimize(kLog);
  undefined.segments = "x1\n0 -1\n";
  EXPECT_EQ(solve(undefined, "halt_on_ampl_error=yes"), 1);
  EXPECT_NE(err_.find("undefined"), std::string::npos) << err_;
  EXPECT_FALSE(std::filesystem::exists(path("model.sol")));
  EXPECT_NE(err_.find("can't evaluate log(-1)"), std::string::npos) << err_;
  EXPECT_EQ(solve(undefined, "halt_on_ampl_error=no"), 0);
  // The message names what is undefined: the constraint log(v0) >= 0, not the objective.
  Parts of_constraint = minimize(kSquare);
  of_constraint.constraints = {kLog};
  of_constraint.rows = "2 0\n";
  of_constraint.segments = "x1\n0 -1\n";
  EXPECT_EQ(solve(of_constraint), 0);
  EXPECT_TRUE(printed("the Jacobian of constraint 0 (_scon[1]) is undefined")) << out_;
  // At 0 sqrt(v) has a value and no derivative.
  undefined = minimize("o39\nv0\n");
  undefined.segments = "x1\n0 0\n";
  EXPECT_EQ(solve(undefined, "halt_on_ampl_error=yes"), 1);
  EXPECT_NE(err_.find("can't evaluate sqrt'(0)"), std::string::npos) << err_;
  EXPECT_EQ(solve(undefined, "halt_on_ampl_error=no"), 0);
}

// The second-order test tries points beside a solution, where Ipopt evaluates nothing.
TEST_F(AmplExecutable, WhatIsUndefinedHaltsAtTheNextIteration) {
  put("model.nl", minimize(kLog).text());
  NlProblem problem(path("model.nl"), -1);
  const double outside = -1.0, further = -2.0, inside = 2.0;
  double value = 0.0;
  const auto iterate = [&] {
    return problem.intermediate_callback(Ipopt::RegularMode, 1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
                                         0.0, 0, nullptr, nullptr);
  };
  EXPECT_FALSE(problem.eval_f(1, &outside, true, value));
  EXPECT_TRUE(iterate());
  problem.halt_on_error();
  EXPECT_FALSE(problem.eval_f(1, &further, true, value));
  EXPECT_TRUE(problem.eval_f(1, &inside, true, value));
  EXPECT_THROW(iterate(), std::runtime_error);
  EXPECT_THROW(problem.halt_where_undefined(), std::runtime_error);
}

TEST_F(AmplExecutable, TheModelIsNotOverwritten) {
  const std::string text = minimize(kSquare).text();
  put("k.nl", text);
  for (const char* arguments : {"k.nl -ok.nl", "k -ok.nl", "-o./k.nl k.nl -AMPL"}) {
    EXPECT_EQ(run(arguments), 2) << out_;
    EXPECT_NE(err_.find("would write over the model k.nl"), std::string::npos) << err_;
    EXPECT_EQ(get("k.nl"), text) << arguments;
  }
}

// Programs count the lines of Ipopt's .sol files.
TEST_F(AmplExecutable, TheSolutionFileOfAMinimizationHasIpoptsLines) {
  ASSERT_EQ(solve(minimize(kSquare)), 0) << err_;
  std::istringstream file(get("model.sol"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  ASSERT_GT(lines.size(), 17U);
  EXPECT_EQ(lines[0], " ");
  EXPECT_NE(lines[1].find("Optimal Solution Found"), std::string::npos) << lines[1];
  EXPECT_NE(lines[1].find("certified local minimum"), std::string::npos) << lines[1];
  EXPECT_EQ(lines[3], "Options");
  EXPECT_EQ(lines[11], "1");  // variables; their values follow
  EXPECT_EQ(lines[13], "objno 0 0");
  EXPECT_EQ(lines[15], "ipopt_zU_out");
  EXPECT_EQ(lines[17], "ipopt_zL_out");
}

TEST_F(AmplExecutable, LimitsKeepTheirNamesInAModelThatMaximizes) {
  Parts parts;
  parts.objectives = {{.maximize = true, .formula = "o16\no44\n" + kSquare}};
  ASSERT_EQ(solve(parts, "minmax_max_factorizations=1"), 0) << err_;
  EXPECT_TRUE(printed("maximum number of iterations")) << out_;
  EXPECT_FALSE(printed("minimum number of iterations")) << out_;
}

TEST_F(AmplExecutable, ThePointIsPrintedWithNames) {
  std::filesystem::copy(IPMINMAX_SOURCE_DIR "/tests/package/saddle.nl", path("model.nl"));
  put("model.col", "force\nwind\n");
  put("model.row", "budget\n");
  ASSERT_EQ(run("model.nl print_level=1"), 0) << err_;
  EXPECT_TRUE(printed("force     Min     -0.8") || printed("force     Min     -0.79999")) << out_;
  EXPECT_TRUE(printed("wind      Max     -0.4") || printed("wind      Max     -0.39999")) << out_;
  EXPECT_FALSE(printed("no Max variable")) << out_;
  EXPECT_FALSE(printed("budget")) << out_;
  ASSERT_EQ(run("model.nl print_level=0"), 0);
  EXPECT_FALSE(printed("force")) << out_;
  ASSERT_EQ(run("model.nl print_level=0 wantsol=14"), 0);
  EXPECT_TRUE(printed("force     Min")) << out_;
  EXPECT_TRUE(printed("budget ")) << out_;
  EXPECT_FALSE(printed("certified")) << out_;
  EXPECT_FALSE(std::filesystem::exists(path("model.sol")));
  ASSERT_EQ(run("model.nl -AMPL print_level=1"), 0);
  EXPECT_EQ(out_, "");
  Parts plain = minimize(kSquare);
  ASSERT_EQ(solve(plain, "print_level=1"), 0) << err_;
  EXPECT_TRUE(printed("no Max variable: a minimization (neither suffix player")) << out_;
  // Where the message is all that is read, as from AMPL and Pyomo.
  ASSERT_EQ(run("model.nl -AMPL print_level=0"), 0) << err_;
  EXPECT_TRUE(solution_has("no Max variable: a minimization (neither suffix player"));
  std::filesystem::copy(IPMINMAX_SOURCE_DIR "/tests/package/saddle.nl", path("model.nl"),
                        std::filesystem::copy_options::overwrite_existing);
  ASSERT_EQ(run("model.nl -AMPL print_level=0"), 0) << err_;
  EXPECT_FALSE(solution_has("no Max variable"));
}

TEST_F(AmplExecutable, OptionsNameTheMaximizersVariables) {
  const std::string game = [&] {
    std::filesystem::copy(IPMINMAX_SOURCE_DIR "/tests/package/saddle.nl", path("model.nl"));
    return get("model.nl");
  }();
  std::string plain = game;
  const std::string suffix = "S0 1 player\n1 1\n";
  plain.erase(plain.find(suffix), suffix.size());
  put("plain.nl", plain);
  for (const char* name : {"model", "plain"}) {
    put(std::string(name) + ".col", "force\nwind\n");
    put(std::string(name) + ".row", "budget\n");
  }
  for (const char* list : {"wind", "1", "1-1"}) {
    ASSERT_EQ(run(std::string("plain.nl print_level=0 minmax_max_variables=") + list), 0) << err_;
    EXPECT_TRUE(printed("certified local minmax\nobjective -0.8,")) << out_;
    ASSERT_EQ(run(std::string("model.nl print_level=0 minmax_max_variables=") + list), 0) << err_;
    EXPECT_TRUE(printed("certified local minmax\nobjective -0.8,")) << out_;
  }
  EXPECT_EQ(run("model.nl minmax_max_variables=force"), 2);
  EXPECT_NE(err_.find("minmax_max_variables gives variable 0 (force) to Max"), std::string::npos)
      << err_;
  EXPECT_NE(err_.find("the file's suffix gives it to Min"), std::string::npos) << err_;
  EXPECT_EQ(run("plain.nl minmax_max_variables=storm"), 2);
  EXPECT_NE(err_.find("storm"), std::string::npos) << err_;
  put("ipminmax.opt", "minmax_max_variables \"wind\"\nminmax_max_constraints budget\n");
  ASSERT_EQ(run("plain.nl print_level=0"), 0) << err_;
  EXPECT_TRUE(printed("certified local minmax\nobjective -0.8,")) << out_;
}

// Pyomo's presolve may eliminate all variables of one player.
TEST_F(AmplExecutable, APlayerWithoutVariablesIsWarnedOf) {
  Parts parts = minimize(kNegativeSquare);
  parts.segments = "S0 1 player\n0 1\n";
  ASSERT_EQ(solve(parts), 0);
  EXPECT_TRUE(printed("certified local maximum\n")) << out_;
  for (const std::string& text : {err_, out_, get("model.sol")}) {
    EXPECT_NE(text.find("WARNING: all variables have player 1"), std::string::npos) << text;
    EXPECT_NE(text.find("linear_presolve=False"), std::string::npos) << text;
  }
  parts = minimize(kSquare);
  parts.segments = "S0 1 player\n0 0\n";
  ASSERT_EQ(solve(parts), 0);
  for (const std::string& text : {err_, get("model.sol")})
    EXPECT_NE(text.find("WARNING: there is a suffix player, but no variable has player 1"),
              std::string::npos)
        << text;
  for (const std::string name : {"playr", "Player", "players"}) {
    parts.segments = "S0 1 " + name + "\n0 1\n";
    ASSERT_EQ(solve(parts), 0);
    for (const std::string& text : {err_, get("model.sol")})
      EXPECT_NE(text.find("WARNING: the variables have a suffix " + name + ", but none player"),
                std::string::npos)
          << text;
  }
  parts.segments = "S0 1 priority\n0 1\n";
  ASSERT_EQ(solve(parts), 0);
  EXPECT_EQ(err_, "");
  ASSERT_EQ(solve(minimize(kSquare)), 0);
  EXPECT_EQ(err_, "");
}

TEST_F(AmplExecutable, MessagesSpeakOfTheModelsSense) {
  Parts parts;
  parts.objectives = {{.maximize = true, .formula = kSquare}};
  Parts unbounded = minimize("o5\nv0\nn3\n");
  unbounded.objectives[0].maximize = true;
  unbounded.segments = "x1\n0 1\n";
  ASSERT_EQ(solve(unbounded), 0) << err_;
  EXPECT_TRUE(printed("maximization looks unbounded (the maximization looks unbounded)")) << out_;
  EXPECT_EQ(out_.find("minim"), std::string::npos) << out_;
  // Least violation stays a minimum.
  Parts infeasible = parts;
  infeasible.constraints = {"o5\nv0\nn2\n"};
  infeasible.rows = "1 -1\n";
  ASSERT_EQ(solve(infeasible), 0) << err_;
  EXPECT_TRUE(printed("violation of the constraints is at a local minimum")) << out_;
  parts.segments = "S0 1 player\n0 1\n";  // player 1 minimizes
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("certified local minimum\n")) << out_;
  EXPECT_TRUE(printed("this is a plain minimization")) << out_;
}

// Its player 0 maximizes, of whom the core speaks as Min, and names may be like the players'.
TEST_F(AmplExecutable, NamesInAModelThatMaximizesStay) {
  Parts parts;
  parts.objectives = {{.maximize = true, .formula = "o16\no5\nv0\nn2\n"}};  // -v^2
  parts.bounds = "2 0";                                                     // v >= 0
  put("model.col", "Max\n");
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("reason: weakly active: the lower bound of variable 0 (Max) (Max) has"))
      << out_;
  put("model.col", "Min\n");
  ASSERT_EQ(solve(parts), 0) << err_;
  EXPECT_TRUE(printed("reason: weakly active: the lower bound of variable 0 (Min) (Max) has"))
      << out_;
  NlProblem problem(path("model.nl"), -1);
  Result result;
  for (const auto& [ours, spoken] : {
           std::pair{"variable 0 (Min in worst case 2) of Min",
                     "variable 0 (Min in worst case 2) of Max"},
           {"variable 0 (Min) is Max's", "variable 0 (Min) is Min's"},
           {"variable 7 (Min) of Max", "variable 7 (Max) of Min"},  // no such variable
           {"(Min) minimizes, 0 (Max", "(Max) maximizes, 0 (Min"},
           {"a local minmax (Max) of variable 0 (Min", "a local maxmin (Min) of variable 0 (Min"},
       }) {
    result.message = ours;
    EXPECT_NE(message_of(result, problem).find(" (" + std::string(spoken) + ")"), std::string::npos)
        << message_of(result, problem);
  }
}

TEST_F(AmplExecutable, FlagsTellAboutIt) {
  ASSERT_EQ(run("-v"), 0);
  EXPECT_TRUE(printed("Ipminmax 0.")) << out_;
  EXPECT_TRUE(out_.starts_with("Ipopt 3.")) << out_;  // what Pyomo looks for
  for (const char* help : {"'-?'", "-h", "--help"}) {
    ASSERT_EQ(run(help), 0);
    EXPECT_TRUE(printed("usage: ipminmax")) << out_;
    EXPECT_TRUE(printed("Exit code")) << out_;
  }
  ASSERT_EQ(run("--version"), 0);
  EXPECT_TRUE(printed("Ipminmax 0.")) << out_;
  ASSERT_EQ(run("-="), 0);
  for (const char* name : {"objno", "wantsol", "tol ", "minmax_starts", "print_level"})
    EXPECT_TRUE(printed(name)) << name;
}

TEST_F(AmplExecutable, TheSolutionFileIsWrittenOnDemand) {
  put("model.nl", minimize(kSquare).text());
  const auto written = [&] { return std::filesystem::remove(path("model.sol")); };
  ASSERT_EQ(run("model print_level=0"), 0);
  EXPECT_FALSE(written());
  EXPECT_TRUE(printed("certified local minimum"));
  EXPECT_EQ(out_.find("certified"), out_.rfind("certified")) << out_;  // once
  ASSERT_EQ(run("model -s print_level=0"), 0);
  EXPECT_TRUE(written());
  EXPECT_EQ(out_.find("certified"), out_.rfind("certified")) << out_;
  ASSERT_EQ(run("model wantsol=1 print_level=0"), 0);
  EXPECT_TRUE(written());
  ASSERT_EQ(run("-e -s -oanother.sol model print_level=0"), 0);
  EXPECT_FALSE(written());
  EXPECT_NE(get("another.sol").find("certified local minimum"), std::string::npos);
  std::filesystem::copy(path("model.nl"), path("-odd.nl"));
  ASSERT_EQ(run("-s - -odd.nl print_level=0"), 0) << err_;
  EXPECT_TRUE(std::filesystem::exists(path("-odd.sol")));
  EXPECT_EQ(run("-onowhere/a.sol model print_level=0"), 1);
  EXPECT_NE(err_.find("cannot write nowhere/a.sol"), std::string::npos) << err_;
  ASSERT_EQ(run("model -AMPL print_level=0"), 0);
  EXPECT_EQ(out_, "");  // AMPL prints the message that the file holds
  EXPECT_TRUE(solution_has("certified local minimum"));
}

}  // namespace
}  // namespace ipminmax::testing
