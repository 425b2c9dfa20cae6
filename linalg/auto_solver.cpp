#include <algorithm>
#include <cmath>
#include <new>
#include <numeric>
#include <utility>

#include "linalg/auto_solver.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/mumps_solver.hpp"
#include "linalg/numbers.hpp"
#include "linalg/ordering.hpp"

namespace ipminmax {

namespace {

// Measured on KKT matrices of chains, grids and random graphs (factorization times, one core).
// LAPACK costs at most 5 microseconds, and needs no refinement:
constexpr Index kDenseDimension = 24;
// Where pivoting is needed, LAPACK takes 0.03 ms at 100 rows, MUMPS 0.1 ms; level at 200 to 300:
constexpr Index kDensePivotingDimension = 100;
// In doubt, where a few matrices are factorized and MUMPS's start and end, 1 ms each, count:
constexpr Index kDenseDoubtDimension = 300;
// Microseconds that factorizations take, those of dense matrices of 50 to 600 rows: LAPACK per n^2
// (loading and scaling) and n^3, LDL' per flop.
constexpr double kLapackPerSquare = 5e-3, kLapackPerCube = 7e-6;
constexpr double kLdltPerFlop = 3e-4;
// LAPACK's time over LDL's up to which it pays: its inertia needs no test, its solutions no
// refinement.
constexpr double kDenseWorth = 3.0;
// Its matrix takes 8 MB then:
constexpr Index kMostDense = 1000;
// Flops per entry of L up to which LDL' is the choice. Chains (5): it is 30 to 100 times faster
// than MUMPS; grids in two dimensions, and blocks of 160 rows (200): 2.5 times; in three: 1.5 times
// at 300, with the inertia tested level at 500. With pairs of rows: grids 3 times at 100, level at
// 150; transport and optimal times take a thousand and more, MUMPS 40:
constexpr double kLdltMaxFlopsPerEntry = 400.0;
constexpr double kPairsMaxFlopsPerEntry = 150.0;

// |A u - w| for |w| = 1 and the u that factors give, Gamma u being a tenth at most: up to where
// rounding leaves the inertia. It is seen in one direction only; with pairs it is as small as with
// pivoting, or they do not suit.
constexpr double kMaxError = 0.25;
constexpr double kMaxErrorOfPairs = 1e-3;
// Of pairs, over LDL's own: Gamma, which hardly a pivot needs, and what takes its place in the
// test.
constexpr double kGammaOfPairs = 1e-5;
constexpr double kTestedGammaOfPairs = 1e-3;
// Entries of their factor over those of LDL's: rows that are eliminated early there may have to
// wait.
constexpr double kMostFillOfPairs = 10.0;
/// Binary logarithm of the factorizations that go by before what failed several times is tried
/// again.
constexpr int kLongestPause = 4;

bool is_below(double flops_per_entry, const FactorSize& size) {
  return size.flops <= flops_per_entry * static_cast<double>(size.entries);
}

bool choose_dense(Index dimension, double ldlt_flops) {
  const double n = dimension;
  const double dense = n * n * (kLapackPerSquare + kLapackPerCube * n);
  return dimension <= kMostDense && dense <= kDenseWorth * kLdltPerFlop * ldlt_flops;
}

/// Of LDL' with any ordering: no column loses entries, and the sum of squares is least where all
/// are alike.
double least_ldlt_flops(const SymmetricMatrix& matrix) {
  const double n = matrix.dimension();
  const double below = matrix.nonzeros() - n;
  return below * below / n;
}

double norm(std::span<const double> v) {
  return std::sqrt(std::inner_product(v.begin(), v.end(), v.begin(), 0.0));
}

/// Whether A u is what rounding may leave of A's entries times those of u. product: workspace.
bool vanishes(const SymmetricMatrix& matrix, std::span<const double> u, std::span<double> product) {
  constexpr double kRounding = 1e-14;
  matrix.multiply(u, product);
  const double left = norm(product);
  std::ranges::fill(product, 0.0);
  matrix.for_each_entry([&](Index i, Index j, Index p) {
    const double size = std::abs(matrix.values()[at(p)]);
    product[at(i)] += size * std::abs(u[at(j)]);
    if (i != j) product[at(j)] += size * std::abs(u[at(i)]);
  });
  return left <= kRounding * norm(product);
}

}  // namespace

AutoSolver::AutoSolver(const SymmetricSolverOptions& options) : options_(options), ldlt_(options) {}

AutoSolver::~AutoSolver() = default;

Analysis AutoSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) {
  const Index n = matrix.dimension();
  ldlt_analyzed_ = pivoting_analyzed_ = false;
  begin_at_ldlt();
  paired_ = nullptr;
  dense_ = nullptr;
  expected_ = {};
  for (const std::int8_t sign : signs) ++(sign > 0 ? expected_.positive : expected_.negative);
  make_pivoting(n);
  if (n > kDenseDimension && choose_dense(n, least_ldlt_flops(matrix))) {
    pivoting_ = std::make_unique<LapackSolver>();
  } else if (n > kDenseDimension && !signs.empty() && options_.ordering != Ordering::Pord) {
    try {
      OrderingChoice choice = choose_ordering(matrix, options_.ordering);
      if (choose_dense(n, choice.size.flops)) {
        pivoting_ = std::make_unique<LapackSolver>();
      } else if (is_below(kLdltMaxFlopsPerEntry, choice.size)) {
        const Analysis analysis = ldlt_.analyze(matrix, signs, choice);
        if (prepare_ldlt(analysis)) return analysis;
      } else if (choice.ordering == Ordering::Metis) {
        make_pivoting(n, std::move(choice.new_index));
      }
    } catch (const std::bad_alloc&) {
      return {};
    }
  }
  const Analysis analysis = pivoting_->analyze(matrix, signs);
  pivoting_analyzed_ = true;
  return analysis;
}

std::unique_ptr<SymmetricSolver> AutoSolver::same_analysis(
    const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const {
  auto other = std::make_unique<AutoSolver>(options_);
  if (pivoting_analyzed_) {
    other->pivoting_ = pivoting_->same_analysis(matrix, signs);
    if (!other->pivoting_) return nullptr;
    other->pivoting_->reset_quality();
    other->pivoting_analyzed_ = true;
  } else {
    other->make_pivoting(matrix.dimension());
  }
  other->expected_ = expected_;
  if (ldlt_analyzed_ && !other->prepare_ldlt(other->ldlt_.analyze_as(ldlt_, matrix, signs))) {
    return nullptr;
  }
  return other;
}

/// metis_order: of the matrix that it analyzes first, where known.
void AutoSolver::make_pivoting(Index dimension, std::vector<Index> metis_order) {
  if (dimension <= kDensePivotingDimension) {
    pivoting_ = std::make_unique<LapackSolver>();
  } else {
    auto mumps = std::make_unique<MumpsSolver>(options_);
    mumps->know_metis_order(std::move(metis_order));
    pivoting_ = std::move(mumps);
  }
  pivoting_->stop_when(stop_);
}

void AutoSolver::stop_when(std::function<bool()> stop) {
  stop_ = std::move(stop);
  if (pivoting_) pivoting_->stop_when(stop_);
}

bool AutoSolver::prepare_ldlt(const Analysis& analysis) {
  ldlt_analyzed_ = analysis.ok;
  ldlt_entries_ = analysis.factor_entries;
  begin_at_ldlt();
  return analysis.ok;
}

/// Where it has been analyzed.
void AutoSolver::begin_at_ldlt() {
  next_ = ldlt_analyzed_ ? Next::Ldlt : Next::Pivoting;
  factors_ = ldlt_analyzed_ ? Factors::Ldlt : Factors::Pivoting;
  pairs_ = Pairs::Unmade;
  inaccurate_pairs_ = 0;
  in_doubt_ = ldlt_in_doubt_ = false;
  ldlt_pause_.end();
  pairs_pause_.end();
}

void AutoSolver::Pause::failed() {
  if (failures_ > 0) left_ = 1 << std::min(failures_ - 1 + first_, kLongestPause);
  ++failures_;
}

/// Inverse iteration with the factors of A + Gamma: 1 / |(A + Gamma)^-1 w|, |w| = 1, bounds the
/// smallest |eigenvalue| from above, closely after two steps. When it is well above gamma, Gamma
/// has changed no eigenvalue's sign (Weyl); when A u = w still holds for the computed u, rounding
/// has not either. Otherwise smaller_gamma is worth a try, unless it is zero.
bool AutoSolver::inertia_is_certain(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                                    double gamma, double most_error, double& smaller_gamma) {
  smaller_gamma = 0.0;
  constexpr double kMargin = 10.0;  // smallest eigenvalue over gamma
  for (auto* workspace : {&direction_, &image_, &product_}) {
    workspace->resize(at(matrix.dimension()));
  }
  std::vector<double>& w = direction_;
  std::vector<double>& u = image_;
  for (std::size_t i = 0; i < u.size(); ++i) {  // any start without the matrix's symmetries
    u[i] = (i % 2 == 0 ? 1.0 : -1.0) * (1.0 + static_cast<double>(i % 7) / 16.0);
  }
  double length = norm(u);
  for (int step = 0; step < 2; ++step) {
    for (std::size_t i = 0; i < u.size(); ++i) u[i] /= length;
    w = u;
    solver.solve_in_place(u);
    length = norm(u);
    if (!(std::isfinite(length) && length > 0.0)) return false;
  }
  if (length * kMargin * gamma > 1.0) {
    // It moves eigenvalues less but costs digits.
    constexpr double kSmallest = 1e-3;
    smaller_gamma = std::max(0.5 / (kMargin * length), kSmallest * gamma);
    return false;
  }
  matrix.multiply(u, product_);
  for (std::size_t i = 0; i < u.size(); ++i) product_[i] -= w[i];
  return norm(product_) <= most_error;
}

Factorization AutoSolver::factorize_pivoting(const SymmetricMatrix& matrix) {
  factors_ = Factors::Pivoting;
  if (in_doubt_ && ldlt_analyzed_ && matrix.dimension() > kDensePivotingDimension &&
      matrix.dimension() <= kDenseDoubtDimension) {
    if (!dense_) {
      auto dense = std::make_unique<LapackSolver>();
      if (!dense->analyze(matrix, {}).ok) return {.status = FactorizationStatus::OutOfMemory};
      dense_ = std::move(dense);
    }
    return dense_->factorize(matrix);
  }
  if (!pivoting_analyzed_) {
    if (!pivoting_->analyze(matrix, {}).ok) return {.status = FactorizationStatus::OutOfMemory};
    pivoting_analyzed_ = true;
  }
  return pivoting_->factorize(matrix);
}

/// The pairs are made from the first values that ask for them.
bool AutoSolver::has_pairs(const SymmetricMatrix& matrix) {
  if (pairs_ != Pairs::Unmade) return pairs_ == Pairs::Made;
  if (!paired_) {
    paired_ =
        std::make_unique<PairedLdltSolver>(options_.ordering, kGammaOfPairs * options_.ldlt_gamma);
  }
  const Analysis analysis = paired_->analyze(matrix, {});
  if (!analysis.ok) return false;
  const bool fill_is_moderate = static_cast<double>(analysis.factor_entries) <=
                                kMostFillOfPairs * static_cast<double>(ldlt_entries_);
  if (!fill_is_moderate || !is_below(kPairsMaxFlopsPerEntry, {.entries = analysis.factor_entries,
                                                              .flops = analysis.flops})) {
    paired_ = nullptr;  // much room, too
    pairs_ = Pairs::TooExpensive;
    return false;
  }
  pairs_ = Pairs::Made;
  return true;
}

bool AutoSolver::is_enough(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                           const Factorization& result, Certainty certainty) {
  double smaller_gamma = 0.0;
  return result.status == FactorizationStatus::Ok &&
         (certainty == Certainty::Usual ||
          inertia_is_certain(solver, matrix, kTestedGammaOfPairs * options_.ldlt_gamma,
                             kMaxErrorOfPairs, smaller_gamma));
}

/// LDL' all the same where the inertia is the expected one and as certain as with pairs: then
/// solutions are as accurate. Where only these are wanted: Singular, not counted, if a vector shows
/// that. Empty: neither.
std::optional<Factorization> AutoSolver::factorize_in_doubt(const SymmetricMatrix& matrix,
                                                            Certainty certainty) {
  constexpr int kSmallerGammas = 2;
  Factorization result = ldlt_.factorize(matrix);
  for (int attempt = 0; result.status == FactorizationStatus::Ok; ++attempt) {
    double gamma = 0.0;
    if (inertia_is_certain(ldlt_, matrix, result.trust.perturbation, kMaxErrorOfPairs, gamma)) {
      if (result.inertia != expected_) break;
      factors_ = Factors::Ldlt;
      return result;
    }
    if (certainty == Certainty::Usual && vanishes(matrix, image_, product_)) {
      return Factorization{.status = FactorizationStatus::Singular, .inertia = {.zero = 1}};
    }
    if (gamma == 0.0 || attempt == kSmallerGammas) break;
    result = ldlt_.factorize_with(matrix, gamma);
  }
  return std::nullopt;
}

/// Where all pivots should have one sign single ones are as accurate as pivoting, but for Gamma.
/// Empty: the inertia is not certain.
std::optional<Factorization> AutoSolver::factorize_definite(const SymmetricMatrix& matrix,
                                                            Certainty certainty) {
  const Factorization result = ldlt_.factorize_with(matrix, kGammaOfPairs * options_.ldlt_gamma);
  if (!is_enough(ldlt_, matrix, result, certainty)) return std::nullopt;
  factors_ = Factors::Definite;
  return result;
}

/// Empty: it breaks down, or its inertia is not certain enough.
std::optional<Factorization> AutoSolver::factorize_in_pairs(const SymmetricMatrix& matrix,
                                                            Certainty certainty) {
  if (pairs_pause_.skips()) return std::nullopt;
  for (bool fresh = false; !fresh;) {
    fresh = pairs_ != Pairs::Made;
    if (!has_pairs(matrix)) break;
    if (paired_->pairs() == inaccurate_pairs_) {
      next_ = Next::Pivoting;
      break;
    }
    const Factorization result = paired_->factorize(matrix);
    const bool may_be_right = !in_doubt_ || result.inertia == expected_;
    if (may_be_right && is_enough(*paired_, matrix, result, certainty)) {
      pairs_pause_.succeeded();
      factors_ = Factors::Pairs;
      return result;
    }
    if (!fresh) pairs_ = Pairs::Unmade;  // those of other values may not suit
  }
  if (in_doubt_) pairs_pause_.failed();
  return std::nullopt;
}

Factorization AutoSolver::factorize_without_ldlt(const SymmetricMatrix& matrix,
                                                 Certainty certainty) {
  factors_ = Factors::Pivoting;
  // Not for one matrix of many whose inertia LDL' leaves uncertain: steps with pairs led
  // minimizations astray that pivoting solves.
  if (next_ == Next::Pairs) {
    if (const auto result = is_definite() ? factorize_definite(matrix, certainty)
                                          : factorize_in_pairs(matrix, certainty)) {
      return *result;
    }
  }
  if (ldlt_in_doubt_ && !is_definite()) {
    if (const auto result = factorize_in_doubt(matrix, certainty)) return *result;
  }
  return factorize_pivoting(matrix);
}

Factorization AutoSolver::factorize(const SymmetricMatrix& matrix, Certainty certainty) {
  factors_ = Factors::Pivoting;
  const bool certain = certainty == Certainty::Certain;
  const bool paused = certain && ldlt_pause_.skips();
  if (next_ >= Next::Pairs || paused) return factorize_without_ldlt(matrix, certainty);
  const Factorization result = ldlt_.factorize(matrix);
  if (result.status != FactorizationStatus::Ok) {
    if (!std::isfinite(matrix.max_norm())) return {};
    return factorize_pivoting(matrix);
  }
  factors_ = Factors::Ldlt;
  return certain ? checked(matrix, result) : result;
}

Factorization AutoSolver::make_certain(const SymmetricMatrix& matrix, const Factorization& last) {
  // Checks that led to pivoting are rare, too.
  return ldlt_pause_.skips() ? last : checked(matrix, last);
}

/// The last factorization of this matrix, where need be repeated until its inertia is certain.
Factorization AutoSolver::checked(const SymmetricMatrix& matrix, const Factorization& last) {
  constexpr int kSmallerGammas = 2;  // what Gamma hides spoils the first estimate
  if (factors_ != Factors::Ldlt) return last;
  Factorization result = last;
  for (int attempt = 0; result.status == FactorizationStatus::Ok; ++attempt) {
    double gamma = 0.0;
    if (inertia_is_certain(ldlt_, matrix, result.trust.perturbation, kMaxError, gamma)) {
      ldlt_pause_.succeeded();
      return result;
    }
    if (gamma == 0.0 || attempt == kSmallerGammas) break;
    result = ldlt_.factorize_with(matrix, gamma);
  }
  // What a vector shows needs no pivots, which take seconds where a thousand of them vanish; the
  // other eigenvalues are not counted.
  constexpr Index kManyPivots = 256;
  if (!in_doubt_ && matrix.dimension() >= kManyPivots && vanishes(matrix, image_, product_)) {
    return {.status = FactorizationStatus::Singular,
            .inertia = {.zero = 1},
            .trust = {.pivoted = false}};
  }
  ldlt_pause_.failed();
  return factorize_without_ldlt(matrix, Certainty::Certain);
}

SymmetricSolver& AutoSolver::pivoting() const { return in_doubt_ && dense_ ? *dense_ : *pivoting_; }

SymmetricSolver& AutoSolver::current() {
  switch (factors_) {
    case Factors::Ldlt:
    case Factors::Definite:
      return ldlt_;
    case Factors::Pairs:
      return *paired_;
    case Factors::None:
    case Factors::Pivoting:
      break;
  }
  return pivoting();
}

void AutoSolver::solve_in_place(std::span<double> rhs, Index columns) {
  current().solve_in_place(rhs, columns);
}

void AutoSolver::inverse_product(const SparseColumns& b, std::span<double> product) {
  current().inverse_product(b, product);
}

double AutoSolver::predict_inverse_product_flops(const SparseColumns& b) const {
  return factors_ == Factors::Ldlt ? ldlt_.predict_inverse_product_flops(b)
                                   : pivoting().predict_inverse_product_flops(b);
}

bool AutoSolver::increase_quality() {
  if (factors_ == Factors::None) return false;
  ldlt_in_doubt_ = false;
  const Factors last = std::exchange(factors_, Factors::Pivoting);
  if (last == Factors::Ldlt) {
    next_ = std::max(next_, Next::Pairs);
    return true;
  }
  if (last == Factors::Pairs) {  // maybe those of other values
    inaccurate_pairs_ = paired_->pairs();
    pairs_ = Pairs::Unmade;
    return true;
  }
  next_ = Next::Pivoting;
  return last != Factors::Pivoting || pivoting().increase_quality();
}

bool AutoSolver::begin_pivoting() {
  const bool changes = ldlt_analyzed_ && !in_doubt_;
  next_ = std::max(next_, Next::Pairs);
  if (changes) factors_ = Factors::None;
  in_doubt_ = true;
  ldlt_in_doubt_ = ldlt_analyzed_;
  return changes;
}

void AutoSolver::reset_quality() {
  begin_at_ldlt();
  pivoting_->reset_quality();
}

}  // namespace ipminmax
