#pragma once

#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Threads that OpenBLAS uses; 1 with another BLAS.
[[nodiscard]] int blas_threads();

/// From the first call on no child is forked while a SequentialBlas of another thread lives. Before
/// a fork the handler registered last runs first, so a lock around which these are made registers
/// later.
void hold_blas_threads_over_forks();

/// Operations of a factorization up to which BLAS uses one thread: fewer take longer on several,
/// and sums are then the same whatever OPENBLAS_NUM_THREADS says.
inline constexpr double kOperationsWorthThreads = 1e9;

/// Held around every call of BLAS. Meanwhile OpenBLAS uses one thread if a factorization of so many
/// operations is not worth more; the number is the whole process's, and comes back when the last of
/// them ends. Forks in other threads wait, with any BLAS.
class SequentialBlas : Uncopied {
 public:
  explicit SequentialBlas(double operations);
  ~SequentialBlas();

 private:
  bool holds_;
};

}  // namespace ipminmax
