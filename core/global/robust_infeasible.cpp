#include <algorithm>
#include <string>
#include <utility>

#include "core/global/robust_search.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "linalg/numbers.hpp"

// Robust constraints that cannot be met: which, by how much, and by which y.
namespace ipminmax {
namespace {

/// Times constr_viol_tol, in the units of the rows: a least violation that is none of rounding.
constexpr double kClearViolation = 10.0;

/// min t subject to the model's constraints, robust ones relaxed by t >= 0: g - t <= upper for
/// every y, or g + t >= lower. t is the last variable. Constraints with two bounds stay as they
/// are.
class LeastViolation final : public ByRows<Problem> {
 public:
  explicit LeastViolation(Problem& model)
      : model_(model), structure_(model.structure()), n_(structure_.variable_players.size()) {
    const Index t = add_variable(structure_, Player::Min, 0.0, kInfinity, {-1, "violation"});
    for (const Index row : robust_constraints(model.structure())) {
      const bool lower = structure_.constraint_lower[at(row)] > -kUnbounded;
      const bool upper = structure_.constraint_upper[at(row)] < kUnbounded;
      if (lower == upper) continue;
      relaxed_.push_back({row, upper ? -1.0 : 1.0});
      structure_.jacobian.push_back({row, t});
    }
    structure_.nonlinear_variables.reset();
  }
  [[nodiscard]] bool relaxes_any() const { return !relaxed_.empty(); }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  /// It is given one.
  [[nodiscard]] bool starting_point(StartingPoint&) override { return false; }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = v.back();
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    grad.back() = 1.0;
    return true;
  }
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                     std::span<double> g) override {
    if (!model_.constraint_rows(rows, v.first(n_), true, g)) return false;
    for (const auto& [row, sign] : relaxed_) {
      if (std::ranges::binary_search(rows, row)) g[at(row)] += sign * v.back();
    }
    return true;
  }
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                   std::span<double> values) override {
    const std::size_t own = values.size() - relaxed_.size();
    for (std::size_t k = 0; k < relaxed_.size(); ++k) values[own + k] = relaxed_[k].sign;
    return model_.jacobian_rows(rows, v.first(n_), true, values.first(own));
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    return model_.hessian(v.first(n_), true, 0.0, lambda, true, values);
  }

 private:
  struct Relaxed {
    Index row;
    double sign;  ///< of t in it
  };
  Problem& model_;
  ProblemStructure structure_;
  std::size_t n_;
  std::vector<Relaxed> relaxed_;
};

}  // namespace

/// After a search that failed: minimizes the largest violation of the robust constraints over y.
/// Where that stays above the tolerance they cannot be met here.
void RobustSearch::name_infeasible(std::vector<double> start) {
  const bool failed = search_failed(answer_.status) || answer_.over_y.better_known;
  if (!failed || budget_.used_up()) return;
  if (!answer_.v.empty() && all_finite(answer_.v)) start = answer_.v;
  start.resize(form_.asked.structure().variable_players.size());
  if (!all_finite(start)) return;
  InRowUnits rows(form_.asked, units_of_rows(form_.asked, start));
  LeastViolation problem(rows);
  if (!problem.relaxes_any()) return;
  start.push_back(1.0);
  SolverOptions options = options_;
  options.minmax_worst_case_proof = false;  // what is seen is enough
  RobustSearch search({problem, form_.asked, rows.units(), form_.witnesses}, options, starts_,
                      budget_, start_);
  search.names_infeasible_ = false;
  Result least = search.run(std::move(start));
  add_work(least, work_);
  if (!is_success(least.status) || least.over_y.better_known || !least.over_y.finished) return;
  const ProblemStructure& s = form_.asked.structure();
  double largest = 0.0, violation = 0.0;
  const RobustWorstCase* worst = nullptr;
  const auto excess_of = [&](const std::vector<double>& g, std::size_t row) {
    return std::max(g[row] - s.constraint_upper[row], s.constraint_lower[row] - g[row]);
  };
  for (RobustWorstCase& found : least.worst_cases) {
    std::vector<double> g(s.constraint_players.size());
    if (!form_.asked.constraints(found.v, true, g)) return;
    const auto row = at(found.constraint);
    found.value = g[row];  // was that of the relaxed row
    const double excess = excess_of(g, row);
    const double beside = excess * rows.units().factor[row];
    if (beside <= largest) continue;
    largest = beside;
    violation = excess;
    worst = &found;
  }
  if (worst == nullptr || !(largest > kClearViolation * options_.constr_viol_tol)) return;
  least.message =
      "robust constraints cannot be met near this x: the least worst-case violation is " +
      number_text(violation, 6) + ", of " + constraint_name(s, worst->constraint) + " at " +
      describe_y(s, worst->constraint, worst->v);
  least.status = Status::LocallyInfeasible;
  least.certificate = {};
  least.certificate.kind = PointKind::InfeasiblePoint;
  least.over_y.largest_violation = violation;
  for (std::size_t row = 0; row < least.constraints.size(); ++row)
    least.error.primal = std::max(least.error.primal, excess_of(least.constraints, row));
  answer_ = std::move(least);
}

}  // namespace ipminmax
