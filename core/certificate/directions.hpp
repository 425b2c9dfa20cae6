#pragma once

#include <optional>

#include "core/certificate/active_set.hpp"
#include "core/method/step_method.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// A direction tangent to the active constraints along which the curvature of W (for Min: of phi)
/// has a wrong sign beyond the margin, and along which trial steps in both directions gain what it
/// predicts: the maximizer's value rises, or phi falls. Steps are at least ten times distance (to
/// the solution, scaled), so that it is not the point's own error that is seen. Weakly active
/// bounds are kept. Empty: none was found.
[[nodiscard]] std::optional<WrongCurvature> find_refuting_direction(CanonicalProblem& canonical,
                                                                    ActiveSetSystem& system,
                                                                    const Point& point,
                                                                    double margin, double distance,
                                                                    Player owner);

/// Directions without curvature beyond the margin.
struct FlatDirections {
  enum class Verdict : std::uint8_t {
    /// The value stays the same along all of them, over lengths up to a tenth of the point, to
    /// rounding and what multipliers of relaxed bounds change it by.
    Flat,
    Neither,  ///< it changes, or the model could not be followed along them
    None      ///< there are none
  };
  Verdict verdict = Verdict::None;
  /// The first that is not flat, or the first of all; a step of canonical variables.
  Eigen::VectorXd direction;
};

/// At a point that is not refuted, with no weakly active bounds: of Max at this x, of Min with y
/// answering. Curvature up to ten margins counts as little. A few directions, orthogonal, are found
/// by inverse iteration with the matrix helped by the margin: of many flat ones these are general
/// combinations, along which the value changes if it does along any.
[[nodiscard]] FlatDirections find_flat_directions(CanonicalProblem& canonical,
                                                  ActiveSetSystem& system, const Point& point,
                                                  const SolverOptions& options, double margin,
                                                  Player owner);

}  // namespace ipminmax
