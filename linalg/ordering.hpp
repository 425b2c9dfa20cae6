#pragma once

#include <cstdint>
#include <span>

#include "array.hpp"
#include "symmetric_matrix.hpp"
#include "symmetric_solver.hpp"

namespace ipminmax {

/// new_index[i] is the place of row i in the elimination order. Deterministic. Pord is not
/// available outside MUMPS and throws std::invalid_argument, as Best does.
[[nodiscard]] Array<Index> fill_reducing_ordering(const SymmetricMatrix& matrix, Ordering ordering);

/// Entries of the factor L (with diagonal) and operations of an LDL' factorization without
/// pivoting in the given order.
struct FactorSize {
  std::int64_t entries = 0;
  double flops = 0.0;
};
[[nodiscard]] FactorSize predict_factor_size(const SymmetricMatrix& matrix,
                                             std::span<const Index> new_index);

/// An ordering and what it costs.
struct OrderingChoice {
  Ordering ordering = Ordering::Amd;
  Array<Index> new_index;
  FactorSize size;
};

/// The ordering asked for; Best takes Amd or Metis by predicted flops, and looks at Metis only
/// where a better factorization could repay the search.
[[nodiscard]] OrderingChoice choose_ordering(const SymmetricMatrix& matrix, Ordering ordering);

/// Predicted flops from which several orderings are worth comparing for a matrix of this size:
/// below, the factorizations of a whole solve cost less than another ordering.
[[nodiscard]] double worthwhile_flops(const SymmetricMatrix& matrix);
/// Times that many from which METIS, as slow as several factorizations, pays within a solve.
inline constexpr double kWorthComparing = 20.0;

}  // namespace ipminmax
