#pragma once

#include <array>
#include <span>
#include <vector>

#include "linalg/array.hpp"
#include "linalg/elimination_tree.hpp"
#include "linalg/ordering.hpp"
#include "linalg/symmetric_solver.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Sparse LDL' of A + gamma I with pivots of one or two rows that are fixed before: a row whose
/// diagonal is small beside its other entries is eliminated together with one that it is coupled
/// with. Where a multiplier's zero diagonal meets a variable without curvature, one pivot after the
/// other would be gamma and 1 / gamma, and their rounding is all that is left of small eigenvalues;
/// the pair's is neither. Gamma can be as small as rounding, therefore. The inertia is that of
/// A + gamma I up to rounding, which is for the caller to test.
class PairedLdltSolver final : public SymmetricSolver, Uncopied {
 public:
  PairedLdltSolver(Ordering ordering, double gamma);

  /// Unlike other solvers reads the values of the matrix, from which it makes the pairs; the last
  /// ordering stays where these are the same. signs are not read.
  /// Makes no room for the factor: the first factorization does.
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;
  /// Number of the pairs: as long as it is the same they are.
  [[nodiscard]] int pairs() const { return pairs_; }
  /// Null: the pairs depend on values.
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;

 private:
  /// Rows (a, b) of a node and columns (c, d) of another: {ac, ad, bc, bd}. A node of one row has
  /// a second one that nothing is coupled with and whose diagonal is 1.
  using Block = std::array<double, 4>;
  void order(const SymmetricMatrix& matrix);
  void build_pattern(const SymmetricMatrix& matrix);
  [[nodiscard]] bool make_room();
  void load_values(const SymmetricMatrix& matrix);
  [[nodiscard]] Block eliminate_row(Index node);
  [[nodiscard]] bool take_pivot(Index node, const Block& pivot, Factorization& result);
  void solve_one(std::span<double> rhs);

  Ordering ordering_;
  double gamma_;
  int pairs_ = 0;
  Array<Index> partner_;  ///< of each row of the matrix; itself: none
  Array<bool> left_;      ///< rows with a small diagonal and no partner
  Index nodes_ = 0;
  Array<Index> place_;  ///< of each row: 2 * node in the order of elimination, + 1: second row
  Array<bool> single_;  ///< by node
  // The matrix by rows of nodes: blocks with the columns of nodes before, and on the diagonal.
  Lists rows_;
  Array<Block> row_blocks_, diagonal_;
  std::vector<double*> entry_;  ///< where each entry of the matrix goes
  // L by columns of nodes, and the inverse of D.
  EliminationTree tree_;
  FactorPattern pattern_;  // made by the first factorization
  Array<Index> ends_;      // of the columns' entries made so far
  Array<Block> blocks_, inverse_;
  Array<Block> row_;  // one row of L D under elimination; else zero
  Array<double> permuted_;
  bool factorized_ = false;
};

}  // namespace ipminmax
