// Models written as .nl files are solved by the executable as the core solves them directly.

#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <nl_problem.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/nl_writer.hpp>

#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/diagnostics/derivative_test.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

/// The numbers of a .sol file.
struct Solution {
  std::vector<double> pi, v;
  int solve_result = -1;
  Index iterations = -1;
  double objective = 0.0;
  std::vector<double> z_lower, z_upper;
};

Solution parse(const std::string& text) {
  Solution solution;
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line) && line != "Options") {
    Index iterations = 0;
    double objective = 0.0;
    const std::size_t at = line.find("objective ");  // one line for a minimization
    if (at != std::string::npos && std::sscanf(line.c_str() + at, "objective %lf, %d iterations",
                                               &objective, &iterations) == 2) {
      solution.objective = objective;
      solution.iterations = iterations;
    }
  }
  int count = 0, skipped = 0, m = 0, pis = 0, n = 0, vs = 0;
  lines >> count;
  for (int i = 0; i < count; ++i) lines >> skipped;
  lines >> m >> pis >> n >> vs;
  solution.pi.resize(static_cast<std::size_t>(pis));
  solution.v.resize(static_cast<std::size_t>(vs));
  for (double& value : solution.pi) lines >> value;
  for (double& value : solution.v) lines >> value;
  std::string word;
  lines >> word >> skipped >> solution.solve_result;
  while (lines >> word && word == "suffix") {
    int kind = 0, entries = 0, ignored = 0;
    lines >> kind >> entries >> ignored >> ignored >> ignored >> word;
    std::vector<double> others(1);  // of the problem: minmax_result
    std::vector<double>& z = word == "ipopt_zL_out"   ? solution.z_lower
                             : word == "ipopt_zU_out" ? solution.z_upper
                                                      : others;
    z.assign(solution.v.size(), 0.0);
    for (std::size_t i = 0; entries-- > 0;) {
      lines >> i;
      lines >> z.at(i);
    }
  }
  return solution;
}

void expect_near(const std::vector<double>& a, const std::vector<double>& b, double tolerance,
                 const char* what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_NEAR(a[i], b[i], tolerance * (1.0 + std::abs(b[i]))) << what << " " << i;
}

std::string bytes_of(const std::vector<double>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

/// Text and binary give the same .sol; the point, the multipliers and the number of iterations are
/// those of the core, also for the negative as a maximization.
class AmplSame : public Ampl {
 protected:
  void compare(const std::string& name, const Model& model, const std::vector<double>& start) {
    SCOPED_TRACE(name);
    AutodiffProblem problem(model, start);
    const Result direct = solve(problem, SolverOptions{});
    ASSERT_TRUE(is_success(direct.status)) << direct.message;

    using Format = NlWriter::Format;
    using Sense = NlWriter::Sense;
    put("text.nl", NlWriter(model, start, Format::Text).write());
    put("binary.nl", NlWriter(model, start, Format::Binary).write());
    put("negative.nl", NlWriter(model, start, Format::Text, Sense::MaximizeNegative).write());
    ASSERT_EQ(run("text -AMPL print_level=0"), 0) << err_;
    EXPECT_EQ(out_, "");
    ASSERT_EQ(run("binary -AMPL print_level=0"), 0) << err_;
    ASSERT_EQ(run("negative.nl -s print_level=0"), 0) << err_;
    const Solution text = parse(get("text.sol")), negative = parse(get("negative.sol"));
    // A binary model is answered by a binary .sol: the same bits.
    const std::string binary = get("binary.sol");
    EXPECT_EQ(binary.substr(0, 10), std::string("\6\0\0\0binary", 10));
    EXPECT_NE(binary.find(bytes_of(text.v)), std::string::npos);
    EXPECT_NE(binary.find(bytes_of(text.pi)), std::string::npos);
    EXPECT_LT(text.solve_result, 200);
    EXPECT_EQ(text.iterations, direct.iterations);
    EXPECT_NEAR(text.objective, direct.objective, 1e-7 * (1.0 + std::abs(direct.objective)));
    EXPECT_NEAR(negative.objective, -direct.objective, 1e-7 * (1.0 + std::abs(direct.objective)));
    EXPECT_EQ(negative.iterations, direct.iterations);
    expect_near(text.v, direct.v, 1e-7, "v");
    expect_near(negative.v, direct.v, 1e-7, "v of the negative");
    std::vector<double> pi = direct.lambda;  // grad f = J' pi + reduced costs
    expect_near(negative.pi, pi, 1e-6, "pi of the negative");
    for (double& value : pi) value = -value;
    expect_near(text.pi, pi, 1e-6, "pi");

    std::vector<double> upper = direct.z_upper;
    expect_near(negative.z_upper, upper, 1e-6, "zU of the negative");
    for (double& value : upper) value = -value;
    expect_near(text.z_upper, upper, 1e-6, "zU");
    expect_near(text.z_lower, direct.z_lower, 1e-6, "zL");
    compare_derivatives("text.nl");
    compare_derivatives("negative.nl");
  }

  void compare_derivatives(const std::string& file) {
    Ipopt::SmartPtr<NlProblem> model = new NlProblem(path(file), -1);
    TnlpProblem problem(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(model)));
    ASSERT_EQ(problem.load(), "");
    SolverOptions options;
    options.derivative_test = DerivativeTest::SecondOrder;
    options.derivative_test_tol = 1e-3;
    options.point_perturbation_radius = 0.1;
    const DerivativeReport report = test_derivatives(problem, options);
    EXPECT_EQ(report.failure, "");
    EXPECT_GT(report.first_tested, 0);
    EXPECT_GT(report.second_tested, 0);
    for (const DerivativeEntry& entry : report.entries)
      ADD_FAILURE() << file << ": " << describe(entry, problem.structure()) << ": " << entry.exact
                    << " differs from " << entry.approximate;
    compare_rows(problem);
  }

  /// Constraints evaluated alone at points that are new, and all of them there.
  void compare_rows(TnlpProblem& problem) {
    const ProblemStructure& s = problem.structure();
    const std::size_t n = s.variable_lower.size(), m = s.constraint_lower.size();
    std::vector<double> v(n), g(m), alone(m), j(s.jacobian.size()), h(s.hessian.size());
    StartingPoint start;
    start.v = v;
    ASSERT_TRUE(problem.starting_point(start));
    for (Index row = 0; static_cast<std::size_t>(row) < m; ++row) {
      for (double& value : v) value += 1e-3;
      std::vector<double> j_alone = j, h_alone(h.size()), lambda(m, 0.0);
      lambda[static_cast<std::size_t>(row)] = 0.7;
      ASSERT_TRUE(problem.constraint_rows({&row, 1}, v, true, alone));
      ASSERT_TRUE(problem.jacobian_rows({&row, 1}, v, false, j_alone));
      ASSERT_TRUE(problem.hessian(v, false, 0.0, lambda, true, h_alone));
      ASSERT_TRUE(problem.constraints(v, false, g));
      ASSERT_TRUE(problem.jacobian(v, false, j));
      ASSERT_TRUE(problem.hessian(v, false, 0.0, lambda, true, h));
      EXPECT_EQ(alone[static_cast<std::size_t>(row)], g[static_cast<std::size_t>(row)]);
      EXPECT_EQ(h_alone, h);
      for (std::size_t k = 0; k < j.size(); ++k) {
        if (s.jacobian[k].row != row) continue;
        EXPECT_EQ(j_alone[k], j[k]) << k;
      }
    }
  }
};

TEST_F(AmplSame, Minmax) {
  for (const char* name : {"paper_f1", "paper_f3", "adolphs", "jin_nash", "dp1", "tc5", "ea3",
                           "rh1", "attack_ball", "eq_coupled", "hyperbola", "bolib_tp7"}) {
    const SmallProblem& problem = small_problem(name);
    compare(name, problem.model, problem.starts.front());
  }
}

TEST_F(AmplSame, HockSchittkowski) {
  for (const char* name : {"hs001", "hs002", "hs004", "hs005", "hs006", "hs007", "hs009",
                           "hs011", "hs012", "hs014", "hs015", "hs021", "hs022", "hs026",
                           "hs035", "hs039", "hs043", "hs065", "hs071", "hs076", "hs100"}) {
    const MinimizationProblem& problem = hock_schittkowski(name);
    compare(name, problem.model, problem.start);
  }
}

}  // namespace
}  // namespace ipminmax::testing
