#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

/// What an independent check says of a certificate.
enum class CertificateVerdict : std::uint8_t {
  Confirmed,
  Doubtful,  ///< neither shown: singular, no solution near by to which Newton's method goes
  False      ///< the solution near by is no strict local minmax
};

struct CertificateJudgement {
  CertificateVerdict verdict = CertificateVerdict::Doubtful;
  std::string why;
  bool signs_are_right = false;            ///< of curvature too small for the check
  std::optional<std::size_t> wrong_row{};  ///< what refutes a guess of the active set
};

/// Checks the claim that a strict local minmax is near result.v. Dense linear algebra, that shares
/// no code with the library: Newton's method on the equations of the active set, for several
/// guesses of it, then multiplier signs, the curvature over y on the tangent space, the curvature
/// of the inner maximum over x; at last values along curves and at random feasible points. seed: of
/// these points. The problem has no robust constraints.
[[nodiscard]] CertificateJudgement judge_certificate(Problem& problem, const SolverOptions& options,
                                                     const Result& result, std::uint64_t seed);

}  // namespace ipminmax::testing
