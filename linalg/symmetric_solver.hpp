#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "linalg/solver_options.hpp"
#include "linalg/symmetric_matrix.hpp"

namespace ipminmax {

/// What the symbolic analysis predicts.
struct Analysis {
  bool ok = false;  ///< false: out of memory or an internal failure of the backend
  Ordering ordering = Ordering::Amd;
  std::int64_t factor_entries = 0;  ///< predicted entries of the factor
  double flops = 0.0;               ///< predicted floating point operations of one factorization
  int threads = 1;                  ///< that factorizations and solves are divided among
};

enum class FactorizationStatus : std::uint8_t {
  Failed,  ///< initial value, or the backend broke down (vanishing pivot without pivoting, NaN)
  OutOfMemory,  ///< also after the retries with more memory
  Singular,     ///< factorized, but inertia.zero > 0: solves are not meaningful
  Ok
};

/// Whether an inertia must hold for the matrix itself, whatever that costs. Matters only to solvers
/// that can do both.
enum class Certainty : std::uint8_t {
  Usual,  ///< regularization or rounding may decide it
  Certain
};

/// How far factors can be trusted.
struct Trust {
  bool pivoted = true;        ///< the inertia is reliable for any matrix
  double perturbation = 0.0;  ///< bound of what was added to eigenvalues
};

struct Factorization {
  FactorizationStatus status = FactorizationStatus::Failed;
  Inertia inertia{};
  /// Smallest |eigenvalue| of the (block) diagonal factor; 0 if unknown.
  double smallest_pivot = 0.0;
  Trust trust{};
};

/// A sparse dimension x columns matrix: column k has the entries starts[k] to starts[k + 1] - 1.
struct SparseColumns {
  Index dimension = 0;
  std::span<const Index> starts;  ///< columns + 1
  std::span<const Index> rows;
  std::span<const double> values;
  [[nodiscard]] Index columns() const { return static_cast<Index>(starts.size()) - 1; }
};

/// Direct solver for A u = b with A symmetric indefinite. Order of calls:
///   1. analyze       once per pattern; only the pattern of the matrix is read
///   2. factorize     any number of times; matrix has the analyzed pattern, values may differ
///   3. solve_in_place  any number of times after a factorize that returned Ok
///   4. increase_quality, then 2 again, when a solution was not accurate
/// A failed factorize may be followed by another factorize with other values.
/// factorize and solve_in_place allocate nothing of their own after the first call.
/// One solver object belongs to one thread at a time; several objects may be used at once.
class SymmetricSolver {
 public:
  virtual ~SymmetricSolver() = default;

  /// signs: expected sign (+1 or -1) of each pivot, length dimension; read by solvers that do not
  /// pivot (the paper's Gamma), ignored by the others.
  [[nodiscard]] virtual Analysis analyze(const SymmetricMatrix& matrix,
                                         std::span<const std::int8_t> signs) = 0;

  /// Another solver of this kind with the last analysis and its ordering, which are not computed
  /// anew; null: out of memory. The pattern of matrix is the analyzed one.
  [[nodiscard]] virtual std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const = 0;

  [[nodiscard]] virtual Factorization factorize(const SymmetricMatrix& matrix,
                                                Certainty certainty = Certainty::Certain) = 0;
  /// After a factorize of the same matrix with Certainty::Usual: its result as it would be with a
  /// certain inertia, and factors for it. last: what factorize returned.
  [[nodiscard]] virtual Factorization make_certain(const SymmetricMatrix& /*matrix*/,
                                                   const Factorization& last) {
    return last;
  }

  /// Sets a function that factorize asks before another attempt with more workspace or another
  /// ordering, which takes as long as the first. If it returns true, factorize returns Failed. It
  /// stays until another is set; empty: factorize does not ask.
  virtual void stop_when(std::function<bool()> /*stop*/) {}

  /// rhs: columns right-hand sides of length dimension one after the other, overwritten by the
  /// solutions. No iterative refinement.
  virtual void solve_in_place(std::span<double> rhs, Index columns = 1) = 0;

  /// Writes B' A^-1 B into product: columns x columns numbers, column by column, of which only the
  /// lower triangle counts. May be called when solve_in_place may. The rows of B are those of A.
  virtual void inverse_product(const SparseColumns& b, std::span<double> product);
  /// Predicted operations of inverse_product after an analyze, in the unit of Analysis::flops; the
  /// pattern of B is all that is read.
  [[nodiscard]] virtual double predict_inverse_product_flops(const SparseColumns& b) const = 0;

  /// True when the next factorize will be more accurate than the last one (larger pivot threshold,
  /// pivoting instead of none); false when nothing better is left.
  [[nodiscard]] virtual bool increase_quality() { return false; }
  /// Only pivoting factorizations from now on, where the solver has the choice. True: the next
  /// factorize may differ from the last one.
  [[nodiscard]] virtual bool begin_pivoting() { return false; }
  /// Undoes all calls of increase_quality and begin_pivoting; the analysis stays.
  virtual void reset_quality() {}

 private:
  std::vector<double> block_;  // workspace of inverse_product
};

}  // namespace ipminmax
