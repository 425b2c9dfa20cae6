// Robust constraints that several threads maximize over y: the bits of one thread.
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/autodiff_problem.hpp"
#include "core/multistart.hpp"
#include "core/proof.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"
#include "linalg/library_lock.hpp"

namespace ipminmax {
namespace {

constexpr double kNone = 2e19;

/// min (x0 - 2)^2 + (x1 - 1)^2 over rows that have their worst cases at corners and within.
struct Rows {
  static constexpr std::size_t count = 5;
  template <class T>
  T objective(std::span<const T> v) const {
    const T a = v[0] - 2.0, b = v[1] - 1.0;
    return a * a + b * b;
  }
  template <class T>
  T constraint(std::size_t j, std::span<const T> v) const {
    const double turn = 0.4 * std::numbers::pi * static_cast<double>(j);
    const T along = cos(turn) * v[0] + sin(turn) * v[1];
    return along * (1.0 + 0.3 * v[2]) + 0.5 * sin(3.0 * v[3] + v[0]) - 0.2 * v[2] * v[2];
  }
};

ModelData data_of_rows() {
  return {.players = {Player::Min, Player::Min, Player::Max, Player::Max},
          .start = {0.1, 0.2, 0.0, 0.1},
          .lower = {-kNone, -kNone, -1.0, -1.0},
          .upper = {kNone, kNone, 1.0, 1.0},
          .constraint_lower = std::vector<double>(Rows::count, -kNone),
          .constraint_upper = std::vector<double>(Rows::count, 1.5),
          .constraint_players = std::vector<Player>(Rows::count, Player::Min)};
}

SolverOptions with_threads(int threads) {
  SolverOptions options;
  options.minmax_threads = threads;
  return options;
}

void expect_same(const Result& one, const Result& several) {
  EXPECT_EQ(one.status, several.status) << several.message;
  EXPECT_EQ(one.message, several.message);
  EXPECT_EQ(one.certificate.kind, several.certificate.kind);
  EXPECT_EQ(one.iterations, several.iterations);
  EXPECT_EQ(one.counts.factorizations_full, several.counts.factorizations_full);
  EXPECT_EQ(one.counts.factorizations_inner, several.counts.factorizations_inner);
  EXPECT_EQ(one.counts.constraints, several.counts.constraints);
  EXPECT_EQ(one.over_y.maximizations, several.over_y.maximizations);
  EXPECT_EQ(one.over_y.largest_violation, several.over_y.largest_violation);
  EXPECT_TRUE(one.v == several.v);
  EXPECT_TRUE(one.lambda == several.lambda);
  EXPECT_TRUE(one.z_lower == several.z_lower);
  ASSERT_EQ(one.worst_cases.size(), several.worst_cases.size());
  for (std::size_t k = 0; k < one.worst_cases.size(); ++k) {
    EXPECT_TRUE(one.worst_cases[k].v == several.worst_cases[k].v);
    EXPECT_EQ(one.worst_cases[k].value, several.worst_cases[k].value);
  }
}

/// Counts its clones.
class Counted : public AutodiffProblem<Rows> {
 public:
  Counted() : AutodiffProblem(Rows{}, data_of_rows()) {}
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    ++clones;
    return AutodiffProblem(functions(), data()).clone();
  }
  mutable int clones = 0;
};

TEST(RobustThreads, GiveTheBitsOfOne) {
  Counted model;
  const Result one = solve(model, with_threads(1));
  EXPECT_EQ(model.clones, 0);
  EXPECT_TRUE(is_success(one.status)) << one.message;
  expect_same(one, solve(model, with_threads(3)));
  EXPECT_EQ(model.clones, 3);
}

TEST(RobustThreads, GiveTheBitsOfOneOfAnObjectiveAsARow) {
  AutodiffProblem model(Rows{}, data_of_rows());
  SolverOptions one = with_threads(1), several = with_threads(2);
  one.minmax_epigraph = several.minmax_epigraph = true;
  expect_same(solve(model, one), solve(model, several));
}

TEST(RobustThreads, GiveTheBitsOfOneOfProofs) {
  ProvableProblem model(Rows{}, data_of_rows());
  SolverOptions one = with_threads(1), several = with_threads(2);
  one.minmax_worst_case_proof = several.minmax_worst_case_proof = true;
  const Result first = solve(model, one), second = solve(model, several);
  expect_same(first, second);
  ASSERT_EQ(first.over_y.proofs.size(), second.over_y.proofs.size());
  for (std::size_t k = 0; k < first.over_y.proofs.size(); ++k)
    EXPECT_EQ(first.over_y.proofs[k].proved, second.over_y.proofs[k].proved);
}

/// Rows of another model than the class that it derives from.
class Shifted final : public AutodiffProblem<Rows> {
 public:
  Shifted() : AutodiffProblem(Rows{}, data_of_rows()) {}
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v,
                                     bool new_v, std::span<double> g) override {
    const bool defined = AutodiffProblem::constraint_rows(rows, v, new_v, g);
    for (const Index j : rows) g[static_cast<std::size_t>(j)] += 0.5;
    return defined;
  }
};

TEST(RobustThreads, DoNotCloneADerivedClassAsItsBase) {
  Shifted model;
  EXPECT_EQ(model.clone(), nullptr);
  expect_same(solve(model, with_threads(1)), solve(model, with_threads(2)));
}

/// A clone that is of another model, or whose functions throw.
class Cloned final : public AutodiffProblem<Rows> {
 public:
  enum class Into { FewerRows, Throwing };
  explicit Cloned(Into into) : AutodiffProblem(Rows{}, data_of_rows()), into_(into) {}
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    if (into_ == Into::Throwing) return std::make_unique<Throwing>();
    ModelData fewer = data_of_rows();
    fewer.constraint_lower.pop_back();
    fewer.constraint_upper.pop_back();
    fewer.constraint_players.pop_back();
    return std::make_unique<AutodiffProblem<Rows>>(Rows{}, fewer);
  }

 private:
  struct Throwing final : AutodiffProblem<Rows> {
    Throwing() : AutodiffProblem(Rows{}, data_of_rows()) {}
    bool jacobian_rows(std::span<const Index>, std::span<const double>, bool,
                       std::span<double>) override {
      throw std::domain_error("of a clone");
    }
  };
  Into into_;
};

TEST(RobustThreads, LeaveACloneOfAnotherShapeAlone) {
  Cloned model(Cloned::Into::FewerRows);
  expect_same(solve(model, with_threads(1)), solve(model, with_threads(2)));
}

TEST(RobustThreads, PassTheExceptionOfACloneOn) {
  Cloned model(Cloned::Into::Throwing);
  EXPECT_THROW(static_cast<void>(solve(model, with_threads(2))), std::domain_error);
}

TEST(RobustThreads, TellTheListenerOneAtATimeAndNothingAfterHisStop) {
  AutodiffProblem model(Rows{}, data_of_rows());
  for (const int most : {3, 40, 200}) {
    int told = 0, after = 0, at_once = 0;
    const Result result = solve(model, with_threads(3), [&](const IterationInfo&) {
      EXPECT_EQ(++at_once, 1);
      if (told >= most) ++after;
      ++told;
      --at_once;
      return told < most;
    });
    EXPECT_EQ(after, 0);
    EXPECT_EQ(told, most);
    EXPECT_FALSE(is_success(result.status) && result.over_y.finished);
  }
}

TEST(RobustThreads, EndWhenTheListenerOfOneThrows) {
  AutodiffProblem model(Rows{}, data_of_rows());
  for (const int most : {30, 60, 120}) {
    int told = 0;
    const auto listen = [&](const IterationInfo&) -> bool {
      if (++told == most) throw std::domain_error("of the listener");
      return true;
    };
    EXPECT_THROW(static_cast<void>(solve(model, with_threads(3), listen)), std::domain_error);
    EXPECT_EQ(told, most);
  }
}

TEST(RobustThreads, DoNotWaitForALockOfTheirCaller) {
  const LibraryLock lock;  // as inside a solve of Ipopt, whose model solves
  AutodiffProblem model(Rows{}, data_of_rows());
  SolverOptions one = with_threads(1), several = with_threads(2);
  one.linear_solver = several.linear_solver = LinearSolver::Mumps;
  expect_same(solve(model, one), solve(model, several));
  several.minmax_starts = 5;
  const ProblemFactory make = [&] { return model.clone(); };
  EXPECT_EQ(multistart(make, 2, several).starts, 5);
}

TEST(RobustThreads, KeepToTheNumberOfFactorizations) {
  Counted model;
  SolverOptions one = with_threads(1), several = with_threads(3);
  one.minmax_max_factorizations = several.minmax_max_factorizations = 300;
  expect_same(solve(model, one), solve(model, several));
  EXPECT_EQ(model.clones, 0);
}

}  // namespace
}  // namespace ipminmax
