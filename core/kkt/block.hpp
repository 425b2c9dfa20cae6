#pragma once

#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/model/kept.hpp"
#include "core/model/quasi_newton.hpp"
#include "core/options.hpp"
#include "linalg/array.hpp"
#include "linalg/inertia.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Offsets and expected inertias of the KKT matrix; with KktPattern the only place that knows them.
///
///     | W_xx + S_x + d_x I   W_xy                 J_x'        J_yx'      |  x
///     | W_yx                 W_yy - S_y - d_y I   0           J_yy'      |  y
///     | J_x                  0                   -D_x - d_lx  0          |  lambda_x
///     | J_yx                 J_yy                 0           D_y + d_ly |  lambda_y
///
/// Slack rows are eliminated: a slack s of constraint j with barrier curvature S_s leaves the
/// diagonal D_j = 1/S_s (0 for an equality). K is the whole matrix (the paper's J_zz), K_yy its
/// rows and columns (y, lambda_y) (the paper's J_yy).
struct KktLayout {
  IndexRange x, y, lambda_x, lambda_y;  ///< rows of K
  Index x_slacks = 0, y_slacks = 0;     ///< numbers of eliminated rows

  explicit KktLayout(const CanonicalProblem& canonical);

  [[nodiscard]] Index dimension() const { return lambda_y.end; }

  /// Expected inertia with the slack rows counted, as in the paper's (ConsLQAC):
  /// K has (n_x + m_y, n_y + m_x, 0), K_yy has (m_y, n_y, 0), slacks included in n_x and n_y.
  [[nodiscard]] Inertia expected() const;
  [[nodiscard]] Inertia expected_inner() const;
  /// Inertia of the matrix with slack rows from that of the matrix without; the eliminated pivots
  /// are S_x > 0 and -S_y < 0.
  [[nodiscard]] Inertia with_slacks(Inertia reduced) const;
  [[nodiscard]] Inertia with_slacks_inner(Inertia reduced) const;
};

/// Shifts of the diagonal of the KKT matrix (the paper's E(z)): + x and - y on the players'
/// variables, not on slacks; - lambda_x and + lambda_y on the multiplier rows.
struct Regularization {
  double x = 0.0;
  double y = 0.0;
  double lambda_x = 0.0;
  double lambda_y = 0.0;
  double slacks = 0.0;  ///< of Min's slacks
  /// Proximal terms of the players besides, per canonical variable; null: none. The KktSystem's.
  const Eigen::VectorXd *proximal_x = nullptr, *proximal_y = nullptr;
  /// What is added to the diagonal of a variable or constraint of either player.
  [[nodiscard]] double of_variable(Index i, bool max) const {
    return max ? -y - (proximal_y ? (*proximal_y)[i] : 0.0)
               : x + (proximal_x ? (*proximal_x)[i] : 0.0);
  }
  [[nodiscard]] double of_constraint(bool max) const { return max ? lambda_y : -lambda_x; }
  friend bool operator==(const Regularization&, const Regularization&) = default;
};

/// What a factorization of K or K_yy gave, inertia with the slack rows counted, and what its
/// factors are of. They serve until the same matrix is factorized with other values or another
/// shift.
struct KktFactors : Factorization {
  Regularization shift;
  Certainty certainty = Certainty::Certain;  ///< that was asked for
  bool by_schur_complement = false;          ///< K by way of K_yy
  std::uint64_t serial = 0;                  ///< of the factorization in its system; 0: none
};

/// No memory for the factors of a KKT matrix.
class FactorsOutOfMemory : public std::bad_alloc {
 public:
  [[nodiscard]] const char* what() const noexcept override {
    return "out of memory in the factorization of a KKT matrix";
  }
};

/// How the options choose and set up the linear solver.
[[nodiscard]] SymmetricSolverOptions solver_options(const SolverOptions& options);

/// Barrier terms of the primal-dual equations where a matrix was assembled.
struct BarrierTerms {
  struct Bound {
    Index variable;
    double distance, multiplier;
  };
  Eigen::VectorXd curvature;  ///< Sigma per canonical variable, >= 0
  std::vector<Bound> lower, upper;

  /// Those of an iterate; of variables up to begin they are of no interest.
  void take(const CanonicalProblem& canonical, const Iterate& iterate, Index begin);
  /// The curvature given: bounds at distance 1 with these multipliers.
  void take(const Eigen::VectorXd& curvature, Index begin);
  /// Curvature 1 and no bounds.
  void take_none();
};

/// K over all rows, or K_yy over (y, lambda_y).
enum class KktPart : std::uint8_t { Full, Inner };

/// Where the entries of one of the two KKT matrices are.
struct KktPattern {
  KktPattern(KktPart which, const CanonicalProblem& canonical, const KktLayout& layout);

  IndexRange variables, constraints;  ///< canonical, with slacks
  /// Canonical variables or constraints in rows that follow each other as they do.
  struct Run {
    Index first, row, size;
  };
  std::vector<Run> variable_runs, constraint_runs;
  Array<Index> row_of_variable, row_of_constraint;  ///< -1: not in this block
  std::vector<std::int8_t> signs;  ///< expected, of each pivot: x +, y -, lambda_x -, lambda_y +
  std::vector<Index> hessian_entries, jacobian_entries;  ///< triplets that lie in the block
  SymmetricMatrix matrix;  ///< of these, the Hessian's first; without values
};

/// The values of a KktBlock, kept from one to the next.
struct KktBlockArrays {
  KktBlockArrays() = default;  // no aggregate: g++ 12 warns of `= {}` of what holds one

  SymmetricMatrix matrix_;
  Eigen::VectorXd diagonal_;  ///< at zero shift, per row
  BarrierTerms terms_;
  Eigen::VectorXd curvature_;  ///< of the variables, in the values
  // Where there are copies, else empty
  std::vector<double> jacobian_;  ///< see row_jacobian
  Eigen::VectorXd lengths_;       ///< per row: matrix = lengths * KKT matrix * lengths
};

/// One of the two KKT matrices with its solver.
/// Positions of all entries are found once; afterwards only values move.
class KktBlock : Kept<KktBlockArrays> {
 public:
  /// The pattern is that of the canonical problem, or of another one of the same shape. arrays: of
  /// no other block that is in use; null: its own.
  KktBlock(std::shared_ptr<const KktPattern> pattern, const CanonicalProblem& canonical,
           KktBlockArrays* arrays = nullptr);

  [[nodiscard]] const std::shared_ptr<const KktPattern>& pattern() const { return pattern_; }
  [[nodiscard]] bool empty() const { return matrix_.dimension() == 0; }
  /// With a new solver.
  [[nodiscard]] Analysis analyze(const SolverOptions& options);
  /// The analyzed solver, and its use for a block with the same pattern, instead of analyze.
  [[nodiscard]] const std::shared_ptr<SymmetricSolver>& solver() const { return solver_; }
  void adopt(const std::shared_ptr<SymmetricSolver>& solver) {
    solver_ = solver;
    reset_quality();
  }
  /// Solves with the factors that another solver has of matrix().
  void take_factors_of(const std::shared_ptr<SymmetricSolver>& solver) {
    factorized_with_.reset();
    solver_ = solver;
  }

  /// Takes the values of W, J and the barrier terms at zero shift. The matrix stays, and its
  /// factors, where they are those of the last call.
  void assemble(const Iterate& iterate, const Evaluation& evaluation);
  /// The same with the barrier curvatures given.
  void assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature);
  /// After assemble: rows without entries of J count with the expected sign and one as diagonal.
  void decouple(const std::vector<bool>& decoupled);
  /// The barrier terms of the last assemble, of none after assemble_projection.
  [[nodiscard]] const BarrierTerms& barrier_terms() const { return terms_; }
  /// The matrix of least-squares multipliers: W = I for Min, -I for Max, slacks with curvature 1,
  /// no coupling of the players.
  void assemble_projection(const Evaluation& evaluation);

  /// Sets the diagonal of matrix().
  void shift_by(const Regularization& shift);
  /// Whether the last factorize was right with these values, this shift and at least this
  /// certainty.
  [[nodiscard]] bool is_factorized(const Regularization& shift, Certainty certainty) const {
    return factorized_with_ && *factorized_with_ == shift && certainty <= certainty_;
  }
  /// Grows with every change of the values, shifts apart.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  /// Repeated, the last factorization is kept. Throws FactorsOutOfMemory.
  [[nodiscard]] Factorization factorize(const Regularization& shift,
                                        Certainty certainty = Certainty::Certain);
  /// The last factorization, made with this shift, as it is with a certain inertia.
  [[nodiscard]] Factorization make_certain(const Regularization& shift);
  [[nodiscard]] bool increase_quality() {
    factorized_with_.reset();
    return !empty() && solver_->increase_quality();
  }
  /// True: the factors are lost, the next ones will be made with pivoting.
  [[nodiscard]] bool begin_pivoting() {
    if (empty() || !solver_->begin_pivoting()) return false;
    factorized_with_.reset();
    return true;
  }
  void reset_quality() {
    factorized_with_.reset();
    if (!empty()) solver_->reset_quality();
  }

  /// Solution of the reduced system for a right-hand side in rows of this block, in place.
  void solve_in_place(std::span<double> rhs) { solver_->solve_in_place(rhs); }
  /// Rows of the KKT matrix over those of matrix(): equations of a copy are those of its own row,
  /// over sqrt(weight), its multipliers times it.
  [[nodiscard]] double length(Index row) const { return measures_copies() ? lengths_[row] : 1.0; }
  [[nodiscard]] bool measures_copies() const { return lengths_.size() > 0; }

  [[nodiscard]] Index dimension() const { return matrix_.dimension(); }
  /// The matrix of the last factorize, and the expected sign of each pivot.
  [[nodiscard]] const SymmetricMatrix& matrix() const { return matrix_; }
  [[nodiscard]] std::span<const std::int8_t> signs() const { return pattern_->signs; }
  /// Row of a canonical variable or constraint, -1 when it is not in this block.
  [[nodiscard]] Index row_of_variable(Index i) const { return pattern_->row_of_variable[i]; }
  [[nodiscard]] Index row_of_constraint(Index j) const { return pattern_->row_of_constraint[j]; }
  [[nodiscard]] std::span<const KktPattern::Run> variable_runs() const {
    return pattern_->variable_runs;
  }
  [[nodiscard]] std::span<const KktPattern::Run> constraint_runs() const {
    return pattern_->constraint_runs;
  }
  /// Canonical, with slacks.
  [[nodiscard]] IndexRange variables() const { return pattern_->variables; }
  [[nodiscard]] IndexRange constraints() const { return pattern_->constraints; }
  [[nodiscard]] double max_norm_hessian() const { return hessian_norm_; }
  /// What matrix() lacks of W beside its diagonal, as it was assembled; null: nothing.
  [[nodiscard]] const LowRankHessian* low_rank() const { return low_rank_.get(); }

  /// (product_v, product_c) -= [W J'; J 0] (v, lambda), restricted to this block.
  void subtract_product(const Evaluation& evaluation, const Eigen::VectorXd& v,
                        const Eigen::VectorXd& lambda, Eigen::VectorXd& product_v,
                        Eigen::VectorXd& product_c) const;

 private:
  void assemble(const Evaluation& evaluation, std::span<const double> jacobian);
  /// coupled: with W and all of J, else the projection's.
  void set_values(const Evaluation& evaluation, std::span<const double> jacobian, bool coupled);
  void set_lengths(const Iterate& iterate);
  void forget_copies();
  void measure_copies();

  const CanonicalProblem& canonical_;
  std::shared_ptr<const KktPattern> pattern_;
  std::shared_ptr<SymmetricSolver> solver_;
  double hessian_norm_ = 0.0;
  std::shared_ptr<const LowRankHessian> low_rank_;
  std::uint64_t jacobian_call_ = 0, hessian_call_ = 0;  ///< that gave the values, 0 if unknown
  std::uint64_t version_ = 0;
  std::optional<Regularization> factorized_with_;  ///< empty: not these values
  Factorization factorization_;
  Certainty certainty_ = Certainty::Certain;  ///< asked of it
};

}  // namespace ipminmax
