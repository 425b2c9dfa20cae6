#include <algorithm>
#include <cmath>

#include "core/method/filter.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

namespace filter = parameters::filter;

/// a <= b up to the rounding of values of the given size.
bool at_most(double a, double b, double size) {
  return a - b <= filter::kRounding * kEpsilon * std::abs(size);
}

}  // namespace

void Filter::set_scale(double first_theta) {
  theta_min_ = filter::kThetaMin * std::max(1.0, first_theta);
  theta_max_ = filter::kThetaMax * std::max(1.0, first_theta);
}

bool Filter::switches(const Merit& from, double slope, double alpha) {
  // Eq. (19).
  return slope < 0.0 &&
         alpha * std::pow(-slope, filter::kPhiPower) > std::pow(from.theta, filter::kThetaPower);
}

Filter::Verdict Filter::test(const Merit& from, double slope, double alpha, const Merit& to) const {
  if (!std::isfinite(to.phi) || !std::isfinite(to.theta)) return Verdict::Reject;
  const double most_increase = filter::kMostIncrease * std::max(10.0, std::abs(from.phi));
  if (minimizes_ && to.phi - from.phi > most_increase) return Verdict::Reject;
  const bool phi_falls = at_most(to.phi - from.phi, filter::kGammaPhi * alpha * slope, from.phi);
  const bool on_phi = switches(from, slope, alpha);
  const bool armijo = from.theta <= theta_min_ && on_phi;
  // Eq. (20), else eq. (18).
  const bool progress =
      armijo ? phi_falls
             : at_most(to.theta, (1.0 - filter::kGammaTheta) * from.theta, from.theta) ||
                   at_most(to.phi - from.phi, -filter::kGammaPhi * from.theta, from.phi);
  if (!progress || !acceptable(to)) return Verdict::Reject;
  // [WB, eq. (22)]: whatever theta_min, the filter is left alone where (19) and (20) hold.
  return armijo || (minimizes_ && on_phi && phi_falls) ? Verdict::Armijo : Verdict::Sufficient;
}

bool Filter::acceptable(const Merit& merit) const {
  if (merit.theta > theta_max_) return false;
  return std::all_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return at_most(merit.theta, entry.theta, entry.theta) ||
           at_most(merit.phi, entry.phi, entry.phi);
  });
}

void Filter::add(const Merit& from) {
  const Entry entry{(1.0 - filter::kGammaTheta) * from.theta,
                    from.phi - filter::kGammaPhi * from.theta};
  std::erase_if(entries_, [&](const Entry& other) {
    return other.theta >= entry.theta && other.phi >= entry.phi;
  });
  entries_.push_back(entry);
}

double Filter::smallest_step(const Merit& from, double slope) const {
  if (slope >= 0.0) return filter::kGammaAlpha * filter::kGammaTheta;
  double alpha = std::min(filter::kGammaTheta, filter::kGammaPhi * from.theta / -slope);
  if (from.theta <= theta_min_) {
    alpha = std::min(
        alpha, std::pow(from.theta, filter::kThetaPower) / std::pow(-slope, filter::kPhiPower));
  }
  return filter::kGammaAlpha * alpha;
}

}  // namespace ipminmax
