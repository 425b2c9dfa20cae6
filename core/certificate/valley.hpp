#pragma once

#include <optional>
#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/point/merit.hpp"

namespace ipminmax {

/// Directions without curvature beyond the margin.
struct Valley {
  enum class Verdict : std::uint8_t {
    Flat,  ///< the value stays the same along all of them, over lengths up to a tenth of the point
    Neither,  ///< it changes, or the model could not be followed along them
    None      ///< there are none
  };
  Verdict verdict = Verdict::None;
  /// The first that is not flat, or the first of all; a step of canonical variables.
  Eigen::VectorXd direction;
  /// A step of Min along which the value falls clearly, although curvature does not say so; only
  /// where there is no y.
  std::optional<Eigen::VectorXd> descent{};
  bool complete = false;  ///< all directions were found
};

/// Curvature, over the margin, of a direction that may be flat.
inline constexpr double kFlatTimes = 10.0;

/// At a point that is not refuted, with no doubtful bounds. inner: of Max at this x, else of Min
/// with y answering. tolerance: curvature up to which a direction counts, in units. At most six
/// directions, orthogonal, are found by inverse iteration with the matrix helped by margin.
[[nodiscard]] Valley explore_valley(CanonicalProblem& canonical, ActiveSetSystem& system,
                                    const Point& point, double margin, double tolerance,
                                    bool inner);

}  // namespace ipminmax
