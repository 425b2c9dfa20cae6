#pragma once

#include <memory>
#include <span>
#include <vector>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Dense Bunch-Kaufman factorization with rook pivoting (LAPACK dsytrf_rook) of the equilibrated
/// matrix S A S, S diagonal with powers of two: no rounding, and "tiny" has a meaning for rows of
/// very different size. A pivot counts as zero when it is within rounding of zero there.
class LapackSolver final : public SymmetricSolver {
 public:
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override {
    return 2.0 * dimension_ * static_cast<double>(dimension_) * b.columns();
  }

 private:
  [[nodiscard]] double operations() const;  // of a factorization
  void equilibrate(const SymmetricMatrix& matrix);
  void load_values(const SymmetricMatrix& matrix);
  [[nodiscard]] Factorization count_pivots();
  struct RookPivot;
  [[nodiscard]] RookPivot find_pivot(std::size_t k) const;
  void interchange(std::size_t k, std::size_t i, std::size_t j);
  void factorize_tiny();
  void solve_tiny(double* b) const;

  Index dimension_ = 0;
  std::vector<double> dense_;      // dimension x dimension by columns, lower triangle
  std::vector<double> scale_;      // diagonal of S
  std::vector<double> row_norms_;  // workspace
  std::vector<Index> interchanges_;
  std::vector<double> work_;
  bool factorized_ = false;
};

}  // namespace ipminmax
