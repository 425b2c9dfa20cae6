#pragma once

#include <cstdint>
#include <optional>

#include "core/method/filter.hpp"
#include "core/method/outer_block.hpp"
#include "core/method/parameters.hpp"
#include "core/method/patience.hpp"
#include "core/method/restoration.hpp"
#include "core/method/step_method.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Ipopt's watchdog for minimizations: after shortened steps in a row, full steps that need not
/// improve on the point they leave, as long as one of the first few improves on the point where it
/// began.
struct Watchdog {
  bool active = false;
  Index trials = 0;
  Index shortened_steps = 0;  ///< in a row
  // Where it began.
  Point point;
  Step step;
  Merit from;
  double slope = 0.0;
  double alpha = 1.0;
  StepReport report;

  // watchdog_shortened_iter_trigger of [Ipopt]
  [[nodiscard]] bool is_due() const { return active || shortened_steps >= parameters::kPatience; }
  void count(bool shortened) { shortened_steps = shortened ? shortened_steps + 1 : 0; }
  /// As a new one; arrays keep their room.
  void begin_anew() {
    active = false;
    trials = shortened_steps = 0;
    from = {};
    slope = 0.0;
    alpha = 1.0;
    report = {};
  }
  void end() {
    active = false;
    shortened_steps = 0;
  }
};

/// What a GlobalizedMethod works with, kept from one to the next.
struct GlobalizedArrays {
  OuterArrays outer_arrays_;
  Filter filter_;
  Watchdog watchdog_;
};

/// The globalized method, docs/algorithm.md: the minimizer descends on phi(x), the local maximum
/// over y, estimated by the barrier value plus the predicted gain of the inner Newton step.
/// Without Max variables this is Ipopt's filter line search.
class GlobalizedMethod final : public StepMethod, Kept<GlobalizedArrays> {
 public:
  /// first: where the search begins.
  GlobalizedMethod(const MethodContext& context, Restorer restorer, const Point& first,
                   GlobalizedArrays& arrays);

  [[nodiscard]] StepReport step(const Point& from, double mu, Point& to) override;
  [[nodiscard]] StepReport escape(const Point& from, double mu, const EscapeRequest& request,
                                  Point& to) override;
  void barrier_changed() override;

 private:
  /// What is known of K without shifts. Right: the block's step is the Newton step.
  enum class UnshiftedStep : std::uint8_t { Unknown, Wrong, Right };
  /// A step under way.
  struct Run {
    const Point* here;  ///< the point left, or what was reached on the way: then &to
    Point& to;
    double mu;
    UnshiftedStep unshifted_step = UnshiftedStep::Unknown;  ///< at here
    StepReport report{};
  };
  struct Block;

  // Each either moves, or gives a reason to end the search, or neither (false).
  [[nodiscard]] bool minmax_step(Run& run);
  [[nodiscard]] bool contracts(double before, double after);
  [[nodiscard]] Accuracy forcing(double error) const;
  [[nodiscard]] bool fast_step(Run& run);
  [[nodiscard]] bool inner_phase(Run& run, double target);
  [[nodiscard]] bool joint_step(Run& run);
  [[nodiscard]] bool outer_step(Run& run);
  [[nodiscard]] bool exact_inner_maximum(Run& run);
  [[nodiscard]] bool without_line_search(Run& run);
  [[nodiscard]] bool watched_step(Run& run);
  void return_to_watched(Run& run);
  [[nodiscard]] bool search(Run& run, int trials, bool first_fails);
  [[nodiscard]] bool soft_step(Run& run);
  [[nodiscard]] bool leap(Run& run);
  [[nodiscard]] bool untested_step(Run& run, StepLength alpha);
  [[nodiscard]] bool restore(Run& run);
  [[nodiscard]] bool begin_at_restored(Run& run);
  [[nodiscard]] bool escape_inner(Run& run, const EscapeRequest& request, bool along_given);
  [[nodiscard]] bool escape_outer(Run& run, const EscapeRequest& request);

  [[nodiscard]] bool has_max() const { return outer_.has_max(); }
  [[nodiscard]] bool can_restore(const Point& point) const;
  [[nodiscard]] double inner_target(const Point& point, double mu) const;
  [[nodiscard]] bool find_outer_step(Run& run);
  /// False, and the run fails, where there is an end.
  [[nodiscard]] bool goes_on(Run& run, const std::optional<Patience::End>& end) const;
  static bool fail(Run& run, Status status, std::string message = {});
  [[nodiscard]] bool fail_by_limit(Run& run) const;
  void move_to_trial(Run& run);
  /// The same with the trial point's direction.
  void accept(Run& run);
  void count_dominated(bool dominated);

  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  InertiaCorrection& correction_;
  const SolverOptions& options_;
  TimeLimit& limit_;
  IterationBudget& budget_;
  Restorer restorer_;
  Patience patience_;
  OuterBlock outer_;

  /// Second derivatives of the point at which a fast step ended, by their number: K_yy is right
  /// there, or taken to be, in the freeze neighbourhood.
  std::uint64_t inner_right_at_ = 0;
  double least_residual_ = kInfinity;  ///< of the fast steps in a row since mu changed
  int steps_above_least_ = 0;          ///< fast ones in a row
  double last_slope_ = 1e20;
  double fast_contraction_ = 0.0;  ///< of the residual by the last step; 0: that was not full, fast
  Index dominated_steps_ = 0;      ///< in a row whose last rejection was the filter's
  Index filter_resets_ = 0;
  Index soft_steps_ = 0;
};

}  // namespace ipminmax
