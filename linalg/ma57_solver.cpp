#include "linalg/ma57_solver.hpp"

#include <algorithm>
#include <limits>
#include <new>

#include "linalg/blas_threads.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/numbers.hpp"
#include "linalg/solver_library.hpp"

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

}  // namespace

/// Fortran's calling convention: everything by address.
struct Ma57Solver::Library {
  template <class Function>
  static Function* find(std::initializer_list<const char*> names) {
    return reinterpret_cast<Function*>(solver_function(LinearSolver::Ma57, names));
  }
  using Defaults = void(double* cntl, int* icntl);
  Defaults* defaults = find<Defaults>({"ma57id_", "ma57id", "MA57ID"});
  using Analyse = void(const int* n, const int* ne, const int* irn, const int* jcn,
                       const int* lkeep, int* keep, int* iwork, const int* icntl, int* info,
                       double* rinfo);
  Analyse* analyse = find<Analyse>({"ma57ad_", "ma57ad", "MA57AD"});
  using Factor = void(const int* n, const int* ne, const double* a, double* fact, const int* lfact,
                      int* ifact, const int* lifact, const int* lkeep, const int* keep, int* iwork,
                      const int* icntl, const double* cntl, int* info, double* rinfo);
  Factor* factor = find<Factor>({"ma57bd_", "ma57bd", "MA57BD"});
  using Solve = void(const int* job, const int* n, const double* fact, const int* lfact,
                     const int* ifact, const int* lifact, const int* nrhs, double* rhs,
                     const int* lrhs, double* work, const int* lwork, int* iwork, const int* icntl,
                     int* info);
  Solve* solve = find<Solve>({"ma57cd_", "ma57cd", "MA57CD"});
};

void Ma57Solver::load_library() {
  if (!library_) library_ = std::make_shared<const Library>();
}

std::unique_ptr<LoadedSolver> Ma57Solver::another() const {
  auto other = std::make_unique<Ma57Solver>(options());
  other->library_ = library_;
  return other;
}

bool Ma57Solver::analyze_in_order(const SymmetricMatrix& matrix) {
  const int n = dimension(), ne = matrix.nonzeros();
  std::vector<int> irn(at(ne)), jcn(at(ne));
  for (int j = 0; j < n; ++j) {
    for (int p = matrix.column_starts()[at(j)]; p < matrix.column_starts()[at(j) + 1]; ++p) {
      irn[at(p)] = matrix.rows()[at(p)] + 1;
      jcn[at(p)] = j + 1;
    }
  }
  library_->defaults(cntl_.data(), icntl_.data());
  cntl_[1] = kNullPivot;
  for (std::size_t k = 0; k < 4; ++k) icntl_[k] = -1;  // streams of messages: none
  icntl_[4] = 0;
  icntl_[5] = 1;  // the order is given, in KEEP
  icntl_[6] = 1;  // threshold pivoting
  icntl_[7] = 1;  // without space: end, do not wait for more
  const int lkeep = 5 * n + ne + std::max(n, ne) + 42;
  keep_.assign(at(lkeep), 0);
  std::ranges::transform(order(), keep_.begin(), [](Index place) { return place + 1; });
  iwork_.resize(5 * at(n));
  const LibraryLock lock;
  library_->analyse(&n, &ne, irn.data(), jcn.data(), &lkeep, keep_.data(), iwork_.data(),
                    icntl_.data(), info_.data(), rinfo_.data());
  if (info_[0] < 0) return false;
  analysis().factor_entries = info_[4];
  analysis().flops = rinfo_[1];
  enlarge(fact_, info_[8]);
  enlarge(ifact_, info_[9]);
  return true;
}

/// INFO(1) of the last attempt.
int Ma57Solver::factorize_with_enough_space(const SymmetricMatrix& matrix) {
  const int n = dimension(), ne = matrix.nonzeros(), lkeep = size_of(keep_);
  cntl_[0] = pivot_tolerance();
  for (;;) {
    const int lfact = size_of(fact_), lifact = size_of(ifact_);
    library_->factor(&n, &ne, matrix.values().data(), fact_.data(), &lfact, ifact_.data(), &lifact,
                     &lkeep, keep_.data(), iwork_.data(), icntl_.data(), cntl_.data(), info_.data(),
                     rinfo_.data());
    if (info_[0] == kNoRealSpace) {
      enlarge(fact_, info_[16]);
    } else if (info_[0] == kNoIntegerSpace) {
      enlarge(ifact_, info_[17]);
    } else {
      return info_[0];
    }
  }
}

bool Ma57Solver::factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) {
  const LibraryLock lock;
  const SequentialBlas sequential(analysis().flops);
  const int status = factorize_with_enough_space(matrix);
  pivots = {.negative = info_[23], .rank = status == kSingularMatrix ? info_[24] : dimension()};
  return status >= 0;
}

void Ma57Solver::solve_with_factors(std::span<double> rhs, Index columns) {
  if (work_.size() < rhs.size()) work_.resize(rhs.size());
  const int job = 1;  // A u = b
  const int n = dimension(), lfact = size_of(fact_), lifact = size_of(ifact_),
            lwork = size_of(work_);
  const LibraryLock lock;
  const SequentialBlas sequential(analysis().flops);
  library_->solve(&job, &n, fact_.data(), &lfact, ifact_.data(), &lifact, &columns, rhs.data(), &n,
                  work_.data(), &lwork, iwork_.data(), icntl_.data(), info_.data());
}

}  // namespace ipminmax
