#include "core/reduction/row_maximum.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/kkt/block.hpp"
#include "core/model/norms.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {
namespace {

/// Accuracy of y, iterations of a solve that begins near it, and of one that does not.
constexpr double kTolerance = 1e-10;
constexpr int kNearIterations = 50;
constexpr int kFarIterations = 500;
/// Bound multipliers and distances of a warm start as they are.
constexpr double kHardly = 1e-20;
/// Barrier parameter of the problem in x from which phi is corrected by the gap that it leaves: with
/// larger ones the correction at one x is wrong at others.
constexpr double kGapFrom = 1e-6;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::size_t packed(std::size_t row, std::size_t col) {
  return row >= col ? row * (row + 1) / 2 + col : col * (col + 1) / 2 + row;
}

}  // namespace

RowMaximum::RowMaximum(Problem& model, Row row, const SolverOptions& options, Budget& budget)
    : model_(model),
      whole_(row.held ? RobustScope{} : robust_scope(model.structure(), row.constraint)),
      scope_(without_consequences(model, whole_, row.constraint, row.v, options)),
      constraint_(row.constraint),
      side_(row.side),
      options_(options),
      over_y_(model, scope_, row.constraint, row.side),
      budget_(budget),
      kept_(std::make_unique<KeptWork>()),
      mu_(0.0) {
  const ProblemStructure& s = model.structure();
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  here_.point = {std::move(row.v), std::vector<double>(m), std::vector<double>(n),
                 std::vector<double>(n)};
  accepted_ = here_;
  g_.resize(m);
  lambda_.resize(m);
  jacobian_.resize(s.jacobian.size());
  hessian_.resize(s.hessian.size());
  make_pattern();
  static_cast<void>(follow_barrier(options.mu_init));
}

/// Rows of M and columns of B.
void RowMaximum::make_pattern() {
  const ProblemStructure& s = model_.structure();
  const std::size_t n = s.variable_players.size();
  x_place_.assign(n, -1);
  y_place_.assign(n, -1);
  h_place_.assign(s.constraint_players.size(), -1);
  for (const Index i : scope_.variables) {
    if (s.variable_lower[at(i)] == s.variable_upper[at(i)]) continue;
    y_place_[at(i)] = static_cast<Index>(y_.size());
    y_.push_back(i);
  }
  for (const Index j : scope_.constraints) {
    if (!(s.constraint_lower[at(j)] > options_.nlp_lower_bound_inf) &&
        !(s.constraint_upper[at(j)] < options_.nlp_upper_bound_inf)) {
      continue;
    }
    h_place_[at(j)] = static_cast<Index>(y_.size() + h_.size());
    h_.push_back(j);
  }
  for_each_bound(here_.point, g_, [&](Index, const Bound&) { ++bounds_; });
  std::vector<bool> involved(n, false);
  for (const auto [row, col] : s.jacobian) {
    const bool mine = row == constraint_ || h_place_[at(row)] >= 0;
    if (mine && s.variable_players[at(col)] == Player::Min) involved[at(col)] = true;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!involved[i] || s.variable_lower[i] == s.variable_upper[i]) continue;
    x_place_[i] = static_cast<Index>(x_.size());
    x_.push_back(static_cast<Index>(i));
  }
  std::vector<Triplet> entries;
  for (const auto [row, col] : s.hessian) {
    if (y_place_[at(row)] >= 0 && y_place_[at(col)] >= 0) {
      entries.push_back({y_place_[at(row)], y_place_[at(col)]});
    }
  }
  for (const auto [row, col] : s.jacobian) {
    if (h_place_[at(row)] >= 0 && y_place_[at(col)] >= 0) {
      entries.push_back({h_place_[at(row)], y_place_[at(col)]});
    }
  }
  const auto dimension = static_cast<Index>(y_.size() + h_.size());
  matrix_ = SymmetricMatrix(dimension, entries);
  signs_.assign(at(dimension), 1);
  std::fill_n(signs_.begin(), y_.size(), static_cast<std::int8_t>(-1));
  linear_solver_ = make_symmetric_solver(options_.linear_solver, solver_options(options_));
}

SolverOptions RowMaximum::inner_options(bool warm) const {
  SolverOptions o = options_;
  o.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  o.obj_scaling_factor = 1.0;
  o.bound_relax_factor = 0.0;
  o.mu_strategy = BarrierStrategy::Monotone;
  o.mu_target = mu_;
  o.tol = std::min(options_.tol, kTolerance);
  o.acceptable_iter = 0;
  o.max_iter = warm ? kNearIterations : kFarIterations;
  o.minmax_starts = 1;
  o.minmax_worst_case_starts = 0;
  o.minmax_epigraph = o.minmax_epigraph_at_kinks = false;
  o.minmax_globalization = Globalization::Filter;
  o.warm_start_init_point = warm;
  if (warm) {
    o.mu_init = mu_;
    o.minmax_max_restarts = 0;
    o.minmax_certificate = CertificateEffort::None;
    o.warm_start_bound_push = o.warm_start_bound_frac = kHardly;
    o.warm_start_slack_bound_push = o.warm_start_slack_bound_frac = kHardly;
    o.warm_start_mult_bound_push = kHardly;
    o.warm_start_mult_init_max = 1e20;
  } else {
    o.mu_init = std::max(options_.mu_init, mu_);
    o.minmax_max_restarts = std::min(options_.minmax_max_restarts, 3);
    o.minmax_certificate = CertificateEffort::Quick;
  }
  return o;
}

bool RowMaximum::same_x(std::span<const double> v, const Place& place) const {
  return std::ranges::all_of(x_, [&](Index i) { return v[at(i)] == place.point.v[at(i)]; });
}

bool RowMaximum::move_to(std::span<const double> v) {
  if (started_ && same_x(v, here_)) return true;
  if (started_ && same_x(v, accepted_)) {
    here_ = accepted_;
    factorized_ = false;
    return true;
  }
  if (started_) elsewhere_ = here_.point.v;
  RowPoint from = started_ ? accepted_.point : here_.point;
  const auto& players = model_.structure().variable_players;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (players[i] == Player::Min) from.v[i] = v[i];
  }
  Place to;
  if (!(started_ && maximize(from, true, to)) && !maximize(from, false, to)) return false;
  here_ = std::move(to);
  if (!started_) accepted_ = here_;
  started_ = true;
  return true;
}

bool RowMaximum::maximize(const RowPoint& from, bool warm, Place& to) {
  factorized_ = false;
  if (y_.empty()) {
    to.point = from;
    if (!model_.constraints(from.v, true, g_)) return false;
    to.value = side_ * g_[at(constraint_)];
    return std::isfinite(to.value);
  }
  over_y_.start_at(from);
  Result result = solve_from_start(over_y_, inner_options(warm), budget_, {}, kept_.get());
  ++solves_;
  iterations_ += result.iterations;
  if (!is_success(result.status) || !all_finite(result.v) || !all_finite(result.lambda)) {
    failure_ = std::string(name_of(result.status)) + ": " + result.message;
    return false;
  }
  scale_ = std::abs(result.objective_scale);
  to.point = {std::move(result.v), std::move(result.lambda), std::move(result.z_lower),
              std::move(result.z_upper)};
  if (!is_maximum(to.point)) {
    failure_ = "the point found is no strict local maximum";
    return false;
  }
  if (!model_.constraints(to.point.v, true, g_)) return false;
  const Barrier barrier = barrier_at(to.point, g_);
  to.value = side_ * g_[at(constraint_)] + weight() * barrier.logarithms - offset_;
  return std::isfinite(to.value);
}

bool RowMaximum::follow_barrier(double mu) {
  const double own = mu / static_cast<double>(std::max<Index>(bounds_, 1));
  if (own == mu_ || bounds_ == 0) return false;
  mu_ = own;
  offset_ = 0.0;
  if (!started_) return false;
  Place to;
  if (!maximize(here_.point, true, to) && !maximize(here_.point, false, to)) return true;
  // What the logarithms make of phi at this point is replaced by the gap to the value without.
  if (mu <= kGapFrom && model_.constraints(to.point.v, true, g_)) {
    const Barrier barrier = barrier_at(to.point, g_);
    offset_ = weight() * barrier.logarithms - barrier.gap;
    to.value = side_ * g_[at(constraint_)] + barrier.gap;
  }
  here_ = std::move(to);
  accepted_ = here_;
  return true;
}

/// use(row of M, bound) for every bound of y and of Max inequalities.
template <class Use>
void RowMaximum::for_each_bound(const RowPoint& point, std::span<const double> g, Use use) const {
  const ProblemStructure& s = model_.structure();
  const auto both = [&](Index row, double value, double lower, double upper, double z_lower,
                        double z_upper) {
    const bool below = lower > options_.nlp_lower_bound_inf;
    const bool above = upper < options_.nlp_upper_bound_inf;
    const double half = 0.5 * (upper - lower);
    if (below) {
      use(row, Bound{value - lower, -z_lower, above ? half : std::max(1.0, std::abs(lower))});
    }
    if (above) {
      use(row, Bound{upper - value, -z_upper, below ? half : std::max(1.0, std::abs(upper))});
    }
  };
  for (const Index i : y_) {
    both(y_place_[at(i)], point.v[at(i)], s.variable_lower[at(i)], s.variable_upper[at(i)],
         point.z_lower[at(i)], point.z_upper[at(i)]);
  }
  for (const Index j : h_) {
    if (s.constraint_lower[at(j)] == s.constraint_upper[at(j)]) continue;
    both(h_place_[at(j)], g[at(j)], s.constraint_lower[at(j)], s.constraint_upper[at(j)],
         -point.lambda[at(j)], point.lambda[at(j)]);
  }
}

/// The distance to a bound: that which its multiplier shows where that is the larger of the two,
/// mu = distance * multiplier.
double RowMaximum::distance(double distance, double multiplier) const {
  return multiplier > distance ? weight() / multiplier : distance;
}

RowMaximum::Barrier RowMaximum::barrier_at(const RowPoint& point, std::span<const double> g) const {
  Barrier barrier;
  for_each_bound(point, g, [&](Index, const Bound& bound) {
    const double d = distance(bound.distance, bound.multiplier);
    barrier.logarithms += std::log(d / bound.length);
    if (bound.multiplier > d) barrier.gap += d * bound.multiplier;
  });
  return barrier;
}

bool RowMaximum::is_maximum(const RowPoint& point) {
  if (!model_.structure().has_hessian) return true;  // the solve over y has looked
  return factorize(point);
}

/// M at a point, equilibrated, with the inertia of a strict local maximum.
bool RowMaximum::factorize(const RowPoint& point) {
  factorized_ = false;
  if (matrix_.dimension() == 0) return factorized_ = true;
  const ProblemStructure& s = model_.structure();
  lambda_ = point.lambda;
  for (std::size_t j = 0; j < lambda_.size(); ++j) {
    if (h_place_[j] < 0) lambda_[j] = 0.0;
  }
  lambda_[at(constraint_)] = side_;
  if (!model_.constraints(point.v, true, g_) || !model_.jacobian(point.v, false, jacobian_) ||
      !model_.hessian(point.v, false, 0.0, lambda_, true, hessian_)) {
    return false;
  }
  matrix_.set_zero();
  const auto values = matrix_.values();
  auto position = matrix_.triplet_positions().begin();
  for (std::size_t k = 0; k < s.hessian.size(); ++k) {
    const auto [row, col] = s.hessian[k];
    if (y_place_[at(row)] >= 0 && y_place_[at(col)] >= 0) values[at(*position++)] += hessian_[k];
  }
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (h_place_[at(row)] >= 0 && y_place_[at(col)] >= 0) values[at(*position++)] += jacobian_[k];
  }
  std::vector<double>& sigma = scaling_;  // barrier curvature per row of M
  sigma.assign(signs_.size(), 0.0);
  for_each_bound(point, g_, [&](Index row, const Bound& bound) {
    const double d = distance(bound.distance, bound.multiplier);
    sigma[at(row)] += weight() / (d * d);
  });
  for (std::size_t row = 0; row < sigma.size(); ++row) {
    if (sigma[row] == 0.0) continue;
    double& diagonal = values[at(matrix_.diagonal_position(static_cast<Index>(row)))];
    if (row < y_.size()) {
      diagonal -= sigma[row];
    } else {
      diagonal += 1.0 / sigma[row];
    }
  }
  // Equilibrated: barrier terms are huge beside the others.
  const auto starts = matrix_.column_starts();
  const auto rows = matrix_.rows();
  scaling_.assign(signs_.size(), 0.0);
  for (std::size_t col = 0; col < scaling_.size(); ++col) {
    for (std::size_t k = at(starts[col]); k < at(starts[col + 1]); ++k) {
      scaling_[col] = std::max(scaling_[col], std::abs(values[k]));
      scaling_[at(rows[k])] = std::max(scaling_[at(rows[k])], std::abs(values[k]));
    }
  }
  for (double& factor : scaling_) factor = factor > 0.0 ? 1.0 / std::sqrt(factor) : 1.0;
  for (std::size_t col = 0; col < scaling_.size(); ++col) {
    for (std::size_t k = at(starts[col]); k < at(starts[col + 1]); ++k) {
      values[k] *= scaling_[col] * scaling_[at(rows[k])];
    }
  }
  if (!analyzed_) {
    analyzed_ = linear_solver_->analyze(matrix_, signs_).ok;
    if (!analyzed_) return false;
  }
  const Inertia expected{static_cast<Index>(h_.size()), static_cast<Index>(y_.size()), 0};
  Factorization found = linear_solver_->factorize(matrix_);
  while (!(found.status == FactorizationStatus::Ok && found.inertia == expected) &&
         !found.trust.pivoted && linear_solver_->increase_quality()) {
    found = linear_solver_->factorize(matrix_);
  }
  factorized_ = found.status == FactorizationStatus::Ok && found.inertia == expected;
  return factorized_;
}

bool RowMaximum::gradient(std::span<double> out) {
  const ProblemStructure& s = model_.structure();
  const RowPoint& point = here_.point;
  if (!model_.jacobian(point.v, true, jacobian_)) return false;
  std::ranges::fill(out, 0.0);
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    const Index place = x_place_[at(col)];
    if (place < 0) continue;
    if (row == constraint_) out[at(place)] += side_ * jacobian_[k];
    if (h_place_[at(row)] >= 0) out[at(place)] += point.lambda[at(row)] * jacobian_[k];
  }
  return true;
}

bool RowMaximum::add_hessian(double weight, std::span<double> out) {
  const ProblemStructure& s = model_.structure();
  if (!factorize(here_.point)) return false;
  for (std::size_t k = 0; k < s.hessian.size(); ++k) {
    const auto [row, col] = s.hessian[k];
    const Index a = x_place_[at(row)], b = x_place_[at(col)];
    if (a >= 0 && b >= 0) out[packed(at(a), at(b))] += weight * hessian_[k];
  }
  const std::size_t size = signs_.size();
  if (size == 0) return true;
  // B, scaled as M is; product of B and M^-1 B.
  right_.assign(size * x_.size(), 0.0);
  const auto add = [&](Index x, Index row, double value) {
    right_[at(x) * size + at(row)] += scaling_[at(row)] * value;
  };
  for (std::size_t k = 0; k < s.hessian.size(); ++k) {
    const auto [row, col] = s.hessian[k];
    if (x_place_[at(row)] >= 0 && y_place_[at(col)] >= 0) {
      add(x_place_[at(row)], y_place_[at(col)], hessian_[k]);
    } else if (y_place_[at(row)] >= 0 && x_place_[at(col)] >= 0) {
      add(x_place_[at(col)], y_place_[at(row)], hessian_[k]);
    }
  }
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (h_place_[at(row)] >= 0 && x_place_[at(col)] >= 0) {
      add(x_place_[at(col)], h_place_[at(row)], jacobian_[k]);
    }
  }
  solution_ = right_;
  const auto columns = static_cast<Index>(x_.size());
  linear_solver_->solve_in_place(solution_, columns);
  // One refinement: what the factorization adds to pivots is seen beside barrier terms.
  std::vector<double> residual = right_, product(size);
  for (std::size_t c = 0; c < x_.size(); ++c) {
    matrix_.multiply(std::span<const double>(solution_).subspan(c * size, size), product);
    for (std::size_t i = 0; i < size; ++i) residual[c * size + i] -= product[i];
  }
  linear_solver_->solve_in_place(residual, columns);
  for (std::size_t i = 0; i < solution_.size(); ++i) solution_[i] += residual[i];
  for (std::size_t a = 0; a < x_.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      double sum = 0.0;
      for (std::size_t i = 0; i < size; ++i) sum += right_[a * size + i] * solution_[b * size + i];
      out[packed(a, b)] -= weight * sum;
    }
  }
  return true;
}

std::vector<double> RowMaximum::other_branch(double distinct_tol) {
  if (!started_ || y_.empty()) return {};
  if (!same_x(here_.point.v, accepted_)) elsewhere_ = here_.point.v;
  if (elsewhere_.empty()) return {};
  RowPoint from = accepted_.point;
  for (const Index i : y_) from.v[at(i)] = elsewhere_[at(i)];
  Place other;
  if (same_point(from.v, accepted_.point.v, distinct_tol) || !maximize(from, false, other) ||
      same_point(other.point.v, accepted_.point.v, distinct_tol)) {
    return {};
  }
  return other.point.v;
}

Result RowMaximum::settle() {
  RowOverY over_y(model_, whole_, constraint_, side_);
  over_y.start_at(here_.point);
  SolverOptions o = inner_options(true);
  o.mu_target = 0.0;
  o.tol = options_.tol;
  o.bound_relax_factor = options_.bound_relax_factor;
  o.max_iter = kFarIterations;
  o.minmax_certificate = CertificateEffort::Full;
  return solve_from_start(over_y, o, budget_, {}, nullptr);
}

}  // namespace ipminmax
