#pragma once

#include <optional>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "core/iteration.hpp"
#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/model/budget.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// A direction from a first-order point along which its owner gains to second order: both signs do.
struct WrongCurvature {
  Player owner = Player::Min;
  Eigen::VectorXd direction;  ///< canonical variables, slacks included; for Max zero in x
};

/// What led to a point. The values are the letters of the log, docs/log.md.
enum class StepKind : char {
  None = ' ',
  Newton = 'n',
  Filter = 'f',
  Shifted = 's',
  Corrected = 'c',  ///< of second order
  Soft = 'r',
  Restoration = 'R',
  Joint = 'j',
  UntestedFull = 'l',
  Escape = 'e',
  Watchdog = 'W',
  Instability = 'i',  ///< line 7 of Algorithm 1 raised delta_x
  NewStart = 'w'
};

/// What a step did.
struct StepReport {
  bool moved = false;               ///< a new point is there, complete
  std::optional<Status> failure{};  ///< ends the search, at the new point if there is one
  std::string message{};            ///< of the failure
  StepKind kind = StepKind::None;
  double delta_x = 0.0, delta_y = 0.0;  ///< shifts of W
  StepLength alpha{.primal = 0.0, .dual = 0.0};
  double step_norm = 0.0;  ///< infinity norm of the primal step
  Index trials = 0;
  ShiftFindings shifts{};

  void fail(Status status, std::string text = {}) {
    failure = status;
    message = std::move(text);
  }
};

/// What the parts of a method, which derive from it, work with; one for all searches of a solve.
struct MethodContext {
  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  InertiaCorrection& correction_;
  const SolverOptions& options_;
  SolveLimit& limit_;
  Counts& counts_;

  /// Else it is a minimization.
  [[nodiscard]] bool has_max() const { return canonical_.max_size() > 0; }
  /// to: from moved along the step, in a minimization as Ipopt's; its functions are the caller's.
  void move(const Point& from, const Step& step, StepLength alpha, double mu, Point& to) const {
    to.iterate = from.iterate;
    advance(canonical_, step, alpha, to.iterate,
            has_max() ? InequalityLength::Dual : InequalityLength::Primal);
    clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, to.iterate);
  }
};

/// A rule that leads from point to point. Points given have functions, derivatives and dual
/// residual; they stay as they are.
class StepMethod {
 public:
  virtual ~StepMethod() = default;

  /// One iteration, to another point with functions, derivatives and dual residual. Past the time
  /// limit any failure may come.
  [[nodiscard]] virtual StepReport step(const Point& from, double mu, Point& to) = 0;
  /// Leaves a first-order point that is no solution, with a wrong inertia, along a direction of the
  /// offending curvature, wrong where that is known. Not moved: no allowed attempt is left, none
  /// helps, or the method knows none.
  [[nodiscard]] virtual StepReport escape(const Point& /*from*/, double /*mu*/,
                                          const std::optional<WrongCurvature>& /*wrong*/,
                                          Point& /*to*/) {
    return {};
  }
  /// The barrier parameter changed: earlier merits no longer compare.
  virtual void barrier_changed() {}
};

}  // namespace ipminmax
