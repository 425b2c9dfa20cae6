// MA57's calling convention in a library of its own, for a machine without HSL: LAPACK factorizes. It refuses arrays that
// are too short, and always wants more space than its analysis has forecast once.
#include <algorithm>
#include <vector>

#include "linalg/lapack_solver.hpp"
#include "linalg/symmetric_matrix.hpp"

using ipminmax::Index;
using ipminmax::LapackSolver;
using ipminmax::SymmetricMatrix;
using ipminmax::Triplet;

namespace {

/// KEEP: the order, then rows and columns; FACT: the values, then what real factors would take.
SymmetricMatrix matrix_of(int n, int ne, const int* keep, const double* a) {
  std::vector<Triplet> entries;
  for (int k = 0; k < ne; ++k) entries.push_back({keep[n + k] - 1, keep[n + ne + k] - 1});
  SymmetricMatrix matrix(n, entries);
  for (int k = 0; k < ne; ++k) {
    matrix.values()[static_cast<std::size_t>(
        matrix.triplet_positions()[static_cast<std::size_t>(k)])] += a[k];
  }
  return matrix;
}

}  // namespace

extern "C" {

void ma57id_(double* cntl, int* icntl) {
  std::fill(cntl, cntl + 5, 0.0);
  std::fill(icntl, icntl + 20, 0);
}

void ma57ad_(const int* n, const int* ne, const int* irn, const int* jcn, const int* lkeep,
             int* keep, int* iwork, const int* icntl, int* info, double* rinfo) {
  info[0] = 0;
  if (*lkeep < 5 * *n + *ne + std::max(*n, *ne) + 42) info[0] = -15;
  std::vector<int> seen(static_cast<std::size_t>(*n), 0);
  for (int i = 0; i < *n && icntl[5] == 1; ++i) {  // a permutation
    if (keep[i] < 1 || keep[i] > *n || seen[static_cast<std::size_t>(keep[i] - 1)]++ != 0)
      info[0] = -9;
  }
  if (info[0] < 0) return;
  std::copy(irn, irn + *ne, keep + *n);
  std::copy(jcn, jcn + *ne, keep + *n + *ne);
  std::fill(iwork, iwork + 5 * *n, 0);
  info[4] = info[8] = *n + *ne / 2;  // less than is needed below
  info[9] = *n;
  rinfo[1] = 1.0;
}

void ma57bd_(const int* n, const int* ne, const double* a, double* fact, const int* lfact,
             int* ifact, const int* lifact, const int* lkeep, const int* keep, int* iwork,
             const int*, const double*, int* info, double*) {
  if (*lkeep < 5 * *n + *ne + std::max(*n, *ne) + 42) {
    info[0] = -15;
    return;
  }
  if (*lfact < 2 * *ne + *n) {
    info[0] = -3;
    info[16] = 2 * *ne + *n;
    return;
  }
  if (*lifact < 2 * *ne + 2) {
    info[0] = -4;
    info[17] = 2 * *ne + 2;
    return;
  }
  std::copy(a, a + *ne, fact);
  ifact[0] = *n;
  ifact[1] = *ne;
  std::copy(keep + *n, keep + *n + 2 * *ne, ifact + 2);
  std::fill(iwork, iwork + *n, 0);
  LapackSolver lapack;
  const SymmetricMatrix matrix = matrix_of(*n, *ne, keep, a);
  if (!lapack.analyze(matrix, {}).ok) return;
  const ipminmax::Factorization found = lapack.factorize(matrix);
  info[0] = found.inertia.zero > 0 ? 4 : 0;
  info[23] = found.inertia.negative;
  info[24] = *n - found.inertia.zero;
}

void ma57cd_(const int* job, const int* n, const double* fact, const int*, const int* ifact,
             const int*, const int* nrhs, double* rhs, const int* lrhs, double* work,
             const int* lwork, int* iwork, const int*, int* info) {
  info[0] = 0;
  if (*job != 1 || *lrhs != *n || *lwork < *n * *nrhs) {
    info[0] = -17;
    return;
  }
  std::vector<int> keep(static_cast<std::size_t>(*n), 0);
  keep.insert(keep.end(), ifact + 2, ifact + 2 + 2 * ifact[1]);
  const SymmetricMatrix matrix = matrix_of(*n, ifact[1], keep.data(), fact);
  LapackSolver lapack;
  if (!lapack.analyze(matrix, {}).ok ||
      lapack.factorize(matrix).status != ipminmax::FactorizationStatus::Ok) {
    info[0] = -1;
    return;
  }
  std::fill(iwork, iwork + *n, 0);
  std::fill(work, work + *n * *nrhs, 0.0);
  lapack.solve_in_place({rhs, static_cast<std::size_t>(*n) * static_cast<std::size_t>(*nrhs)},
                        *nrhs);
}

}  // extern "C"
