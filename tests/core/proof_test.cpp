// Bounds over all of y that are proved: known maxima, traps for sampling, what cannot be proved.
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/answer.hpp"
#include "core/proof.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;
constexpr double kNone = 2e19;

/// One x, which is held at `x`, and y in a box.
template <class Functions>
ProvableProblem<Functions> over_box(Functions functions, std::vector<double> lower,
                                    std::vector<double> upper, ModelData more = {}) {
  more.players.assign(lower.size() + 1, kMax);
  more.players[0] = kMin;
  more.start.assign(lower.size() + 1, 0.0);
  for (std::size_t i = 0; i < lower.size(); ++i) more.start[i + 1] = 0.5 * (lower[i] + upper[i]);
  lower.insert(lower.begin(), -kNone);
  upper.insert(upper.begin(), kNone);
  more.lower = std::move(lower);
  more.upper = std::move(upper);
  return {std::move(functions), std::move(more)};
}

/// Seen and proved enclose the truth and each other.
void expect_proved(const WorstCaseProof& proof, double truth) {
  EXPECT_TRUE(proof.complete) << proof.message;
  EXPECT_GE(proof.proved, truth - 1e-12 * std::max(1.0, std::abs(truth))) << proof.message;
  EXPECT_LE(proof.proved, truth + 1.01 * proof.resolution + 1e-7);
  EXPECT_LE(proof.seen, truth + 1e-7);
  EXPECT_EQ(proof.left, 0);
  EXPECT_FALSE(proof.interrupted);
}

/// Six humps; largest where x1 x2 < 0: 1.0316284534898774 for the negative of the camel.
struct Camel {
  template <class T>
  T objective(std::span<const T> v) const {
    const T a = square(v[1]), b = square(v[2]);
    return -(a * (4.0 - 2.1 * a + square(a) / 3.0) + v[1] * v[2] + b * (4.0 * b - 4.0)) + v[0];
  }
};

TEST(Proof, SixHumps) {
  auto problem = over_box(Camel{}, {-3.0, -2.0}, {3.0, 2.0});
  const std::vector<double> v = {2.0, 0.1, 0.1};
  const WorstCaseProof proof = prove_worst_case(problem, v, {});
  expect_proved(proof, 3.0316284534898774);
  EXPECT_NEAR(proof.seen, 3.0316284534898774, 1e-7);
  EXPECT_LT(proof.boxes, 5000);
  EXPECT_NE(proof.message.find("proved over all y"), std::string::npos);
}

/// Cosines and a parabola that are largest at different places: one global maximum among many.
struct Rastrigin {
  static constexpr double kTop = 0.4;
  template <class T>
  T objective(std::span<const T> v) const {
    T f = 0.0;
    for (const T& y : v.subspan(1))
      f += 10.0 * (cos(2.0 * std::numbers::pi * y) - 1.0) - square(y - kTop);
    return f;
  }
};

TEST(Proof, ManyLocalMaxima) {
  for (const std::size_t n : {1U, 2U, 3U}) {
    auto problem = over_box(Rastrigin{}, std::vector<double>(n, -4.1), std::vector<double>(n, 5.2));
    const std::vector<double> v(n + 1, 0.3);
    double y = 0.0;  // g'(y) = -20 pi sin(2 pi y) - 2 (y - kTop) = 0
    for (int k = 0; k < 50; ++k) {
      constexpr double kPi = std::numbers::pi;
      y += (-20.0 * kPi * std::sin(2.0 * kPi * y) - 2.0 * (y - Rastrigin::kTop)) /
           (40.0 * kPi * kPi * std::cos(2.0 * kPi * y) + 2.0);
    }
    const double one = 10.0 * (std::cos(2.0 * std::numbers::pi * y) - 1.0) -
                       (y - Rastrigin::kTop) * (y - Rastrigin::kTop);
    const WorstCaseProof proof = prove_worst_case(problem, v, {});
    expect_proved(proof, static_cast<double>(n) * one);
    EXPECT_GT(proof.boxes, 10) << n;
  }
}

/// A disc on which a linear function is largest at its edge: nothing is inside the box's corners.
struct Disc {
  template <class T>
  T objective(std::span<const T> v) const {
    return 3.0 * v[1] + 4.0 * v[2] + v[0] * sin(v[1]);
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = square(v[1]) + square(v[2]);
  }
};

TEST(Proof, ConstraintsOfMax) {
  auto problem = over_box(
      Disc{}, {-1.0, -1.0}, {1.0, 1.0},
      {.players = {}, .start = {}, .constraint_lower = {-kNone}, .constraint_upper = {1.0}});
  const std::vector<double> v = {0.0, 0.0, 0.0};
  const WorstCaseProof proof = prove_worst_case(problem, v, {});
  expect_proved(proof, 5.0);
  EXPECT_LT(proof.boxes, 1000);  // without multipliers of the rows 17,000 touch the circle
}

TEST(Proof, ThereMayBeNoY) {
  auto problem = over_box(
      Disc{}, {-1.0, -1.0}, {1.0, 1.0},
      {.players = {}, .start = {}, .constraint_lower = {2.5}, .constraint_upper = {kNone}});
  const WorstCaseProof proof = prove_worst_case(problem, std::vector<double>{0.0, 0.0, 0.0}, {});
  EXPECT_TRUE(proof.empty) << proof.message;
  EXPECT_TRUE(proof.complete);
}

/// Max's row is y^2, and is small.
struct Square {
  template <class T>
  T objective(std::span<const T> v) const {
    return square(v[0] - 1.0) + 0.1 * v[0] * v[1];
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = 1e-6 * square(v[1]);
  }
};

TEST(Proof, NoSuccessStandsBesideAProofThatThereIsNoY) {
  for (const bool epigraph : {false, true}) {
    auto problem = over_box(Square{}, {-1.0}, {1.0},
                            {.players = {},
                             .start = {0.3, 0.2},
                             .constraint_lower = {-kNone},
                             .constraint_upper = {-8e-9},
                             .constraint_players = {Player::Max}});
    SolverOptions options;
    options.minmax_worst_case_proof = true;
    options.minmax_epigraph = epigraph;
    const Result result = solve(problem, options);
    EXPECT_FALSE(is_success(result.status)) << epigraph << ": " << result.message;
    EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax) << epigraph;
  }
}

/// A gain x whose response is good but for one narrow resonance: eight starts see none of it.
struct Resonance {
  template <class T>
  T objective(std::span<const T> v) const {
    return square(v[0] - 1.0);
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = v[0] * (0.5 + 0.1 * cos(v[1]) + 2.0 / (1.0 + 1e8 * square(v[1] - 0.7316)));
  }
};

ProvableProblem<Resonance> resonance() {
  return over_box(Resonance{}, {-3.0}, {3.0},
                  {.players = {},
                   .start = {},
                   .constraint_lower = {-kNone},
                   .constraint_upper = {1.0},
                   .constraint_players = {kMin}});
}

TEST(Proof, ANarrowPeakIsFound) {
  ProvableProblem<Resonance> problem = resonance();
  const std::vector<double> v = {1.0, 0.0};
  ProofRequest request;
  request.constraint = 0;
  const WorstCaseProof proof = prove_worst_case(problem, v, {}, request);
  expect_proved(proof, 0.5 + 0.1 * std::cos(0.7316) + 2.0);
  EXPECT_NEAR(proof.v[1], 0.7316, 1e-3);
  request.least = true;
  expect_proved(prove_worst_case(problem, v, {}, request),
                0.5 + 0.1 * std::cos(3.0) + 2.0 / (1.0 + 1e8 * std::pow(3.7316, 2.0)));
}

TEST(Proof, LimitsLeaveWhatIsProvedSoFar) {
  auto problem = over_box(Rastrigin{}, std::vector<double>(4, -4.1), std::vector<double>(4, 5.2));
  const std::vector<double> v(5, 0.3);
  ProofRequest request;
  request.most_boxes = 50;
  WorstCaseProof proof = prove_worst_case(problem, v, {}, request);
  EXPECT_FALSE(proof.complete);
  EXPECT_GT(proof.left, 0);
  EXPECT_GE(proof.proved, proof.seen);
  EXPECT_NE(proof.message.find("not proved (too many boxes)"), std::string::npos) << proof.message;

  request.most_boxes = 1'000'000;
  int calls = 0;
  MultistartObserver observer;
  observer.on_iteration = [&](Index, const IterationInfo&) { return ++calls < 3; };
  proof = prove_worst_case(problem, v, {}, request, observer);
  EXPECT_EQ(calls, 3);
  EXPECT_EQ(proof.interrupted, Status::UserStop);
  EXPECT_FALSE(proof.complete);
}

/// A formula that branches cannot be enclosed.
struct Branches {
  template <class T>
  T objective(std::span<const T> v) const {
    return v[1] < 0.25 ? v[1] : v[1] * v[1];
  }
};

TEST(Proof, BranchesAreRefused) {
  auto problem = over_box(Branches{}, {0.0}, {1.0});
  const WorstCaseProof proof = prove_worst_case(problem, std::vector<double>{0.0, 0.5}, {});
  EXPECT_FALSE(proof.complete);
  EXPECT_TRUE(std::isinf(proof.proved));
  EXPECT_NE(proof.message.find("order differs"), std::string::npos) << proof.message;
}

/// Undefined to the left of zero, largest there: an end of the domain is no end of the box.
struct Root {
  double power;
  template <class T>
  T objective(std::span<const T> v) const {
    return -v[1] - pow(v[1], power) - sqrt(v[1]);
  }
};

TEST(Proof, EndsOfWhereAFormulaIsDefined) {
  for (const double power : {0.5, 1.5, 2.5}) {
    auto problem = over_box(Root{power}, {-1.0}, {1.0});
    const WorstCaseProof proof =
        prove_worst_case(problem, std::vector<double>{0.0, 0.5}, {}, {.most_boxes = 2000});
    EXPECT_GE(proof.proved, 0.0) << power;
  }
}

TEST(Proof, BadRequestsAreNamed) {
  auto problem = over_box(Camel{}, {-3.0, -2.0}, {3.0, kNone});
  const auto error = [&](std::span<const double> v, const ProofRequest& request) -> std::string {
    try {
      static_cast<void>(prove_worst_case(problem, v, {}, request));
    } catch (const std::invalid_argument& refused) {
      return refused.what();
    }
    return "";
  };
  const std::vector<double> v = {0.0, 0.0, 0.0};
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  const WorstCaseProof uncut = prove_worst_case(problem, v, {});
  EXPECT_FALSE(uncut.complete);
  EXPECT_TRUE(has(uncut.message, "variable 2 is Max's and has not two bounds")) << uncut.message;
  EXPECT_TRUE(has(error(std::vector<double>{1.0}, {}), "1 values for 3"));
  EXPECT_TRUE(has(error(std::vector<double>{1.0, NAN, 0.0}, {}), "not finite"));
  EXPECT_TRUE(has(error(v, {.constraint = 3}), "no constraint 3"));
  EXPECT_TRUE(has(error(v, {.tolerance = 0.0}), "must be positive"));
  EXPECT_TRUE(has(error(v, {.least = true}), "no least value"));
}

/// Random trigonometric polynomials in up to three y, some with a ball: never below what a fine
/// grid sees, and within the tolerance of it where the grid's own error is.
struct Waves {
  struct Wave {
    std::vector<double> k;
    double phase, size;
  };
  std::vector<Wave> waves;
  double bend;
  template <class T>
  T objective(std::span<const T> v) const {
    T f = 0.0;
    for (const Wave& wave : waves) {
      T angle = wave.phase;
      for (std::size_t i = 0; i < wave.k.size(); ++i) angle += wave.k[i] * v[i + 1];
      f += wave.size * sin(angle);
    }
    for (const T& y : v.subspan(1)) f -= bend * square(y);
    return f;
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    if (g.empty()) return;
    g[0] = 0.0;
    for (const T& y : v.subspan(1)) g[0] += square(y);
  }
};

TEST(Proof, RandomWavesAreEnclosed) {
  std::mt19937_64 random(31415);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 60; ++trial) {
    const std::size_t n = 1 + static_cast<std::size_t>(trial) % 3;
    Waves waves{.waves = {}, .bend = 0.3 * (1.0 + unit(random))};
    for (int k = 0; k < 4; ++k) {
      Waves::Wave wave{.k = {}, .phase = 3.0 * unit(random), .size = unit(random)};
      for (std::size_t i = 0; i < n; ++i) wave.k.push_back(4.0 * unit(random));
      waves.waves.push_back(wave);
    }
    const bool ball = trial % 4 == 3;
    ModelData more{.players = {}, .start = {}};
    if (ball) {
      more.constraint_lower = {-kNone};
      more.constraint_upper = {1.0};
    }
    auto problem = over_box(waves, std::vector<double>(n, -1.0), std::vector<double>(n, 1.0), more);
    ProofRequest request;
    request.tolerance = n == 3 ? 1e-3 : 1e-5;
    const WorstCaseProof proof =
        prove_worst_case(problem, std::vector<double>(n + 1, 0.0), {}, request);
    EXPECT_TRUE(proof.complete) << trial << ": " << proof.message;
    const int points = n == 1 ? 4001 : n == 2 ? 201 : 41;
    double most = -1e300;
    std::vector<double> v(n + 1, 0.0);
    std::vector<int> index(n, 0);
    for (std::size_t i = 0; i < n;) {
      double norm = 0.0, f = 0.0;
      for (std::size_t j = 0; j < n; ++j) {
        v[j + 1] = -1.0 + 2.0 * index[j] / (points - 1);
        norm += v[j + 1] * v[j + 1];
      }
      if (!ball || norm <= 1.0) {
        ASSERT_TRUE(problem.objective(v, true, f));
        most = std::max(most, f);
      }
      for (i = 0; i < n && ++index[i] == points; ++i) index[i] = 0;
    }
    EXPECT_GE(proof.proved, most - 1e-12) << trial;
    EXPECT_LE(proof.seen, proof.proved) << trial;
    EXPECT_LE(proof.proved - most, (n == 1 ? 1e-4 : n == 2 ? 2e-2 : 0.3)) << trial;
  }
}

/// Kinks and poles where boxes meet: each box answers for its own side only.
struct Kinks {
  int kind;
  template <class T>
  T objective(std::span<const T> v) const {
    const T &a = v[1], b = square(v[2] - 0.3);
    switch (kind) {
      case 0:
        return v[0] - abs(a) - b;
      case 1:
        return v[0] - sqrt(square(a)) - b;
      case 2:
        return v[0] - 0.5 * (a + abs(a)) + a - b;  // min(a, 0)
      case 3:
        return v[0] - abs(a - v[2]) - abs(a + v[2]) - square(a * v[2]);
      case 4:
        return v[0] - pow(abs(a), 0.5) - b;
      default:
        return v[0] - abs(abs(a) - 0.5) - b;
    }
  }
};

TEST(Proof, KinksWhereBoxesMeet) {
  for (const int kind : {0, 1, 2, 3, 4, 5}) {
    auto problem = over_box(Kinks{kind}, {-1.0, -1.0}, {1.0, 1.0});
    const WorstCaseProof proof =
        prove_worst_case(problem, std::vector<double>{0.0, 0.4, 0.2}, {}, {.most_boxes = 50'000});
    EXPECT_GE(proof.proved, 0.0) << kind;
    EXPECT_TRUE(proof.complete) << kind << ": " << proof.message;
    EXPECT_LE(proof.proved, 1e-5) << kind;
  }
}

/// Unbounded inside the box, though the slope has one sign wherever it is defined.
struct Poles {
  bool tangent;
  template <class T>
  T objective(std::span<const T> v) const {
    return tangent ? tan(v[1]) : 1e-3 / v[1] - v[1];
  }
};

TEST(Proof, SlopesSayNothingAcrossAPole) {
  for (const bool tangent : {false, true}) {
    auto problem = over_box(Poles{tangent}, {tangent ? 1.0 : -1.0}, {2.0});
    const WorstCaseProof proof =
        prove_worst_case(problem, std::vector<double>{0.0, 1.9}, {}, {.most_boxes = 5000});
    EXPECT_FALSE(proof.complete) << proof.message;
    EXPECT_TRUE(std::isinf(proof.proved)) << proof.message;
  }
}

/// K ((x - .3)^2 - y^2 + 5 exp(-(50 (y - 2))^2)) + C: a narrow peak of nearly K at y = 2.
struct Units {
  double k, c;
  template <class T>
  T objective(std::span<const T> v) const {
    return k * (square(v[0] - 0.3) - square(v[1]) + 5.0 * exp(-square(50.0 * (v[1] - 2.0)))) + c;
  }
};

TEST(Proof, GapsAreMeasuredByTheRangeOfValues) {
  for (const auto& [k, c] : std::vector<std::pair<double, double>>{
           {1.0, 0.0}, {1e-6, 0.0}, {1.0, 1e6}, {1e-6, 1e3}, {1e6, 0.0}, {1e-12, 0.0}}) {
    auto problem = over_box(Units{k, c}, {-3.0}, {3.0});
    const WorstCaseProof proof = prove_worst_case(problem, std::vector<double>{0.3, 0.1}, {});
    EXPECT_TRUE(proof.complete) << k << " " << c << ": " << proof.message;
    EXPECT_NEAR((proof.seen - c) / k, 1.00032, 1e-3) << k << " " << c;
    EXPECT_GE(proof.proved, proof.seen);
    EXPECT_LE(proof.proved - proof.seen, 2e-5 * k + 1e-12 * c) << k << " " << c;
  }
}

/// No y meets y^2 <= -1e-5, though one does to the tolerance of a solve.
struct Missed {
  template <class T>
  T objective(std::span<const T> v) const {
    return v[0] - square(v[1] - 0.4);
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = square(v[1]);
  }
};

TEST(Proof, YMeetsItsConstraintsToRounding) {
  const auto proof_with = [](double upper) {
    auto problem = over_box(
        Missed{}, {-1.0}, {1.0},
        {.players = {}, .start = {}, .constraint_lower = {-kNone}, .constraint_upper = {upper}});
    return prove_worst_case(problem, std::vector<double>{0.0, 0.2}, {});
  };
  for (const double upper : {-1e-5, -1e-9, -1e-14}) {
    const WorstCaseProof none = proof_with(upper);
    EXPECT_TRUE(none.empty) << none.message;
    EXPECT_TRUE(none.v.empty());
  }
  const WorstCaseProof some = proof_with(0.01);  // y in [-.1, .1]
  EXPECT_TRUE(some.complete) << some.message;
  EXPECT_NEAR(some.seen, -0.09, 1e-9);
  EXPECT_LE(some.v[1] * some.v[1], 0.01 + 1e-16);
}

/// Boxes are answered by another function.
class WrongOverBoxes final : public AutodiffProblem<Missed>, public BoxFunctions {
 public:
  WrongOverBoxes(double f, double g)
      : AutodiffProblem(Missed{}, {.players = {kMin, kMax},
                                   .start = {0.0, 0.2},
                                   .lower = {-1.0, -1.0},
                                   .upper = {1.0, 1.0},
                                   .constraint_lower = {-kNone},
                                   .constraint_upper = {0.5}}),
        f_(f),
        g_(g) {}
  [[nodiscard]] const BoxFunctions* over_boxes() const override { return this; }
  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    return functions().objective<IntervalJet>(v) * IntervalJet(f_);
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    functions().constraints<IntervalJet>(v, g);
    g[0] *= IntervalJet(g_);
  }

 private:
  double f_, g_;
};

TEST(Proof, FunctionsThatAnswerBoxesWronglyAreRefusedByName) {
  const auto proof_of = [](double f, double g) {
    WrongOverBoxes problem(f, g);
    return prove_worst_case(problem, std::vector<double>{0.0, 0.2}, {});
  };
  EXPECT_TRUE(proof_of(1.0, 1.0).complete);
  for (const auto& [f, g, name] : std::vector<std::tuple<double, double, const char*>>{
           {0.0, 1.0, "its value"}, {1.0, 1e3, "constraint 0"}, {2.0, 1.0, "its value"}}) {
    const WorstCaseProof refused = proof_of(f, g);
    EXPECT_FALSE(refused.complete);
    EXPECT_FALSE(refused.empty);
    EXPECT_TRUE(std::isinf(refused.proved));
    EXPECT_NE(refused.message.find(name), std::string::npos) << refused.message;
    EXPECT_NE(refused.message.find("over boxes"), std::string::npos) << refused.message;
  }
}

/// Undefined over every box.
struct Undefined {
  template <class T>
  T objective(std::span<const T> v) const {
    return sqrt(-1.0 - square(v[1])) - v[2] + v[0];
  }
};

TEST(Proof, NoBoundAtAPointEndsIt) {
  auto problem = over_box(Undefined{}, {-1.0, -1.0}, {1.0, 1.0});
  const WorstCaseProof proof = prove_worst_case(problem, std::vector<double>{0.0, 0.2, 0.1}, {});
  EXPECT_FALSE(proof.complete);
  EXPECT_LT(proof.boxes, 100);
  EXPECT_NE(proof.message.find("not finite"), std::string::npos) << proof.message;
}

/// Boxes are cut in the same order by any number of threads.
TEST(Proof, ThreadsFindTheSame) {
  auto waves = over_box(Camel{}, {-3.0, -2.0}, {3.0, 2.0});
  const std::vector<double> v = {2.0, 0.1, 0.1};
  SolverOptions options;
  const WorstCaseProof one = prove_worst_case(waves, v, options);
  EXPECT_TRUE(one.complete) << one.message;
  EXPECT_GT(one.boxes, 100);
  for (const int threads : {2, 3, 7}) {
    options.minmax_threads = threads;
    const WorstCaseProof more = prove_worst_case(waves, v, options);
    EXPECT_EQ(more.boxes, one.boxes);
    EXPECT_EQ(more.proved, one.proved);
    EXPECT_EQ(more.seen, one.seen);
    EXPECT_EQ(more.v, one.v);
  }
}

/// The design that eight starts call safe, with the proof in the solve: the peak that it finds is a
/// worst case of the next one.
TEST(ProofOfASolve, DesignsWithTheWorstCaseThatTheProofFinds) {
  ProvableProblem<Resonance> problem = resonance();
  SolverOptions options;
  options.minmax_worst_case_starts = 8;
  const Result unsafe = solve(problem, options);
  EXPECT_TRUE(is_success(unsafe.status));
  EXPECT_NEAR(unsafe.v[0], 1.0, 1e-6);
  EXPECT_TRUE(unsafe.over_y.proofs.empty());

  options = {};
  options.minmax_worst_case_proof = true;
  const Result safe = solve(problem, options);
  EXPECT_TRUE(is_success(safe.status)) << safe.message;
  EXPECT_EQ(safe.certificate.kind, PointKind::LocalMinmax);
  EXPECT_NEAR(safe.v[0], 1.0 / (2.5 + 0.1 * std::cos(0.7316)), 1e-6);
  ASSERT_EQ(safe.over_y.proofs.size(), 2U);  // of the constraint, and of f, which reads no y
  for (const WorstCaseProof& proof : safe.over_y.proofs) {
    EXPECT_TRUE(proof.complete) << proof.message;
    EXPECT_NEAR(proof.proved, proof.constraint < 0 ? safe.objective : 1.0, 1e-5);
  }
  EXPECT_NE(statements(safe)[2].find("proved over all y"), std::string::npos)
      << statements(safe)[2];
}

/// x against a peak of height 2 - x at y = -2.2137, 3e-4 wide, which one start does not see.
struct Peak {
  template <class T>
  T objective(std::span<const T> v) const {
    const T& y = v[1];
    return square(v[0]) + 0.3 * cos(y) + (2.0 - v[0]) / (1.0 + 1e7 * square(y + 2.2137));
  }
};

TEST(ProofOfASolve, TheObjectivesPeakIsAnotherStart) {
  auto problem = over_box(Peak{}, {-3.0}, {3.0});
  SolverOptions options;
  options.minmax_worst_case_starts = 1;
  const Result unsafe = solve(problem, options);
  EXPECT_NEAR(unsafe.v[0], 0.0, 1e-6);

  options.minmax_worst_case_proof = true;
  const Result safe = solve(problem, options);
  EXPECT_TRUE(is_success(safe.status)) << safe.message;
  EXPECT_NEAR(safe.v[0], 0.5, 1e-3);
  EXPECT_NEAR(safe.v[1], -2.2137, 1e-3);
  ASSERT_EQ(safe.over_y.proofs.size(), 1U);
  EXPECT_GE(safe.over_y.proofs[0].proved, safe.objective - 1e-9);

  options.minmax_epigraph = true;
  const Result branches = solve(problem, options);
  EXPECT_TRUE(is_success(branches.status)) << branches.message;
  EXPECT_NEAR(branches.objective, safe.objective, 1e-6);
  ASSERT_EQ(branches.over_y.proofs.size(), 1U);
  EXPECT_EQ(branches.over_y.proofs[0].constraint, -1);
  EXPECT_NEAR(branches.over_y.proofs[0].proved, branches.objective, 1e-5);
}

/// What is not proved is no success.
TEST(ProofOfASolve, AnIncompleteProofIsNoSuccess) {
  auto branching = over_box(Branches{}, {0.0}, {1.0});
  SolverOptions options;
  options.minmax_worst_case_proof = true;
  options.minmax_max_restarts = 0;
  const Result undecided = solve(branching, options);
  EXPECT_FALSE(is_success(undecided.status));
  EXPECT_NE(undecided.certificate.kind, PointKind::LocalMinmax);

  auto unbounded = over_box(Camel{}, {-3.0, -2.0}, {3.0, kNone});
  const Result uncut = solve(unbounded, options);
  EXPECT_FALSE(is_success(uncut.status));

  AutodiffProblem foreign(Camel{}, {.players = {kMin, kMax, kMax},
                                    .start = {0.0, 0.0, 0.0},
                                    .lower = {-1.0, -1.0, -1.0},
                                    .upper = {1.0, 1.0, 1.0}});
  const Result refused = solve(foreign, options);
  EXPECT_EQ(refused.status, Status::InvalidOption);
  EXPECT_NE(refused.message.find("minmax_worst_case_proof"), std::string::npos);

  auto dear = over_box(Rastrigin{}, std::vector<double>(5, -4.1), std::vector<double>(5, 5.2));
  int words = 0;
  const Result stopped = solve(dear, options, [&](const IterationInfo& info) {
    words += info.over_y && info.error.total == 0.0 ? 1 : 0;
    return words < 3;
  });
  EXPECT_EQ(stopped.status, Status::UserStop) << stopped.message;
  EXPECT_NE(stopped.certificate.kind, PointKind::LocalMinmax);
}

/// x + y + sin(x y) <= 1/2 for every y in [0, 1] holds for no x >= 0.
struct Unmeetable {
  template <class T>
  T objective(std::span<const T> v) const {
    return square(v[0]);
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = v[0] + v[1] + sin(v[0] * v[1]);
  }
};

TEST(ProofOfASolve, RowsThatCannotBeMetAreNamedAsWithoutIt) {
  ProvableProblem problem(Unmeetable{}, {.players = {kMin, kMax},
                                         .start = {0.5, 0.2},
                                         .lower = {0.0, 0.0},
                                         .upper = {1.0, 1.0},
                                         .constraint_lower = {-kNone},
                                         .constraint_upper = {0.5},
                                         .constraint_players = {kMin}});
  SolverOptions options;
  options.minmax_worst_case_proof = true;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::LocallyInfeasible);
  EXPECT_NE(result.message.find("the least worst-case violation is 0.5"), std::string::npos)
      << result.message;
}

}  // namespace
}  // namespace ipminmax
