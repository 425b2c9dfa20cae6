#pragma once

#include <span>
#include <vector>

#include "linalg/array.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Factorization of
///
///     K = | A  B' |   with  S = A - B' C^-1 B
///         | B  C  |
///
/// from a factorization of the sparse C and one of the dense S: In(K) = In(C) + In(S) [Haynsworth
/// 1968]. Rows of C are called inner, the others outer. Where only the diagonal of A changes, S is
/// factorized anew without a solve. No iterative refinement.
class SchurComplement {
 public:
  /// inner_row: for every row of K its row of C, or -1; ascending where it is not -1. Only the
  /// pattern is read.
  SchurComplement(const SymmetricMatrix& matrix, std::span<const Index> inner_row);

  [[nodiscard]] Index outer_dimension() const { return static_cast<Index>(outer_.size()); }
  [[nodiscard]] Index inner_dimension() const { return static_cast<Index>(inner_.size()); }

  /// Predicted operations of form and factorize by a solver that has analyzed C.
  [[nodiscard]] double predict_flops(const SymmetricSolver& inner) const;

  /// The values of C, in the order of a SymmetricMatrix with its pattern.
  void extract_inner(const SymmetricMatrix& matrix, std::span<double> values) const;

  /// B' C^-1 B, with C's factors. False: its entries exceed those of K so far that S would have
  /// lost its digits, as when C is nearly singular; K should be factorized as a whole.
  [[nodiscard]] bool form(const SymmetricMatrix& matrix, SymmetricSolver& inner);

  /// Factorizes S. Nothing but the diagonal of A may have changed since form. The inertia is that
  /// of S.
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix);

  /// rhs: one right-hand side in the rows of K, overwritten by the solution; after a factorize that
  /// returned Ok, with C's factors of form.
  void solve_in_place(SymmetricSolver& inner, std::span<double> rhs);

 private:
  [[nodiscard]] SparseColumns coupling() const {
    return {inner_dimension(), coupling_rows_.starts, coupling_rows_.items, coupling_};
  }

  std::vector<Index> outer_, inner_;                  // rows of K
  std::vector<Index> outer_entries_, outer_targets_;  // positions of A in K and in complement_
  std::vector<Index> inner_entries_;                  // positions of C in K
  // B by columns: rows of C, positions in K, values
  Lists coupling_rows_;
  std::vector<Index> coupling_entries_;
  std::vector<double> coupling_;
  std::vector<double> product_;  // B' C^-1 B by columns, lower triangle
  SymmetricMatrix complement_;   // S, all entries
  LapackSolver dense_;
  std::vector<double> outer_rhs_, inner_rhs_;
};

}  // namespace ipminmax
