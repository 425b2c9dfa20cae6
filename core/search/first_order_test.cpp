#include <algorithm>
#include <cmath>
#include <utility>

#include "core/search/first_order_test.hpp"

namespace ipminmax {

bool FirstOrderTest::is_met(const KktError& error) const {
  return error.total <= options_.tol &&
         std::max(error.dual_min, error.dual_max) <= options_.dual_inf_tol &&
         error.primal <= options_.constr_viol_tol &&
         error.complementarity <= options_.compl_inf_tol;
}

bool FirstOrderTest::is_acceptable(const KktError& error) const {
  return options_.acceptable_iter > 0 && error.total <= options_.acceptable_tol &&
         std::max(error.dual_min, error.dual_max) <= options_.acceptable_dual_inf_tol &&
         error.primal <= options_.acceptable_constr_viol_tol &&
         error.complementarity <= options_.acceptable_compl_inf_tol;
}

std::optional<Status> FirstOrderTest::claim(const KktError& error, double objective) {
  const double last = std::exchange(last_objective_, objective);
  if (is_met(error)) return Status::Solved;
  const double change = std::abs(objective - last) / std::max(1.0, std::abs(objective));
  const bool counts = is_acceptable(error) && change <= options_.acceptable_obj_change_tol;
  acceptable_ = counts ? acceptable_ + 1 : 0;
  if (acceptable_ == 0 || acceptable_ < options_.acceptable_iter) return std::nullopt;
  return Status::SolvedToAcceptableLevel;
}

}  // namespace ipminmax
