#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "linalg/schur_complement.hpp"
#include "linalg/symmetric_solver.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

class KktBlock;

/// Factorizations of K by way of K_yy (linalg/schur_complement.hpp): the factors that give the
/// inertia of K_yy serve K as well. Two factorizations of K_yy are kept, because K may still be
/// solved with after K_yy was factorized at another point.
class KktSchur : Uncopied {
 public:
  /// inner has been analyzed. Throws std::bad_alloc.
  KktSchur(const KktBlock& full, const KktBlock& inner);
  /// Makes the second solver of K_yy, or takes an analyzed one. False: out of memory. To be called
  /// before a factorization.
  [[nodiscard]] bool prepare(const KktBlock& inner, std::shared_ptr<SymmetricSolver> second);

  /// Predicted operations of a factorization of K when that of K_yy is there.
  [[nodiscard]] double predict_flops(const KktBlock& inner) const;

  /// The solver that inner does not hold.
  [[nodiscard]] const std::shared_ptr<SymmetricSolver>& second(const KktBlock& inner) const;

  /// Factorizes inner's matrix as it stands, unless that was done before, and leaves inner with the
  /// solver that has the factors.
  [[nodiscard]] Factorization factorize_inner(KktBlock& inner, Certainty certainty,
                                              Index& factorized);

  /// Factorizes full's matrix as it stands. Nothing: K_yy is nearly singular, or has no
  /// factorization, so that K should be factorized as a whole.
  [[nodiscard]] std::optional<Factorization> factorize(const KktBlock& full, Certainty certainty,
                                                       Index& factorized, Index& complements);
  /// Solves with the last factorization of K, in place.
  void solve_in_place(std::span<double> rhs);

  /// K has other values: its factorization is needed no more.
  void release_full() { full_factors_ = nullptr; }
  /// K_yy's factors were overwritten, or better ones are wanted.
  void forget_factors();
  /// Undoes all calls of increase_quality of both solvers of K_yy.
  void reset_quality();

 private:
  struct Factors {
    std::shared_ptr<SymmetricSolver> solver;
    std::vector<double> values{};  ///< of the matrix that was factorized; empty: none
    Factorization result{};
    Certainty certainty{};  ///< asked of it
    Index serial = 0;       ///< number of factorizations so far
  };
  [[nodiscard]] Factors* other(const Factors* factors) {
    return factors == factors_.data() ? &factors_[1] : factors_.data();
  }
  [[nodiscard]] Factors* find(std::span<const double> values, Certainty certainty);
  void factorize(Factors& factors, const SymmetricMatrix& matrix, Certainty certainty,
                 Index& factorized);

  SchurComplement complement_;
  std::array<Factors, 2> factors_;
  Factors* inner_factors_;           ///< of the last factorize_inner
  Factors* full_factors_ = nullptr;  ///< K's factorization stands on them; null: none
  SymmetricMatrix inner_matrix_;     ///< the part K_yy of K
  /// What the complement was formed with.
  struct {
    const Factors* factors = nullptr;
    Index serial = 0;
    std::uint64_t version = 0;  ///< of K's values
  } formed_;
};

}  // namespace ipminmax
