#include <algorithm>
#include <cmath>
#include <utility>

#include "core/kkt/block.hpp"
#include "core/point/residual.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

SymmetricSolverOptions solver_options(const SolverOptions& options) {
  return {.ordering = options.minmax_ordering,
          .ldlt_gamma = options.minmax_ldlt_gamma,
          .mumps_pivot_tolerance = options.mumps_pivtol,
          .mumps_pivot_tolerance_max = options.mumps_pivtolmax,
          .mumps_memory_percent = options.mumps_mem_percent,
          .max_memory = 1e6 * options.max_memory,
          .mpi_halves = options.minmax_mpi_halves,
          .threads = options.minmax_threads};
}

void BarrierTerms::set_size(Index variables) {
  curvature.setZero(variables);
  distance_lower.setOnes(variables);
  distance_upper.setOnes(variables);
  z_lower.setZero(variables);
  z_upper.setZero(variables);
  for (auto* bounded : {&lower, &upper}) {
    bounded->clear();
    bounded->reserve(at(variables));
  }
}

void BarrierTerms::take(const CanonicalProblem& canonical, const Iterate& iterate, Index begin) {
  z_lower = iterate.z_lower;
  z_upper = iterate.z_upper;
  curvature.setZero();
  const auto take_from = [&](std::span<const Index> all, std::vector<Index>& bounded) {
    bounded.assign(std::ranges::lower_bound(all, begin), all.end());
  };
  take_from(canonical.lower_bounded(), lower);
  take_from(canonical.upper_bounded(), upper);
  for (const Index i : lower) {
    distance_lower[i] = canonical.above_lower(i, iterate.v[i]);
    curvature[i] += z_lower[i] / distance_lower[i];
  }
  for (const Index i : upper) {
    distance_upper[i] = canonical.below_upper(i, iterate.v[i]);
    curvature[i] += z_upper[i] / distance_upper[i];
  }
}

void BarrierTerms::take(const Eigen::VectorXd& given, Index begin) {
  curvature = given;
  distance_lower.setOnes();
  distance_upper.setOnes();
  z_lower = given;
  z_upper.setZero();
  lower.clear();
  upper.clear();
  for (Index i = begin; i < given.size(); ++i) {
    if (given[i] != 0.0) lower.push_back(i);
  }
}

void BarrierTerms::take_none() {
  curvature.setOnes();
  distance_lower.setOnes();
  distance_upper.setOnes();
  z_lower.setZero();
  z_upper.setZero();
  lower.clear();
  upper.clear();
}

KktPattern::KktPattern(Which which, const CanonicalProblem& canonical, const KktLayout& layout)
    : row_of_variable(at(canonical.variables()), -1),
      row_of_constraint(at(canonical.constraints()), -1) {
  const bool full = which == Which::Full;
  const Index y_offset = full ? layout.y.begin : 0;
  const Index lambda_y_offset = full ? layout.lambda_y.begin : layout.y.size();
  const Index dimension = full ? layout.dimension() : layout.y.size() + layout.lambda_y.size();
  variables = {full ? 0 : canonical.y().begin, canonical.variables()};
  constraints = {full ? 0 : canonical.max_constraints().begin, canonical.constraints()};

  const auto number = [](std::vector<Index>& rows, std::vector<Run>& runs, IndexRange range,
                         Index offset) {
    for (Index i = range.begin; i < range.end; ++i) rows[at(i)] = offset + (i - range.begin);
    runs.push_back({.first = range.begin, .row = offset, .size = range.size()});
  };
  if (full) {
    number(row_of_variable, variable_runs, canonical.x(), layout.x.begin);
    number(row_of_constraint, constraint_runs, canonical.min_constraints(), layout.lambda_x.begin);
  }
  number(row_of_variable, variable_runs, canonical.y(), y_offset);
  number(row_of_constraint, constraint_runs, canonical.max_constraints(), lambda_y_offset);

  std::vector<Triplet> entries;
  entries.reserve(canonical.hessian().size() + canonical.jacobian().size());
  hessian_entries.reserve(canonical.hessian().size());
  jacobian_entries.reserve(canonical.jacobian().size());
  for (std::size_t k = 0; k < canonical.hessian().size(); ++k) {
    const Index row = row_of_variable[at(canonical.hessian()[k].row)];
    const Index col = row_of_variable[at(canonical.hessian()[k].col)];
    if (row < 0 || col < 0) continue;
    hessian_entries.push_back(static_cast<Index>(k));
    entries.push_back({row, col});
  }
  for (std::size_t k = 0; k < canonical.jacobian().size(); ++k) {
    const Index row = row_of_constraint[at(canonical.jacobian()[k].row)];
    const Index col = row_of_variable[at(canonical.jacobian()[k].col)];
    if (row < 0 || col < 0) continue;
    jacobian_entries.push_back(static_cast<Index>(k));
    entries.push_back({row, col});
  }
  zero = SymmetricMatrix(dimension, entries);
  positions = zero.take_triplet_positions();
  hessian_entries.shrink_to_fit();
  jacobian_entries.shrink_to_fit();

  signs.assign(at(dimension), 1);
  for (Index i = variables.begin; i < variables.end; ++i) {
    if (const Index row = row_of_variable[at(i)]; row >= 0) {
      signs[at(row)] = canonical.owned_by_max(i) ? -1 : 1;
    }
  }
  for (Index j = constraints.begin; j < constraints.end; ++j) {
    signs[at(row_of_constraint[at(j)])] = canonical.max_constraints().contains(j) ? 1 : -1;
  }
}

KktBlock::KktBlock(std::shared_ptr<const KktPattern> pattern, const CanonicalProblem& canonical,
                   KktBlockArrays* arrays)
    : canonical_(canonical),
      pattern_(std::move(pattern)),
      arrays_(arrays != nullptr ? *arrays : own_.emplace()) {
  arrays_.matrix = pattern_->zero;
  arrays_.diagonal.assign(at(arrays_.matrix.dimension()), 0.0);
  arrays_.terms.set_size(canonical.variables());
  arrays_.curvature.setZero(pattern_->variables.size());
  forget_copies();
}

Analysis KktBlock::analyze(const SolverOptions& options) {
  solver_ = make_symmetric_solver(options.linear_solver, solver_options(options));
  return empty() ? Analysis{.ok = true} : solver_->analyze(arrays_.matrix, signs());
}

void KktBlock::adopt(std::shared_ptr<SymmetricSolver> solver) {
  factorized_with_.reset();
  solver_ = std::move(solver);
  if (!empty()) solver_->reset_quality();
}

void KktBlock::assemble(const Iterate& iterate, const Evaluation& evaluation) {
  arrays_.terms.take(canonical_, iterate, pattern_->variables.begin);
  if (!canonical_.has_copies()) {
    assemble(evaluation, evaluation.jacobian);
    return;
  }
  row_jacobian(canonical_, iterate, evaluation, arrays_.jacobian);
  set_lengths(iterate);
  assemble(evaluation, arrays_.jacobian);
}

void KktBlock::set_lengths(const Iterate& iterate) {
  arrays_.lengths.setOnes(dimension());
  const auto set = [&](Index row, Index slack, double power) {
    if (row < 0 || slack < 0) return;
    arrays_.lengths[row] = std::pow(CanonicalProblem::weight_by(slack, iterate), power);
  };
  for (Index i = canonical_.y().begin; i < canonical_.y().end; ++i) {
    set(row_of_variable(i), canonical_.served_slack(i), -0.5);
  }
  for (Index j = canonical_.max_constraints().begin; j < canonical_.constraints(); ++j) {
    set(row_of_constraint(j), canonical_.slack_served_by_constraint(j), 0.5);
  }
}

void KktBlock::forget_copies() {
  if (arrays_.lengths.size() == 0) return;
  jacobian_call_ = hessian_call_ = 0;
  arrays_.lengths.resize(0);
  arrays_.jacobian.clear();
}

void KktBlock::assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature) {
  arrays_.terms.take(barrier_curvature, pattern_->variables.begin);
  forget_copies();
  assemble(evaluation, evaluation.jacobian);
}

void KktBlock::assemble(const Evaluation& evaluation, std::span<const double> jacobian) {
  const auto own_curvature =
      arrays_.terms.curvature.segment(pattern_->variables.begin, pattern_->variables.size());
  const bool known = evaluation.jacobian_call > 0 && evaluation.hessian_call > 0;
  if (known && jacobian_call_ == evaluation.jacobian_call &&
      hessian_call_ == evaluation.hessian_call && arrays_.curvature == own_curvature) {
    return;
  }
  factorized_with_.reset();
  ++version_;
  jacobian_call_ = known ? evaluation.jacobian_call : 0;
  hessian_call_ = known ? evaluation.hessian_call : 0;
  arrays_.curvature = own_curvature;
  low_rank_ = evaluation.low_rank;
  arrays_.matrix.set_zero();
  const auto values = arrays_.matrix.values();
  hessian_norm_ = 0.0;
  for (std::size_t k = 0; k < pattern_->hessian_entries.size(); ++k) {
    const double value = evaluation.hessian[at(pattern_->hessian_entries[k])];
    values[at(pattern_->positions[k])] += value;
    hessian_norm_ = std::max(hessian_norm_, std::abs(value));
  }
  for (std::size_t k = 0; k < pattern_->jacobian_entries.size(); ++k) {
    values[at(pattern_->positions[pattern_->hessian_entries.size() + k])] +=
        jacobian[at(pattern_->jacobian_entries[k])];
  }
  for (Index i = pattern_->variables.begin; i < pattern_->variables.end; ++i) {
    const Index row = pattern_->row_of_variable[at(i)];
    if (row < 0) continue;
    arrays_.diagonal[at(row)] = values[at(arrays_.matrix.diagonal_position(row))] +
                                canonical_.sign(i) * arrays_.terms.curvature[i];
    if (low_rank_) arrays_.diagonal[at(row)] += low_rank_->diagonal[i];
  }
  if (low_rank_ && low_rank_->diagonal.size() > 0)
    hessian_norm_ = std::max(hessian_norm_, low_rank_->diagonal.maxCoeff());
  for (Index j = pattern_->constraints.begin; j < pattern_->constraints.end; ++j) {
    const Index slack = canonical_.slack_of(j);
    arrays_.diagonal[at(pattern_->row_of_constraint[at(j)])] =
        slack < 0 ? 0.0 : -canonical_.sign(slack) / arrays_.terms.curvature[slack];
  }
  if (arrays_.lengths.size() > 0) measure_copies();
}

/// In units in which the equations of a copy are those of its own row.
void KktBlock::measure_copies() {
  const Eigen::VectorXd& lengths = arrays_.lengths;
  const auto starts = arrays_.matrix.column_starts();
  const auto rows = arrays_.matrix.rows();
  const auto values = arrays_.matrix.values();
  for (Index col = 0; col < dimension(); ++col) {
    for (Index k = starts[at(col)]; k < starts[at(col) + 1]; ++k) {
      values[at(k)] *= lengths[col] * lengths[rows[at(k)]];
    }
    arrays_.diagonal[at(col)] *= lengths[col] * lengths[col];
  }
}

void KktBlock::decouple(const std::vector<bool>& constraints) {
  if (constraints.empty()) return;
  factorized_with_.reset();
  for (Index j = pattern_->constraints.begin; j < pattern_->constraints.end; ++j) {
    if (!constraints[at(j)]) continue;
    arrays_.diagonal[at(pattern_->row_of_constraint[at(j)])] =
        canonical_.max_constraints().contains(j) ? 1.0 : -1.0;
  }
}

void KktBlock::assemble_projection(const Evaluation& evaluation,
                                   const Eigen::VectorXd& multiplier_diagonal) {
  arrays_.terms.take_none();
  forget_copies();
  factorized_with_.reset();
  ++version_;
  jacobian_call_ = hessian_call_ = 0;
  low_rank_ = nullptr;
  arrays_.matrix.set_zero();
  const auto values = arrays_.matrix.values();
  for (std::size_t k = 0; k < pattern_->jacobian_entries.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[at(pattern_->jacobian_entries[k])];
    if (canonical_.owned_by_max(col) != canonical_.max_constraints().contains(row)) continue;
    values[at(pattern_->positions[pattern_->hessian_entries.size() + k])] +=
        evaluation.jacobian[at(pattern_->jacobian_entries[k])];
  }
  for (Index i = pattern_->variables.begin; i < pattern_->variables.end; ++i) {
    if (const Index row = pattern_->row_of_variable[at(i)]; row >= 0)
      arrays_.diagonal[at(row)] = canonical_.sign(i);
  }
  for (Index j = pattern_->constraints.begin; j < pattern_->constraints.end; ++j) {
    arrays_.diagonal[at(pattern_->row_of_constraint[at(j)])] = multiplier_diagonal[j];
  }
}

void KktBlock::shift_by(const Regularization& shift) {
  const auto values = arrays_.matrix.values();
  for (Index i = pattern_->variables.begin; i < pattern_->variables.end; ++i) {
    const Index row = pattern_->row_of_variable[at(i)];
    if (row < 0) continue;
    values[at(arrays_.matrix.diagonal_position(row))] =
        arrays_.diagonal[at(row)] +
        (canonical_.owned_by_max(i) ? shift.of_max(i) : shift.of_min(i));
  }
  for (Index j = pattern_->constraints.begin; j < pattern_->constraints.end; ++j) {
    const Index row = pattern_->row_of_constraint[at(j)];
    double diagonal = arrays_.diagonal[at(row)];  // of Min -1 / Sigma of the slack, or 0
    if (shift.slacks > 0.0 && diagonal < 0.0) diagonal /= 1.0 - shift.slacks * diagonal;
    values[at(arrays_.matrix.diagonal_position(row))] =
        diagonal + (canonical_.max_constraints().contains(j) ? shift.lambda_y : -shift.lambda_x);
  }
}

void KktBlock::begin_factorize(const Regularization& shift) {
  factorized_with_.reset();
  shift_by(shift);
  solver_->begin_factorize(arrays_.matrix);
}

Factorization KktBlock::factorize(const Regularization& shift, Certainty certainty) {
  if (is_factorized(shift, certainty)) return factorization_;
  shift_by(shift);
  certainty_ = certainty;
  factorization_ = solver_->factorize(arrays_.matrix, certainty);
  factorized_with_.reset();
  if (factorization_.status == FactorizationStatus::OutOfMemory) throw FactorsOutOfMemory();
  if (factorization_.status == FactorizationStatus::Ok) factorized_with_ = shift;
  return factorization_;
}

Factorization KktBlock::make_certain(const Regularization& shift) {
  if (certainty_ == Certainty::Certain || !is_factorized(shift, certainty_)) return factorization_;
  factorization_ = solver_->make_certain(arrays_.matrix, factorization_);
  if (factorization_.status != FactorizationStatus::Ok) factorized_with_.reset();
  return factorization_;
}

void KktBlock::subtract_product(const Evaluation& evaluation, const Eigen::VectorXd& v,
                                const Eigen::VectorXd& lambda, Eigen::VectorXd& product_v,
                                Eigen::VectorXd& product_c) const {
  const auto hessian = canonical_.hessian();
  for (const Index k : pattern_->hessian_entries) {
    const auto [row, col] = hessian[at(k)];
    const double value = evaluation.hessian[at(k)];
    product_v[row] -= value * v[col];
    if (row != col) product_v[col] -= value * v[row];
  }
  if (evaluation.low_rank) evaluation.low_rank->subtract_product(v, product_v);
  const auto jacobian = canonical_.jacobian();
  const auto& jacobians = arrays_.jacobian.empty() ? evaluation.jacobian : arrays_.jacobian;
  for (const Index k : pattern_->jacobian_entries) {
    const auto [row, col] = jacobian[at(k)];
    const double value = jacobians[at(k)];
    product_c[row] -= value * v[col];
    product_v[col] -= value * lambda[row];
  }
}

}  // namespace ipminmax
