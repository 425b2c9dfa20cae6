// Files and command lines as modelling systems write them.
//
//   min over x, z   max over y   x^2 + z + x y - y^2   s.t.  x + y <= 10 (Max),  x z >= 1,  z >= 0.1
//
// y = x / 2, z = 1 / x: 5/4 x^2 + 1 / x is least at x = 0.4^(1/3).
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>

namespace ipminmax::testing {
namespace {

/// Text as Pyomo writes it: comments, sums as o54 or with constants in front, suffixes after the
/// header, no segment x.
const char* const kPyomo =
    "g3 1 1 0\t# problem unknown\n"
    " 3 2 1 0 0\t# vars, constraints, objectives, ranges, eqns\n"
    " 1 1 0 0 0 0\t# nonlinear constrs, objs; ccons: lin, nonlin, nd, nzlb\n"
    " 0 0\t# network constraints: nonlinear, linear\n"
    " 2 3 1\t# nonlinear vars in constraints, objectives, both\n"
    " 0 0 0 1\t# linear network variables; functions; arith, flags\n"
    " 0 0 0 0 0\t# discrete variables: binary, integer, nonlinear (b,c,o)\n"
    " 4 3\t# nonzeros in Jacobian, obj. gradient\n"
    " 2 1\t# max name lengths: constraints, variables\n"
    " 0 0 0 0 0\t# common exprs: b,c,o,c1,o1\n"
    "S0 1 player\n"
    "2 1\n"
    "C0\t#product\n"
    "o2\t#*\n"
    "v0\t#x\n"
    "v1\t#z\n"
    "C1\t#sum\n"
    "n0\n"
    "O0 0\t#o\n"
    "o54\t#sumlist\n"
    "3\t#n\n"
    "o5\t#^\n"
    "v0\t#x\n"
    "n2\n"
    "o2\t#*\n"
    "v0\t#x\n"
    "v2\t#y\n"
    "o16\t#-\n"
    "o5\t#^\n"
    "v2\t#y\n"
    "n2\n"
    "x2\t# initial guess\n"
    "0 1.0\t#x\n"
    "1 1.0\t#z\n"
    "r\t#2 ranges (rhs's)\n"
    "2 1.0\t#product\n"
    "1 10.0\t#sum\n"
    "b\t#3 bounds (on variables)\n"
    "3\t#x\n"
    "2 0.1\t#z\n"
    "3\t#y\n"
    "k2\t#intermediate Jacobian column lengths\n"
    "2\n"
    "3\n"
    "J0 2\t#product\n"
    "0 0\n"
    "1 0\n"
    "J1 2\t#sum\n"
    "0 1\n"
    "2 1\n"
    "G0 3\t#o\n"
    "0 0\n"
    "1 1\n"
    "2 0\n";

/// The same as JuMP's writer formats it: no comments, no suffixes, zero in the linear parts for
/// variables that are nonlinear, binary operators.
std::string jump(bool with_suffix, const std::string& nonlinear = "2 3 1") {
  std::string text = "g3 1 1 0\n 3 2 1 0 0 0\n 1 1\n 0 0\n " + nonlinear +
                     "\n 0 0 0 1\n 0 0 0 0 0\n 4 3\n 0 0\n 0 0 0 0 0\n";
  if (with_suffix) text += "S0 1 player\n2 1\n";
  return text +
         "C0\no2\nv0\nv1\nC1\nn0\n"
         "O0 0\no0\no5\nv0\nn2\no1\no2\nv0\nv2\no5\nv2\nn2\n"
         "x3\n0 1\n1 1\n2 0\nr\n2 1\n1 10\nb\n3\n2 0.1\n3\n"
         "k2\n2\n3\nJ0 2\n0 0\n1 0\nJ1 2\n0 1\n2 1\nG0 3\n0 0\n1 1\n2 0\n";
}

class ModellingSystems : public Ampl {
 protected:
  /// Lines of a .sol file after "Options": counts, duals, variables, "objno k n".
  void read_solution() {
    std::istringstream lines(get("model.sol"));
    std::string line;
    while (std::getline(lines, line) && line != "Options") {
    }
    int options = 0, skipped = 0, duals = 0, variables = 0;
    lines >> options;
    for (int i = 0; i < options; ++i) lines >> skipped;
    lines >> skipped >> duals >> skipped >> variables;
    dual_.assign(static_cast<std::size_t>(duals), 0.0);
    x_.assign(static_cast<std::size_t>(variables), 0.0);
    for (double& value : dual_) lines >> value;
    for (double& value : x_) lines >> value;
    std::string word;
    lines >> word >> skipped >> solve_result_;
    EXPECT_EQ(word, "objno");
  }
  void expect_solved() {
    read_solution();
    EXPECT_EQ(solve_result_, 0);
    const double x = std::cbrt(0.4);
    ASSERT_EQ(x_.size(), 3U);
    EXPECT_NEAR(x_[0], x, 1e-6);
    EXPECT_NEAR(x_[1], 1.0 / x, 1e-6);
    EXPECT_NEAR(x_[2], 0.5 * x, 1e-6);
    ASSERT_EQ(dual_.size(), 2U);
    EXPECT_NEAR(dual_[0], 1.0 / x, 1e-6);  // d/db of 5/4 x^2 + b / x
    EXPECT_NEAR(dual_[1], 0.0, 1e-6);
  }

  std::vector<double> x_, dual_;
  int solve_result_ = -1;
};

// Pyomo passes each option in the environment and on the command line.
TEST_F(ModellingSystems, Pyomo) {
  put("model.nl", kPyomo);
  for (const char* arguments :
       {"model.nl -AMPL max_iter=50 print_level=0", "-s model.nl max_iter=50 print_level=0"}) {
    std::filesystem::remove(path("model.sol"));
    ASSERT_EQ(run(arguments, "ipminmax_options='max_iter=50 print_level=0'"), 0) << err_;
    EXPECT_EQ(err_, "");
    expect_solved();
    EXPECT_NE(get("model.sol").find("certified local minmax"), std::string::npos);
  }
  ASSERT_EQ(run("-v"), 0);  // Pyomo looks for a version number
  EXPECT_NE(out_.find(" 0."), std::string::npos) << out_;
}

// Pyomo's new interface quotes texts, wants Ipopt's name and version, and takes each line of the
// log that begins with a number for an iteration of Ipopt's.
TEST_F(ModellingSystems, PyomosNewInterface) {
  put("model.nl", kPyomo);
  put("model.opt", "minmax_starts 2\nprint_user_options yes\n");
  for (const char* options : {"", "'option_file_name=\"model.opt\"' 'linear_solver=\"mumps\"'"}) {
    ASSERT_EQ(run(std::string("model.nl -AMPL halt_on_ampl_error=\"no\" outlev=5 ") + options), 0)
        << err_;
    expect_solved();
    std::istringstream lines(out_);
    int iterations = -1, rows = 0;
    for (std::string line; std::getline(lines, line);) {
      std::sscanf(line.c_str(), "Number of Iterations....: %d", &iterations);
      const std::size_t first = line.find_first_not_of(' ');
      if (first == std::string::npos || line[first] < '0' || line[first] > '9') continue;
      std::istringstream columns(line);
      int iteration = -1, trials = -1;
      double number = 0.0;
      std::string word, step;
      columns >> iteration >> number >> number >> number >> word >> number >> word >> number;
      columns >> step >> trials;
      EXPECT_TRUE(columns && columns.eof()) << line;
      EXPECT_EQ(iteration, rows++) << line;
    }
    EXPECT_EQ(rows, *options ? 0 : iterations + 1) << out_;
    EXPECT_NE(out_.find("Overall NLP error.......:"), std::string::npos) << out_;
    EXPECT_NE(out_.find("EXIT: Optimal Solution Found."), std::string::npos) << out_;
  }
  ASSERT_EQ(run("model.nl -AMPL print_ipopt_log=no"), 0);
  EXPECT_NE(out_.find("inf_dy"), std::string::npos) << out_;
  ASSERT_EQ(run("--version"), 0);
  int major = 0, minor = 0, patch = 0;
  EXPECT_EQ(std::sscanf(out_.c_str(), "Ipopt %d.%d.%d ", &major, &minor, &patch), 3) << out_;
}

// Pyomo asks so whether a linear solver is there.
TEST_F(ModellingSystems, TheLogNamesALinearSolverThatIsBuiltIn) {
  put("model.nl", kPyomo);
  const char* const words = "running with linear solver";
  ASSERT_EQ(run("model.nl -AMPL linear_solver=mumps"), 0) << err_;
  EXPECT_NE(out_.find(std::string(words) + " mumps"), std::string::npos) << out_;
  ASSERT_EQ(run("model.nl -AMPL"), 0) << err_;
  EXPECT_NE(out_.find(words), std::string::npos) << out_;
  ASSERT_EQ(run("model.nl -AMPL linear_solver=ma57"), 0) << err_;
  EXPECT_EQ(out_.find(words), std::string::npos) << out_;
}

TEST_F(ModellingSystems, Jump) {
  put("model.nl", jump(true));
  ASSERT_EQ(run("model.nl -AMPL print_level=0"), 0) << err_;
  expect_solved();
  // Without suffix y is minimized over, too: unbounded.
  put("model.nl", jump(false));
  ASSERT_EQ(run("model.nl -AMPL print_level=0"), 0) << err_;
  read_solution();
  EXPECT_GE(solve_result_, 300);
  EXPECT_LT(solve_result_, 400);
}

// AmplNLWriter has counted too few nonlinear variables in objectives: ASL then differentiates
// another function than it evaluates.
TEST_F(ModellingSystems, TooFewNonlinearVariablesAreRefused) {
  put("model.nl", jump(true, "2 2 1"));
  EXPECT_EQ(run("model.nl -AMPL print_level=0"), 1) << out_;
  EXPECT_NE(err_.find("variable _svar[3] is nonlinear"), std::string::npos) << err_;
  EXPECT_NE(err_.find("first 2 of 3"), std::string::npos) << err_;
  EXPECT_FALSE(std::filesystem::exists(path("model.sol")));
  put("model.nl", jump(true, "1 1 1"));
  EXPECT_EQ(run("model.nl -AMPL print_level=0"), 1) << out_;
  EXPECT_NE(err_.find("variable _svar[2] is nonlinear"), std::string::npos) << err_;
  put("model.nl", jump(true, "3 0 0"));  // more than there are do no harm
  EXPECT_EQ(run("model.nl -AMPL print_level=0"), 0) << err_;
  expect_solved();
}

}  // namespace
}  // namespace ipminmax::testing
