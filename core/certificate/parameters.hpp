#pragma once

#include "core/model/parameters.hpp"
#include "core/result.hpp"

/// The numbers of the second-order test that are no options, each with what it decides. What the
/// parts change that they belong to: bench/README.md; bench/constants.sh varies each of them.
namespace ipminmax::parameters::certificate {

using namespace parameters;  // those of all rooms

// --- Shares and roundings that several parts have in common --------------------------------------

constexpr double kConfirmed = 0.5;  ///< of something: a change that leaves it what it is
/// Square root of rounding: a residual, and relative distances over which W is compared.
constexpr double kRootOfRounding = 1e-8;
constexpr double kRelaxation = 1e-10;  ///< of rows of length one whose gradients may depend
constexpr double kRigid = 1e20;        ///< curvature of a slack whose inequality is an equation

// --- Which bounds are active ---------------------------------------------------------------------

constexpr double kStrictRatio = 100.0;  ///< z / s in units, or s / z, that is no doubt
constexpr double kClearTrend = 0.75;    ///< share of what s or z loses with mu that is no doubt
constexpr double kDecrease = 0.05;      ///< of mu
constexpr int kMostDecreases = 8, kMostBarrierSteps = 24;
constexpr double kTau = 0.995;  ///< fraction to the boundary

// --- The Newton step to the solution -------------------------------------------------------------

/// Second step with the same matrix over the first, up to which Newton's method converges: 1/4 for
/// x^3 at 0, quadratic convergence is near below it.
constexpr double kContraction = 0.1;
constexpr double kShareOfWay = 0.99;      ///< to an active bound: models may be undefined on it
constexpr double kStepIsRounding = 1e-5;  ///< over the distance over which W is compared
/// Change of the active gradients over a step times what the matrices amplify, up to which these
/// are nonsingular all along it.
constexpr double kTurn = 0.25;
constexpr double kResiduals = 10.0;   ///< of a gradient, that its multipliers may be off by
constexpr double kIndependent = 1e5;  ///< amplification by matrices with independent gradients
constexpr Index kToConfirm = 3;       ///< factorizations of a step and the test at its end

// --- How far a solution may be from the point ----------------------------------------------------

constexpr double kInTols = 100.0;  ///< a step or margin that belongs to a tolerance, over that
constexpr double kLeastFar = 1e-6, kMostFar = 1e-4;  ///< within these

// --- Directions ----------------------------------------------------------------------------------

constexpr double kClearlyWrong = 2.0;  ///< curvature over error and margin
constexpr double kGrowth = 16.0;       ///< of the shift
constexpr double kShorter = 0.25;

// --- Gradients that depend on each other, cones, robust rows -------------------------------------

/// Of combinations that are looked for, each of which costs two substitutions: vertices of linear
/// programs have many.
constexpr Index kDependentEntries = 200000;
constexpr double kDependent = 1e-7;  ///< a combination of rows of length one that is zero
/// The same after kFew steps of inverse iteration that is none: 3 times the square root of
/// kRelaxation.
constexpr double kClearlyIndependent = 3e-5;
constexpr double kFirm = 1e6;  ///< growth of barrier curvatures that hold bounds

// --- W beside differences of gradients -----------------------------------------------------------

constexpr double kLeastError = 1e-5,
                 kLargestError = 1e-3;  ///< of W in units, that count

}  // namespace ipminmax::parameters::certificate
