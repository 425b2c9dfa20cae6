#include "core/iteration_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/paper/algorithm_one.hpp"
#include "core/point/point.hpp"

namespace ipminmax {
namespace {

bool fits(const Problem& problem, const Result& at) {
  const std::size_t n = problem.structure().variable_players.size();
  const std::size_t m = problem.structure().constraint_lower.size();
  return at.v.size() == n && at.lambda.size() == m && at.z_lower.size() == n &&
         at.z_upper.size() == n;
}

/// The starting point is taken as it is.
SolverOptions unmoved(SolverOptions options) {
  const double tiny = std::numeric_limits<double>::min();
  options.warm_start_init_point = true;
  options.warm_start_bound_push = options.warm_start_bound_frac = tiny;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = tiny;
  options.warm_start_mult_bound_push = tiny;
  options.warm_start_mult_init_max = std::numeric_limits<double>::max();
  return options;
}

/// A result has the difference of the multipliers of a slack between two bounds: that of the
/// farther one is taken from the central path.
void split_slack_multipliers(const CanonicalProblem& canonical, double mu, Iterate& iterate) {
  for (const IndexRange slacks : {canonical.x_slacks(), canonical.y_slacks()}) {
    for (const Index i : indices(slacks)) {
      const double below = iterate.v[i] - canonical.lower()[i];
      const double above = canonical.upper()[i] - iterate.v[i];
      if (!std::isfinite(below) || !std::isfinite(above)) continue;
      const double net = iterate.z_upper[i] - iterate.z_lower[i];
      iterate.z_lower[i] = net >= 0.0 ? mu / below : mu / above - net;
      iterate.z_upper[i] = iterate.z_lower[i] + net;
    }
  }
}

/// Fills the point; what is undefined is named.
std::string evaluate(CanonicalProblem& canonical, const SolverOptions& options, double mu,
                     Point& point) {
  begin_at(canonical, canonical.starting_point(), point);
  if (!evaluate_values(canonical, point)) return canonical.evaluation_error();
  canonical.start_slacks(point.iterate, point.evaluation.c);
  start_bound_multipliers(canonical, options, point.iterate);
  split_slack_multipliers(canonical, mu, point.iterate);
  const bool defined = evaluate_values(canonical, point) && evaluate_derivatives(canonical, point);
  return defined ? std::string() : canonical.evaluation_error();
}

/// A row of the Newton system on whose diagonal E stands.
struct ShiftedRow {
  Index index = 0;
  bool is_variable = true;
  double shift = 0.0;
};

std::vector<ShiftedRow> shifted_rows(const CanonicalProblem& canonical,
                                     const Regularization& shift) {
  std::vector<ShiftedRow> rows;
  const auto add = [&](IndexRange range, bool is_variable, double value) {
    for (const Index i : indices(range)) rows.push_back({i, is_variable, value});
  };
  add(canonical.x(), true, shift.x);
  add(canonical.y(), true, -shift.y);
  if (shift.lambda_x != 0.0) add(canonical.min_constraints(), false, -shift.lambda_x);
  if (shift.lambda_y != 0.0) add(canonical.max_constraints(), false, shift.lambda_y);
  return rows;
}

/// The rows and columns of (J_zz + E)^-1 E in which it is not zero. Empty: inaccurate.
std::optional<Eigen::MatrixXd> map_matrix(const CanonicalProblem& canonical, KktSystem& kkt,
                                          const Evaluation& evaluation,
                                          const Regularization& shift) {
  const std::vector<ShiftedRow> rows = shifted_rows(canonical, shift);
  const auto size = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd map(size, size);
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  for (Eigen::Index j = 0; j < size; ++j) {
    const ShiftedRow& column = rows[static_cast<std::size_t>(j)];
    set_zero(rhs);
    (column.is_variable ? rhs.v : rhs.lambda)[column.index] = column.shift;
    if (!kkt.solve(evaluation, rhs, step)) return std::nullopt;
    for (Eigen::Index i = 0; i < size; ++i) {
      const ShiftedRow& row = rows[static_cast<std::size_t>(i)];
      map(i, j) = (row.is_variable ? step.v : step.lambda)[row.index];
    }
  }
  return map;
}

std::optional<Regularization> choose_shift(KktSystem& kkt, const SolverOptions& options,
                                           Counts& counts, double mu) {
  const auto prescribed = prescribed_shift(options);
  if (!prescribed) {
    return InertiaCorrection(kkt, options, counts, Certainty::Certain).correct(mu);
  }
  const bool regular = kkt.factorize(*prescribed).status == FactorizationStatus::Ok;
  return regular ? prescribed : std::nullopt;
}

}  // namespace

IterationMap iteration_map(Problem& problem, const Result& at, const SolverOptions& given) {
  IterationMap map;
  const SolverOptions options = unmoved(given);
  if (map.error = check(options); !map.error.empty()) return map;
  if (!fits(problem, at)) {
    map.error = "the point's vectors do not have the problem's sizes";
    return map;
  }
  Counts counts;
  Timing timing;
  AtResult started(problem, &at);
  CanonicalProblem canonical(started, options, counts, timing);
  if (map.error = canonical.build(); !map.error.empty()) return map;
  KktSystem kkt(canonical, options, counts, timing);
  Point point;
  if (map.error = evaluate(canonical, options, at.mu, point); !map.error.empty()) return map;
  map.residual = barrier_error(canonical, point, at.mu, options.s_max).norm();

  map.error = "the KKT matrix cannot be factorized";
  if (!kkt.analyze()) return map;
  kkt.assemble(point.iterate, point.evaluation);
  map.inner_expected = kkt.layout().expected_inner();
  map.full_expected = kkt.layout().expected();
  map.inner = kkt.factorize_inner({}).inertia;
  map.full = kkt.factorize({}).inertia;
  const auto shift = choose_shift(kkt, options, counts, at.mu);
  if (!shift) return map;
  map.delta_x = shift->x;
  map.delta_y = shift->y;
  const auto matrix = map_matrix(canonical, kkt, point.evaluation, *shift);
  if (!matrix) return map;
  map.error.clear();

  const Eigen::VectorXcd values = Eigen::EigenSolver<Eigen::MatrixXd>(*matrix, false).eigenvalues();
  map.eigenvalues.assign(values.begin(), values.end());
  std::ranges::sort(map.eigenvalues,
                    [](const auto& a, const auto& b) { return std::abs(a) > std::abs(b); });
  if (!map.eigenvalues.empty()) map.spectral_radius = std::abs(map.eigenvalues.front());
  return map;
}

}  // namespace ipminmax
