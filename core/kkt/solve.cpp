#include <algorithm>
#include <cmath>

#include "core/kkt/system.hpp"
#include "core/model/budget.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "linalg/numbers.hpp"

// Solutions with the factors of K and K_yy: elimination, refinement.

namespace ipminmax {
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
    for (const Index i : terms_.lower) found.z = largest(found.z, std::abs(s.z_lower[i]));
    for (const Index i : terms_.upper) found.z = largest(found.z, std::abs(s.z_upper[i]));
    return found;
  }
  void copy(const Step& from, Step& to) const {
    copy_equations(from, to);
    for (const Index i : terms_.lower) to.z_lower[i] = from.z_lower[i];
    for (const Index i : terms_.upper) to.z_upper[i] = from.z_upper[i];
  }
  void add(double factor, const Step& correction, Step& step) const {
    step.v.tail(n_) += factor * correction.v.tail(n_);
    step.lambda.tail(m_) += factor * correction.lambda.tail(m_);
    for (const Index i : terms_.lower) step.z_lower[i] += factor * correction.z_lower[i];
    for (const Index i : terms_.upper) step.z_upper[i] += factor * correction.z_upper[i];
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
  product_.resize(size);
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
    block.matrix().multiply(reduced, {product_.data(), reduced.size()});
    reduced_residual_ = reduced_rhs_ - product_;
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
  for (const Index i : at_point.lower) t[i] = rhs.z_lower[i] / at_point.distance_lower[i];
  for (const Index i : at_point.upper) t[i] -= rhs.z_upper[i] / at_point.distance_upper[i];
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
  for (const Index i : at_point.lower) {
    step.z_lower[i] =
        (rhs.z_lower[i] - at_point.z_lower[i] * step.v[i]) / at_point.distance_lower[i];
  }
  for (const Index i : at_point.upper) {
    step.z_upper[i] =
        (rhs.z_upper[i] + at_point.z_upper[i] * step.v[i]) / at_point.distance_upper[i];
  }
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
  for (const Index i : at_point.lower) {
    dz[i] = -step.z_lower[i];
    residual.z_lower[i] -=
        at_point.z_lower[i] * step.v[i] + at_point.distance_lower[i] * step.z_lower[i];
  }
  for (const Index i : at_point.upper) {
    dz[i] += step.z_upper[i];
    residual.z_upper[i] -=
        at_point.distance_upper[i] * step.z_upper[i] - at_point.z_upper[i] * step.v[i];
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

}  // namespace ipminmax
