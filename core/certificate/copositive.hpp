#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace ipminmax {

/// What a symmetric matrix C does on the vectors t >= 0.
struct Copositivity {
  enum class Verdict : std::uint8_t { Strictly, Unknown, Not };
  Verdict verdict = Verdict::Unknown;
  Eigen::VectorXd direction;  ///< Not: t >= 0 with t'Ct clearly negative
};

/// Strictly: t'Ct > 0 for all t >= 0, t != 0, with a margin relative to the diagonal. By all faces
/// of the cone: the least value over |t| = 1 is attained inside one of them, at an eigenvector of
/// its principal submatrix [Kaplan 2000]. Beyond 10 rows these are too many: Unknown.
[[nodiscard]] Copositivity copositivity(const Eigen::MatrixXd& matrix);

}  // namespace ipminmax
