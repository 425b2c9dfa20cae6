#pragma once

#include "core/method/parameters.hpp"
#include "core/result.hpp"

/// The numbers of the second-order test that are no options, each with what it decides. What the
/// parts change that they belong to: bench/README.md; bench/constants.sh varies each of them.
namespace ipminmax::parameters::certificate {

// --- Shares and roundings that several parts have in common --------------------------------------

using parameters::kHardly;           ///< of something: none, where rounding is not all there is
using parameters::kLittle;           ///< of something: little beside it
using parameters::kSmall;            ///< of something: a residual or change that ends iterations
constexpr double kConfirmed = 0.5;   ///< of something: a change that leaves it what it is
constexpr double kTrace = 1e-3;      ///< of something: still named, or kept above zero
constexpr double kRounding = 1e-13;  ///< of a variable, value or multiplier, relative
constexpr double kConstant = 1e-12;  ///< change of a value, relative, of one that is constant
constexpr double kZero = 1e-9;       ///< entries of directions and gradients in units that are none
constexpr double kRelaxation = 1e-10;  ///< of rows of length one whose gradients may depend
constexpr double kRigid = 1e20;        ///< curvature of a slack whose inequality is an equation

/// Caps of loops that mostly end before: where each turn costs factorizations, an evaluation of the
/// model, a solve. Trials that have to agree.
constexpr int kFew = 4, kSeveral = 6, kMany = 16, kEnough = 3;

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
constexpr double kProbe = 1e-8;           ///< least distance over which W is compared, relative
constexpr double kErrorOfStep = 1e-4;     ///< of a Newton step, relative
constexpr double kStepIsRounding = 1e-5;  ///< over the distance over which W is compared
/// Change of the active gradients over a step times what the matrices amplify, up to which these
/// are nonsingular all along it.
constexpr double kTurn = 0.25;
constexpr double kResiduals = 10.0;   ///< of a gradient, that its multipliers may be off by
constexpr double kIndependent = 1e5;  ///< amplification by matrices with independent gradients
constexpr Index kToConfirm = 3;       ///< factorizations of a step and the test at its end
/// Contraction of more than kFew steps of small systems, to a zero of high order; 1/2 belongs to
/// weakly active bounds.
constexpr double kCreeping = 0.4;

// --- How far a solution may be from the point ----------------------------------------------------

constexpr double kInTols = 100.0;  ///< a step or margin that belongs to a tolerance, over that
constexpr double kLeastFar = 1e-6, kMostFar = 1e-4;  ///< within these
constexpr double kNear = 1e-3;           ///< over the problem's size: one that is not returned
constexpr double kLargeGradient = 1e-4;  ///< in the model's units: its point is not where it says

// --- Directions ----------------------------------------------------------------------------------

constexpr double kProximal = 1e-4;     ///< curvature taken from Max where his answers are many
constexpr double kClearlyWrong = 2.0;  ///< curvature over error and margin
constexpr double kGrowth = 16.0;       ///< of the shift
constexpr double kShorter = 0.25;
/// Residual at the end of an arc where it has to be stationary, of the length.
constexpr double kSmallStationary = 1e-8;

// --- Gradients that depend on each other, cones, robust rows -------------------------------------

/// Of combinations that are looked for, each of which costs two substitutions: vertices of linear
/// programs have many.
constexpr Index kDependentEntries = 200000;
constexpr double kDependent = 1e-7;  ///< a combination of rows of length one that is zero
/// The same after kFew steps of inverse iteration that is none: 3 times the square root of
/// kRelaxation.
constexpr double kClearlyIndependent = 3e-5;
constexpr double kNothingLeft = 1e-4;  ///< of a vector in the null space: no more is there
constexpr Index kMostFaces = 10;       ///< rows of a matrix whose faces are all looked at
constexpr double kFirm = 1e6;          ///< growth of barrier curvatures that hold bounds

// --- W beside differences of gradients -----------------------------------------------------------

/// Longest entry of the step, in units, and its growth with the point's size.
constexpr double kStep = 1e-6, kStepOfSize = 1e-8;
constexpr double kLeastError = 1e-5,
                 kLargestError = 1e-3;  ///< of W in units, that count

}  // namespace ipminmax::parameters::certificate
