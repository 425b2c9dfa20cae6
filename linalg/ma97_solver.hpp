#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "linalg/loaded_solver.hpp"

namespace ipminmax {

/// HSL_MA97 (Hogg, Scott, 2011), from a library that is loaded at run time: multifrontal LDL' with
/// threshold pivoting, parallel by OpenMP.
class Ma97Solver final : public LoadedSolver {
 public:
  explicit Ma97Solver(const SymmetricSolverOptions& options);
  ~Ma97Solver() override;
  [[nodiscard]] std::string_view name() const override { return "ma97"; }

 private:
  struct Library;
  struct Factors;
  void load_library() override;
  [[nodiscard]] std::unique_ptr<LoadedSolver> another() const override;
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override;
  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override;
  void solve_with_factors(std::span<double> rhs, Index columns) override;

  std::shared_ptr<const Library> library_;  // from the first analysis on
  std::unique_ptr<Factors> factors_;
};

}  // namespace ipminmax
