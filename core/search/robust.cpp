#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "core/model/forwarding_problem.hpp"
#include "core/model/robust_copies.hpp"
#include "core/multistart.hpp"
#include "core/robust.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Rounds of solving and looking for worst cases.
constexpr Index kMostRounds = 30;
/// Points at which the gradient of f tells which Max variables f reads, and how far they lie from the
/// start, relative to max(1, |v|).
constexpr int kProbes = 3;
constexpr double kProbeRadius = 0.1;
/// Excess over its bound, relative to its range, from which a constraint asks for another scenario.
constexpr double kScenarioTol = 1e-3;
/// Distance to its bound, on that scale, within which a maximum becomes a worst case of its own.
constexpr double kNearlyActive = 1e-2;
/// Multiplier, relative to the largest one, below which a worst case is inactive.
constexpr double kVanishing = 1e-5;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Max over y of side times one constraint of the model, x held; side -1 for a lower bound.
class ConstraintOverY final : public ForwardingProblem {
 public:
  ConstraintOverY(Problem& model, Index constraint, double side, std::vector<double> v)
      : ForwardingProblem(model),
        structure_(model.structure()),
        constraint_(constraint),
        side_(side),
        v_(std::move(v)),
        g_(structure_.constraint_players.size()),
        lambda_(g_.size()),
        jacobian_(structure_.jacobian.size()) {
    const RobustScope scope = robust_scope(structure_, constraint);
    const ProblemStructure& s = model.structure();
    structure_.variable_lower = structure_.variable_upper = v_;
    for (const Index i : scope.variables) {
      structure_.variable_lower[at(i)] = s.variable_lower[at(i)];
      structure_.variable_upper[at(i)] = s.variable_upper[at(i)];
    }
    std::ranges::fill(structure_.constraint_lower, -kInfinity);
    std::ranges::fill(structure_.constraint_upper, kInfinity);
    for (const Index j : scope.constraints) {
      structure_.constraint_lower[at(j)] = s.constraint_lower[at(j)];
      structure_.constraint_upper[at(j)] = s.constraint_upper[at(j)];
    }
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    return !start.needs_multipliers;
  }
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    if (!model().user_scaling(scaling)) return false;
    if (!scaling.constraints.empty()) scaling.objective = scaling.constraints[at(constraint_)];
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    if (!model().constraints(v, true, g_)) return false;
    f = side_ * g_[at(constraint_)];
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    if (!model().jacobian(v, true, jacobian_)) return false;
    std::ranges::fill(grad, 0.0);
    for (std::size_t k = 0; k < jacobian_.size(); ++k) {
      const auto [row, col] = structure_.jacobian[k];
      if (row == constraint_) grad[at(col)] += side_ * jacobian_[k];
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    return model().hessian(v, true, 0.0, weights(sigma, lambda), true, values);
  }
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    return model().hessian_errors(v, 0.0, weights(sigma, lambda), row_errors);
  }

 private:
  [[nodiscard]] std::span<const double> weights(double sigma, std::span<const double> lambda) {
    std::ranges::copy(lambda, lambda_.begin());
    lambda_[at(constraint_)] = sigma * side_;
    return lambda_;
  }

  ProblemStructure structure_;
  Index constraint_;
  double side_;
  std::vector<double> v_;
  std::vector<double> g_, lambda_, jacobian_;
};

bool stopped_from_outside(Status status) {
  return status == Status::UserStop || status == Status::MaxCpuTime ||
         status == Status::MaxWallTime || status == Status::OutOfMemory;
}

/// Whether indices can be followed; solve says what is wrong with others.
bool well_formed(const ProblemStructure& s) {
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  const auto inside = [](Index i, std::size_t size) { return i >= 0 && at(i) < size; };
  return s.variable_lower.size() == n && s.variable_upper.size() == n &&
         s.constraint_lower.size() == m && s.constraint_upper.size() == m &&
         std::ranges::all_of(s.jacobian,
                             [&](Triplet t) { return inside(t.row, m) && inside(t.col, n); }) &&
         std::ranges::all_of(s.hessian,
                             [&](Triplet t) { return inside(t.row, n) && inside(t.col, n); });
}

std::vector<Index> robust_constraints(const ProblemStructure& s) {
  std::vector<Index> rows;
  for (const auto [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] == Player::Min &&
        s.variable_players[at(col)] == Player::Max) {
      rows.push_back(row);
    }
  }
  std::ranges::sort(rows);
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

/// Which Max variables f reads, from its gradient around the start.
std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start) {
  const ProblemStructure& s = model.structure();
  std::vector<bool> reads(start.size(), false);
  std::vector<double> v = start, gradient(start.size());
  std::mt19937_64 random(20220411);
  for (int probe = 0; probe < kProbes; ++probe) {
    for (std::size_t i = 0; probe > 0 && i < v.size(); ++i) {
      const double t = std::ldexp(static_cast<double>(random() >> 11U), -52) - 1.0;
      v[i] = std::clamp(start[i] + kProbeRadius * t * std::max(1.0, std::abs(start[i])),
                        std::min(s.variable_lower[i], start[i]),
                        std::max(s.variable_upper[i], start[i]));
    }
    if (!model.gradient(v, true, gradient)) continue;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (s.variable_players[i] == Player::Max && gradient[i] != 0.0) reads[i] = true;
    }
  }
  return reads;
}

/// What maximizations of one side of a robust constraint over y have found at one x.
struct SideScan {
  Index constraint = 0;
  double bound = 0.0;                           ///< of side times the constraint
  double scale = 0.0;                           ///< range of its values seen
  std::vector<RobustCopies::WorstCase> maxima;  ///< distinct, the largest value first
  std::vector<double> values;                   ///< theirs, side times the constraint
  std::vector<std::vector<double>> starts;      ///< where the maximizations began
  /// Excess over the bound, relative to the scale; negative: the constraint holds.
  [[nodiscard]] double excess(std::size_t k) const {
    return (values[k] - bound) / std::max(scale, std::numeric_limits<double>::min());
  }
};

/// The search for worst cases around a list of solves.
class RobustSearch {
 public:
  RobustSearch(Problem& model, const SolverOptions& options, const SolveObserver& observer)
      : model_(model), options_(options), observer_(observer) {}

  RobustResult run();

 private:
  [[nodiscard]] bool find_start();
  void choose_copies();
  [[nodiscard]] bool solve_rounds();
  [[nodiscard]] bool exchange();
  void release(const std::vector<SideScan>& scans);
  [[nodiscard]] Result solve_once(RobustCopies& copies);
  [[nodiscard]] Result solve_from_here();
  void keep_point(const RobustCopies& copies, const Result& result);
  [[nodiscard]] bool add_violated(const std::vector<SideScan>& scans, double tolerance, bool held);
  [[nodiscard]] bool drop_inactive(const RobustCopies& copies, const Result& result);
  [[nodiscard]] std::vector<SideScan> scan(const std::vector<double>& x);
  [[nodiscard]] SideScan scan_side(Index constraint, double side, const std::vector<double>& x);
  [[nodiscard]] Result in_model_shape(const RobustCopies& copies, const Result& result) const;
  void list_worst_cases(const RobustCopies& copies, const Result& result);

  Problem& model_;
  const SolverOptions& options_;
  const SolveObserver& observer_;
  std::vector<double> start_;
  bool moved_ = false;  ///< start_ is no longer the model's
  std::vector<bool> reads_y_;
  std::vector<RobustCopies::WorstCase> worst_cases_;
  RobustResult answer_;
};

RobustResult RobustSearch::run() {
  answer_.largest_violation = std::numeric_limits<double>::quiet_NaN();
  if (!well_formed(model_.structure()) || !find_start()) {
    answer_.result = solve(model_, options_, observer_);  // says what is wrong
    return std::move(answer_);
  }
  const std::vector<double> first_start = start_;
  choose_copies();
  if (solve_rounds() || options_.minmax_worst_case_starts == 0 ||
      stopped_from_outside(answer_.result.status)) {
    return std::move(answer_);
  }
  // One branch of y alone may leave x unbounded, or end: scenarios first, then the worst cases at
  // the x that they give.
  start_ = first_start;
  moved_ = false;
  if (exchange()) static_cast<void>(solve_rounds());
  return std::move(answer_);
}

/// Solves with the worst cases at hand and adds violated ones until there are none. The answer is that
/// of the last solve; whether it is a success.
bool RobustSearch::solve_rounds() {
  bool dropped = false;
  for (Index round = 0;; ++round) {
    RobustCopies copies(model_, worst_cases_, reads_y_);
    if (moved_) copies.start_at(start_);
    const Result result = solve_once(copies);
    const bool success = is_success(result.status);
    if (success) {
      keep_point(copies, result);
      if (options_.minmax_worst_case_starts > 0 && round < kMostRounds) {
        if (add_violated(scan(start_), options_.minmax_worst_case_tol, false)) continue;
        // Checked over all of y, worst cases far from active only blur the certificate.
        if (!dropped && (dropped = drop_inactive(copies, result))) continue;
      }
    }
    answer_.worst_cases.clear();
    list_worst_cases(copies, result);
    answer_.result = in_model_shape(copies, result);
    return success;
  }
}

/// Solves with scenarios of y, the worst of them added in each round, until none violates much.
bool RobustSearch::exchange() {
  worst_cases_.clear();
  for (const SideScan& side : scan(start_)) {
    for (const auto& v : side.starts) worst_cases_.push_back({side.constraint, v, true, true});
    for (const auto& found : side.maxima) {
      worst_cases_.push_back({side.constraint, found.v, true, true});
    }
  }
  for (Index round = 0; round < kMostRounds; ++round) {
    RobustCopies copies(model_, worst_cases_, reads_y_);
    if (moved_) copies.start_at(start_);
    const Result result = solve_once(copies);
    if (!is_success(result.status)) return false;
    keep_point(copies, result);
    const std::vector<SideScan> scans = scan(start_);
    if (!add_violated(scans, kScenarioTol, true)) {
      release(scans);
      return true;
    }
  }
  return false;
}

/// The worst cases that are active or nearly so at this x, with y free again.
void RobustSearch::release(const std::vector<SideScan>& scans) {
  worst_cases_.clear();
  for (const SideScan& side : scans) {
    for (std::size_t k = 0; k < side.maxima.size(); ++k) {
      if (k == 0 || side.excess(k) > -kNearlyActive) worst_cases_.push_back(side.maxima[k]);
    }
  }
}

bool RobustSearch::find_start() {
  start_.assign(model_.structure().variable_players.size(), 0.0);
  StartingPoint start{
      .v = start_, .needs_multipliers = false, .lambda = {}, .z_lower = {}, .z_upper = {}};
  return model_.starting_point(start);
}

void RobustSearch::choose_copies() {
  const ProblemStructure& s = model_.structure();
  reads_y_ = read_by_objective(model_, start_);
  std::vector<Index> readers(start_.size(), 0);
  const std::vector<Index> rows = robust_constraints(s);
  for (const Index row : rows) {
    for (const Index i : robust_scope(s, row).variables) ++readers[at(i)];
  }
  for (const Index row : rows) {
    const RobustScope scope = robust_scope(s, row);
    const bool shared = std::ranges::any_of(
        scope.variables, [&](Index i) { return reads_y_[at(i)] || readers[at(i)] > 1; });
    worst_cases_.push_back({row, start_, shared && options_.minmax_robust_copies});
  }
}

Result RobustSearch::solve_once(RobustCopies& copies) {
  SolverOptions options = options_;
  options.warm_start_init_point = false;
  SolveObserver observer = observer_;
  if (observer_.on_iteration) {
    observer.on_iteration = [&](const IterationInfo& info) {
      IterationInfo seen = info;
      seen.v = info.v.first(start_.size());
      seen.result = [&] { return in_model_shape(copies, info.result()); };
      return observer_.on_iteration(seen);
    };
  }
  ++answer_.solves;
  return solve(copies, options, observer);
}

/// The next solve goes on from here.
void RobustSearch::keep_point(const RobustCopies& copies, const Result& result) {
  start_.assign(result.v.begin(), result.v.begin() + static_cast<std::ptrdiff_t>(start_.size()));
  moved_ = true;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    worst_cases_[k].v = copies.model_point(result.v, k);
  }
}

/// One more worst case of each side whose largest maximum exceeds the bound, unless it is known.
bool RobustSearch::add_violated(const std::vector<SideScan>& scans, double tolerance, bool held) {
  bool any = false;
  for (const SideScan& side : scans) {
    if (side.maxima.empty() || !(side.excess(0) > tolerance)) continue;
    const auto& worst = side.maxima.front();
    const bool known = std::ranges::any_of(worst_cases_, [&](const auto& other) {
      return other.constraint == side.constraint &&
             same_point(worst.v, other.v, options_.minmax_distinct_tol);
    });
    if (known) continue;
    worst_cases_.push_back({side.constraint, worst.v, true, held});
    any = true;
  }
  return any;
}

/// Drops worst cases whose multiplier vanishes or that have met another one; each constraint keeps at
/// least one. Whether there were any.
bool RobustSearch::drop_inactive(const RobustCopies& copies, const Result& result) {
  double largest = 0.0;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    largest = std::max(largest, std::abs(result.lambda[at(copies.row(k))]));
  }
  std::vector<RobustCopies::WorstCase> kept;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const auto& worst_case = worst_cases_[k];
    const bool active = std::abs(result.lambda[at(copies.row(k))]) > kVanishing * largest;
    const bool met = std::ranges::any_of(kept, [&](const auto& other) {
      return other.constraint == worst_case.constraint &&
             same_point(worst_case.v, other.v, options_.minmax_distinct_tol);
    });
    if ((active && !met) || !worst_case.copied) kept.push_back(worst_case);
  }
  for (const auto& worst_case : worst_cases_) {
    if (std::ranges::find(kept, worst_case.constraint, &RobustCopies::WorstCase::constraint) ==
        kept.end()) {
      kept.push_back(worst_case);
    }
  }
  const bool fewer = kept.size() < worst_cases_.size();
  worst_cases_ = std::move(kept);
  return fewer;
}

std::vector<SideScan> RobustSearch::scan(const std::vector<double>& x) {
  const ProblemStructure& s = model_.structure();
  std::vector<SideScan> scans;
  answer_.largest_violation = 0.0;
  for (const Index row : robust_constraints(s)) {
    for (const double side : {1.0, -1.0}) {
      const bool bounded = side > 0.0 ? s.constraint_upper[at(row)] < options_.nlp_upper_bound_inf
                                      : s.constraint_lower[at(row)] > options_.nlp_lower_bound_inf;
      if (!bounded) continue;
      scans.push_back(scan_side(row, side, x));
      if (scans.back().maxima.empty()) continue;
      answer_.largest_violation =
          std::max(answer_.largest_violation, scans.back().values[0] - scans.back().bound);
    }
  }
  return scans;
}

SideScan RobustSearch::scan_side(Index row, double side, const std::vector<double>& x) {
  const ProblemStructure& s = model_.structure();
  SideScan scan;
  scan.constraint = row;
  scan.bound = side > 0.0 ? s.constraint_upper[at(row)] : -s.constraint_lower[at(row)];
  std::vector<std::vector<double>> given;
  for (const auto& known : worst_cases_) {
    if (known.constraint == row && !known.held) given.push_back(known.v);
  }
  SolverOptions options = options_;
  options.warm_start_init_point = false;
  options.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  options.minmax_starts =
      std::max(options_.minmax_worst_case_starts, static_cast<int>(given.size()) + 1);
  options.minmax_worst_case_starts = 0;
  double least = kInfinity, most = -kInfinity;
  std::vector<std::pair<double, std::vector<double>>> found;
  MultistartObserver observer;
  observer.on_iteration = [&](Index, const IterationInfo& info) {
    least = std::min(least, info.objective);
    most = std::max(most, info.objective);
    if (info.iteration == 0) scan.starts.emplace_back(info.v.begin(), info.v.end());
    return true;
  };
  observer.on_result = [&](Index, const Result& result) {
    ++answer_.maximizations;
    if (result.v.empty() || !(result.error.primal <= options_.constr_viol_tol)) return;
    found.emplace_back(result.objective, result.v);
  };
  ConstraintOverY problem(model_, row, side, x);
  static_cast<void>(multistart(problem, options, observer, given));
  std::ranges::stable_sort(found, std::greater{}, &std::pair<double, std::vector<double>>::first);
  for (auto& [value, point] : found) {
    std::vector<double>& v = point;  // clang 14 captures no structured binding
    const bool known = std::ranges::any_of(scan.maxima, [&](const auto& other) {
      return same_point(v, other.v, options_.minmax_distinct_tol);
    });
    if (known) continue;
    scan.maxima.push_back({row, std::move(v), true});
    scan.values.push_back(value);
  }
  scan.scale = std::max(most - least, std::abs(scan.bound));
  return scan;
}

Result RobustSearch::in_model_shape(const RobustCopies& copies, const Result& result) const {
  const ProblemStructure& s = model_.structure();
  const std::size_t n = start_.size();
  const std::size_t m = s.constraint_players.size();
  Result own = result;
  if (result.v.size() < n) return own;
  own.v.resize(n);
  own.z_lower.resize(n);
  own.z_upper.resize(n);
  own.lambda.resize(m);
  own.constraints.assign(m, std::numeric_limits<double>::quiet_NaN());
  std::vector<double> largest(n, -1.0);
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const Index row = copies.row(k);
    const auto constraint = at(worst_cases_[k].constraint);
    const double multiplier = result.lambda[at(row)];
    if (at(row) != constraint) own.lambda[constraint] += multiplier;
    for (std::size_t i = 0; i < n; ++i) {
      const auto copy = at(copies.variable(k, static_cast<Index>(i)));
      const bool unread =
          copies.structure().variable_lower[i] == copies.structure().variable_upper[i];
      if (copy == i || !unread || !(std::abs(multiplier) > largest[i])) continue;
      largest[i] = std::abs(multiplier);
      own.v[i] = result.v[copy];
      own.z_lower[i] = result.z_lower[copy];
      own.z_upper[i] = result.z_upper[copy];
    }
  }
  if (!std::ranges::all_of(own.v, [](double x) { return std::isfinite(x); })) return own;
  double f = 0.0;
  if (model_.objective(own.v, true, f)) own.objective = f;
  if (m > 0) static_cast<void>(model_.constraints(own.v, false, own.constraints));
  return own;
}

void RobustSearch::list_worst_cases(const RobustCopies& copies, const Result& result) {
  if (result.v.size() < start_.size()) return;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const auto row = at(copies.row(k));
    answer_.worst_cases.push_back({.constraint = worst_cases_[k].constraint,
                                   .v = copies.model_point(result.v, k),
                                   .value = row < result.constraints.size()
                                                ? result.constraints[row]
                                                : std::numeric_limits<double>::quiet_NaN(),
                                   .multiplier = result.lambda[row]});
  }
  std::ranges::stable_sort(answer_.worst_cases, {}, &RobustWorstCase::constraint);
}

/// The answer without the epigraph's variable and constraint.
void leave_epigraph(Problem& model, RobustResult& answer) {
  const std::size_t n = model.structure().variable_players.size();
  const std::size_t m = model.structure().constraint_players.size();
  Result& result = answer.result;
  if (result.v.size() > n) {
    result.v.resize(n);
    result.z_lower.resize(n);
    result.z_upper.resize(n);
    result.lambda.resize(m);
    result.constraints.resize(m);
  }
  for (RobustWorstCase& worst_case : answer.worst_cases) {
    if (worst_case.constraint == static_cast<Index>(m)) worst_case.value += worst_case.v.back();
    worst_case.v.resize(n);
  }
}

}  // namespace

bool has_robust_constraints(const ProblemStructure& structure) {
  return well_formed(structure) && !robust_constraints(structure).empty();
}

RobustResult solve_robust(Problem& model, const SolverOptions& options,
                          const SolveObserver& observer) {
  if (!options.minmax_epigraph || !well_formed(model.structure()))
    return RobustSearch(model, options, observer).run();
  const std::unique_ptr<Problem> epigraph = make_epigraph(model);
  const std::size_t n = model.structure().variable_players.size();
  const std::size_t m = model.structure().constraint_players.size();
  SolveObserver own = observer;
  if (observer.on_iteration) {
    own.on_iteration = [&observer, n, m](const IterationInfo& info) {
      IterationInfo seen = info;
      seen.v = info.v.first(n);
      seen.result = [&info, n, m] {
        Result result = info.result();
        result.v.resize(n);
        result.z_lower.resize(n);
        result.z_upper.resize(n);
        result.lambda.resize(m);
        result.constraints.resize(m);
        return result;
      };
      return observer.on_iteration(seen);
    };
  }
  RobustResult answer = RobustSearch(*epigraph, options, own).run();
  leave_epigraph(model, answer);
  return answer;
}

}  // namespace ipminmax
