// SplitTNLP: every call reaches the model; wrong indices are named.
#include <gtest/gtest.h>

#include <stdexcept>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

/// Answers every method that has a default in TNLP, each in its own way.
class FullModel : public Model {
 public:
  bool get_scaling_parameters(Number& obj_scaling, bool& use_x_scaling, Index, Number* x_scaling,
                              bool& use_g_scaling, Index, Number* g_scaling) override {
    obj_scaling = 7.0;
    use_x_scaling = true;
    use_g_scaling = false;
    x_scaling[2] = 3.0;
    g_scaling[1] = 4.0;
    return true;
  }
  bool get_variables_linearity(Index, LinearityType* types) override {
    types[1] = NON_LINEAR;
    return true;
  }
  bool get_constraints_linearity(Index, LinearityType* types) override {
    types[1] = NON_LINEAR;
    return true;
  }
  bool get_warm_start_iterate(Ipopt::IteratesVector&) override {
    ++warm_starts;
    return true;
  }
  Index get_number_of_nonlinear_variables() override { return 2; }
  bool get_list_of_nonlinear_variables(Index, Index* list) override {
    list[1] = 5;
    return true;
  }
  int warm_starts = 0;
};

TEST(SplitTnlp, PassesEveryCallOn) {
  const SmartPtr<FullModel> model = new FullModel;
  model->variable_strings["idx_names"] = {"a", "b", "c"};
  const SmartPtr<Ipopt::TNLP> split = new SplitTNLP(GetRawPtr(model), {1});

  Ipopt::Index n = 0, m = 0, jacobian = 0, hessian = 0;
  Ipopt::TNLP::IndexStyleEnum style = Ipopt::TNLP::FORTRAN_STYLE;
  EXPECT_TRUE(split->get_nlp_info(n, m, jacobian, hessian, style));
  EXPECT_EQ(n, 3);
  EXPECT_EQ(m, 2);
  EXPECT_EQ(style, Ipopt::TNLP::C_STYLE);

  Ipopt::TNLP::StringMetaDataMapType strings, other_strings;
  Ipopt::TNLP::IntegerMetaDataMapType integers, other_integers;
  Ipopt::TNLP::NumericMetaDataMapType numbers, other_numbers;
  EXPECT_TRUE(split->get_var_con_metadata(n, strings, integers, numbers, m, other_strings,
                                          other_integers, other_numbers));
  EXPECT_EQ(strings["idx_names"].size(), 3U);

  std::vector<double> a(3), b(3), c(3), d(3);
  EXPECT_TRUE(split->get_bounds_info(3, a.data(), b.data(), 2, c.data(), d.data()));
  EXPECT_EQ(a[1], -5.0);
  EXPECT_EQ(d[1], 4.0);

  double scale = 0.0;
  bool use_x = false, use_g = true;
  EXPECT_TRUE(split->get_scaling_parameters(scale, use_x, 3, a.data(), use_g, 2, b.data()));
  EXPECT_EQ(scale, 7.0);
  EXPECT_TRUE(use_x);
  EXPECT_FALSE(use_g);
  EXPECT_EQ(a[2], 3.0);
  EXPECT_EQ(b[1], 4.0);

  std::vector<Ipopt::TNLP::LinearityType> types(3, Ipopt::TNLP::LINEAR);
  EXPECT_TRUE(split->get_variables_linearity(3, types.data()));
  EXPECT_EQ(types[1], Ipopt::TNLP::NON_LINEAR);
  types[1] = Ipopt::TNLP::LINEAR;
  EXPECT_TRUE(split->get_constraints_linearity(2, types.data()));
  EXPECT_EQ(types[1], Ipopt::TNLP::NON_LINEAR);

  EXPECT_TRUE(
      split->get_starting_point(3, true, a.data(), true, b.data(), c.data(), 2, true, d.data()));
  EXPECT_EQ(model->calls.back(), "get_starting_point(111)");
  EXPECT_EQ(a[0], 1.0);

  // The iterate is only passed through as a reference, so any object does.
  alignas(std::max_align_t) char storage[8] = {};
  EXPECT_TRUE(split->get_warm_start_iterate(reinterpret_cast<Ipopt::IteratesVector&>(storage)));
  EXPECT_EQ(model->warm_starts, 1);

  double f = 0.0;
  EXPECT_TRUE(split->eval_f(3, a.data(), true, f));
  EXPECT_EQ(f, 3.25);
  EXPECT_TRUE(split->eval_grad_f(3, a.data(), false, b.data()));
  EXPECT_EQ(b[0], 5.5);
  EXPECT_TRUE(split->eval_g(3, a.data(), false, 2, c.data()));
  EXPECT_EQ(c[1], -0.5);
  std::vector<Ipopt::Index> rows(4), cols(4);
  std::vector<double> values(4);
  EXPECT_TRUE(split->eval_jac_g(3, nullptr, false, 2, 4, rows.data(), cols.data(), nullptr));
  EXPECT_EQ(cols[1], 2);
  EXPECT_TRUE(split->eval_jac_g(3, a.data(), false, 2, 4, nullptr, nullptr, values.data()));
  EXPECT_EQ(values[3], -1.0);
  EXPECT_TRUE(split->eval_h(3, nullptr, false, 1.0, 2, nullptr, false, 4, rows.data(), cols.data(),
                            nullptr));
  EXPECT_EQ(cols[1], 1);
  EXPECT_TRUE(split->eval_h(3, a.data(), false, 2.0, 2, d.data(), true, 4, nullptr, nullptr,
                            values.data()));
  EXPECT_EQ(values[0], 8.0);

  EXPECT_TRUE(split->intermediate_callback(Ipopt::RegularMode, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                                           nullptr, nullptr));
  EXPECT_EQ(model->iterations, std::vector<Ipopt::Index>{9});
  split->finalize_metadata(3, strings, integers, numbers, 2, other_strings, other_integers,
                           other_numbers);
  EXPECT_EQ(model->final.variable_strings.size(), 1U);
  split->finalize_solution(Ipopt::SUCCESS, 3, a.data(), b.data(), c.data(), 2, d.data(), d.data(),
                           1.5, nullptr, nullptr);
  EXPECT_EQ(model->final.status, Ipopt::SUCCESS);
  EXPECT_EQ(model->final.objective, 1.5);
  EXPECT_EQ(split->get_number_of_nonlinear_variables(), 2);
  EXPECT_TRUE(split->get_list_of_nonlinear_variables(2, cols.data()));
  EXPECT_EQ(cols[1], 5);
}

TEST(SplitTnlp, GivesTheListedToMax) {
  const SmartPtr<SplitTNLP> split = new SplitTNLP(new Model, {1}, {0});
  std::vector<Player> players(3, Player::Min);
  ASSERT_TRUE(split->get_variable_players(3, players.data()));
  EXPECT_EQ(players, (std::vector{Player::Min, Player::Max, Player::Min}));
  std::vector<Player> owners = {Player::Min, Player::Max};  // the second is implied
  ASSERT_TRUE(split->get_constraint_players(2, owners.data()));
  EXPECT_EQ(owners, (std::vector{Player::Max, Player::Max}));
}

std::string load_error(std::vector<Ipopt::Index> variables, std::vector<Ipopt::Index> constraints) {
  TnlpProblem problem(new SplitTNLP(new Model, std::move(variables), std::move(constraints)));
  return problem.load();
}

TEST(SplitTnlp, WrongIndicesAreNamed) {
  EXPECT_EQ(load_error({1}, {}), "");
  EXPECT_EQ(load_error({1, 7}, {}),
            "SplitTNLP: max_variables[1] = 7 is out of range: the model has 3 variables (indices "
            "are 0-based)");
  EXPECT_NE(load_error({-1}, {}).find("max_variables[0] = -1"), std::string::npos);
  EXPECT_EQ(load_error({1, 0, 1}, {}),
            "SplitTNLP: max_variables holds index 1 twice, at places 0 and 2");
  EXPECT_NE(load_error({1}, {2}).find("max_constraints[0] = 2"), std::string::npos);
  EXPECT_NE(load_error({1}, {0, 0}).find("max_constraints holds index 0 twice"), std::string::npos);
}

// y - x0 <= 4 for every y in [-5, 5]: x0 >= 1.
TEST(SplitTnlp, ConstraintsGivenToMinAreRobust) {
  const SmartPtr<Model> model = new Model;
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {1}, {}, {1})),
            Ipopt::Solve_Succeeded);
  EXPECT_NEAR(model->final.x[0], 1.0, 1e-6);
  ASSERT_EQ(app->LastWorstCases().size(), 1U);
  EXPECT_NEAR(app->LastWorstCases()[0].v[1], 5.0, 1e-5);
  const auto error_of = [](std::vector<Ipopt::Index> of_max, std::vector<Ipopt::Index> of_min) {
    return TnlpProblem(new SplitTNLP(new Model, {1}, std::move(of_max), std::move(of_min))).load();
  };
  EXPECT_NE(error_of({}, {2}).find("min_constraints[0] = 2 is out of range"), std::string::npos);
  EXPECT_NE(error_of({}, {1, 1}).find("min_constraints holds index 1 twice"), std::string::npos);
  EXPECT_EQ(error_of({1}, {0, 1}),
            "SplitTNLP: max_constraints and min_constraints both hold index 1");
}

TEST(SplitTnlp, ANullModelIsRefused) {
  EXPECT_THROW(SplitTNLP(SmartPtr<Ipopt::TNLP>(), {0}), std::invalid_argument);
}

}  // namespace
}  // namespace ipminmax
