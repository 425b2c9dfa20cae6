#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include "core/method/parameters.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Signs that a search for a local minmax does not go on.
enum class StallSign : std::uint8_t {
  NoMaximum,    ///< no maximum over y in reach of the inner phase
  OtherBranch,  ///< the maximization ended on a higher branch than the one descended on
  NoProgress,   ///< to and fro between branches, or nearly level ground
  Infeasible,   ///< a restoration was needed
  NoStep        ///< no step was acceptable
};

/// Decides how long a search goes on without success.
class StallDetection {
  static constexpr double kClearly = 1e-4;        ///< over 1 + |phi|
  static constexpr Index kVariablesPerSign = 10;  ///< each allows one more

 public:
  /// rows: of K.
  StallDetection(Index variables, Index rows)
      : allowed_(parameters::kFewestStallSigns +
                 (rows > parameters::kSmallSystem ? 0 : variables / kVariablesPerSign)) {}
  /// Why a search is given up.
  struct End {
    Status status;
    std::string_view message;
  };

  /// Merits of another barrier parameter do not compare.
  void barrier_changed() {
    best_ = {kInfinity, kInfinity};
    stale_steps_ = 0;
  }

  [[nodiscard]] std::optional<End> count(StallSign kind) {
    ++counts_[static_cast<std::size_t>(kind)];
    const Index signs = std::accumulate(counts_.begin(), counts_.end(), Index{0});
    if (signs <= allowed_) return std::nullopt;
    if (2 * inner_unbounded_ > signs) {
      return End{Status::InnerUnbounded, "the maximization over y looks unbounded"};
    }
    return End{
        Status::NoLocalMinmaxFound,
        "the maximum over y disappears or jumps near here, so max over y of f may have a kink"};
  }

  /// No inner maximum was found; y_ran_away: because y did.
  [[nodiscard]] std::optional<End> inner_phase_failed(bool y_ran_away) {
    inner_unbounded_ += y_ran_away ? 1 : 0;
    return count(StallSign::NoMaximum);
  }

  /// A value found above its estimate is another branch's: the name of the next lack of progress.
  void watch_branch(double estimate, double found) {
    jumped_ = jumped_ || found > estimate + kClearly * (1.0 + std::abs(found));
  }

  /// A sign where neither violation nor value has improved for some steps.
  [[nodiscard]] std::optional<End> check_progress(const Merit& now) {
    // To and fro over a kink of phi, where neither branch leads on.
    const bool better = now.theta < parameters::kProgress * best_.theta ||
                        now.phi < best_.phi - kClearly * (1.0 + std::abs(best_.phi));
    if (better) {
      best_.theta = std::min(best_.theta, now.theta);
      best_.phi = std::min(best_.phi, now.phi);
      jumped_ = false;
      stale_steps_ = 0;
      return std::nullopt;
    }
    constexpr int kStaleSteps = 3;
    if (++stale_steps_ < kStaleSteps) return std::nullopt;
    stale_steps_ = 0;
    return count(std::exchange(jumped_, false) ? StallSign::OtherBranch : StallSign::NoProgress);
  }

  /// "no maximum over y was found (3 times), ...", with the Min variables of the last sign.
  [[nodiscard]] std::string describe_signs(const CanonicalProblem& canonical,
                                           const Eigen::VectorXd& v) const {
    constexpr std::array<std::string_view, 5> kTexts = {
        "no maximum over y was found", "another y became the higher maximum", "x moved to and fro",
        "the constraints were not met", "no step was acceptable"};
    constexpr Index kShown = 3;  // Min variables
    std::string text;
    for (const auto k : indices(counts_)) {
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

 private:
  Index allowed_;
  std::array<Index, 5> counts_{};  ///< of the signs, by kind
  Index inner_unbounded_ = 0;      ///< inner phases in which y ran away
  Merit best_{1e300, 1e300};       ///< least violation and value at this mu
  Index stale_steps_ = 0;          ///< in a row that improved neither
  bool jumped_ = false;            ///< to another branch since the last progress
};

}  // namespace ipminmax
