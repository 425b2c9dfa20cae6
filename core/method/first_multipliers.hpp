#pragma once

#include "core/kkt/system.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// First multipliers of the constraints at a point with first derivatives and bound multipliers: by
/// least squares, dropped when above constr_mult_init_max [WB, 3.6], those of robust constraints
/// from their slacks.
void start_multipliers(const CanonicalProblem& canonical, KktSystem& kkt,
                       const SolverOptions& options, Point& point);

}  // namespace ipminmax
