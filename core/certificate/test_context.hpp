#pragma once

#include <optional>

#include "core/certificate/active_set.hpp"
#include "core/certificate/certificate.hpp"
#include "core/certificate/newton_test.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/reasons.hpp"
#include "core/certificate/robust_rows.hpp"
#include "core/certificate/second_order.hpp"
#include "core/differences/directional_check.hpp"

namespace ipminmax {

/// What all parts of the second-order test of a point work with, and what they have found.
struct TestContext {
  TestContext(CanonicalProblem& its_canonical, KktSystem& its_kkt, double its_mu,
              const SolverOptions& its_options, Index factorizations,
              CertificateArrays& its_arrays);

  CanonicalProblem& canonical;
  KktSystem& kkt;
  const SolverOptions& options;
  CertificateArrays& arrays;
  double mu;                 ///< of the point, or of the one that it moved to
  Index last_factorization;  ///< that an undecided point may cost, as counted by kkt
  IdleCopies idle{};         ///< copies of y whose robust constraint is inactive
  std::optional<Eigen::VectorXd> hessian_error{};  ///< of differences, canonical units

  Reasons reasons;
  std::optional<Point> moved{};  ///< nearer to the solution
  std::optional<WrongCurvature> wrong{};
  std::optional<Deviation> wrong_row{};  ///< of W
  Eigen::VectorXd proximal{};  ///< curvature that was taken from Max, canonical units; or empty
  bool is_far = false;         ///< the solution is near enough for the test but not for the user
  bool stopped = false;        ///< by the budget of factorizations
  Certificate certificate{};

  /// Curvature in units that a certificate leaves, at least what factorizations perturb.
  [[nodiscard]] double margin(double times) const;
  /// Step to the solution, over the size of the problem, that is worth going.
  [[nodiscard]] double far() const;
  /// False ends the test of an undecided point.
  [[nodiscard]] bool may_factorize(Index more);
  [[nodiscard]] bool has_x() const { return kkt.layout().x.size() > 0; }
  [[nodiscard]] bool has_y() const { return kkt.layout().y.size() > 0; }

  /// Copies of y whose robust constraint is inactive.
  void hold_idle(BoundClasses& classes) const;
  /// By z / s in the units of the first look, idle copies held.
  void guess(const Iterate& iterate, double strict_ratio, BoundClasses& classes) const;
  [[nodiscard]] Eigen::VectorXd hessian_error_in(const Units& units) const;
  /// Whether a Newton step keeps the classes and the next one would be much shorter. is_part: see
  /// test_newton.
  [[nodiscard]] bool newton_confirms(ActiveSetSystem& system, const Point& point,
                                     const KktSolve& solve, NewtonTest& newton,
                                     bool is_part = false) const;
  /// To the certificate and the reasons: the doubtful bounds of the classes that the verdict is of.
  void report_weakly_active(const BoundClasses& classes);
  /// To the certificate: the matrices' inertias at the point without any margin; all zero where no
  /// factorizations are left.
  void report_inertias(ActiveSetSystem& system);
  /// To the certificate: little curvature; to wrong_row: where W is wrong along it.
  void examine_curvature(ActiveSetSystem& system, const Point& point,
                         const Eigen::VectorXd& lambda);
  /// The same at a point whose active set is not known. assembled: null where no factors are.
  void examine_curvature(const Point& point, const Evaluation* assembled);

 private:
  void examine_curvature(const CurvatureTrial& trial, const Point& point,
                         const Eigen::VectorXd& lambda);
};

/// Whether the matrices of the test are nonsingular at the end of the step as well.
[[nodiscard]] inline bool gradients_hold(const NewtonTest& newton, const InertiaTest& test) {
  return newton.inner_turn * test.inner_response <= parameters::certificate::kTurn &&
         newton.turn * test.full_response <= parameters::certificate::kTurn;
}

}  // namespace ipminmax
