#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>

#include "core/problem.hpp"

/// What the dense judges are made of, in double or extended precision: bounds as rows, tangent
/// spaces, equilibrated systems. Shares no code with the library.
namespace ipminmax::testing {

template <typename T>
using DenseVector = Eigen::Matrix<T, Eigen::Dynamic, 1>;
template <typename T>
using DenseMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
using Places = std::vector<Eigen::Index>;

/// A finite bound of a variable or constraint, or an equation.
struct Row {
  bool is_variable = false;
  Eigen::Index index = 0;
  Player owner = Player::Min;
  double side = 0.0;  ///< +1 upper, -1 lower, 0 equation
  double bound = 0.0;

  /// A multiplier with the sign that the owner wants: >= 0.
  template <typename T>
  [[nodiscard]] T wanted(T multiplier) const {
    return (owner == Player::Min ? T{1} : T{-1}) * side * multiplier;
  }
  template <typename T>
  [[nodiscard]] T value(const DenseVector<T>& v, const DenseVector<T>& g) const {
    return is_variable ? v[index] : g[index];
  }
  /// To the bound; negative outside.
  template <typename T>
  [[nodiscard]] T distance(const DenseVector<T>& v, const DenseVector<T>& g) const {
    return side * (bound - value(v, g));
  }
};

/// Of these variables and of all constraints. relaxed(bound, width): what an inequality's bound is
/// moved outwards by; infinite: bounds that are none begin there.
template <typename Relaxation>
[[nodiscard]] std::vector<Row> rows_of(const ProblemStructure& s, const Places& variables,
                                       double lower_infinite, double upper_infinite,
                                       const Relaxation& relaxed) {
  std::vector<Row> rows;
  const auto add = [&](Row row, double lower, double upper) {
    row.bound = lower;
    if (lower == upper) return rows.push_back(row);
    if (lower > lower_infinite) {
      row.side = -1.0;
      row.bound = lower - relaxed(lower, upper - lower);
      rows.push_back(row);
    }
    if (upper < upper_infinite) {
      row.side = 1.0;
      row.bound = upper + relaxed(upper, upper - lower);
      rows.push_back(row);
    }
  };
  for (const Eigen::Index i : variables) {
    const auto k = static_cast<std::size_t>(i);
    add({.is_variable = true, .index = i, .owner = s.variable_players[k]}, s.variable_lower[k],
        s.variable_upper[k]);
  }
  for (std::size_t j = 0; j < s.constraint_players.size(); ++j) {
    add({.index = static_cast<Eigen::Index>(j), .owner = s.constraint_players[j]},
        s.constraint_lower[j], s.constraint_upper[j]);
  }
  return rows;
}

template <typename Derived>
[[nodiscard]] typename Derived::Scalar max_norm(const Eigen::MatrixBase<Derived>& a) {
  return a.size() == 0 ? 0 : a.template lpNorm<Eigen::Infinity>();
}

/// Factors d with |d_i a_ij d_j| about at most 1 in every row that is not zero.
template <typename T>
[[nodiscard]] DenseVector<T> equilibration(const DenseMatrix<T>& a, int sweeps = 8) {
  DenseVector<T> d = DenseVector<T>::Ones(a.rows());
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    const DenseMatrix<T> scaled = d.asDiagonal() * a * d.asDiagonal();
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const T largest = max_norm(scaled.row(i));
      if (largest > 0 && std::isfinite(largest)) d[i] /= std::sqrt(largest);
    }
  }
  return d;
}

/// [h a'; a 0]
template <typename T>
[[nodiscard]] DenseMatrix<T> kkt_matrix(const DenseMatrix<T>& h, const DenseMatrix<T>& a) {
  const Eigen::Index n = h.rows(), k = a.rows();
  DenseMatrix<T> kkt = DenseMatrix<T>::Zero(n + k, n + k);
  kkt.topLeftCorner(n, n) = h;
  kkt.bottomLeftCorner(k, n) = a;
  kkt.topRightCorner(n, k) = kkt.bottomLeftCorner(k, n).transpose();
  return kkt;
}

/// A solution of a symmetric system, in its equilibrated units the shortest one. rank: pivots that
/// count as zero, over the largest; 0: Eigen's.
template <typename T>
[[nodiscard]] DenseVector<T> solve_symmetric(const DenseMatrix<T>& a, const DenseVector<T>& rhs,
                                             int sweeps = 8, T rank = 0) {
  const DenseVector<T> d = equilibration(a, sweeps);
  Eigen::CompleteOrthogonalDecomposition<DenseMatrix<T>> qr;
  if (rank > 0) qr.setThreshold(rank);
  qr.compute(d.asDiagonal() * a * d.asDiagonal());
  return d.asDiagonal() * qr.solve(DenseVector<T>(d.asDiagonal() * rhs));
}

/// Orthonormal basis of {d : rows d = 0}; independent: whether the rows are, pivots of 1e-9 of the
/// largest apart.
template <typename T>
[[nodiscard]] DenseMatrix<T> null_space(const DenseMatrix<T>& rows, bool& independent) {
  independent = rows.rows() == 0;
  if (rows.rows() == 0 || rows.cols() == 0) {
    return DenseMatrix<T>::Identity(rows.cols(), rows.cols());
  }
  Eigen::ColPivHouseholderQR<DenseMatrix<T>> qr(rows.transpose());
  qr.setThreshold(T(1e-9));
  independent = qr.rank() == rows.rows();
  return DenseMatrix<T>(qr.householderQ()).rightCols(rows.cols() - qr.rank());
}

/// The same of rows of any length.
template <typename T>
[[nodiscard]] DenseMatrix<T> null_space_of_directions(DenseMatrix<T> rows, bool& independent) {
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    const T norm = rows.row(k).norm();
    if (norm > 0) rows.row(k) /= norm;
  }
  return null_space(rows, independent);
}

/// H_xx - N' M^-1 N with M = [H_yy A_y'; A_y 0], N = [H_yx; A_x]: the Hessian of x -> L(x, y(x)),
/// where y(x) follows the inner maximum on the rows A of Max.
template <typename T>
[[nodiscard]] DenseMatrix<T> schur_complement(const DenseMatrix<T>& h, const DenseMatrix<T>& rows,
                                              const Places& x, const Places& y) {
  const auto ny = static_cast<Eigen::Index>(y.size()), nx = static_cast<Eigen::Index>(x.size());
  const Eigen::Index k = rows.rows();
  if (ny + k == 0 || nx == 0) return h(x, x);
  const DenseMatrix<T> inner =
      kkt_matrix<T>(DenseMatrix<T>(h(y, y)), DenseMatrix<T>(rows(Eigen::all, y)));
  DenseMatrix<T> coupling(ny + k, nx);
  coupling.topRows(ny) = h(y, x);
  coupling.bottomRows(k) = rows(Eigen::all, x);
  const DenseVector<T> d = equilibration(inner);
  const DenseMatrix<T> scaled = d.asDiagonal() * inner * d.asDiagonal();
  const DenseMatrix<T> right = d.asDiagonal() * coupling;
  return h(x, x) - right.transpose() * scaled.fullPivLu().solve(right);
}

}  // namespace ipminmax::testing
