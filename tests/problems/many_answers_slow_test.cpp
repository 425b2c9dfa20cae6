// Games whose best answer y is not unique: the certificates are compared with closed forms of
// phi(x) = max over y of f.
//
// By hand, any number of games from any seed: IPMINMAX_RUNS=10000 IPMINMAX_SEED=7.

#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <problems/closed_form_games.hpp>
#include <support/dice.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Share {
  const char* family;
  std::uint64_t runs;
  double many;  ///< of those certified, whose answer is not unique
};
void PrintTo(const Share& share, std::ostream* out) { *out << share.family; }

class ManyAnswers : public ::testing::TestWithParam<Share> {};

TEST_P(ManyAnswers, AreCertifiedWhereXIsStrict) {
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", GetParam().runs);
  int solved = 0, certified = 0, many = 0, strict = 0, missed = 0;
  for (const ClosedFormFamily& family : closed_form_families()) {
    if (std::string(family.name) != GetParam().family) continue;
    for (std::uint64_t seed = first; seed < first + runs; ++seed) {
      const ClosedForm game = family.game(seed);
      const Result result = solve(*game.problem, {});
      if (!is_success(result.status)) continue;
      ++solved;
      const ClosedFormJudgement found = judge(game, result, seed);
      const bool is_certified = result.certificate.kind == PointKind::LocalMinmax;
      certified += is_certified ? 1 : 0;
      many += result.certificate.answer == InnerAnswer::BestNotUnique ? 1 : 0;
      strict += found.strict() ? 1 : 0;
      missed += found.strict() && !is_certified ? 1 : 0;
      EXPECT_FALSE(is_certified && found.refuted())
          << "seed " << seed << ": certified, value " << result.objective;
    }
  }
  std::printf("%s: %d solved, %d certified, %d with many answers, %d strict ones, %d missed\n",
              GetParam().family, solved, certified, many, strict, missed);
  EXPECT_GE(certified, GetParam().many > 0.0 ? 1 : 0);
  EXPECT_GE(many, GetParam().many * certified);
  EXPECT_LE(20 * missed, strict);
}

INSTANTIATE_TEST_SUITE_P(
    Of, ManyAnswers,
    ::testing::Values(Share{"bilinear", 500, 0.1}, Share{"finite_maximum", 500, 0.1},
                      Share{"matrix_game", 150, 0.1}, Share{"lagrangian", 300, 0.1},
                      Share{"wasserstein_gan", 100, 0.0}, Share{"dirac_gan", 100, 0.0},
                      Share{"ridge", 100, 0.1}, Share{"robust_lp", 200, 0.0}),
    [](const auto& family) { return std::string(family.param.family); });

}  // namespace
}  // namespace ipminmax::testing
