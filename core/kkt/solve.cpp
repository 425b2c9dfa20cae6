#include <algorithm>
#include <cmath>

#include "core/kkt/system.hpp"
#include "core/model/budget.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

// Solutions with the factors of K and K_yy: elimination, refinement.

namespace {

/// Residual over the scale of the system that a row may keep.
constexpr double kRoundingOfRow = 1e-15;
/// Size of a solution over that of its right-hand side up to which it counts in the scale.
constexpr double kLongestSolution = 1e6;

template <class Vector>
double infinity_norm(const Vector& v) {
  return v.size() == 0 ? 0.0 : v.template lpNorm<Eigen::Infinity>();
}

/// Largest entries of a right-hand side, residual or solution.
struct Sizes {
  double v = 0.0, lambda = 0.0, z = 0.0;
  [[nodiscard]] double all() const { return largest(largest(v, lambda), z); }
};

/// The tails of canonical vectors, which a block owns.
class OwnPart {
 public:
  explicit OwnPart(const KktBlock& block)
      : terms_(block.barrier_terms()),
        begin_v_(block.variables().begin),
        begin_lambda_(block.constraints().begin),
        n_(block.variables().size()),
        m_(block.constraints().size()) {}

  void clear_rest(Step& s) const {
    s.v.head(begin_v_).setZero();
    s.lambda.head(begin_lambda_).setZero();
    s.z_lower.head(begin_v_).setZero();
    s.z_upper.head(begin_v_).setZero();
  }
  [[nodiscard]] Sizes sizes(const Step& s) const {
    Sizes found{.v = infinity_norm(s.v.tail(n_)), .lambda = infinity_norm(s.lambda.tail(m_))};
    for (const auto& [i, distance, z] : terms_.lower)
      found.z = largest(found.z, std::abs(s.z_lower[i]));
    for (const auto& [i, distance, z] : terms_.upper)
      found.z = largest(found.z, std::abs(s.z_upper[i]));
    return found;
  }
  void copy(const Step& from, Step& to) const {
    copy_equations(from, to);
    for (const auto& [i, distance, z] : terms_.lower) to.z_lower[i] = from.z_lower[i];
    for (const auto& [i, distance, z] : terms_.upper) to.z_upper[i] = from.z_upper[i];
  }
  void add(double factor, const Step& correction, Step& step) const {
    step.v.tail(n_) += factor * correction.v.tail(n_);
    step.lambda.tail(m_) += factor * correction.lambda.tail(m_);
    for (const auto& [i, distance, z] : terms_.lower)
      step.z_lower[i] += factor * correction.z_lower[i];
    for (const auto& [i, distance, z] : terms_.upper)
      step.z_upper[i] += factor * correction.z_upper[i];
  }
  /// Rows of the variables and constraints.
  void copy_equations(const NewtonResidual& from, NewtonResidual& to) const {
    to.v.tail(n_) = from.v.tail(n_);
    to.lambda.tail(m_) = from.lambda.tail(m_);
  }
  /// A few modes that Gamma spoils are left: the multiple of the last correction d with the
  /// smallest residual, from K d = last - residual, which last becomes.
  [[nodiscard]] double best_multiple(const NewtonResidual& residual, NewtonResidual& last) const {
    auto product_v = last.v.tail(n_);
    auto product_lambda = last.lambda.tail(m_);
    product_v -= residual.v.tail(n_);
    product_lambda -= residual.lambda.tail(m_);
    return (residual.v.tail(n_).dot(product_v) + residual.lambda.tail(m_).dot(product_lambda)) /
           (product_v.squaredNorm() + product_lambda.squaredNorm());
  }

 private:
  const BarrierTerms& terms_;
  Index begin_v_, begin_lambda_, n_, m_;
};

/// Beside long steps of the multipliers small rows are overlooked, which Newton's method needs.
bool rows_are_small(const Sizes& residual, const Sizes& rhs, double scale) {
  constexpr double kLeft = 1e-2;
  const double rounding = kRoundingOfRow * scale;
  return residual.v <= kLeft * rhs.v + rounding && residual.lambda <= kLeft * rhs.lambda + rounding;
}

}  // namespace

void KktSystem::solve_with_factors(KktBlock& block, std::span<double> reduced) {
  if (full_factors_.by_schur_complement && &block == &full_) {
    schur_->solve_in_place(reduced);
  } else if (!block.empty()) {
    block.solve_in_place(reduced);
    if (block.low_rank() != nullptr) add_low_rank(block, reduced);
  }
}

/// With C in the rows of K, K = K_0 - C M^-1 C', so that (Woodbury)
///   K^-1 r = K_0^-1 r + Z (M - C' Z)^-1 C' K_0^-1 r,  Z = K_0^-1 C.
void KktSystem::add_low_rank(KktBlock& block, std::span<double> solution) {
  const LowRankHessian& low_rank = *block.low_rank();
  const Eigen::Index columns = low_rank.columns.cols();
  if (columns == 0) return;
  if (low_rank_factors_.serial != full_factors_.serial) {
    low_rank_factors_.serial = full_factors_.serial;
    Eigen::MatrixXd& c = low_rank_factors_.columns;
    c.setZero(block.dimension(), columns);
    for (const Index i : indices(block.variables())) {
      if (const Index row = block.row_of_variable(i); row >= 0)
        c.row(row) = low_rank.columns.row(i);
    }
    Eigen::MatrixXd& z = low_rank_factors_.solutions;
    z = c;
    for (Eigen::Index k = 0; k < columns; ++k) {
      block.solve_in_place({z.col(k).data(), at(block.dimension())});
    }
    low_rank_factors_.small.compute(low_rank.middle - c.transpose() * z);
  }
  Eigen::Map<Eigen::VectorXd> r(solution.data(), block.dimension());
  r += low_rank_factors_.solutions *
       low_rank_factors_.small.solve(low_rank_factors_.columns.transpose() * r);
}

bool KktSystem::solve_refined(KktBlock& block, std::span<double> reduced) {
  const auto size = static_cast<Eigen::Index>(reduced.size());
  Eigen::Map<Eigen::VectorXd> solution(reduced.data(), size);
  reduced_residual_ = reduced_rhs_ = solution;
  solution.setZero();
  double last_ratio = kInfinity;
  for (Index k = 0;; ++k) {
    const double scale = infinity_norm(reduced_rhs_) + infinity_norm(solution);
    const double ratio = scale > 0.0 ? infinity_norm(reduced_residual_) / scale : 0.0;
    if (ratio <= options_.residual_ratio_max) return true;
    // An overflow is no progress either.
    if (k > options_.max_refinement_steps || !(ratio <= parameters::kProgress * last_ratio))
      return false;
    last_ratio = ratio;
    solve_with_factors(block, {reduced_residual_.data(), reduced.size()});
    solution += reduced_residual_;
    block.matrix().multiply(reduced, {reduced_residual_.data(), reduced.size()});
    reduced_residual_ = reduced_rhs_ - reduced_residual_;
  }
}

/// Sign times Sigma of a slack, with the shift of Min's.
double KktSystem::slack_curvature(const KktBlock& block, const Regularization& shift,
                                  Index slack) const {
  const double sign = canonical_.sign(slack);
  return sign * block.barrier_terms().curvature[slack] + (sign > 0.0 ? shift.slacks : 0.0);
}

/// Bound multipliers: S dz_l + z_l dv = r, S dz_u - z_u dv = r, so that the variables' rows read
///   (W + sign Sigma) dv + J' dlambda = r_v + sign (r_zl / S_l - r_zu / S_u) =: t.
/// Slack s of constraint j: sign Sigma_s ds - dlambda_j = t_s.
void KktSystem::eliminate(KktBlock& block, const Regularization& shift, const NewtonResidual& rhs) {
  const BarrierTerms& at_point = block.barrier_terms();
  Eigen::VectorXd& t = eliminated_;
  t.setZero();
  for (const auto& [i, distance, z] : at_point.lower) t[i] = rhs.z_lower[i] / distance;
  for (const auto& [i, distance, z] : at_point.upper) t[i] -= rhs.z_upper[i] / distance;
  const IndexRange variables = block.variables(), constraints = block.constraints();
  const Index of_min = canonical_.y().begin - variables.begin, of_max = variables.size() - of_min;
  t.segment(variables.begin, of_min) += rhs.v.segment(variables.begin, of_min);
  t.tail(of_max) = rhs.v.tail(of_max) - t.tail(of_max);
  for (const auto& run : block.variable_runs()) {
    reduced_.segment(run.row, run.size) = t.segment(run.first, run.size);
  }
  for (const auto& run : block.constraint_runs()) {
    reduced_.segment(run.row, run.size) = rhs.lambda.segment(run.first, run.size);
  }
  for (const Index j : indices(constraints)) {
    if (const Index slack = canonical_.slack_of(j); slack >= 0) {
      reduced_[block.row_of_constraint(j)] += t[slack] / slack_curvature(block, shift, slack);
    }
  }
}

/// The step of all variables and multipliers from that of the reduced system.
void KktSystem::expand(KktBlock& block, const Regularization& shift, const NewtonResidual& rhs,
                       Step& step) const {
  const BarrierTerms& at_point = block.barrier_terms();
  for (const auto& run : block.variable_runs()) {
    step.v.segment(run.first, run.size) = reduced_.segment(run.row, run.size);
  }
  for (const auto& run : block.constraint_runs()) {
    step.lambda.segment(run.first, run.size) = reduced_.segment(run.row, run.size);
  }
  const IndexRange variables = block.variables(), constraints = block.constraints();
  for (const Index j : indices(constraints)) {
    if (const Index slack = canonical_.slack_of(j); slack >= 0) {
      step.v[slack] = (eliminated_[slack] + step.lambda[j]) / slack_curvature(block, shift, slack);
    }
  }
  step.z_lower.tail(variables.size()).setZero();
  step.z_upper.tail(variables.size()).setZero();
  for (const auto& [i, distance, z] : at_point.lower)
    step.z_lower[i] = (rhs.z_lower[i] - z * step.v[i]) / distance;
  for (const auto& [i, distance, z] : at_point.upper)
    step.z_upper[i] = (rhs.z_upper[i] + z * step.v[i]) / distance;
}

bool KktSystem::solve_reduced(KktBlock& block, const Regularization& shift,
                              const NewtonResidual& rhs, Step& step, bool refined) {
  eliminate(block, shift, rhs);
  const std::span<double> reduced(reduced_.data(), at(block.dimension()));
  const auto in_lengths = [&] {
    if (!block.measures_copies()) return;
    for (Index row = 0; row < block.dimension(); ++row) reduced[at(row)] *= block.length(row);
  };
  in_lengths();
  bool ok = true;
  if (refined) {
    ok = solve_refined(block, reduced);
  } else {
    solve_with_factors(block, reduced);
  }
  in_lengths();
  expand(block, shift, rhs, step);
  return ok;
}

void KktSystem::subtract_product(const KktBlock& block, const Regularization& shift,
                                 const Evaluation& evaluation, const Step& step,
                                 NewtonResidual& residual) {
  const BarrierTerms& at_point = block.barrier_terms();
  block.subtract_product(evaluation, step.v, step.lambda, residual.v, residual.lambda);
  Eigen::VectorXd& dz = eliminated_;
  dz.setZero();
  for (const auto& [i, distance, z] : at_point.lower) {
    dz[i] = -step.z_lower[i];
    residual.z_lower[i] -= z * step.v[i] + distance * step.z_lower[i];
  }
  for (const auto& [i, distance, z] : at_point.upper) {
    dz[i] += step.z_upper[i];
    residual.z_upper[i] -= distance * step.z_upper[i] - z * step.v[i];
  }
  const bool shifted = shift != Regularization{};
  const IndexRange variables = block.variables();
  const Index of_max = canonical_.max_size();
  dz.tail(of_max) = -dz.tail(of_max);
  for (Index i = variables.begin; shifted && i < variables.end; ++i) {
    const Index row = block.row_of_variable(i);
    if (row < 0) continue;
    const double length = block.length(row);
    dz[i] += shift.of_variable(i, canonical_.owned_by_max(i)) / (length * length) * step.v[i];
  }
  residual.v.tail(variables.size()) -= dz.tail(variables.size());
  for (const Index j : indices(block.constraints())) {
    if (shifted) {
      const double delta = shift.of_constraint(canonical_.max_constraints().contains(j));
      const double length = block.length(block.row_of_constraint(j));
      residual.lambda[j] -= delta / (length * length) * step.lambda[j];
    }
    if (const Index slack = canonical_.slack_of(j); slack >= 0) {
      residual.lambda[j] += step.v[slack];
      residual.v[slack] += step.lambda[j];
      if (canonical_.sign(slack) > 0.0) residual.v[slack] -= shift.slacks * step.v[slack];
    }
  }
}

bool KktSystem::solve(KktBlock& block, const Regularization& shift, const Evaluation& evaluation,
                      const NewtonResidual& rhs, Step& step, const Accuracy& accuracy) {
  const ScopedTimer timer(timed(timing_.solves));
  ++counts_.solves;
  const OwnPart own(block);
  own.clear_rest(step);
  solve_reduced(block, shift, rhs, step);
  if (accuracy.ratio >= 1.0) return true;
  const Sizes of_rhs = own.sizes(rhs);
  Sizes of_residual;
  double scale = 0.0;
  const auto residual_ratio = [&] {
    own.copy(rhs, residual_);
    subtract_product(block, shift, evaluation, step, residual_);
    of_residual = own.sizes(residual_);
    scale = std::min(own.sizes(step).all(), kLongestSolution * of_rhs.all()) + of_rhs.all();
    return scale > 0.0 ? of_residual.all() / scale : 0.0;
  };
  // Of minimizations: Ipopt refines once whatever residual_ratio_max allows, and beside long steps
  // of the multipliers 1e-10 leaves the other rows inaccurate.
  const double asked = inner_.empty() ? std::min(options_.residual_ratio_max, parameters::kRounding)
                                      : options_.residual_ratio_max;
  const double enough = std::max(asked, accuracy.ratio);
  const auto is_enough = [&](double ratio) {
    return (ratio <= enough || of_residual.all() <= accuracy.residual) &&
           (!accuracy.by_rows || rows_are_small(of_residual, of_rhs, scale));
  };
  // Refinement: stops at what is enough, or when the residual no longer falls.
  constexpr double kSlow = 0.1;  // over the last ratio
  double last_ratio = kInfinity;
  for (Index k = 0;; ++k) {
    double ratio = residual_ratio();
    if (std::isfinite(ratio) && ratio > kSlow * last_ratio) {
      const double more = own.best_multiple(residual_, last_residual_);
      if (std::isfinite(more)) {
        own.add(more, correction_, step);
        ratio = residual_ratio();
      }
    }
    if (!std::isfinite(ratio)) return false;
    if (is_enough(ratio)) return true;
    if (k == options_.max_refinement_steps || ratio > parameters::kProgress * last_ratio) {
      return std::min(ratio, last_ratio) <= options_.residual_ratio_singular;
    }
    last_ratio = ratio;
    own.copy_equations(residual_, last_residual_);
    solve_reduced(block, shift, residual_, correction_);
    own.add(1.0, correction_, step);
  }
}

bool KktSystem::solve(const KktFactors& factors, const Evaluation& evaluation,
                      const NewtonResidual& rhs, Step& step, const Accuracy& accuracy) {
  return are_current(factors) && solve(full_, full_factors_.shift, evaluation, rhs, step, accuracy);
}

bool KktSystem::solve_inner(const KktFactors& factors, const Evaluation& evaluation,
                            const NewtonResidual& rhs, Step& step, const Accuracy& accuracy) {
  return are_current_inner(factors) &&
         solve(inner_, inner_factors_.shift, evaluation, rhs, step, accuracy);
}

// Least-squares multipliers.

bool KktSystem::solve_projection(const NewtonResidual& rhs, Step& step) {
  for (;;) {
    if (factorize_for_solutions({}, needed(Certainty::Usual)).status != FactorizationStatus::Ok)
      return false;
    {
      const ScopedTimer timer(timed(timing_.solves));
      ++counts_.solves;
      if (solve_reduced(full_, {}, rhs, step, true)) return true;
    }
    if (!increase_quality()) return false;
  }
}

bool KktSystem::least_squares_multipliers(const Iterate& iterate, const Evaluation& evaluation,
                                          Eigen::VectorXd& lambda) {
  // [I A'; A 0] (d, lambda) = (-g, 0) for each player, slacks with curvature 1:
  // first lambda_y from the y-rows, then lambda_x with J_yx' lambda_y on the right-hand side.
  lambda.setZero(canonical_.constraints());
  if (canonical_.constraints() == 0) return true;
  const Counting counting(*this, FactorizationCause::Multipliers);
  full_.assemble_projection(evaluation);
  release_full();
  NewtonResidual& rhs = residual_;
  Step& step = correction_;
  set_zero(canonical_, rhs);
  set_zero(canonical_, step);
  for (const bool max : {true, false}) {
    const IndexRange variables = {max ? canonical_.y().begin : 0,
                                  max ? canonical_.variables() : canonical_.y().begin};
    rhs.v.setZero();
    for (const Index i : indices(variables)) {
      rhs.v[i] =
          -evaluation.gradient[i] - canonical_.sign(i) * (iterate.z_upper[i] - iterate.z_lower[i]);
    }
    if (max && canonical_.has_copies()) {  // what copies maximize
      for (const std::size_t k : canonical_.owners().own_entries) {
        const Index i = canonical_.jacobian()[k].col;
        rhs.v[i] -= evaluation.jacobian[k] *
                    CanonicalProblem::signed_weight(canonical_.robust_slack(i), iterate);
      }
    }
    if (!max) {
      const auto jacobian = canonical_.jacobian();
      for (const auto k : indices(jacobian)) {
        const auto [row, col] = jacobian[k];
        if (canonical_.max_constraints().contains(row) && !canonical_.owned_by_max(col)) {
          rhs.v[col] -= evaluation.jacobian[k] * lambda[row];
        }
      }
    }
    // Where Gamma is the pivot of a multiplier, little of I is left in the factors.
    if (!solve_projection(rhs, step)) return false;
    const IndexRange own = max ? canonical_.max_constraints() : canonical_.min_constraints();
    for (const Index j : indices(own)) lambda[j] = step.lambda[j];
  }
  return lambda.allFinite();
}

const Eigen::VectorXd* KktSystem::proximal_curvature(const Evaluation& evaluation, double share) {
  const Index n = canonical_.variables(), y = canonical_.y().begin;
  // Zero where it is not known; constraints are numbered after the variables.
  Step &known = residual_, &found = correction_;
  set_zero(known);
  const auto of = [&](Step& sizes, Index i) -> double& {
    return i < n ? sizes.v[i] : sizes.lambda[i - n];
  };
  const auto take = [&](Index i, Index j, double entry) {
    // What rows would give x by elimination has no bound where Max has no room left.
    if (entry == 0.0 || (i < y && j >= n)) return;
    double& fill = of(found, i);
    if (i == j) fill = std::abs(entry);
    const double size = of(known, j);
    if (of(known, i) > 0.0 || size == 0.0) return;
    const double eliminated = entry * (entry / size);
    fill = fill > 0.0 ? std::min(fill, eliminated) : eliminated;
  };
  const auto take_all = [&](Index first, const auto& entries, const std::vector<double>& values) {
    for (const auto k : indices(values)) {
      take(first + entries[k].row, entries[k].col, values[k]);
      take(entries[k].col, first + entries[k].row, values[k]);
    }
  };
  constexpr int kSweeps = 6;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    found = known;
    take_all(0, canonical_.hessian(), evaluation.hessian);
    take_all(n, canonical_.jacobian(), evaluation.jacobian);
    if (found.v == known.v && found.lambda == known.lambda) break;
    known = found;
  }
  double largest_x = 0.0, largest = 0.0;
  for (const auto k : indices(evaluation.hessian)) {
    const double entry = std::abs(evaluation.hessian[k]);
    largest = std::max(largest, entry);
    if (canonical_.hessian()[k].col < y) largest_x = std::max(largest_x, entry);
  }
  if (largest == 0.0) largest = 1.0;  // f may be constant: any will do
  if (largest_x == 0.0) largest_x = largest;
  for (Index i = 0; i < n; ++i)
    proximal_[i] = share * (known.v[i] > 0.0 ? known.v[i] : i < y ? largest_x : largest);
  return &proximal_;
}

void start_multipliers(const CanonicalProblem& canonical, KktSystem& kkt,
                       const SolverOptions& options, Point& point) {
  Iterate& iterate = point.iterate;
  const bool known = canonical.constraints() > 0 && options.constr_mult_init_max > 0.0 &&
                     kkt.least_squares_multipliers(iterate, point.evaluation, iterate.lambda) &&
                     max_norm(iterate.lambda) <= options.constr_mult_init_max;
  if (!known) start_constraint_multipliers(canonical, options, iterate);
  start_robust_multipliers(canonical, iterate);
}

}  // namespace ipminmax
