#include <algorithm>
#include <utility>

#include "core/kkt/block.hpp"
#include "core/kkt/schur.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Row of K_yy for every row of K, -1 for x and lambda_x.
std::vector<Index> inner_rows(const KktBlock& full, const KktBlock& inner) {
  std::vector<Index> rows(at(full.dimension()), -1);
  const auto set = [&](Index full_row, Index inner_row) {
    if (full_row >= 0) rows[at(full_row)] = inner_row;
  };
  for (const Index i : indices(inner.variables())) {
    set(full.row_of_variable(i), inner.row_of_variable(i));
  }
  for (const Index j : indices(inner.constraints())) {
    set(full.row_of_constraint(j), inner.row_of_constraint(j));
  }
  return rows;
}

}  // namespace

KktSchur::KktSchur(const KktBlock& full, const KktBlock& inner)
    : complement_(full.matrix(), inner_rows(full, inner)),
      factors_{Factors{.solver = inner.solver()}, Factors{.solver = nullptr}},
      inner_factors_(factors_.data()),
      inner_matrix_(inner.matrix()) {}

double KktSchur::predict_flops(const KktBlock& inner) const {
  return complement_.predict_flops(*inner.solver());
}

void KktSchur::forget_factors() {
  for (Factors& factors : factors_) factors.values.clear();
  full_factors_ = nullptr;
  formed_ = {};
}

void KktSchur::reset_quality() {
  forget_factors();
  for (Factors& factors : factors_) {
    if (factors.solver) factors.solver->reset_quality();
  }
}

KktSchur::Factors* KktSchur::find(std::span<const double> values, Certainty certainty) {
  for (Factors& factors : factors_) {
    const bool made = !factors.values.empty() && certainty <= factors.certainty;
    if (made && std::ranges::equal(factors.values, values)) return &factors;
  }
  return nullptr;
}

bool KktSchur::prepare(const KktBlock& inner, std::shared_ptr<SymmetricSolver> second) {
  if (second) {
    factors_[1].solver = std::move(second);
    factors_[1].solver->reset_quality();
    return true;
  }
  factors_[1].solver = inner.solver()->same_analysis(inner.matrix(), inner.signs());
  return factors_[1].solver != nullptr;
}

const std::shared_ptr<SymmetricSolver>& KktSchur::second(const KktBlock& inner) const {
  return factors_[factors_[0].solver == inner.solver() ? 1 : 0].solver;
}

void KktSchur::factorize(Factors& factors, const SymmetricMatrix& matrix, Certainty certainty,
                         Index& factorized) {
  ++factorized;
  ++factors.serial;
  factors.certainty = certainty;
  factors.result = factors.solver->factorize(matrix, certainty);
  factors.values.assign(matrix.values().begin(), matrix.values().end());
}

Factorization KktSchur::factorize_inner(KktBlock& inner, Certainty certainty, Index& factorized) {
  if (Factors* known = find(inner.matrix().values(), certainty)) {
    inner_factors_ = known;
  } else {
    // K may still be solved with.
    if (inner_factors_ == full_factors_) inner_factors_ = other(inner_factors_);
    factorize(*inner_factors_, inner.matrix(), certainty, factorized);
  }
  inner.take_factors_of(inner_factors_->solver);
  return inner_factors_->result;
}

std::optional<Factorization> KktSchur::factorize(const KktBlock& full, Certainty certainty,
                                                 Index& factorized, Index& complements) {
  complement_.extract_inner(full.matrix(), inner_matrix_.values());
  full_factors_ = find(inner_matrix_.values(), certainty);
  if (!full_factors_) {
    full_factors_ = other(inner_factors_);
    factorize(*full_factors_, inner_matrix_, certainty, factorized);
  }
  Factors& factors = *full_factors_;
  if (factors.result.status == FactorizationStatus::OutOfMemory) return factors.result;
  const bool formed = formed_.factors == &factors && formed_.serial == factors.serial &&
                      formed_.version == full.version();
  if (!formed) {
    formed_ = {};
    if (factors.result.status != FactorizationStatus::Ok ||
        !complement_.form(full.matrix(), *factors.solver)) {
      full_factors_ = nullptr;
      return std::nullopt;
    }
    formed_ = {.factors = &factors, .serial = factors.serial, .version = full.version()};
  }
  ++complements;
  Factorization result = complement_.factorize(full.matrix());
  result.inertia.positive += factors.result.inertia.positive;
  result.inertia.negative += factors.result.inertia.negative;
  result.smallest_pivot = std::min(result.smallest_pivot, factors.result.smallest_pivot);
  result.trust = factors.result.trust;  // the dense complement is pivoted
  return result;
}

void KktSchur::solve_in_place(std::span<double> rhs) {
  complement_.solve_in_place(*full_factors_->solver, rhs);
}

}  // namespace ipminmax
