#pragma once

#include "core/certificate/candidate.hpp"

namespace ipminmax {

/// Whether y is a best answer to x nearby, maybe one of many, at a point whose K_yy has no
/// curvature of the wrong sign beyond kProximal. Either by structure: W has no entries between some
/// of his free variables, Z, and any of them; L is affine in Z then, with slope zero, and constant;
/// without Z and the rows that read it K_yy is right. Or by values: these are constant along all
/// directions without curvature. Reasons name such a direction.
[[nodiscard]] bool maximizes_weakly(TestContext& c, const Candidate& candidate);

}  // namespace ipminmax
