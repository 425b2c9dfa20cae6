#pragma once

#include <optional>

#include "core/method/filter_search.hpp"
#include "core/method/inner_maximizer.hpp"
#include "core/method/step_method.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// What an inner Newton step may still promise to gain where phi is estimated: that share, but less
/// than phi itself says and more than its rounding.
[[nodiscard]] double tolerated_gain(double share, double phi);

/// What an OuterBlock works with, kept from one to the next.
struct OuterArrays {
  InnerArrays inner_arrays;
  Point trial;
  InnerDirection direction;        ///< inner Newton step at the current point
  InnerDirection trial_direction;  ///< at the trial point
  NewtonResidual rhs;
  Step step;
  Step corrected;               ///< another step, of corrections and escapes
  Eigen::VectorXd corrected_c;  ///< right-hand side of second-order corrections
  Eigen::VectorXd gradient_;
  Point before_, best_;  ///< on the way back to the constraints
};

/// The minimizer's side of the globalized method: the Newton step through K, and phi(x), estimated
/// by the barrier value plus the predicted gain of the inner Newton step, along it. Without Max
/// variables phi is the barrier objective.
class OuterBlock : public Kept<OuterArrays> {
 public:
  /// The largest merit phi worth looking at where the violation is theta.
  class Bound {
   public:
    Bound() = default;  ///< none
    Bound(const Filter& filter, const SearchLine& line) : filter_(&filter), line_(&line) {}
    [[nodiscard]] double operator()(double alpha, double theta) const;

   private:
    const Filter* filter_ = nullptr;
    const SearchLine* line_ = nullptr;
  };

  /// first: where the search begins.
  OuterBlock(const MethodContext& context, const Point& first, OuterArrays& arrays);

  [[nodiscard]] bool has_max() const { return canonical_.max_size() > 0; }

  /// Violation of the Min constraints and f_b.
  [[nodiscard]] Merit merit(const Point& point, double mu) const;
  /// The same with phi estimated, at the point that direction belongs to.
  [[nodiscard]] Merit estimate(const Point& point, double mu) const;
  [[nodiscard]] double norm_error(const Point& point, double mu) const;

  /// Right-hand side and matrices at the point.
  void assemble(const Point& point, double mu);
  /// The Newton step with shifts of x that K needs, given those of y; assembled anew. zero_fails: K
  /// is known to be wrong without shift.
  [[nodiscard]] bool find_step(const Point& point, double mu, Regularization& shift,
                               bool zero_fails);
  /// The Newton step with factors.
  [[nodiscard]] bool solve(const Point& point, const Accuracy& accuracy = {}) {
    return kkt_.solve(factors, point.evaluation, rhs, step, accuracy);
  }
  /// As far along step as bounds allow.
  [[nodiscard]] StepLength longest_step(const Point& point, double mu) const;
  /// Directional derivative of phi along step.
  [[nodiscard]] double slope(const Point& point, double mu);

  /// Of the trial point; the shift in trial_direction.
  [[nodiscard]] bool has_trial_maximum_in_sight(double mu) {
    const KktSystem::Counting counting(kkt_, FactorizationCause::TrialPoint);
    return inner.has_maximum_in_sight(trial, mu, trial_direction.shift);
  }

  void set_trial(const Point& from, const Step& along, StepLength alpha, double mu);
  /// Merit of the trial point, its inner maximum first where there are Max variables: it must keep
  /// one in sight. None where phi is seen to lie above the bound, before K_yy is factorized if the
  /// value shows it.
  [[nodiscard]] Trial evaluate_trial(double mu, double slope, double alpha, const Bound& bound);
  /// trial_direction at the trial point; false: K_yy is wrong there.
  [[nodiscard]] bool find_trial_direction(double mu) {
    const KktSystem::Counting counting(kkt_, FactorizationCause::TrialPoint);
    return inner.unshifted_direction(trial, mu, trial_direction);
  }
  /// The trial point along the step for constraints with the values c, from a point with the
  /// factors.
  [[nodiscard]] std::optional<StepLength> correct(const Point& from, double mu,
                                                  const Eigen::VectorXd& c);
  /// The trial point moved towards the constraints of the minimizer; no Max variables. from: the
  /// point of the factors.
  [[nodiscard]] Trial return_to_constraints(const Point& from, double mu, Trial reached);

  InnerMaximizer inner;
  KktFactors factors;  ///< of K

 private:
  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  InertiaCorrection& correction_;
  const SolverOptions& options_;
};

}  // namespace ipminmax
