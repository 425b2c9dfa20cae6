// What every linear solver promises, run against all of them. Compiled with IPMINMAX_TEST_RANKS it
// runs against MUMPS on the ranks that the program was started with.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "linalg/make_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::chauffeur_kkt;
using test::grid_kkt;
using test::KktMatrix;
using test::MatrixBuilder;
using test::random_kkt;

struct Backend {
  std::string name;
  LinearSolver kind = LinearSolver::Auto;
  Ordering ordering = Ordering::Best;
};

void PrintTo(const Backend& backend, std::ostream* out) { *out << backend.name; }

struct Spectrum {
  Inertia inertia;
  double smallest = 0.0, largest = 0.0;  // absolute values
};

/// From dense eigenvalues; zero: within rounding of the largest one.
Spectrum spectrum(const SymmetricMatrix& matrix) {
  const Index n = matrix.dimension();
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    for (Index p = matrix.column_starts()[static_cast<std::size_t>(j)];
         p < matrix.column_starts()[static_cast<std::size_t>(j) + 1]; ++p) {
      dense(matrix.rows()[static_cast<std::size_t>(p)], j) =
          matrix.values()[static_cast<std::size_t>(p)];
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(dense, Eigen::EigenvaluesOnly);
  const Eigen::VectorXd magnitudes = eigen.eigenvalues().cwiseAbs();
  Spectrum result{{}, magnitudes.minCoeff(), magnitudes.maxCoeff()};
  for (const double value : eigen.eigenvalues()) {
    if (std::abs(value) <= 1e-14 * n * result.largest) {
      ++result.inertia.zero;
    } else {
      ++(value > 0.0 ? result.inertia.positive : result.inertia.negative);
    }
  }
  return result;
}

std::vector<double> random_vector(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> v(size);
  for (double& value : v) value = uniform(random);
  return v;
}

double largest(const std::vector<double>& v) {
  double result = 0.0;
  for (const double value : v)
    result = std::max(result, std::isnan(value) ? INFINITY : std::abs(value));
  return result;
}

class Contract : public testing::TestWithParam<Backend> {
 protected:
  [[nodiscard]] std::unique_ptr<SymmetricSolver> make() const {
    SymmetricSolverOptions options;
    options.ordering = GetParam().ordering;
    return make_symmetric_solver(GetParam().kind, options);
  }
  /// Solvers that are loaded: calling conventions of MA57, MA97, Pardiso by stand-ins, unless
  /// IPMINMAX_TEST_HSL, IPMINMAX_TEST_PARDISO, IPMINMAX_TEST_MKL name libraries; SPRAL where
  /// IPMINMAX_TEST_SPRAL names it.
  void SetUp() override {
    [[maybe_unused]] const auto use = [](LinearSolver kind, const char* variable,
                                         const char* otherwise) {
      const char* named = std::getenv(variable);
      use_solver_library(kind, named != nullptr ? named : otherwise);
    };
#ifdef IPMINMAX_MA57_STAND_IN
    if (GetParam().kind == LinearSolver::Ma57) {
      use(LinearSolver::Ma57, "IPMINMAX_TEST_HSL", IPMINMAX_MA57_STAND_IN);
    }
    if (GetParam().kind == LinearSolver::Ma97) {
      use(LinearSolver::Ma97, "IPMINMAX_TEST_HSL", IPMINMAX_MA97_STAND_IN);
    }
    if (GetParam().kind == LinearSolver::Spral) {
      use(LinearSolver::Spral, "IPMINMAX_TEST_SPRAL", "libspral.so");
    }
    if (GetParam().kind == LinearSolver::Pardiso) {
      use(LinearSolver::Pardiso, "IPMINMAX_TEST_PARDISO", IPMINMAX_PARDISO_STAND_IN);
    }
    if (GetParam().kind == LinearSolver::PardisoMkl) {
      use(LinearSolver::PardisoMkl, "IPMINMAX_TEST_MKL", IPMINMAX_PARDISO_STAND_IN);
    }
#endif
    const std::string missing = missing_solver_library(GetParam().kind);
    if (!missing.empty()) GTEST_SKIP() << missing;
  }
  [[nodiscard]] bool unpivoted() const { return GetParam().kind == LinearSolver::Ldlt; }
  /// It counts the pivots that it has moved away from zero, and does not tell which way.
  [[nodiscard]] bool moves_pivots() const {
    return GetParam().kind == LinearSolver::Pardiso || GetParam().kind == LinearSolver::PardisoMkl;
  }

  /// The same bits; on several ranks contributions are added as they arrive: the same to rounding.
  static void expect_same(const std::vector<double>& a, const std::vector<double>& b,
                          const std::string& what) {
    if (GetParam().kind != LinearSolver::MumpsMpi) {
      EXPECT_EQ(a, b) << what;
      return;
    }
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-9 * largest(a)) << what;
  }

  /// Solves A u = b, with the steps of refinement against A that a caller would make, and
  /// multiplies back: |A u - b| / (|A| |u| + |b|).
  double backward_error(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                        const std::vector<double>& b) const {
    std::vector<double> u(b.size(), 0.0), residual = b, product(b.size());
    const int refinements = unpivoted() || GetParam().kind == LinearSolver::Auto ? 6 : 1;
    for (int step = 0; step <= refinements; ++step) {
      solver.solve_in_place(residual);
      for (std::size_t i = 0; i < u.size(); ++i) u[i] += residual[i];
      matrix.multiply(u, product);
      for (std::size_t i = 0; i < u.size(); ++i) residual[i] = b[i] - product[i];
    }
    return largest(residual) / (matrix.max_norm() * largest(u) + largest(b));
  }

  /// Inertia against eigenvalues, solution against the matrix.
  void expect_correct(SymmetricSolver& solver, const KktMatrix& kkt) const {
    SCOPED_TRACE(kkt.name);
    const Spectrum expected = spectrum(kkt.matrix);
    ASSERT_EQ(expected.inertia.zero, 0) << "not a test of a regular matrix";
    const Factorization result = solver.factorize(kkt.matrix);
    ASSERT_EQ(result.status, FactorizationStatus::Ok);
    EXPECT_EQ(result.inertia, expected.inertia)
        << "negative " << result.inertia.negative << " of " << expected.inertia.negative
        << ", eigenvalues " << expected.smallest << " to " << expected.largest;
    const auto b = random_vector(static_cast<std::size_t>(kkt.matrix.dimension()), 5);
    EXPECT_LT(backward_error(solver, kkt.matrix, b), 1e-14);
  }

  void expect_correct(const KktMatrix& kkt) const {
    const auto solver = make();
    ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
    expect_correct(*solver, kkt);
  }

  /// A singular matrix: pivoting solvers find the nullity. Without pivoting the inertia is that of
  /// A + Gamma, in which each zero eigenvalue has taken a sign, or the factorization has failed.
  void expect_singular(const KktMatrix& kkt) const {
    SCOPED_TRACE(kkt.name);
    const Inertia expected = spectrum(kkt.matrix).inertia;
    ASSERT_GT(expected.zero, 0);
    const auto solver = make();
    ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
    const Factorization result = solver->factorize(kkt.matrix);
    if (moves_pivots()) {
      EXPECT_EQ(result.status, FactorizationStatus::Singular);
      EXPECT_EQ(result.inertia.zero, expected.zero);
    } else if (!unpivoted()) {
      EXPECT_EQ(result.status, FactorizationStatus::Singular);
      EXPECT_EQ(result.inertia, expected)
          << result.inertia.positive << " " << result.inertia.negative << " " << result.inertia.zero
          << " for " << expected.positive << " " << expected.negative << " " << expected.zero;
    } else if (result.status == FactorizationStatus::Ok) {
      EXPECT_EQ(result.inertia.zero, 0);
      EXPECT_GE(result.inertia.positive, expected.positive);
      EXPECT_GE(result.inertia.negative, expected.negative);
    } else {
      EXPECT_EQ(result.status, FactorizationStatus::Failed);
    }
  }

 public:
  // The promises, one function each.
  void definite();
  void indefinite();
  void random_minmax_kkt();
  void barrier_diagonals();
  void matrices_of_a_game();
  void larger_sparse_kkt();
  void singular();
  void rank_deficient_constraint_rows();
  void several_right_hand_sides();
  void refactorizes_with_other_values();
  void analyzes_another_pattern();
  void the_same_analysis_serves_another_solver();
  void products_with_the_inverse();
  void same_bits_when_run_twice();
  void not_a_number_fails();
  void solve_without_factors_gives_nan();
  void dimension_zero_and_one();
  void increases_quality_finitely_often();
  void two_solvers_alive_at_once();
  void many_solvers_one_after_the_other();
  void two_threads_with_solvers_of_their_own();
};

KktMatrix diagonal_matrix(const std::vector<double>& values) {
  const auto n = static_cast<Index>(values.size());
  MatrixBuilder builder(n);
  KktMatrix result{"diagonal", {}, {}};
  for (Index i = 0; i < n; ++i) {
    builder.add(i, i, values[static_cast<std::size_t>(i)]);
    result.signs.push_back(values[static_cast<std::size_t>(i)] < 0.0 ? -1 : 1);
  }
  result.matrix = builder.build();
  return result;
}

void Contract::definite() {
  expect_correct(diagonal_matrix({1.0, 2.0, 3.0, 1e-3}));
  expect_correct(diagonal_matrix(std::vector<double>(40, -2.0)));
  MatrixBuilder laplace(60);
  for (Index i = 0; i < 60; ++i) {
    laplace.add(i, i, 2.0);
    if (i > 0) laplace.add(i, i - 1, -1.0);
  }
  expect_correct({"laplace", laplace.build(), std::vector<std::int8_t>(60, 1)});
}

void Contract::indefinite() {
  expect_correct(diagonal_matrix({1.0, -2.0, 3.0, -1e-3}));
  MatrixBuilder swap(2);  // no diagonal pivot exists
  swap.add(1, 0, 1.0);
  expect_correct({"swap", swap.build(), {1, -1}});
  for (unsigned seed = 1; seed <= 5; ++seed) {  // any signs, unlike those promised
    expect_correct(random_kkt({{40, 0, 0, 0}, 0.3, 0.0}, seed));
  }
}

void Contract::random_minmax_kkt() {
  std::mt19937 random(3);
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::uniform_int_distribution<Index> size(1, seed <= 30 ? 6 : 20);
    test::Blocks blocks{size(random), size(random), 0, 0};
    blocks.lambda_x = std::uniform_int_distribution<Index>(0, blocks.x / 2)(random);
    blocks.lambda_y = std::uniform_int_distribution<Index>(0, blocks.y / 2)(random);
    const KktMatrix kkt = random_kkt({blocks, 0.5, 0.0}, seed);
    // A nearly singular matrix has no inertia to agree on.
    if (spectrum(kkt.matrix).smallest > 1e-5) expect_correct(kkt);
  }
}

void Contract::barrier_diagonals() {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const double decades : {3.0, 6.0, 8.0}) {
      const KktMatrix kkt = random_kkt({{10, 8, 4, 3}, 0.4, decades}, seed);
      // The dense eigenvalues that are compared with are themselves good to 1e-16 of the largest.
      const Spectrum s = spectrum(kkt.matrix);
      if (s.smallest > 1e-5 && s.smallest > 1e-13 * s.largest) expect_correct(kkt);
    }
  }
}

void Contract::matrices_of_a_game() {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double barrier : {1.0, 1e3, 1e6}) expect_correct(chauffeur_kkt(20, seed, barrier));
  }
}

void Contract::larger_sparse_kkt() {
  expect_correct(grid_kkt(14, 1));
  expect_correct(chauffeur_kkt(60, 1));
  const KktMatrix sparse = random_kkt({{150, 150, 70, 70}, 0.01, 1.0}, 8);
  if (spectrum(sparse.matrix).smallest > 1e-5) expect_correct(sparse);
}

void Contract::singular() {
  expect_singular(diagonal_matrix({1.0, 0.0, -3.0}));
  expect_singular(diagonal_matrix(std::vector<double>(30, 0.0)));
  MatrixBuilder ones(30);  // rank one
  for (Index i = 0; i < 30; ++i) {
    for (Index j = 0; j <= i; ++j) ones.add(i, j, 1.0);
  }
  expect_singular({"ones", ones.build(), std::vector<std::int8_t>(30, 1)});
}

void Contract::rank_deficient_constraint_rows() {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    expect_singular(random_kkt({{6, 5, 3, 3}, 0.6, 0.0, true}, seed));
    expect_singular(random_kkt({{20, 16, 8, 7}, 0.3, 2.0, true}, seed));
  }
}

void Contract::several_right_hand_sides() {
  const KktMatrix kkt = chauffeur_kkt(10, 2);
  const auto solver = make();
  ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  ASSERT_EQ(solver->factorize(kkt.matrix).status, FactorizationStatus::Ok);
  constexpr Index kColumns = 7;
  const auto n = static_cast<std::size_t>(kkt.matrix.dimension());
  const auto rhs = random_vector(n * kColumns, 1);
  auto together = rhs;
  solver->solve_in_place(together, kColumns);
  for (std::size_t c = 0; c < kColumns; ++c) {
    std::vector<double> alone(rhs.begin() + static_cast<std::ptrdiff_t>(c * n),
                              rhs.begin() + static_cast<std::ptrdiff_t>((c + 1) * n));
    solver->solve_in_place(alone);
    const double scale = largest(alone);
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_NEAR(together[c * n + i], alone[i], 1e-7 * scale) << c << " " << i;
    }
  }
}

void Contract::refactorizes_with_other_values() {
  const auto solver = make();
  const KktMatrix first = chauffeur_kkt(15, 1);
  ASSERT_TRUE(solver->analyze(first.matrix, first.signs).ok);
  expect_correct(*solver, first);
  for (unsigned seed = 2; seed <= 6; ++seed) {
    expect_correct(*solver, chauffeur_kkt(15, seed, 100.0 * seed));
  }
}

void Contract::analyzes_another_pattern() {
  const auto solver = make();
  for (const KktMatrix& kkt :
       {chauffeur_kkt(3, 1), grid_kkt(8, 1), diagonal_matrix({1.0, -1.0}), chauffeur_kkt(12, 1)}) {
    ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
    expect_correct(*solver, kkt);
  }
}

void Contract::the_same_analysis_serves_another_solver() {
  for (const KktMatrix& kkt :
       {chauffeur_kkt(12, 1), grid_kkt(14, 1), diagonal_matrix({1.0, -1.0})}) {
    const auto solver = make();
    const Analysis analysis = solver->analyze(kkt.matrix, kkt.signs);
    ASSERT_TRUE(analysis.ok);
    ASSERT_EQ(solver->factorize(kkt.matrix).status, FactorizationStatus::Ok);
    const auto other = solver->same_analysis(kkt.matrix, kkt.signs);
    ASSERT_NE(other, nullptr);
    EXPECT_EQ(other->factorize(kkt.matrix).trust.pivoted,
              solver->factorize(kkt.matrix).trust.pivoted);
    expect_correct(*other, kkt);
    expect_correct(*solver, kkt);  // of its own
  }
}

void Contract::products_with_the_inverse() {
  const KktMatrix kkt = chauffeur_kkt(10, 3);
  const Index n = kkt.matrix.dimension();
  const auto solver = make();
  ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  for (const Index columns : {0, 1, 5, 40}) {
    // Column k has entries in rows k, k + 7, ..., and one row twice.
    std::vector<Index> starts{0}, rows;
    std::vector<double> values;
    for (Index k = 0; k < columns; ++k) {
      for (Index i = k; i < n; i += 7 + k) rows.push_back(i);
      rows.push_back(k);
      while (values.size() < rows.size())
        values.push_back(std::sin(1.0 + 2.0 * static_cast<double>(values.size())));
      starts.push_back(static_cast<Index>(rows.size()));
    }
    const SparseColumns b{n, starts, rows, values};
    const auto size = static_cast<std::size_t>(columns);
    EXPECT_GE(solver->predict_inverse_product_flops(b), 0.0);
    ASSERT_EQ(solver->factorize(kkt.matrix).status, FactorizationStatus::Ok);
    std::vector<double> product(size * size);
    for (int pass = 0; pass < 2; ++pass) {  // leaves nothing behind
      solver->inverse_product(b, product);
      for (std::size_t k = 0; k < size; ++k) {
        std::vector<double> column(static_cast<std::size_t>(n), 0.0);
        for (Index p = starts[k]; p < starts[k + 1]; ++p) {
          column[static_cast<std::size_t>(rows[static_cast<std::size_t>(p)])] +=
              values[static_cast<std::size_t>(p)];
        }
        solver->solve_in_place(column);
        for (std::size_t i = k; i < size; ++i) {
          double expected = 0.0;
          for (Index p = starts[i]; p < starts[i + 1]; ++p) {
            expected += values[static_cast<std::size_t>(p)] *
                        column[static_cast<std::size_t>(rows[static_cast<std::size_t>(p)])];
          }
          EXPECT_NEAR(product[i + k * size], expected, 1e-6 * largest(column)) << i << " " << k;
        }
      }
    }
  }
}

void Contract::same_bits_when_run_twice() {
  for (const KktMatrix& kkt : {chauffeur_kkt(40, 1), grid_kkt(20, 1)}) {
    std::vector<FactorizationStatus> statuses;
    std::vector<std::vector<double>> solutions;
    for (int run = 0; run < 2; ++run) {
      (void)std::rand();  // orderings must not depend on its state
      const auto solver = make();
      ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
      statuses.push_back(solver->factorize(kkt.matrix).status);
      solutions.push_back(random_vector(static_cast<std::size_t>(kkt.matrix.dimension()), 1));
      solver->solve_in_place(solutions.back());
    }
    EXPECT_EQ(statuses[0], statuses[1]);
    // METIS may eliminate multipliers before their variables; rounding can then swallow Gamma.
    if (unpivoted() && statuses[0] == FactorizationStatus::Failed) continue;
    EXPECT_EQ(statuses[0], FactorizationStatus::Ok);
    expect_same(solutions[0], solutions[1], kkt.name);
  }
}

void Contract::not_a_number_fails() {
  const KktMatrix good = chauffeur_kkt(8, 1);
  const auto solver = make();
  ASSERT_TRUE(solver->analyze(good.matrix, good.signs).ok);
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    KktMatrix bad = good;
    bad.matrix.values()[bad.matrix.values().size() / 2] = value;
    EXPECT_EQ(solver->factorize(bad.matrix).status, FactorizationStatus::Failed);
    expect_correct(*solver, good);  // and is none the worse for it
  }
}

void Contract::solve_without_factors_gives_nan() {
  KktMatrix kkt = chauffeur_kkt(8, 1);
  const auto solver = make();
  ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  kkt.matrix.values()[0] = std::numeric_limits<double>::quiet_NaN();
  ASSERT_EQ(solver->factorize(kkt.matrix).status, FactorizationStatus::Failed);
  std::vector<double> rhs(static_cast<std::size_t>(kkt.matrix.dimension()), 1.0);
  solver->solve_in_place(rhs);
  EXPECT_TRUE(std::isnan(rhs[0]));
}

void Contract::dimension_zero_and_one() {
  const auto solver = make();
  const SymmetricMatrix empty(0, {});
  ASSERT_TRUE(solver->analyze(empty, {}).ok);
  const Factorization result = solver->factorize(empty);
  EXPECT_EQ(result.status, FactorizationStatus::Ok);
  EXPECT_EQ(result.inertia, Inertia{});
  solver->solve_in_place({}, 1);

  expect_correct(diagonal_matrix({-4.0}));
}

void Contract::increases_quality_finitely_often() {
  const KktMatrix kkt = chauffeur_kkt(12, 1);
  const auto solver = make();
  ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  int increases = 0;
  expect_correct(*solver, kkt);
  while (solver->increase_quality()) {
    ASSERT_LT(++increases, 50);
    expect_correct(*solver, kkt);
    // Auto: pivots of two rows come first.
    const bool still_ldlt = GetParam().kind == LinearSolver::Auto && increases == 1;
    EXPECT_NE(solver->factorize(kkt.matrix).trust.pivoted, still_ldlt);
  }
  switch (GetParam().kind) {
    case LinearSolver::Mumps:
    case LinearSolver::MumpsMpi:
    case LinearSolver::Ma57:
    case LinearSolver::Ma97:
    case LinearSolver::Spral:
      EXPECT_GT(increases, 2);
      break;  // pivot tolerance 1e-6 to 0.1, 1e-8 to 1e-4
    case LinearSolver::Auto:
      EXPECT_GE(increases, 2);
      break;
    default:
      EXPECT_EQ(increases, 0);
  }
  const auto as_new = make();
  ASSERT_TRUE(as_new->analyze(kkt.matrix, kkt.signs).ok);
  solver->reset_quality();
  EXPECT_EQ(solver->factorize(kkt.matrix).trust.pivoted,
            as_new->factorize(kkt.matrix).trust.pivoted);
  std::vector<double> solution[2];
  for (SymmetricSolver* s : {solver.get(), as_new.get()}) {
    EXPECT_EQ(s->factorize(kkt.matrix).status, FactorizationStatus::Ok);
    std::vector<double>& u = solution[s == solver.get()];
    u = random_vector(static_cast<std::size_t>(kkt.matrix.dimension()), 1);
    s->solve_in_place(u);
  }
  expect_same(solution[0], solution[1], "as if the quality had never been increased");
  int increases_again = 0;
  while (solver->increase_quality()) {
    ASSERT_LT(++increases_again, 50);
    expect_correct(*solver, kkt);
  }
  EXPECT_EQ(increases_again, increases);
}

void Contract::two_solvers_alive_at_once() {
  const KktMatrix first = chauffeur_kkt(15, 1);
  const KktMatrix second = grid_kkt(12, 1);
  const auto one = make();
  const auto other = make();
  ASSERT_TRUE(one->analyze(first.matrix, first.signs).ok);
  ASSERT_TRUE(other->analyze(second.matrix, second.signs).ok);
  for (int round = 0; round < 3; ++round) {
    expect_correct(*one, first);
    expect_correct(*other, second);
    auto b = random_vector(static_cast<std::size_t>(first.matrix.dimension()), 5);
    EXPECT_LT(backward_error(*one, first.matrix, b), 1e-14);  // still has its factors
  }
}

void Contract::many_solvers_one_after_the_other() {
  if (unpivoted()) return;  // not every ordering has pivots for this matrix
  const KktMatrix kkt = chauffeur_kkt(4, 1);
  for (int k = 0; k < 100; ++k) expect_correct(kkt);
}

void Contract::two_threads_with_solvers_of_their_own() {
  const KktMatrix kkt = chauffeur_kkt(15, 1);
  const Inertia expected = spectrum(kkt.matrix).inertia;
  const auto work = [&](std::vector<double>& solution, bool& right) {
    right = true;
    for (int run = 0; run < 10; ++run) {
      const auto solver = make();
      right = right && solver->analyze(kkt.matrix, kkt.signs).ok;
      right = right && solver->factorize(kkt.matrix).inertia == expected;
      solution = random_vector(static_cast<std::size_t>(kkt.matrix.dimension()), 1);
      solver->solve_in_place(solution);
    }
  };
  std::vector<double> solution[2];
  bool right[2] = {false, false};
  std::thread first(work, std::ref(solution[0]), std::ref(right[0]));
  std::thread second(work, std::ref(solution[1]), std::ref(right[1]));
  first.join();
  second.join();
  EXPECT_TRUE(right[0] && right[1]);
  expect_same(solution[0], solution[1], "in two threads");
}

TEST_P(Contract, IsKept) {
  struct Promise {
    const char* name;
    void (Contract::*check)();
  };
  constexpr Promise kPromises[] = {
      {"Definite", &Contract::definite},
      {"Indefinite", &Contract::indefinite},
      {"RandomMinmaxKkt", &Contract::random_minmax_kkt},
      {"BarrierDiagonals", &Contract::barrier_diagonals},
      {"ChauffeurKkt", &Contract::matrices_of_a_game},
      {"LargerSparseKkt", &Contract::larger_sparse_kkt},
      {"Singular", &Contract::singular},
      {"RankDeficientConstraintRows", &Contract::rank_deficient_constraint_rows},
      {"SeveralRightHandSides", &Contract::several_right_hand_sides},
      {"RefactorizesWithOtherValues", &Contract::refactorizes_with_other_values},
      {"AnalyzesAnotherPattern", &Contract::analyzes_another_pattern},
      {"TheSameAnalysisServesAnotherSolver", &Contract::the_same_analysis_serves_another_solver},
      {"ProductsWithTheInverse", &Contract::products_with_the_inverse},
      {"SameBitsWhenRunTwice", &Contract::same_bits_when_run_twice},
      {"NotANumberFails", &Contract::not_a_number_fails},
      {"SolveWithoutFactorsGivesNaN", &Contract::solve_without_factors_gives_nan},
      {"DimensionZeroAndOne", &Contract::dimension_zero_and_one},
      {"IncreasesQualityFinitelyOften", &Contract::increases_quality_finitely_often},
      {"TwoSolversAliveAtOnce", &Contract::two_solvers_alive_at_once},
      {"ManySolversOneAfterTheOther", &Contract::many_solvers_one_after_the_other},
      {"TwoThreadsWithSolversOfTheirOwn", &Contract::two_threads_with_solvers_of_their_own},
  };
  for (const auto& [name, check] : kPromises) {
    SCOPED_TRACE(name);
    (this->*check)();
  }
}

#ifdef IPMINMAX_TEST_RANKS
INSTANTIATE_TEST_SUITE_P(
    Ranks, Contract,
    testing::Values(Backend{"mumps_mpi", LinearSolver::MumpsMpi},
                    Backend{"mumps_mpi_pord", LinearSolver::MumpsMpi, Ordering::Pord},
                    Backend{"mumps_mpi_metis", LinearSolver::MumpsMpi, Ordering::Metis}),
    [](const auto& test) { return test.param.name; });
#else
INSTANTIATE_TEST_SUITE_P(
    Solvers, Contract,
    testing::Values(Backend{"auto", LinearSolver::Auto}, Backend{"ldlt", LinearSolver::Ldlt},
                    Backend{"ldlt_amd", LinearSolver::Ldlt, Ordering::Amd},
                    Backend{"ldlt_metis", LinearSolver::Ldlt, Ordering::Metis},
                    Backend{"lapack", LinearSolver::Lapack}, Backend{"mumps", LinearSolver::Mumps},
                    Backend{"mumps_amd", LinearSolver::Mumps, Ordering::Amd},
                    Backend{"mumps_pord", LinearSolver::Mumps, Ordering::Pord},
                    Backend{"mumps_metis", LinearSolver::Mumps, Ordering::Metis},
                    Backend{"ma57", LinearSolver::Ma57},
                    Backend{"ma57_metis", LinearSolver::Ma57, Ordering::Metis},
                    Backend{"ma97", LinearSolver::Ma97},
                    Backend{"ma97_metis", LinearSolver::Ma97, Ordering::Metis},
                    Backend{"spral", LinearSolver::Spral},
                    Backend{"spral_metis", LinearSolver::Spral, Ordering::Metis},
                    Backend{"pardiso", LinearSolver::Pardiso},
                    Backend{"pardisomkl", LinearSolver::PardisoMkl}),
    [](const auto& test) { return test.param.name; });
#endif

}  // namespace
}  // namespace ipminmax
