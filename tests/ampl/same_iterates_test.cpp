// One model through the TNLP, the C interface and an .nl file: the same iterates.
#include <array>
#include <cmath>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ipminmax.h>
#include <ampl/ampl_fixture.hpp>
#include <nl_problem.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/mixed_model.hpp>
#include <support/nl_writer.hpp>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/problem_tnlp.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

/// What intermediate_callback is told of an iteration.
struct Row {
  int iteration = -1;
  double objective = 0.0, inf_pr = 0.0, inf_du = 0.0, mu = 0.0, alpha_du = 0.0, alpha_pr = 0.0;
};

/// An Ipopt model that keeps what its callback is told.
template <class Base>
class Recorded : public Base {
 public:
  using Base::Base;
  std::vector<Row> rows;
  bool intermediate_callback(Ipopt::AlgorithmMode, Ipopt::Index iter, double f, double inf_pr,
                             double inf_du, double mu, double, double, double alpha_du,
                             double alpha_pr, Ipopt::Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    rows.push_back({iter, f, inf_pr, inf_du, mu, alpha_du, alpha_pr});
    return true;
  }
};

using Rows = std::vector<Row>;

/// Logs the iterations to a file.
void solve_tnlp(const SmartPtr<Ipopt::TNLP>& model, const std::string& log_file) {
  const SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
  EXPECT_EQ(application->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_TRUE(application->OpenOutputFile(log_file, Ipopt::J_ITERSUMMARY));
  EXPECT_EQ(application->OptimizeTNLP(model), Ipopt::Solve_Succeeded);
}

Rows through_tnlp(AutodiffProblem& problem, const std::string& log_file) {
  const SmartPtr<Recorded<ProblemTnlp>> model = new Recorded<ProblemTnlp>(problem);
  std::array<std::vector<Ipopt::Index>, 2> of_max;
  const ProblemStructure& s = problem.structure();
  const std::array<const std::vector<Player>*, 2> players{&s.variable_players,
                                                          &s.constraint_players};
  for (std::size_t kind = 0; kind < 2; ++kind) {
    for (std::size_t i = 0; i < players[kind]->size(); ++i) {
      if ((*players[kind])[i] == Player::Max) of_max[kind].push_back(static_cast<int>(i));
    }
  }
  solve_tnlp(new SplitTNLP(GetRawPtr(model), of_max[0], of_max[1]), log_file);
  return model->rows;
}

Rows through_nl(const std::string& file, const std::string& log_file) {
  const SmartPtr<Recorded<NlProblem>> model = new Recorded<NlProblem>(file, -1);
  solve_tnlp(GetRawPtr(model), log_file);
  return model->rows;
}

/// The C callbacks' user data.
struct CModel {
  AutodiffProblem& problem;
  std::vector<Row> rows;
};
CModel& c_model(void* data) { return *static_cast<CModel*>(data); }
template <class Value>
std::span<Value> span_of(Value* values, int count) {
  return {values, static_cast<std::size_t>(count)};
}
void write_structure(const std::vector<Triplet>& entries, int* row, int* col) {
  for (std::size_t k = 0; k < entries.size(); ++k) {
    row[k] = static_cast<int>(entries[k].row);
    col[k] = static_cast<int>(entries[k].col);
  }
}
int eval_f(int n, double* x, int new_x, double* f, void* data) {
  return c_model(data).problem.objective(span_of(x, n), new_x != 0, *f) ? 1 : 0;
}
int eval_grad_f(int n, double* x, int new_x, double* grad, void* data) {
  return c_model(data).problem.gradient(span_of(x, n), new_x != 0, span_of(grad, n)) ? 1 : 0;
}
int eval_g(int n, double* x, int new_x, int m, double* g, void* data) {
  return c_model(data).problem.constraints(span_of(x, n), new_x != 0, span_of(g, m)) ? 1 : 0;
}
int eval_jac_g(int n, double* x, int new_x, int, int entries, int* row, int* col, double* values,
               void* data) {
  AutodiffProblem& problem = c_model(data).problem;
  if (values == nullptr) return write_structure(problem.structure().jacobian, row, col), 1;
  return problem.jacobian(span_of(x, n), new_x != 0, span_of(values, entries)) ? 1 : 0;
}
int eval_h(int n, double* x, int new_x, double sigma, int m, double* lambda, int new_lambda,
           int entries, int* row, int* col, double* values, void* data) {
  AutodiffProblem& problem = c_model(data).problem;
  if (values == nullptr) return write_structure(problem.structure().hessian, row, col), 1;
  return problem.hessian(span_of(x, n), new_x != 0, sigma, span_of(lambda, m), new_lambda != 0,
                         span_of(values, entries))
             ? 1
             : 0;
}
int intermediate(int, int iteration, double f, double inf_pr, double inf_du, double mu, double,
                 double, double alpha_du, double alpha_pr, int, void* data) {
  c_model(data).rows.push_back({iteration, f, inf_pr, inf_du, mu, alpha_du, alpha_pr});
  return 1;
}

Rows through_c(AutodiffProblem& problem, std::vector<double> x) {
  const ProblemStructure& s = problem.structure();
  const auto players = [](const std::vector<Player>& from) {
    std::vector<int> to;
    for (const Player player : from) to.push_back(player == Player::Max ? 1 : 0);
    return to;
  };
  IpminmaxProblem c = IpminmaxCreate(
      static_cast<int>(x.size()), s.variable_lower.data(), s.variable_upper.data(),
      static_cast<int>(s.constraint_lower.size()), s.constraint_lower.data(),
      s.constraint_upper.data(), static_cast<int>(s.jacobian.size()),
      static_cast<int>(s.hessian.size()), IPMINMAX_C_STYLE, eval_f, eval_g, eval_grad_f, eval_jac_g,
      eval_h, players(s.variable_players).data(), players(s.constraint_players).data());
  EXPECT_NE(c, nullptr) << IpminmaxMessage(nullptr);
  CModel model{problem, {}};
  EXPECT_EQ(IpminmaxAddIntOption(c, "print_level", 0), 1);
  EXPECT_EQ(IpminmaxSetIntermediateCallback(c, intermediate), 1);
  EXPECT_EQ(IpminmaxSolve(c, x.data(), nullptr, nullptr, nullptr, nullptr, nullptr, &model),
            IPMINMAX_SOLVE_SUCCEEDED);
  IpminmaxFree(c);
  return std::move(model.rows);
}

void expect_same(const Rows& rows, const Rows& expected, double tolerance) {
  ASSERT_EQ(rows.size(), expected.size());
  // Rounding of evaluations over what ill-conditioned steps make of it.
  constexpr double kFloor = 1e-5;
  const auto near = [&](double a, double b) {
    return std::abs(a - b) <= tolerance * (kFloor + std::abs(b));
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Row &a = rows[k], &b = expected[k];
    EXPECT_EQ(a.iteration, b.iteration);
    EXPECT_TRUE(near(a.objective, b.objective)) << k << ": " << a.objective << " " << b.objective;
    EXPECT_TRUE(near(a.inf_pr, b.inf_pr)) << k << ": " << a.inf_pr << " " << b.inf_pr;
    EXPECT_TRUE(near(a.inf_du, b.inf_du)) << k << ": " << a.inf_du << " " << b.inf_du;
    EXPECT_TRUE(near(a.mu, b.mu)) << k << ": " << a.mu << " " << b.mu;
    EXPECT_TRUE(near(a.alpha_du, b.alpha_du)) << k << ": " << a.alpha_du << " " << b.alpha_du;
    EXPECT_TRUE(near(a.alpha_pr, b.alpha_pr)) << k << ": " << a.alpha_pr << " " << b.alpha_pr;
  }
}

/// The words of the iterations' lines: those that begin with a number and end a row of the table.
std::vector<std::vector<std::string>> table(const std::string& log) {
  std::vector<std::vector<std::string>> lines;
  std::istringstream text(log);
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::vector<std::string> row;
    for (std::string word; words >> word;) row.push_back(word);
    constexpr std::size_t kColumns = 12;
    if (row.size() == kColumns && row[0] == std::to_string(lines.size())) lines.push_back(row);
  }
  return lines;
}

class AmplSameIterates : public Ampl {
 protected:
  void compare(const std::string& name, const Model& model, const std::vector<double>& start) {
    SCOPED_TRACE(name);
    AutodiffProblem problem(model, start);
    const Rows tnlp = through_tnlp(problem, path("tnlp.log"));
    const Rows c = through_c(problem, start);
    ASSERT_GT(tnlp.size(), 3U);
    {
      SCOPED_TRACE("C");
      expect_same(c, tnlp, 0.0);  // to the bit
    }
    for (const auto format : {NlWriter::Format::Text, NlWriter::Format::Binary}) {
      SCOPED_TRACE(format == NlWriter::Format::Text ? "text .nl" : "binary .nl");
      put("model.nl", NlWriter(model, start, format).write());
      const Rows nl = through_nl(path("model.nl"), path("nl.log"));
      expect_same(nl, tnlp, 1e-6);  // formulas are evaluated in another order
      ASSERT_EQ(run("model.nl"), 0) << err_;
      const auto executable = table(out_), in_process = table(get("nl.log"));
      EXPECT_EQ(executable, in_process);
      const auto by_tnlp = table(get("tnlp.log"));
      ASSERT_EQ(executable.size(), tnlp.size());
      ASSERT_EQ(by_tnlp.size(), tnlp.size());
      for (std::size_t k = 0; k < by_tnlp.size(); ++k) {
        for (const std::size_t column : {0U, 5U, 7U, 8U, 11U}) {  // lg(mu), shifts, trial points
          EXPECT_EQ(executable[k][column], by_tnlp[k][column]) << "iteration " << k;
        }
        EXPECT_EQ(executable[k][10].back(), by_tnlp[k][10].back()) << "kind of step " << k;
        EXPECT_NEAR(std::stod(executable[k][1]), tnlp[k].objective,
                    2e-7 * (1.0 + std::abs(tnlp[k].objective)));
      }
    }
  }
};

TEST_F(AmplSameIterates, MinmaxWithConstraints) {
  for (const char* name : {"hyperbola", "attack_ball", "bolib_tp7", "eq_coupled"}) {
    compare(name, small_problem(name).model, small_problem(name).starts.front());
  }
}

TEST_F(AmplSameIterates, Minimization) {
  for (const char* name : {"hs071", "hs100", "hs043"}) {
    compare(name, hock_schittkowski(name).model, hock_schittkowski(name).start);
  }
}

TEST_F(AmplSameIterates, FreeRowsAndFixedVariables) {
  compare("mixed", mixed_model(), kMixedStart);
}

}  // namespace
}  // namespace ipminmax::testing
