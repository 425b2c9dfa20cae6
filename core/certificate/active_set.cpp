#include "core/certificate/active_set.hpp"

#include "core/certificate/parameters.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

ActiveSetSystem::ActiveSetSystem(const CanonicalProblem& canonical, KktSystem& kkt,
                                 const BoundClasses& classes, const Units& units,
                                 const Evaluation& evaluation, ActiveSetArrays* arrays)
    : canonical_(canonical),
      kkt_(kkt),
      classes_(classes),
      units_(units),
      arrays_(arrays != nullptr ? *arrays : own_.emplace()) {
  set_in_units(canonical, evaluation, units, arrays_.scaled);
  arrays_.reduced = arrays_.scaled;
  arrays_.fixed.assign(at(canonical.variables()), false);
}

void ActiveSetSystem::assemble(Doubtful fixed, const Eigen::VectorXd& error, double min_times,
                               double max_times) {
  for (Index i = 0; i < canonical_.variables(); ++i) {
    const bool doubtful = canonical_.owned_by_max(i) ? fixed.max_fixed : fixed.min_fixed;
    arrays_.fixed[at(i)] =
        classes_[i] == BoundClass::Active || (classes_[i] == BoundClass::Doubtful && doubtful);
  }
  for (std::size_t k = 0; k < arrays_.scaled.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    arrays_.reduced.hessian[k] =
        arrays_.fixed[at(i)] || arrays_.fixed[at(j)] ? 0.0 : arrays_.scaled.hessian[k];
  }
  for (std::size_t k = 0; k < arrays_.scaled.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    arrays_.reduced.jacobian[k] =
        arrays_.fixed[at(col)] || !counts(row) ? 0.0 : arrays_.scaled.jacobian[k];
  }
  Eigen::VectorXd& curvature = arrays_.curvature;
  curvature.setZero(canonical_.variables());
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (is_slack(i)) {
      curvature[i] = arrays_.fixed[at(i)] ? parameters::certificate::kRigid : 1.0;
    } else if (arrays_.fixed[at(i)]) {
      curvature[i] = 1.0;
    } else if (error.size() > 0) {
      curvature[i] = (canonical_.owned_by_max(i) ? max_times : min_times) * error[i];
    }
  }
  const bool any = !classes_.redundant.empty() || !classes_.held_rows.empty();
  arrays_.left_out.assign(any ? at(canonical_.constraints()) : 0, true);
  for (Index j = 0; any && j < canonical_.constraints(); ++j) {
    const Index slack = canonical_.slack_of(j);
    arrays_.left_out[at(j)] = classes_.is_left_out(j);
    if (slack >= 0 && classes_.is_left_out(j)) curvature[slack] = 1.0;
  }
  kkt_.assemble(arrays_.reduced, curvature, arrays_.left_out);
}

}  // namespace ipminmax
