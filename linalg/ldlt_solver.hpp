#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "linalg/array.hpp"
#include "linalg/ordering.hpp"
#include "linalg/supernodal_factor.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Sparse LDL' without pivoting of A + Gamma, Gamma = diag(signs_i gamma_i), gamma_i <= gamma: the
/// paper's way to make every pivot of a KKT matrix appear. Solutions are those of A + Gamma, to be
/// refined against A.
///
/// The inertia is that of A + Gamma. It is that of A when no eigenvalue of A lies within gamma of
/// zero; a singular A is therefore reported with a definite inertia, or as Failed, never reliably
/// as Singular.
class LdltSolver final : public SymmetricSolver {
 public:
  explicit LdltSolver(const SymmetricSolverOptions& options) : options_(options) {}

  /// Throws std::invalid_argument unless there is one sign per row.
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;

  /// As above, with an ordering made before.
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs,
                                 const OrderingChoice& ordering);

  /// With the ordering of another solver that has analyzed the pattern.
  [[nodiscard]] Analysis analyze_as(const LdltSolver& other, const SymmetricMatrix& matrix,
                                    std::span<const std::int8_t> signs);
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;
  /// With the forward substitution alone; rows that no column of B reaches cost nothing.
  void inverse_product(const SparseColumns& b, std::span<double> product) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;
  [[nodiscard]] Factorization factorize_with(const SymmetricMatrix& matrix, double gamma);
  /// What factorize takes by itself. As pivot of a multiplier's zero diagonal gamma leaves J'J /
  /// gamma in the rows of the variables: too small a gamma costs their digits, too large a one
  /// accuracy.
  [[nodiscard]] double suitable_gamma(const SymmetricMatrix& matrix) const;

 private:
  /// Of L: its entries made so far, and the pivot.
  struct Column {
    Index begin = 0, end = 0;
    double pivot = 0.0;
  };
  struct ColumnRange {  // of B
    Index begin = 0, end = 0;
    void include(ColumnRange other);
  };
  void build_pattern(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs);
  void make_supernodes(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs);
  [[nodiscard]] bool eliminate(std::span<const double> values, double gamma);
  void solve_one(std::span<double> rhs);
  /// visit(row, value) for the entries of column j of L, without its unit diagonal.
  template <class Visit>
  void for_each_of_column(std::size_t j, Visit&& visit) const {
    if (supernodes_) return supernodes_->for_each_of_column(j, visit);
    for (Index p = columns_[j].begin; p < columns_[j].end; ++p) {
      visit(at(pattern_.rows[p]), values_[p]);
    }
  }
  [[nodiscard]] double pivot(std::size_t j) const {
    return supernodes_ ? supernodes_->pivots()[j] : columns_[j].pivot;
  }
  void find_ranges(const SparseColumns& b, Array<ColumnRange>& ranges) const;

  SymmetricSolverOptions options_;
  Ordering ordering_ = Ordering::Amd;
  FactorSize size_;         // predicted
  Array<Index> new_index_;  // place of row i in the elimination order
  // P A P' by rows: entries left of the diagonal, their places in A, and those of the diagonals.
  Lists lower_;
  Array<Index> lower_places_, diagonal_places_;
  Array<double> gamma_weights_;  // diagonal of Gamma over gamma, in elimination order
  Array<Index> couplings_;       // places in A that link rows of opposite signs
  Array<ColumnRange> ranges_;    // of inverse_product: columns that reach a row; else empty
  Array<double> forward_;        // L^-1 P B by rows; else zero
  EliminationTree tree_;
  std::unique_ptr<SupernodalFactor> supernodes_;  // in place of all below where columns are long
  FactorPattern pattern_;                         // of L
  Array<Column> columns_;
  Array<double> values_;    // of L, as pattern_.rows
  Array<double> row_;       // of L D under elimination; else zero
  Array<double> permuted_;  // one right-hand side in elimination order
  bool factorized_ = false;
};

}  // namespace ipminmax
