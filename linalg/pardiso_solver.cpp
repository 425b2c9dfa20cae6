#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "linalg/blas_threads.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/loaded_solver.hpp"
#include "linalg/numbers.hpp"
#include "linalg/ordering.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {
namespace {

constexpr int kSymmetricIndefinite = -2;  ///< MTYPE
enum class Phase { Analyze = 11, Factorize = 22, Solve = 33, Release = -1 };
// Values of ERROR.
enum Error { kNoMemory = -2, kZeroPivot = -4, kSingularDiagonal = -7 };

/// Entries of IPARM, which its manual counts from 1.
std::size_t iparm(int number) { return at(number - 1); }

template <class Range>
std::vector<int> from_one(const Range& from) {
  std::vector<int> result(from.begin(), from.end());
  for (int& i : result) ++i;
  return result;
}

struct PardisoLibrary : SolverLibrary {
  using SolverLibrary::SolverLibrary;
  /// DPARM is the Pardiso project's; MKL does not look at it.
  void (*call)(void** pt, const int* maxfct, const int* mnum, const int* mtype, const int* phase,
               const int* n, const double* a, const int* ia, const int* ja, int* perm,
               const int* nrhs, int* iparm, const int* msglvl, double* b, double* x, int* error,
               double* dparm) = find({"pardiso", "pardiso_"});
  /// Null: PT and IPARM are all that MKL keeps.
  void (*initialize)(void** pt, const int* mtype, const int* solver, int* iparm, double* dparm,
                     int* error) = kind == LinearSolver::PardisoMkl
                                       ? LoadedFunction{nullptr}
                                       : find({"pardisoinit", "pardisoinit_"});
};

/// What Pardiso has allocated, and its arguments.
struct PardisoFactors : Uncopied {
  PardisoFactors(std::shared_ptr<const PardisoLibrary> from, const SymmetricMatrix& matrix)
      : library(std::move(from)),
        n(matrix.dimension()),
        // The lower triangle by columns is the upper one by rows.
        starts(from_one(matrix.column_starts())),
        columns(from_one(matrix.rows())) {
    if (library->initialize != nullptr) {
      const int direct = 0;
      int error = 0;
      library->initialize(pt.data(), &kSymmetricIndefinite, &direct, parameters.data(),
                          dparm.data(), &error);
      if (error != 0) {
        throw SolverUnavailable("pardisoinit ends with error " + std::to_string(error) +
                                ": no license");
      }
      const char* given = std::getenv("OMP_NUM_THREADS");
      parameters[iparm(3)] = std::max(1, given == nullptr ? 1 : std::atoi(given));
    }
    parameters[iparm(1)] = 1;                                        // no defaults
    parameters[iparm(2)] = 2;                                        // METIS's nested dissection
    parameters[iparm(8)] = 0;                                        // no refinement
    parameters[iparm(10)] = 12;                                      // pivots below 1e-12 are moved
    parameters[iparm(11)] = 1;                                       // scaling and
    parameters[iparm(13)] = library->initialize == nullptr ? 1 : 2;  // matching
    parameters[iparm(21)] = 1;                                       // pivots of one and two rows
  }
  ~PardisoFactors() {
    if (is_analyzed) run(Phase::Release, nullptr, nullptr, 1);
  }

  /// The value of ERROR. Throws std::bad_alloc.
  int run(Phase phase, double* b, double* x, int right_hand_sides) {
    const int one = 1, silent = 0, wanted = static_cast<int>(phase);
    int error = 0;
    library->call(pt.data(), &one, &one, &kSymmetricIndefinite, &wanted, &n, values.data(),
                  starts.data(), columns.data(), permutation.data(), &right_hand_sides,
                  parameters.data(), &silent, b, x, &error, dparm.data());
    if (error == kNoMemory) throw std::bad_alloc();
    return error;
  }
  /// The order, by the values.
  [[nodiscard]] int analyze() {
    is_analyzed = true;
    return run(Phase::Analyze, nullptr, nullptr, 1);
  }
  [[nodiscard]] int moved() const { return parameters[iparm(14)]; }

  std::shared_ptr<const PardisoLibrary> library;
  int n;
  std::vector<int> starts, columns, permutation;
  std::vector<double> values, solution;
  std::array<void*, 64> pt{};
  std::array<int, 64> parameters{};
  std::array<double, 64> dparm{};
  bool is_analyzed = false;
};

class PardisoSolver final : public SolverFrom<PardisoSolver, PardisoLibrary> {
 public:
  using SolverFrom::SolverFrom;
  [[nodiscard]] bool increase_quality() override { return false; }

 private:
  /// Pardiso's own analysis waits for values; its order costs about what ours would.
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override {
    const LibraryLock lock;
    factors_ = std::make_unique<PardisoFactors>(library_, matrix);
    factors_->permutation.resize(at(dimension_));
    const FactorSize size = predict_factor_size(matrix, order_);
    analysis_.factor_entries = size.entries;
    analysis_.flops = size.flops;
    return true;
  }

  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override {
    PardisoFactors& f = *factors_;
    f.values.assign(matrix.values().begin(), matrix.values().end());
    const LibraryLock lock;
    const SequentialBlas sequential(analysis_.flops);
    const bool is_fresh = !f.is_analyzed;
    int error = is_fresh ? f.analyze() : 0;
    if (error == 0) error = f.run(Phase::Factorize, nullptr, nullptr, 1);
    if (!is_fresh && (error != 0 || f.moved() > 0)) {
      error = f.analyze();
      if (error == 0) error = f.run(Phase::Factorize, nullptr, nullptr, 1);
    }
    if (error == kZeroPivot || error == kSingularDiagonal) {
      pivots = {.negative = 0, .rank = dimension_ - 1};
      return true;
    }
    const int rank = dimension_ - f.moved();
    pivots = {.negative = std::min(f.parameters[iparm(23)], rank), .rank = rank};
    return error == 0;
  }

  void solve_with_factors(std::span<double> rhs, Index columns) override {
    PardisoFactors& f = *factors_;
    if (f.solution.size() < rhs.size()) f.solution.resize(rhs.size());
    const LibraryLock lock;
    const SequentialBlas sequential(analysis_.flops);
    if (f.run(Phase::Solve, rhs.data(), f.solution.data(), columns) != 0) {
      std::ranges::fill(rhs, kNaN);
      return;
    }
    std::copy_n(f.solution.begin(), rhs.size(), rhs.begin());
  }

  std::unique_ptr<PardisoFactors> factors_;
};

}  // namespace

std::unique_ptr<SymmetricSolver> make_pardiso(const SymmetricSolverOptions& options,
                                              LinearSolver kind) {
  return std::make_unique<PardisoSolver>(options, kind);
}

}  // namespace ipminmax
