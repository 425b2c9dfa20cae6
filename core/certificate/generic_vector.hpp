#pragma once

#include <Eigen/Core>
#include <cmath>

namespace ipminmax {

/// sin(1 + i) and cos(1 + i): right-hand sides and directions without the symmetries that a problem
/// may have, kept from use to use.
class GenericVectors {
 public:
  [[nodiscard]] const Eigen::VectorXd& sines(Eigen::Index size) {
    for (Eigen::Index i = grow(sines_, size); i < size; ++i) {
      sines_[i] = std::sin(1.0 + static_cast<double>(i));
    }
    return sines_;
  }
  [[nodiscard]] const Eigen::VectorXd& cosines(Eigen::Index size) {
    for (Eigen::Index i = grow(cosines_, size); i < size; ++i) {
      cosines_[i] = std::cos(1.0 + static_cast<double>(i));
    }
    return cosines_;
  }

 private:
  /// How many entries there are already; at least so many afterwards.
  static Eigen::Index grow(Eigen::VectorXd& values, Eigen::Index size) {
    const Eigen::Index before = values.size();
    if (before < size) values.conservativeResize(size);
    return before;
  }
  Eigen::VectorXd sines_, cosines_;
};

}  // namespace ipminmax
