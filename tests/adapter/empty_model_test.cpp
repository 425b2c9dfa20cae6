// Models in which nothing is left to choose: solved or infeasible, as the values say.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using Ipopt::SmartPtr;

/// min sum of n variables, all fixed at 1 but the first `free` ones in [0, 2]; m constraints on the
/// sum of the fixed ones, in [lower, upper].
class Fixed : public Ipopt::TNLP {
 public:
  Index n = 0, m = 0, free = 0;
  Number lower = 0.0, upper = 0.0;
  Ipopt::SolverReturn ended = Ipopt::UNASSIGNED;
  std::vector<Number> x, g;

  bool get_nlp_info(Index& variables, Index& constraints, Index& jac, Index& hess,
                    IndexStyleEnum& style) override {
    variables = n;
    constraints = m;
    jac = m * (n - free);
    hess = 0;
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l, Number* g_u) override {
    for (Index i = 0; i < n; ++i) {
      x_l[i] = i < free ? 0.0 : 1.0;
      x_u[i] = i < free ? 2.0 : 1.0;
    }
    for (Index j = 0; j < m; ++j) {
      g_l[j] = lower;
      g_u[j] = upper;
    }
    return true;
  }
  bool get_starting_point(Index, bool, Number* start, bool, Number*, Number*, Index, bool,
                          Number*) override {
    for (Index i = 0; i < n; ++i) start[i] = 10.0;
    return true;
  }
  bool eval_f(Index, const Number* v, bool, Number& f) override {
    f = 0.0;
    for (Index i = 0; i < n; ++i) f += v[i];
    return true;
  }
  bool eval_grad_f(Index, const Number*, bool, Number* grad) override {
    for (Index i = 0; i < n; ++i) grad[i] = 1.0;
    return true;
  }
  bool eval_g(Index, const Number* v, bool, Index, Number* values) override {
    for (Index j = 0; j < m; ++j) {
      values[j] = 0.0;
      for (Index i = free; i < n; ++i) values[j] += v[i];
    }
    return true;
  }
  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index* row, Index* col,
                  Number* values) override {
    for (Index j = 0, k = 0; j < m; ++j) {
      for (Index i = free; i < n; ++i, ++k) {
        if (values != nullptr) {
          values[k] = 1.0;
        } else {
          row[k] = j;
          col[k] = i;
        }
      }
    }
    return true;
  }
  bool eval_h(Index, const Number*, bool, Number, Index, const Number*, bool, Index, Index*, Index*,
              Number*) override {
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn status, Index, const Number* v, const Number*,
                         const Number*, Index, const Number* values, const Number*, Number,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    ended = status;
    x.assign(v, v + n);
    g.assign(values, values + m);
  }
};

struct Case {
  std::string what;
  Index n, m, free;
  Number lower, upper;
  Ipopt::ApplicationReturnStatus status;
  Ipopt::SolverReturn ended;
};

TEST(EmptyModel, IsSolvedOrInfeasibleAsTheValuesSay) {
  const auto solved = Ipopt::Solve_Succeeded;
  const auto infeasible = Ipopt::Infeasible_Problem_Detected;
  const auto locally = Ipopt::LOCAL_INFEASIBILITY;
  for (const Case& c : std::vector<Case>{
           {"no variables, no constraints", 0, 0, 0, 0.0, 0.0, solved, Ipopt::SUCCESS},
           {"no variables, 0 >= 0", 0, 1, 0, 0.0, 1e300, solved, Ipopt::SUCCESS},
           {"no variables, 0 >= 1", 0, 1, 0, 1.0, 1e300, infeasible, locally},
           {"no variables, 0 = 0", 0, 1, 0, 0.0, 0.0, solved, Ipopt::SUCCESS},
           {"no variables, 0 = 1", 0, 1, 0, 1.0, 1.0, infeasible, locally},
           {"all fixed", 3, 0, 0, 0.0, 0.0, solved, Ipopt::SUCCESS},
           {"all fixed, 3 >= 3", 3, 1, 0, 3.0, 1e300, solved, Ipopt::SUCCESS},
           {"all fixed, 3 >= 4", 3, 1, 0, 4.0, 1e300, infeasible, locally},
           {"all fixed, 3 = 3 twice", 3, 2, 0, 3.0, 3.0, solved, Ipopt::SUCCESS},
           {"all fixed, 3 = 4 twice", 3, 2, 0, 4.0, 4.0, infeasible, locally},
           {"one free, 2 = 2 twice", 3, 2, 1, 2.0, 2.0, solved, Ipopt::SUCCESS},
           {"one free, 2 = 4", 3, 1, 1, 4.0, 4.0, infeasible, locally}}) {
    const SmartPtr<Fixed> model = new Fixed;
    model->n = c.n, model->m = c.m, model->free = c.free;
    model->lower = c.lower, model->upper = c.upper;
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
    ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
    EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), c.status)
        << c.what << ": " << app->LastResult().message;
    EXPECT_EQ(model->ended, c.ended) << c.what;
    ASSERT_TRUE(IsValid(app->Statistics())) << c.what;
    if (c.free == 0) {
      EXPECT_EQ(app->Statistics()->IterationCount(), 0) << c.what;
    }
    for (Index i = c.free; i < c.n; ++i) EXPECT_EQ(model->x[static_cast<std::size_t>(i)], 1.0);
    for (const Number value : model->g) EXPECT_EQ(value, c.n - c.free) << c.what;
  }
}

}  // namespace
}  // namespace ipminmax
