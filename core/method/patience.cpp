#include "core/method/patience.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/method/parameters.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

constexpr std::array<std::string_view, 5> kTexts = {
    "no maximum over y was found", "another y became the higher maximum", "x moved to and fro",
    "the constraints were not met", "no step was acceptable"};
/// Min variables that are shown.
constexpr Index kShown = 3;

}  // namespace

Index Setbacks::total() const { return std::accumulate(counts_.begin(), counts_.end(), Index{0}); }

std::string Setbacks::describe(const CanonicalProblem& canonical, const Eigen::VectorXd& v) const {
  std::string text;
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    if (counts_[k] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(kTexts[k]) + " (" +
            std::to_string(counts_[k]) + (counts_[k] == 1 ? " time)" : " times)");
  }
  const IndexRange x = canonical.x();
  for (Index i = x.begin; i < std::min(x.end, x.begin + kShown); ++i) {
    text += (i == x.begin ? ", last at " : ", ") + canonical.column_name(i) + " = " +
            number_text(v[i] / canonical.variable_scale(i), 4);
  }
  return text + (x.size() > kShown ? ", ..." : "");
}

Patience::Patience(Index variables, Index rows)
    : allowed_(parameters::kFewestSetbacks +
               (rows > parameters::kSmallSystem ? 0 : variables / parameters::kPatience)) {}

void Patience::barrier_changed() {
  best_ = {kInfinity, kInfinity};
  stale_steps_ = 0;
}

std::optional<Patience::End> Patience::set_back(Setback kind) {
  setbacks_.add(kind);
  if (setbacks_.total() <= allowed_) return std::nullopt;
  if (2 * inner_unbounded_ > setbacks_.total()) {
    return End{Status::InnerUnbounded, "the maximization over y looks unbounded"};
  }
  return End{
      Status::NoLocalMinmaxFound,
      "the maximum over y disappears or jumps near here, so max over y of f may have a kink"};
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
