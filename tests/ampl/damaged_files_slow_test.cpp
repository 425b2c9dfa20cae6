// Every byte of small .nl files changed to others, and every truncation: refused, or read and
// solved, by the reader in this process and by the executable, which then leaves its .sol.
//
// By hand: IPMINMAX_RUNS=1000000000 IPMINMAX_SEED=0 ampl_damaged_files_slow_test, or some from
// another seed: changes are numbered, a run takes as many as said, spread over all.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <answer.hpp>
#include <nl_problem.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/dice.hpp>
#include <support/nl_writer.hpp>

#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax::testing {
namespace {

using Format = NlWriter::Format;

std::vector<std::string> small_files() {
  std::vector<std::string> files;
  const SmallProblem& game = small_problem("eq_coupled");
  const MinimizationProblem& minimization = hock_schittkowski("hs071");
  for (const Format format : {Format::Text, Format::Binary}) {
    files.push_back(NlWriter(game.model, game.starts.front(), format).write());
    files.push_back(NlWriter(minimization.model, minimization.start, format).write());
    files.push_back(
        NlWriter(game.model, game.starts.front(), format, NlWriter::Sense::MaximizeNegative)
            .write());
  }
  return files;
}

/// The changes of some files: for each place 255 other bytes and the cut there.
class Changes {
 public:
  explicit Changes(std::vector<std::string> files) : files_(std::move(files)) {}
  [[nodiscard]] std::uint64_t count() const {
    std::uint64_t bytes = 0;
    for (const std::string& file : files_) bytes += file.size();
    return 256 * bytes;
  }
  [[nodiscard]] std::string operator[](std::uint64_t number) const {
    std::uint64_t place = number / 256;
    std::size_t file = 0;
    for (; place >= files_[file].size(); ++file) place -= files_[file].size();
    std::string text = files_[file];
    const auto added = static_cast<unsigned char>(number % 256);
    if (added == 0) return text.substr(0, place);
    text[place] = static_cast<char>(static_cast<unsigned char>(text[place]) + added);
    return text;
  }
  /// The numbers of so many, spread over all: every one where there are no more.
  template <class Visit>
  void visit(std::uint64_t runs, std::uint64_t seed, Visit visit) const {
    const std::uint64_t all = count(),
                        step = std::max<std::uint64_t>(all / std::max<std::uint64_t>(runs, 1), 1);
    Dice dice(seed);
    for (std::uint64_t first = 0; first < all; first += step) {
      const auto within = std::min(step, all - first);
      visit(first + static_cast<std::uint64_t>(dice.below(static_cast<int>(within))));
    }
  }

 private:
  std::vector<std::string> files_;
};

class AmplDamage : public Ampl {
 protected:
  const Changes changes_{small_files()};
  const std::uint64_t seed_ = number_from("IPMINMAX_SEED", 1);
};

/// Reads, solves for three iterations and writes; false when the file is refused.
bool is_solved(const std::string& file) {
  try {
    const Ipopt::SmartPtr<NlProblem> problem = new NlProblem(file, -1);
    const Ipopt::SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
    application->Options()->SetIntegerValue("max_iter", 3);
    EXPECT_EQ(application->Initialize(""), Ipopt::Solve_Succeeded);
    application->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(problem)));
    const Result& result = application->LastResult();
    SolutionFile solution = problem->solution_file(result);
    solution.message = message_of(result, *problem);
    EXPECT_NE(solution.text(), "");
    EXPECT_NE(solution.binary(), "");
    return true;
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find("Sanitizer"), std::string::npos) << text;
    EXPECT_EQ(text.find("runtime error"), std::string::npos) << text;
    EXPECT_EQ(text.find("no end after"), std::string::npos) << text;
    EXPECT_NE(text, "");
    return false;
  }
}

TEST_F(AmplDamage, OfOneByteIsReadOrRefused) {
  std::uint64_t runs = 0, solved = 0;
  changes_.visit(number_from("IPMINMAX_RUNS", 3000), seed_, [&](std::uint64_t number) {
    SCOPED_TRACE("change " + std::to_string(number));
    ++runs;
    solved += is_solved(put("damaged.nl", changes_[number]));
  });
  std::printf("%llu files, %llu of them read\n", static_cast<unsigned long long>(runs),
              static_cast<unsigned long long>(solved));
  EXPECT_GT(solved, runs / 100);
  EXPECT_LT(solved, runs / 2);
}

// Exit code 0 and a whole .sol, or 1, a message and none, also none of an earlier run.
TEST_F(AmplDamage, IsAnsweredByTheExecutable) {
  std::uint64_t runs = 0, solved = 0;
  changes_.visit(number_from("IPMINMAX_RUNS", 3000) / 20, seed_ + 1, [&](std::uint64_t number) {
    SCOPED_TRACE("change " + std::to_string(number));
    put("damaged.nl", changes_[number]);
    put("damaged.sol", "stale");
    const int code = run("damaged.nl -AMPL print_level=0 max_iter=20 max_wall_time=10");
    ++runs;
    if (code == 0) {
      ++solved;
      const std::string solution = get("damaged.sol");
      const bool binary = solution.starts_with('\6');
      EXPECT_TRUE(binary ? solution.size() > 100 : solution.find("\n\n") != std::string::npos)
          << solution;
      EXPECT_NE(solution.find("Ipminmax"), std::string::npos);
    } else {
      EXPECT_EQ(code, 1) << err_;
      EXPECT_TRUE(err_.starts_with("ipminmax: ") && err_.size() > 20) << err_;
      EXPECT_FALSE(std::filesystem::exists(path("damaged.sol")));
    }
  });
  std::printf("%llu runs of the executable, %llu solved\n", static_cast<unsigned long long>(runs),
              static_cast<unsigned long long>(solved));
  EXPECT_GT(solved, 0U);
}

}  // namespace
}  // namespace ipminmax::testing
