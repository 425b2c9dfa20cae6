#include <cmath>
#include <functional>
#include <utility>

#include "core/model/forwarding_problem.hpp"
#include "core/multistart.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/worst_case_scan.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

/// Distinct maxima, the largest value first.
void sort_in(std::vector<std::pair<double, std::vector<double>>> found, double distinct_tol,
             SideScan& scan) {
  std::ranges::stable_sort(found, std::greater{}, &std::pair<double, std::vector<double>>::first);
  for (auto& [value, point] : found) {
    std::vector<double>& v = point;  // clang 14 captures no structured binding
    const bool known = std::ranges::any_of(
        scan.maxima, [&](const auto& other) { return same_point(v, other.v, distinct_tol); });
    if (known) continue;
    scan.maxima.push_back({scan.constraint, std::move(v), true});
    scan.values.push_back(value);
  }
}

}  // namespace

const SideScan* worst_side(const std::vector<SideScan>& scans, Index constraint) {
  const SideScan* worst = nullptr;
  for (const SideScan& side : scans) {
    if (side.constraint != constraint || side.maxima.empty()) continue;
    if (worst == nullptr || side.excess(0) > worst->excess(0)) worst = &side;
  }
  return worst;
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

std::vector<SideScan> scan_worst_cases(Problem& model, const std::vector<double>& x,
                                       const SolverOptions& options, int starts,
                                       const std::vector<RobustCopies::WorstCase>& also,
                                       Index& maximizations, Result& work) {
  const ProblemStructure& s = model.structure();
  SolverOptions inner = options;
  inner.warm_start_init_point = false;
  inner.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  inner.minmax_worst_case_starts = 0;
  const auto scan_side = [&](Index row, double side) {
    SideScan scan;
    scan.constraint = row;
    scan.bound = side > 0.0 ? s.constraint_upper[at(row)] : -s.constraint_lower[at(row)];
    std::vector<std::vector<double>> given;
    for (const auto& other : also) {
      if (other.constraint == row) given.push_back(other.v);
    }
    inner.minmax_starts = std::max(starts, static_cast<int>(given.size()) + 1);
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
      ++maximizations;
      if (result.v.empty() || !(result.error.primal <= options.constr_viol_tol)) return;
      found.emplace_back(result.objective, result.v);
    };
    ConstraintOverY problem(model, row, side, x);
    add_work(multistart(problem, inner, observer, given).best, work);
    sort_in(std::move(found), options.minmax_distinct_tol, scan);
    scan.scale = std::max(most - least, std::abs(scan.bound));
    return scan;
  };
  std::vector<SideScan> scans;
  for (const Index row : robust_constraints(s)) {
    if (s.constraint_upper[at(row)] < options.nlp_upper_bound_inf) {
      scans.push_back(scan_side(row, 1.0));
    }
    if (s.constraint_lower[at(row)] > options.nlp_lower_bound_inf) {
      scans.push_back(scan_side(row, -1.0));
    }
  }
  return scans;
}

}  // namespace ipminmax
