#include "adapter/ipopt/point_arrays.hpp"

#include <algorithm>

namespace ipminmax {

void copy_to(double* array, const std::vector<double>& values) {
  if (array != nullptr) std::ranges::copy(values, array);
}

void fill(const PointArrays& arrays, const Result& point) {
  copy_to(arrays.x, point.v);
  copy_to(arrays.z_L, point.z_lower);
  copy_to(arrays.z_U, point.z_upper);
  copy_to(arrays.g, point.constraints);
  copy_to(arrays.lambda, point.lambda);
}

void fill(const ViolationArrays& arrays, const Violations& violations) {
  copy_to(arrays.x_L_violation, violations.lower_bound);
  copy_to(arrays.x_U_violation, violations.upper_bound);
  copy_to(arrays.compl_x_L, violations.lower_complementarity);
  copy_to(arrays.compl_x_U, violations.upper_complementarity);
  copy_to(arrays.grad_lag_x, violations.lagrangian_gradient);
  copy_to(arrays.nlp_constraint_violation, violations.constraint);
  copy_to(arrays.compl_g, violations.constraint_complementarity);
}

}  // namespace ipminmax
