#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "linalg/loaded_solver.hpp"

namespace ipminmax {

/// Pardiso (Schenk and Gaertner, 2006), MKL's or the Pardiso project's, from a library that is
/// loaded at run time: supernodal LDL' in an order of its own. It pivots within supernodes alone
/// and moves the pivots that stay small: what then helps is another order, by a matching of the
/// matrix's values. That is made at the first factorization, and anew where pivots were moved, as
/// Ipopt does; those that are moved again are zero. Calls are serialized over all threads of the
/// process.
class PardisoSolver final : public LoadedSolver {
 public:
  /// kind: Pardiso or PardisoMkl.
  PardisoSolver(const SymmetricSolverOptions& options, LinearSolver kind);
  ~PardisoSolver() override;
  [[nodiscard]] std::string_view name() const override;
  [[nodiscard]] bool increase_quality() override { return false; }

 private:
  struct Library;
  struct Factors;
  void load_library() override;
  [[nodiscard]] std::unique_ptr<LoadedSolver> another() const override;
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override;
  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override;
  void solve_with_factors(std::span<double> rhs, Index columns) override;

  LinearSolver kind_;
  std::shared_ptr<const Library> library_;  // from the first analysis on
  std::unique_ptr<Factors> factors_;
};

}  // namespace ipminmax
