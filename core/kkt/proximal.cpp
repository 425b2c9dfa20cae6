#include <cmath>

#include "core/kkt/system.hpp"
#include "core/model/indices.hpp"

namespace ipminmax {

const Eigen::VectorXd* KktSystem::proximal_curvature(const Evaluation& evaluation, double share) {
  const Index n = canonical_.variables(), y = canonical_.y().begin;
  // Of variables and then of constraints; zero where it is not known.
  Eigen::VectorXd &size = known_, &fill = found_;
  size.setZero(n + canonical_.constraints());
  const auto take = [&](Index i, Index j, double entry) {
    // What rows would give x by elimination has no bound where Max has no room left.
    if (entry == 0.0 || (i < y && j >= n)) return;
    if (i == j) fill[i] = std::abs(entry);
    if (size[i] > 0.0 || size[j] == 0.0) return;
    const double found = entry * (entry / size[j]);
    fill[i] = fill[i] > 0.0 ? std::min(fill[i], found) : found;
  };
  const auto take_all = [&](Index first, const auto& entries, const std::vector<double>& values) {
    for (const auto k : indices(values)) {
      take(first + entries[k].row, entries[k].col, values[k]);
      take(entries[k].col, first + entries[k].row, values[k]);
    }
  };
  constexpr int kSweeps = 6;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    fill = size;
    take_all(0, canonical_.hessian(), evaluation.hessian);
    take_all(n, canonical_.jacobian(), evaluation.jacobian);
    if (fill == size) break;
    size = fill;
  }
  double largest_x = 0.0, largest = 0.0;
  for (const auto k : indices(evaluation.hessian)) {
    const double entry = std::abs(evaluation.hessian[k]);
    largest = std::max(largest, entry);
    if (canonical_.hessian()[k].col < y) largest_x = std::max(largest_x, entry);
  }
  if (largest == 0.0) largest = 1.0;  // f may be constant: any will do
  if (largest_x == 0.0) largest_x = largest;
  for (Index i = 0; i < n; ++i)
    proximal_[i] = share * (size[i] > 0.0 ? size[i] : i < y ? largest_x : largest);
  return &proximal_;
}

}  // namespace ipminmax
