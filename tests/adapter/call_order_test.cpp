// The model is called in the order in which Ipopt calls it.
#include <gtest/gtest.h>

#include <IpIpoptApplication.hpp>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using Calls = std::vector<std::string>;

/// The calls before the first evaluation of a function and those after the last.
struct Frame {
  Calls before, after;
};

bool is_evaluation(const std::string& name) {
  return name == "eval_f" || name == "eval_grad_f" || name == "eval_g" || name == "eval_jac_g" ||
         name == "eval_h";
}

Frame frame_of(const Calls& calls) {
  const auto first = std::find_if(calls.begin(), calls.end(), is_evaluation);
  const auto last = std::find_if(calls.rbegin(), calls.rend(), [](const std::string& name) {
                      return is_evaluation(name) || name == "intermediate_callback";
                    }).base();
  return {{calls.begin(), first}, {last, calls.end()}};
}

template <class Application>
Calls calls_of(const SmartPtr<Model>& model) {
  const SmartPtr<Application> app = new Application(false);
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
  return model->calls;
}

/// As a minimization, y on one of its bounds.
void expect_same_frame(const std::function<SmartPtr<Model>()>& make) {
  const Calls ours = calls_of<MinMaxApplication>(make());
  const Calls theirs = calls_of<Ipopt::IpoptApplication>(make());
  EXPECT_EQ(frame_of(ours).before, frame_of(theirs).before);
  EXPECT_EQ(frame_of(ours).after, frame_of(theirs).after);
}

TEST(CallOrder, IsIpopts) {
  expect_same_frame([] { return SmartPtr<Model>(new Model); });
}

/// The same without constraints.
class Unconstrained : public Model {
 public:
  bool get_nlp_info(Index& n, Index& m, Index& jac, Index& hess, IndexStyleEnum& s) override {
    const bool ok = Model::get_nlp_info(n, m, jac, hess, s);
    m = jac = 0;
    return ok;
  }
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index, Number*, Number*) override {
    std::vector<Number> g(2), h(2);
    return Model::get_bounds_info(n, x_l, x_u, 2, g.data(), h.data());
  }
  bool eval_g(Index, const Number*, bool, Index, Number*) override {
    calls.emplace_back("eval_g");
    return true;
  }
  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    // Empty arrays have an address, so that models can tell the two calls apart.
    EXPECT_NE(rows == nullptr, values == nullptr);
    EXPECT_EQ(rows == nullptr, cols == nullptr);
    calls.emplace_back(values != nullptr ? "eval_jac_g" : "eval_jac_g structure");
    return true;
  }
};

TEST(CallOrder, WithoutConstraints) {
  expect_same_frame([] { return SmartPtr<Model>(new Unconstrained); });
}

/// Records where the players are asked for.
class Asked : public SplitTNLP {
 public:
  explicit Asked(const SmartPtr<Model>& model) : SplitTNLP(GetRawPtr(model), {1}), calls_(model) {}
  bool get_variable_players(Ipopt::Index n, Player* players) override {
    calls_->calls.emplace_back("get_variable_players");
    return SplitTNLP::get_variable_players(n, players);
  }
  bool get_constraint_players(Ipopt::Index m, Player* players) override {
    calls_->calls.emplace_back("get_constraint_players");
    return SplitTNLP::get_constraint_players(m, players);
  }

 private:
  SmartPtr<Model> calls_;
};

TEST(CallOrder, PlayersAreAskedForAfterTheStructure) {
  const SmartPtr<Model> model = new Model;
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->OptimizeTNLP(new Asked(model)), Ipopt::Solve_Succeeded);
  const Calls expected = {
      "get_nlp_info",           "get_var_con_metadata", "get_bounds_info",
      "eval_jac_g structure",   "eval_h structure",     "get_variable_players",
      "get_constraint_players", "get_bounds_info",      "get_starting_point(100)"};
  EXPECT_EQ(frame_of(model->calls).before, expected);
  EXPECT_EQ(frame_of(model->calls).after, (Calls{"finalize_metadata", "finalize_solution"}));
}

}  // namespace
}  // namespace ipminmax
