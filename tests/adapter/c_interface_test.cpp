// ipminmax.h: the same solves as through MinMaxApplication, and what bad input gives.
#include <gtest/gtest.h>

#include <ipminmax.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "adapter/c_callbacks.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using Row = std::array<double, 11>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Model that keeps what intermediate_callback is told.
class Recorder : public Model {
 public:
  std::vector<Row> rows;

  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iter, Number f, Number inf_pr,
                             Number inf_du, Number mu, Number d_norm, Number regularization,
                             Number alpha_du, Number alpha_pr, Index trials,
                             const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* cq) override {
    rows.push_back({static_cast<double>(mode), static_cast<double>(iter), f, inf_pr, inf_du, mu,
                    d_norm, regularization, alpha_du, alpha_pr, static_cast<double>(trials)});
    return Model::intermediate_callback(mode, iter, f, inf_pr, inf_du, mu, d_norm, regularization,
                                        alpha_du, alpha_pr, trials, data, cq);
  }
};

using Callbacks = CCallbacks<Recorder>;

struct Free {
  void operator()(IpminmaxProblem problem) const { IpminmaxFree(problem); }
};
using ProblemPtr = std::unique_ptr<IpminmaxProblemInfo, Free>;

/// Arguments of IpminmaxCreate for the Model; tests change one.
struct Arguments {
  int n = 3, m = 2, nele_jac = 4, nele_hess = 4, style = IPMINMAX_C_STYLE;
  std::vector<double> x_L{-10.0, -5.0, -1e20}, x_U{1e20, 5.0, 1e20}, g_L{1.0, -1e20}, g_U{1.0, 4.0};
  std::vector<int> variable_players{IPMINMAX_MIN, IPMINMAX_MAX, IPMINMAX_MIN};
  std::vector<int> constraint_players;
  IpminmaxEval_F_CB f = Callbacks::eval_f;
  IpminmaxEval_G_CB g = Callbacks::eval_g;
  IpminmaxEval_Grad_F_CB grad_f = Callbacks::eval_grad_f;
  IpminmaxEval_Jac_G_CB jac_g = Callbacks::eval_jac_g;
  IpminmaxEval_H_CB h = Callbacks::eval_h;

  [[nodiscard]] ProblemPtr create() const {
    const auto data = [](const auto& values) { return values.empty() ? nullptr : values.data(); };
    ProblemPtr problem(IpminmaxCreate(n, data(x_L), data(x_U), m, data(g_L), data(g_U), nele_jac,
                                      nele_hess, style, f, g, grad_f, jac_g, h,
                                      data(variable_players), data(constraint_players)));
    if (problem) {
      EXPECT_EQ(IpminmaxAddIntOption(problem.get(), "print_level", 0), 1);
      EXPECT_EQ(IpminmaxAddStrOption(problem.get(), "option_file_name", ""), 1);
    }
    return problem;
  }
};

struct Answer {
  IpminmaxReturnStatus status = IPMINMAX_INTERNAL_ERROR;
  std::vector<double> x{1.0, 0.5, 0.0}, g{7.0, 7.0}, lambda{7.0, 7.0}, z_L{7.0, 7.0, 7.0},
      z_U{7.0, 7.0, 7.0};
  double f = 7.0;
};

void solve_into(const ProblemPtr& problem, Recorder& model, Answer& answer) {
  answer.status = IpminmaxSolve(problem.get(), answer.x.data(), answer.g.data(), &answer.f,
                                answer.lambda.data(), answer.z_L.data(), answer.z_U.data(), &model);
}

Answer solve(const ProblemPtr& problem, Recorder& model) {
  Answer answer;
  solve_into(problem, model, answer);
  return answer;
}

std::string message(const ProblemPtr& problem) { return IpminmaxMessage(problem.get()); }

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// The model through MinMaxApplication.
SmartPtr<MinMaxApplication> solve_in_cpp(const SmartPtr<Recorder>& model,
                                         const std::string& options = "") {
  SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  std::istringstream text(options);
  EXPECT_EQ(app->Initialize(text), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {1})), Ipopt::Solve_Succeeded);
  return app;
}

IpminmaxInertia inertia(const Inertia& of) { return {of.positive, of.negative, of.zero}; }
bool equal(const IpminmaxInertia& a, const IpminmaxInertia& b) {
  return std::tie(a.positive, a.negative, a.zero) == std::tie(b.positive, b.negative, b.zero);
}

TEST(CInterface, IteratesAndAnswerAreThoseOfTheTnlp) {
  for (const auto style : {Ipopt::TNLP::C_STYLE, Ipopt::TNLP::FORTRAN_STYLE}) {
    const SmartPtr<Recorder> cpp = new Recorder;
    const auto app = solve_in_cpp(cpp);
    const Result& result = app->LastResult();

    Recorder model;
    model.style = style;
    Arguments arguments;
    arguments.style = static_cast<int>(style);
    const auto problem = arguments.create();
    ASSERT_TRUE(problem) << IpminmaxMessage(nullptr);
    ASSERT_EQ(IpminmaxSetIntermediateCallback(problem.get(), Callbacks::intermediate), 1);
    const Answer answer = solve(problem, model);

    EXPECT_EQ(answer.status, IPMINMAX_SOLVE_SUCCEEDED);
    EXPECT_GT(model.rows.size(), 3U);
    EXPECT_EQ(model.rows, cpp->rows);
    EXPECT_EQ(answer.x, result.v);
    EXPECT_EQ(answer.g, result.constraints);
    EXPECT_EQ(answer.lambda, result.lambda);
    EXPECT_EQ(answer.z_L, result.z_lower);
    EXPECT_EQ(answer.z_U, result.z_upper);
    EXPECT_EQ(answer.f, result.objective);
    EXPECT_NEAR(answer.x[0], 4.0 / 21.0, 1e-6);
    EXPECT_NEAR(answer.lambda[0], -34.0 / 21.0, 1e-6);
    EXPECT_EQ(IpminmaxStatusName(problem.get()), std::string(name_of(result.status)));
    EXPECT_EQ(message(problem), result.message);

    IpminmaxCertificate c;
    ASSERT_EQ(IpminmaxGetCertificate(problem.get(), &c), 1);
    EXPECT_EQ(c.point_kind, IPMINMAX_LOCAL_MINMAX);
    EXPECT_EQ(c.second_order, IPMINMAX_SATISFIED);
    EXPECT_TRUE(equal(c.inner, inertia(result.certificate.inner)));
    EXPECT_TRUE(equal(c.inner_expected, c.inner));
    EXPECT_TRUE(equal(c.full, inertia(result.certificate.full)));
    EXPECT_TRUE(equal(c.full_expected, c.full));
    EXPECT_GT(c.full.positive, c.inner.positive);
    EXPECT_EQ(c.margin, result.certificate.margin);
    EXPECT_GT(c.margin, 0.0);
    EXPECT_EQ(c.licq_min, 1);
    EXPECT_EQ(c.licq_max, 1);
    EXPECT_EQ(c.weakly_active_min, 0);
    EXPECT_EQ(c.weakly_active_max, 0);
    EXPECT_EQ(c.finite_differences, 0);
    EXPECT_EQ(c.hessian_error, 0.0);
    EXPECT_EQ(c.answer, IPMINMAX_ANSWER_SMOOTH);
    EXPECT_STREQ(c.reasons, "");

    IpminmaxStatistics s;
    ASSERT_EQ(IpminmaxGetStatistics(problem.get(), &s), 1);
    EXPECT_EQ(s.iterations, result.iterations);
    EXPECT_EQ(s.factorizations, result.factorizations);
    EXPECT_EQ(s.analyses, result.counts.analyses);
    EXPECT_EQ(s.analyses, 2);
    EXPECT_EQ(s.objective_evaluations, model.evaluations);
    EXPECT_EQ(s.hessian_evaluations, model.count("eval_h"));
    EXPECT_EQ(s.error, result.error.total);
    EXPECT_LE(s.error, 1e-8);
    EXPECT_GT(s.seconds, 0.0);
  }
}

TEST(CInterface, ConstraintPlayersAreUsed) {
  Recorder model;
  Arguments arguments;
  arguments.constraint_players = {IPMINMAX_MIN, IPMINMAX_MAX};
  EXPECT_EQ(solve(arguments.create(), model).status, IPMINMAX_SOLVE_SUCCEEDED);
  arguments.constraint_players = {IPMINMAX_MIN, IPMINMAX_MIN};  // g1 reads y: for every y
  const auto robust = arguments.create();
  const Answer answer = solve(robust, model);
  EXPECT_EQ(answer.status, IPMINMAX_SOLVE_SUCCEEDED);
  EXPECT_NEAR(answer.x[0], 1.0, 1e-6);
  const auto forbidden = arguments.create();
  ASSERT_EQ(IpminmaxAddStrOption(forbidden.get(), "minmax_robust_constraints", "no"), 1);
  EXPECT_EQ(solve(forbidden, model).status, IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_FALSE(message(forbidden).empty());
}

// --- Hock-Schittkowski 71 as a minimization, in C callbacks of its own ---------------------------

int hs071_f(int, double* x, int, double* f, void*) {
  *f = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
  return 1;
}
int hs071_grad(int, double* x, int, double* grad, void*) {
  grad[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
  grad[1] = x[0] * x[3];
  grad[2] = x[0] * x[3] + 1.0;
  grad[3] = x[0] * (x[0] + x[1] + x[2]);
  return 1;
}
int hs071_g(int, double* x, int, int, double* g, void*) {
  g[0] = x[0] * x[1] * x[2] * x[3];
  g[1] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3];
  return 1;
}
int hs071_jac(int, double* x, int, int, int, int* row, int* col, double* values, void*) {
  for (int k = 0; k < 8; ++k) {
    if (values == nullptr) {
      row[k] = k / 4;
      col[k] = k % 4;
    } else if (k < 4) {
      values[k] = 1.0;
      for (int i = 0; i < 4; ++i) values[k] *= i == k ? 1.0 : x[i];
    } else {
      values[k] = 2.0 * x[k - 4];
    }
  }
  return 1;
}
int hs071_h(int, double* x, int, double sigma, int, double* lambda, int, int, int* row, int* col,
            double* values, void*) {
  int k = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j, ++k) {
      if (values == nullptr) {
        row[k] = i;
        col[k] = j;
        continue;
      }
      double product = 1.0;
      for (int l = 0; l < 4; ++l) product *= l == i || l == j ? 1.0 : x[l];
      values[k] = i == j ? 2.0 * lambda[1] : lambda[0] * product;
    }
  }
  if (values == nullptr) return 1;
  values[0] += sigma * 2.0 * x[3];  // entries (0,0), (1,0), (2,0), (3,0), (3,1), (3,2)
  values[1] += sigma * x[3];
  values[3] += sigma * x[3];
  values[6] += sigma * (2.0 * x[0] + x[1] + x[2]);
  values[7] += sigma * x[0];
  values[8] += sigma * x[0];
  return 1;
}

TEST(CInterface, MinimizesHS071) {
  const std::vector<double> x_L(4, 1.0), x_U(4, 5.0), g_L{25.0, 40.0}, g_U{2e19, 40.0};
  const std::vector<int> players(4, IPMINMAX_MIN);
  const ProblemPtr problem(IpminmaxCreate(4, x_L.data(), x_U.data(), 2, g_L.data(), g_U.data(), 8,
                                          10, 0, hs071_f, hs071_g, hs071_grad, hs071_jac, hs071_h,
                                          players.data(), nullptr));
  ASSERT_TRUE(problem);
  ASSERT_EQ(IpminmaxAddIntOption(problem.get(), "print_level", 0), 1);
  std::vector<double> x{1.0, 5.0, 5.0, 1.0}, lambda(2), z_L(4), z_U(4);
  double f = 0.0;
  ASSERT_EQ(IpminmaxSolve(problem.get(), x.data(), nullptr, &f, lambda.data(), z_L.data(),
                          z_U.data(), nullptr),
            IPMINMAX_SOLVE_SUCCEEDED);
  EXPECT_NEAR(f, 17.0140172, 1e-6);
  EXPECT_NEAR(x[1], 4.7429994, 1e-6);
  EXPECT_NEAR(x[2], 3.8211503, 1e-6);
  EXPECT_NEAR(lambda[0], -0.5522936, 1e-5);
  EXPECT_NEAR(lambda[1], 0.1614686, 1e-5);
  EXPECT_NEAR(z_L[0], 1.0878712, 1e-5);
}

// --- Solves that end otherwise -------------------------------------------------------------------

/// (x - 3)^2 with x + a_k y <= 2 for |y| <= 1, a = 1, .5, .25; calls of all rows and of some.
struct RobustRows {
  static constexpr std::array<double, 3> a{1.0, 0.5, 0.25};
  int of_all = 0, of_some = 0;
  static int rows(int, double* x, int, int count, const int* which, int, double* g, int,
                  double* values, void* data) {
    ++static_cast<RobustRows*>(data)->of_some;
    for (int k = 0; k < count; ++k) {
      const auto j = static_cast<std::size_t>(which[k]);
      if (g != nullptr) {
        g[j] = x[0] + a[j] * x[1];
      } else {
        values[2 * j] = 1.0;
        values[2 * j + 1] = a[j];
      }
    }
    return 1;
  }
  static int g(int n, double* x, int, int m, double* values, void* data) {
    ++static_cast<RobustRows*>(data)->of_all;
    constexpr std::array<int, 3> all{0, 1, 2};
    RobustRows unused;
    return rows(n, x, 0, m, all.data(), m, values, 6, nullptr, &unused);
  }
  static int jacobian(int n, double* x, int, int m, int entries, int* row, int* col, double* values,
                      void* data) {
    if (values == nullptr) {
      for (int k = 0; k < entries; ++k) {
        row[k] = k / 2;
        col[k] = k % 2;
      }
      return 1;
    }
    ++static_cast<RobustRows*>(data)->of_all;
    constexpr std::array<int, 3> all{0, 1, 2};
    RobustRows unused;
    return rows(n, x, 0, m, all.data(), m, nullptr, entries, values, &unused);
  }
};

TEST(CInterface, RobustConstraintsAreMaximizedByTheirRowsAlone) {
  std::array<double, 2> answers{};
  std::array<RobustRows, 2> calls{};
  for (const bool by_rows : {false, true}) {
    const std::array<double, 2> lower{-2e19, -1.0}, upper{2e19, 1.0};
    const std::array<double, 3> none{-2e19, -2e19, -2e19}, two{2.0, 2.0, 2.0};
    const std::array<int, 2> players{IPMINMAX_MIN, IPMINMAX_MAX};
    const std::array<int, 3> owners{IPMINMAX_MIN, IPMINMAX_MIN, IPMINMAX_MIN};
    const auto f = [](int, double* x, int, double* value, void*) {
      *value = (x[0] - 3.0) * (x[0] - 3.0);
      return 1;
    };
    const auto gradient = [](int, double* x, int, double* slope, void*) {
      slope[0] = 2.0 * (x[0] - 3.0);
      slope[1] = 0.0;
      return 1;
    };
    const auto hessian = [](int, double*, int, double factor, int, double*, int, int, int* row,
                            int* col, double* values, void*) {
      if (values == nullptr)
        *row = *col = 0;
      else
        *values = 2.0 * factor;
      return 1;
    };
    const ProblemPtr problem(IpminmaxCreate(
        2, lower.data(), upper.data(), 3, none.data(), two.data(), 6, 1, IPMINMAX_C_STYLE, f,
        RobustRows::g, gradient, RobustRows::jacobian, hessian, players.data(), owners.data()));
    ASSERT_NE(problem, nullptr) << IpminmaxMessage(nullptr);
    IpminmaxAddIntOption(problem.get(), "print_level", 0);
    const auto rows = by_rows ? RobustRows::rows : nullptr;
    ASSERT_EQ(IpminmaxSetRowsCallback(problem.get(), rows), 1);
    std::array<double, 2> x{0.0, 0.1};
    EXPECT_EQ(IpminmaxSolve(problem.get(), x.data(), nullptr, nullptr, nullptr, nullptr, nullptr,
                            &calls[by_rows]),
              IPMINMAX_SOLVE_SUCCEEDED)
        << IpminmaxMessage(problem.get());
    answers[by_rows] = x[0];
  }
  EXPECT_NEAR(answers[0], 1.0, 1e-6);
  EXPECT_EQ(answers[1], answers[0]);
  EXPECT_EQ(calls[0].of_some, 0);
  EXPECT_GT(calls[1].of_some, 0);
  EXPECT_LT(calls[1].of_all, calls[0].of_all / 10);
}

TEST(CInterface, TheUserStops) {
  Recorder model;
  model.on_iteration = [](int iteration) { return iteration < 2; };
  const auto problem = Arguments().create();
  ASSERT_EQ(IpminmaxSetIntermediateCallback(problem.get(), Callbacks::intermediate), 1);
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_USER_REQUESTED_STOP);
  EXPECT_EQ(model.rows.size(), 3U);
  IpminmaxCertificate certificate;
  ASSERT_EQ(IpminmaxGetCertificate(problem.get(), &certificate), 1);
  EXPECT_NE(certificate.point_kind, IPMINMAX_LOCAL_MINMAX);
  ASSERT_EQ(IpminmaxSetIntermediateCallback(problem.get(), nullptr), 1);
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_SOLVE_SUCCEEDED);
  EXPECT_EQ(model.rows.size(), 3U);
}

TEST(CInterface, TheCurrentIterateIsSeenInsideTheCallback) {
  const auto problem = Arguments().create();
  Recorder model;
  Answer at;
  std::vector<double> x_low(3), x_up(3), compl_low(3), compl_up(3), slope(3), violation(2),
      compl_g(2);
  const auto iterate = [&](int n, int m) {
    return IpminmaxGetCurrentIterate(problem.get(), n, at.x.data(), at.z_L.data(), at.z_U.data(), m,
                                     at.g.data(), at.lambda.data());
  };
  const auto violations = [&] {
    return IpminmaxGetCurrentViolations(problem.get(), 3, x_low.data(), x_up.data(),
                                        compl_low.data(), compl_up.data(), slope.data(), 2,
                                        violation.data(), compl_g.data());
  };
  const auto expect_none = [&] {
    EXPECT_EQ(iterate(3, 2), 0);
    EXPECT_TRUE(contains(message(problem), "only inside the intermediate callback"));
    EXPECT_EQ(violations(), 0);
    EXPECT_TRUE(contains(message(problem), "only inside the intermediate callback"));
  };
  expect_none();
  EXPECT_EQ(at.g, Answer().g);  // untouched

  model.on_iteration = [&](int iteration) {
    EXPECT_EQ(iterate(4, 2), 0);
    EXPECT_TRUE(contains(message(problem), "n = 4"));
    EXPECT_EQ(iterate(3, 1), 0);
    EXPECT_TRUE(contains(message(problem), "m = 1"));
    EXPECT_EQ(iterate(3, 2), 1) << message(problem);
    EXPECT_EQ(violations(), 1) << message(problem);
    EXPECT_EQ(
        IpminmaxGetCurrentIterate(problem.get(), 3, nullptr, nullptr, nullptr, 2, nullptr, nullptr),
        1);
    IpminmaxStatistics now;
    EXPECT_EQ(IpminmaxGetStatistics(problem.get(), &now), 1);
    EXPECT_EQ(now.iterations, iteration);
    const Row& told = model.rows.back();
    EXPECT_EQ(now.primal_error, told[3]);
    EXPECT_EQ(std::max(now.dual_error_min, now.dual_error_max), told[4]);

    // The model's functions at x: see adapter/model.hpp.
    const auto& x = at.x;
    EXPECT_EQ(at.g, (std::vector{x[0] + x[2], x[1] - x[0]}));
    EXPECT_NEAR(2.0 * x[0] * x[0] + x[2] * x[2] + 3.0 * x[0] * x[1] - x[1] * x[1], told[2], 1e-12);
    EXPECT_NEAR(slope[0],
                4.0 * x[0] + 3.0 * x[1] + at.lambda[0] - at.lambda[1] - at.z_L[0] + at.z_U[0],
                1e-12);
    EXPECT_NEAR(slope[1], 3.0 * x[0] - 2.0 * x[1] + at.lambda[1] - at.z_L[1] + at.z_U[1], 1e-12);
    EXPECT_NEAR(slope[2], 2.0 * x[2] + at.lambda[0], 1e-12);
    EXPECT_NEAR(std::max(std::abs(slope[0]), std::abs(slope[2])), now.dual_error_min, 1e-12);
    EXPECT_LE(std::abs(slope[1]), now.dual_error_max + 1e-12);  // g1 has a slack
    EXPECT_EQ(violation[0], std::abs(at.g[0] - 1.0));
    EXPECT_EQ(violation[1], std::max(at.g[1] - 4.0, 0.0));
    EXPECT_EQ(compl_low[0], (x[0] + 10.0) * at.z_L[0]);
    EXPECT_EQ(compl_up[0], 0.0);  // no upper bound
    EXPECT_EQ(compl_up[1], (5.0 - x[1]) * at.z_U[1]);
    EXPECT_EQ(compl_g[0], -(at.g[0] - 1.0) * at.lambda[0]);  // g0 = 1
    if (at.lambda[1] < 0.0) {                                // g1 is Max's
      EXPECT_EQ(compl_g[1], (4.0 - at.g[1]) * at.lambda[1]);
    }
    EXPECT_EQ(x_low, std::vector<double>(3, 0.0));
    EXPECT_EQ(x_up, std::vector<double>(3, 0.0));
    return iteration < 3;
  };
  ASSERT_EQ(IpminmaxSetIntermediateCallback(problem.get(), Callbacks::intermediate), 1);
  const Answer answer = solve(problem, model);
  EXPECT_EQ(answer.status, IPMINMAX_USER_REQUESTED_STOP);
  EXPECT_EQ(answer.x, at.x);
  EXPECT_EQ(answer.g, at.g);
  EXPECT_EQ(answer.lambda, at.lambda);
  EXPECT_EQ(answer.z_L, at.z_L);
  EXPECT_EQ(answer.z_U, at.z_U);
  expect_none();
}

TEST(CInterface, ExceptionsOfCallbacksDoNotPass) {
  const auto problem = Arguments().create();
  Recorder model;
  model.on_call = [](const std::string& name) -> bool {
    if (name == "eval_grad_f") throw std::runtime_error("no gradient today");
    return true;
  };
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_NONIPOPT_EXCEPTION_THROWN);
  EXPECT_TRUE(contains(message(problem), "no gradient today"));
  IpminmaxStatistics statistics;
  EXPECT_EQ(IpminmaxGetStatistics(problem.get(), &statistics), 0);

  model.on_call = [](const std::string& name) -> bool {
    if (name == "eval_h") throw std::bad_alloc();
    return true;
  };
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_INSUFFICIENT_MEMORY);
  EXPECT_TRUE(contains(message(problem), "memory"));
}

TEST(CInterface, WithoutHessianDifferencesTakeItsPlace) {
  const auto exact = Arguments().create();
  Recorder model;
  const Answer expected = solve(exact, model);
  Arguments arguments;
  arguments.h = nullptr;
  const auto problem = arguments.create();
  ASSERT_TRUE(problem) << IpminmaxMessage(nullptr);
  const Answer answer = solve(problem, model);
  EXPECT_EQ(answer.status, IPMINMAX_SOLVE_SUCCEEDED) << message(problem);
  ASSERT_EQ(answer.x.size(), expected.x.size());
  for (std::size_t i = 0; i < answer.x.size(); ++i) EXPECT_NEAR(answer.x[i], expected.x[i], 1e-6);

  // The certificate says where its curvature came from, and how wrong it may be.
  IpminmaxCertificate certificate;
  ASSERT_EQ(IpminmaxGetCertificate(problem.get(), &certificate), 1);
  EXPECT_EQ(certificate.point_kind, IPMINMAX_LOCAL_MINMAX);
  EXPECT_EQ(certificate.finite_differences, 1);
  EXPECT_GT(certificate.hessian_error, 0.0);
  EXPECT_LT(certificate.hessian_error, 1e-3);

  ASSERT_EQ(IpminmaxAddStrOption(problem.get(), "hessian_approximation", "exact"), 1);
  const Answer refused = solve(problem, model);
  EXPECT_EQ(refused.status, IPMINMAX_INVALID_OPTION);
  EXPECT_TRUE(contains(message(problem), "hessian")) << message(problem);
  EXPECT_EQ(refused.f, 7.0);  // outputs untouched
  EXPECT_EQ(refused.x, Answer().x);
}

TEST(CInterface, NoSolveInsideItsOwnCallback) {
  const auto problem = Arguments().create();
  Recorder model;
  IpminmaxReturnStatus inner = IPMINMAX_SOLVE_SUCCEEDED;
  std::string text, of_free;
  model.on_iteration = [&](int) {
    Recorder other;
    inner = solve(problem, other).status;
    text = message(problem);
    IpminmaxFree(problem.get());
    of_free = message(problem);
    return true;
  };
  ASSERT_EQ(IpminmaxSetIntermediateCallback(problem.get(), Callbacks::intermediate), 1);
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_SOLVE_SUCCEEDED);
  EXPECT_EQ(inner, IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_TRUE(contains(text, "inside its own callbacks"));
  EXPECT_TRUE(contains(of_free, "not freed"));
}

// --- Scaling, warm start, output -----------------------------------------------------------------

TEST(CInterface, UserScalingChangesThePathNotTheAnswer) {
  Recorder plain, scaled;
  const auto problem = Arguments().create();
  ASSERT_EQ(IpminmaxSetIntermediateCallback(problem.get(), Callbacks::intermediate), 1);
  ASSERT_EQ(IpminmaxAddStrOption(problem.get(), "nlp_scaling_method", "user-scaling"), 1);
  const Answer first = solve(problem, plain);
  const std::vector<double> x_scaling{2.0, 0.5, 3.0}, g_scaling{10.0, 0.1};
  ASSERT_EQ(IpminmaxSetScaling(problem.get(), 5.0, x_scaling.data(), g_scaling.data()), 1);
  const Answer second = solve(problem, scaled);
  EXPECT_EQ(second.status, IPMINMAX_SOLVE_SUCCEEDED) << message(problem);
  EXPECT_NE(plain.rows, scaled.rows);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(first.x[i], second.x[i], 1e-6);
  for (std::size_t j = 0; j < 2; ++j) EXPECT_NEAR(first.lambda[j], second.lambda[j], 1e-6);

  EXPECT_EQ(IpminmaxSetScaling(problem.get(), kNaN, nullptr, nullptr), 0);
  EXPECT_TRUE(contains(message(problem), "obj_scaling"));
  const std::vector<double> bad{1.0, kNaN, 1.0}, zero{1.0, 0.0};
  EXPECT_EQ(IpminmaxSetScaling(problem.get(), 1.0, bad.data(), nullptr), 0);
  EXPECT_TRUE(contains(message(problem), "x_scaling[1]")) << message(problem);
  EXPECT_EQ(IpminmaxSetScaling(problem.get(), 1.0, nullptr, zero.data()), 0);
  EXPECT_TRUE(contains(message(problem), "g_scaling[1]")) << message(problem);
}

/// f = sign (x0^2 + 4 x0 x1 - x1^2), sign in the user's data.
double sign_of(void* data) { return *static_cast<double*>(data); }
int signed_f(int, double* x, int, double* f, void* data) {
  *f = sign_of(data) * (x[0] * x[0] + 4.0 * x[0] * x[1] - x[1] * x[1]);
  return 1;
}
int signed_grad_f(int, double* x, int, double* grad, void* data) {
  grad[0] = sign_of(data) * (2.0 * x[0] + 4.0 * x[1]);
  grad[1] = sign_of(data) * (4.0 * x[0] - 2.0 * x[1]);
  return 1;
}
int signed_h(int, double*, int, double sigma, int, double*, int, int, int* row, int* col,
             double* values, void* data) {
  if (values == nullptr) {
    row[0] = col[0] = col[1] = 0;
    row[1] = row[2] = col[2] = 1;
  } else {
    values[0] = 2.0 * sigma * sign_of(data);
    values[1] = 4.0 * sigma * sign_of(data);
    values[2] = -2.0 * sigma * sign_of(data);
  }
  return 1;
}

// As Ipopt documents it, a negative factor maximizes: the players are mirrored, multipliers negated.
TEST(CInterface, ANegativeFactorOfTheObjectiveMaximizes) {
  struct Point {
    std::array<double, 2> x{2.0, 2.5}, z_lower{}, z_upper{};
    double f = 0.0;
  };
  const auto solve_with = [](double sign) {
    const std::array<double, 2> lower{1.0, -9.0}, upper{5.0, 1.5};
    const std::array<int, 2> players{IPMINMAX_MIN, IPMINMAX_MAX};
    const ProblemPtr problem(IpminmaxCreate(2, lower.data(), upper.data(), 0, nullptr, nullptr, 0,
                                            3, IPMINMAX_C_STYLE, signed_f, nullptr, signed_grad_f,
                                            nullptr, signed_h, players.data(), nullptr));
    EXPECT_EQ(IpminmaxAddIntOption(problem.get(), "print_level", 0), 1);
    EXPECT_EQ(IpminmaxAddStrOption(problem.get(), "option_file_name", ""), 1);
    EXPECT_EQ(IpminmaxAddStrOption(problem.get(), "nlp_scaling_method", "user-scaling"), 1);
    EXPECT_EQ(IpminmaxSetScaling(problem.get(), sign, nullptr, nullptr), 1) << message(problem);
    Point point;
    EXPECT_EQ(IpminmaxSolve(problem.get(), point.x.data(), nullptr, &point.f, nullptr,
                            point.z_lower.data(), point.z_upper.data(), &sign),
              IPMINMAX_SOLVE_SUCCEEDED)
        << message(problem);
    IpminmaxCertificate certificate{};
    EXPECT_EQ(IpminmaxGetCertificate(problem.get(), &certificate), 1);
    EXPECT_EQ(certificate.point_kind, IPMINMAX_LOCAL_MINMAX);
    return point;
  };
  const Point plain = solve_with(1.0), mirrored = solve_with(-1.0);
  EXPECT_NEAR(plain.x[0], 1.0, 1e-6);
  EXPECT_NEAR(plain.x[1], 1.5, 1e-6);
  EXPECT_GT(plain.z_lower[0], 1.0);
  EXPECT_LT(plain.z_upper[1], -0.5);
  EXPECT_EQ(mirrored.x, plain.x);
  EXPECT_EQ(mirrored.f, -plain.f);
  EXPECT_EQ(mirrored.z_lower[0], -plain.z_lower[0]);
  EXPECT_EQ(mirrored.z_upper[1], -plain.z_upper[1]);
}

TEST(CInterface, SolvesAgainFromTheLastMultipliers) {
  const auto problem = Arguments().create();
  Recorder model;
  Answer answer;
  const auto again = [&] {
    return IpminmaxSolveAgain(problem.get(), answer.x.data(), answer.g.data(), &answer.f,
                              answer.lambda.data(), nullptr, nullptr, &model);
  };
  EXPECT_EQ(again(), IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_TRUE(contains(message(problem), "IpminmaxSolveAgain"));

  ASSERT_EQ(IpminmaxAddNumOption(problem.get(), "mu_init", 1e-6), 1);
  solve_into(problem, model, answer);
  ASSERT_EQ(answer.status, IPMINMAX_SOLVE_SUCCEEDED);
  IpminmaxStatistics cold, warm;
  ASSERT_EQ(IpminmaxGetStatistics(problem.get(), &cold), 1);
  EXPECT_EQ(again(), IPMINMAX_SOLVE_SUCCEEDED) << message(problem);
  ASSERT_EQ(IpminmaxGetStatistics(problem.get(), &warm), 1);
  EXPECT_LT(warm.iterations, cold.iterations);
  EXPECT_EQ(cold.analyses, 2);
  EXPECT_EQ(warm.analyses, 0);
  EXPECT_NEAR(answer.x[0], 4.0 / 21.0, 1e-6);

  // Other numbers, the same structure: g0 = 2 instead of 1 doubles the solution.
  const std::vector<double> two{2.0, -1e20}, two_up{2.0, 4.0}, bad{2.0, kNaN};
  ASSERT_EQ(IpminmaxSetBounds(problem.get(), nullptr, nullptr, two.data(), two_up.data()), 1);
  EXPECT_EQ(again(), IPMINMAX_SOLVE_SUCCEEDED) << message(problem);
  ASSERT_EQ(IpminmaxGetStatistics(problem.get(), &warm), 1);
  EXPECT_EQ(warm.analyses, 0);
  EXPECT_NEAR(answer.x[0], 8.0 / 21.0, 1e-6);
  EXPECT_EQ(IpminmaxSetBounds(problem.get(), nullptr, nullptr, nullptr, bad.data()), 0);
  EXPECT_TRUE(contains(message(problem), "g_U[1] is NaN")) << message(problem);
  EXPECT_EQ(again(), IPMINMAX_SOLVE_SUCCEEDED);
  EXPECT_NEAR(answer.x[0], 8.0 / 21.0, 1e-6);  // untouched by the refused bounds

  // An inequality more is another structure: analyzed anew, not taken for the old one.
  const std::vector<double> inequality{1.0, -1e20}, inequality_up{3.0, 4.0};
  ASSERT_EQ(
      IpminmaxSetBounds(problem.get(), nullptr, nullptr, inequality.data(), inequality_up.data()),
      1);
  EXPECT_EQ(again(), IPMINMAX_SOLVE_SUCCEEDED) << message(problem);
  ASSERT_EQ(IpminmaxGetStatistics(problem.get(), &warm), 1);
  EXPECT_EQ(warm.analyses, 2);
  EXPECT_NEAR(answer.x[0], 4.0 / 21.0, 1e-6);

  // The warm start was for that call: multipliers are not asked for afterwards.
  EXPECT_EQ(IpminmaxSolve(problem.get(), answer.x.data(), nullptr, nullptr, nullptr, nullptr,
                          nullptr, &model),
            IPMINMAX_SOLVE_SUCCEEDED);
}

TEST(CInterface, AWarmStartNeedsMultipliers) {
  const auto problem = Arguments().create();
  Recorder model;
  Answer answer = solve(problem, model);
  ASSERT_EQ(IpminmaxAddStrOption(problem.get(), "warm_start_init_point", "yes"), 1);
  EXPECT_EQ(IpminmaxSolve(problem.get(), answer.x.data(), nullptr, nullptr, answer.lambda.data(),
                          nullptr, answer.z_U.data(), &model),
            IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_TRUE(contains(message(problem), "mult_x_L is NULL")) << message(problem);
  solve_into(problem, model, answer);
  EXPECT_EQ(answer.status, IPMINMAX_SOLVE_SUCCEEDED) << message(problem);
}

TEST(CInterface, OutputFile) {
  const auto problem = Arguments().create();
  const std::string file = ::testing::TempDir() + "c_interface_test.out";
  ASSERT_EQ(IpminmaxOpenOutputFile(problem.get(), file.c_str(), 5), 1) << message(problem);
  Recorder model;
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_SOLVE_SUCCEEDED);
  std::ifstream stream(file);
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  EXPECT_TRUE(contains(text, "inf_pr")) << text;
  std::remove(file.c_str());
  EXPECT_EQ(IpminmaxOpenOutputFile(problem.get(), "/nonexistent/folder/file", 5), 0);
  EXPECT_TRUE(contains(message(problem), "/nonexistent/folder/file"));
  EXPECT_EQ(IpminmaxOpenOutputFile(problem.get(), file.c_str(), 13), 0);
  EXPECT_TRUE(contains(message(problem), "print_level = 13"));
  EXPECT_EQ(IpminmaxOpenOutputFile(problem.get(), nullptr, 5), 0);
}

// --- Bad input -----------------------------------------------------------------------------------

TEST(CInterface, CreateNamesWhatIsWrong) {
  const auto expect_refusal = [](const std::string& part, auto change) {
    Arguments arguments;
    change(arguments);
    EXPECT_FALSE(arguments.create()) << part;
    EXPECT_TRUE(contains(IpminmaxMessage(nullptr), part)) << IpminmaxMessage(nullptr);
  };
  expect_refusal("n = -1", [](Arguments& a) { a.n = -1; });
  expect_refusal("m = -2", [](Arguments& a) { a.m = -2; });
  expect_refusal("nele_jac = -1", [](Arguments& a) { a.nele_jac = -1; });
  expect_refusal("nele_jac = 4 without", [](Arguments& a) { a.m = 0; });
  expect_refusal("nele_hess = -3", [](Arguments& a) { a.nele_hess = -3; });
  expect_refusal("index_style = 2", [](Arguments& a) { a.style = 2; });
  expect_refusal("eval_f is NULL", [](Arguments& a) { a.f = nullptr; });
  expect_refusal("eval_g is NULL", [](Arguments& a) { a.g = nullptr; });
  expect_refusal("eval_grad_f is NULL", [](Arguments& a) { a.grad_f = nullptr; });
  expect_refusal("eval_jac_g is NULL", [](Arguments& a) { a.jac_g = nullptr; });
  expect_refusal("x_L is NULL", [](Arguments& a) { a.x_L.clear(); });
  expect_refusal("g_U is NULL", [](Arguments& a) { a.g_U.clear(); });
  expect_refusal("x_U[1] is NaN", [](Arguments& a) { a.x_U[1] = kNaN; });
  expect_refusal("g_L[1] is NaN", [](Arguments& a) { a.g_L[1] = kNaN; });
  expect_refusal("variable_players is NULL", [](Arguments& a) { a.variable_players.clear(); });
  expect_refusal("variable_players[2] = 5", [](Arguments& a) { a.variable_players[2] = 5; });
  expect_refusal("constraint_players[1] = -1", [](Arguments& a) {
    a.constraint_players = {0, -1};
  });
}

// f = 7, and m constraints with value 2.
int constant_f(int, double*, int, double* f, void*) {
  *f = 7.0;
  return 1;
}
int no_grad_f(int, double*, int, double*, void*) { return 1; }
int constant_g(int, double*, int, int m, double* g, void*) {
  std::fill_n(g, m, 2.0);
  return 1;
}
int no_jac_g(int, double*, int, int, int, int*, int*, double*, void*) { return 1; }
int no_h(int, double*, int, double, int, double*, int, int, int*, int*, double*, void*) {
  return 1;
}

TEST(CInterface, AModelWithoutVariablesIsSolvedOrInfeasibleAsItsValuesSay) {
  for (const double upper : {3.0, 2.0, 1.0}) {
    const double lower = -1e20;
    const ProblemPtr problem(IpminmaxCreate(0, nullptr, nullptr, 1, &lower, &upper, 0, 0,
                                            IPMINMAX_C_STYLE, constant_f, constant_g, no_grad_f,
                                            no_jac_g, no_h, nullptr, nullptr));
    ASSERT_TRUE(problem) << IpminmaxMessage(nullptr);
    IpminmaxAddIntOption(problem.get(), "print_level", 0);
    double f = 0.0, g = 0.0;
    EXPECT_EQ(IpminmaxSolve(problem.get(), nullptr, &g, &f, nullptr, nullptr, nullptr, nullptr),
              upper >= 2.0 ? IPMINMAX_SOLVE_SUCCEEDED : IPMINMAX_INFEASIBLE_PROBLEM_DETECTED)
        << message(problem);
    EXPECT_EQ(f, 7.0);
    EXPECT_EQ(g, 2.0);
  }
}

TEST(CInterface, OptionsNameWhatIsWrong) {
  const auto problem = Arguments().create();
  const auto expect_message = [&](int done, const std::string& part) {
    EXPECT_EQ(done, 0) << part;
    EXPECT_TRUE(contains(message(problem), part)) << message(problem);
  };
  IpminmaxProblem p = problem.get();
  expect_message(IpminmaxAddNumOption(p, "tool", 1.0), "unknown option \"tool\"");
  expect_message(IpminmaxAddNumOption(p, "tol", -1.0), "tol = -1");
  expect_message(IpminmaxAddNumOption(p, "tol", kNaN), "tol = nan");
  expect_message(IpminmaxAddIntOption(p, "tol", 1), "tol is a number option");
  expect_message(IpminmaxAddStrOption(p, "max_iter", "5"), "max_iter is an integer option");
  expect_message(IpminmaxAddIntOption(p, "max_iter", -5), "max_iter = -5");
  expect_message(IpminmaxAddStrOption(p, "linear_solver", "nothing"), "linear_solver = nothing");
  expect_message(IpminmaxAddStrOption(p, "linear_solver", nullptr), "NULL");
  expect_message(IpminmaxAddStrOption(p, nullptr, "x"), "NULL");

  // Values may be changed until the solve.
  ASSERT_EQ(IpminmaxAddIntOption(p, "max_iter", 100), 1);
  ASSERT_EQ(IpminmaxAddIntOption(p, "max_iter", 1), 1);
  Recorder model;
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_MAXIMUM_ITERATIONS_EXCEEDED);
}

TEST(CInterface, TheOptionsFileIsReadAndItsErrorsReported) {
  const std::string file = ::testing::TempDir() + "c_interface_test.opt";
  const auto problem = Arguments().create();
  ASSERT_EQ(IpminmaxAddStrOption(problem.get(), "option_file_name", file.c_str()), 1);
  Recorder model;
  std::ofstream(file) << "max_iter 1\n";
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_MAXIMUM_ITERATIONS_EXCEEDED);
  std::ofstream(file) << "max_iter 1\nmax_itre 2\n";
  EXPECT_EQ(solve(problem, model).status, IPMINMAX_INVALID_OPTION);
  EXPECT_TRUE(contains(message(problem), "line 2: unknown option \"max_itre\""))
      << message(problem);
  IpminmaxCertificate certificate;
  EXPECT_EQ(IpminmaxGetCertificate(problem.get(), &certificate), 0);
  std::remove(file.c_str());
}

TEST(CInterface, NullsAreRefused) {
  const auto expect_null = [](int done) {
    EXPECT_EQ(done, 0);
    EXPECT_STREQ(IpminmaxMessage(nullptr), "the problem is NULL");
  };
  IpminmaxFree(nullptr);
  double x = 0.0;
  IpminmaxCertificate certificate;
  IpminmaxStatistics statistics;
  expect_null(IpminmaxAddNumOption(nullptr, "tol", 1.0));
  expect_null(IpminmaxAddIntOption(nullptr, "max_iter", 1));
  expect_null(IpminmaxAddStrOption(nullptr, "sb", nullptr));
  expect_null(IpminmaxOpenOutputFile(nullptr, "file", 1));
  expect_null(IpminmaxSetScaling(nullptr, 1.0, nullptr, nullptr));
  expect_null(IpminmaxSetIntermediateCallback(nullptr, nullptr));
  expect_null(IpminmaxGetCertificate(nullptr, &certificate));
  expect_null(IpminmaxGetStatistics(nullptr, &statistics));
  EXPECT_EQ(IpminmaxSolve(nullptr, &x, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr),
            IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_EQ(IpminmaxSolveAgain(nullptr, &x, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr),
            IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_STREQ(IpminmaxStatusName(nullptr), "");

  const auto problem = Arguments().create();
  Recorder model;
  EXPECT_STREQ(IpminmaxStatusName(problem.get()), "");
  EXPECT_EQ(IpminmaxGetCertificate(problem.get(), &certificate), 0);
  EXPECT_FALSE(message(problem).empty());
  EXPECT_EQ(
      IpminmaxSolve(problem.get(), nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, &model),
      IPMINMAX_INVALID_PROBLEM_DEFINITION);
  EXPECT_EQ(message(problem), "x is NULL");
  solve(problem, model);
  EXPECT_EQ(IpminmaxGetCertificate(problem.get(), nullptr), 0);
}

// A program of another version has a shorter or a longer structure, which is filled as far as it
// reaches.
template <class Structure, class Get>
void expect_sizes_respected(std::size_t part, const Get& get,
                            int (*old)(IpminmaxProblem, Structure*), IpminmaxProblem problem) {
  Structure known{};
  ASSERT_EQ(get(&known, sizeof known), 1);
  constexpr std::size_t kMore = 24;
  constexpr unsigned char kUntouched = 0xA5;
  std::array<unsigned char, sizeof(Structure)> expected{};
  std::memcpy(expected.data(), &known, sizeof known);
  for (const std::size_t size : {std::size_t{0}, part, sizeof known, sizeof known + kMore}) {
    alignas(Structure) std::array<unsigned char, sizeof(Structure) + 2 * kMore> memory{};
    memory.fill(kUntouched);
    ASSERT_EQ(get(reinterpret_cast<Structure*>(memory.data()), size), 1);
    for (std::size_t k = 0; k < memory.size(); ++k) {
      const unsigned char filled = k < expected.size() ? expected[k] : 0;
      ASSERT_EQ(memory[k], k < size ? filled : kUntouched) << "byte " << k << " of " << size;
    }
  }
  Structure by_old_name{};
  ASSERT_EQ(old(problem, &by_old_name), 1);
  EXPECT_EQ(std::memcmp(&by_old_name, &known, sizeof known), 0);
}

TEST(CInterface, StructuresOfOtherVersionsAreFilledAsFarAsTheyReach) {
  const auto problem = Arguments().create();
  Recorder model;
  solve(problem, model);
  expect_sizes_respected<IpminmaxCertificate>(
      offsetof(IpminmaxCertificate, margin),
      [&](IpminmaxCertificate* c, std::size_t size) {
        return IpminmaxGetCertificateSized(problem.get(), c, size);
      },
      IpminmaxGetCertificate, problem.get());
  expect_sizes_respected<IpminmaxStatistics>(
      offsetof(IpminmaxStatistics, seconds),
      [&](IpminmaxStatistics* s, std::size_t size) {
        return IpminmaxGetStatisticsSized(problem.get(), s, size);
      },
      IpminmaxGetStatistics, problem.get());
  expect_sizes_respected<IpminmaxWorstCase>(
      offsetof(IpminmaxWorstCase, found),
      [&](IpminmaxWorstCase* w, std::size_t size) {
        return IpminmaxGetWorstCaseSized(problem.get(), w, size, nullptr);
      },
      [](IpminmaxProblem p, IpminmaxWorstCase* w) { return (IpminmaxGetWorstCase)(p, w, nullptr); },
      problem.get());
}

TEST(CInterface, Version) { EXPECT_EQ(std::string(IpminmaxVersion()).find("0."), 0U); }

// min over x, max over y of (x - 1)^2 / 2 + x y / 10 - (y^2 - 1)^2 + 0.3 y: a weak branch near y =
// -1.
int two_branches_f(int, double* v, int, double* f, void*) {
  const double s = v[1] * v[1] - 1.0;
  *f = 0.5 * (v[0] - 1.0) * (v[0] - 1.0) + 0.1 * v[0] * v[1] - s * s + 0.3 * v[1];
  return 1;
}
int two_branches_grad(int, double* v, int, double* grad, void*) {
  grad[0] = v[0] - 1.0 + 0.1 * v[1];
  grad[1] = 0.1 * v[0] - 4.0 * v[1] * (v[1] * v[1] - 1.0) + 0.3;
  return 1;
}

TEST(CInterface, TheWorstCaseOverAllOfY) {
  const double lower[] = {-5.0, -2.0}, upper[] = {5.0, 2.0};
  const int players[] = {IPMINMAX_MIN, IPMINMAX_MAX};
  ProblemPtr problem(IpminmaxCreate(2, lower, upper, 0, nullptr, nullptr, 0, 0, IPMINMAX_C_STYLE,
                                    two_branches_f, nullptr, two_branches_grad, nullptr, nullptr,
                                    players, nullptr));
  ASSERT_NE(problem.get(), nullptr);
  IpminmaxAddIntOption(problem.get(), "print_level", 0);
  IpminmaxWorstCase found;
  double x[] = {1.0, -1.0}, worst[2] = {}, f = 0.0;
  EXPECT_EQ(IpminmaxGetWorstCase(problem.get(), &found, worst), 0) << "nothing was solved";
  ASSERT_EQ(IpminmaxSolve(problem.get(), x, nullptr, &f, nullptr, nullptr, nullptr, nullptr),
            IPMINMAX_SOLVE_SUCCEEDED);
  ASSERT_LT(x[1], 0.0) << "not the weak branch";
  ASSERT_EQ(IpminmaxGetWorstCase(problem.get(), &found, nullptr), 1);
  EXPECT_EQ(found.starts, 0) << "was not asked for";

  ASSERT_EQ(IpminmaxCheckWorstCase(problem.get(), x, 10, &found, worst, nullptr), 1)
      << IpminmaxMessage(problem.get());
  EXPECT_EQ(found.starts, 10);
  EXPECT_EQ(found.found, 1);
  EXPECT_EQ(found.higher, 1);
  EXPECT_EQ(found.maxima, 2);
  EXPECT_GT(found.value, f + 0.1);
  EXPECT_EQ(worst[0], x[0]);
  EXPECT_GT(worst[1], 0.9);
  double values[2] = {};
  ASSERT_EQ(IpminmaxGetWorstCaseBranches(problem.get(), 2, values), 2);
  EXPECT_EQ(values[0], found.value);
  EXPECT_NEAR(values[1], f, 1e-6);

  IpminmaxAddIntOption(problem.get(), "minmax_worst_case_starts", 10);
  x[1] = -1.0;
  ASSERT_EQ(IpminmaxSolve(problem.get(), x, nullptr, &f, nullptr, nullptr, nullptr, nullptr),
            IPMINMAX_SOLVE_SUCCEEDED);
  ASSERT_EQ(IpminmaxGetWorstCase(problem.get(), &found, worst), 1);
  EXPECT_EQ(found.starts, 10);
  EXPECT_EQ(found.higher, 0) << "the solve goes on from the higher y";
  EXPECT_GT(f, values[1] + 0.1);

  EXPECT_EQ(IpminmaxCheckWorstCase(problem.get(), x, 0, &found, nullptr, nullptr), 0);
  EXPECT_NE(std::string(IpminmaxMessage(problem.get())).find("at least one"), std::string::npos);
  EXPECT_EQ(IpminmaxCheckWorstCase(problem.get(), x, 5, nullptr, nullptr, nullptr), 0);
  EXPECT_EQ(IpminmaxCheckWorstCase(problem.get(), nullptr, 5, &found, nullptr, nullptr), 0);
  EXPECT_EQ(IpminmaxCheckWorstCase(nullptr, x, 5, &found, nullptr, nullptr), 0);
}

int product_f(int, double* v, int, double* f, void*) {
  *f = v[0] * v[1];
  return 1;
}
int product_grad(int, double* v, int, double* grad, void*) {
  grad[0] = v[1];
  grad[1] = v[0];
  return 1;
}

TEST(CInterface, TheDualityGap) {
  double x_L[] = {-1.0, -1.0}, x_U[] = {1.0, 2.0}, x[] = {0.5, 0.5};
  const int players[] = {IPMINMAX_MIN, IPMINMAX_MAX};
  const ProblemPtr problem(IpminmaxCreate(2, x_L, x_U, 0, nullptr, nullptr, 0, 0, IPMINMAX_C_STYLE,
                                          product_f, nullptr, product_grad, nullptr, nullptr,
                                          players, nullptr));
  ASSERT_NE(problem, nullptr);
  IpminmaxAddIntOption(problem.get(), "print_level", 0);
  double most = 0.0, least = 0.0;
  int saddle_point = -1;
  ASSERT_EQ(IpminmaxFindGap(problem.get(), x, &most, &least, &saddle_point, nullptr), 1)
      << IpminmaxMessage(problem.get());
  EXPECT_NEAR(most, 1.0, 1e-6);
  EXPECT_NEAR(least, -0.5, 1e-6);
  EXPECT_EQ(saddle_point, 0);
  x[0] = x[1] = 0.0;
  ASSERT_EQ(IpminmaxFindGap(problem.get(), x, nullptr, nullptr, &saddle_point, nullptr), 1);
  EXPECT_EQ(saddle_point, 1);
  x[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(IpminmaxFindGap(problem.get(), x, &most, &least, nullptr, nullptr), 0);
  EXPECT_EQ(IpminmaxFindGap(problem.get(), nullptr, &most, &least, nullptr, nullptr), 0);
  EXPECT_EQ(IpminmaxFindGap(nullptr, x, &most, &least, nullptr, nullptr), 0);
}

/// min x^2 - x with x y <= 1, x - y <= 9 for every y in [1, 4]: x = 1/4 at y = 4; the other row is
/// idle.
int limits_f(int, double* v, int, double* f, void*) {
  *f = v[0] * v[0] - v[0];
  return 1;
}
int limits_grad(int, double* v, int, double* grad, void*) {
  grad[0] = 2.0 * v[0] - 1.0;
  grad[1] = 0.0;
  return 1;
}
int limits_g(int, double* v, int, int, double* g, void*) {
  g[0] = v[0] * v[1];
  g[1] = v[0] - v[1];
  return 1;
}
int limits_jac(int, double* v, int, int, int, int* row, int* col, double* values, void*) {
  if (values == nullptr) {
    row[0] = row[1] = 0, row[2] = row[3] = 1;
    col[0] = col[2] = 0, col[1] = col[3] = 1;
  } else {
    values[0] = v[1], values[1] = v[0], values[2] = 1.0, values[3] = -1.0;
  }
  return 1;
}

TEST(CInterface, WorstCasesOfRobustConstraints) {
  const double lower[] = {-5.0, 1.0}, upper[] = {5.0, 4.0};
  const double least[] = {-1e20, -1e20}, most[] = {1.0, 9.0};
  const int players[] = {IPMINMAX_MIN, IPMINMAX_MAX}, rows[] = {IPMINMAX_MIN, IPMINMAX_MIN};
  ProblemPtr problem(IpminmaxCreate(2, lower, upper, 2, least, most, 4, 0, IPMINMAX_C_STYLE,
                                    limits_f, limits_g, limits_grad, limits_jac, nullptr, players,
                                    rows));
  ASSERT_NE(problem.get(), nullptr);
  IpminmaxAddIntOption(problem.get(), "print_level", 0);
  EXPECT_EQ(
      IpminmaxGetRobustWorstCases(problem.get(), 0, nullptr, nullptr, nullptr, nullptr, nullptr),
      0);
  double x[] = {0.1, 2.0}, f = 0.0;
  ASSERT_EQ(IpminmaxSolve(problem.get(), x, nullptr, &f, nullptr, nullptr, nullptr, nullptr),
            IPMINMAX_SOLVE_SUCCEEDED)
      << IpminmaxMessage(problem.get());
  EXPECT_NEAR(x[0], 0.25, 1e-6);
  int constraints[2] = {-1, -1}, active[2] = {-1, -1};
  double values[2] = {}, multipliers[2] = {}, worst[4] = {};
  ASSERT_EQ(IpminmaxGetRobustWorstCases(problem.get(), 2, constraints, values, multipliers, active,
                                        worst),
            2);
  EXPECT_EQ(constraints[0], 0);
  EXPECT_EQ(constraints[1], 1);
  EXPECT_NEAR(values[0], 1.0, 1e-6);
  EXPECT_LT(values[1], -0.7);
  EXPECT_NEAR(multipliers[0], 0.125, 1e-5);  // 2 x - 1 + 4 lambda = 0
  EXPECT_NEAR(multipliers[1], 0.0, 1e-6);
  EXPECT_EQ(active[0], 1);
  EXPECT_EQ(active[1], 0);
  EXPECT_NEAR(worst[0], 0.25, 1e-6);
  EXPECT_NEAR(worst[1], 4.0, 1e-6);
  EXPECT_EQ(worst[2], x[0]);
  int first = -1;
  EXPECT_EQ(
      IpminmaxGetRobustWorstCases(problem.get(), 1, &first, nullptr, nullptr, nullptr, nullptr), 2);
  EXPECT_EQ(first, 0);
  EXPECT_EQ(IpminmaxGetRobustWorstCases(nullptr, 1, &first, nullptr, nullptr, nullptr, nullptr), 0);
}

TEST(CInterface, AMistypedOptionGetsAProposal) {
  ProblemPtr problem = Arguments{}.create();
  EXPECT_EQ(IpminmaxAddNumOption(problem.get(), "toll", 1e-6), 0);
  EXPECT_NE(std::string(IpminmaxMessage(problem.get())).find("did you mean tol?"),
            std::string::npos)
      << IpminmaxMessage(problem.get());
}

}  // namespace
}  // namespace ipminmax
