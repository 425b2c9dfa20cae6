// What leaves through the third door, .nl files, is true of its own point as well: random small
// problems written as files, text and binary, and what the .sol file says of them.
//
// By hand: IPMINMAX_RUNS=5000 IPMINMAX_SEED=7 ampl_truthful_nl_slow_test

#include <cmath>
#include <string>

#include <answer.hpp>
#include <nl_problem.hpp>

#include <problems/random_game.hpp>
#include <support/dice.hpp>
#include <support/doors.hpp>
#include <support/judge_truth.hpp>
#include <support/nl_writer.hpp>

#include "adapter/ipopt/tnlp_problem.hpp"
#include "ampl_fixture.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

class TruthfulNl : public Ampl {
 protected:
  /// Whether the file's functions are those of the formulas, as far as rounding tells.
  static void expect_same_model(Problem& file, Problem& model, const std::vector<double>& v) {
    const auto near = [](double a, double b) {
      return same(a, b) || std::abs(a - b) <= 1e-9 * (1.0 + std::abs(a) + std::abs(b));
    };
    const std::size_t m = model.structure().constraint_players.size();
    double f = 0.0, file_f = 0.0;
    std::vector<double> g(m), file_g(m);
    if (!model.objective(v, true, f) || (m > 0 && !model.constraints(v, true, g))) return;
    ASSERT_TRUE(file.objective(v, true, file_f));
    EXPECT_TRUE(near(f, file_f)) << f << " " << file_f;
    if (m == 0) return;
    ASSERT_TRUE(file.constraints(v, true, file_g));
    for (std::size_t j = 0; j < m; ++j) EXPECT_TRUE(near(g[j], file_g[j]));
  }

  static void expect_same_file(const SolutionFile& file, const Result& result) {
    EXPECT_EQ(file.variables, static_cast<int>(result.v.size()));
    EXPECT_TRUE(file.primals.empty() || file.primals == result.v);
    if (is_success(result.status)) {
      EXPECT_EQ(file.primals, result.v);
    }
    if (file.duals.empty()) return;
    ASSERT_EQ(file.duals.size(), result.lambda.size());
    for (std::size_t j = 0; j < file.duals.size(); ++j) {
      EXPECT_EQ(file.duals[j], -result.lambda[j]);
    }
  }
};

TEST_F(TruthfulNl, OfRandomGames) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 300);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 200001);
  for (std::uint64_t seed = first; seed < first + runs && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomGame game = seed % 2 == 0 ? tame_game(seed) : random_game(seed);
    game.options.max_cpu_time = SolverOptions{}.max_cpu_time;
    AutodiffProblem formulas(game.model, game.start);
    const auto format = seed % 3 == 0 ? NlWriter::Format::Binary : NlWriter::Format::Text;
    const std::string file = put("game.nl", NlWriter(game.model, game.start, format).write());
    const SmartPtr<NlProblem> problem = new NlProblem(file, -1);
    const SmartPtr<MinMaxApplication> application = application_with(game.options);
    static_cast<void>(application->OptimizeTNLP(SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(problem))));
    const Result& result = application->LastResult();
    TnlpProblem model(SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(problem)));
    ASSERT_EQ(model.load(), "");
    expect_same_model(model, formulas, game.start);
    EXPECT_EQ(TruthJudge(model, game.options, result, false).untruths(), "")
        << name_of(result.status);
    if (!result.v.empty()) expect_same_file(problem->solution_file(result), result);
    EXPECT_NE(message_of(result, *problem), "");
  }
}

}  // namespace
}  // namespace ipminmax::testing
