#include <dmumps_c.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>

#include "linalg/blas_threads.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/memory_limit.hpp"
#include "linalg/mpi_library.hpp"
#include "linalg/mumps_solver.hpp"
#include "linalg/numbers.hpp"
#include "linalg/ordering.hpp"
#include "linalg/reproducible_rand.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

namespace {

/// Of one analysis: the entries twice and some arrays of length n; measured, with room to spare.
double analysis_bytes(const SymmetricMatrix& matrix) {
  return 60.0 * matrix.nonzeros() + 300.0 * matrix.dimension();
}

static_assert(std::is_same_v<MUMPS_INT, Index>, "MUMPS must be built with 32-bit integers");

using enum mpi::Job;
// Values of INFOG(1) from the MUMPS users' guide.
constexpr int kSingular = -10;
constexpr int kOutOfMemory = -13;
constexpr int kStopped = -1000;  // ours: no more attempts
/// ICNTL(14) of the analysis, on which its estimates rest, and the least of a factorization.
constexpr Index kLeastPercent = 20;
/// Where less is needed (bytes) no limit is asked for: MUMPS calls are as short as the question.
constexpr double kWorthAsking = 16e6;
constexpr bool wants_more_workspace(int status) { return status == -8 || status == -9; }

/// Predicted operations of an ordering that has seen values, over those of one that has not, up to
/// which it is taken at once: the other one will delay pivots where the diagonal has zeros.
constexpr double kWorthOfValues = 1.5;

/// Above so many times the expected operations of a factorization, because of delayed pivots, an
/// ordering that has seen values is tried. Each attempt costs an analysis and a factorization.
constexpr double kManyDelays = 1.3;
constexpr int kMostComparisons = 3;

// ICNTL(7); never automatic, which may take SCOTCH: not deterministic.
constexpr int kOrderAmd = 0;
constexpr int kOrderGiven = 1;
constexpr int kOrderAmf = 2;
constexpr int kOrderPord = 4;

// ICNTL(6) and ICNTL(12): the matching of large entries, and its use for the ordering of symmetric
// matrices.
constexpr int kNoMatching = 0;
constexpr int kMatchingChosen = 7;
constexpr int kUsualOrdering = 1;
constexpr int kOrderingChosen = 0;

// ICNTL(8). What MUMPS chooses after a matching is the scaling of the analysis: wrong for later
// values.
constexpr int kScalingChosen = 77;
constexpr int kScalingOfEachMatrix = 7;

/// CNTL(3): a null pivot, rows being scaled to about 1; found by trial. Matrices that are singular
/// leave pivots up to this, and so do some that are only ill-conditioned.
constexpr double kNullPivotOfMumps = 1e-12;
/// Error of two known solutions with entries up to 1, up to which a matrix with such pivots is
/// regular. If it is singular the error is about 1, and 1 in 100 times less than this.
constexpr double kRegularError = 0.03;

/// PORD ends the process on a graph without structure (a full matrix), and its two stages are of
/// no use on small ones.
bool pord_can_order(const SymmetricMatrix& matrix) {
  constexpr Index kSmall = 100;
  const auto n = static_cast<std::int64_t>(matrix.dimension());
  return n > kSmall && matrix.nonzeros() < n * (n + 1) / 2;
}

bool has_zero_diagonal(const SymmetricMatrix& matrix) {
  const auto values = matrix.values();
  for (Index i = 0; i < matrix.dimension(); ++i) {
    if (values[at(matrix.diagonal_position(i))] == 0.0) return true;
  }
  return false;
}

}  // namespace

/// One MUMPS instance, from JOB = -1 to JOB = -2.
struct MumpsSolver::Instance : Uncopied {
  explicit Instance(Processes processes) {
    data.sym = 2;  // symmetric indefinite
    data.par = 1;
    data.comm_fortran = -987654;  // MPI_COMM_WORLD
    if (processes == Processes::Ranks) {
      const LibraryLock lock;
      mpi.emplace(&data, kInitialize);
    } else {
      run(kInitialize);
    }
    for (int k = 1; k <= 4; ++k) icntl(k) = 0;  // no output
    icntl(6) = kNoMatching;                     // the analysis sees no values
    icntl(8) = kScalingChosen;
    icntl(10) = 0;  // no refinement
    icntl(12) = kUsualOrdering;
    icntl(14) = kLeastPercent;
    icntl(13) = 1;  // no ScaLAPACK at the root: exact inertia
    icntl(24) = 1;  // null pivots are detected and counted
    cntl(3) = kNullPivotOfMumps;
  }
  ~Instance() {
    try {
      run(kTerminate);
    } catch (const SolverUnavailable&) {  // the other ranks are gone, and so is the instance
    }
  }

  /// Returns INFOG(1).
  int run(mpi::Job job) {
    const LibraryLock lock;
    data.job = job;
    std::optional<ReproducibleRand> rand;
    if (job == kAnalyze) rand.emplace();
    if (mpi) {
      mpi->run();
    } else {
      const SequentialBlas sequential(rinfog(1));
      dmumps_c(&data);
    }
    return infog(1);
  }

  // As in the users' guide: 1-based.
  int& icntl(int k) { return data.icntl[k - 1]; }
  double& cntl(int k) { return data.cntl[k - 1]; }
  [[nodiscard]] int infog(int k) const { return data.infog[k - 1]; }
  [[nodiscard]] double rinfog(int k) const { return data.rinfog[k - 1]; }

  DMUMPS_STRUC_C data{};
  std::optional<MpiMumps> mpi;
};

MumpsSolver::MumpsSolver(const SymmetricSolverOptions& options, Processes processes)
    : options_(options),
      processes_(processes),
      pivot_tolerance_(options.mumps_pivot_tolerance),
      memory_percent_(options.mumps_memory_percent) {}

MumpsSolver::~MumpsSolver() = default;

void MumpsSolver::make_instance() {
  instance_.reset();
  instance_ = std::make_unique<Instance>(processes_);
}

void MumpsSolver::take_pattern(const SymmetricMatrix& matrix) {
  for (auto* places : {&rows_, &columns_}) places->resize(at(matrix.nonzeros()));
  matrix.for_each_entry([&](Index i, Index j, Index p) {
    rows_[at(p)] = i + 1;
    columns_[at(p)] = j + 1;
  });
}

void MumpsSolver::load_pattern() {
  DMUMPS_STRUC_C& data = instance_->data;
  data.n = dimension_;
  data.nnz = static_cast<MUMPS_INT8>(rows_.size());
  data.irn = rows_.data();
  data.jcn = columns_.data();
}

/// What MUMPS predicts after an analysis that returned status.
Analysis MumpsSolver::prediction(int status, Ordering ordering) const {
  const int entries = instance_->infog(20);  // negative: in millions
  return {status >= 0, ordering, entries >= 0 ? entries : -std::int64_t{1000000} * entries,
          instance_->rinfog(1)};
}

/// Best: METIS's ordering where it is known or has the fewest flops, else AMD's.
Analysis MumpsSolver::analyze_with(Ordering ordering, const SymmetricMatrix& matrix) {
  if (ordering == Ordering::Best && metis_order_.empty()) {
    const Analysis amd = analyze_with(Ordering::Amd, matrix);
    if (amd.ok && amd.flops < kWorthComparing * worthwhile_flops(matrix)) return amd;
    const Analysis metis = analyze_with(Ordering::Metis, matrix);
    const bool is_worse = amd.ok && !(metis.ok && metis.flops < amd.flops);
    return is_worse ? analyze_with(Ordering::Amd, matrix) : metis;
  }
  if (ordering == Ordering::Pord && !pord_can_order(matrix)) ordering = Ordering::Amd;
  if (ordering == Ordering::Metis || ordering == Ordering::Best) {
    if (metis_order_.empty()) metis_order_ = fill_reducing_ordering(matrix, Ordering::Metis);
    std::vector<Index> order = metis_order_;
    for (Index& place : order) ++place;
    return analyze_given(Ordering::Metis, std::move(order));
  }
  order_.clear();
  instance_->icntl(7) = ordering == Ordering::Pord ? kOrderPord : kOrderAmd;
  return prediction(instance_->run(kAnalyze), ordering);
}

Analysis MumpsSolver::analyze_given(Ordering name, std::vector<Index> order) {
  order_ = std::move(order);
  instance_->data.perm_in = order_.data();
  instance_->icntl(7) = kOrderGiven;
  return prediction(instance_->run(kAnalyze), name);
}

/// As Ipopt has it: zeros on the diagonal are paired by a matching of large entries before the rows
/// are ordered, so that few pivots are delayed.
Analysis MumpsSolver::analyze_with_values(const SymmetricMatrix& matrix) {
  order_.clear();
  instance_->data.a = const_cast<double*>(matrix.values().data());  // read only
  instance_->icntl(6) = kMatchingChosen;
  instance_->icntl(7) = kOrderAmf;
  instance_->icntl(8) = kScalingOfEachMatrix;
  instance_->icntl(12) = kOrderingChosen;
  instance_->icntl(14) = kLeastPercent;
  const Analysis analysis = prediction(instance_->run(kAnalyze), Ordering::Best);
  instance_->icntl(6) = kNoMatching;
  instance_->icntl(12) = kUsualOrdering;
  return analysis;
}

/// Before the first factorization: an analysis that sees the values, all later ones being alike,
/// where that pays and the diagonal has zeros. The one before is kept where it promises far fewer
/// operations. False: out of memory.
bool MumpsSolver::take_first_values(const SymmetricMatrix& matrix) {
  if (std::exchange(has_seen_values_, true) || options_.ordering != Ordering::Best ||
      instance_->mpi || analysis_.flops < worthwhile_flops(matrix) || !has_zero_diagonal(matrix)) {
    return true;
  }
  const Analysis last = analysis_;
  std::vector<Index> last_order = current_order();
  analysis_ = analyze_with_values(matrix);
  by_values_ = analysis_.ok && analysis_.flops <= kWorthOfValues * last.flops;
  if (!by_values_) {
    instance_->icntl(8) = kScalingChosen;
    analysis_ = analyze_given(last.ordering, std::move(last_order));
  }
  return analysis_.ok;
}

/// Whether the last factorization, or what there was room for, took so many more operations than
/// predicted that another ordering is worth a try.
bool MumpsSolver::has_many_delays(const SymmetricMatrix& matrix) const {
  const double flops = instance_->rinfog(3);  // done, where rinfog(1) was predicted
  return options_.ordering == Ordering::Best && !instance_->mpi &&
         comparisons_ < kMostComparisons &&
         flops > kManyDelays * std::max(expected_flops_, analysis_.flops) &&
         flops > worthwhile_flops(matrix);
}

/// After such a factorization, or one that was given up: other analyses, with the values at hand,
/// where they promise fewer operations; the ordering that did better is kept. INFOG(1).
int MumpsSolver::compare_with_others(const SymmetricMatrix& matrix, int status) {
  const double flops = instance_->rinfog(3);
  ++comparisons_;
  const int* places = instance_->data.sym_perm;
  std::vector<Index> last_order(places, places + dimension_);
  const Analysis last = analysis_;
  const bool last_by_values = by_values_;
  const int last_scaling = instance_->icntl(8);
  const auto does_better = [&](int other) {  // what was given up would have taken more
    if (other < 0 || (status >= 0 && instance_->rinfog(3) >= flops)) return false;
    expected_flops_ = instance_->rinfog(3);
    return true;
  };
  analysis_ = analyze_with_values(matrix);
  by_values_ = true;
  if (analysis_.ok && analysis_.flops < flops) {
    // Null pivots may gather at the root of this one, too: not with all the workspace they want,
    // nor where the same prediction means the same ordering.
    const bool differs =
        analysis_.factor_entries != last.factor_entries || analysis_.flops != last.flops;
    int other = status;
    if (differs) {
      other = factorize_with_enough_memory([&] { return status < 0 && has_many_delays(matrix); });
      if (other == kStopped || does_better(other)) return other;
    }
    if (status < 0 && wants_more_workspace(other)) {
      instance_->icntl(8) = last_scaling;
      analysis_ = analyze_with(Ordering::Metis, matrix);
      metis_order_ = {};
      by_values_ = false;
      if (analysis_.ok) other = factorize_with_enough_memory();
      if (other == kStopped || (analysis_.ok && does_better(other))) return other;
    }
  }
  instance_->icntl(8) = last_scaling;
  instance_->icntl(14) = kLeastPercent;
  analysis_ = analyze_given(last.ordering, std::move(last_order));
  by_values_ = last_by_values;
  expected_flops_ = flops;
  return analysis_.ok ? factorize_with_enough_memory() : kOutOfMemory;
}

Analysis MumpsSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t>) {
  factorized_ = by_values_ = has_seen_values_ = false;
  expected_flops_ = 0.0;
  comparisons_ = 0;
  instance_.reset();
  order_.clear();
  memory_percent_ = options_.mumps_memory_percent;
  dimension_ = matrix.dimension();
  const Ordering wanted = options_.ordering;
  if (dimension_ != 0 && !(blas_has_memory() && has_memory_for(analysis_bytes(matrix)))) return {};
  if (dimension_ == 0) {
    return {true, wanted == Ordering::Best ? Ordering::Amd : wanted, 0, 0.0};
  }
  try {
    make_instance();
    take_pattern(matrix);
    load_pattern();
    analysis_ = analyze_with(wanted, matrix);
    metis_order_ = {};
    return analysis_;
  } catch (const std::bad_alloc&) {
    instance_.reset();
    metis_order_ = {};
    return {};
  }
}

std::unique_ptr<SymmetricSolver> MumpsSolver::same_analysis(const SymmetricMatrix& matrix,
                                                            std::span<const std::int8_t>) const {
  auto other = std::make_unique<MumpsSolver>(options_, processes_);
  other->dimension_ = dimension_;
  other->has_seen_values_ = has_seen_values_;
  if (dimension_ == 0) return other;
  try {
    other->make_instance();
    other->take_pattern(matrix);
    other->load_pattern();
    other->instance_->icntl(8) = instance_->icntl(8);
    if (analysis_.ordering == Ordering::Amd && !by_values_) {  // cheap
      other->analysis_ = other->analyze_with(Ordering::Amd, matrix);
    } else {
      other->analysis_ = other->analyze_given(analysis_.ordering, current_order());
    }
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
  return other->analysis_.ok ? std::move(other) : nullptr;
}

/// Bytes of a factorization with ICNTL(14) = percent: the analysis's INFOG(16), in MB, of which the
/// workspace grows in proportion.
double MumpsSolver::factorization_bytes(Index percent) const {
  return 1e6 * instance_->infog(16) * (100.0 + percent) / (100.0 + kLeastPercent);
}

/// MUMPS may end the process when it cannot allocate, so it is asked for nothing that is not there.
bool MumpsSolver::has_memory_for(double bytes) const {
  return bytes < kWorthAsking || bytes <= available_memory(options_.max_memory);
}

/// ICNTL(14) for half of the memory that is left: an attempt with too little takes as long as the
/// one that succeeds.
Index MumpsSolver::affordable_percent() const {
  const double times = 0.5 * available_memory(options_.max_memory) / factorization_bytes(0);
  return static_cast<Index>(std::clamp(100.0 * (times - 1.0), 1.0 * kLeastPercent,
                                       std::max(1.0 * kLeastPercent, 0.5 * memory_percent_)));
}

/// The one that the analysis stands on, 1-based.
std::vector<Index> MumpsSolver::current_order() const {
  if (!order_.empty()) return order_;
  const int* places = instance_->data.sym_perm;
  return {places, places + dimension_};
}

/// INFOG(1) of the factorization. Retries with more workspace when that was too small, where
/// gives_up() does not end it, and once with little when the generous default could not be
/// allocated.
int MumpsSolver::factorize_with_enough_memory(const std::function<bool()>& gives_up) {
  constexpr Index kMaxPercent = 1'000'000;
  bool economize = memory_percent_ > kLeastPercent;
  for (;;) {
    const bool fits = has_memory_for(factorization_bytes(memory_percent_));
    instance_->icntl(14) = memory_percent_;
    const int status = fits ? instance_->run(kFactorize) : kOutOfMemory;
    // With little workspace ranks allocate while they factorize: where that fails on one of them
    // MUMPS's others wait for ever.
    const bool may_wait = fits && instance_->mpi;
    const bool frugally = status == kOutOfMemory && economize && !may_wait;
    const bool generously = wants_more_workspace(status) && memory_percent_ < kMaxPercent;
    if (!frugally && !generously) return status;
    if (is_stopped()) return kStopped;
    if (frugally) {
      economize = false;
      memory_percent_ = fits ? kLeastPercent : affordable_percent();
    } else {
      if (gives_up && gives_up()) return status;
      memory_percent_ = std::max(kLeastPercent, 2 * memory_percent_);
    }
  }
}

/// Of a matrix with null pivots: factorizes it with these as pivots, and whether that solves.
bool MumpsSolver::is_ill_conditioned_only(const SymmetricMatrix& matrix) {
  instance_->cntl(3) = kEpsilon;
  const int status = factorize_with_enough_memory();
  instance_->cntl(3) = kNullPivotOfMumps;
  if (status < 0 || instance_->infog(28) > 0) return false;
  const std::size_t n = at(dimension_);
  std::vector<double> known(2 * n, 1.0), solution(2 * n);
  for (std::size_t i = 0; i < n; ++i) known[n + i] = std::cos(static_cast<double>(i));
  for (const std::size_t first : {std::size_t{0}, n}) {
    matrix.multiply({known.data() + first, n}, {solution.data() + first, n});
  }
  factorized_ = true;
  solve_in_place(solution, 2);
  return std::ranges::equal(solution, known, [](double found, double exact) {
    return std::abs(found - exact) <= kRegularError;
  });
}

Factorization MumpsSolver::factorize(const SymmetricMatrix& matrix, Certainty) {
  factorized_ = false;
  Factorization result;
  if (dimension_ == 0) {
    factorized_ = true;
    result.status = FactorizationStatus::Ok;
    return result;
  }
  if (instance_ == nullptr || !std::isfinite(matrix.max_norm())) return result;
  if (!take_first_values(matrix)) {
    result.status = FactorizationStatus::OutOfMemory;
    return result;
  }
  instance_->data.a = const_cast<double*>(matrix.values().data());  // read only
  instance_->cntl(1) = pivot_tolerance_;
  // Delayed pivots fill the workspace: no more of it before another ordering has been tried.
  int status = factorize_with_enough_memory([&] { return has_many_delays(matrix); });
  // Null pivots are delayed to the root in any order.
  const bool complete = status >= 0 ? instance_->infog(28) == 0 : wants_more_workspace(status);
  if (complete && has_many_delays(matrix)) {
    if (!is_stopped()) {
      status = compare_with_others(matrix, status);
    } else if (status < 0) {
      status = kStopped;
    }
  }
  if (wants_more_workspace(status) || status == kOutOfMemory) {
    result.status = FactorizationStatus::OutOfMemory;
    return result;
  }
  if (status < 0 && status != kSingular) return result;

  result.inertia.negative = instance_->infog(12);
  result.inertia.zero = status == kSingular ? 1 : instance_->infog(28);
  if (result.inertia.zero > 0 && is_ill_conditioned_only(matrix)) {
    result.inertia.negative = instance_->infog(12);
    result.inertia.zero = 0;
  }
  result.inertia.positive = dimension_ - result.inertia.negative - result.inertia.zero;
  result.status = result.inertia.zero > 0 ? FactorizationStatus::Singular : FactorizationStatus::Ok;
  factorized_ = result.status == FactorizationStatus::Ok;
  return result;
}

void MumpsSolver::solve_in_place(std::span<double> rhs, Index columns) {
  if (factorized_ && dimension_ == 0) return;
  if (factorized_) {
    instance_->data.rhs = rhs.data();
    instance_->data.nrhs = columns;
    instance_->data.lrhs = dimension_;
    if (instance_->run(kSolve) >= 0) return;
  }
  std::fill(rhs.begin(), rhs.end(), kNaN);
}

/// One multiply-add per entry of L, forward and backward.
double MumpsSolver::predict_inverse_product_flops(const SparseColumns& b) const {
  return 4.0 * static_cast<double>(analysis_.factor_entries) * b.columns();
}

/// Ipopt's rule, by whose powers 1 is never reached.
bool MumpsSolver::increase_quality() {
  constexpr double kNearOne = 0.9;
  const double most = options_.mumps_pivot_tolerance_max;
  if (!(pivot_tolerance_ < most)) return false;
  const double raised = std::pow(pivot_tolerance_, 0.75);
  pivot_tolerance_ = raised < kNearOne ? std::min(most, raised) : most;
  return true;
}

}  // namespace ipminmax
