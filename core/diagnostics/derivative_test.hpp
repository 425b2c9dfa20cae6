#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "../options.hpp"
#include "../problem.hpp"
#include "../result.hpp"

namespace IPMINMAX_API ipminmax {

/// What the derivative test says about one entry.
enum class DerivativeFinding : std::uint8_t {
  Agrees,
  Differs,  ///< relative error above derivative_test_tol
  Missing   ///< not in the structure, but differences show that it is not zero
};

/// One partial derivative: of f or g_k, first or second.
struct DerivativeEntry {
  Index constraint = -1;       ///< k, -1 for the objective
  Index variable = 0;          ///< first derivative: in this variable; second: the row
  Index second_variable = -1;  ///< column of a second derivative, -1 for a first one
  DerivativeFinding finding = DerivativeFinding::Agrees;
  double exact = 0.0;           ///< the model's value, 0 when missing
  double approximate = 0.0;     ///< by differences
  double relative_error = 0.0;  ///< |exact - approximate| / max(1, |approximate|)
  /// The constraint belongs to Min and varies with this variable of Max, which its structure does
  /// not say, or which minmax_robust_constraints no forbids.
  bool crosses_players = false;
};

/// Outcome of the derivative test.
struct DerivativeReport {
  std::string failure;     ///< why nothing could be tested, empty when it could
  std::vector<double> v;   ///< the point of the test, n
  Index first_tested = 0;  ///< first derivatives compared
  Index first_wrong = 0;
  Index second_tested = 0;  ///< second derivatives compared
  Index second_wrong = 0;
  /// Wrong entries, or all that were compared with derivative_test_print_all; first derivatives by
  /// variable, then second ones by function.
  std::vector<DerivativeEntry> entries;
  /// Parts that were left out, with the reason (no second derivatives, undefined differences).
  std::vector<std::string> remarks;
};

/// Compares the model's derivatives with forward differences, as Ipopt's derivative checker: first
/// and second ones, also if options.derivative_test is None; FirstOrder and OnlySecondOrder select
/// a part. The point is random, within point_perturbation_radius of the starting point and within
/// the bounds. Steps are derivative_test_perturbation max(1, |v|), away from a bound or an
/// undefined point. An entry is wrong when its relative error is at least derivative_test_tol and
/// more than rounding explains.
///
/// Rows outside the structures are compared with zero, so a nonzero that the Jacobian or the
/// Hessian misses is found, and with it a Min constraint that varies with a Max variable. Second
/// derivatives of f and of every g_k are tested one by one.
[[nodiscard]] DerivativeReport test_derivatives(Problem& problem, const SolverOptions& options);

/// Compares, near the answer of a certified game, first derivatives of its functions with
/// differences along one generic direction. If they disagree, the certificate is withdrawn, with a
/// reason and in the message: a wrong sign of a slope over y, shared by second derivatives, makes a
/// minimum over y look like a maximum, and at the answer itself nothing shows it. Front ends call
/// this after the first solve of a model; solve and run do not. It takes five values and one
/// gradient of all functions, counted in the result. Exceptions of the model pass through.
void check_first_derivatives(Problem& problem, const SolverOptions& options, Result& result);

/// "Jacobian of constraint 0 (balance) of Min in variable 2 (y) of Max"; names where there are
/// some.
[[nodiscard]] std::string describe(const DerivativeEntry& entry, const ProblemStructure& structure);

}  // namespace ipminmax
