// The scalable families in growing sizes, ours against Ipopt.

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <regression/effort_table.hpp>
#include <regression/problem_tnlp.hpp>
#include <regression/scalable_nlp.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

constexpr std::array<Index, 3> kSizes = {100, 1000, 4000};  // larger ones: bench/scalable.cpp

TEST(ScalableTable, EffortIsThatOfIpopt) {
  EffortTable table;
  EffortTable::print_header();
  for (const Index n : kSizes) {
    for (const ScalableNlp& family : scalable_nlps()) {
      const std::string name = family.name + " " + std::to_string(n);
      const auto problem = family.make(n);
      const IpoptAnswer ipopt = solve_with_ipopt(*problem);
      const Result ours = solve(*problem, SolverOptions{});
      table.add(name, ipopt, ours);
      EXPECT_TRUE(is_success(ours.status) || !ipopt.solved()) << name << ": " << ours.message;
    }
  }
  table.print_summary();
  EXPECT_EQ(table.ipopt_better, 0);
  EXPECT_LE(table.iterations.mean(), 1.1);
  EXPECT_LE(table.evaluations.mean(), 1.15);
  EXPECT_LE(table.factorizations.mean(), 1.3);
}

TEST(ScalableTable, TenTimesTheVariablesTakeAboutAsManyIterations) {
  constexpr std::array<std::string_view, 8> kFamilies = {
      "luksan_vlcek_1",      "luksan_vlcek_1_inequalities", "luksan_vlcek_2",
      "luksan_vlcek_3",      "chained_rosenbrock",          "van_der_pol",
      "distributed_control", "elastic_plastic_torsion"};
  for (const std::string_view name : kFamilies) {
    const auto family = std::ranges::find(scalable_nlps(), name, &ScalableNlp::name);
    ASSERT_NE(family, scalable_nlps().end()) << name;
    constexpr Index kFewer = 5000;
    Index smaller = 0;
    for (const Index n : {kFewer, 10 * kFewer}) {
      const Result result = solve(*family->make(n), SolverOptions{});
      EXPECT_TRUE(is_success(result.status)) << name << ": " << result.message;
      if (n > kFewer) {
        EXPECT_LE(result.iterations, smaller + smaller / 4 + 3) << name;
      }
      smaller = result.iterations;
    }
  }
}

TEST(ScalableCertificate, IsThatOfPivotingWhateverTheLinearSolver) {
  // LDL' without pivoting leaves residuals here that hide where Newton's method ends.
  constexpr Index kVariables = 10000;
  const auto family =
      std::ranges::find(scalable_nlps(), std::string("boundary_control"), &ScalableNlp::name);
  ASSERT_NE(family, scalable_nlps().end());
  for (const LinearSolver solver : {LinearSolver::Auto, LinearSolver::Mumps}) {
    SolverOptions options;
    options.linear_solver = solver;
    const auto problem = family->make(kVariables);
    const Result result = solve(*problem, options);
    EXPECT_EQ(result.status, Status::Solved) << result.message;
    EXPECT_EQ(result.certificate.second_order, SecondOrder::Satisfied) << result.message;
  }
}

}  // namespace
}  // namespace ipminmax::testing
