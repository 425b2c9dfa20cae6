#pragma once

#include <optional>

#include "core/certificate/active_set.hpp"
#include "core/method/wrong_curvature.hpp"
#include "core/point/merit.hpp"

namespace ipminmax {

/// A direction tangent to the active constraints along which the curvature of W (for Min: of phi) has
/// a wrong sign beyond the error and the margin, and along which a trial step gains: the maximizer's
/// value rises, or phi falls. Doubtful bounds are kept. inner: whether K_yy is the matrix that is wrong.
/// Empty: none was found.
[[nodiscard]] std::optional<WrongCurvature> find_witness(CanonicalProblem& canonical,
                                                         ActiveSetSystem& system,
                                                         const Point& point,
                                                         const Eigen::VectorXd& error,
                                                         double margin, bool inner);

}  // namespace ipminmax
