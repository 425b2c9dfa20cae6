#include "core/certificate/copositive.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/certificate/parameters.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

using Verdict = Copositivity::Verdict;

Copositivity along(Eigen::VectorXd direction) { return {Verdict::Not, std::move(direction)}; }

/// Scaled matrix.
Copositivity by_faces(const Eigen::MatrixXd& c) {
  const Eigen::Index size = c.rows();
  Copositivity found{.verdict = Verdict::Strictly, .direction = {}};
  for (std::uint32_t face = 1; face < (1U << size); ++face) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < size; ++i) {
      if (face >> i & 1U) rows.push_back(i);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(c(rows, rows));
    for (Eigen::Index e = 0; e < eigen.eigenvalues().size(); ++e) {
      const double value = eigen.eigenvalues()[e];
      if (value > parameter::kZero) break;
      Eigen::VectorXd t = eigen.eigenvectors().col(e);
      if (t.sum() < 0.0) t = -t;
      if (t.minCoeff() < -parameter::kZero) continue;
      if (value > -parameter::kZero) {
        found.verdict = Verdict::Unknown;
        continue;
      }
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(size);
      direction(rows) = t.cwiseMax(0.0);
      return along(direction);
    }
  }
  return found;
}

}  // namespace

Copositivity copositivity(const Eigen::MatrixXd& matrix) {
  const Eigen::Index size = matrix.rows();
  if (!matrix.allFinite() || size > parameter::kMostFaces) return {};
  const double largest = size > 0 ? matrix.cwiseAbs().maxCoeff() : 0.0;
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    if (matrix(i, i) < -parameter::kZero * largest) return along(Eigen::VectorXd::Unit(size, i));
    if (!(matrix(i, i) > 0.0)) return {};
    scale[i] = 1.0 / std::sqrt(matrix(i, i));
  }
  const Eigen::MatrixXd c = scale.asDiagonal() * matrix * scale.asDiagonal();
  Copositivity found = by_faces(c);
  if (found.verdict == Verdict::Not) found.direction = scale.cwiseProduct(found.direction);
  return found;
}

}  // namespace ipminmax
