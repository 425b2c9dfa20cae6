#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <vector>

#include "core/kkt/layout.hpp"
#include "core/kkt/schur.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/options.hpp"
#include "core/point/step_length.hpp"
#include "core/result.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Shifts of the diagonal of the KKT matrix (the paper's E(z)): + x and - y on the players'
/// variables, not on slacks; - lambda_x and + lambda_y on the multiplier rows.
struct Regularization {
  double x = 0.0;
  double y = 0.0;
  double lambda_x = 0.0;
  double lambda_y = 0.0;
  friend bool operator==(const Regularization&, const Regularization&) = default;
};

/// No memory for the factors of a KKT matrix.
class FactorsOutOfMemory : public std::bad_alloc {
 public:
  [[nodiscard]] const char* what() const noexcept override {
    return "out of memory in the factorization of a KKT matrix";
  }
};

/// Analyzed solvers of K and K_yy with the options that they were made with.
struct KktAnalysis {
  LinearSolver linear_solver{};
  SymmetricSolverOptions options;
  std::shared_ptr<SymmetricSolver> full, inner;
  std::shared_ptr<SymmetricSolver> second_inner;  ///< by_schur_complement
  SchurComplementUse schur_option{};
  bool by_schur_complement = false;
  bool at_once = false;  ///< SymmetricSolver::work_beside
};

/// One of the two KKT matrices with its solver: K over all rows, or K_yy over (y, lambda_y).
/// Positions of all entries are found once; afterwards only values move.
class KktBlock {
 public:
  enum class Which : std::uint8_t { Full, Inner };

  KktBlock(Which which, const CanonicalProblem& canonical, const KktLayout& layout,
           const SolverOptions& options);

  [[nodiscard]] bool empty() const { return matrix_.dimension() == 0; }
  [[nodiscard]] Analysis analyze();
  /// The analyzed solver, and its use for a block with the same pattern, instead of analyze.
  [[nodiscard]] const std::shared_ptr<SymmetricSolver>& solver() const { return solver_; }
  void adopt(std::shared_ptr<SymmetricSolver> solver);
  /// Solves with the factors that another solver has of matrix().
  void take_factors_of(const std::shared_ptr<SymmetricSolver>& solver) {
    factorized_with_.reset();
    solver_ = solver;
  }

  /// Takes the values of W, J and the barrier curvatures at zero shift. Nothing happens where they
  /// are those of the last call.
  void assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature);
  /// After assemble: rows without entries of J count with the expected sign and one as diagonal.
  void decouple(const std::vector<bool>& constraints);
  /// W = I for Min, -I for Max, no coupling of the players, and the given diagonal on the
  /// multiplier rows (per canonical constraint): the matrix of least-squares multipliers and of
  /// the rank test. Columns of J are multiplied by column_factor, rows by row_factor.
  void assemble_projection(const Evaluation& evaluation, const Eigen::VectorXd& column_factor,
                           const Eigen::VectorXd& row_factor,
                           const Eigen::VectorXd& multiplier_diagonal);

  /// Sets the diagonal of matrix().
  void shift_by(const Regularization& shift);
  /// Whether the last factorize was right with these values and this shift.
  [[nodiscard]] bool is_factorized(const Regularization& shift) const {
    return factorized_with_ && *factorized_with_ == shift;
  }
  /// Grows with every change of the values, shifts apart.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  /// Begins what the next call of factorize with this shift ends; see SymmetricSolver.
  void begin_factorize(const Regularization& shift);
  /// Repeated, the last factorization is kept. Throws FactorsOutOfMemory.
  [[nodiscard]] Factorization factorize(const Regularization& shift);
  /// The last factorization, made with this shift, as it is with a certain inertia.
  [[nodiscard]] Factorization make_certain(const Regularization& shift);
  [[nodiscard]] bool increase_quality() {
    factorized_with_.reset();
    return solver_->increase_quality();
  }
  void reset_quality() {
    factorized_with_.reset();
    if (!empty()) solver_->reset_quality();
  }
  [[nodiscard]] bool pivots() const { return empty() || solver_->pivots(); }
  [[nodiscard]] double perturbation() const { return empty() ? 0.0 : solver_->perturbation(); }
  void require_certain_inertia(bool certain) {
    if (certain == certain_) return;
    factorized_with_.reset();
    certain_ = certain;
    solver_->require_certain_inertia(certain);
  }
  [[nodiscard]] bool inertia_is_certain() const { return certain_; }

  /// Solution of the reduced system for a right-hand side in rows of this block, in place.
  void solve_in_place(std::span<double> rhs) { solver_->solve_in_place(rhs); }

  [[nodiscard]] Index dimension() const { return matrix_.dimension(); }
  /// The matrix of the last factorize, and the expected sign of each pivot.
  [[nodiscard]] const SymmetricMatrix& matrix() const { return matrix_; }
  [[nodiscard]] std::span<const std::int8_t> signs() const { return signs_; }
  /// Row of a canonical variable or constraint, -1 when it is not in this block.
  [[nodiscard]] Index row_of_variable(Index i) const {
    return variable_row_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] Index row_of_constraint(Index j) const {
    return constraint_row_[static_cast<std::size_t>(j)];
  }
  [[nodiscard]] IndexRange variables() const { return variables_; }      ///< canonical, with slacks
  [[nodiscard]] IndexRange constraints() const { return constraints_; }  ///< canonical
  [[nodiscard]] double max_norm_hessian() const { return hessian_norm_; }

  /// (product_v, product_c) -= [W J'; J 0] (v, lambda), restricted to this block.
  void subtract_product(const Evaluation& evaluation, const Eigen::VectorXd& v,
                        const Eigen::VectorXd& lambda, Eigen::VectorXd& product_v,
                        Eigen::VectorXd& product_c) const;

 private:
  const CanonicalProblem& canonical_;
  IndexRange variables_, constraints_;
  std::vector<Index> variable_row_, constraint_row_;
  std::vector<std::int8_t> signs_;
  SymmetricMatrix matrix_;
  std::vector<Index> hessian_entries_, jacobian_entries_;  ///< triplets that lie in the block
  std::vector<Index> positions_;  ///< their places in the matrix, the Hessian's first
  std::vector<double> diagonal_;  ///< at zero shift, per row
  std::shared_ptr<SymmetricSolver> solver_;
  double hessian_norm_ = 0.0;
  std::uint64_t jacobian_call_ = 0, hessian_call_ = 0;  ///< that gave the values, 0 if unknown
  Eigen::VectorXd curvature_;                           ///< of the variables, in the values
  std::uint64_t version_ = 0;
  std::optional<Regularization> factorized_with_;  ///< empty: not these values
  Factorization factorization_;
  bool certain_ = true;
};

/// The Newton system of the primal-dual equations (paper's eq. (interiorpoint)) at one iterate.
class KktSystem {
 public:
  KktSystem(const CanonicalProblem& canonical, const SolverOptions& options, Counts& counts,
            Timing& timing);

  [[nodiscard]] const KktLayout& layout() const { return layout_; }

  /// Orderings and symbolic factorizations; false: out of memory. kept: those of a problem of the
  /// same shape, to be used instead of new ones where the linear solver's options are the same.
  [[nodiscard]] bool analyze(const std::optional<KktAnalysis>& kept = std::nullopt);
  /// For another system of the same shape, when this one is used no more.
  [[nodiscard]] KktAnalysis analysis() const;

  void assemble(const Iterate& iterate, const Evaluation& evaluation);
  /// K_yy alone; K keeps the values of the last assemble, but must not be solved with.
  void assemble_inner(const Iterate& iterate, const Evaluation& evaluation);
  /// Barrier terms of another point than the last assembled one: before solving with a K that was
  /// factorized at this point.
  void take_barrier_terms(const Iterate& iterate);
  /// As assemble, with the barrier curvatures given (certificate). decoupled, per constraint or empty:
  /// equalities that are taken out; their rows of J have to be zero.
  void assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature,
                const std::vector<bool>& decoupled = {});

  /// Factorizes K or K_yy with shifts; inertias count the slack rows.
  /// Where the last factorization had the same values and shift it is kept and not counted.
  [[nodiscard]] Factorization factorize(const Regularization& shift);
  /// Where a certain inertia is required but not of this matrix.
  [[nodiscard]] Factorization factorize_for_solutions(const Regularization& shift);
  [[nodiscard]] Factorization factorize_inner(const Regularization& shift);
  /// The last factorization of K or K_yy, whose inertia Gamma or rounding may have decided, checked
  /// and if need be repeated with pivoting.
  [[nodiscard]] Factorization make_certain();
  [[nodiscard]] Factorization make_inner_certain();
  /// Before factorize_inner and factorize with these shifts: makes both factorizations at the same
  /// time where the linear solver can, and does nothing elsewhere.
  void factorize_ahead(const Regularization& inner, const Regularization& full);
  [[nodiscard]] bool has_expected_inertia(const Factorization& f) const {
    return f.status == FactorizationStatus::Ok && f.inertia == layout_.expected();
  }
  [[nodiscard]] bool has_expected_inner_inertia(const Factorization& f) const {
    return f.status == FactorizationStatus::Ok && f.inertia == layout_.expected_inner();
  }

  /// Solves the unreduced Newton system for the right-hand side with the last factorization of K,
  /// with refinement against the unreduced equations. False: inaccurate.
  [[nodiscard]] bool solve(const Evaluation& evaluation, const NewtonResidual& rhs, Step& step);
  /// The same for the system at zero shift with the factors of a shifted K: refinement has to make up for
  /// the shift.
  [[nodiscard]] bool solve_unshifted(const Evaluation& evaluation, const NewtonResidual& rhs,
                                     Step& step) {
    return solve(full_, {}, evaluation, rhs, step);
  }
  /// The same for the maximizer alone, x held: K_yy's last factorization; the step's other parts
  /// are zero.
  [[nodiscard]] bool solve_inner(const Evaluation& evaluation, const NewtonResidual& rhs,
                                 Step& step);

  /// True when another factorization will be more accurate; factorize anew after it.
  [[nodiscard]] bool increase_quality();
  /// Undoes all calls of increase_quality; the factors are lost.
  void reset_quality();
  /// True for the certificate. False while iterating: with Max variables, for whom many matrices are
  /// factorized, a wrong inertia costs a step; without, it could end or mislead a minimization, and
  /// inertias stay certain.
  void require_certain_inertia(bool certain);
  /// Whether both factorizations pivot, so that their inertias hold for any matrix.
  [[nodiscard]] bool pivots() const { return full_.pivots() && inner_.pivots(); }
  /// By how much eigenvalues of the last factorizations are off.
  [[nodiscard]] double perturbation() const {
    return std::max(full_.perturbation(), inner_.perturbation());
  }

  /// Least-squares multipliers: lambda_y from the y-rows, then lambda_x from the x-rows.
  /// False: the constraints' gradients are dependent or the solve failed.
  [[nodiscard]] bool least_squares_multipliers(const Iterate& iterate, const Evaluation& evaluation,
                                               Eigen::VectorXd& lambda);

  struct RankFinding {
    bool full_min = false;
    bool full_max = false;
    bool vanishing = false;  ///< an active gradient is zero: no constraint qualification at all
  };
  /// Whether the gradients of each player's active constraints are independent. active: per
  /// canonical variable (slacks stand for their inequality).
  [[nodiscard]] RankFinding active_rank(const Evaluation& evaluation,
                                        const std::vector<bool>& active);

  [[nodiscard]] double hessian_norm() const { return full_.max_norm_hessian(); }
  /// Of K and K_yy so far.
  [[nodiscard]] Index factorizations() const {
    return counts_.factorizations_full + counts_.factorizations_inner;
  }

 private:
  [[nodiscard]] Factorization factorize(KktBlock& block, const Regularization& shift, Index& count);
  [[nodiscard]] Factorization factorize(const Regularization& shift, bool by_schur_complement);
  void release_full();
  [[nodiscard]] bool leave_schur_complement();
  void decide_on_schur_complement(const Analysis& full);
  /// A right-hand side or solution restricted to a block: reduced, solved, expanded.
  /// Not refined: once with the factors. Refined: false when no small residual was reached.
  bool solve_reduced(KktBlock& block, const NewtonResidual& rhs, Step& step, bool refined = false);
  void solve_with_factors(KktBlock& block, std::span<double> reduced);
  /// Against the assembled matrix.
  bool solve_refined(KktBlock& block, std::span<double> reduced);
  /// With the matrix of assemble_projection.
  bool solve_projection(const NewtonResidual& rhs, Step& step);
  [[nodiscard]] bool solve(KktBlock& block, const Regularization& shift,
                           const Evaluation& evaluation, const NewtonResidual& rhs, Step& step);
  void subtract_product(const KktBlock& block, const Regularization& shift,
                        const Evaluation& evaluation, const Step& step,
                        NewtonResidual& residual) const;

  const CanonicalProblem& canonical_;
  const SolverOptions& options_;
  Counts& counts_;
  Timing& timing_;
  KktLayout layout_;
  KktBlock full_, inner_;
  std::unique_ptr<KktSchur> schur_;     ///< null: K is factorized as a whole
  bool at_once_ = false;                ///< K and K_yy can be factorized at the same time
  bool by_schur_ = false;               ///< whether K's last factorization is schur_'s
  Inertia inertia_;                     ///< of K, as last factorized
  Regularization shift_, inner_shift_;  ///< of the factorizations at hand
  Eigen::VectorXd curvature_;           ///< barrier curvature Sigma per canonical variable, >= 0
  Eigen::VectorXd distance_lower_, distance_upper_;  ///< to the bounds, 1 where there is none
  Eigen::VectorXd z_lower_, z_upper_;                ///< bound multipliers of the last assemble
  NewtonResidual residual_, last_residual_;
  Step correction_;
  std::vector<double> rhs_;
};

}  // namespace ipminmax
