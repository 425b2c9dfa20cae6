#include "core/certificate/copositive.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace ipminmax {
namespace {

constexpr double kClear = 1e-8;          // of a matrix with a diagonal of ones
constexpr Eigen::Index kMostFaces = 10;  // rows
constexpr double kInside = 1e-9;         // entries of an eigenvector that count as nonnegative

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
      if (value > kClear) break;
      Eigen::VectorXd t = eigen.eigenvectors().col(e);
      if (t.sum() < 0.0) t = -t;
      if (t.minCoeff() < -kInside) continue;
      if (value > -kClear) {
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

Copositivity by_parts(const Eigen::MatrixXd& c) {
  const Eigen::Index size = c.rows();
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      // (1, 1) has c_ii + c_jj + 2 c_ij = 2 + 2 c_ij.
      if (c(i, j) < -1.0 - kClear) {
        return along(Eigen::VectorXd::Unit(size, i) + Eigen::VectorXd::Unit(size, j));
      }
    }
  }
  Eigen::MatrixXd lower = c.cwiseMin(0.0);
  lower.diagonal().setConstant(1.0 - kClear);
  const Eigen::LLT<Eigen::MatrixXd> cholesky(lower);
  return {cholesky.info() == Eigen::Success ? Verdict::Strictly : Verdict::Unknown, {}};
}

}  // namespace

Copositivity copositivity(const Eigen::MatrixXd& matrix) {
  const Eigen::Index size = matrix.rows();
  if (!matrix.allFinite()) return {};
  const double largest = size > 0 ? matrix.cwiseAbs().maxCoeff() : 0.0;
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    if (matrix(i, i) < -kClear * largest) return along(Eigen::VectorXd::Unit(size, i));
    if (!(matrix(i, i) > 0.0)) return {};
    scale[i] = 1.0 / std::sqrt(matrix(i, i));
  }
  const Eigen::MatrixXd c = scale.asDiagonal() * matrix * scale.asDiagonal();
  Copositivity found = size <= kMostFaces ? by_faces(c) : by_parts(c);
  if (found.verdict == Verdict::Not) found.direction = scale.cwiseProduct(found.direction);
  return found;
}

}  // namespace ipminmax
