// Options minmax_max_variables and minmax_max_constraints: the lists, and what the model itself
// says.
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "adapter/ipopt/cross_check.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/player_lists.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using Indices = std::vector<Index>;
using Players = std::vector<Player>;

const Player kMin = Player::Min, kMax = Player::Max;

const std::vector<std::string> kNames = {"u",      "wind[1]", "wind[2]",         "windy", "3",
                                         "x[1,2]", "x[1,3]",  "x['New York',1]", "a-b",   "u_2"};

Indices indices_of(const std::string& list) {
  Indices indices;
  EXPECT_EQ(read_index_list(list, {"variable", 10, &kNames}, indices), "") << list;
  return indices;
}

std::string error_of(const std::string& list, const std::vector<std::string>* names = &kNames) {
  Indices indices;
  return read_index_list(list, {"variable", 10, names}, indices);
}

TEST(IndexList, HoldsIndicesRangesAndNames) {
  EXPECT_EQ(indices_of("3 5-9"), (Indices{3, 5, 6, 7, 8, 9}));
  EXPECT_EQ(indices_of(" 9,0\t4-4 "), (Indices{0, 4, 9}));
  EXPECT_EQ(indices_of(""), Indices{});
  EXPECT_EQ(indices_of("u"), Indices{0});
  EXPECT_EQ(indices_of("wind"), (Indices{1, 2}));
  EXPECT_EQ(indices_of("wind[2]"), Indices{2});
  EXPECT_EQ(indices_of("x[1,3], x['New York',1] windy"), (Indices{3, 6, 7}));
  EXPECT_EQ(indices_of("a-b"), Indices{8});
  EXPECT_EQ(indices_of("3"), Indices{3});  // digits are an index, whatever the names
  EXPECT_EQ(indices_of("00000000000000000001"), Indices{1});
}

TEST(IndexList, SaysWhatIsWrong) {
  EXPECT_EQ(error_of("1 10"),
            "there is no variable 10: the model has 10 variables, counted from 0");
  EXPECT_EQ(error_of("8-12"),
            "there is no variable 12: the model has 10 variables, counted from 0");
  EXPECT_EQ(
      error_of("99999999999999999999"),
      "there is no variable 99999999999999999999: the model has 10 variables, counted from 0");
  EXPECT_EQ(error_of("5-3"), "the range 5-3 runs backwards");
  EXPECT_EQ(error_of("win"), "there is no variable named \"win\"");
  EXPECT_EQ(error_of("-1"), "there is no variable named \"-1\"");
  EXPECT_EQ(error_of("1-"), "there is no variable named \"1-\"");
  EXPECT_EQ(error_of("1-2-3"), "there is no variable named \"1-2-3\"");
  EXPECT_EQ(error_of("wind 2"), "variable 2 (wind[2]) is listed twice");
  EXPECT_EQ(error_of("2 0-4", nullptr), "variable 2 is listed twice");
  EXPECT_EQ(error_of("u", nullptr),
            "\"u\" is no index and no range, and the model names no variables");
}

TEST(PlayerOption, GivesTheListedToMax) {
  const SmartPtr<Model> model = new Model;
  model->variable_strings["idx_names"] = {"x0", "y", "x1"};
  model->constraint_strings["idx_names"] = {"sum", "answer"};
  TnlpProblem problem(GetRawPtr(model), {"y", "sum"});
  ASSERT_EQ(problem.load(), "");
  EXPECT_EQ(problem.structure().variable_players, (Players{kMin, kMax, kMin}));
  EXPECT_EQ(problem.structure().constraint_players, (Players{kMax, kMax}));  // the second implied

  TnlpProblem implied(GetRawPtr(model), {"1", ""});
  ASSERT_EQ(implied.load(), "");
  EXPECT_EQ(implied.structure().constraint_players, (Players{kMin, kMax}));
  EXPECT_EQ(
      TnlpProblem(GetRawPtr(model), {"3", ""}).load(),
      "option minmax_max_variables: there is no variable 3: the model has 3 variables, counted "
      "from 0");
  EXPECT_EQ(TnlpProblem(GetRawPtr(model), {"", "product"}).load(),
            "option minmax_max_constraints: there is no constraint named \"product\"");
}

TEST(PlayerOption, AndWhatTheModelSaysMustAgree) {
  const SmartPtr<Model> model = new Model;
  model->variable_integers["player"] = {0, 1, 0};
  EXPECT_EQ(TnlpProblem(GetRawPtr(model), {"1", ""}).load(), "");
  EXPECT_EQ(TnlpProblem(GetRawPtr(model), {"0", ""}).load(),
            "option minmax_max_variables gives variable 0 to Max, metadata \"player\" gives it to "
            "Min");
  model->constraint_integers["player"] = {1, 1};
  EXPECT_EQ(TnlpProblem(GetRawPtr(model), {"", "0"}).load(), "");
  EXPECT_EQ(TnlpProblem(GetRawPtr(model), {"", "1"}).load(),
            "option minmax_max_constraints gives constraint 0 to Min, metadata \"player\" gives it "
            "to Max");
  const SmartPtr<Ipopt::TNLP> split = new SplitTNLP(new Model, {1});
  EXPECT_EQ(TnlpProblem(split, {"1 2", ""}).load(),
            "option minmax_max_variables gives variable 2 to Max, get_variable_players gives it to "
            "Min");
  // A model that gives nothing to Max has said nothing.
  const SmartPtr<Model> silent = new Model;
  silent->variable_integers["player"] = {0, 0, 0};
  TnlpProblem problem(GetRawPtr(silent), {"1", ""});
  ASSERT_EQ(problem.load(), "");
  EXPECT_EQ(problem.structure().variable_players, (Players{kMin, kMax, kMin}));
}

/// The game of model.hpp without a word about players in the model.
TEST(PlayerOption, StatesAGameThroughTheApplication) {
  for (const bool from_file : {false, true}) {
    const SmartPtr<Model> model = new Model;
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
    std::istringstream file(from_file ? "minmax_max_variables \"1\"\n" : "");
    if (!from_file) app->Options()->SetStringValue("minmax_max_variables", "1");
    ASSERT_EQ(app->Initialize(file), Ipopt::Solve_Succeeded);
    ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
    EXPECT_EQ(app->LastResult().certificate.kind, PointKind::LocalMinmax);
    EXPECT_NEAR(model->final.x[1], 2.0 / 7.0, 1e-6);
  }
}

TEST(PlayerOption, NamesKeepTheirCase) {
  const SmartPtr<Model> model = new Model;
  model->variable_strings["idx_names"] = {"Wind", "wInd", "WIND"};
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("minmax_max_variables", "wInd");
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
  EXPECT_NEAR(model->final.x[1], 2.0 / 7.0, 1e-6);
}

TEST(PlayerOption, AWrongListIsAnInvalidProblem) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("minmax_max_variables", "y");
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(new Model), Ipopt::Invalid_Problem_Definition);
  EXPECT_EQ(app->LastResult().message,
            "option minmax_max_variables: \"y\" is no index and no range, and the model names no "
            "variables");
}

TEST(PlayerOption, NamesOfAnotherNumberAreCounted) {
  const SmartPtr<Model> model = new Model;
  model->variable_strings["idx_names"] = {"x0", "y"};
  EXPECT_EQ(
      TnlpProblem(GetRawPtr(model), {"y", ""}).load(),
      "option minmax_max_variables: \"y\" is no index and no range, and the model gives 2 names "
      "for 3 variables");
}

TEST(PlayerOption, ConstraintsOfMinThatReadMaxHoldForEveryY) {
  // y - x0 <= 4 for every y in [-5, 5]: x0 >= 1, while f's own y stays at 3/2 x0.
  for (const int starts : {0, 5}) {
    const SmartPtr<Model> model = new Model;
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
    app->Options()->SetStringValue("minmax_max_variables", "1");
    app->Options()->SetStringValue("minmax_min_constraints", "1");
    app->Options()->SetIntegerValue("minmax_worst_case_starts", starts);
    ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
    ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
    ASSERT_EQ(model->final.x.size(), 3U);
    EXPECT_NEAR(model->final.x[0], 1.0, 1e-6);
    EXPECT_NEAR(model->final.x[1], 1.5, 1e-5);
    EXPECT_NEAR(model->final.x[2], 0.0, 1e-6);
    EXPECT_NEAR(model->final.objective, 4.25, 1e-5);
    EXPECT_EQ(model->final.z_lower.size(), 3U);
    EXPECT_GT(app->LastResult().lambda[1], 1.0);
    ASSERT_EQ(app->LastWorstCases().size(), 1U);
    EXPECT_EQ(app->LastWorstCases()[0].constraint, 1);
    EXPECT_NEAR(app->LastWorstCases()[0].v[1], 5.0, 1e-5);
    EXPECT_NEAR(app->LastWorstCases()[0].value, 4.0, 1e-6);
  }
}

TEST(PlayerOption, AConstraintListedForBothPlayersIsNamed) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  app->Options()->SetStringValue("minmax_max_variables", "1");
  app->Options()->SetStringValue("minmax_max_constraints", "0 1");
  app->Options()->SetStringValue("minmax_min_constraints", "1");
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(new Model), Ipopt::Invalid_Problem_Definition);
  EXPECT_EQ(app->LastResult().message,
            "options minmax_min_constraints and minmax_max_constraints both list constraint 1");
}

TEST(PlayerOption, IsUnderstoodByTheCrossCheck) {
  CrossCheckSettings settings;
  settings.options = {{"minmax_max_variables", "1"}};
  const CrossCheck check = cross_check_with_ipopt(SmartPtr<Ipopt::TNLP>(new Model), settings);
  EXPECT_EQ(check.message, "");
  EXPECT_EQ(check.variables - check.min_variables, 1);
  EXPECT_EQ(check.verdict, CrossCheckVerdict::MaximumConfirmed);
}

}  // namespace
}  // namespace ipminmax
