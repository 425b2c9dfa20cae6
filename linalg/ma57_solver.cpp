#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include "linalg/blas_threads.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/loaded_solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

constexpr double kNullPivot = 1e-12;  ///< as in MUMPS, rows being scaled

// Values of INFO(1), from MA57's specification.
constexpr int kNoRealSpace = -3, kNoIntegerSpace = -4, kSingularMatrix = 4;

/// Space beyond the forecast, which knows no delayed pivots.
constexpr double kSpace = 1.2;

/// At least `needed` entries and half as many again as there are. Throws std::bad_alloc, also
/// beyond what an int counts.
template <class Vector>
void enlarge(Vector& vector, int needed) {
  const double wanted = std::max(kSpace * needed, 1.5 * static_cast<double>(vector.size()));
  if (wanted > std::numeric_limits<int>::max()) throw std::bad_alloc();
  vector.resize(static_cast<std::size_t>(wanted));
}

int size_of(const auto& vector) { return static_cast<int>(vector.size()); }

/// Fortran's calling convention: everything by address.
struct Ma57Library : SolverLibrary {
  using SolverLibrary::SolverLibrary;
  void (*defaults)(double* cntl, int* icntl) = find({"ma57id_", "ma57id", "MA57ID"});
  void (*analyse)(const int* n, const int* ne, const int* irn, const int* jcn, const int* lkeep,
                  int* keep, int* iwork, const int* icntl, int* info,
                  double* rinfo) = find({"ma57ad_", "ma57ad", "MA57AD"});
  void (*factor)(const int* n, const int* ne, const double* a, double* fact, const int* lfact,
                 int* ifact, const int* lifact, const int* lkeep, const int* keep, int* iwork,
                 const int* icntl, const double* cntl, int* info,
                 double* rinfo) = find({"ma57bd_", "ma57bd", "MA57BD"});
  void (*solve)(const int* job, const int* n, const double* fact, const int* lfact,
                const int* ifact, const int* lifact, const int* nrhs, double* rhs, const int* lrhs,
                double* work, const int* lwork, int* iwork, const int* icntl,
                int* info) = find({"ma57cd_", "ma57cd", "MA57CD"});
};

class Ma57Solver final : public SolverFrom<Ma57Solver, Ma57Library> {
 public:
  using SolverFrom::SolverFrom;

 private:
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override {
    const int n = dimension_, ne = matrix.nonzeros();
    std::vector<int> irn(at(ne)), jcn(at(ne));
    matrix.for_each_entry([&](Index i, Index j, Index p) {
      irn[at(p)] = i + 1;
      jcn[at(p)] = j + 1;
    });
    library_->defaults(cntl_.data(), icntl_.data());
    cntl_[1] = kNullPivot;
    for (std::size_t k = 0; k < 4; ++k) icntl_[k] = -1;  // streams of messages: none
    icntl_[4] = 0;
    icntl_[5] = 1;  // the order is given, in KEEP
    icntl_[6] = 1;  // threshold pivoting
    icntl_[7] = 1;  // without space: end, do not wait for more
    const int lkeep = 5 * n + ne + std::max(n, ne) + 42;
    keep_.assign(at(lkeep), 0);
    std::ranges::transform(order_, keep_.begin(), [](Index place) { return place + 1; });
    iwork_.resize(5 * at(n));
    const LibraryLock lock;
    library_->analyse(&n, &ne, irn.data(), jcn.data(), &lkeep, keep_.data(), iwork_.data(),
                      icntl_.data(), info_.data(), rinfo_.data());
    if (info_[0] < 0) return false;
    analysis_.factor_entries = info_[4];
    analysis_.flops = rinfo_[1];
    enlarge(fact_, info_[8]);
    enlarge(ifact_, info_[9]);
    return true;
  }

  /// INFO(1) of the last attempt.
  [[nodiscard]] int factorize_with_enough_space(const SymmetricMatrix& matrix) {
    const int n = dimension_, ne = matrix.nonzeros(), lkeep = size_of(keep_);
    cntl_[0] = pivot_tolerance_;
    for (;;) {
      const int lfact = size_of(fact_), lifact = size_of(ifact_);
      library_->factor(&n, &ne, matrix.values().data(), fact_.data(), &lfact, ifact_.data(),
                       &lifact, &lkeep, keep_.data(), iwork_.data(), icntl_.data(), cntl_.data(),
                       info_.data(), rinfo_.data());
      if (info_[0] == kNoRealSpace) {
        enlarge(fact_, info_[16]);
      } else if (info_[0] == kNoIntegerSpace) {
        enlarge(ifact_, info_[17]);
      } else {
        return info_[0];
      }
    }
  }

  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override {
    const LibraryLock lock;
    const SequentialBlas sequential(analysis_.flops);
    const int status = factorize_with_enough_space(matrix);
    pivots = {.negative = info_[23], .rank = status == kSingularMatrix ? info_[24] : dimension_};
    return status >= 0;
  }

  void solve_with_factors(std::span<double> rhs, Index columns) override {
    if (work_.size() < rhs.size()) work_.resize(rhs.size());
    const int job = 1;  // A u = b
    const int n = dimension_, lfact = size_of(fact_), lifact = size_of(ifact_),
              lwork = size_of(work_);
    const LibraryLock lock;
    const SequentialBlas sequential(analysis_.flops);
    library_->solve(&job, &n, fact_.data(), &lfact, ifact_.data(), &lifact, &columns, rhs.data(),
                    &n, work_.data(), &lwork, iwork_.data(), icntl_.data(), info_.data());
  }

  // Arrays of MA57, with its names.
  std::array<double, 5> cntl_{};
  std::array<int, 20> icntl_{};
  std::array<int, 40> info_{};
  std::array<double, 20> rinfo_{};
  std::vector<int> keep_, iwork_, ifact_;
  std::vector<double> fact_, work_;
};

}  // namespace

std::unique_ptr<SymmetricSolver> make_ma57(const SymmetricSolverOptions& options) {
  return std::make_unique<Ma57Solver>(options, LinearSolver::Ma57);
}

}  // namespace ipminmax
