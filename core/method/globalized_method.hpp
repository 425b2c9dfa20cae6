#pragma once

#include <cstdint>
#include <optional>

#include "core/method/filter.hpp"
#include "core/method/inner_maximizer.hpp"
#include "core/method/restoration.hpp"
#include "core/method/setbacks.hpp"
#include "core/method/step_method.hpp"
#include "core/point/merit.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

/// Setbacks before a search is given up, to begin anew elsewhere.
struct Patience {
  Index setbacks = 0;
  Index setbacks_when_long = 0;  ///< and in a long search
  Index long_search = 0;         ///< iterations of one

  /// Of the search from the model's start, and of those after it.
  [[nodiscard]] static Patience first(const CanonicalProblem& canonical);
  [[nodiscard]] static Patience begun_anew(const CanonicalProblem& canonical);
};

/// The globalized method, core/algorithm.md: the minimizer descends on phi(x), the local maximum
/// over y, estimated by the barrier value plus the predicted gain of the inner Newton step.
/// Without Max variables this is Ipopt's filter line search.
class GlobalizedMethod final : public StepMethod {
 public:
  /// first: where the search begins.
  GlobalizedMethod(const MethodContext& context, const Patience& patience, Restorer restorer,
                   const Point& first);

  [[nodiscard]] StepReport step(const Point& from, double mu, Point& to) override;
  [[nodiscard]] StepReport escape(const Point& from, double mu, const EscapeRequest& request,
                                  Point& to) override;
  void barrier_changed() override;
  void factors_lost() override { forget_direction(); }

 private:
  struct Trial {
    bool usable = false;
    Merit merit;
  };
  /// A step under way.
  struct Run {
    const Point* here;  ///< the point left, or what was reached on the way: then &to
    Point& to;
    double mu;
    StepReport report{};
  };
  [[nodiscard]] bool has_max() const { return canonical_.max_size() > 0; }
  [[nodiscard]] std::optional<Status> minmax_step(Run& run);
  [[nodiscard]] bool fast_step(Run& run);
  [[nodiscard]] std::optional<Status> shifted_joint_step(Run& run);
  [[nodiscard]] std::optional<Status> outer_step(Run& run);
  [[nodiscard]] bool newton_step(const Point& point, double mu, Regularization& shift);
  /// The step of a minimization while the watchdog watches. False: an ordinary search is due, from
  /// the point and with the step that it went back to when skip_first.
  [[nodiscard]] bool watched_step(Run& run, bool& skip_first);
  /// skip_first: the full step was rejected before.
  [[nodiscard]] bool search(Run& run, int max_trials, bool skip_first);
  /// An accepted step, the last trial before which the filter alone rejected or not.
  void count_dominated(bool dominated);
  [[nodiscard]] bool turn_to_least_curvature(const Point& point, bool clear);
  [[nodiscard]] Filter::Verdict second_order_correction(Run& run, const Merit& from, double slope,
                                                        double alpha, double first_theta);
  [[nodiscard]] bool soft_step(Run& run);
  [[nodiscard]] bool can_restore(const Point& point) const;
  [[nodiscard]] std::optional<Status> restore(Run& run);
  [[nodiscard]] std::optional<Status> check_branch(double estimate, Run& run);
  [[nodiscard]] std::optional<Status> check_progress(Run& run);
  [[nodiscard]] std::optional<Status> set_back(Setback kind, Run& run);
  /// As far along step_ as all functions are defined.
  [[nodiscard]] std::optional<Status> step_untested(Run& run, StepLength alpha);
  [[nodiscard]] std::optional<Status> leap(Run& run);
  [[nodiscard]] bool escape_inner(Run& run, const EscapeRequest& request, bool along_given);
  [[nodiscard]] bool escape_outer(Run& run, const EscapeRequest& request);
  [[nodiscard]] Trial evaluate_trial(double mu, double slope, double alpha, double upper_bound);
  /// The trial point moved towards the constraints of the minimizer; no Max variables.
  [[nodiscard]] Trial back_to_constraints(const Point& point, double mu, Trial trial);
  void set_trial(const Point& from, const Step& step, double alpha_primal, double alpha_dual,
                 double mu);
  void move_to_trial(Run& run);
  void accept(Run& run);
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
  IterationBudget& budget_;
  Patience patience_;
  Restorer restorer_;
  InnerMaximizer inner_;
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
    StepReport report;
  } watchdog_;
  Index escapes_ = 0;
  Index soft_steps_ = 0;
  Index inner_pause_ = 0;      ///< joint steps before the inner phase is tried again
  Index inner_failures_ = 0;   ///< in a row
  Index inner_unbounded_ = 0;  ///< inner phases in which y ran away
  Index joint_steps_ = 0;      ///< shifted joint steps of the whole solve
  Setbacks setbacks_;
};

}  // namespace ipminmax
