#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// SSIDS of SPRAL (Hogg, Ovtchinnikov, Scott, 2016), from a library that is loaded at run time: multifrontal LDL'
/// with threshold pivoting a posteriori, parallel by OpenMP. SPRAL with OpenMP needs
/// OMP_CANCELLATION=TRUE in the environment of the process.
class SpralSolver final : public SymmetricSolver {
 public:
  explicit SpralSolver(const SymmetricSolverOptions& options);
  ~SpralSolver() override;

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
  [[nodiscard]] std::string_view name() const override { return "spral"; }

 private:
  struct Library;
  struct Factors;
  [[nodiscard]] Analysis analyze_in_order(const SymmetricMatrix& matrix);

  SymmetricSolverOptions options_;
  std::shared_ptr<const Library> library_;  // from the first analysis on
  std::unique_ptr<Factors> factors_;
  double pivot_tolerance_;
  Index dimension_ = 0;
  std::vector<Index> order_;  // place of each row in the elimination order
  Analysis analysis_;
  bool factorized_ = false;
};

}  // namespace ipminmax
