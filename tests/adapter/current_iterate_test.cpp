// What intermediate_callback may ask of the iterate: GetCurrentIterate and GetCurrentViolations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <regression/not_minima.hpp>
#include <support/mixed_model.hpp>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/problem_tnlp.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

/// What intermediate_callback is told.
struct Told {
  Ipopt::AlgorithmMode mode;
  Index iteration;
  double objective, inf_pr, inf_du, mu;
};

/// A Problem as Ipopt's model, that asks a function in each callback and keeps the final answer.
class Watched : public ProblemTnlp {
 public:
  explicit Watched(Problem& problem) : ProblemTnlp(problem) {}

  std::function<bool(const Told&)> on_iteration = [](const Told&) { return true; };
  std::function<void()> on_end = [] {};
  int ends = 0;
  Ipopt::SolverReturn status = Ipopt::UNASSIGNED;

  bool intermediate_callback(Ipopt::AlgorithmMode mode, Ipopt::Index iter, double f, double inf_pr,
                             double inf_du, double mu, double, double, double, double, Ipopt::Index,
                             const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    return on_iteration({mode, iter, f, inf_pr, inf_du, mu});
  }
  void finalize_solution(Ipopt::SolverReturn reason, Ipopt::Index n, const double* x,
                         const double* z_L, const double* z_U, Ipopt::Index m, const double* g,
                         const double* lambda, double f, const Ipopt::IpoptData* data,
                         Ipopt::IpoptCalculatedQuantities* cq) override {
    ProblemTnlp::finalize_solution(reason, n, x, z_L, z_U, m, g, lambda, f, data, cq);
    status = reason;
    ++ends;
    on_end();
  }
};

/// A model, the problem of its formulas, and an application without output.
struct Setting {
  explicit Setting(const Model& formulas, const std::vector<double>& start)
      : problem(formulas, start), watched(new Watched(problem)) {
    const ProblemStructure& s = problem.structure();
    const auto indices = [](const std::vector<Player>& players, Player player) {
      std::vector<Ipopt::Index> found;
      for (std::size_t i = 0; i < players.size(); ++i) {
        if (players[i] == player) found.push_back(static_cast<Ipopt::Index>(i));
      }
      return found;
    };
    model = new SplitTNLP(GetRawPtr(watched), indices(s.variable_players, Player::Max),
                          indices(s.constraint_players, Player::Max),
                          indices(s.constraint_players, Player::Min));
    EXPECT_EQ(application->Initialize(""), Ipopt::Solve_Succeeded);
  }
  Ipopt::ApplicationReturnStatus solve() { return application->OptimizeTNLP(GetRawPtr(model)); }

  AutodiffProblem problem;
  SmartPtr<Watched> watched;
  SmartPtr<SplitTNLP> model;
  SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
};

double distance(double value, double lower, double upper) {
  return std::max({lower - value, value - upper, 0.0});
}

/// Compares iterate and violations with the model's functions.
void expect_consistent(AutodiffProblem& problem, const Told& told, const Result& at,
                       const Violations& found) {
  const ProblemStructure& s = problem.structure();
  const std::size_t n = s.variable_players.size(), m = s.constraint_players.size();
  double f = 0.0;
  std::vector<double> g(m), gradient(n), jacobian(s.jacobian.size());
  ASSERT_TRUE(problem.objective(at.v, true, f) && problem.constraints(at.v, false, g) &&
              problem.gradient(at.v, false, gradient) && problem.jacobian(at.v, false, jacobian));
  EXPECT_EQ(at.objective, f);
  EXPECT_EQ(at.constraints, g);
  EXPECT_NEAR(told.objective, f, 1e-12 * (1.0 + std::abs(f)));
  EXPECT_GE(at.error.primal, told.inf_pr);  // measured to the bounds before their relaxation
  EXPECT_NEAR(at.error.primal, told.inf_pr, 1e-6);
  EXPECT_EQ(std::max(at.error.dual_min, at.error.dual_max), told.inf_du);
  EXPECT_EQ(at.mu, told.mu);

  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    gradient[static_cast<std::size_t>(s.jacobian[k].col)] +=
        jacobian[k] * at.lambda[static_cast<std::size_t>(s.jacobian[k].row)];
  }
  double of_min = 0.0, of_max = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const bool max = s.variable_players[i] == Player::Max;
    const double lower = s.variable_lower[i], upper = s.variable_upper[i];
    const double slope = gradient[i] - at.z_lower[i] + at.z_upper[i];
    EXPECT_NEAR(found.lagrangian_gradient[i], slope, 1e-11 * (1.0 + std::abs(gradient[i]))) << i;
    double& largest = max ? of_max : of_min;
    largest = std::max(largest, std::abs(slope));
    EXPECT_EQ(found.lower_bound[i], std::max(lower - at.v[i], 0.0)) << i;
    EXPECT_EQ(found.upper_bound[i], std::max(at.v[i] - upper, 0.0)) << i;
    // The sign of a bound's multiplier is the player's.
    EXPECT_GE(max ? -at.z_lower[i] : at.z_lower[i], 0.0) << i;
    EXPECT_GE(max ? -at.z_upper[i] : at.z_upper[i], 0.0) << i;
    const bool fixed = lower == upper;
    if (fixed) {
      EXPECT_EQ(at.v[i], lower);
      EXPECT_NEAR(slope, 0.0, 1e-11 * (1.0 + std::abs(gradient[i]))) << i;
    }
    const double below = fixed || lower < -1e19 ? 0.0 : (at.v[i] - lower) * at.z_lower[i];
    const double above = fixed || upper > 1e19 ? 0.0 : (upper - at.v[i]) * at.z_upper[i];
    EXPECT_EQ(found.lower_complementarity[i], below) << i;
    EXPECT_EQ(found.upper_complementarity[i], above) << i;
  }
  // The errors hold for the slacks of inequalities, too.
  EXPECT_LE(of_min, at.error.dual_min * (1.0 + 1e-9) + 1e-11);
  EXPECT_LE(of_max, at.error.dual_max * (1.0 + 1e-9) + 1e-11);
  for (std::size_t j = 0; j < m; ++j) {
    const double lower = s.constraint_lower[j], upper = s.constraint_upper[j];
    EXPECT_EQ(found.constraint[j], distance(g[j], lower, upper)) << j;
    const double pressure = s.constraint_players[j] == Player::Max ? -at.lambda[j] : at.lambda[j];
    double product = 0.0;
    if (pressure > 0.0 && upper < 1e19) product = (upper - g[j]) * at.lambda[j];
    if (pressure < 0.0 && lower > -1e19) product = (lower - g[j]) * at.lambda[j];
    EXPECT_EQ(found.constraint_complementarity[j], product) << j;
  }
}

TEST(CurrentIterate, AgreesWithTheModelAtEveryIteration) {
  struct Case {
    const char* name;
    Model model;
    std::vector<double> start;
    const char* scaling;
  };
  const MinimizationProblem& hs071 = hock_schittkowski("hs071");
  std::vector<Case> cases = {{"mixed", mixed_model(), kMixedStart, "gradient-based"},
                             {"mixed, not scaled", mixed_model(), kMixedStart, "none"},
                             {"hs071", hs071.model, hs071.start, "gradient-based"}};
  for (const char* name : {"hyperbola", "attack_ball", "bolib_tp7", "tc5"}) {
    cases.push_back(
        {name, small_problem(name).model, small_problem(name).starts.front(), "gradient-based"});
  }
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    Setting setting(c.model, c.start);
    setting.application->Options()->SetStringValue("nlp_scaling_method", c.scaling);
    Index calls = 0;
    Result last;
    Violations at_last;
    setting.watched->on_iteration = [&](const Told& told) {
      SCOPED_TRACE("iteration " + std::to_string(told.iteration));
      ++calls;
      EXPECT_TRUE(setting.application->GetCurrentIterate(last));
      EXPECT_TRUE(setting.application->GetCurrentViolations(at_last));
      expect_consistent(setting.problem, told, last, at_last);
      return !::testing::Test::HasFatalFailure();
    };
    ASSERT_EQ(setting.solve(), Ipopt::Solve_Succeeded);
    const Result& answer = setting.application->LastResult();
    EXPECT_EQ(calls, answer.iterations + 1);
    EXPECT_EQ(last.v, answer.v);  // the last iterate is the answer
    EXPECT_EQ(last.lambda, answer.lambda);
    EXPECT_EQ(last.z_lower, answer.z_lower);
    const auto largest = [](const std::vector<double>& values) {
      double norm = 0.0;
      for (const double value : values) norm = std::max(norm, std::abs(value));
      return norm;
    };
    EXPECT_LT(largest(at_last.lagrangian_gradient), 1e-6);
    EXPECT_LT(largest(at_last.constraint), 1e-6);
    EXPECT_LT(largest(at_last.lower_complementarity), 1e-6);
    EXPECT_LT(largest(at_last.constraint_complementarity), 1e-6);
  }
}

TEST(CurrentIterate, SplitsTheDualErrorByPlayer) {
  // No inequalities: the errors are those of the variables alone.
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(exp(x) + x * y - pow(y - 1.0, 4.0) - square(y));
  Setting setting(model, {2.0, -1.0});
  bool apart = false;
  setting.watched->on_iteration = [&](const Told& told) {
    Result at;
    Violations found;
    EXPECT_TRUE(setting.application->GetCurrentIterate(at));
    EXPECT_TRUE(setting.application->GetCurrentViolations(found));
    EXPECT_NEAR(at.error.dual_min, std::abs(std::exp(at.v[0]) + at.v[1]), 1e-12);
    EXPECT_NEAR(at.error.dual_max,
                std::abs(at.v[0] - 4.0 * std::pow(at.v[1] - 1.0, 3.0) - 2.0 * at.v[1]), 1e-12);
    EXPECT_NEAR(std::abs(found.lagrangian_gradient[0]), at.error.dual_min, 1e-12);
    EXPECT_NEAR(std::abs(found.lagrangian_gradient[1]), at.error.dual_max, 1e-12);
    apart = apart || at.error.dual_min != at.error.dual_max;
    return told.iteration < 100;
  };
  EXPECT_EQ(setting.solve(), Ipopt::Solve_Succeeded);
  EXPECT_TRUE(apart);
}

TEST(CurrentIterate, ThereIsNoneOutsideTheCallback) {
  Setting setting(mixed_model(), kMixedStart);
  Result at;
  at.objective = 7.0;
  at.v = {1.0};
  Violations found;
  found.constraint = {2.0};
  const auto expect_none = [&](const char* where) {
    EXPECT_FALSE(setting.application->GetCurrentIterate(at)) << where;
    EXPECT_FALSE(setting.application->GetCurrentViolations(found)) << where;
    EXPECT_EQ(at.objective, 7.0);
    EXPECT_EQ(at.v, std::vector{1.0});
    EXPECT_EQ(found.constraint, std::vector{2.0});
  };
  expect_none("before");
  setting.watched->on_end = [&] {  // there it is the answer
    Result answer;
    Violations missing;
    EXPECT_TRUE(setting.application->GetCurrentIterate(answer));
    EXPECT_TRUE(setting.application->GetCurrentViolations(missing));
    EXPECT_EQ(answer.v, setting.application->LastResult().v);
    EXPECT_EQ(answer.lambda, setting.application->LastResult().lambda);
  };
  ASSERT_EQ(setting.solve(), Ipopt::Solve_Succeeded);
  EXPECT_EQ(setting.watched->ends, 1);
  expect_none("after");
  setting.watched->on_end = [] {};
  setting.watched->on_iteration = [](const Told&) -> bool { throw std::runtime_error("stop"); };
  EXPECT_EQ(setting.solve(), Ipopt::NonIpopt_Exception_Thrown);
  expect_none("after an exception");
}

/// min x0 + x1 + x2 with 1 <= |x|^2 <= 2, x0^2 - x2^2 = 1/2, x0 >= -10, x1 = 1 and scaling factors of
/// its own, which asks for everything in each callback and at the end, as a test of Ipopt 3.14 does.
class Asking : public ObservableTNLP {
 public:
  using Number = Ipopt::Number;
  explicit Asking(UserScaling scaling) : scaling_(std::move(scaling)) {}
  int asked = 0, answered = 0;

  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian,
                    IndexStyleEnum& style) override {
    n = 3, m = 2, jacobian = 5, hessian = 3;
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l, Number* g_u) override {
    x_l[0] = -10.0, x_l[1] = 1.0, x_l[2] = -1e300;
    x_u[0] = 1e300, x_u[1] = 1.0, x_u[2] = 1e300;
    g_l[0] = 1.0, g_u[0] = 2.0;
    g_l[1] = g_u[1] = 0.5;
    return true;
  }
  bool get_starting_point(Index, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override {
    x[0] = x[1] = 1.0, x[2] = -1.0;
    return true;
  }
  bool get_scaling_parameters(Number& f, bool& use_x, Index, Number* x, bool& use_g, Index,
                              Number* g) override {
    f = scaling_.objective;
    use_x = use_g = true;
    std::ranges::copy(scaling_.variables, x);
    std::ranges::copy(scaling_.constraints, g);
    return true;
  }
  bool eval_f(Index, const Number* x, bool, Number& f) override {
    f = x[0] + x[1] + x[2];
    return true;
  }
  bool eval_grad_f(Index, const Number*, bool, Number* grad) override {
    grad[0] = grad[1] = grad[2] = 1.0;
    return true;
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    g[0] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    g[1] = x[0] * x[0] - x[2] * x[2];
    return true;
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    const Index row[] = {0, 0, 0, 1, 1}, col[] = {0, 1, 2, 0, 2};
    for (std::size_t k = 0; k < 5; ++k) {
      if (values == nullptr) {
        rows[k] = row[k], cols[k] = col[k];
      } else {
        values[k] = k == 4 ? -2.0 * x[2] : 2.0 * x[col[k]];
      }
    }
    return true;
  }
  bool eval_h(Index, const Number*, bool, Number, Index, const Number* lambda, bool, Index,
              Index* rows, Index* cols, Number* values) override {
    for (Index k = 0; k < 3; ++k) {
      if (values == nullptr) {
        rows[k] = cols[k] = k;
      } else {
        values[k] = 2.0 * lambda[0] + 2.0 * static_cast<double>(1 - k) * lambda[1];
      }
    }
    return true;
  }
  bool intermediate_callback(Ipopt::AlgorithmMode, Index, Number, Number, Number, Number, Number,
                             Number, Number, Number, Index, const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* cq) override {
    ask(data, cq);
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number* z_L,
                         const Number* z_U, Index, const Number* g, const Number* lambda, Number,
                         const Ipopt::IpoptData* data,
                         Ipopt::IpoptCalculatedQuantities* cq) override {
    const Seen seen = ask(data, cq);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(seen.x[i], x[i]);
      EXPECT_EQ(seen.z_l[i], z_L[i]);
      EXPECT_EQ(seen.z_u[i], z_U[i]);
    }
    for (std::size_t j = 0; j < 2; ++j) {
      EXPECT_EQ(seen.g[j], g[j]);
      EXPECT_EQ(seen.lambda[j], lambda[j]);
    }
    ++answered;
  }

 private:
  struct Seen {
    double x[3], z_l[3], z_u[3], g[2], lambda[2];
    double below[3], above[3], compl_l[3], compl_u[3], gradient[3], violation[2], compl_g[2];
  };
  Seen take(bool scaled, const Ipopt::IpoptData* data, Ipopt::IpoptCalculatedQuantities* cq) {
    Seen s{};
    EXPECT_TRUE(get_curr_iterate(data, cq, scaled, 3, s.x, s.z_l, s.z_u, 2, s.g, s.lambda));
    EXPECT_TRUE(get_curr_violations(data, cq, scaled, 3, s.below, s.above, s.compl_l, s.compl_u,
                                    s.gradient, 2, s.violation, s.compl_g));
    return s;
  }
  static void expect_near(double value, double wanted, const std::string& what) {
    EXPECT_NEAR(value, wanted, 1e-9 * std::max({1.0, std::abs(value), std::abs(wanted)})) << what;
  }
  /// The first-order quantities from x, z and lambda of s, with these factors.
  void check(const Seen& s, const double* x, const UserScaling& by) {
    const double f = by.objective;
    const std::vector<double>&c = by.variables, &r = by.constraints;
    const double g0 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2], g1 = x[0] * x[0] - x[2] * x[2];
    const double slope0 = s.lambda[0] * r[0], slope1 = s.lambda[1] * r[1];
    expect_near(s.g[0], g0 * r[0], "g0");
    expect_near(s.g[1], g1 * r[1], "g1");
    expect_near(s.below[0], std::max(0.0, -10.0 - x[0]) * c[0], "below");
    expect_near(s.compl_l[0], s.z_l[0] * (x[0] + 10.0) * c[0], "compl_x_L");
    expect_near(s.compl_l[1], 0.0, "compl_x_L of the fixed one");
    expect_near(s.compl_u[1], 0.0, "compl_x_U of the fixed one");
    expect_near(s.gradient[0], (f + 2.0 * x[0] * (slope0 + slope1)) / c[0] - s.z_l[0], "grad 0");
    expect_near(s.gradient[1], (f + 2.0 * x[1] * slope0) / c[1] - s.z_l[1] + s.z_u[1], "grad 1");
    expect_near(s.gradient[2], (f + 2.0 * x[2] * (slope0 - slope1)) / c[2], "grad 2");
    expect_near(s.violation[0], std::max({0.0, 1.0 - g0, g0 - 2.0}) * r[0], "violation 0");
    expect_near(s.violation[1], std::abs(g1 - 0.5) * r[1], "violation 1");
    const double pressing = s.lambda[0] < 0.0 ? -(g0 - 1.0) : 2.0 - g0;
    expect_near(s.compl_g[0], pressing * s.lambda[0] * r[0], "compl_g 0");
    expect_near(s.compl_g[1], -(g1 - 0.5) * s.lambda[1] * r[1], "compl_g 1");
  }
  Seen ask(const Ipopt::IpoptData* data, Ipopt::IpoptCalculatedQuantities* cq) {
    ++asked;
    const Seen plain = take(false, data, cq), scaled = take(true, data, cq);
    check(plain, plain.x, {1.0, {1.0, 1.0, 1.0}, {1.0, 1.0}});
    check(scaled, plain.x, scaling_);
    const double f = scaling_.objective;
    for (std::size_t i = 0; i < 3; ++i) {
      const double c = scaling_.variables[i];
      const bool other_side = i == 1 && f < 0.0;  // of a fixed variable only one side is not zero
      expect_near(scaled.x[i], plain.x[i] * c, "x");
      expect_near(scaled.z_l[i], (other_side ? -plain.z_u[i] : plain.z_l[i]) * f / c, "z_L");
      expect_near(scaled.z_u[i], (other_side ? -plain.z_l[i] : plain.z_u[i]) * f / c, "z_U");
    }
    for (std::size_t j = 0; j < 2; ++j)
      expect_near(scaled.lambda[j], plain.lambda[j] * f / scaling_.constraints[j], "lambda");
    return plain;
  }
  UserScaling scaling_;
};

TEST(CurrentIterate, AnswersAsIpoptDoesScaledAndAtTheEnd) {
  for (const char* fixed : {"make_parameter", "make_constraint"}) {
    for (const double objective : {0.0, 2.0, -2.0}) {
      SCOPED_TRACE(std::string(fixed) + ", objective times " + std::to_string(objective));
      const bool scales = objective != 0.0;
      const SmartPtr<Asking> model =
          new Asking(scales ? UserScaling{objective, {3.0, 1.0, 5.0}, {7.0, 11.0}}
                            : UserScaling{1.0, {1.0, 1.0, 1.0}, {1.0, 1.0}});
      const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
      app->Options()->SetStringValue("fixed_variable_treatment", fixed);
      app->Options()->SetStringValue("nlp_scaling_method", scales ? "user-scaling" : "none");
      app->Options()->SetNumericValue("constr_viol_tol", 1e-12);  // bounds are hardly relaxed
      ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
      EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
      EXPECT_EQ(model->answered, 1);
      EXPECT_EQ(model->asked, app->LastResult().iterations + 2);
    }
  }
}

/// The user stops at the given call; everything that comes back is the iterate there.
void stop_at(const Model& model, const std::vector<double>& start, int call,
             const char* options = "") {
  SCOPED_TRACE("call " + std::to_string(call));
  Setting setting(model, start);
  std::istringstream text(options);
  ASSERT_EQ(setting.application->Initialize(text), Ipopt::Solve_Succeeded);
  Result seen;
  int calls = 0;
  setting.watched->on_iteration = [&](const Told&) {
    if (calls++ < call) return true;
    EXPECT_TRUE(setting.application->GetCurrentIterate(seen));
    return false;
  };
  ASSERT_EQ(setting.solve(), Ipopt::User_Requested_Stop);
  ASSERT_EQ(calls, call + 1);
  EXPECT_EQ(setting.watched->ends, 1);
  EXPECT_EQ(setting.watched->status, Ipopt::USER_REQUESTED_STOP);
  const IpoptAnswer& final = setting.watched->answer();
  const Result& result = setting.application->LastResult();
  EXPECT_EQ(result.status, Status::UserStop);
  EXPECT_EQ(final.v, seen.v);
  EXPECT_EQ(final.lambda, seen.lambda);
  EXPECT_EQ(final.z_lower, seen.z_lower);
  EXPECT_EQ(final.z_upper, seen.z_upper);
  EXPECT_EQ(final.constraints, seen.constraints);
  EXPECT_EQ(final.objective, seen.objective);
  EXPECT_EQ(result.v, seen.v);
  EXPECT_EQ(result.error.total, seen.error.total);
}

/// Calls of a solve whose mode is that of a restoration, and the number of all.
std::vector<int> restoration_calls(const Model& model, const std::vector<double>& start) {
  Setting setting(model, start);
  std::vector<int> found;
  int calls = 0;
  setting.watched->on_iteration = [&](const Told& told) {
    if (told.mode == Ipopt::RestorationPhaseMode) {
      found.push_back(calls);
      Result at;
      EXPECT_TRUE(setting.application->GetCurrentIterate(at));
      EXPECT_NEAR(told.objective, at.objective, 1e-12 * (1.0 + std::abs(at.objective)));
      EXPECT_GE(at.error.primal, told.inf_pr);
      EXPECT_NEAR(at.error.primal, told.inf_pr, 1e-6 * (1.0 + told.inf_pr));
    }
    ++calls;
    return true;
  };
  static_cast<void>(setting.solve());
  return found;
}

TEST(UserStop, ReturnsTheIterate) {
  const MinimizationProblem& hs071 = hock_schittkowski("hs071");
  for (const int call : {0, 1, 5}) {
    stop_at(mixed_model(), kMixedStart, call);
    stop_at(hs071.model, hs071.start, call);
  }
  // Of several starts the best point so far: here that of the first.
  stop_at(hs071.model, hs071.start, 4, "minmax_starts 3\n");
}

// Maximizations over y tell of a row, not of f, and of points that no stop returns.
TEST(UserStop, RobustSearchesTellOfTheirIterates) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(square(x - 1.0));
  model.constraint(x + sin(3.0 * y) - 5.0, -kNoBound, 0.0, Player::Min);
  const std::vector<double> start = {0.0, 0.1};
  Setting setting(model, start);
  int calls = 0;
  setting.watched->on_iteration = [&](const Told& told) {
    Result at;
    EXPECT_TRUE(setting.application->GetCurrentIterate(at));
    EXPECT_EQ(told.objective, (at.v[0] - 1.0) * (at.v[0] - 1.0)) << calls;
    ++calls;
    return true;
  };
  ASSERT_EQ(setting.solve(), Ipopt::Solve_Succeeded);
  ASSERT_GT(calls, 3);
  for (int call = 0; call < calls; ++call) {
    SCOPED_TRACE(call);
    stop_at(model, start, call);
  }
}

TEST(UserStop, ReturnsTheIterateOfARestoration) {
  int stops = 0;
  for (const IllPosed& problem : ill_posed()) {
    const std::vector<int> calls = restoration_calls(problem.model, problem.start);
    if (calls.empty()) continue;
    ++stops;
    SCOPED_TRACE(problem.name);
    stop_at(problem.model, problem.start, calls.front());
    stop_at(problem.model, problem.start, calls.back());
  }
  EXPECT_GT(stops, 2);
}

}  // namespace
}  // namespace ipminmax::testing
