#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/kkt/system.hpp"
#include "core/model/timer.hpp"

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Operations of a factorization of K below which the bookkeeping of the Schur complement costs more
/// than it saves (bench/schur).
constexpr double kLeastSchurFlops = 5e4;
/// Norm of an active constraint's gradient (scaled problem) that counts as zero.
constexpr double kVanishingGradient = 1e-8;

SymmetricSolverOptions solver_options(const SolverOptions& options) {
  return {.ordering = options.minmax_ordering,
          .ldlt_gamma = options.minmax_ldlt_gamma,
          .mumps_pivot_tolerance = options.mumps_pivtol,
          .mumps_pivot_tolerance_max = options.mumps_pivtolmax,
          .mumps_memory_percent = options.mumps_mem_percent,
          .max_memory = 1e6 * options.max_memory,
          .mpi_halves = options.minmax_mpi_halves};
}

template <class Vector>
double max_norm(const Vector& v) {
  return v.size() == 0 ? 0.0 : v.template lpNorm<Eigen::Infinity>();
}

}  // namespace

KktBlock::KktBlock(Which which, const CanonicalProblem& canonical, const KktLayout& layout,
                   const SolverOptions& options)
    : canonical_(canonical),
      variable_row_(at(canonical.variables()), -1),
      constraint_row_(at(canonical.constraints()), -1),
      solver_(make_symmetric_solver(options.linear_solver, solver_options(options))) {
  const bool full = which == Which::Full;
  const Index y_offset = full ? layout.y.begin : 0;
  const Index lambda_y_offset = full ? layout.lambda_y.begin : layout.y.size();
  const Index dimension = full ? layout.dimension() : layout.y.size() + layout.lambda_y.size();
  variables_ = {full ? 0 : canonical.y().begin, canonical.variables()};
  constraints_ = {full ? 0 : canonical.max_constraints().begin, canonical.constraints()};

  const auto number = [](std::vector<Index>& rows, IndexRange range, Index offset) {
    for (Index i = range.begin; i < range.end; ++i) rows[at(i)] = offset + (i - range.begin);
  };
  if (full) {
    number(variable_row_, canonical.x(), layout.x.begin);
    number(constraint_row_, canonical.min_constraints(), layout.lambda_x.begin);
  }
  number(variable_row_, canonical.y(), y_offset);
  number(constraint_row_, canonical.max_constraints(), lambda_y_offset);

  std::vector<Triplet> entries;
  for (std::size_t k = 0; k < canonical.hessian().size(); ++k) {
    const Index row = variable_row_[at(canonical.hessian()[k].row)];
    const Index col = variable_row_[at(canonical.hessian()[k].col)];
    if (row < 0 || col < 0) continue;
    hessian_entries_.push_back(static_cast<Index>(k));
    entries.push_back({row, col});
  }
  for (std::size_t k = 0; k < canonical.jacobian().size(); ++k) {
    const Index row = constraint_row_[at(canonical.jacobian()[k].row)];
    const Index col = variable_row_[at(canonical.jacobian()[k].col)];
    if (row < 0 || col < 0) continue;
    jacobian_entries_.push_back(static_cast<Index>(k));
    entries.push_back({row, col});
  }
  matrix_ = SymmetricMatrix(dimension, entries);
  positions_ = matrix_.take_triplet_positions();
  hessian_entries_.shrink_to_fit();
  jacobian_entries_.shrink_to_fit();
  diagonal_.assign(at(dimension), 0.0);
  curvature_.setZero(variables_.size());

  const std::vector<std::int8_t> signs = layout.signs();
  signs_.assign(at(dimension), 1);
  for (Index i = variables_.begin; i < variables_.end; ++i) {
    if (const Index row = variable_row_[at(i)]; row >= 0) {
      signs_[at(row)] = canonical.owned_by_max(i) ? -1 : 1;
    }
  }
  for (Index j = constraints_.begin; j < constraints_.end; ++j) {
    signs_[at(constraint_row_[at(j)])] = canonical.max_constraints().contains(j) ? 1 : -1;
  }
}

Analysis KktBlock::analyze() {
  return empty() ? Analysis{.ok = true} : solver_->analyze(matrix_, signs_);
}

void KktBlock::adopt(std::shared_ptr<SymmetricSolver> solver) {
  factorized_with_.reset();
  solver_ = std::move(solver);
  solver_->require_certain_inertia(certain_);
  if (!empty()) solver_->reset_quality();
}

void KktBlock::assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature) {
  const auto own_curvature = barrier_curvature.segment(variables_.begin, variables_.size());
  const bool known = evaluation.jacobian_call > 0 && evaluation.hessian_call > 0;
  if (known && jacobian_call_ == evaluation.jacobian_call &&
      hessian_call_ == evaluation.hessian_call && curvature_ == own_curvature) {
    return;
  }
  factorized_with_.reset();
  ++version_;
  jacobian_call_ = known ? evaluation.jacobian_call : 0;
  hessian_call_ = known ? evaluation.hessian_call : 0;
  curvature_ = own_curvature;
  matrix_.set_zero();
  const auto values = matrix_.values();
  hessian_norm_ = 0.0;
  for (std::size_t k = 0; k < hessian_entries_.size(); ++k) {
    const double value = evaluation.hessian[at(hessian_entries_[k])];
    values[at(positions_[k])] += value;
    hessian_norm_ = std::max(hessian_norm_, std::abs(value));
  }
  for (std::size_t k = 0; k < jacobian_entries_.size(); ++k) {
    values[at(positions_[hessian_entries_.size() + k])] +=
        evaluation.jacobian[at(jacobian_entries_[k])];
  }
  for (Index i = variables_.begin; i < variables_.end; ++i) {
    const Index row = variable_row_[at(i)];
    if (row < 0) continue;
    diagonal_[at(row)] =
        values[at(matrix_.diagonal_position(row))] + canonical_.sign(i) * barrier_curvature[i];
  }
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = constraints_.begin; j < constraints_.end; ++j) {
    const Index slack = slack_of[at(j)];
    diagonal_[at(constraint_row_[at(j)])] =
        slack < 0 ? 0.0 : -canonical_.sign(slack) / barrier_curvature[slack];
  }
}

void KktBlock::decouple(const std::vector<bool>& constraints) {
  if (constraints.empty()) return;
  factorized_with_.reset();
  for (Index j = constraints_.begin; j < constraints_.end; ++j) {
    if (!constraints[at(j)]) continue;
    diagonal_[at(constraint_row_[at(j)])] = canonical_.max_constraints().contains(j) ? 1.0 : -1.0;
  }
}

void KktBlock::assemble_projection(const Evaluation& evaluation,
                                   const Eigen::VectorXd& column_factor,
                                   const Eigen::VectorXd& row_factor,
                                   const Eigen::VectorXd& multiplier_diagonal) {
  factorized_with_.reset();
  ++version_;
  jacobian_call_ = hessian_call_ = 0;
  matrix_.set_zero();
  const auto values = matrix_.values();
  for (std::size_t k = 0; k < jacobian_entries_.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[at(jacobian_entries_[k])];
    if (canonical_.owned_by_max(col) != canonical_.max_constraints().contains(row)) continue;
    values[at(positions_[hessian_entries_.size() + k])] +=
        column_factor[col] * row_factor[row] * evaluation.jacobian[at(jacobian_entries_[k])];
  }
  for (Index i = variables_.begin; i < variables_.end; ++i) {
    if (const Index row = variable_row_[at(i)]; row >= 0) diagonal_[at(row)] = canonical_.sign(i);
  }
  for (Index j = constraints_.begin; j < constraints_.end; ++j) {
    diagonal_[at(constraint_row_[at(j)])] = multiplier_diagonal[j];
  }
}

void KktBlock::shift_by(const Regularization& shift) {
  const auto values = matrix_.values();
  for (Index i = variables_.begin; i < variables_.end; ++i) {
    const Index row = variable_row_[at(i)];
    if (row < 0) continue;
    values[at(matrix_.diagonal_position(row))] =
        diagonal_[at(row)] + (canonical_.owned_by_max(i) ? -shift.y : shift.x);
  }
  for (Index j = constraints_.begin; j < constraints_.end; ++j) {
    const Index row = constraint_row_[at(j)];
    values[at(matrix_.diagonal_position(row))] =
        diagonal_[at(row)] +
        (canonical_.max_constraints().contains(j) ? shift.lambda_y : -shift.lambda_x);
  }
}

void KktBlock::begin_factorize(const Regularization& shift) {
  factorized_with_.reset();
  shift_by(shift);
  solver_->begin_factorize(matrix_);
}

Factorization KktBlock::factorize(const Regularization& shift) {
  if (is_factorized(shift)) return factorization_;
  shift_by(shift);
  factorization_ = solver_->factorize(matrix_);
  factorized_with_.reset();
  if (factorization_.status == FactorizationStatus::OutOfMemory) throw FactorsOutOfMemory();
  if (factorization_.status == FactorizationStatus::Ok) factorized_with_ = shift;
  return factorization_;
}

Factorization KktBlock::make_certain(const Regularization& shift) {
  if (certain_ || !is_factorized(shift)) return factorization_;
  factorization_ = solver_->make_certain(matrix_, factorization_);
  if (factorization_.status != FactorizationStatus::Ok) factorized_with_.reset();
  return factorization_;
}

void KktBlock::subtract_product(const Evaluation& evaluation, const Eigen::VectorXd& v,
                                const Eigen::VectorXd& lambda, Eigen::VectorXd& product_v,
                                Eigen::VectorXd& product_c) const {
  const auto hessian = canonical_.hessian();
  for (const Index k : hessian_entries_) {
    const auto [row, col] = hessian[at(k)];
    const double value = evaluation.hessian[at(k)];
    product_v[row] -= value * v[col];
    if (row != col) product_v[col] -= value * v[row];
  }
  const auto jacobian = canonical_.jacobian();
  for (const Index k : jacobian_entries_) {
    const auto [row, col] = jacobian[at(k)];
    const double value = evaluation.jacobian[at(k)];
    product_c[row] -= value * v[col];
    product_v[col] -= value * lambda[row];
  }
}

KktSystem::KktSystem(const CanonicalProblem& canonical, const SolverOptions& options,
                     Counts& counts, Timing& timing)
    : canonical_(canonical),
      options_(options),
      counts_(counts),
      timing_(timing),
      layout_(canonical),
      full_(KktBlock::Which::Full, canonical, layout_, options),
      inner_(KktBlock::Which::Inner, canonical, layout_, options),
      curvature_(Eigen::VectorXd::Zero(canonical.variables())),
      distance_lower_(Eigen::VectorXd::Ones(canonical.variables())),
      distance_upper_(Eigen::VectorXd::Ones(canonical.variables())),
      z_lower_(Eigen::VectorXd::Zero(canonical.variables())),
      z_upper_(Eigen::VectorXd::Zero(canonical.variables())),
      rhs_(at(layout_.dimension()), 0.0) {
  residual_ = last_residual_ = correction_ = zero_step(canonical);
  require_certain_inertia(false);
}

bool KktSystem::analyze(const std::optional<KktAnalysis>& kept) {
  if (kept && kept->linear_solver == options_.linear_solver &&
      kept->schur_option == options_.minmax_schur_complement &&
      kept->options == solver_options(options_)) {
    full_.adopt(kept->full);
    inner_.adopt(kept->inner);
    at_once_ = kept->at_once;
    require_certain_inertia(false);
    if (!kept->by_schur_complement) return true;
    schur_ = std::make_unique<KktSchur>(full_, inner_);
    return schur_->prepare(inner_, kept->second_inner);
  }
  const ScopedTimer timer(timing_.analysis);
  counts_.analyses += inner_.empty() ? 1 : 2;
  const Analysis full = full_.analyze();
  if (!full.ok || !inner_.analyze().ok) return false;
  decide_on_schur_complement(full);
  if (!schur_) {
    at_once_ = !inner_.empty() && inner_.solver()->work_beside(*full_.solver());
    return true;
  }
  ++counts_.analyses;
  return schur_->prepare(inner_, nullptr);
}

/// Whether K by way of K_yy is cheaper than K as a whole.
void KktSystem::decide_on_schur_complement(const Analysis& full) {
  const SchurComplementUse use = options_.minmax_schur_complement;
  if (use == SchurComplementUse::No || inner_.empty()) return;
  const double outer = layout_.dimension() - inner_.dimension();
  const bool open = use == SchurComplementUse::Auto;
  if (open && (full.flops < kLeastSchurFlops || outer * outer * outer / 3.0 > full.flops)) return;
  schur_ = std::make_unique<KktSchur>(full_, inner_);
  if (open && schur_->predict_flops(inner_) > full.flops) schur_ = nullptr;
}

void KktSystem::require_certain_inertia(bool certain) {
  certain = certain || inner_.empty();
  if (schur_ && certain != inner_.inertia_is_certain()) schur_->forget_factors();
  full_.require_certain_inertia(certain);
  inner_.require_certain_inertia(certain);
}

KktAnalysis KktSystem::analysis() const {
  return {.linear_solver = options_.linear_solver,
          .options = solver_options(options_),
          .full = full_.solver(),
          .inner = inner_.solver(),
          .second_inner = schur_ ? schur_->second(inner_) : nullptr,
          .schur_option = options_.minmax_schur_complement,
          .by_schur_complement = schur_ != nullptr,
          .at_once = at_once_};
}

void KktSystem::take_barrier_terms(const Iterate& iterate) {
  z_lower_ = iterate.z_lower;
  z_upper_ = iterate.z_upper;
  curvature_.setZero();
  for (const Index i : canonical_.lower_bounded()) {
    distance_lower_[i] = canonical_.above_lower(i, iterate.v[i]);
    curvature_[i] += z_lower_[i] / distance_lower_[i];
  }
  for (const Index i : canonical_.upper_bounded()) {
    distance_upper_[i] = canonical_.below_upper(i, iterate.v[i]);
    curvature_[i] += z_upper_[i] / distance_upper_[i];
  }
}

void KktSystem::release_full() {
  by_schur_ = false;
  if (schur_) schur_->release_full();
}

void KktSystem::assemble(const Iterate& iterate, const Evaluation& evaluation) {
  const ScopedTimer timer(timing_.assembly);
  take_barrier_terms(iterate);
  release_full();
  full_.assemble(evaluation, curvature_);
  inner_.assemble(evaluation, curvature_);
}

void KktSystem::assemble_inner(const Iterate& iterate, const Evaluation& evaluation) {
  const ScopedTimer timer(timing_.assembly);
  take_barrier_terms(iterate);
  inner_.assemble(evaluation, curvature_);
}

void KktSystem::assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature,
                         const std::vector<bool>& decoupled) {
  const ScopedTimer timer(timing_.assembly);
  curvature_ = barrier_curvature;
  // In the unreduced equations: a bound at distance 1 with this multiplier.
  distance_lower_.setOnes();
  distance_upper_.setOnes();
  z_lower_ = curvature_;
  z_upper_.setZero();
  release_full();
  full_.assemble(evaluation, curvature_);
  inner_.assemble(evaluation, curvature_);
  full_.decouple(decoupled);
  inner_.decouple(decoupled);
}

Factorization KktSystem::factorize(KktBlock& block, const Regularization& shift, Index& count) {
  if (block.is_factorized(shift)) return block.factorize(shift);
  const ScopedTimer timer(timing_.factorization);
  ++count;
  return block.factorize(shift);
}

Factorization KktSystem::factorize(const Regularization& shift) {
  return factorize(shift, !full_.inertia_is_certain());
}

Factorization KktSystem::factorize_for_solutions(const Regularization& shift) {
  return factorize(shift, true);
}

Factorization KktSystem::factorize(const Regularization& shift, bool by_schur_complement) {
  shift_ = shift;
  if (full_.empty()) return {.status = FactorizationStatus::Ok, .inertia = layout_.expected()};
  std::optional<Factorization> result;
  if (schur_ && by_schur_complement && !full_.is_factorized(shift)) {
    const ScopedTimer timer(timing_.factorization);
    full_.shift_by(shift);
    result = schur_->factorize(full_, inner_, counts_);
  }
  by_schur_ = result.has_value();
  if (!result) result = factorize(full_, shift, counts_.factorizations_full);
  result->inertia = inertia_ = layout_.with_slacks(result->inertia);
  return *result;
}

Factorization KktSystem::factorize_inner(const Regularization& shift) {
  inner_shift_ = shift;
  if (inner_.empty()) {
    return {.status = FactorizationStatus::Ok, .inertia = layout_.expected_inner()};
  }
  Factorization result;
  if (schur_) {
    const ScopedTimer timer(timing_.factorization);
    inner_.shift_by(shift);
    result = schur_->factorize_inner(inner_, counts_);
  } else {
    result = factorize(inner_, shift, counts_.factorizations_inner);
  }
  result.inertia = layout_.with_slacks_inner(result.inertia);
  return result;
}

Factorization KktSystem::make_certain() {
  if (full_.empty()) return {.status = FactorizationStatus::Ok, .inertia = layout_.expected()};
  if (by_schur_) static_cast<void>(factorize(shift_, false));
  const ScopedTimer timer(timing_.factorization);
  Factorization result = full_.make_certain(shift_);
  result.inertia = inertia_ = layout_.with_slacks(result.inertia);
  return result;
}

Factorization KktSystem::make_inner_certain() {
  if (inner_.empty()) {
    return {.status = FactorizationStatus::Ok, .inertia = layout_.expected_inner()};
  }
  const ScopedTimer timer(timing_.factorization);
  Factorization result = inner_.make_certain(inner_shift_);
  result.inertia = layout_.with_slacks_inner(result.inertia);
  return result;
}

void KktSystem::factorize_ahead(const Regularization& inner, const Regularization& full) {
  if (!at_once_ || inner_.is_factorized(inner) || full_.is_factorized(full)) return;
  {
    const ScopedTimer timer(timing_.factorization);
    inner_.begin_factorize(inner);
  }
  static_cast<void>(factorize(full));
  static_cast<void>(factorize_inner(inner));
}

bool KktSystem::increase_quality() {
  if (schur_) schur_->forget_factors();
  const bool full = !full_.empty() && full_.increase_quality();
  const bool inner = !inner_.empty() && inner_.increase_quality();
  return full || inner;
}

void KktSystem::reset_quality() {
  release_full();
  if (schur_) schur_->reset_quality();
  full_.reset_quality();
  inner_.reset_quality();
}

void KktSystem::solve_with_factors(KktBlock& block, std::span<double> reduced) {
  if (by_schur_ && &block == &full_) {
    schur_->solve_in_place(reduced);
  } else if (!block.empty()) {
    block.solve_in_place(reduced);
  }
}

bool KktSystem::solve_refined(KktBlock& block, std::span<double> reduced) {
  const auto size = static_cast<Eigen::Index>(reduced.size());
  const Eigen::VectorXd rhs = Eigen::Map<const Eigen::VectorXd>(reduced.data(), size);
  Eigen::VectorXd residual = rhs;
  Eigen::VectorXd product(size);
  Eigen::Map<Eigen::VectorXd> solution(reduced.data(), size);
  solution.setZero();
  double last_ratio = std::numeric_limits<double>::infinity();
  for (Index k = 0;; ++k) {
    const double scale = max_norm(rhs) + max_norm(solution);
    const double ratio = scale > 0.0 ? max_norm(residual) / scale : 0.0;
    if (ratio <= options_.residual_ratio_max) return true;
    // An overflow is no progress either.
    if (k > options_.max_refinement_steps || !(ratio <= 0.9 * last_ratio)) return false;
    last_ratio = ratio;
    solve_with_factors(block, {residual.data(), reduced.size()});
    solution += residual;
    block.matrix().multiply(reduced, {product.data(), reduced.size()});
    residual = rhs - product;
  }
}

bool KktSystem::solve_reduced(KktBlock& block, const NewtonResidual& rhs, Step& step,
                              bool refined) {
  // Bound multipliers: S dz_l + z_l dv = r, S dz_u - z_u dv = r, so that the variables' rows read
  //   (W + sign Sigma) dv + J' dlambda = r_v + sign (r_zl / S_l - r_zu / S_u) =: t.
  const auto slack_of = canonical_.slack_of_constraint();
  const auto t = [&](Index i) {
    return rhs.v[i] + canonical_.sign(i) * (rhs.z_lower[i] / distance_lower_[i] -
                                            rhs.z_upper[i] / distance_upper_[i]);
  };
  const std::span<double> reduced(rhs_.data(), at(block.dimension()));
  for (Index i = block.variables().begin; i < block.variables().end; ++i) {
    if (const Index row = block.row_of_variable(i); row >= 0) reduced[at(row)] = t(i);
  }
  // Slack s of constraint j: sign Sigma_s ds - dlambda_j = t_s, eliminated.
  for (Index j = block.constraints().begin; j < block.constraints().end; ++j) {
    const Index slack = slack_of[at(j)];
    reduced[at(block.row_of_constraint(j))] =
        rhs.lambda[j] + (slack < 0 ? 0.0 : canonical_.sign(slack) * t(slack) / curvature_[slack]);
  }
  bool ok = true;
  if (refined) {
    ok = solve_refined(block, reduced);
  } else {
    solve_with_factors(block, reduced);
  }

  for (Index j = block.constraints().begin; j < block.constraints().end; ++j) {
    step.lambda[j] = reduced[at(block.row_of_constraint(j))];
    if (const Index slack = slack_of[at(j)]; slack >= 0) {
      step.v[slack] = canonical_.sign(slack) * (t(slack) + step.lambda[j]) / curvature_[slack];
    }
  }
  for (Index i = block.variables().begin; i < block.variables().end; ++i) {
    if (const Index row = block.row_of_variable(i); row >= 0) step.v[i] = reduced[at(row)];
    step.z_lower[i] = (rhs.z_lower[i] - z_lower_[i] * step.v[i]) / distance_lower_[i];
    step.z_upper[i] = (rhs.z_upper[i] + z_upper_[i] * step.v[i]) / distance_upper_[i];
  }
  return ok;
}

void KktSystem::subtract_product(const KktBlock& block, const Regularization& shift,
                                 const Evaluation& evaluation, const Step& step,
                                 NewtonResidual& residual) const {
  block.subtract_product(evaluation, step.v, step.lambda, residual.v, residual.lambda);
  for (Index i = block.variables().begin; i < block.variables().end; ++i) {
    const double sign = canonical_.sign(i);
    const bool is_slack = block.row_of_variable(i) < 0;
    const double delta = is_slack ? 0.0 : (sign > 0.0 ? shift.x : -shift.y);
    residual.v[i] -= delta * step.v[i] + sign * (step.z_upper[i] - step.z_lower[i]);
    residual.z_lower[i] -= z_lower_[i] * step.v[i] + distance_lower_[i] * step.z_lower[i];
    residual.z_upper[i] -= distance_upper_[i] * step.z_upper[i] - z_upper_[i] * step.v[i];
  }
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = block.constraints().begin; j < block.constraints().end; ++j) {
    const double delta =
        canonical_.max_constraints().contains(j) ? shift.lambda_y : -shift.lambda_x;
    residual.lambda[j] -= delta * step.lambda[j];
    if (const Index slack = slack_of[at(j)]; slack >= 0) {
      residual.lambda[j] += step.v[slack];
      residual.v[slack] += step.lambda[j];
    }
  }
}

bool KktSystem::solve(KktBlock& block, const Regularization& shift, const Evaluation& evaluation,
                      const NewtonResidual& rhs, Step& step) {
  const ScopedTimer timer(timing_.solves);
  ++counts_.solves;
  // The block owns the tails of the canonical vectors; nothing else enters or changes.
  const Index n = block.variables().size();
  const Index m = block.constraints().size();
  const auto clear_head = [&](Step& s) {
    s.v.head(block.variables().begin).setZero();
    s.lambda.head(block.constraints().begin).setZero();
    s.z_lower.head(block.variables().begin).setZero();
    s.z_upper.head(block.variables().begin).setZero();
  };
  const auto norm = [&](const Step& s) {
    return std::max({max_norm(s.v.tail(n)), max_norm(s.lambda.tail(m)), max_norm(s.z_lower.tail(n)),
                     max_norm(s.z_upper.tail(n))});
  };
  clear_head(step);
  clear_head(correction_);
  solve_reduced(block, rhs, step);
  // Refinement: stops at residual_ratio_max, or when the residual no longer falls. Beside long steps
  // of the multipliers the ratio overlooks small rows, which Newton's method needs as well.
  constexpr double kForcing = 1e-2;
  constexpr double kRounding = 1e-15;
  constexpr double kSlow = 0.1;
  const double rhs_norm = norm(rhs);
  const double rhs_v = max_norm(rhs.v.tail(n));
  const double rhs_lambda = max_norm(rhs.lambda.tail(m));
  double last_ratio = std::numeric_limits<double>::infinity();
  const auto add_correction = [&](double factor) {
    step.v.tail(n) += factor * correction_.v.tail(n);
    step.lambda.tail(m) += factor * correction_.lambda.tail(m);
    step.z_lower.tail(n) += factor * correction_.z_lower.tail(n);
    step.z_upper.tail(n) += factor * correction_.z_upper.tail(n);
  };
  double scale = 0.0;
  const auto residual_ratio = [&] {
    residual_.v = rhs.v;
    residual_.lambda = rhs.lambda;
    residual_.z_lower = rhs.z_lower;
    residual_.z_upper = rhs.z_upper;
    subtract_product(block, shift, evaluation, step, residual_);
    scale = std::min(norm(step), 1e6 * rhs_norm) + rhs_norm;
    return scale > 0.0 ? norm(residual_) / scale : 0.0;
  };
  for (Index k = 0;; ++k) {
    double ratio = residual_ratio();
    if (!std::isfinite(ratio)) return false;
    if (ratio > kSlow * last_ratio) {
      // A few modes that Gamma spoils are left: the multiple of the correction d with the smallest
      // residual, from K d = last residual - residual.
      auto product_v = last_residual_.v.tail(n);
      auto product_lambda = last_residual_.lambda.tail(m);
      product_v -= residual_.v.tail(n);
      product_lambda -= residual_.lambda.tail(m);
      const double more =
          (residual_.v.tail(n).dot(product_v) + residual_.lambda.tail(m).dot(product_lambda)) /
          (product_v.squaredNorm() + product_lambda.squaredNorm());
      if (std::isfinite(more)) {
        add_correction(more);
        ratio = residual_ratio();
        if (!std::isfinite(ratio)) return false;
      }
    }
    const double rounding = kRounding * scale;
    const bool every_row = max_norm(residual_.v.tail(n)) <= kForcing * rhs_v + rounding &&
                           max_norm(residual_.lambda.tail(m)) <= kForcing * rhs_lambda + rounding;
    if (ratio <= options_.residual_ratio_max && every_row) return true;
    if (k == options_.max_refinement_steps || ratio > 0.9 * last_ratio) {
      return std::min(ratio, last_ratio) <= options_.residual_ratio_singular;
    }
    last_ratio = ratio;
    last_residual_.v.tail(n) = residual_.v.tail(n);
    last_residual_.lambda.tail(m) = residual_.lambda.tail(m);
    solve_reduced(block, residual_, correction_);
    add_correction(1.0);
  }
}

bool KktSystem::solve(const Evaluation& evaluation, const NewtonResidual& rhs, Step& step) {
  if (solve(full_, shift_, evaluation, rhs, step)) return true;
  return leave_schur_complement() && solve(full_, shift_, evaluation, rhs, step);
}

/// K as a whole from now on, the current one at once. False: that changes nothing, or its inertia.
bool KktSystem::leave_schur_complement() {
  if (!by_schur_) return false;
  const Inertia before = inertia_;
  schur_ = nullptr;
  return factorize(shift_).status == FactorizationStatus::Ok && inertia_ == before;
}

bool KktSystem::solve_inner(const Evaluation& evaluation, const NewtonResidual& rhs, Step& step) {
  return solve(inner_, inner_shift_, evaluation, rhs, step);
}

bool KktSystem::solve_projection(const NewtonResidual& rhs, Step& step) {
  for (;;) {
    if (factorize_for_solutions({}).status != FactorizationStatus::Ok) return false;
    {
      const ScopedTimer timer(timing_.solves);
      ++counts_.solves;
      if (solve_reduced(full_, rhs, step, true)) return true;
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
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(canonical_.constraints());
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (const Index slack = canonical_.slack_of_constraint()[at(j)]; slack >= 0) {
      diagonal[j] = -canonical_.sign(slack);
    }
  }
  full_.assemble_projection(evaluation, Eigen::VectorXd::Ones(canonical_.variables()),
                            Eigen::VectorXd::Ones(canonical_.constraints()), diagonal);
  release_full();
  curvature_.setOnes();
  distance_lower_.setOnes();
  distance_upper_.setOnes();
  z_lower_.setZero();
  z_upper_.setZero();
  NewtonResidual rhs = zero_step(canonical_);
  Step step = rhs;
  for (const bool max : {true, false}) {
    const IndexRange variables = {max ? canonical_.y().begin : 0,
                                  max ? canonical_.variables() : canonical_.y().begin};
    rhs.v.setZero();
    for (Index i = variables.begin; i < variables.end; ++i) {
      rhs.v[i] =
          -evaluation.gradient[i] - canonical_.sign(i) * (iterate.z_upper[i] - iterate.z_lower[i]);
    }
    if (!max) {
      const auto jacobian = canonical_.jacobian();
      for (std::size_t k = 0; k < jacobian.size(); ++k) {
        const auto [row, col] = jacobian[k];
        if (canonical_.max_constraints().contains(row) && !canonical_.owned_by_max(col)) {
          rhs.v[col] -= evaluation.jacobian[k] * lambda[row];
        }
      }
    }
    // Where Gamma is the pivot of a multiplier, little of I is left in the factors.
    if (!solve_projection(rhs, step)) return false;
    const IndexRange own = max ? canonical_.max_constraints() : canonical_.min_constraints();
    for (Index j = own.begin; j < own.end; ++j) lambda[j] = step.lambda[j];
  }
  return lambda.allFinite();
}

KktSystem::RankFinding KktSystem::active_rank(const Evaluation& evaluation,
                                              const std::vector<bool>& active) {
  // Rows of active constraints normalized, columns at bounds removed: with the diagonal
  // +-tolerance the inertia is the expected one iff A A' > tolerance I. Where Gamma stays in the
  // matrix unchecked, the tolerance has to dominate it.
  const double tolerance =
      options_.linear_solver == LinearSolver::Ldlt ? 4.0 * options_.minmax_ldlt_gamma : 1e-14;
  const auto slack_of = canonical_.slack_of_constraint();
  Eigen::VectorXd columns = Eigen::VectorXd::Ones(canonical_.variables());
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (active[at(i)]) columns[i] = 0.0;
  }
  Eigen::VectorXd rows = Eigen::VectorXd::Zero(canonical_.constraints());
  const auto jacobian = canonical_.jacobian();
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = jacobian[k];
    if (canonical_.owned_by_max(col) != canonical_.max_constraints().contains(row)) continue;
    const double value = columns[col] * evaluation.jacobian[k];
    rows[row] += value * value;
  }
  RankFinding finding{.full_min = true, .full_max = true};
  Eigen::VectorXd diagonal(canonical_.constraints());
  bool any_min = false, any_max = false;  // rows whose independence is in question
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const bool max = canonical_.max_constraints().contains(j);
    const double expected = max ? 1.0 : -1.0;
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && !active[at(slack)]) {
      rows[j] = 0.0;
      diagonal[j] = expected;
    } else if (rows[j] <= kVanishingGradient * kVanishingGradient) {
      (max ? finding.full_max : finding.full_min) = false;
      finding.vanishing = true;
      diagonal[j] = expected;
    } else {
      rows[j] = 1.0 / std::sqrt(rows[j]);
      diagonal[j] = -expected * tolerance;
      (max ? any_max : any_min) = true;
    }
  }
  const auto full_rank = [&](KktBlock& block, Inertia expected, Index& count) {
    block.assemble_projection(evaluation, columns, rows, diagonal);
    const ScopedTimer timer(timing_.factorization);
    ++count;
    if (&block == &full_) by_schur_ = false;
    if (schur_) schur_->forget_factors();
    const Factorization f = block.factorize({});
    return f.status == FactorizationStatus::Ok && f.inertia == expected;
  };
  // The players are uncoupled here. Max is tested alone: in the whole matrix two equal deficiencies
  // of the players would cancel.
  const Inertia expected_inner{layout_.lambda_y.size(), layout_.y.size(), 0};
  if (any_max && !full_rank(inner_, expected_inner, counts_.factorizations_inner)) {
    return {.full_min = false, .full_max = false, .vanishing = finding.vanishing};
  }
  const Inertia expected{layout_.x.size() + layout_.lambda_y.size(),
                         layout_.y.size() + layout_.lambda_x.size(), 0};
  if (any_min && !full_rank(full_, expected, counts_.factorizations_full)) {
    finding.full_min = false;
  }
  return finding;
}

}  // namespace ipminmax
