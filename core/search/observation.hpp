#pragma once

#include <functional>
#include <string_view>

#include "core/iteration.hpp"
#include "core/method/step_method.hpp"

namespace ipminmax {

/// Tells the caller's observer of the iterations of a solve.
class Observation {
 public:
  /// totals: fills in what a result says of the solve as a whole.
  Observation(const SolveObserver& observer, const MethodContext& context,
              std::function<void(Result&)> totals);
  Observation(const Observation&) = delete;
  Observation& operator=(const Observation&) = delete;

  /// Whether anybody listens to iterations.
  [[nodiscard]] bool is_wanted() const { return observer_.on_iteration != nullptr; }
  /// A measured point, mu of the step that led there. False: stop.
  [[nodiscard]] bool tell(const Point& point, double mu, const StepReport& step);
  /// An iteration of a restoration (see RestorationObserver) in a step with parameter mu.
  [[nodiscard]] bool tell_restoration(double mu, const IterationInfo& nested, const Point& from,
                                      const Eigen::VectorXd& v, const Eigen::VectorXd& c);
  void say(std::string_view text);

  /// Whether a call of the observer has begun and not ended: an exception on its way is the
  /// caller's.
  [[nodiscard]] bool is_inside() const { return inside_; }

 private:
  [[nodiscard]] bool tell(const IterationInfo& info);
  void count_factorizations(IterationInfo& info);
  /// What the solve would return at a point.
  [[nodiscard]] Result stopped_at(const Point& point) const;

  const SolveObserver& observer_;
  MethodContext context_;
  std::function<void(Result&)> totals_;
  const Point* point_ = nullptr;  ///< told last
  double mu_ = 0.0;               ///< of it
  Counts told_;                   ///< when it was
  bool inside_ = false;
};

}  // namespace ipminmax
