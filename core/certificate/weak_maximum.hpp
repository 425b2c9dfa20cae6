#pragma once

#include "core/certificate/stage.hpp"

namespace ipminmax {

/// Curvature that is taken from Max's variables where his best answer is not unique, in units.
/// Smaller ones ask less of x, but no less than 1e-5 of a system's solution can be told from
/// dependent gradients. Of 2,642 random bilinear games with a strict minimizer 1e-3 certifies 2,620
/// (design.md, section 4).
inline constexpr double kProximal = 1e-3;

/// Whether y is a best answer to x nearby, maybe one of many, at a point whose K_yy has no
/// curvature of the wrong sign beyond kProximal. Either by structure: W has no entries between
/// some of his free variables, Z, and any of them; L is affine in Z then, with slope zero, and
/// constant; without Z and the rows that read it K_yy is right. Or by values: these are constant
/// along all directions without curvature. Reasons name such a direction.
[[nodiscard]] bool maximizes_weakly(Case& c, const Stage& stage);

}  // namespace ipminmax
