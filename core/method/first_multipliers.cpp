#include "core/method/first_multipliers.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {

void start_multipliers(const CanonicalProblem& canonical, KktSystem& kkt,
                       const SolverOptions& options, Point& point) {
  Iterate& iterate = point.iterate;
  const bool known = canonical.constraints() > 0 && options.constr_mult_init_max > 0.0 &&
                     kkt.least_squares_multipliers(iterate, point.evaluation, iterate.lambda) &&
                     max_norm(iterate.lambda) <= options.constr_mult_init_max;
  if (!known) start_constraint_multipliers(canonical, options, iterate);
  start_robust_multipliers(canonical, iterate);
}

}  // namespace ipminmax
