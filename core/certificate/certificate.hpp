#pragma once

#include <optional>
#include <string>

#include "core/certificate/active_set.hpp"
#include "core/certificate/contraction.hpp"
#include "core/certificate/hessian_check.hpp"
#include "core/certificate/units.hpp"
#include "core/kkt/system.hpp"
#include "core/method/wrong_curvature.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/merit.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// What the second-order test found, and where.
struct Finding {
  Certificate certificate;
  /// A point nearer to the solution, with all derivatives and the barrier parameter that belongs to
  /// it, of which the certificate speaks; empty: of the point that was given.
  std::optional<Point> point;
  double mu = 0.0;
  std::optional<WrongCurvature> wrong;  ///< why the verdict is Violated
  /// A step of Min to smaller values, although no curvature was found that refutes the point.
  std::optional<Eigen::VectorXd> descent;
  std::string remark;  ///< where W is wrong, if it is, without line end
};

/// What the test of a clear point works with, kept from test to test.
struct CertificateArrays {
  UnitsArrays units;  ///< at the point that is given
  BoundClasses classes;
  ActiveSetArrays system;
  NewtonTest newton;
  Eigen::VectorXd change;  ///< of W on the way to the solution, in units
  NewtonArrays newton_step;
  CurvatureArrays curvature;
};

inline constexpr Index kGenerousFactorizations = 100;

/// Second-order test at a first-order point: the paper's Proposition "Second order sufficient
/// conditions for constrained minmax", all regularization off. The claim, its hypotheses and what
/// of them is proved, checked or trusted: core/algorithm.md, "Second-order test".
///
/// point: f, c, first and second derivatives and the dual residual at the iterate. The KKT matrices
/// are left at the certificate's values. factorizations: that may be spent on an undecided point,
/// beyond those of the first look; options.minmax_certificate: Full or Quick.
[[nodiscard]] Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point,
                              double mu, const SolverOptions& options, Index factorizations,
                              CertificateArrays& arrays);
/// The same with arrays of its own.
[[nodiscard]] Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point,
                              double mu, const SolverOptions& options,
                              Index factorizations = kGenerousFactorizations);

}  // namespace ipminmax
