#include <algorithm>
#include <cmath>
#include <utility>

#include "core/method/parameters.hpp"
#include "core/method/patience.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace patience = parameters::patience;

Patience::Patience(Index variables, Index rows)
    : allowed_(patience::kFewestSetbacks +
               (rows > parameters::kSmallSystem ? 0 : variables / parameters::kPatience)) {}

void Patience::barrier_changed() {
  best_ = {kInfinity, kInfinity};
  stale_steps_ = 0;
}

std::optional<Patience::End> Patience::set_back(Setback kind) {
  setbacks_.add(kind);
  if (setbacks_.total() <= allowed_) return std::nullopt;
  if (2 * inner_unbounded_ > setbacks_.total()) {
    return End{Status::InnerUnbounded, "the maximization over the Max variables looks unbounded"};
  }
  return End{Status::NoLocalMinmaxFound,
             "the branches of inner maxima followed from here end or meet in a kink"};
}

std::optional<Patience::End> Patience::inner_phase_failed(bool y_ran_away) {
  inner_unbounded_ += y_ran_away ? 1 : 0;
  return set_back(Setback::NoMaximum);
}

void Patience::watch_branch(double estimate, double found) {
  jumped_ = jumped_ || found > estimate + parameters::kSlight * (1.0 + std::abs(found));
}

std::optional<Patience::End> Patience::check_progress(const Merit& now) {
  // To and fro over a kink of phi, where neither branch leads on.
  const bool better = now.theta < parameters::kProgress * best_.theta ||
                      now.phi < best_.phi - parameters::kSlight * (1.0 + std::abs(best_.phi));
  if (better) {
    best_.theta = std::min(best_.theta, now.theta);
    best_.phi = std::min(best_.phi, now.phi);
    jumped_ = false;
    stale_steps_ = 0;
    return std::nullopt;
  }
  if (++stale_steps_ < parameters::kEnough) return std::nullopt;
  stale_steps_ = 0;
  return set_back(std::exchange(jumped_, false) ? Setback::OtherBranch : Setback::NoProgress);
}

}  // namespace ipminmax
