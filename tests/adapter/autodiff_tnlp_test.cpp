// Formulas as Ipopt's model: players, names, any size.
#include <IpIpoptApplication.hpp>
#include <algorithm>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "adapter/ipopt/autodiff_tnlp.hpp"
#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax {
namespace {

/// Pairs (x_i, y_i) in a chain: sum of (x_i - 1)^2 + 0.1 x_i x_{i+1} + 3 x_i y_i - y_i^2 - y_i^4.
struct Chain {
  template <class T>
  T objective(std::span<const T> v) const {
    const std::size_t n = v.size() / 2;
    T f = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const T x = v[i], y = v[n + i];
      f += square(x - 1.0) + 3.0 * x * y - y * y - pow(y, 4);
      if (i + 1 < n) f += 0.1 * x * v[i + 1];
    }
    return f;
  }
  /// The sum of all x.
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = 0.0;
    for (std::size_t i = 0; i < v.size() / 2; ++i) g[0] += v[i];
  }
};

ModelData data(std::size_t n) {
  ModelData d;
  d.players.assign(2 * n, Player::Max);
  std::fill_n(d.players.begin(), n, Player::Min);
  d.start.assign(2 * n, 0.1);
  d.constraint_lower = {-1e20};
  d.constraint_upper = {10.0 * static_cast<double>(n)};
  return d;
}

TEST(AutodiffTnlp, IsSolvedWithItsPlayers) {
  ModelData d = data(3);
  d.variable_names = {"x0", "x1", "x2", "y0", "y1", "y2"};
  const Ipopt::SmartPtr<AutodiffTNLP<Chain>> model = new AutodiffTNLP(Chain{}, d);
  const Ipopt::SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  app->Options()->SetStringValue("derivative_test", "second-order");
  ASSERT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->LastResult().certificate.kind, PointKind::LocalMinmax);
  AutodiffProblem<Chain> problem(Chain{}, d);
  EXPECT_EQ(app->LastResult().v, solve(problem, {}).v);
  Ipopt::TNLP::StringMetaDataMapType names, of_rows;
  Ipopt::TNLP::IntegerMetaDataMapType integers;
  Ipopt::TNLP::NumericMetaDataMapType numbers;
  EXPECT_TRUE(
      model->get_var_con_metadata(6, names, integers, numbers, 1, of_rows, integers, numbers));
  EXPECT_EQ(names["idx_names"], d.variable_names);
}

struct Bowl {
  template <class T>
  T objective(std::span<const T> v) const {
    return square(v[0] - 3.0) + square(v[0] * v[1] - 1.0);
  }
};

TEST(AutodiffTnlp, IsIpoptsModelToo) {
  const Ipopt::SmartPtr<Ipopt::TNLP> model = new AutodiffTNLP(
      Bowl{}, ModelData{.players = {Player::Min, Player::Min}, .start = {1.0, 1.0}});
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> ipopt = new Ipopt::IpoptApplication(false);
  ipopt->Options()->SetIntegerValue("print_level", 0);
  ipopt->Options()->SetStringValue("sb", "yes");
  ASSERT_EQ(ipopt->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(ipopt->OptimizeTNLP(model), Ipopt::Solve_Succeeded);
}

// What a dense method would do in minutes and gigabytes.
TEST(AutodiffTnlp, HundredThousandVariablesHaveASparseHessian) {
  constexpr std::size_t kN = 50000;
  AutodiffProblem<Chain> problem(Chain{}, data(kN));
  const ProblemStructure& s = problem.structure();
  EXPECT_EQ(s.jacobian.size(), kN);
  EXPECT_EQ(s.hessian.size(), 4 * kN - 1);  // xx, xy, yy; x_i x_{i+1}
  std::vector<double> v(2 * kN, 0.5), grad(2 * kN), values(s.hessian.size()), lambda{2.0};
  EXPECT_TRUE(problem.gradient(v, true, grad));
  EXPECT_DOUBLE_EQ(grad[1], -1.0 + 0.1 + 1.5);
  EXPECT_DOUBLE_EQ(grad[kN], 1.5 - 1.0 - 0.5);
  EXPECT_TRUE(problem.hessian(v, false, 2.0, lambda, true, values));
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [row, col] = s.hessian[k];
    const auto n = static_cast<Index>(kN);
    const double expected =
        row == col ? (col < n ? 4.0 : 2.0 * (-2.0 - 12.0 * 0.25)) : (row == col + n ? 6.0 : 0.2);
    ASSERT_NEAR(values[k], expected, 1e-12) << row << " " << col;
  }
}

}  // namespace
}  // namespace ipminmax
