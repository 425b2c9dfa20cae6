#pragma once

#include <Eigen/Core>

/// Dense linear algebra for references in tests, compiled once: each use of Eigen's decompositions
/// in a source file costs seconds.
namespace ipminmax::testing {

/// In ascending order; the lower triangle of the matrix is read.
[[nodiscard]] Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& matrix);

/// Orthonormal columns in the same order.
[[nodiscard]] Eigen::MatrixXd symmetric_eigenvectors(const Eigen::MatrixXd& matrix);

/// Of any square matrix.
[[nodiscard]] Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix);
/// Their largest modulus.
[[nodiscard]] double spectral_radius(const Eigen::MatrixXd& matrix);

/// a^-1 b, a square and nonsingular.
[[nodiscard]] Eigen::MatrixXd solve_dense(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// The same with full pivoting, for matrices that may be nearly singular.
[[nodiscard]] Eigen::MatrixXd solve_pivoting(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// The shortest x of those that make |a x - b| least.
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Orthonormal columns that span {d : rows d = 0}.
[[nodiscard]] Eigen::MatrixXd null_space(const Eigen::MatrixXd& rows);

}  // namespace ipminmax::testing
