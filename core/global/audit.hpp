#pragma once

#include <tuple>

#include "core/global/witnesses.hpp"
#include "core/model/budget.hpp"
#include "core/multistart.hpp"
#include "core/options.hpp"

// One order of answers, and the last word on each.
namespace ipminmax {

/// Rank of a result in better(): lexicographic, smaller is better.
using Rank = std::tuple<int, int, double>;

[[nodiscard]] Rank rank_of(const Result& result);

[[nodiscard]] inline bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

/// Whether nothing is known that speaks against a result's claim: what was asked for was done, and
/// no y refutes it.
[[nodiscard]] bool stands(const Result& result);

/// The last word on an answer: the only place that takes back a success or a certificate, and it
/// grants none. It evaluates the model as the user gave it, at the answer's x with each y of the
/// witnesses that Max's constraints allow there, and compares in the range of what is compared.
///
/// Taken back is what was cut short (as the budget knows), what was asked for and not
/// finished, a value that another y exceeds (where other y were asked for), a robust constraint
/// that a y violates, a K_yy that clearly has a wrong sign, and numbers that are not finite. A y
/// that refutes the answer is kept: of f in result.worst_case, of a robust constraint as the last
/// of result.worst_cases.
/// counts: evaluations are added. Without memory the budget is stopped.
void audit(Problem& model, const SolverOptions& options, const Witnesses& witnesses, Budget& budget,
           Result& result, Counts& counts);

}  // namespace ipminmax
