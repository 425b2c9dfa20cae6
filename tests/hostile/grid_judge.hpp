#pragma once

#include <string>

#include <hostile/known_models.hpp>
#include <hostile/rewritten_problem.hpp>

#include "core/options.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

struct Judgement {
  /// Why a claim of the result is false; empty: none is.
  std::string wrong;
  /// The same, of a point that is as good as tol and bound_relax_factor in the rewritten model's
  /// units can tell.
  std::string tolerated;
};

/// Judges what a result of the rewritten model claims, at the model's own point, from grids of y and
/// closed forms.
[[nodiscard]] Judgement judge(const KnownModel& model, const Rewriting& rewriting,
                              const Result& result, const SolverOptions& options);

}  // namespace ipminmax::testing
