// MA97's calling convention in a library of its own, for a machine without HSL: LAPACK factorizes. It refuses an order
// that is no permutation, and lines of a matrix that are not the lower triangle's.
#include <cstring>
#include <vector>

#include "linalg/lapack_solver.hpp"
#include "linalg/symmetric_matrix.hpp"

using ipminmax::LapackSolver;
using ipminmax::SymmetricMatrix;
using ipminmax::Triplet;

namespace {

enum Flag { kOk = 0, kSingular = 7, kWrongSequence = -2, kWrongOrder = -11, kNotImplemented = -98 };

// As HSL_MA97's specification has them.
struct Control {
  int f_arrays, action, nemin;
  double multiplier;
  int ordering, print_level, scaling;
  double small, u;
  int unit_diagnostics, unit_error, unit_warning;
  long factor_min;
  int solve_blas3;
  long solve_min;
  int solve_mf;
  double consist_tol;
  int ispare[5];
  double rspare[10];
};
struct Info {
  int flag, flag68, flag77, matrix_dup, matrix_rank, matrix_outrange, matrix_missing_diag, maxdepth,
      maxfront, num_delay;
  long num_factor, num_flops;
  int num_neg, num_sup, num_two, ordering, stat;
  int ispare[5];
  double rspare[10];
};

struct Kept {
  SymmetricMatrix matrix;
  LapackSolver lapack{};
};

Kept* kept(void** keep) { return static_cast<Kept*>(*keep); }

}  // namespace

extern "C" {

void ma97_default_control_d(Control* control) {
  std::memset(control, 0, sizeof *control);
  control->f_arrays = 1;
  control->ordering = 5;
  control->u = 0.01;
}

void ma97_analyse_d(int, int n, const int* ptr, const int* row, const double*, void** akeep,
                    const Control* control, Info* info, int* order) {
  *info = {};
  std::vector<int> seen(static_cast<std::size_t>(n), 0);
  for (int i = 0; i < n; ++i) {
    if (order[i] < 0 || order[i] >= n || seen[static_cast<std::size_t>(order[i])]++ != 0)
      info->flag = kWrongOrder;
  }
  if (control->f_arrays != 0 || control->ordering != 0 || control->action == 0)
    info->flag = kNotImplemented;
  std::vector<Triplet> entries;
  for (int j = 0; j < n; ++j) {
    for (int p = ptr[j]; p < ptr[j + 1]; ++p) {
      if (row[p] < j) info->flag = kNotImplemented;
      entries.push_back({row[p], j});
    }
  }
  if (info->flag < 0) return;
  delete kept(akeep);
  *akeep = new Kept{SymmetricMatrix(n, entries)};
  if (!kept(akeep)->lapack.analyze(kept(akeep)->matrix, {}).ok) info->flag = kWrongSequence;
  info->num_factor = static_cast<long>(entries.size());
  info->num_flops = n;
  for (int i = 0; i < n; ++i) order[i] = -1;  // what it makes of it
}

void ma97_factor_d(int type, const int* ptr, const int* row, const double* val, void** akeep,
                   void** fkeep, const Control* control, Info* info, double*) {
  *info = {};
  Kept* keep = kept(akeep);
  if (keep == nullptr || type != 4 || !(control->u > 0.0) || control->small != 1e-12) {
    info->flag = kWrongSequence;
    return;
  }
  const int n = keep->matrix.dimension();
  for (int p = 0, j = 0; j < n; ++j) {
    for (; p < ptr[j + 1]; ++p) {
      if (row[p] != keep->matrix.rows()[static_cast<std::size_t>(p)]) info->flag = kWrongSequence;
      keep->matrix.values()[static_cast<std::size_t>(p)] = val[p];
    }
  }
  if (info->flag < 0) return;
  const ipminmax::Factorization found = keep->lapack.factorize(keep->matrix);
  *fkeep = keep;
  info->flag = found.inertia.zero > 0 ? kSingular : kOk;
  info->num_neg = found.inertia.negative;
  info->matrix_rank = n - found.inertia.zero;
}

void ma97_solve_d(int job, int nrhs, double* x, int ldx, void** akeep, void** fkeep, const Control*,
                  Info* info) {
  Kept* keep = kept(akeep);
  *info = {};
  if (keep == nullptr || *fkeep != keep || job != 0 || ldx != keep->matrix.dimension()) {
    info->flag = kWrongSequence;
    return;
  }
  keep->lapack.solve_in_place({x, static_cast<std::size_t>(ldx) * static_cast<std::size_t>(nrhs)},
                              nrhs);
}

void ma97_finalise_d(void** akeep, void** fkeep) {
  delete kept(akeep);
  *akeep = *fkeep = nullptr;
}

}  // extern "C"
