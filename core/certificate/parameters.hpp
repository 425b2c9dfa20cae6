#pragma once

#include "core/model/parameters.hpp"
#include "core/result.hpp"

/// Numbers of the second-order test that are not options, each with what it decides.
/// bench/constants.sh varies each of them; bench/README.md has the results.
namespace ipminmax::parameters::certificate {

using namespace parameters;  // those of all rooms

// --- Shares and roundings that several parts have in common --------------------------------------

constexpr double kSafety = 0.1;       ///< factor of what is known, for what may be unknown
constexpr double kMinorShare = 0.1;   ///< of a term, change or gain: less does not matter beside it
constexpr double kShareOfRoom = 0.1;  ///< of the distance to a bound, for steps that test
constexpr double kShareOfSize = 0.1;  ///< of the problem's size: the longest step that tests
constexpr double kNegligible = 1e-6;  ///< over curvature, slope, value or gain: none
constexpr double kNearby = 1e-6;      ///< of the size: distance of a point that counts as near
constexpr double kConfirmed = 0.5;    ///< share of a value: a smaller change leaves it what it is
/// Square root of rounding: limit of a residual; relative distance over which W is compared.
constexpr double kRootOfRounding = 1e-8;
/// Shift of the rows of multipliers, of length one, whose gradients may depend on each other.
constexpr double kDualShift = 1e-10;
constexpr double kRigid = 1e20;  ///< curvature of a slack whose inequality is an equation

// --- Which bounds are active ---------------------------------------------------------------------

/// A bound is clearly active, or inactive, if z / s, or s / z, exceeds this (scaled).
constexpr double kStrictRatio = 100.0;
/// Share of the decrease of mu that s or z must follow to be clear.
constexpr double kClearTrend = 0.75;
constexpr double kDecrease = 0.05;  ///< factor of mu on the path
constexpr int kMostDecreases = 8, kMostBarrierSteps = 24;
constexpr double kTau = 0.995;  ///< fraction to the boundary

// --- The Newton step to the solution -------------------------------------------------------------

/// Largest ratio of the simplified Newton step to the step tried at which Newton's method counts as
/// converging. For x^3 at 0 it is 1/4; below it quadratic convergence is near.
constexpr double kContraction = 0.1;
/// Share of the way to an active bound that a step goes: models may be undefined on it.
constexpr double kShareOfWay = 0.99;
constexpr double kStepIsRounding = 1e-5;  ///< a step below this share of the step tried is rounding
/// Largest product of Jacobian variation and inverse-norm estimate at which the matrices stay
/// nonsingular along a step.
constexpr double kMostVariation = 0.25;
/// Error of multipliers, in residuals of the gradient that they balance.
constexpr double kResiduals = 10.0;
constexpr double kIndependent = 1e5;  ///< largest inverse-norm estimate with independent gradients
constexpr Index kToConfirm = 3;       ///< factorizations for a Newton step and the test at its end

// --- How far a solution may be from the point ----------------------------------------------------

constexpr double kInTols = 100.0;  ///< a step or margin over the tolerance that it belongs to
/// Limits of a relative distance that moves the point.
constexpr double kLeastFar = 1e-6, kMostFar = 1e-4;

// --- Directions ----------------------------------------------------------------------------------

/// Least wrong curvature of a refutation, over error and margin.
constexpr double kClearlyWrong = 2.0;
constexpr double kGrowth = 16.0;  ///< growth factor of the shift
constexpr double kShorter = 0.25;
constexpr double kUnread = 1e-10;  ///< slope along a step that nothing reads, over its terms

// --- Gradients that depend on each other, cones, robust rows -------------------------------------

/// Work for dependent combinations, each of which costs two substitutions: vertices of linear
/// programs have many.
constexpr Index kDependentEntries = 200000;
/// Largest combination of rows of length one that counts as zero.
constexpr double kDependent = 1e-7;
/// Steps of inverse iteration; after them a larger combination than this is not zero: 3 times the
/// square root of kDualShift.
constexpr int kNullIterations = 4;
constexpr double kClearlyIndependent = 3e-5;
constexpr double kFirm = 1e6;  ///< factor of the barrier curvatures that hold bounds

// --- W beside differences of gradients -----------------------------------------------------------

constexpr double kLeastError = 1e-5,
                 kLargestError = 1e-3;  ///< limits of the relative error of W that counts, scaled

}  // namespace ipminmax::parameters::certificate
