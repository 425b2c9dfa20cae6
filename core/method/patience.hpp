#pragma once

#include <optional>
#include <string_view>

#include "core/method/setbacks.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/merit.hpp"

namespace ipminmax {

/// How long a search goes on without success.
class Patience {
 public:
  struct Limits {
    Index setbacks = 0;
    Index setbacks_when_long = 0;  ///< and in a long search
    Index long_search = 0;         ///< iterations of one
  };
  /// Of the search from the model's start, and of those after it.
  [[nodiscard]] static Limits first(const CanonicalProblem& canonical);
  [[nodiscard]] static Limits begun_anew(const CanonicalProblem& canonical);

  /// Why a search is given up.
  struct End {
    Status status;
    std::string_view message;
  };

  explicit Patience(const Limits& limits) : limits_(limits) {}

  void count_step() { ++steps_; }
  void count_joint_step() { ++joint_steps_; }
  /// Merits of another barrier parameter do not compare.
  void barrier_changed();

  [[nodiscard]] std::optional<End> set_back(Setback kind);
  /// No inner maximum was found; y_ran_away: because y did.
  [[nodiscard]] std::optional<End> inner_phase_failed(bool y_ran_away);
  /// A setback where the value found is on another branch than its estimate.
  [[nodiscard]] std::optional<End> check_branch(double estimate, double found);
  /// A setback where neither violation nor value has improved for some steps.
  [[nodiscard]] std::optional<End> check_progress(const Merit& now);
  [[nodiscard]] const Setbacks& setbacks() const { return setbacks_; }

 private:
  Limits limits_;
  Setbacks setbacks_;
  Index steps_ = 0, joint_steps_ = 0;
  Index inner_unbounded_ = 0;  ///< inner phases in which y ran away
  Merit best_{1e300, 1e300};   ///< least violation and value at this mu
  Index stale_steps_ = 0;      ///< in a row that improved neither
};

}  // namespace ipminmax
