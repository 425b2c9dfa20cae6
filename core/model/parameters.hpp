#pragma once

/// Shares, counts and roundings that the rooms have in common, each of which says no more than its
/// name: those of the method and the certificate were changed to a tenth and ten times one by one,
/// and few verdicts depend on them (bench/README.md). What has a symbol or a source of its own
/// stands in parameters.hpp of its room, or beside its use.
namespace ipminmax::parameters {

// Shares of something, and lengths or changes over the size of what they are of.
constexpr double kLittle = 0.1;      ///< little beside it; a safety factor
constexpr double kHardly = 1e-6;     ///< none, where rounding is not all there is
constexpr double kZero = 1e-9;       ///< none: rounding of long sums
constexpr double kConstant = 1e-12;  ///< a change of what is constant
constexpr double kRounding = 1e-13;  ///< of a variable, value or multiplier
constexpr double kVanished =
    1e-100;  ///< whatever the scale; its logarithm and inverse are harmless

/// Of a residual or violation, or of the way to a bound: what leaves more is no progress.
constexpr double kProgress = 0.9;
constexpr double kRunaway = 1e10;  ///< over the size that was expected: it grows without bound

constexpr int kHalvings = 60;  ///< of a step to where the model is defined, to rounding
constexpr int kRoom = 1000;    ///< of lists that grow with the iterations, set aside at once

}  // namespace ipminmax::parameters
