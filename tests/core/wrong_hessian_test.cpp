// Five kinds of mistakes in second derivatives, in random games and minimizations of 2 to 50
// variables: how many are named, and that none is certified.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/dice.hpp>
#include <support/forwarding_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Dice;
using testing::Expression;
using testing::ForwardingProblem;
using testing::kNoBound;
using testing::Model;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// n variables, a third of them Max's; every pair coupled, or about two for each variable. Some
/// constraints of both players are active at the solution.
AutodiffProblem random_model(Dice& dice, int n, bool dense, bool game) {
  Model model;
  const int max = game ? std::max(1, n / 3) : 0;
  std::vector<Expression> v;
  std::vector<bool> is_max;
  std::vector<double> start;
  for (int i = 0; i < n; ++i) {
    is_max.push_back(i >= n - max);
    v.push_back(model.variable(is_max.back() ? Player::Max : Player::Min, "v" + std::to_string(i),
                               -5.0, 5.0));
    start.push_back(dice.between(0.2, 1.0));
  }
  Expression f = 0.0;
  const double share = dense ? 1.0 / n : 0.4;
  for (int i = 0; i < n; ++i) {
    const Expression& x = v[at(i)];
    const Expression own = dice.between(1.0, 2.0) * square(x - dice.between(0.5, 1.5)) +
                           dice.between(0.1, 0.3) * exp(0.5 * x);
    f += is_max[at(i)] ? -own : own;
    for (int j = 0; j < i; ++j) {
      if (!dense && i - j > 2) continue;
      f += share * dice.between(0.5, 1.0) * sin(x) * (v[at(j)] + 0.3 * square(v[at(j)]));
    }
  }
  model.objective(f);
  for (int i = 0; i < n - max; i += 3) {  // at least the other radius from the origin
    const Expression& next = v[at((i + 1) % (n - max))];
    model.constraint(square(v[at(i)]) + 0.5 * square(next) + 0.2 * v[at(i)] * next, 3.0, kNoBound);
  }
  for (int i = n - max; i < n; i += 2)
    model.constraint(square(v[at(i)]) + 0.3 * v[0] * v[at(i)], -kNoBound, 0.3);
  return AutodiffProblem(model, start);
}

enum class Mistake { WrongDiagonal, MissingEntry, WrongSign, WrongConstraint, SignOfConstraint };
constexpr std::size_t kKinds = 5;

/// A model with one mistake in its second derivatives.
class Mistaken final : public ForwardingProblem {
 public:
  Mistaken(Problem& right, Mistake kind, Dice& dice)
      : ForwardingProblem(right), kind_(kind), structure_(right.structure()) {
    const auto is_diagonal = [&](std::size_t k) {
      return structure_.hessian[k].row == structure_.hessian[k].col;
    };
    row_ = dice.below(static_cast<int>(structure_.constraint_players.size()));
    factor_ = dice.one_of({0.5, 1.3, 2.0});
    const bool diagonal = kind == Mistake::WrongDiagonal || kind == Mistake::WrongConstraint;
    do {
      entry_ = at(dice.below(static_cast<int>(structure_.hessian.size())));
    } while (is_diagonal(entry_) != diagonal);
    if (kind == Mistake::MissingEntry)
      structure_.hessian.erase(structure_.hessian.begin() + static_cast<std::ptrdiff_t>(entry_));
  }
  const ProblemStructure& structure() const override { return structure_; }

  bool hessian(std::span<const double> v, bool new_v, double sigma, std::span<const double> lambda,
               bool, std::span<double> values) override {
    std::vector<double> all(ForwardingProblem::structure().hessian.size());
    if (!ForwardingProblem::hessian(v, new_v, sigma, lambda, true, all)) return false;
    if (kind_ == Mistake::WrongDiagonal) all[entry_] *= factor_;
    if (kind_ == Mistake::WrongSign) all[entry_] *= -1.0;
    if (kind_ == Mistake::MissingEntry)
      all.erase(all.begin() + static_cast<std::ptrdiff_t>(entry_));
    if (kind_ == Mistake::WrongConstraint || kind_ == Mistake::SignOfConstraint) {
      std::vector<double> one(lambda.size(), 0.0), part(all.size());
      one[at(row_)] = lambda[at(row_)];
      if (!ForwardingProblem::hessian(v, false, 0.0, one, true, part)) return false;
      for (std::size_t k = 0; k < all.size(); ++k)
        all[k] += kind_ == Mistake::SignOfConstraint ? -2.0 * part[k] : (factor_ - 1.0) * part[k];
    }
    std::ranges::copy(all, values.begin());
    return true;
  }

 private:
  Mistake kind_;
  ProblemStructure structure_;
  std::size_t entry_ = 0;
  Index row_ = 0;
  double factor_ = 1.0;
};

using Matrix = std::map<std::pair<Index, Index>, double>;

Matrix second_derivatives(Problem& problem, const Result& at_point) {
  const auto& pattern = problem.structure().hessian;
  std::vector<double> values(pattern.size());
  EXPECT_TRUE(problem.hessian(at_point.v, true, 1.0, at_point.lambda, true, values));
  Matrix matrix;
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    const auto [row, col] = std::minmax(pattern[k].row, pattern[k].col);
    matrix[{row, col}] += values[k];
  }
  return matrix;
}

/// Largest difference, over the geometric mean of what the two variables have at most.
double size_of_mistake(Problem& right, Problem& wrong, const Result& point) {
  const Matrix exact = second_derivatives(right, point), other = second_derivatives(wrong, point);
  std::vector<double> most(point.v.size(), 0.0);
  for (const auto& [place, value] : exact) {
    most[at(place.first)] = std::max(most[at(place.first)], std::abs(value));
    most[at(place.second)] = std::max(most[at(place.second)], std::abs(value));
  }
  double largest = 0.0;
  for (const auto& [place, value] : exact) {
    const auto found = other.find(place);
    const double difference = std::abs(value - (found == other.end() ? 0.0 : found->second));
    if (difference == 0.0) continue;
    largest =
        std::max(largest, difference / std::sqrt(most[at(place.first)] * most[at(place.second)]));
  }
  return largest;
}

struct Tally {
  int solved = 0, named = 0, certified = 0, silent = 0, harmless = 0;
};

TEST(WrongHessian, IsNamed) {
  Dice dice(7);
  std::vector<Tally> tallies(kKinds);
  const int repetitions = static_cast<int>(testing::number_from("IPMINMAX_WRONG_HESSIANS", 2));
  for (int repetition = 0; repetition < repetitions; ++repetition) {
    for (const int n : {2, 3, 5, 10, 20, 50}) {
      for (const bool dense : {true, false}) {
        const bool game = dice.chance(0.7);
        AutodiffProblem right = random_model(dice, n, dense, game);
        const Result exact = solve(right, {});
        EXPECT_FALSE(exact.certificate.hessian_disagrees) << exact.message;
        EXPECT_EQ(exact.message.find("second derivatives in"), std::string::npos) << exact.message;
        for (std::size_t kind = 0; kind < kKinds; ++kind) {
          Mistaken wrong(right, static_cast<Mistake>(kind), dice);
          const Result result = solve(wrong, {});
          Tally& tally = tallies[kind];
          if (size_of_mistake(right, wrong, result) < 1e-2) {
            ++tally.harmless;
            continue;
          }
          ++tally.solved;
          const bool certified = result.certificate.kind == PointKind::LocalMinmax;
          const bool named = result.certificate.hessian_disagrees ||
                             result.message.find("second derivatives in") != std::string::npos;
          tally.named += named;
          tally.certified += certified;
          tally.silent += !named && !certified;
          EXPECT_TRUE(named && !certified)
              << "n = " << n << ", mistake " << kind << ", game " << game << ": " << result.message
              << ", wrong by " << size_of_mistake(right, wrong, result);
        }
      }
    }
  }
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const Tally& t = tallies[kind];
    RecordProperty("mistake_" + std::to_string(kind),
                   std::to_string(t.named) + " of " + std::to_string(t.solved));
    std::printf("mistake %zu: named %d of %d, certified %d, silent %d; too small to matter %d\n",
                kind, t.named, t.solved, t.certified, t.silent, t.harmless);
    EXPECT_GT(t.solved, 5 * repetitions) << kind;
  }
}

}  // namespace
}  // namespace ipminmax
