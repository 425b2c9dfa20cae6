#include "core/worst_case.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/differences/finite_difference_hessian.hpp"
#include "core/gap.hpp"
#include "core/global/audit.hpp"
#include "core/global/inner_problem.hpp"
#include "core/global/over_y.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof/enclosure.hpp"
#include "core/search/one_start.hpp"
#include "core/search/starts.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Values of maxima in the summary.
constexpr std::size_t kMostListed = 10;
/// Of the range of f over y: maxima whose values differ by less are as high.
constexpr double kValuesAgree = 1e-6;

/// What the maximizations say of f at a point with the value `here`.
WorstCase summary(Problem& problem, const std::vector<double>& v, double here,
                  const MaximaOverY& maxima, const SolverOptions& options) {
  WorstCase found;
  found.starts = maxima.made;
  found.unbounded = maxima.unbounded;
  found.single_branch = maxima.single_branch;
  found.stated_concave = options.minmax_concave_in_y;
  found.maxima =
      static_cast<Index>(std::ranges::count_if(maxima.maxima, &WorstCaseMaximum::certified));
  if (maxima.maxima.empty()) {
    found.higher = found.unbounded;
    return found;
  }
  const ProblemStructure& structure = problem.structure();
  found.value = maxima.maxima.front().value;
  found.v = maxima.maxima.front().v;
  found.y = max_part(structure, found.v);
  for (std::size_t k = 0; k < std::min(kMostListed, maxima.maxima.size()); ++k) {
    found.branches.push_back(maxima.maxima[k].value);
  }
  // Both values are of the same branch where they differ by no more than a maximization is exact.
  ValueRange range = maxima.range;
  range.see(here);
  const double tol = std::max(options.tol, kValuesAgree);
  double clear = range.resolution(tol);
  if (found.value - here > clear && std::isfinite(here))
    clear = std::max(clear, change_with_x(problem, v, found.v, options.tol));
  found.higher = found.unbounded || found.value - here > clear;
  for (const WorstCaseMaximum& maximum : maxima.maxima) {
    if (found.value - maximum.value <= clear) ++found.competing;
  }
  if (maxima.range.size() == 0.0) found.competing = 1;  // f does not vary with y
  return found;
}

// Of a game that is convex in x and concave in y,
//     min over x of f(x, y*)  <=  its value  <=  max over y of f(x*, y)
// with equality at a saddle point (x*, y*), of which there may be many.

/// Random points at which f should look convex and concave, beside the one that is asked about.
constexpr Index kRandomPoints = 8;
/// Random points of one player alone at which f should be no better than the optimum found, and
/// variables that are put at their bounds for that.
constexpr Index kRandomValues = 50;
constexpr std::size_t kVariablesAtBounds = 50;

/// Hessian of f, or of a random sum of the constraints, with errors of its rows.
struct SecondDerivatives {
  SecondDerivatives(Problem& game, const std::vector<double>& v, bool of_objective)
      : s(game.structure()), w(s.hessian.size()), errors(v.size(), 0.0) {
    std::mt19937_64 random(19281218);
    std::vector<double> lambda(s.constraint_players.size(), 0.0);
    if (!of_objective) std::ranges::generate(lambda, [&] { return 1.0 + uniform(random); });
    const double sigma = of_objective ? 1.0 : 0.0;
    if (!game.hessian(v, true, sigma, lambda, true, w) || !all_finite(w)) return;
    static_cast<void>(game.hessian_errors(v, sigma, lambda, errors));
    known = all_finite(errors);
  }

  bool may_vanish() const {
    for (const auto k : indices(w)) {
      if (std::abs(w[k]) > errors[at(s.hessian[k].row)]) return false;
    }
    return known;
  }

  /// Whether a player's own may have no eigenvalue of the wrong sign. tol: of diagonal entries.
  bool may_suit(Player player, double tol) const {
    std::vector<Eigen::Triplet<double>> entries;
    for (Index i = 0; i < std::ssize(errors); ++i) {
      const double shift = errors[at(i)] + std::numeric_limits<double>::min();
      entries.emplace_back(i, i, shift);
    }
    for (const auto k : indices(w)) {
      const auto [row, col] = s.hessian[k];
      if (s.variable_players[at(row)] != player || s.variable_players[at(col)] != player) continue;
      const double own = player == Player::Min ? w[k] : -w[k];
      const double shift = row == col ? tol * std::abs(own) : 0.0;
      entries.emplace_back(std::max(row, col), std::min(row, col), own + shift);
    }
    Eigen::SparseMatrix<double> matrix(std::ssize(errors), std::ssize(errors));
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
    return known && factors.info() == Eigen::Success && factors.vectorD().minCoeff() > 0.0;
  }

  const ProblemStructure& s;
  std::vector<double> w, errors;
  bool known = false;
};

/// Why no gap proves anything, as far as v shows; empty: one does.
std::string why_no_proof(Problem& game, const SolverOptions& options,
                         const std::vector<double>& v) {
  const ProblemStructure& s = game.structure();
  for (const auto& [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] != s.variable_players[at(col)])
      return constraint_name(s, row) + " reads variables of both players";
  }
  if (!SecondDerivatives(game, v, false).may_vanish()) return "a constraint is not linear";
  const SecondDerivatives of_objective(game, v, true);
  const double tol = options.minmax_curvature_tol;
  if (!of_objective.may_suit(Player::Min, tol)) return "f is not convex in x";
  if (!options.minmax_concave_in_y && !of_objective.may_suit(Player::Max, tol))
    return "f is not concave in y";
  return {};
}

/// What one player can reach alone from v: random points, and those with one variable at a bound.
Points points_of(Player player, const ProblemStructure& s, const std::vector<double>& v,
                 const SolverOptions& options) {
  Points points;
  for (Index k = 1; k <= kRandomValues; ++k) {
    std::vector<double>& point = points.emplace_back(random_start(s, v, k, options));
    for (const auto i : indices(v)) {
      if (s.variable_players[i] != player) point[i] = v[i];
    }
  }
  for (std::size_t i = 0; i < std::min(v.size(), kVariablesAtBounds); ++i) {
    for (const double bound : {s.variable_lower[i], s.variable_upper[i]}) {
      if (s.variable_players[i] == player && std::abs(bound) < kUnbounded)
        points.emplace_back(v)[i] = bound;
    }
  }
  return points;
}

DualityGap find_gap(Problem& model, const std::vector<double>& v, const SolverOptions& options,
                    Budget& budget, Result& work) {
  std::optional<FiniteDifferenceHessian> differences;
  const bool given = model.structure().has_hessian &&
                     options.hessian_approximation != HessianApproximation::FiniteDifferenceValues;
  Problem& game = given ? model : differences.emplace(model, options);
  DualityGap gap;
  ValueRange range;
  for (Index k = 0; k <= kRandomPoints; ++k) {
    const std::vector<double> point = k == 0 ? v : random_start(game.structure(), v, k, options);
    gap.message = why_no_proof(game, options, point);
    if (!gap.message.empty()) return gap;
    double f = kNaN;
    if (game.objective(point, true, f)) range.see(f);
  }
  const auto best_value = [&](Player player) {
    if (!gap.message.empty()) return kNaN;
    SolverOptions one_solve = without_restarts(options);
    one_solve.hessian_approximation = HessianApproximation::Exact;
    one_solve.minmax_certificate = CertificateEffort::Quick;
    // Exact beside what f changes by, whatever its units.
    if (range.size() > 0.0)
      one_solve.obj_scaling_factor = std::clamp(1.0 / range.size(), 1.0, kLargestScaling);
    one_solve.warm_start_init_point = false;
    one_solve.nlp_scaling_method = Scaling::GradientBased;  // a user's factor may change the signs
    Held held = alone(game, player, v);
    Result found = solve_from_start(held, one_solve, budget, {}, nullptr);
    found.iterations = 0;
    add_work(found, work);
    const bool exact = is_success(found.status) && found.status != Status::SolvedToAcceptableLevel;
    gap.message = exact ? why_no_proof(game, options, found.v) : found.message;
    if (!gap.message.empty()) return kNaN;
    const double sign = player == Player::Max ? 1.0 : -1.0;
    const auto is_better = [&](const std::vector<double>& point) {
      double f = kNaN;
      return is_feasible(held, options, point) && held.objective(point, false, f) &&
             clearly_greater(sign * f, sign * found.objective, range,
                             options.minmax_worst_case_tol);
    };
    if (std::ranges::any_of(points_of(player, game.structure(), v, options), is_better))
      gap.message = player == Player::Max ? "f is not concave in y" : "f is not convex in x";
    return found.objective;
  };
  const double most = best_value(Player::Max), least = best_value(Player::Min);
  if (!gap.message.empty()) return gap;
  gap.most = most;
  gap.least = least;
  constexpr double kTellsNothing = 1e-3;  // of the range of f: a tolerance that is larger
  gap.saddle_point = gap.size() <= std::max(range.resolution(options.minmax_worst_case_tol),
                                            std::min(options.tol, kTellsNothing * range.size()));
  gap.message = "duality gap " + number_text(gap.size(), 2);
  if (gap.saddle_point)
    gap.message +=
        ": a saddle point, perhaps one of several, whose value is exact over all of x and y, as f "
        "looks convex in x and concave in y";
  return gap;
}

}  // namespace

void look_for_worst_case(Problem& problem, Index starts, const Points& given,
                         const MaximizationContext& context, Result& result) {
  MaximaOverY maxima = maximize_objective(problem, result.v, starts, given, context);
  result.worst_case = summary(problem, result.v, result.objective, maxima, context.options);
  SearchOverY& y = result.over_y;
  y.asked = starts;
  y.functions += 1;
  y.finished = y.finished && maxima.finished && maxima.maximized;
  y.better_known = y.better_known || result.worst_case.higher;
  if (!maxima.proof) return;
  describe(-1, 1.0, *maxima.proof);
  y.finished = y.finished && maxima.proof->complete;
  y.proofs.push_back(std::move(*maxima.proof));
}

WorstCaseCheck check_worst_case(Problem& problem, std::span<const double> v,
                                const SolverOptions& options, Index starts, const Points& given,
                                const MultistartObserver& observer) {
  require_point("the point of a worst-case check", problem.structure(), v);
  WorstCaseCheck check;
  if (!has_max_variables(problem.structure())) return check;
  double here = -kInfinity;
  if (!problem.objective(v, true, here) || std::isnan(here)) here = -kInfinity;
  Budget budget(options, observer);
  Result work;
  MaximaOverY maxima = maximize_objective(problem, v, std::max<Index>(1, starts), given,
                                          {options, budget, 0, problem.structure(), work});
  check.interrupted = budget.interrupted();
  check.found = summary(problem, {v.begin(), v.end()}, here, maxima, options);
  check.maxima = std::move(maxima.maxima);
  return check;
}

void add_worst_case(Problem& problem, const SolverOptions& options, Result& result,
                    const MultistartObserver& observer) {
  const Index starts = starts_over_y_of_objective(options);
  // A negative factor of the objective makes the inner player minimize: no maxima to look for.
  if (starts == 0 || result.v.empty() || result.objective_scale < 0.0 || !all_finite(result.v) ||
      !has_max_variables(problem.structure())) {
    return;
  }
  Budget budget(options, observer);
  Result work;
  look_for_worst_case(problem, starts, {}, {options, budget, 0, problem.structure(), work}, result);
  result.over_y.maximizations += work.over_y.maximizations;
  audit(problem, options, Witnesses(), budget, result, result.counts);
}

DualityGap duality_gap(Problem& problem, std::span<const double> v, const SolverOptions& options) {
  require_point("the point of a duality gap", problem.structure(), v);
  Budget budget(options);
  Result work;
  return find_gap(problem, {v.begin(), v.end()}, options, budget, work);
}

void add_gap(Problem& model, const SolverOptions& options, Budget& budget, Result& result) {
  const auto& players = model.structure().variable_players;
  const bool undecided = result.status == Status::SolvedDegenerate && result.over_y.branches == 0 &&
                         result.objective_scale > 0.0;
  const auto of_min = std::ranges::count(players, Player::Min);
  if (!undecided || of_min == 0 || of_min == std::ssize(players)) return;
  const DualityGap gap = find_gap(model, result.v, options, budget, result);
  if (gap.saddle_point) result.message += "; " + gap.message;
}

}  // namespace ipminmax
