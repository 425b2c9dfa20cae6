#include "core/certificate/corner_check.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/parameters.hpp"
#include "core/model/products.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

class CornerCheck {
 public:
  CornerCheck(CanonicalProblem& canonical, const Point& point, const BoundClasses& classes,
              const Units& units, const SolverOptions& options, CornerArrays& arrays)
      : canonical_(canonical),
        point_(point),
        classes_(classes),
        units_(units),
        options_(options),
        arrays_(arrays),
        here_(arrays.here),
        balanced_(arrays.balanced) {
    take_gradient(point.evaluation, here_);
    balance();
  }

  /// trial: which of the two directions.
  [[nodiscard]] Index lost_along(bool of_max, int trial, Evaluation& scratch) const;

 private:
  [[nodiscard]] bool is_active(Index i) const {
    return classes_[i] == BoundClass::Active && classes_.side[at(i)] != 0;
  }
  [[nodiscard]] bool is_active_row(Index row) const {
    const Index slack = canonical_.slack_of(row);
    return slack >= 0 && is_active(slack) && !classes_.is_left_out(row);
  }
  [[nodiscard]] bool is_slack(Index i) const {
    return canonical_.x_slacks().contains(i) || canonical_.y_slacks().contains(i);
  }
  void take_gradient(const Evaluation& evaluation, Eigen::VectorXd& gradient) const {
    gradient = evaluation.gradient;
    add_transposed_product(canonical_, evaluation, point_.iterate.lambda, gradient);
  }
  void balance();
  [[nodiscard]] double size(Index i) const {
    return own_size(canonical_, point_.iterate.v[i], i, units_);
  }
  [[nodiscard]] double reach(Index i) const;
  void step_inside(bool of_max, int trial) const;

  CanonicalProblem& canonical_;
  const Point& point_;
  const BoundClasses& classes_;
  const Units& units_;
  const SolverOptions& options_;
  CornerArrays& arrays_;
  Eigen::VectorXd& here_;      ///< gradient of the Lagrangian
  double off_ = 0.0;           ///< of active bounds, over the variable's own size
  Eigen::VectorXd& balanced_;  ///< what active bounds and inequalities balance of it; 0: nothing
};

void CornerCheck::balance() {
  balanced_.setZero(canonical_.variables());
  for (std::size_t k = 0; k < point_.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    if (!is_active_row(row)) continue;
    const double part = std::abs(point_.iterate.lambda[row] * point_.evaluation.jacobian[k]);
    balanced_[col] = std::max(balanced_[col], part);
  }
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (!is_active(i)) continue;
    const double off = classes_.distance(canonical_, point_.iterate, i) +
                       relaxation_of(canonical_, i, classes_.side[at(i)], options_);
    off_ = std::max(off_, off / size(i));
    if (!is_slack(i)) balanced_[i] = classes_.multiplier(point_.iterate, i);
  }
}

/// Beyond what the point and bound_relax_factor keep from any of the bounds.
double CornerCheck::reach(Index i) const {
  constexpr double kBeyond = 10.0;
  return size(i) * std::min(parameter::kHardly + kBeyond * off_, parameter::kSmall);
}

/// The first direction goes far in every other variable, the second one in those between.
void CornerCheck::step_inside(bool of_max, int trial) const {
  constexpr double kShort = 0.05;
  Eigen::VectorXd &step = arrays_.step, &longest = arrays_.longest;
  step.setZero(canonical_.variables());
  longest.setZero(canonical_.constraints());
  int turn = trial;
  const auto next = [&] { return turn++ % 2 == 0 ? 1.0 : kShort; };
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (!is_active(i) || is_slack(i) || canonical_.owned_by_max(i) != of_max) continue;
    step[i] = -classes_.side[at(i)] * reach(i) * next();
  }
  const auto& jacobian = canonical_.jacobian();
  const auto counts = [&](std::size_t k) {
    const auto [row, col] = jacobian[k];
    return is_active_row(row) && !is_active(col) && canonical_.owned_by_max(col) == of_max &&
           canonical_.max_constraints().contains(row) == of_max;
  };
  const auto slope = [&](std::size_t k) {
    return point_.evaluation.jacobian[k] * units_.variable[jacobian[k].col];
  };
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    if (counts(k))
      longest[jacobian[k].row] = std::max(longest[jacobian[k].row], std::abs(slope(k)));
  }
  for (double& length : longest) length = length > 0.0 ? next() / length : 0.0;
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    if (!counts(k)) continue;
    const auto [row, col] = jacobian[k];
    const Index slack = canonical_.slack_of(row);
    step[col] -= classes_.side[at(slack)] * longest[row] * slope(k) * reach(col);
  }
}

Index CornerCheck::lost_along(bool of_max, int trial, Evaluation& scratch) const {
  step_inside(of_max, trial);
  const Eigen::VectorXd& step = arrays_.step;
  if (step.isZero(0.0)) return -1;
  // Of the answers of Max his own multipliers have to stay, of a step of Min all.
  const auto is_tested = [&](Index i) {
    return balanced_[i] > 0.0 && (canonical_.owned_by_max(i) || !of_max);
  };
  Eigen::VectorXd& predicted = arrays_.predicted;
  predicted.setZero(step.size());
  add_hessian_product(canonical_, point_.evaluation, step, predicted);
  double shorter = 1.0;
  for (Index i = 0; i < step.size(); ++i) {
    const double most = parameter::kLittle * balanced_[i];
    if (is_tested(i) && std::abs(predicted[i]) > most)
      shorter = std::min(shorter, most / std::abs(predicted[i]));
  }
  scratch = point_.evaluation;
  arrays_.there = point_.iterate.v + shorter * step;
  if (canonical_.first_derivatives(arrays_.there, scratch) != EvaluationStatus::Ok) {
    return -1;
  }
  Eigen::VectorXd& change = arrays_.there;
  take_gradient(scratch, change);
  change -= here_;
  for (Index i = 0; i < step.size(); ++i) {
    if (!is_tested(i)) continue;
    // Of a bound's multiplier what it gains is no matter.
    const double lost =
        is_active(i) ? classes_.side[at(i)] * canonical_.sign(i) * change[i] : std::abs(change[i]);
    if (!(lost <= (1.0 - parameter::kLittle) * balanced_[i])) return i;
  }
  return -1;
}

/// Variables that have an entry in W or in the Jacobian here: 1, others 0.
void mark_read(const CanonicalProblem& canonical, const Evaluation& evaluation,
               Eigen::VectorXd& read) {
  read.setZero(canonical.variables());
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [row, col] = canonical.hessian()[k];
    if (evaluation.hessian[k] != 0.0) read[row] = read[col] = 1.0;
  }
  for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
    if (evaluation.jacobian[k] != 0.0) read[canonical.jacobian()[k].col] = 1.0;
  }
}

/// Whether curvature says something of a player: he has more variables, but for free ones that
/// nothing reads, than active bounds and rows.
bool has_free_variable(const CanonicalProblem& canonical, const BoundClasses& classes,
                       const Eigen::VectorXd& read, bool of_max) {
  const IndexRange own = of_max ? canonical.y() : canonical.x();
  const IndexRange slacks = of_max ? canonical.y_slacks() : canonical.x_slacks();
  Index free = 0;
  for (Index i = own.begin; i < own.end; ++i)
    free += classes[i] != BoundClass::Active && read[i] != 0.0 ? 1 : 0;
  for (Index i = slacks.begin; i < slacks.end; ++i)
    free -= classes[i] == BoundClass::Active ? 1 : 0;
  return free > 0;
}

}  // namespace

Index multiplier_lost_inside(CanonicalProblem& canonical, const Point& point,
                             const BoundClasses& classes, const Units& units,
                             const SolverOptions& options, Evaluation& scratch,
                             CornerArrays& arrays) {
  // A minimization is compared with Ipopt, which looks at no corner.
  if (canonical.max_size() == 0) return -1;
  mark_read(canonical, point.evaluation, arrays.step);
  const bool x = !has_free_variable(canonical, classes, arrays.step, false);
  const bool y = !has_free_variable(canonical, classes, arrays.step, true);
  if (!x && !y) return -1;
  const CornerCheck check(canonical, point, classes, units, options, arrays);
  for (const bool of_max : {true, false}) {
    if (of_max ? !y : !x) continue;
    for (const int trial : {0, 1}) {
      const Index lost = check.lost_along(of_max, trial, scratch);
      if (lost >= 0) return lost;
    }
  }
  return -1;
}

}  // namespace ipminmax
