#include "core/certificate/active_set.hpp"

namespace ipminmax {
namespace {

/// Curvature of an active slack: its constraint is an equality.
constexpr double kRigid = 1e20;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

ActiveSetSystem::ActiveSetSystem(const CanonicalProblem& canonical, KktSystem& kkt,
                                 const BoundClasses& classes, const Units& units,
                                 const Evaluation& evaluation)
    : canonical_(canonical),
      kkt_(kkt),
      classes_(classes),
      units_(units),
      scaled_(in_units(canonical, evaluation, units)),
      reduced_(scaled_),
      fixed_(at(canonical.variables()), false) {}

void ActiveSetSystem::assemble(Doubtful fixed, const Eigen::VectorXd& error, double min_times,
                               double max_times) {
  for (Index i = 0; i < canonical_.variables(); ++i) {
    const bool doubtful = canonical_.owned_by_max(i) ? fixed.max_fixed : fixed.min_fixed;
    fixed_[at(i)] =
        classes_[i] == BoundClass::Active || (classes_[i] == BoundClass::Doubtful && doubtful);
  }
  for (std::size_t k = 0; k < scaled_.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    reduced_.hessian[k] = fixed_[at(i)] || fixed_[at(j)] ? 0.0 : scaled_.hessian[k];
  }
  for (std::size_t k = 0; k < scaled_.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    reduced_.jacobian[k] = fixed_[at(col)] || !counts(row) ? 0.0 : scaled_.jacobian[k];
  }
  Eigen::VectorXd curvature = Eigen::VectorXd::Zero(canonical_.variables());
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (is_slack(i)) {
      curvature[i] = fixed_[at(i)] ? kRigid : 1.0;
    } else if (fixed_[at(i)]) {
      curvature[i] = 1.0;
    } else if (error.size() > 0) {
      curvature[i] = (canonical_.owned_by_max(i) ? max_times : min_times) * error[i];
    }
  }
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && classes_.is_redundant(j)) curvature[slack] = 1.0;
  }
  kkt_.assemble(reduced_, curvature, classes_.redundant);
}

}  // namespace ipminmax
