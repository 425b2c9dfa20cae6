#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

#include "core/model/canonical_problem.hpp"

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
  /// "no maximum over y in reach (3 times), ...", those met, with the Min variables of the last.
  [[nodiscard]] std::string describe(const CanonicalProblem& canonical,
                                     const Eigen::VectorXd& v) const;

 private:
  std::array<Index, 5> counts_{};
};

}  // namespace ipminmax
