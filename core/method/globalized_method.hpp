#pragma once

#include <optional>
#include <string>

#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/method/filter.hpp"
#include "core/method/inner_maximizer.hpp"
#include "core/method/restoration.hpp"
#include "core/method/wrong_curvature.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/merit.hpp"
#include "core/point/step_length.hpp"
#include "core/solver.hpp"

namespace ipminmax {

/// The globalized method, core/algorithm.md: the minimizer descends on phi(x), the local maximum
/// over y, estimated by the barrier value plus the predicted gain of the inner Newton step.
/// Without Max variables this is Ipopt's filter line search.
class GlobalizedMethod {
 public:
  GlobalizedMethod(CanonicalProblem& canonical, KktSystem& kkt, InertiaCorrection& correction,
                   const SolverOptions& options, TimeLimit& limit, Counts& counts,
                   bool allow_restoration, bool repeated = false);

  /// Once, at the first point.
  void start(const Point& point);
  /// The barrier parameter changed: earlier merits no longer compare.
  void barrier_changed();
  /// The KKT systems were factorized for something else since the last step.
  void factors_lost() { forget_direction(); }

  /// One iteration: moves the point, fully evaluated at its end, and describes the step in info.
  /// A status ends the solve; message() says more. Past the time limit any status may come.
  [[nodiscard]] std::optional<Status> step(Point& point, double mu, IterationInfo& info);

  /// Leaves a first-order point with a wrong inertia along a direction of the offending curvature: the
  /// given one, or one that inverse iteration finds; clear: only for a clear gain, looked for at few
  /// points. False: none of the allowed attempts is left, or none helps.
  [[nodiscard]] bool escape(Point& point, double mu, bool clear, IterationInfo& info,
                            const std::optional<WrongCurvature>& wrong);

  /// To be told of restorations' iterations. A stop ends the step with Status::UserStop, the point
  /// moved to where it happened, its values and first derivatives renewed where they exist.
  void observe_restorations(RestorationObserver observer) {
    restoration_observer_ = std::move(observer);
  }

  [[nodiscard]] const std::string& message() const { return message_; }

 private:
  struct Trial {
    bool usable = false;
    Merit merit;
  };
  [[nodiscard]] bool has_max() const { return canonical_.max_size() > 0; }
  [[nodiscard]] bool fast_step(Point& point, double mu, IterationInfo& info);
  [[nodiscard]] std::optional<Status> shifted_joint_step(Point& point, double mu,
                                                         IterationInfo& info);
  [[nodiscard]] std::optional<Status> outer_step(Point& point, double mu, IterationInfo& info);
  [[nodiscard]] bool newton_step(const Point& point, double mu, Regularization& shift);
  /// The step of a minimization while the watchdog watches. False: an ordinary search is due, from
  /// the point and with the step that it went back to when skip_first.
  [[nodiscard]] bool watched_step(Point& point, double mu, IterationInfo& info, bool& skip_first);
  /// skip_first: the full step was rejected before.
  [[nodiscard]] bool search(Point& point, double mu, int max_trials, IterationInfo& info,
                            bool skip_first);
  /// An accepted step, the last trial before which the filter alone rejected or not.
  void count_dominated(bool dominated);
  [[nodiscard]] bool turn_to_least_curvature(const Point& point, bool clear);
  [[nodiscard]] Filter::Verdict second_order_correction(const Point& point, double mu,
                                                        const Merit& from, double slope,
                                                        double alpha, double first_theta,
                                                        IterationInfo& info);
  [[nodiscard]] bool soft_step(Point& point, double mu, IterationInfo& info);
  [[nodiscard]] bool can_restore(const Point& point) const;
  [[nodiscard]] std::optional<Status> restore(Point& point, double mu, IterationInfo& info);
  [[nodiscard]] std::optional<Status> check_branch(double estimate, const Point& point, double mu);
  [[nodiscard]] std::optional<Status> check_progress(const Point& point, double mu);
  [[nodiscard]] std::optional<Status> set_back();
  /// As far along step_ as all functions are defined.
  std::optional<Status> step_untested(Point& point, StepLength alpha, double mu,
                                      IterationInfo& info);
  [[nodiscard]] std::optional<Status> leap(Point& point, double mu, IterationInfo& info);
  [[nodiscard]] Trial evaluate_trial(double mu, double slope, double alpha, double upper_bound);
  /// The trial point moved towards the constraints of the minimizer; no Max variables.
  [[nodiscard]] Trial back_to_constraints(const Point& point, double mu, Trial trial);
  void set_trial(const Point& from, const Step& step, double alpha_primal, double alpha_dual,
                 double mu);
  [[nodiscard]] bool evaluate_values(Point& point);
  [[nodiscard]] bool evaluate_derivatives(Point& point);
  [[nodiscard]] bool evaluate_residual(Point& point);  ///< all but the Hessian
  [[nodiscard]] bool evaluate_hessian(Point& point);
  void accept(Point& point);
  /// The point moved without its K_yy.
  void forget_direction() { direction_known_ = inner_right_ = false; }
  [[nodiscard]] double inner_target(const Point& point, double mu) const;
  [[nodiscard]] double outer_slope(const Point& point, double mu);
  [[nodiscard]] double norm_error(const Point& point, double mu) const;
  [[nodiscard]] Merit merit(const Point& point, double mu) const;

  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  InertiaCorrection& correction_;
  const SolverOptions& options_;
  TimeLimit& limit_;
  Counts& counts_;
  bool allow_restoration_;
  RestorationObserver restoration_observer_;
  bool repeated_;  ///< the search from another starting point failed before
  InnerMaximizer inner_;
  Index max_setbacks_;
  Merit best_{1e300, 1e300};  ///< least violation and value at this mu
  Index stale_steps_ = 0;     ///< in a row that improved neither
  Index steps_ = 0;
  Filter filter_;

  Point trial_;
  InnerDirection direction_;        ///< inner Newton step at the current point
  InnerDirection trial_direction_;  ///< at the trial point
  /// What is known of K at the point without shifts: step_ then holds the Newton step.
  enum class UnshiftedStep : std::uint8_t { Unknown, Wrong, Right };
  UnshiftedStep unshifted_step_ = UnshiftedStep::Unknown;
  bool direction_known_ = false;  ///< direction_ belongs to the point, with some mu
  bool inner_right_ = false;      ///< K_yy was right at the point, or the point lies in the freeze
                                  ///< neighbourhood, where it is taken to be
  bool inner_overwritten_ = false;  ///< the fast step left the K_yy of another point
  NewtonResidual rhs_;
  Step step_, correction_step_, back_step_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd corrected_c_;  ///< right-hand side of second-order corrections
  Point before_;                 ///< the inner phase
  Point best_trial_;             ///< on the way back to the constraints
  double last_slope_ = 1e20;
  Index fast_pause_ = 0;           ///< iterations without the fast path after it failed
  double fast_contraction_ = 0.0;  ///< of the residual by the last step; 0: that was not full, fast
  Index slow_steps_ = 0;           ///< short accepted steps in a row
  Index shortened_steps_ = 0;      ///< in a row
  Index dominated_steps_ = 0;      ///< in a row whose last rejection was the filter's
  Index filter_resets_ = 0;
  struct Watchdog {
    bool active = false;
    Index trials = 0;
    Point point;  ///< where it began, with its step
    Step step;
    Merit from;
    double slope = 0.0;
    double alpha = 1.0;
    IterationInfo info;
  } watchdog_;
  Index escapes_ = 0;
  Index soft_steps_ = 0;
  Index inner_pause_ = 0;      ///< joint steps before the inner phase is tried again
  Index inner_failures_ = 0;   ///< in a row
  Index inner_unbounded_ = 0;  ///< inner phases in which y ran away
  Index joint_steps_ = 0;      ///< shifted joint steps of the whole solve
  Index setbacks_ = 0;         ///< leaps, failed inner phases and jumps to another branch
  std::string message_;
};

}  // namespace ipminmax
