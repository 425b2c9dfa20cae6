#pragma once

#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "linalg/loaded_solver.hpp"

namespace ipminmax {

/// HSL's MA57 (Duff, ACM TOMS 30, 2004), from a library that is loaded at run time: multifrontal
/// LDL' with threshold pivoting. Calls are serialized over all threads of the process.
class Ma57Solver final : public LoadedSolver {
 public:
  explicit Ma57Solver(const SymmetricSolverOptions& options) : LoadedSolver(options) {}
  [[nodiscard]] std::string_view name() const override { return "ma57"; }

 private:
  struct Library;
  void load_library() override;
  [[nodiscard]] std::unique_ptr<LoadedSolver> another() const override;
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override;
  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override;
  void solve_with_factors(std::span<double> rhs, Index columns) override;
  [[nodiscard]] int factorize_with_enough_space(const SymmetricMatrix& matrix);

  std::shared_ptr<const Library> library_;  // from the first analysis on

  // Arrays of MA57, with its names.
  std::array<double, 5> cntl_{};
  std::array<int, 20> icntl_{};
  std::array<int, 40> info_{};
  std::array<double, 20> rinfo_{};
  std::vector<int> keep_, iwork_, ifact_;
  std::vector<double> fact_, work_;
};

}  // namespace ipminmax
