#pragma once

#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// HSL's MA57 (Duff, ACM TOMS 30, 2004), from a library that is loaded at run time: multifrontal LDL' with threshold
/// pivoting. Calls are serialized over all threads of the process.
class Ma57Solver final : public SymmetricSolver {
 public:
  explicit Ma57Solver(const SymmetricSolverOptions& options);

  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;
  [[nodiscard]] bool increase_quality() override;
  void reset_quality() override;
  [[nodiscard]] std::string_view name() const override { return "ma57"; }

 private:
  struct Library;
  [[nodiscard]] Analysis analyze_in_order(const SymmetricMatrix& matrix);
  [[nodiscard]] int factorize_with_enough_space(const SymmetricMatrix& matrix);

  SymmetricSolverOptions options_;
  std::shared_ptr<const Library> library_;  // from the first analysis on
  double pivot_tolerance_;
  Index dimension_ = 0;
  std::vector<Index> order_;  // place of each row in the elimination order
  Analysis analysis_;
  bool factorized_ = false;

  // Arrays of MA57, with its names.
  std::array<double, 5> cntl_{};
  std::array<int, 20> icntl_{};
  std::array<int, 40> info_{};
  std::array<double, 20> rinfo_{};
  std::vector<int> keep_, iwork_, ifact_;
  std::vector<double> fact_, work_;
};

}  // namespace ipminmax
