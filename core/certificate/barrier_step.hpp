#pragma once

#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/merit.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

/// Solves with the assembled K at a shift, factorized anew at a higher quality as often as needed.
[[nodiscard]] bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation,
                                    const NewtonResidual& rhs, Step& step,
                                    const Regularization& shift = {});

/// One Newton step for the equations at mu from a point with all derivatives and dual residual,
/// which is left at its end, without f; dependent: constraints are, as is known before or found
/// out. False: it cannot be computed or evaluated.
[[nodiscard]] bool barrier_newton_step(CanonicalProblem& canonical, KktSystem& kkt, double mu,
                                       Point& point, StepLength& alpha, bool& dependent);

}  // namespace ipminmax
