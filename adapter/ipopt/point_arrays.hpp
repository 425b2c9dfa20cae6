#pragma once

#include <algorithm>
#include <vector>

#include "../../core/result.hpp"
#include "../../core/violations.hpp"

namespace ipminmax {

/// Copies values to a caller's array of that length; null: not asked for.
inline void copy_to(double* array, const std::vector<double>& values) {
  if (array != nullptr) std::ranges::copy(values, array);
}

/// Arrays that Ipopt's get_curr_iterate fills: n, n, n, m, m entries; null where not asked for.
struct PointArrays {
  double *x, *z_L, *z_U, *g, *lambda;
};
inline void fill(const PointArrays& arrays, const Result& point) {
  copy_to(arrays.x, point.v);
  copy_to(arrays.z_L, point.z_lower);
  copy_to(arrays.z_U, point.z_upper);
  copy_to(arrays.g, point.constraints);
  copy_to(arrays.lambda, point.lambda);
}

/// Arrays that Ipopt's get_curr_violations fills: n, n, n, n, n, m, m entries; null where not asked
/// for.
struct ViolationArrays {
  double *x_L_violation, *x_U_violation, *compl_x_L, *compl_x_U, *grad_lag_x;
  double *nlp_constraint_violation, *compl_g;
};
inline void fill(const ViolationArrays& arrays, const Violations& violations) {
  copy_to(arrays.x_L_violation, violations.lower_bound);
  copy_to(arrays.x_U_violation, violations.upper_bound);
  copy_to(arrays.compl_x_L, violations.lower_complementarity);
  copy_to(arrays.compl_x_U, violations.upper_complementarity);
  copy_to(arrays.grad_lag_x, violations.lagrangian_gradient);
  copy_to(arrays.nlp_constraint_violation, violations.constraint);
  copy_to(arrays.compl_g, violations.constraint_complementarity);
}

}  // namespace ipminmax
