#pragma once

#include <optional>
#include <vector>

#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/model_shape.hpp"

namespace ipminmax {

/// What a solve leaves to the next one.
struct KeptWork {
  ModelShape shape;
  std::optional<GradientScaling> scaling;
  std::optional<KktAnalysis> analysis;
  ShiftMemory shifts;
  /// For searches that must not depend on those before: shape, analysis and pattern are those of
  /// the first and stay, the rest is not kept.
  bool structure_only = false;
  /// Of second derivatives by differences, detected; empty: not known.
  std::optional<std::vector<Triplet>> hessian_pattern;

  /// Whether it serves a solve of the problem; what does not fit is forgotten first.
  [[nodiscard]] bool fits(const ProblemStructure& structure, const SolverOptions& options);
};

}  // namespace ipminmax
