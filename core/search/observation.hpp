#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "core/iteration.hpp"
#include "core/method/step_method.hpp"
#include "core/point/point.hpp"
#include "core/search/outcome.hpp"
#include "linalg/numbers.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Tells the caller's observer of the iterations of a solve.
class Observation : MethodContext, Uncopied {
 public:
  /// totals: fills in what a result says of the solve as a whole.
  Observation(const SolveObserver& observer, const MethodContext& context,
              std::function<void(Result&)> totals)
      : MethodContext(context), observer_(observer), totals_(std::move(totals)) {}

  /// Whether anybody listens to iterations.
  [[nodiscard]] bool is_wanted() const { return observer_.on_iteration != nullptr; }
  /// A measured point, mu of the step that led there. False: stop.
  [[nodiscard]] bool tell(const Point& point, double mu, const StepReport& step) {
    point_ = &point;
    mu_ = mu;
    if (!is_wanted()) return true;
    IterationInfo info;
    info.iteration = limit_.iteration;
    info.objective = canonical_.unscaled_objective(point.evaluation.f);
    info.error = point.error;
    info.mu = mu;
    info.barrier_error = measured_barrier_error(canonical_, point, mu).norm();
    info.step_norm = step.step_norm;
    info.delta_x = step.delta_x;
    info.delta_y = step.delta_y;
    info.alpha_dual = step.alpha.dual;
    info.alpha_primal = step.alpha.primal;
    info.step_kind = static_cast<char>(step.kind);
    info.shifts = step.shifts;
    info.trials = step.trials;
    count_factorizations(info);
    info.v = canonical_.model_point(point.iterate.v);
    info.result = [this] { return stopped_at(*point_); };
    info.scaling = [this](UserScaling& factors) { canonical_.write_scaling(factors); };
    return tell(info);
  }

  /// An iteration of a restoration (see RestorationObserver) in a step with parameter mu.
  [[nodiscard]] bool tell_restoration(double mu, const IterationInfo& nested, const Point& from,
                                      const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
    mu_ = mu;
    IterationInfo info = nested;
    info.restoration = true;
    info.iteration = limit_.iteration + 1;
    info.factorizations_full = info.factorizations_inner = 0;
    double f = kNaN;
    if (!canonical_.objective(v, f)) {
      f = kNaN;
    }
    info.objective = canonical_.unscaled_objective(f);
    info.error.primal = 0.0;
    for (Index j = 0; j < canonical_.constraints(); ++j) {
      info.error.primal =
          std::max(info.error.primal, std::abs(c[j]) / canonical_.constraint_scale(j));
    }
    info.v = canonical_.model_point(v);
    info.scaling = [this](UserScaling& factors) { canonical_.write_scaling(factors); };
    info.result = [&] {
      Point here = from;
      here.iterate.v = v;
      evaluate_where_defined(canonical_, here);
      measure(canonical_, options_, here);
      return stopped_at(here);
    };
    return tell(info);
  }

  void say(std::string_view text) {
    if (!observer_.message) return;
    inside_ = true;
    observer_.message(text);
    inside_ = false;
  }

  /// Whether a call of the observer has begun and not ended: an exception on its way is the
  /// caller's.
  [[nodiscard]] bool is_inside() const { return inside_; }

 private:
  [[nodiscard]] bool tell(const IterationInfo& info) {
    inside_ = true;
    const bool goes_on = observer_.on_iteration(info);
    inside_ = false;
    return goes_on;
  }

  void count_factorizations(IterationInfo& info) {
    const Counts& now = counts_;
    info.factorizations_full = now.factorizations_full - told_.factorizations_full;
    info.factorizations_inner = now.factorizations_inner - told_.factorizations_inner;
    info.factorizations_complement =
        now.factorizations_complement - told_.factorizations_complement;
    told_ = now;
  }

  /// What the solve would return at a point.
  [[nodiscard]] Result stopped_at(const Point& point) const {
    Result result;
    result.status = Status::UserStop;
    result.message = std::string(name_of(result.status));
    result.mu = mu_;
    result.iterations = limit_.iteration;
    describe(canonical_, options_, point, result);
    totals_(result);
    return result;
  }

  const SolveObserver& observer_;
  std::function<void(Result&)> totals_;
  const Point* point_ = nullptr;  ///< told last
  double mu_ = 0.0;               ///< of it
  Counts told_;                   ///< when it was
  bool inside_ = false;
};

}  // namespace ipminmax
