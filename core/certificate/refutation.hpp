#pragma once

#include "core/certificate/stage.hpp"

namespace ipminmax {

/// What is said of a point that gets no certificate: that it is refuted, by a witness; that it is
/// flat; or why neither is known.
[[nodiscard]] SecondOrder judge_without_certificate(Case& c, Stage& stage);

/// The necessary conditions, with the margin given to Max in K where K_yy is right without.
[[nodiscard]] InertiaTest helped_by_margin(Case& c, ActiveSetSystem& system,
                                           const Eigen::VectorXd& error);

}  // namespace ipminmax
