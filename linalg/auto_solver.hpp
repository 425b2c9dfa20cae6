#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "linalg/ldlt_solver.hpp"
#include "linalg/paired_ldlt_solver.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Chooses by size and predicted fill: LAPACK for tiny and dense matrices, LDL' without pivoting
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
  void stop_when(std::function<bool()> stop) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;

  void inverse_product(const SparseColumns& b, std::span<double> product) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;

  /// The first call after an LDL' factorization leaves it for that with pivots of two rows, the
  /// next one takes the pairs of the matrix at hand or, if these failed, leaves LDL' for good.
  [[nodiscard]] bool increase_quality() override;
  /// With pivots of two rows where the inertia is that of the signs, which is far from uncertain.
  [[nodiscard]] bool begin_pivoting() override;
  void reset_quality() override;

 private:
  void make_pivoting(Index dimension, std::vector<Index> metis_order = {});
  [[nodiscard]] bool prepare_ldlt(const Analysis& analysis);
  void begin_at_ldlt();
  [[nodiscard]] bool inertia_is_certain(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                                        double gamma, double most_error, double& smaller_gamma);
  [[nodiscard]] SymmetricSolver& pivoting() const;
  [[nodiscard]] SymmetricSolver& current();
  [[nodiscard]] bool has_pairs(const SymmetricMatrix& matrix);
  [[nodiscard]] bool is_enough(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                               const Factorization& result, Certainty certainty);
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

  /// What the next factorization is by, in the order of quality.
  enum class Next : std::uint8_t {
    Ldlt,   ///< then what is left of these where it breaks down or is uncertain
    Pairs,  ///< or pivoting
    Pivoting
  };
  /// Whose factors are at hand.
  enum class Factors : std::uint8_t {
    None,  ///< since begin_pivoting
    Ldlt,
    Pairs,
    Definite,  ///< LDL' in place of pairs, of a matrix that should be definite
    Pivoting
  };
  enum class Pairs : std::uint8_t { Unmade, Made, TooExpensive };
  /// Attempts that fail again and again are left out for a while, a longer one each time.
  class Pause {
   public:
    /// first: the first one's length, as all of them a power of two, by its logarithm.
    explicit Pause(int first) : first_(first) {}
    /// Whether the next attempt is left out.
    [[nodiscard]] bool skips() { return left_ > 0 && left_-- > 0; }
    void failed();
    void succeeded() { failures_ = 0; }
    void end() { failures_ = left_ = 0; }

   private:
    int first_;
    int failures_ = 0;  ///< in a row
    int left_ = 0;
  };

  SymmetricSolverOptions options_;
  LdltSolver ldlt_;
  std::unique_ptr<PairedLdltSolver> paired_;  // null before its first use
  std::unique_ptr<SymmetricSolver> pivoting_;
  std::unique_ptr<SymmetricSolver> dense_;  // in place of it in doubt, where small; null before
  std::function<bool()> stop_;
  Inertia expected_;               // by the signs
  std::int64_t ldlt_entries_ = 0;  // of its factor
  bool pivoting_analyzed_ = false;
  bool ldlt_analyzed_ = false;
  Next next_ = Next::Pivoting;
  Factors factors_ = Factors::Pivoting;
  Pairs pairs_ = Pairs::Unmade;                      // since the last reset
  int inaccurate_pairs_ = 0;                         // PairedLdltSolver::pairs() of those
  bool in_doubt_ = false;                            // begin_pivoting
  bool ldlt_in_doubt_ = false;                       // LDL' may serve there
  Pause ldlt_pause_{0};                              // where its inertia was not certain
  Pause pairs_pause_{1};                             // in doubt
  std::vector<double> direction_, image_, product_;  // workspace of inertia_is_certain
};

}  // namespace ipminmax
