#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/method/parameters.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// The filter of Waechter and Biegler 2006, section 2.3: pairs (theta, phi) that later points must
/// improve on in one of the two. Constants are the paper's, names too.
class Filter {
 public:
  enum class Verdict : unsigned char {
    Reject,     ///< no sufficient progress from the point left
    Dominated,  ///< progress from the point left, but a pair of the filter is better
    Armijo,     ///< a step on phi: sufficient decrease of phi, the filter stays as it is
    Sufficient  ///< theta or phi decreased enough; the point left is added to the filter
  };

  [[nodiscard]] static bool accepted(Verdict verdict) { return verdict >= Verdict::Armijo; }

  /// Forgets all pairs. The first violation of a solve fixes theta_min and theta_max.
  void reset() { entries_.clear(); }
  void set_scale(double first_theta);
  /// From now on, as in Ipopt, no step is accepted that raises phi by orders of magnitude, however
  /// theta falls, and a step that phi falls by enters no pair above theta_min either.
  void minimize() { minimizes_ = true; }
  /// As a new filter, with room for that many pairs; its scale is to be set.
  void begin_anew(std::size_t pairs) {
    reset();
    entries_.reserve(pairs);
    minimizes_ = false;
  }

  /// Whether a step of length alpha from one point to another is acceptable; slope is the
  /// directional derivative of phi.
  [[nodiscard]] Verdict test(const Merit& from, double slope, double alpha, const Merit& to) const;

  /// The largest phi that test would accept of a point with this theta.
  [[nodiscard]] double largest_acceptable(const Merit& from, double slope, double alpha,
                                          double theta) const;

  /// Records the point that was left by an accepted step.
  void add(const Merit& from);

  /// Not dominated by a pair of the filter and not above theta_max.
  [[nodiscard]] bool acceptable(const Merit& merit) const;

  /// Step length below which the search gives up (eq. (23)).
  [[nodiscard]] double smallest_step(const Merit& from, double slope) const;

 private:
  struct Entry {
    double theta, phi;
  };
  /// Whether phi falls so fast along the step that theta need not.
  [[nodiscard]] static bool switches(const Merit& from, double slope, double alpha);
  /// Whether the step is one on phi alone.
  [[nodiscard]] bool is_armijo(const Merit& from, double slope, double alpha) const;
  /// By which phi may rise.
  [[nodiscard]] double most_increase(const Merit& from) const;
  /// The change of phi that such a step to a point with this theta has to make, eq. (18) or (20);
  /// none: theta falls enough.
  [[nodiscard]] static std::optional<double> demanded(bool armijo, const Merit& from, double slope,
                                                      double alpha, double theta);

  std::vector<Entry> entries_;
  double theta_min_ = parameters::filter::kThetaMin;
  double theta_max_ = parameters::filter::kThetaMax;
  bool minimizes_ = false;
};

}  // namespace ipminmax
