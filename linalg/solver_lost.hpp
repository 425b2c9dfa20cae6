#pragma once

#include "linalg/solver_options.hpp"

namespace ipminmax {

/// The linear solver worked before and does not any more, as when another process has died: no
/// option is wrong.
class SolverLost : public SolverUnavailable {
 public:
  using SolverUnavailable::SolverUnavailable;
};

}  // namespace ipminmax
