#pragma once

#include <vector>

#include "../../core/result.hpp"
#include "../../core/violations.hpp"

namespace ipminmax {

/// Copies values to a caller's array of that length; null: not asked for.
void copy_to(double* array, const std::vector<double>& values);

/// Arrays that Ipopt's get_curr_iterate fills: n, n, n, m, m entries; null where not asked for.
struct PointArrays {
  double *x, *z_L, *z_U, *g, *lambda;
};
void fill(const PointArrays& arrays, const Result& point);

/// Arrays that Ipopt's get_curr_violations fills: n, n, n, n, n, m, m entries; null where not asked
/// for.
struct ViolationArrays {
  double *x_L_violation, *x_U_violation, *compl_x_L, *compl_x_U, *grad_lag_x;
  double *nlp_constraint_violation, *compl_g;
};
void fill(const ViolationArrays& arrays, const Violations& violations);

}  // namespace ipminmax
