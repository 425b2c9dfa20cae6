// The scalable families in growing sizes, ours against Ipopt.

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <ipminmax/core/solver.hpp>
#include <regression/effort_table.hpp>
#include <regression/problem_tnlp.hpp>
#include <regression/scalable_nlp.hpp>

namespace ipminmax::testing {
namespace {

constexpr std::array<Index, 4> kSizes = {100, 1000, 10000, 100000};

TEST(ScalableTable, EffortIsThatOfIpopt) {
  EffortTable table;
  EffortTable::print_header();
  for (const Index n : kSizes) {
    for (const ScalableNlp& family : scalable_nlps()) {
      const auto problem = family.make(n);
      const IpoptAnswer ipopt = solve_with_ipopt(*problem);
      const Result ours = solve(*problem, SolverOptions{});
      table.add(family.name + " " + std::to_string(n), ipopt, ours);
      std::printf("TIME %g %g\n", ipopt.seconds, ours.seconds);
      fflush(stdout);
      EXPECT_TRUE(is_success(ours.status) || !ipopt.solved()) << ours.message;
    }
  }
  table.print_summary();
  EXPECT_EQ(table.ipopt_better, 0);
}

}  // namespace
}  // namespace ipminmax::testing
