#pragma once

#include <optional>

#include "core/certificate/active_set.hpp"
#include "core/method/wrong_curvature.hpp"
#include "core/point/merit.hpp"

namespace ipminmax {

/// A direction tangent to the active constraints along which the curvature of W (for Min: of phi)
/// has a wrong sign beyond the margin, and along which trial steps in both directions gain what it
/// predicts: the maximizer's value rises, or phi falls. Steps are at least ten times distance (to
/// the solution, in units), so that it is not the point's own error that is seen. Doubtful bounds
/// are kept. Empty: none was found.
[[nodiscard]] std::optional<WrongCurvature> find_witness(CanonicalProblem& canonical,
                                                         ActiveSetSystem& system,
                                                         const Point& point, double margin,
                                                         double distance, Player owner);

/// The same along a direction in units that leads into the bounds where the other one does not: the
/// value has to bend by more than a slope explains. Bounds as in the last assemble, K (of Max: K_yy)
/// factorized.
[[nodiscard]] std::optional<WrongCurvature> try_witness(CanonicalProblem& canonical,
                                                        ActiveSetSystem& system, const Point& point,
                                                        const Eigen::VectorXd& direction,
                                                        double distance, Player owner);

}  // namespace ipminmax
