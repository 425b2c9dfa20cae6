#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "linalg/ordering.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Sparse LDL' of A + gamma I with pivots of one or two rows that are fixed before: a row whose
/// diagonal is small beside its other entries is eliminated together with one that it is coupled
/// with. Where a multiplier's zero diagonal meets a variable without curvature, one pivot after the
/// other would be gamma and 1 / gamma, and their rounding is all that is left of small eigenvalues;
/// the pair's is neither. Gamma can be as small as rounding, therefore. The inertia is that of
/// A + gamma I up to rounding, which is for the caller to test.
class PairedLdltSolver final : public SymmetricSolver {
 public:
  PairedLdltSolver(Ordering ordering, double gamma);
  PairedLdltSolver(const PairedLdltSolver&) = delete;
  PairedLdltSolver& operator=(const PairedLdltSolver&) = delete;

  /// Unlike other solvers reads the values of the matrix, from which it makes the pairs; the last
  /// ordering stays where these are the same. signs are not read.
  /// Makes no room for the factor: the first factorization does.
  [[nodiscard]] Analysis analyze(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) override;
  /// Null: the pairs depend on values.
  [[nodiscard]] std::unique_ptr<SymmetricSolver> same_analysis(
      const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const override;
  [[nodiscard]] Factorization factorize(const SymmetricMatrix& matrix,
                                        Certainty certainty = Certainty::Certain) override;
  void solve_in_place(std::span<double> rhs, Index columns = 1) override;
  [[nodiscard]] double predict_inverse_product_flops(const SparseColumns& b) const override;
  [[nodiscard]] bool increase_quality() override { return false; }
  void reset_quality() override {}
  [[nodiscard]] std::string_view name() const override { return "paired_ldlt"; }

 private:
  /// Of rows (a, b) of a node and columns (c, d) of another: {ac, ad, bc, bd}. A node of one row has
  /// a second one that nothing is coupled with and whose diagonal is 1.
  using Block = std::array<double, 4>;
  void order(const SymmetricMatrix& matrix);
  void build_pattern(const SymmetricMatrix& matrix);
  void build_tree();
  [[nodiscard]] bool make_room();
  void load_values(const SymmetricMatrix& matrix);
  [[nodiscard]] std::size_t reach_of(Index node);
  [[nodiscard]] Block eliminate_row(Index node, std::size_t first);
  [[nodiscard]] bool take_pivot(Index node, const Block& pivot, Factorization& result);
  void solve_one(std::span<double> rhs);

  Ordering ordering_;
  double gamma_;
  std::vector<Index> partner_;  ///< of each row of the matrix; itself: none
  std::vector<bool> left_;      ///< rows with a small diagonal and no partner
  Index nodes_ = 0;
  std::vector<Index>
      place_;  ///< of each row: 2 * node in the order of elimination, + 1: second row
  std::vector<bool> single_;  ///< by node
  // The matrix by rows of nodes: blocks with the columns of nodes before, and on the diagonal.
  std::vector<Index> row_starts_, row_columns_;
  std::vector<Block> row_blocks_, diagonal_;
  std::vector<double*> entry_;  ///< where each entry of the matrix goes
  // L by columns of nodes, and the inverse of D.
  std::vector<Index> parent_, starts_{0}, ends_, rows_;
  std::vector<Block> blocks_, inverse_;
  // Workspace: one row of L D, the nodes that are in it, and marks of these.
  std::vector<Block> row_;
  std::vector<Index> reach_, mark_;
  std::vector<double> permuted_;
  bool factorized_ = false;
};

}  // namespace ipminmax
