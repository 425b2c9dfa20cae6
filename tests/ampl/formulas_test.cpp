// Formulas of .nl files over boxes enclose what AMPL's library computes; proofs over all of y.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <nl_formulas.hpp>
#include <nl_problem.hpp>
#include <problems/semi_infinite_programs.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/nl_writer.hpp>

#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

/// Of values that the library may round another way.
constexpr double kRounding = 1e-9;

class AmplFormulas : public Ampl {
 protected:
  static void expect_in(const ipminmax::Interval& box, double value, const std::string& what) {
    const double room = kRounding * std::max(1.0, std::abs(value));
    EXPECT_LE(box.lower(), value + room) << what;
    EXPECT_GE(box.upper(), value - room) << what;
  }

  /// Values at points of boxes around the start, and first derivatives, lie in what is known of the
  /// boxes. Returns how many values were compared.
  static int compare(NlProblem& problem, std::mt19937_64& random) {
    int n = 0, m = 0, entries = 0, ignored = 0;
    Ipopt::TNLP::IndexStyleEnum style = Ipopt::TNLP::C_STYLE;
    problem.get_nlp_info(n, m, entries, ignored, style);
    const auto size = [](int count) { return static_cast<std::size_t>(count); };
    std::vector<double> start(size(n)), x(size(n)), g(size(m)), gradient(size(n));
    problem.get_starting_point(n, true, start.data(), false, nullptr, nullptr, m, false, nullptr);
    const BoxFunctions* functions = problem.over_boxes();
    const auto directions = std::min<std::size_t>(size(n), IntervalJet::kMostDirections);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    int compared = 0;
    for (const double width : {0.0, 1e-6, 0.1}) {
      std::vector<IntervalJet> v, over(size(m));
      for (std::size_t i = 0; i < size(n); ++i) {
        const double center = start[i] + 0.1 * unit(random);
        x[i] = center + width * unit(random);
        const ipminmax::Interval box(std::min(center - width, x[i]),
                                     std::max(center + width, x[i]));
        v.push_back(i < directions ? IntervalJet(box, i, directions) : IntervalJet(box));
      }
      double f = 0.0;
      if (!problem.eval_f(n, x.data(), true, f) || !problem.eval_g(n, x.data(), false, m, g.data()))
        continue;
      const IntervalJet objective = functions->objective_over(v);
      functions->constraints_over(v, over);
      expect_in(objective.value(), f, "objective");
      for (std::size_t j = 0; j < g.size(); ++j) {
        expect_in(over[j].value(), g[j], "constraint " + std::to_string(j));
      }
      compared += 1 + m;
      if (!problem.eval_grad_f(n, x.data(), false, gradient.data())) continue;
      for (std::size_t i = 0; i < directions; ++i) {
        expect_in(objective.gradient(i), gradient[i], "gradient " + std::to_string(i));
      }
    }
    return compared;
  }

  /// A game in x = v0 >= 0 and y = v1 in [-3, 3]: min -x subject to
  /// x (0.5 + 0.1 cos y + 2 / (1 + 1e8 (y - 0.7316)^2)) <= 1 for every y, which eight starts meet
  /// at x = 1 / 0.6.
  void put_resonance() const {
    put("model.nl",
        "g3 1 1 0\n 2 1 1 0 0\n 1 0\n 0 0\n 2 0 0\n 0 0 0 1\n 0 0 0 0 0\n 2 1\n 0 0\n 0 0 0 0 0\n"
        "S0 1 player\n1 1\nS1 1 robust\n0 1\n"
        "C0\no2\nv0\no0\nn0.5\no0\no2\nn0.1\no46\nv1\no3\nn2\no0\nn1\no2\nn1e8\no5\no0\nv1\nn-"
        "0.7316\nn2\n"
        "O0 0\nn0\nx2\n0 0.1\n1 0.0\nr\n1 1\nb\n0 0 10\n0 -3 3\nk1\n1\nJ0 2\n0 0\n1 0\nG0 1\n0 "
        "-1\n");
  }
};

TEST_F(AmplFormulas, EncloseWhatTheLibraryComputes) {
  std::mt19937_64 random(27182);
  int compared = 0;
  const auto check = [&](const Model& model, const std::vector<double>& start) {
    using Format = NlWriter::Format;
    using Sense = NlWriter::Sense;
    for (const auto& [format, sense] :
         {std::pair(Format::Text, Sense::Minimize), std::pair(Format::Binary, Sense::Minimize),
          std::pair(Format::Text, Sense::MaximizeNegative)}) {
      NlProblem problem(put("model.nl", NlWriter(model, start, format, sense).write()), -1);
      compared += compare(problem, random);
    }
  };
  for (const char* name : {"paper_f1", "paper_f3", "adolphs", "dp1", "attack_ball", "bolib_tp7"}) {
    SCOPED_TRACE(name);
    check(small_problem(name).model, small_problem(name).starts.front());
  }
  for (const char* name : {"hs007", "hs012", "hs026", "hs065", "hs071", "hs100", "hs105"}) {
    SCOPED_TRACE(name);
    check(hock_schittkowski(name).model, hock_schittkowski(name).start);
  }
  // Unary operations, lists, defined variables, linear parts.
  for (const char* name : {"seed_unary", "seed_lists", "seed_defined", "seed_saddle"}) {
    SCOPED_TRACE(name);
    std::ostringstream text;
    text << std::ifstream(std::string(IPMINMAX_SOURCE_DIR "/tests/fuzz/corpus/nl/") + name + ".nl")
                .rdbuf();
    std::string formulas = text.str();
    for (const char* step : {"o13\n", "o14\n"}) {  // floor and ceil: not to be enclosed
      const std::size_t at = formulas.find(step);
      if (at != std::string::npos) formulas.replace(at, 3, "o15");
    }
    NlProblem problem(put("model.nl", formulas), -1);
    compared += compare(problem, random);
  }
  EXPECT_GT(compared, 150);
}

TEST_F(AmplFormulas, ADesignIsProvedOverAllY) {
  put_resonance();
  ASSERT_EQ(run("model.nl -s minmax_worst_case_starts=8"), 0) << err_;
  EXPECT_NE(out_.find("objective -1.66666"), std::string::npos) << out_;
  ASSERT_EQ(run("model.nl -s minmax_worst_case_proof=yes"), 0) << err_;
  EXPECT_NE(out_.find("proved over all y"), std::string::npos) << out_;
  EXPECT_NE(out_.find("objective -0.38"), std::string::npos) << out_;
}

TEST_F(AmplFormulas, ALocalMinmaxIsProvedNearThePoint) {
  const auto& known = small_problem("paper_f3");
  put("model.nl",
      NlWriter(known.model, known.starts.front(), NlWriter::Format::Text, NlWriter::Sense::Minimize)
          .write());
  ASSERT_EQ(run("model.nl -s minmax_certificate=proved"), 0) << err_;
  EXPECT_NE(out_.find(": proved: a strict local minmax"), std::string::npos) << out_;
  put_resonance();
  ASSERT_EQ(run("model.nl -s minmax_certificate=proved"), 0) << err_;
  EXPECT_NE(out_.find("not proved: "), std::string::npos) << out_;
}

TEST_F(AmplFormulas, WhatCannotBeEnclosedIsNamed) {
  put_resonance();
  std::string text = get("model.nl");
  text.replace(text.find("o46"), 3, "o13");  // floor
  put("model.nl", text);
  static_cast<void>(run("model.nl -s minmax_worst_case_proof=yes minmax_max_restarts=0"));
  EXPECT_EQ(out_.find("certified local minmax"), std::string::npos) << out_;
  EXPECT_NE(out_.find("operation o13 of the file cannot be enclosed"), std::string::npos) << out_;
}

/// Published programs as .nl files: solved by default, and their rows proved for every t.
TEST_F(AmplFormulas, SemiInfiniteProgramsAreProved) {
  int solved = 0, proved = 0;
  for (const SemiInfinite& program : semi_infinite_programs()) {
    SCOPED_TRACE(program.name);
    const Model model = model_of(program);
    const std::vector<double> start = start_of(program);
    using Format = NlWriter::Format;
    put("model.nl", NlWriter(model, start, Format::Text).write());
    Ipopt::SmartPtr<NlProblem> file = new NlProblem(path("model.nl"), -1);
    std::string rows;
    for (std::size_t j = 0; j < program.rows.size(); ++j) rows += std::to_string(j) + " ";
    file->set_players({"", "", rows});
    TnlpProblem problem(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(file)));
    ASSERT_EQ(problem.load(), "");
    SolverOptions options;
    options.minmax_worst_case_proof = true;
    options.max_wall_time = 60.0;
    const Result result = solve(problem, options);
    SemiInfiniteRows values(program);
    bool all = !result.over_y.proofs.empty();
    int boxes = 0;
    for (const WorstCaseProof& proof : result.over_y.proofs) {
      all = all && proof.complete;
      boxes += proof.boxes;
      if (proof.constraint < 0) continue;
      const double largest =
          values.largest(result.v, static_cast<std::size_t>(proof.constraint)).first;
      EXPECT_GE(proof.proved, largest - 1e-9 * std::max(1.0, std::abs(largest))) << proof.message;
    }
    std::printf("%-24s f = %.9f, %d boxes, %s\n", program.name.c_str(), result.objective, boxes,
                is_success(result.status) ? "solved and proved" : result.message.c_str());
    if (is_success(result.status)) {
      EXPECT_TRUE(all);
      ++solved;
      if (!std::isnan(program.optimum)) {
        const double size = std::max(1.0, std::abs(program.optimum));
        EXPECT_NEAR(result.objective, program.optimum, std::max(1e-5, program.tolerance) * size);
      }
    }
    proved += all ? 1 : 0;
  }
  EXPECT_GE(solved, 21);
  EXPECT_GE(proved, 21);
}

}  // namespace
}  // namespace ipminmax::testing
