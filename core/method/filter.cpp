#include <algorithm>
#include <cmath>
#include <limits>

#include "core/method/filter.hpp"

namespace ipminmax {
namespace {

constexpr double kGammaTheta = 1e-5;
constexpr double kGammaPhi = 1e-8;
constexpr double kDelta = 1.0;
constexpr double kThetaPower = 1.1;  // s_theta
constexpr double kPhiPower = 2.3;    // s_phi
constexpr double kEtaPhi = 1e-8;
constexpr double kGammaAlpha = 0.05;

/// a <= b up to the rounding of values of the given size.
bool at_most(double a, double b, double size) {
  return a - b <= 10.0 * std::numeric_limits<double>::epsilon() * std::abs(size);
}

}  // namespace

void Filter::set_scale(double first_theta) {
  theta_min_ = 1e-4 * std::max(1.0, first_theta);
  theta_max_ = 1e4 * std::max(1.0, first_theta);
}

bool Filter::is_phi_step(double theta, double slope, double alpha) const {
  // Switching condition, eq. (19).
  return slope < 0.0 && alpha * std::pow(-slope, kPhiPower) > kDelta * std::pow(theta, kThetaPower);
}

Filter::Verdict Filter::test(const Merit& from, double slope, double alpha, const Merit& to) const {
  if (!std::isfinite(to.phi) || !std::isfinite(to.theta)) return Verdict::Reject;
  const auto unless_dominated = [&](Verdict verdict) {
    return acceptable(to) ? verdict : Verdict::Dominated;
  };
  if (from.theta <= theta_min_ && is_phi_step(from.theta, slope, alpha)) {
    const bool armijo = at_most(to.phi - from.phi, kEtaPhi * alpha * slope, from.phi);
    return armijo ? unless_dominated(Verdict::Armijo) : Verdict::Reject;
  }
  const bool theta_falls = at_most(to.theta, (1.0 - kGammaTheta) * from.theta, from.theta);
  const bool phi_falls = at_most(to.phi - from.phi, -kGammaPhi * from.theta, from.phi);
  return theta_falls || phi_falls ? unless_dominated(Verdict::Sufficient) : Verdict::Reject;
}

bool Filter::acceptable(const Merit& merit) const {
  if (merit.theta > theta_max_) return false;
  return std::all_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return at_most(merit.theta, entry.theta, entry.theta) ||
           at_most(merit.phi, entry.phi, entry.phi);
  });
}

void Filter::add(const Merit& from) {
  const Entry entry{(1.0 - kGammaTheta) * from.theta, from.phi - kGammaPhi * from.theta};
  std::erase_if(entries_, [&](const Entry& other) {
    return other.theta >= entry.theta && other.phi >= entry.phi;
  });
  entries_.push_back(entry);
}

double Filter::smallest_step(const Merit& from, double slope) const {
  if (slope >= 0.0) return kGammaAlpha * kGammaTheta;
  double alpha = std::min(kGammaTheta, kGammaPhi * from.theta / -slope);
  if (from.theta <= theta_min_) {
    alpha =
        std::min(alpha, kDelta * std::pow(from.theta, kThetaPower) / std::pow(-slope, kPhiPower));
  }
  return kGammaAlpha * alpha;
}

}  // namespace ipminmax
