// Pardiso's calling convention, the Pardiso project's and with fewer calls MKL's, in a library of
// its own: LAPACK factorizes. It refuses arguments that are out of order, and moves zero pivots
// up.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "linalg/lapack_solver.hpp"
#include "linalg/symmetric_matrix.hpp"

using ipminmax::LapackSolver;
using ipminmax::SymmetricMatrix;
using ipminmax::Triplet;

namespace {

struct Kept {
  SymmetricMatrix matrix;
  LapackSolver lapack;
};

bool is_upper_triangle(int n, const int* ia, const int* ja) {
  for (int row = 1; row <= n; ++row) {
    if (ja[ia[row - 1] - 1] != row) return false;  // the diagonal first
    if (!std::is_sorted(ja + ia[row - 1] - 1, ja + ia[row] - 1)) return false;
  }
  return ia[0] == 1;
}

Kept* analyzed(int n, const int* ia, const int* ja) {
  std::vector<Triplet> entries;
  for (int row = 1; row <= n; ++row) {
    for (int p = ia[row - 1]; p < ia[row]; ++p) entries.push_back({row - 1, ja[p - 1] - 1});
  }
  auto kept = std::make_unique<Kept>(Kept{SymmetricMatrix(n, entries), {}});
  return kept->lapack.analyze(kept->matrix, {}).ok ? kept.release() : nullptr;
}

}  // namespace

extern "C" {

void pardisoinit(void** pt, const int* mtype, const int* solver, int* iparm, double* dparm,
                 int* error) {
  std::fill(pt, pt + 64, nullptr);
  std::fill(iparm, iparm + 64, 0);
  std::fill(dparm, dparm + 64, 0.0);
  *error = *mtype == -2 && *solver == 0 ? 0 : -1;
}

void pardiso(void** pt, const int* maxfct, const int* mnum, const int* mtype, const int* phase,
             const int* n, const double* a, const int* ia, const int* ja, int*, const int* nrhs,
             int* iparm, const int* msglvl, double* b, double* x, int* error, double*) {
  auto* kept = static_cast<Kept*>(pt[0]);
  const bool is_right = *maxfct == 1 && *mnum == 1 && *mtype == -2 && *msglvl == 0 && *nrhs > 0 &&
                        iparm[0] == 1 && iparm[5] == 0 && is_upper_triangle(*n, ia, ja);
  *error = is_right && (kept != nullptr || *phase == 11) ? 0 : -1;
  if (*error != 0) return;
  const auto entries = static_cast<std::size_t>(ia[*n] - 1);
  switch (*phase) {
    case 11:
      delete std::exchange(kept, analyzed(*n, ia, ja));
      pt[0] = kept;
      *error = kept == nullptr ? -2 : 0;
      return;
    case 22: {
      std::copy_n(a, entries, kept->matrix.values().begin());
      const ipminmax::Factorization found = kept->lapack.factorize(kept->matrix);
      iparm[13] = found.inertia.zero;
      iparm[21] = found.inertia.positive + found.inertia.zero;
      iparm[22] = found.inertia.negative;
      return;
    }
    case 33: {
      const auto size = static_cast<std::size_t>(*n) * static_cast<std::size_t>(*nrhs);
      std::copy_n(b, size, x);
      kept->lapack.solve_in_place({x, size}, *nrhs);
      return;
    }
    case -1:
      delete kept;
      pt[0] = nullptr;
      return;
    default:
      *error = -1;
  }
}

}  // extern "C"
