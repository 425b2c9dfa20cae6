#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "core/model/canonical_problem.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// What keeps a search for a local minmax from going on.
enum class Setback : std::uint8_t {
  NoMaximum,    ///< no maximum over y in reach of the inner phase
  OtherBranch,  ///< the maximization ended on a higher branch than the one descended on
  NoProgress,   ///< to and fro between branches, or nearly level ground
  Infeasible,   ///< a restoration was needed
  NoStep        ///< no step was acceptable
};

/// How often each was met.
class Setbacks {
 public:
  void add(Setback kind) { ++counts_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] Index total() const;
  /// "no maximum over y was found (3 times), ...", those met, with the Min variables of the last.
  [[nodiscard]] std::string describe(const CanonicalProblem& canonical,
                                     const Eigen::VectorXd& v) const;

 private:
  std::array<Index, 5> counts_{};
};

/// How long a search goes on without success.
class Patience {
 public:
  /// rows: of K.
  Patience(Index variables, Index rows);

  /// Why a search is given up.
  struct End {
    Status status;
    std::string_view message;
  };

  /// Merits of another barrier parameter do not compare.
  void barrier_changed();

  [[nodiscard]] std::optional<End> set_back(Setback kind);
  /// No inner maximum was found; y_ran_away: because y did.
  [[nodiscard]] std::optional<End> inner_phase_failed(bool y_ran_away);
  /// A value found above its estimate is another branch's: the name of the next lack of progress.
  void watch_branch(double estimate, double found);
  /// A setback where neither violation nor value has improved for some steps.
  [[nodiscard]] std::optional<End> check_progress(const Merit& now);
  [[nodiscard]] const Setbacks& setbacks() const { return setbacks_; }

 private:
  Index allowed_;
  Setbacks setbacks_;
  Index inner_unbounded_ = 0;  ///< inner phases in which y ran away
  Merit best_{1e300, 1e300};   ///< least violation and value at this mu
  Index stale_steps_ = 0;      ///< in a row that improved neither
  bool jumped_ = false;        ///< to another branch since the last progress
};

}  // namespace ipminmax
