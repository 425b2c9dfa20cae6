#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/kkt/block.hpp"
#include "core/kkt/schur.hpp"
#include "core/model/budget.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"
#include "core/result.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Analyzed solvers of K and K_yy with the options that they were made with.
struct KktAnalysis {
  LinearSolver linear_solver{};
  SymmetricSolverOptions options;
  std::shared_ptr<SymmetricSolver> full, inner;
  std::shared_ptr<SymmetricSolver> second_inner;  ///< by_schur_complement
  SchurComplementUse schur_option{};
  bool by_schur_complement = false;
  std::shared_ptr<const KktPattern> full_pattern, inner_pattern;
};

/// What a KktSystem works with, kept from one to the next.
struct KktArrays {
  KktBlockArrays full_arrays_, inner_arrays_;
  Eigen::VectorXd reduced_;     ///< right-hand side and solution in the rows of a block
  Eigen::VectorXd eliminated_;  ///< bound multipliers' part of the variables' rows
  // Refinement, and least-squares multipliers
  NewtonResidual residual_, last_residual_;
  Step correction_;
  // The same against the assembled matrix, in its rows
  Eigen::VectorXd reduced_rhs_, reduced_residual_;
  Eigen::VectorXd proximal_;  ///< of proximal_curvature
};

/// What of a solution is accurate enough for its use, where the options' residual_ratio_max asks
/// for more than that: either of the two.
struct Accuracy {
  double ratio = 0.0;     ///< of the residual to right-hand side and solution
  double residual = 0.0;  ///< itself
  /// And the rows of variables and constraints, each beside its own right-hand side.
  bool by_rows = true;
};
inline constexpr Accuracy kUnrefined{.ratio = 1.0};  ///< as the factors give it

/// What a KktSystem may take over of earlier ones.
struct KeptKkt {
  const KktAnalysis* analysis = nullptr;  ///< of a problem of the same shape
  KktArrays* arrays = nullptr;            ///< of no other system that is in use
};

/// The Newton system of the primal-dual equations (paper's eq. (interiorpoint)) at one iterate.
class KktSystem : Kept<KktArrays> {
 public:
  /// limit: told when a factorization is refused; null for none. kept.analysis: solvers, to be used
  /// instead of new ones where the linear solver's options are the same.
  KktSystem(const CanonicalProblem& canonical, const SolverOptions& options, Counts& counts,
            Timing& timing, SolveLimit* limit = nullptr, const KeptKkt& kept = {});
  [[nodiscard]] const KktLayout& layout() const { return layout_; }

  /// Orderings and symbolic factorizations; false: out of memory.
  [[nodiscard]] bool analyze();
  /// For another system of the same shape, when this one is used no more.
  [[nodiscard]] KktAnalysis analysis() const;

  void assemble(const Iterate& iterate, const Evaluation& evaluation);
  /// K_yy alone; K keeps the values of the last assemble, and its factors.
  void assemble_inner(const Iterate& iterate, const Evaluation& evaluation);
  /// As assemble, with the barrier curvatures given (certificate). decoupled, per constraint or
  /// empty: equalities that are taken out; their rows of J have to be zero.
  void assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature,
                const std::vector<bool>& decoupled = {});

  /// What factorizations are counted for while it lives; before and after, what they were.
  class Counting : Uncopied {
   public:
    Counting(KktSystem& kkt, FactorizationCause cause)
        : cause_(kkt.cause_), before_(std::exchange(cause_, cause)) {}
    ~Counting() { cause_ = before_; }

   private:
    FactorizationCause& cause_;
    FactorizationCause before_;
  };

  /// Factorizes K or K_yy with shifts; inertias count the slack rows.
  /// Where the last factorization had the same values and shift it is kept and not counted.
  /// Usual while iterating: with Max variables, for whom many matrices are factorized, a wrong
  /// inertia costs a step. Without, it could end or mislead a minimization: Usual is then Certain.
  [[nodiscard]] KktFactors factorize(const Regularization& shift,
                                     Certainty certainty = Certainty::Certain);
  /// K where only solutions are wanted of it. certainty: of K_yy's inertia or, where K is
  /// factorized as a whole, of K's.
  [[nodiscard]] KktFactors factorize_for_solutions(const Regularization& shift,
                                                   Certainty certainty = Certainty::Certain);
  [[nodiscard]] KktFactors factorize_inner(const Regularization& shift,
                                           Certainty certainty = Certainty::Certain);
  /// The last factorization of K or K_yy, whose inertia Gamma or rounding may have decided, checked
  /// and if need be repeated with pivoting.
  [[nodiscard]] KktFactors make_certain();
  /// The last factors of K and of K_yy.
  [[nodiscard]] const KktFactors& factors() const { return full_factors_; }
  [[nodiscard]] const KktFactors& inner_factors() const { return inner_factors_; }
  /// Whether these are the factors at hand, of K or of K_yy.
  [[nodiscard]] bool are_current(const KktFactors& factors) const {
    return factors.serial != 0 && factors.serial == full_factors_.serial;
  }
  [[nodiscard]] bool are_current_inner(const KktFactors& factors) const {
    return factors.serial != 0 && factors.serial == inner_factors_.serial;
  }
  [[nodiscard]] bool has_expected_inertia(const Factorization& f) const {
    return f.status == FactorizationStatus::Ok && f.inertia == layout_.expected();
  }
  [[nodiscard]] bool has_expected_inner_inertia(const Factorization& f) const {
    return f.status == FactorizationStatus::Ok && f.inertia == layout_.expected_inner();
  }

  /// Solves the unreduced Newton system for the right-hand side with factors of K, with refinement
  /// against the unreduced equations where K was assembled. False: inaccurate, or the factors are
  /// not current.
  [[nodiscard]] bool solve(const KktFactors& factors, const Evaluation& evaluation,
                           const NewtonResidual& rhs, Step& step, const Accuracy& accuracy = {});
  /// With the last factors of K.
  [[nodiscard]] bool solve(const Evaluation& evaluation, const NewtonResidual& rhs, Step& step,
                           const Accuracy& accuracy = {}) {
    return solve(full_factors_, evaluation, rhs, step, accuracy);
  }
  /// The same for the system at zero shift with the factors of a shifted K: refinement has to make
  /// up for the shift.
  [[nodiscard]] bool solve_unshifted(const Evaluation& evaluation, const NewtonResidual& rhs,
                                     Step& step, const Accuracy& accuracy = {}) {
    return solve(full_, {}, evaluation, rhs, step, accuracy);
  }
  /// The same for the maximizer alone, x held, with factors of K_yy; the step's other parts are
  /// zero.
  [[nodiscard]] bool solve_inner(const KktFactors& factors, const Evaluation& evaluation,
                                 const NewtonResidual& rhs, Step& step,
                                 const Accuracy& accuracy = {});
  [[nodiscard]] bool solve_inner(const Evaluation& evaluation, const NewtonResidual& rhs,
                                 Step& step, const Accuracy& accuracy = {}) {
    return solve_inner(inner_factors_, evaluation, rhs, step, accuracy);
  }

  /// What a solution has to reach in the end, or it is none.
  [[nodiscard]] Accuracy least_accuracy() const {
    return {.ratio = options_.residual_ratio_singular};
  }

  /// True when another factorization will be more accurate; factorize anew after it.
  [[nodiscard]] bool increase_quality();
  /// Only pivoting factorizations from now on, where the linear solver has the choice; factorize
  /// anew.
  void begin_pivoting();
  /// Undoes all calls of increase_quality and begin_pivoting; the factors are lost.
  void reset_quality();
  /// Whether both of the last factorizations were pivoted, so that their inertias hold for any
  /// matrix.
  [[nodiscard]] bool pivots() const {
    return full_factors_.trust.pivoted && inner_factors_.trust.pivoted;
  }
  /// By how much eigenvalues of the last factorizations are off.
  [[nodiscard]] double perturbation() const {
    return std::max(full_factors_.trust.perturbation, inner_factors_.trust.perturbation);
  }

  /// Least-squares multipliers: lambda_y from the y-rows, then lambda_x from the x-rows.
  /// False: the constraints' gradients are dependent or the solve failed.
  [[nodiscard]] bool least_squares_multipliers(const Iterate& iterate, const Evaluation& evaluation,
                                               Eigen::VectorXd& lambda);

  /// That share of the curvature of each variable; of one without curvature, of that which it
  /// would get by elimination of others: the same in all units of the model. Of one that nothing
  /// measures the share of the largest entry of W, of x of its rows of x.
  /// Valid until the next call.
  [[nodiscard]] const Eigen::VectorXd* proximal_curvature(const Evaluation& evaluation,
                                                          double share);

  /// How many more are allowed; further ones fail, and the limit is exceeded.
  [[nodiscard]] Index factorizations_left() const {
    if (limit_ == nullptr) return std::numeric_limits<Index>::max();
    return limit_->factorizations_now() - factorizations() -
           counts_.factorizations_for(FactorizationCause::Restoration).full;
  }

  /// Whether the limit of time is exceeded.
  [[nodiscard]] bool is_over() const { return limit_ != nullptr && limit_->expired(); }

  [[nodiscard]] double hessian_norm() const { return full_.max_norm_hessian(); }
  /// Of K and K_yy so far.
  [[nodiscard]] Index factorizations() const {
    return counts_.factorizations_full + counts_.factorizations_inner;
  }

 private:
  /// Where a part of the work takes longer than reading the clock.
  [[nodiscard]] double* timed(double& total) const {
    constexpr Index kLeastRows = 17;
    return layout_.dimension() >= kLeastRows ? &total : nullptr;
  }
  [[nodiscard]] Certainty needed(Certainty asked) const {
    return inner_.empty() ? Certainty::Certain : asked;
  }
  [[nodiscard]] Factorization factorize(KktBlock& block, const Regularization& shift,
                                        Certainty certainty);
  [[nodiscard]] bool may_factorize();
  void count_factorizations(Index full, Index inner);
  /// What make(factorized) gives, its factorizations of K_yy counted; Failed: none is left.
  template <class Make>
  [[nodiscard]] auto counted(const Make& make);
  [[nodiscard]] KktFactors factorize_full(const Regularization& shift, Certainty certainty,
                                          bool by_schur_complement);
  /// The factors at hand from now on: made again, or kept under their number.
  const KktFactors& hold(KktFactors& at_hand, const Factorization& result, bool kept);
  void release_full();
  /// All of K and those of K_yy that the Schur complement has; full, inner: those of the system.
  void forget_factors(bool full, bool inner);
  [[nodiscard]] std::shared_ptr<const KktPattern> pattern_of(KktPart which) const;
  [[nodiscard]] bool analyze_or_adopt();
  void decide_on_schur_complement(const Analysis& full);
  [[nodiscard]] double slack_curvature(const KktBlock& block, const Regularization& shift,
                                       Index slack) const;
  void eliminate(KktBlock& block, const Regularization& shift, const NewtonResidual& rhs);
  void expand(KktBlock& block, const Regularization& shift, const NewtonResidual& rhs,
              Step& step) const;
  /// A right-hand side or solution restricted to a block: reduced, solved, expanded.
  /// Not refined: once with the factors. Refined: false when no small residual was reached.
  bool solve_reduced(KktBlock& block, const Regularization& shift, const NewtonResidual& rhs,
                     Step& step, bool refined = false);
  void solve_with_factors(KktBlock& block, std::span<double> reduced);
  void add_low_rank(KktBlock& block, std::span<double> solution);
  /// Against the assembled matrix.
  bool solve_refined(KktBlock& block, std::span<double> reduced);
  /// With the matrix of assemble_projection.
  bool solve_projection(const NewtonResidual& rhs, Step& step);
  [[nodiscard]] bool solve(KktBlock& block, const Regularization& shift,
                           const Evaluation& evaluation, const NewtonResidual& rhs, Step& step,
                           const Accuracy& accuracy);
  void subtract_product(const KktBlock& block, const Regularization& shift,
                        const Evaluation& evaluation, const Step& step, NewtonResidual& residual);

  const CanonicalProblem& canonical_;
  const SolverOptions& options_;
  Counts& counts_;
  Timing& timing_;
  SolveLimit* limit_;
  const KktAnalysis* kept_analysis_;
  FactorizationCause cause_ = FactorizationCause::Step;
  KktLayout layout_;
  KktBlock full_, inner_;
  std::unique_ptr<KktSchur> schur_;          ///< null: K is factorized as a whole
  KktFactors full_factors_, inner_factors_;  ///< at hand
  std::uint64_t factorizations_ = 0;
  struct {
    std::uint64_t serial = 0;            ///< of the factors of K_0 that these are of
    Eigen::MatrixXd columns, solutions;  ///< C in the rows of K, K_0^-1 C
    Eigen::FullPivLU<Eigen::MatrixXd> small;
  } low_rank_factors_;
};

/// First multipliers of the constraints at a point with first derivatives and bound multipliers: by
/// least squares, dropped when above constr_mult_init_max [WB, 3.6], those of robust constraints
/// from their slacks.
void start_multipliers(const CanonicalProblem& canonical, KktSystem& kkt,
                       const SolverOptions& options, Point& point);

}  // namespace ipminmax
