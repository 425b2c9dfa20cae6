// TnlpProblem: what is read from the model, and what is said about wrong models.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "adapter/ipopt/tnlp_problem.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using Players = std::vector<Player>;

bool same(const std::vector<Triplet>& a, const std::vector<std::pair<Index, Index>>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Triplet& s, const auto& t) {
    return s.row == t.first && s.col == t.second;
  });
}

TEST(TnlpProblem, ReadsTheStructureInBothIndexStyles) {
  for (const auto style : {Ipopt::TNLP::C_STYLE, Ipopt::TNLP::FORTRAN_STYLE}) {
    const SmartPtr<Model> model = new Model;
    model->style = style;
    TnlpProblem problem(new SplitTNLP(GetRawPtr(model), {1}));
    ASSERT_EQ(problem.load(), "");
    const ProblemStructure& structure = problem.structure();
    EXPECT_TRUE(same(structure.jacobian, {{0, 0}, {0, 2}, {1, 1}, {1, 0}}));
    EXPECT_TRUE(same(structure.hessian, {{0, 0}, {0, 1}, {1, 1}, {2, 2}}));
    EXPECT_EQ(structure.variable_players, (Players{Player::Min, Player::Max, Player::Min}));
    EXPECT_EQ(structure.constraint_players, (Players{Player::Min, Player::Max}));
    EXPECT_EQ(structure.variable_lower, (std::vector{-10.0, -5.0, -1e20}));
    EXPECT_EQ(structure.variable_upper, (std::vector{1e20, 5.0, 1e20}));
    EXPECT_EQ(structure.constraint_lower, (std::vector{1.0, -1e20}));
    EXPECT_EQ(structure.constraint_upper, (std::vector{1.0, 4.0}));
  }
}

TEST(TnlpProblem, PassesEvaluationsOn) {
  TnlpProblem problem(new Model);
  ASSERT_EQ(problem.load(), "");
  const std::vector<double> v = {1.0, 0.5, 0.0};
  double f = 0.0;
  std::vector<double> gradient(3), g(2), values(4);
  EXPECT_TRUE(problem.objective(v, true, f));
  EXPECT_EQ(f, 3.25);
  EXPECT_TRUE(problem.gradient(v, false, gradient));
  EXPECT_EQ(gradient, (std::vector{5.5, 2.0, 0.0}));
  EXPECT_TRUE(problem.constraints(v, false, g));
  EXPECT_EQ(g, (std::vector{1.0, -0.5}));
  EXPECT_TRUE(problem.jacobian(v, false, values));
  EXPECT_EQ(values, (std::vector{1.0, 1.0, 1.0, -1.0}));
  EXPECT_TRUE(problem.hessian(v, false, 0.5, std::vector<double>(2), true, values));
  EXPECT_EQ(values, (std::vector{2.0, 1.5, -1.0, 1.0}));
}

TEST(TnlpProblem, AsksForMultipliersOnlyInAWarmStart) {
  const SmartPtr<Model> model = new Model;
  TnlpProblem problem(GetRawPtr(model));
  ASSERT_EQ(problem.load(), "");
  std::vector<double> v(3), lambda(2, -1.0), z_lower(3), z_upper(3);
  StartingPoint start{.v = v, .lambda = lambda, .z_lower = z_lower, .z_upper = z_upper};
  EXPECT_FALSE(problem.started());
  EXPECT_TRUE(problem.starting_point(start));
  EXPECT_TRUE(problem.started());
  EXPECT_EQ(model->calls.back(), "get_starting_point(100)");
  EXPECT_EQ(v, model->start);
  start.needs_multipliers = true;
  EXPECT_TRUE(problem.starting_point(start));
  EXPECT_EQ(model->calls.back(), "get_starting_point(111)");
  EXPECT_EQ(z_upper, (std::vector{1.0, 1.0, 1.0}));
  EXPECT_EQ(lambda, (std::vector{0.0, 0.0}));
}

TEST(TnlpProblem, APlainModelIsAMinimization) {
  TnlpProblem problem(new Model);
  ASSERT_EQ(problem.load(), "");
  EXPECT_EQ(problem.structure().variable_players, Players(3, Player::Min));
  EXPECT_EQ(problem.structure().constraint_players, Players(2, Player::Min));
}

TEST(TnlpProblem, ReadsPlayersAndNamesFromMetadata) {
  const SmartPtr<Model> model = new Model;
  model->variable_integers["player"] = {0, 1, 0};
  model->variable_strings["idx_names"] = {"a", "b", "c"};
  model->constraint_strings["idx_names"] = {"too", "many", "names"};
  TnlpProblem problem(GetRawPtr(model));
  ASSERT_EQ(problem.load(), "");
  EXPECT_EQ(problem.structure().variable_players, (Players{Player::Min, Player::Max, Player::Min}));
  EXPECT_EQ(problem.structure().constraint_players, (Players{Player::Min, Player::Max}));
  EXPECT_EQ(problem.structure().variable_names, (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_TRUE(problem.structure().constraint_names.empty());

  model->constraint_integers["player"] = {1, 1};
  TnlpProblem other(GetRawPtr(model));
  ASSERT_EQ(other.load(), "");
  EXPECT_EQ(other.structure().constraint_players, (Players{Player::Max, Player::Max}));
}

TEST(TnlpProblem, WrongPlayerMetadataIsNamed) {
  const auto error_of = [](std::vector<Ipopt::Index> variables,
                           std::vector<Ipopt::Index> constraints) {
    const SmartPtr<Model> model = new Model;
    model->variable_integers["player"] = std::move(variables);
    model->constraint_integers["player"] = std::move(constraints);
    return TnlpProblem(GetRawPtr(model)).load();
  };
  EXPECT_EQ(error_of({0, 1}, {0, 1}), "variable metadata \"player\" has 2 values for 3 variables");
  EXPECT_EQ(error_of({0, 2, 0}, {0, 1}),
            "variable metadata \"player\" is 2 at index 1; it must be 0 (Min) or 1 (Max)");
  EXPECT_EQ(error_of({0, 1, 0}, {}),
            "constraint metadata \"player\" has 0 values for 2 constraints");
  EXPECT_EQ(error_of({0, 1, 0}, {-1, 1}),
            "constraint metadata \"player\" is -1 at index 0; it must be 0 (Min) or 1 (Max)");
}

TEST(TnlpProblem, MetadataOfARefusingModelIsIgnored) {
  const SmartPtr<Model> model = new Model;
  model->variable_integers["player"] = {9};
  model->on_call = [](const std::string& name) { return name != "get_var_con_metadata"; };
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(), "");
}

TEST(TnlpProblem, RefusalsAreNamed) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"get_nlp_info", "get_nlp_info returned false"},
      {"get_bounds_info", "get_bounds_info returned false"},
      {"eval_jac_g structure",
       "eval_jac_g returned false when asked for the structure of the Jacobian"}};
  for (const auto& [method, message] : cases) {
    const SmartPtr<Model> model = new Model;
    model->on_call = [refused = method](const std::string& name) { return name != refused; };
    EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(), message);
  }
}

/// One wrong entry.
class WrongStructure : public Model {
 public:
  Index jacobian_row = 0, hessian_col = 0, entries = 4, size = 3;
  bool forget = false;
  bool get_nlp_info(Index& n, Index& m, Index& jac, Index& hess, IndexStyleEnum& s) override {
    const bool ok = Model::get_nlp_info(n, m, jac, hess, s);
    n = size;
    jac = entries;
    return ok;
  }
  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index nnz, Index* rows,
                  Index* cols, Number* values) override {
    const Index last = rows[3];
    const bool ok = Model::eval_jac_g(n, x, new_x, m, nnz, rows, cols, values);
    rows[2] = jacobian_row + (style == C_STYLE ? 0 : 1);
    if (forget) rows[3] = last;
    return ok;
  }
  bool eval_h(Index n, const Number* x, bool new_x, Number s, Index m, const Number* l, bool new_l,
              Index nnz, Index* rows, Index* cols, Number* values) override {
    const bool ok = Model::eval_h(n, x, new_x, s, m, l, new_l, nnz, rows, cols, values);
    cols[1] = hessian_col + (style == C_STYLE ? 0 : 1);
    return ok;
  }
};

TEST(TnlpProblem, EntriesOutsideTheMatrixAreNamed) {
  SmartPtr<WrongStructure> model = new WrongStructure;
  model->jacobian_row = 2;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(),
            "Jacobian entry 2 is at row 2, column 1, outside the matrix (rows 0 to 1, columns 0 to "
            "2, C style)");
  model->style = Ipopt::TNLP::FORTRAN_STYLE;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(),
            "Jacobian entry 2 is at row 3, column 2, outside the matrix (rows 1 to 2, columns 1 to "
            "3, Fortran style)");
  model->jacobian_row = -1;
  EXPECT_NE(TnlpProblem(GetRawPtr(model)).load().find("row 0, column 2"), std::string::npos);
  model->jacobian_row = 1;
  model->hessian_col = 3;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(),
            "Hessian entry 1 is at row 1, column 4, outside the matrix (rows 1 to 3, columns 1 to "
            "3, Fortran style)");
  model->hessian_col = 1;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(), "");
  model->forget = true;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(), "Jacobian entry 3 was not set by the model");
}

TEST(TnlpProblem, NegativeSizesAreNamed) {
  const SmartPtr<WrongStructure> model = new WrongStructure;
  model->size = -3;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(), "get_nlp_info set n = -3");
  model->size = 3;
  model->entries = -1;
  EXPECT_EQ(TnlpProblem(GetRawPtr(model)).load(), "get_nlp_info set nnz_jac_g = -1");
}

/// Says no, with or without a reason.
class RefusingSplit : public SplitTNLP {
 public:
  explicit RefusingSplit(int kind) : SplitTNLP(new Model, {1}), kind_(kind) {}
  bool get_variable_players(Ipopt::Index n, Player* players) override {
    if (kind_ == 0) return false;
    if (kind_ == 1) THROW_EXCEPTION(INVALID_TNLP, "nobody plays");
    return SplitTNLP::get_variable_players(n, players);
  }
  bool get_constraint_players(Ipopt::Index, Player*) override { return kind_ != 2; }

 private:
  int kind_;
};

TEST(TnlpProblem, PlayersMayBeRefused) {
  EXPECT_EQ(TnlpProblem(new RefusingSplit(0)).load(), "get_variable_players returned false");
  EXPECT_EQ(TnlpProblem(new RefusingSplit(1)).load(), "nobody plays");
  EXPECT_EQ(TnlpProblem(new RefusingSplit(2)).load(), "get_constraint_players returned false");
}

/// Leaves a bound unset.
class ForgetfulModel : public Model {
 public:
  bool get_bounds_info(Index, Number* x_l, Number*, Index, Number*, Number*) override {
    x_l[0] = 0.0;
    return true;
  }
};

TEST(TnlpProblem, BoundsThatAreNotSetAreNaN) {
  TnlpProblem problem(new ForgetfulModel);
  ASSERT_EQ(problem.load(), "");
  EXPECT_EQ(problem.structure().variable_lower[0], 0.0);
  EXPECT_TRUE(std::isnan(problem.structure().variable_upper[0]));
  EXPECT_TRUE(std::isnan(problem.structure().constraint_lower[1]));
}

/// Scales the variables, not the constraints.
class ScaledModel : public Model {
 public:
  bool get_scaling_parameters(Number& obj_scaling, bool& use_x_scaling, Index, Number* x_scaling,
                              bool& use_g_scaling, Index, Number*) override {
    obj_scaling = 3.0;
    use_x_scaling = true;
    use_g_scaling = false;
    x_scaling[1] = 2.0;
    return true;
  }
};

TEST(TnlpProblem, ReadsUserScaling) {
  TnlpProblem problem(new ScaledModel);
  ASSERT_EQ(problem.load(), "");
  UserScaling scaling;
  ASSERT_TRUE(problem.user_scaling(scaling));
  EXPECT_EQ(scaling.objective, 3.0);
  EXPECT_EQ(scaling.variables, (std::vector{1.0, 2.0, 1.0}));
  EXPECT_TRUE(scaling.constraints.empty());

  TnlpProblem plain(new Model);
  ASSERT_EQ(plain.load(), "");
  EXPECT_FALSE(plain.user_scaling(scaling));
}

}  // namespace
}  // namespace ipminmax
