#pragma once

#include <memory>
#include <span>
#include <vector>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// What solvers from libraries that are loaded at run time share: the elimination order is ours,
/// they pivot by threshold, and the threshold grows by Ipopt's rule.
class LoadedSolver : public SymmetricSolver {
 public:
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) final;
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const final;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) final;
  void solve_in_place(std::span<double> rhs, Index columns = 1) final;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const final;
  [[nodiscard]] bool increase_quality() override;
  void reset_quality() final;

 protected:
  struct Pivots {
    int negative = 0, rank = 0;
  };
  explicit LoadedSolver(const SymmetricSolverOptions& options);

  /// Throws SolverUnavailable.
  virtual void load_library() = 0;
  /// With the same options and library.
  [[nodiscard]] virtual std::unique_ptr<LoadedSolver> another() const = 0;
  // The dimension is not 0. These throw std::bad_alloc.
  /// Into analysis(), order() being known; false: it failed.
  [[nodiscard]] virtual bool analyze_in_order(const SymmetricMatrix& matrix) = 0;
  /// False: it failed.
  [[nodiscard]] virtual bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) = 0;
  virtual void solve_with_factors(std::span<double> rhs, Index columns) = 0;

  [[nodiscard]] const SymmetricSolverOptions& options() const { return options_; }
  [[nodiscard]] double pivot_tolerance() const { return pivot_tolerance_; }
  [[nodiscard]] Index dimension() const { return dimension_; }
  /// Place of each row in the elimination order.
  [[nodiscard]] const std::vector<Index>& order() const { return order_; }
  [[nodiscard]] Analysis& analysis() { return analysis_; }

 private:
  [[nodiscard]] Analysis analyze_with_order(const SymmetricMatrix& matrix);

  SymmetricSolverOptions options_;
  double pivot_tolerance_;
  Index dimension_ = 0;
  std::vector<Index> order_;
  Analysis analysis_;
  bool factorized_ = false;
};

}  // namespace ipminmax
