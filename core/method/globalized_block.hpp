#pragma once

#include <optional>

#include "core/method/curvature_escape.hpp"
#include "core/method/filter_search.hpp"
#include "core/method/globalized_method.hpp"
#include "core/method/parameters.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

/// The block of x, through K, for filter_search and move_along_curvature.
struct GlobalizedMethod::Block {
  GlobalizedMethod& owner;
  Run& run;
  OuterBlock::Bound bound{};  ///< of merits worth looking at
  // Of a move along a curvature
  double alpha_primal = 0.0;

  [[nodiscard]] const Point& from() const { return *run.here; }
  [[nodiscard]] Point& trial() const { return owner.outer_.trial; }
  [[nodiscard]] Eigen::VectorXd& corrected_c() const { return owner.outer_.corrected_c; }

  [[nodiscard]] Trial evaluate(double slope, StepLength alpha) const {
    owner.outer_.set_trial(from(), owner.outer_.step, alpha, run.mu);
    ++run.report.trials;
    return owner.outer_.evaluate_trial(run.mu, slope, alpha.primal, bound);
  }
  [[nodiscard]] std::optional<StepLength> correct(const Eigen::VectorXd& c) const {
    ++run.report.trials;
    return owner.outer_.correct(from(), run.mu, c);
  }
  [[nodiscard]] Trial evaluate_corrected(double slope, double alpha) const {
    return owner.outer_.evaluate_trial(run.mu, slope, alpha, {});
  }
  void passed(bool dominated) const { owner.count_dominated(dominated); }
  [[nodiscard]] bool complete() const {
    return owner.has_max() ||
           evaluate_derivatives(owner.canonical_, trial()) == EvaluationStatus::Ok;
  }

  void set_trial(const Eigen::VectorXd& direction, double length) {
    Step& along = owner.outer_.corrected;
    set_zero(along);
    along.v = length * direction;
    const StepLength alpha =
        largest_step(owner.canonical_, from().iterate, along, parameters::kProgress);
    alpha_primal = alpha.primal;
    owner.outer_.set_trial(from(), along, alpha, run.mu);
    ++run.report.trials;
  }
  [[nodiscard]] Trial evaluate_move(double length) const {
    return owner.outer_.evaluate_trial(run.mu, 1.0, length, {});
  }
  [[nodiscard]] Trial improve(const Trial& moved) const {
    if (!moved.usable || owner.has_max()) return moved;
    return owner.outer_.return_to_constraints(from(), run.mu, moved);
  }
};

}  // namespace ipminmax
