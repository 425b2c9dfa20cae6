// No certificate is false: each is judged by an independent check, see judge_certificate.hpp.
//
// By hand, any number of games from any seed; one seed alone is repeated with
//   IPMINMAX_RUNS=1 IPMINMAX_SEED=7 hostile_certificates_slow_test --gtest_filter='*/Trap'
// IPMINMAX_VERBOSE=1 prints those that are doubtful, too.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <hostile/judge_certificate.hpp>
#include <hostile/odd_problem.hpp>
#include <hostile/trap_game.hpp>
#include <support/dice.hpp>
#include <support/judge_truth.hpp>
#include <support/units_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

// --- The judge itself ----------------------------------------------------------------------------

/// Says of a point of a game, without multipliers, what a false certificate would be told.
CertificateVerdict verdict_at(const Model& game, std::vector<double> v,
                              std::vector<double> lambda = {}, std::vector<double> z_lower = {}) {
  AutodiffProblem model(game, v);
  Result result;
  lambda.resize(model.structure().constraint_players.size(), 0.0);
  z_lower.resize(v.size(), 0.0);
  result.lambda = std::move(lambda);
  result.z_lower = std::move(z_lower);
  result.z_upper.assign(v.size(), 0.0);
  result.v = std::move(v);
  return judge_certificate(model, SolverOptions{}, result, 1).verdict;
}

TEST(JudgeCertificate, RefutesWhatIsFalse) {
  Model hidden;  // by the multiplier of an inactive constraint
  Expression x0 = hidden.variable(Player::Min, "x0"), x1 = hidden.variable(Player::Min, "x1");
  hidden.objective(1e4 * square(x0) - 1e-3 * square(x1));
  hidden.constraint(1e6 * square(x1), -kNoBound, 1.0);
  EXPECT_EQ(verdict_at(hidden, {0.0, 0.0}), CertificateVerdict::False);

  Model inner;  // K is right, K_yy is not: y is a minimum
  Expression x = inner.variable(Player::Min, "x"), y = inner.variable(Player::Max, "y");
  inner.objective(square(x) + 3.0 * x * y + square(y));
  EXPECT_EQ(verdict_at(inner, {0.0, 0.0}), CertificateVerdict::False);

  Model outer;  // phi = -3 x^2
  x = outer.variable(Player::Min, "x"), y = outer.variable(Player::Max, "y");
  outer.objective(-4.0 * square(x) + 2.0 * x * y - square(y));
  EXPECT_EQ(verdict_at(outer, {0.0, 0.0}), CertificateVerdict::False);

  Model flat;
  x0 = flat.variable(Player::Min, "x0"), x1 = flat.variable(Player::Min, "x1");
  flat.objective(square(x0) + 0.0 * x1);
  EXPECT_EQ(verdict_at(flat, {0.0, 0.0}), CertificateVerdict::Doubtful);
}

TEST(JudgeCertificate, ConfirmsWhatIsTrue) {
  Model game;  // phi = 2 x^2
  Expression x = game.variable(Player::Min, "x"), y = game.variable(Player::Max, "y");
  game.objective(-2.0 * square(x) + 4.0 * x * y - square(y));
  EXPECT_EQ(verdict_at(game, {1e-6, 1e-6}), CertificateVerdict::Confirmed);
  EXPECT_NE(verdict_at(game, {0.5, 0.5}), CertificateVerdict::False);
}

TEST(JudgeCertificate, DoesNotRefuteWhatIsTrueInSmallUnits) {
  // Convex along y, held at its bound by 2e-6; what of that w's coupling hides is rounding.
  Model game;
  const Expression y = game.variable(Player::Max, "y", -1e-6);
  const Expression w = game.variable(Player::Max, "w");
  game.objective(square(y) + 1e6 * y * w - 1e14 * square(w));
  EXPECT_NE(verdict_at(game, {-1e-6, -5e-15}, {}, {-2e-6, 0.0}), CertificateVerdict::False);
  // Without the bound.
  Model free;
  const Expression u = free.variable(Player::Max, "u"), t = free.variable(Player::Max, "t");
  free.objective(square(u) + 1e6 * u * t - 1e14 * square(t));
  EXPECT_EQ(verdict_at(free, {0.0, 0.0}), CertificateVerdict::False);
}

TEST(JudgeCertificate, DoesNotDrawAcrossAGapOfTheFeasibleSet) {
  Model gap;  // x <= -1e-4 or x >= 1e-4
  const Expression x = gap.variable(Player::Min, "x");
  gap.objective(square(x - 1.0));
  gap.constraint(square(x), 1e-8, kNoBound);
  EXPECT_NE(verdict_at(gap, {-1e-4}, {-10001.0}), CertificateVerdict::False);
}

// f is constant along y at x*: what curvature there is to see comes from rounding of x*.
TEST(JudgeCertificate, TakesNoRoundingForCurvature) {
  for (const std::uint64_t seed : {660002336, 660802943, 900101464}) {
    const RandomGame game = tame_game(seed);
    AutodiffProblem model(game.model, game.start);
    const Result result = solve(model, game.options);
    ASSERT_EQ(result.certificate.kind, PointKind::LocalMinmax) << "seed " << seed;
    EXPECT_NE(judge_certificate(model, game.options, result, seed).verdict,
              CertificateVerdict::False)
        << "seed " << seed;
  }
}

// At x = 1e-27 beside a logarithm in a constraint, whose second derivative of 1e46 holds x.
TEST(JudgeCertificate, DoesNotRefuteBesideAPole) {
  const RandomGame game = tame_game(1100304761);
  AutodiffProblem model(game.model, game.start);
  const Result result = solve(model, game.options);
  ASSERT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_NE(judge_certificate(model, game.options, result, 1).verdict, CertificateVerdict::False);
}

TEST(JudgeCertificate, StepsAreNoLongerThanVariables) {
  // Curvature of 5e-12 makes lengths of 4e5 of a cosine with period 5.
  Model game;
  const Expression y = game.variable(Player::Max, "y"), w = game.variable(Player::Max, "w");
  game.objective(2.5e-12 * cos(1.4 * y) - square(w - 1.0));
  EXPECT_NE(verdict_at(game, {0.0, 1.0}), CertificateVerdict::False);
  EXPECT_EQ(verdict_at(game, {3.14159265358979 / 1.4, 1.0}), CertificateVerdict::False);
}

struct Kind {
  const char* name;
  RandomGame (*game)(std::uint64_t seed);
  std::uint64_t runs;
  std::uint64_t least;  ///< certificates among them
};

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

class Certificates : public ::testing::TestWithParam<Kind> {};

TEST_P(Certificates, AreTrue) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", GetParam().runs);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  const bool verbose = number_from("IPMINMAX_VERBOSE", 0) != 0;
  std::uint64_t judged = 0, untrue = 0;
  std::map<CertificateVerdict, std::uint64_t> verdicts;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    const RandomGame game = GetParam().game(seed);
    AutodiffProblem model(game.model, game.start);
    const Result result = solve(model, game.options);
    const std::string untruths = TruthJudge(model, game.options, result, false).untruths();
    if (!untruths.empty()) {
      ++untrue;
      ADD_FAILURE() << "seed " << seed << ", " << name_of(result.status) << ": " << untruths;
    }
    const Certificate& certificate = result.certificate;
    if (certificate.second_order != SecondOrder::NotTested) {
      const auto named = std::ranges::count_if(certificate.reasons, [](const auto& reason) {
        return reason.kind == CertificateReason::Kind::WeaklyActive;
      });
      EXPECT_EQ(named, certificate.weakly_active_min + certificate.weakly_active_max)
          << "seed " << seed;
      // These alone are no obstacle.
      EXPECT_FALSE(certificate.second_order == SecondOrder::Undecided &&
                   named == std::ssize(certificate.reasons))
          << "seed " << seed;
    }
    if (certificate.kind != PointKind::LocalMinmax) continue;
    ++judged;
    const CertificateJudgement found = judge_certificate(model, game.options, result, seed);
    const bool unique = std::ranges::none_of(certificate.reasons, [](const auto& reason) {
      return reason.text.starts_with("x is best but not unique");
    });
    // A strict one is what is looked for.
    if (unique || found.verdict != CertificateVerdict::Doubtful) ++verdicts[found.verdict];
    if (found.verdict == CertificateVerdict::False) {
      ADD_FAILURE() << "seed " << seed << ": certified, but " << found.why;
    } else if (found.verdict == CertificateVerdict::Doubtful && verbose) {
      std::printf("seed %llu: doubtful, %s\n", static_cast<unsigned long long>(seed),
                  found.why.c_str());
    }
  }
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(
      "%llu games, %llu certificates: %llu confirmed, %llu doubtful, %llu false; "
      "%llu results untrue\n",
      count(runs), count(judged), count(verdicts[CertificateVerdict::Confirmed]),
      count(verdicts[CertificateVerdict::Doubtful]), count(verdicts[CertificateVerdict::False]),
      count(untrue));
  if (runs >= GetParam().runs) {
    EXPECT_GE(judged, GetParam().least);
    EXPECT_LE(1000 * verdicts[CertificateVerdict::Doubtful], 22 * judged);
  }
}

/// With bounds where a problem in other units relaxes them: what is little there may be much here.
class RelaxedInUnits final : public ForwardingProblem {
 public:
  RelaxedInUnits(Problem& problem, const SolverOptions& options, const Result& ones)
      : ForwardingProblem(problem), structure_(problem.structure()) {
    const auto relax = [&](double& bound, double factor, double side) {
      const double size = std::max(1.0, std::abs(factor * bound));
      const double most = std::min(options.bound_relax_factor * size, options.constr_viol_tol);
      if (std::abs(bound) < 1e19) bound += side * most / factor;
    };
    for (std::size_t i = 0; i < structure_.variable_lower.size(); ++i) {
      relax(structure_.variable_lower[i], 1.0 / ones.v[i], -1.0);
      relax(structure_.variable_upper[i], 1.0 / ones.v[i], 1.0);
    }
    for (std::size_t j = 0; j < structure_.constraint_lower.size(); ++j) {
      if (structure_.constraint_lower[j] == structure_.constraint_upper[j]) continue;
      relax(structure_.constraint_lower[j], ones.lambda[j], -1.0);
      relax(structure_.constraint_upper[j], ones.lambda[j], 1.0);
    }
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

 private:
  ProblemStructure structure_;
};

/// An odd model's certificates, in its own units and in others of 10^-3 to 10^3, judged.
void judge_odd_model(std::uint64_t seed,
                     const std::function<void(const CertificateJudgement&)>& judged) {
  const RandomGame game = seed % 2 == 0 ? tame_game(seed) : trap_game(seed);
  AutodiffProblem model(game.model, game.start);
  OddProblem odd(model, seed), plain(model, seed, true);
  const auto judge = [&](Problem& problem, const SolverOptions& options, const Result& result) {
    return judge_certificate(problem, options, odd.plain(result), seed);
  };
  const Result result = solve(odd, game.options);
  if (result.certificate.kind == PointKind::LocalMinmax) judged(judge(plain, game.options, result));
  UnitsProblem other = UnitsProblem::random(odd, 3, seed);
  Result in_units = solve(other, game.options);
  if (in_units.certificate.kind != PointKind::LocalMinmax) return;
  CertificateJudgement found = judge(plain, game.options, other.original(in_units));
  // The certificate speaks of the relaxed bounds, and names those that matter.
  const auto is_relaxed = [](const CertificateReason& reason) {
    return reason.kind == CertificateReason::Kind::Relaxed;
  };
  if (found.verdict == CertificateVerdict::False &&
      std::ranges::any_of(in_units.certificate.reasons, is_relaxed)) {
    Result ones = in_units;
    for (std::vector<double>* values : {&ones.v, &ones.lambda, &ones.z_lower, &ones.z_upper}) {
      std::ranges::fill(*values, 1.0);
    }
    RelaxedInUnits relaxed(plain, game.options, other.original(ones));
    SolverOptions options = game.options;
    options.bound_relax_factor = 0.0;
    found = judge(relaxed, options, other.original(in_units));
  }
  judged(found);
}

/// With jumps of W, rows that say nothing new and variables that nobody reads.
TEST(OddModels, AreCertifiedTruly) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 1000);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  std::uint64_t judged = 0, confirmed = 0;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    judge_odd_model(seed, [&](const CertificateJudgement& found) {
      ++judged;
      confirmed += found.verdict == CertificateVerdict::Confirmed ? 1U : 0U;
      EXPECT_NE(found.verdict, CertificateVerdict::False)
          << "seed " << seed << ": certified, but " << found.why;
    });
  }
  std::printf("%llu certificates, %llu confirmed\n", static_cast<unsigned long long>(judged),
              static_cast<unsigned long long>(confirmed));
  EXPECT_GE(judged, runs / 10);
  EXPECT_GE(10 * confirmed, 9 * judged);
}

// A jump of W at the solution, short of which a step with curvature from Max ends (the first and
// the last). The others are true: optima so near to a jump that values do not show them; bounds
// relaxed by ten times their size.
TEST(OnceFalse, OddModelsAreNoMore) {
  for (const std::uint64_t seed :
       {620502441, 620101533, 620402181, 620402487, 620602877, 620701893, 1020301241}) {
    judge_odd_model(seed, [&](const CertificateJudgement& found) {
      EXPECT_NE(found.verdict, CertificateVerdict::False) << "seed " << seed << ": " << found.why;
    });
  }
}

// Gradients that turn on the way to the solution, inequalities open by their gradients alone, a
// solution far from the point that was returned, weakly active bounds far from it, a solution
// beyond a nearer one of the wrong kind, entries so large in long units that rounding decides,
// curvature that is alike where the Newton step begins and as far beyond its end, a step over a
// hill, a y in which f is linear with a slope that is little beside the multipliers, an equation
// whose gradient vanishes, a saddle of a y without curvature of its own and another one of 1e-20 in
// its lengths, a y whose curvature of the wrong sign is below the rounding of the value.
TEST(OnceFalse, TrapsAreNoMore) {
  for (const std::uint64_t seed :
       {1012110, 1032517, 1034127, 1050867, 1051177, 1054030, 1058769, 7117438, 9005818, 9083497,
        9314422, 11019485, 620800524, 950421193, 1350303588, 1640002768}) {
    const RandomGame game = trap_game(seed);
    AutodiffProblem model(game.model, game.start);
    const Result result = solve(model, game.options);
    if (result.certificate.kind != PointKind::LocalMinmax) continue;
    const CertificateJudgement found = judge_certificate(model, game.options, result, seed);
    EXPECT_NE(found.verdict, CertificateVerdict::False) << "seed " << seed << ": " << found.why;
  }
}

// The model is undefined where the test goes on from the point: 1e15 away from zero.
TEST(OnceWithoutAReason, UndecidedNamesOne) {
  const RandomGame game = tame_game(640301462);
  AutodiffProblem model(game.model, game.start);
  const Certificate certificate = solve(model, game.options).certificate;
  EXPECT_NE(certificate.second_order, SecondOrder::Satisfied);
  EXPECT_TRUE(certificate.second_order != SecondOrder::Undecided || !certificate.reasons.empty());
}

// An acceptable tolerance below tol: the point that the certificate moves to has to meet it, too.
TEST(OnceFalse, ThePointMeetsTheToleranceOfItsStatus) {
  for (const std::uint64_t seed : {9702251, 9731377, 9771790, 9782052}) {
    const RandomGame game = tame_game(seed);
    AutodiffProblem model(game.model, game.start);
    const Result result = solve(model, game.options);
    EXPECT_EQ(TruthJudge(model, game.options, result, false).untruths(), "") << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Certificates,
                         ::testing::Values(Kind{"Tame", tame_game, 4000, 1000},
                                           Kind{"Trap", trap_game, 2500, 600}),
                         [](const auto& game) { return std::string(game.param.name); });

}  // namespace
}  // namespace ipminmax::testing
