#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "linalg/ldlt_solver.hpp"
#include "linalg/paired_ldlt_solver.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Chooses by size and predicted fill: LAPACK for tiny and for dense matrices, LDL' without pivoting
/// where fill is low, MUMPS elsewhere. A factorization by LDL' that breaks down, or whose inertia
/// its Gamma or rounding may have decided, is repeated by a pivoting solver; once LDL' has been
/// left, one with pivots of two rows comes first, and pivoting where that leaves the inertia
/// uncertain.
class AutoSolver final : public SymmetricSolver {
 public:
  explicit AutoSolver(const SymmetricSolverOptions& options);
  ~AutoSolver() override;

  /// Without signs (an empty span) only pivoting solvers are considered.
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  /// Certain: every LDL' inertia is checked, at about the cost of the factorization.
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  [[nodiscard]] Factorization make_certain(const SymmetricMatrix& matrix,
                                           const Factorization& last) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;

  void inverse_product(const SparseColumns& b, std::span<double> product) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;

  /// The first call after an LDL' factorization leaves it for that with pivots of two rows, the
  /// next one LDL' for good.
  [[nodiscard]] bool increase_quality() override;
  /// With pivots of two rows where they suit, LDL' elsewhere.
  void refine_less() override { prefer_paired_ = use_ldlt_; }
  /// With pivots of two rows where the inertia is that of the signs, which is far from uncertain.
  [[nodiscard]] bool begin_pivoting() override;
  void reset_quality() override;
  [[nodiscard]] std::string_view name() const override;

 private:
  void make_pivoting(Index dimension, std::vector<Index> metis_order = {});
  [[nodiscard]] bool prepare_ldlt(const Analysis& analysis);
  [[nodiscard]] bool inertia_is_certain(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                                        double gamma, double most_error, double& smaller_gamma);
  [[nodiscard]] SymmetricSolver& current();
  [[nodiscard]] bool has_pairs(const SymmetricMatrix& matrix);
  [[nodiscard]] bool pairs_are_enough(const SymmetricMatrix& matrix, const Factorization& result,
                                      Certainty certainty);
  [[nodiscard]] std::optional<Factorization> factorize_in_pairs(const SymmetricMatrix& matrix,
                                                                Certainty certainty);
  [[nodiscard]] std::optional<Factorization> factorize_in_doubt(const SymmetricMatrix& matrix,
                                                                Certainty certainty);
  [[nodiscard]] std::optional<Factorization> factorize_definite(const SymmetricMatrix& matrix,
                                                                Certainty certainty);
  [[nodiscard]] bool is_definite() const { return expected_.positive * expected_.negative == 0; }
  [[nodiscard]] Factorization factorize_without_ldlt(const SymmetricMatrix& matrix,
                                                     Certainty certainty);
  [[nodiscard]] Factorization checked(const SymmetricMatrix& matrix, const Factorization& last);
  [[nodiscard]] Factorization factorize_pivoting(const SymmetricMatrix& matrix);

  SymmetricSolverOptions options_;
  LdltSolver ldlt_;
  std::unique_ptr<PairedLdltSolver> paired_;  // null before its first use
  std::unique_ptr<SymmetricSolver> pivoting_;
  Inertia expected_;               // by the signs
  std::int64_t ldlt_entries_ = 0;  // of its factor
  bool pivoting_analyzed_ = false;
  bool ldlt_analyzed_ = false;
  bool pairs_made_ = false;           // since the last reset
  bool pairs_cost_too_much_ = false;  // the same
  bool use_ldlt_ = false;             // for the next factorization
  bool use_paired_ = false;           // where LDL' is not used or not enough
  bool prefer_paired_ = false;        // to LDL', where they suit
  bool in_doubt_ = false;             // begin_pivoting
  bool ldlt_in_doubt_ = false;        // LDL' may serve there
  int uncertain_ = 0;                 // LDL' factorizations in a row whose inertia was not certain
  int ldlt_pause_ = 0;                // next factorizations without LDL'
  int failed_pairs_ = 0;              // in a row, in doubt
  int pairs_pause_ = 0;               // next factorizations without pairs
  bool ldlt_is_current_ = false;      // the last factorization, before any the next
  bool paired_is_current_ = false;    // the same, or its replacement for definite matrices
  std::vector<double> direction_, image_, product_;  // workspace of inertia_is_certain
};

}  // namespace ipminmax
