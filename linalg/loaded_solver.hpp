#pragma once

#include <memory>
#include <span>
#include <vector>

#include "linalg/solver_library.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// What solvers from libraries that are loaded at run time share: the elimination order is ours,
/// they pivot by threshold, and the threshold grows by Ipopt's rule.
class LoadedSolver : public SymmetricSolver {
 public:
  LoadedSolver(const SymmetricSolverOptions& options, LinearSolver kind);

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

  /// Throws SolverUnavailable.
  virtual void load_library() = 0;
  /// With the same options and library.
  [[nodiscard]] virtual std::unique_ptr<LoadedSolver> another() const = 0;
  // The dimension is not 0. These throw std::bad_alloc.
  /// Into analysis_, order_ being known; false: it failed.
  [[nodiscard]] virtual bool analyze_in_order(const SymmetricMatrix& matrix) = 0;
  /// False: it failed.
  [[nodiscard]] virtual bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) = 0;
  virtual void solve_with_factors(std::span<double> rhs, Index columns) = 0;

  SymmetricSolverOptions options_;
  LinearSolver kind_;
  double pivot_tolerance_;
  Index dimension_ = 0;
  std::vector<Index> order_;  ///< place of each row in the elimination order
  Analysis analysis_;

 private:
  [[nodiscard]] Analysis analyze_with_order(const SymmetricMatrix& matrix);

  bool factorized_ = false;
};

/// A Solver by the functions that its Library, a SolverLibrary, finds.
template <class Solver, class Library>
class SolverFrom : public LoadedSolver {
 public:
  using LoadedSolver::LoadedSolver;

 protected:
  std::shared_ptr<const Library> library_;  ///< from the first analysis on

 private:
  void load_library() final {
    if (!library_) library_ = std::make_shared<const Library>(kind_);
  }
  [[nodiscard]] std::unique_ptr<LoadedSolver> another() const final {
    auto other = std::make_unique<Solver>(options_, kind_);
    other->library_ = library_;
    return other;
  }
};

// Each in a file of its own. Calls of MA57 and Pardiso are serialized over all threads of the
// process.

/// HSL's MA57 (Duff, ACM TOMS 30, 2004): multifrontal LDL' with threshold pivoting.
[[nodiscard]] std::unique_ptr<SymmetricSolver> make_ma57(const SymmetricSolverOptions& options);
/// HSL_MA97 (Hogg, Scott, 2011): multifrontal LDL' with threshold pivoting, parallel by OpenMP.
[[nodiscard]] std::unique_ptr<SymmetricSolver> make_ma97(const SymmetricSolverOptions& options);
/// SSIDS of SPRAL (Hogg, Ovtchinnikov, Scott, 2016): multifrontal LDL' with threshold pivoting a
/// posteriori, parallel by OpenMP. SPRAL with OpenMP needs OMP_CANCELLATION=TRUE in the environment
/// of the process.
[[nodiscard]] std::unique_ptr<SymmetricSolver> make_spral(const SymmetricSolverOptions& options);
/// Pardiso (Schenk and Gaertner, 2006), MKL's or the Pardiso project's (kind): supernodal LDL' in
/// an order of its own. It pivots within supernodes alone and moves the pivots that stay small:
/// what then helps is another order, by a matching of the matrix's values. That is made at the
/// first factorization, and anew where pivots were moved, as Ipopt does; those that are moved again
/// are zero.
[[nodiscard]] std::unique_ptr<SymmetricSolver> make_pardiso(const SymmetricSolverOptions& options,
                                                            LinearSolver kind);

}  // namespace ipminmax
