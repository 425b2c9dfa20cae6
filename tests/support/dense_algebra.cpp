#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

#include <support/dense_algebra.hpp>

namespace ipminmax::testing {

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

Eigen::MatrixXd symmetric_eigenvectors(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvectors();
}

Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(matrix, false).eigenvalues();
}

double spectral_radius(const Eigen::MatrixXd& matrix) {
  return eigenvalues(matrix).cwiseAbs().maxCoeff();
}

Eigen::MatrixXd solve_dense(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.partialPivLu().solve(b);
}

Eigen::MatrixXd solve_pivoting(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.fullPivLu().solve(b);
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

Eigen::MatrixXd null_space(const Eigen::MatrixXd& rows, bool& independent) {
  if (rows.rows() == 0 || rows.cols() == 0) {
    independent = rows.rows() == 0;
    return Eigen::MatrixXd::Identity(rows.cols(), rows.cols());
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows.transpose());
  qr.setThreshold(1e-9);
  independent = qr.rank() == rows.rows();
  return Eigen::MatrixXd(qr.householderQ()).rightCols(rows.cols() - qr.rank());
}

Eigen::MatrixXd null_space(const Eigen::MatrixXd& rows) {
  bool independent = true;
  return null_space(rows, independent);
}

}  // namespace ipminmax::testing
