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

bool Filter::is_armijo(const Merit& from, double slope, double alpha) const {
  return from.theta <= theta_min_ && switches(from, slope, alpha);
}

std::optional<double> Filter::demanded(bool armijo, const Merit& from, double slope, double alpha,
                                       double theta) {
  if (armijo) return filter::kGammaPhi * alpha * slope;
  const bool theta_falls = at_most(theta, (1.0 - filter::kGammaTheta) * from.theta, from.theta);
  return theta_falls ? std::nullopt : std::optional(-filter::kGammaPhi * from.theta);
}

double Filter::most_increase(const Merit& from) const {
  if (!minimizes_) return kInfinity;
  return filter::kMostIncrease * std::max(10.0, std::abs(from.phi));
}

Filter::Verdict Filter::test(const Merit& from, double slope, double alpha, const Merit& to) const {
  if (!std::isfinite(to.phi) || !std::isfinite(to.theta)) return Verdict::Reject;
  if (to.phi - from.phi > most_increase(from)) return Verdict::Reject;
  const bool armijo = is_armijo(from, slope, alpha);
  const auto change = demanded(armijo, from, slope, alpha, to.theta);
  if (change && !at_most(to.phi - from.phi, *change, from.phi)) return Verdict::Reject;
  if (!acceptable(to)) return Verdict::Dominated;
  // [WB, eq. (22)]: whatever theta_min, the filter is left alone where (19) and (20) hold.
  const bool falls = minimizes_ && switches(from, slope, alpha) &&
                     at_most(to.phi - from.phi, filter::kGammaPhi * alpha * slope, from.phi);
  return falls || armijo ? Verdict::Armijo : Verdict::Sufficient;
}

double Filter::largest_acceptable(const Merit& from, double slope, double alpha,
                                  double theta) const {
  if (!(theta <= theta_max_)) return -kInfinity;
  const auto forgiving = [](double phi, double size) {
    return phi + filter::kRounding * kEpsilon * std::abs(size);
  };
  const auto change = demanded(is_armijo(from, slope, alpha), from, slope, alpha, theta);
  double largest =
      change ? forgiving(from.phi + *change, from.phi) : from.phi + most_increase(from);
  for (const Entry& entry : entries_) {
    if (!at_most(theta, entry.theta, entry.theta)) {
      largest = std::min(largest, forgiving(entry.phi, entry.phi));
    }
  }
  return largest;
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
