#include "core/kkt/block.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/model/indices.hpp"
#include "core/point/point.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

KktLayout::KktLayout(const CanonicalProblem& canonical)
    : x_slacks(canonical.x_slacks().size()), y_slacks(canonical.y_slacks().size()) {
  x = {0, canonical.x().size()};
  y = {x.end, x.end + canonical.y().size()};
  lambda_x = {y.end, y.end + canonical.min_constraints().size()};
  lambda_y = {lambda_x.end, lambda_x.end + canonical.max_constraints().size()};
}

Inertia KktLayout::expected() const {
  return {x.size() + x_slacks + lambda_y.size(), y.size() + y_slacks + lambda_x.size(), 0};
}

Inertia KktLayout::expected_inner() const { return {lambda_y.size(), y.size() + y_slacks, 0}; }

Inertia KktLayout::with_slacks(Inertia reduced) const {
  return {reduced.positive + x_slacks, reduced.negative + y_slacks, reduced.zero};
}

Inertia KktLayout::with_slacks_inner(Inertia reduced) const {
  return {reduced.positive, reduced.negative + y_slacks, reduced.zero};
}

SymmetricSolverOptions solver_options(const SolverOptions& options) {
  return {.ordering = options.minmax_ordering,
          .ldlt_gamma = options.minmax_ldlt_gamma,
          .mumps_pivot_tolerance = options.mumps_pivtol,
          .mumps_pivot_tolerance_max = options.mumps_pivtolmax,
          .mumps_memory_percent = options.mumps_mem_percent,
          .max_memory = 1e6 * options.max_memory,
          .threads = options.minmax_threads};
}

void BarrierTerms::take(const CanonicalProblem& canonical, const Iterate& iterate, Index begin) {
  take_none();
  curvature.setZero();
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    if (i < begin) return;
    const double multiplier = multiplier_of(iterate, i, side);
    (side < 0 ? lower : upper).push_back({i, distance, multiplier});
    curvature[i] += multiplier / distance;
  });
}

void BarrierTerms::take(const Eigen::VectorXd& given, Index begin) {
  take_none();
  curvature = given;
  for (Index i = begin; i < given.size(); ++i) {
    if (given[i] != 0.0) lower.push_back({i, 1.0, given[i]});
  }
}

void BarrierTerms::take_none() {
  curvature.setOnes();
  lower.clear();
  upper.clear();
}

KktPattern::KktPattern(KktPart which, const CanonicalProblem& canonical, const KktLayout& layout)
    : row_of_variable(at(canonical.variables()), -1),
      row_of_constraint(at(canonical.constraints()), -1) {
  if (layout.dimension() == 0) return;
  const bool full = which == KktPart::Full;
  const Index dimension = full ? layout.dimension() : layout.y.size() + layout.lambda_y.size();
  variables = {full ? 0 : canonical.y().begin, canonical.variables()};
  constraints = {full ? 0 : canonical.max_constraints().begin, canonical.constraints()};

  signs.resize(at(dimension));
  const auto number = [&](std::vector<Index>& rows, std::vector<Run>& runs, IndexRange range,
                          Index row, std::int8_t sign) {
    runs.push_back({.first = range.begin, .row = row, .size = range.size()});
    std::iota(rows.begin() + range.begin, rows.begin() + range.end, row);
    std::fill_n(signs.begin() + row, range.size(), sign);
  };
  if (full) {
    number(row_of_variable, variable_runs, canonical.x(), layout.x.begin, 1);
    number(row_of_constraint, constraint_runs, canonical.min_constraints(), layout.lambda_x.begin,
           -1);
  }
  number(row_of_variable, variable_runs, canonical.y(), full ? layout.y.begin : 0, -1);
  number(row_of_constraint, constraint_runs, canonical.max_constraints(),
         full ? layout.lambda_y.begin : layout.y.size(), 1);

  std::vector<Triplet> entries;
  entries.reserve(canonical.hessian().size() + canonical.jacobian().size());
  const auto take = [&](std::span<const Triplet> pattern, const Array<Index>& rows,
                        std::vector<Index>& taken) {
    taken.reserve(pattern.size());
    for (const auto k : indices(pattern)) {
      const Index row = rows[pattern[k].row], col = row_of_variable[pattern[k].col];
      if (row < 0 || col < 0) continue;
      taken.push_back(static_cast<Index>(k));
      entries.push_back({row, col});
    }
    taken.shrink_to_fit();
  };
  take(canonical.hessian(), row_of_variable, hessian_entries);
  take(canonical.jacobian(), row_of_constraint, jacobian_entries);
  matrix = SymmetricMatrix(dimension, entries);
  matrix.drop_values();
}

KktBlock::KktBlock(std::shared_ptr<const KktPattern> pattern, const CanonicalProblem& canonical,
                   KktBlockArrays* arrays)
    : Kept(arrays), canonical_(canonical), pattern_(std::move(pattern)) {
  matrix_ = pattern_->matrix;
  matrix_.set_zero();
  diagonal_.setZero(dimension());
  terms_.curvature.resize(canonical.variables());
  std::size_t bounded = 0, from_above = 0;
  for (Index i = variables().begin; i < variables().end; ++i) {
    const bool has_upper = std::isfinite(canonical.upper()[i]);
    from_above += has_upper ? 1 : 0;
    bounded += has_upper || std::isfinite(canonical.lower()[i]) ? 1 : 0;
  }
  terms_.lower.reserve(bounded);
  terms_.upper.reserve(from_above);
  curvature_.setZero(variables().size());
  forget_copies();
}

Analysis KktBlock::analyze(const SolverOptions& options) {
  solver_ = make_symmetric_solver(options.linear_solver, solver_options(options));
  return empty() ? Analysis{.ok = true} : solver_->analyze(matrix_, signs());
}

void KktBlock::assemble(const Iterate& iterate, const Evaluation& evaluation) {
  terms_.take(canonical_, iterate, variables().begin);
  if (!canonical_.has_copies()) {
    assemble(evaluation, evaluation.jacobian);
    return;
  }
  row_jacobian(canonical_, iterate, evaluation, jacobian_);
  set_lengths(iterate);
  assemble(evaluation, jacobian_);
}

void KktBlock::set_lengths(const Iterate& iterate) {
  lengths_.setOnes(dimension());
  const auto set = [&](Index row, Index slack, double power) {
    if (row < 0 || slack < 0) return;
    lengths_[row] = std::pow(CanonicalProblem::weight_by(slack, iterate), power);
  };
  for (const Index i : indices(canonical_.y())) {
    set(row_of_variable(i), canonical_.robust_slack(i), -0.5);
  }
  for (Index j = canonical_.max_constraints().begin; j < canonical_.constraints(); ++j) {
    set(row_of_constraint(j), canonical_.robust_slack_of_constraint(j), 0.5);
  }
}

void KktBlock::forget_copies() {
  if (lengths_.size() == 0) return;
  jacobian_call_ = hessian_call_ = 0;
  lengths_.resize(0);
  jacobian_.clear();
}

void KktBlock::assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature) {
  terms_.take(barrier_curvature, variables().begin);
  forget_copies();
  assemble(evaluation, evaluation.jacobian);
}

void KktBlock::assemble(const Evaluation& evaluation, std::span<const double> jacobian) {
  const auto own_curvature = part(terms_.curvature, variables());
  const bool known = evaluation.jacobian_call > 0 && evaluation.hessian_call > 0;
  if (known && jacobian_call_ == evaluation.jacobian_call &&
      hessian_call_ == evaluation.hessian_call && curvature_ == own_curvature) {
    return;
  }
  jacobian_call_ = known ? evaluation.jacobian_call : 0;
  hessian_call_ = known ? evaluation.hessian_call : 0;
  curvature_ = own_curvature;
  set_values(evaluation, jacobian, true);
  if (lengths_.size() > 0) measure_copies();
}

void KktBlock::assemble_projection(const Evaluation& evaluation) {
  terms_.take_none();
  forget_copies();
  jacobian_call_ = hessian_call_ = 0;
  set_values(evaluation, evaluation.jacobian, false);
}

void KktBlock::set_values(const Evaluation& evaluation, std::span<const double> jacobian,
                          bool coupled) {
  factorized_with_.reset();
  ++version_;
  low_rank_ = coupled ? evaluation.low_rank : nullptr;
  matrix_.set_zero();
  const auto values = matrix_.values();
  auto position = matrix_.triplet_positions().begin();
  if (coupled) {
    hessian_norm_ = low_rank_ && low_rank_->diagonal.size() > 0
                        ? std::max(0.0, low_rank_->diagonal.maxCoeff())
                        : 0.0;
    for (const Index k : pattern_->hessian_entries) {
      const double value = evaluation.hessian[at(k)];
      values[at(*position++)] += value;
      hessian_norm_ = std::max(hessian_norm_, std::abs(value));
    }
  } else {
    position += std::ssize(pattern_->hessian_entries);
  }
  for (const Index k : pattern_->jacobian_entries) {
    const auto [row, col] = canonical_.jacobian()[at(k)];
    const bool own = canonical_.owned_by_max(col) == canonical_.max_constraints().contains(row);
    if (coupled || own) values[at(*position)] += jacobian[at(k)];
    ++position;
  }
  for (const Index i : indices(variables())) {
    const Index row = row_of_variable(i);
    if (row < 0) continue;
    diagonal_[row] =
        values[at(matrix_.diagonal_position(row))] + canonical_.sign(i) * terms_.curvature[i];
    if (low_rank_) diagonal_[row] += low_rank_->diagonal[i];
  }
  for (const Index j : indices(constraints())) {
    const Index slack = canonical_.slack_of(j);
    diagonal_[row_of_constraint(j)] =
        slack < 0 ? 0.0 : -canonical_.sign(slack) / terms_.curvature[slack];
  }
}

/// In units in which the equations of a copy are those of its own row.
void KktBlock::measure_copies() {
  const auto values = matrix_.values();
  matrix_.for_each_entry(
      [&](Index i, Index j, Index p) { values[at(p)] *= lengths_[j] * lengths_[i]; });
  diagonal_.array() *= lengths_.array().square();
}

void KktBlock::decouple(const std::vector<bool>& decoupled) {
  if (decoupled.empty()) return;
  factorized_with_.reset();
  for (const Index j : indices(constraints())) {
    if (!decoupled[at(j)]) continue;
    diagonal_[row_of_constraint(j)] = canonical_.max_constraints().contains(j) ? 1.0 : -1.0;
  }
}

void KktBlock::shift_by(const Regularization& shift) {
  const auto values = matrix_.values();
  for (const Index i : indices(variables())) {
    const Index row = row_of_variable(i);
    if (row < 0) continue;
    values[at(matrix_.diagonal_position(row))] =
        diagonal_[row] + shift.of_variable(i, canonical_.owned_by_max(i));
  }
  for (const Index j : indices(constraints())) {
    const Index row = row_of_constraint(j);
    double diagonal = diagonal_[row];  // of Min -1 / Sigma of the slack, or 0
    if (shift.slacks > 0.0 && diagonal < 0.0) diagonal /= 1.0 - shift.slacks * diagonal;
    values[at(matrix_.diagonal_position(row))] =
        diagonal + shift.of_constraint(canonical_.max_constraints().contains(j));
  }
}

Factorization KktBlock::factorize(const Regularization& shift, Certainty certainty) {
  if (is_factorized(shift, certainty)) return factorization_;
  shift_by(shift);
  certainty_ = certainty;
  factorization_ = solver_->factorize(matrix_, certainty);
  factorized_with_.reset();
  if (factorization_.status == FactorizationStatus::OutOfMemory) throw FactorsOutOfMemory();
  if (factorization_.status == FactorizationStatus::Ok) factorized_with_ = shift;
  return factorization_;
}

Factorization KktBlock::make_certain(const Regularization& shift) {
  if (certainty_ == Certainty::Certain || !is_factorized(shift, certainty_)) return factorization_;
  factorization_ = solver_->make_certain(matrix_, factorization_);
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
  const auto& jacobians = jacobian_.empty() ? evaluation.jacobian : jacobian_;
  for (const Index k : pattern_->jacobian_entries) {
    const auto [row, col] = jacobian[at(k)];
    const double value = jacobians[at(k)];
    product_c[row] -= value * v[col];
    product_v[col] -= value * lambda[row];
  }
}

}  // namespace ipminmax
