#pragma once

#include <cstdint>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "linalg/inertia.hpp"

namespace ipminmax {

/// Offsets, signs and expected inertias of the KKT matrix, the only place that knows them.
///
///     | W_xx + S_x + d_x I   W_xy                 J_x'        J_yx'      |  x
///     | W_yx                 W_yy - S_y - d_y I   0           J_yy'      |  y
///     | J_x                  0                   -D_x - d_lx  0          |  lambda_x
///     | J_yx                 J_yy                 0           D_y + d_ly |  lambda_y
///
/// Slack rows are eliminated: a slack s of constraint j with barrier curvature S_s leaves the
/// diagonal D_j = 1/S_s (0 for an equality). K is the whole matrix (the paper's J_zz), K_yy its
/// rows and columns (y, lambda_y) (the paper's J_yy).
struct KktLayout {
  IndexRange x, y, lambda_x, lambda_y;  ///< rows of K
  Index x_slacks = 0, y_slacks = 0;     ///< numbers of eliminated rows

  explicit KktLayout(const CanonicalProblem& canonical);

  [[nodiscard]] Index dimension() const { return lambda_y.end; }

  /// Expected inertia with the slack rows counted, as in the paper's (ConsLQAC):
  /// K has (n_x + m_y, n_y + m_x, 0), K_yy has (m_y, n_y, 0), slacks included in n_x and n_y.
  [[nodiscard]] Inertia expected() const;
  [[nodiscard]] Inertia expected_inner() const;
  /// Inertia of the matrix with slack rows from that of the matrix without; the eliminated pivots
  /// are S_x > 0 and -S_y < 0.
  [[nodiscard]] Inertia with_slacks(Inertia reduced) const;
  [[nodiscard]] Inertia with_slacks_inner(Inertia reduced) const;

  /// Expected sign of the pivot of each row of K: x +, y -, lambda_x -, lambda_y +.
  [[nodiscard]] std::vector<std::int8_t> signs() const;
};

}  // namespace ipminmax
