#pragma once

#include <array>
#include <cstddef>

#include "core/result.hpp"

/// The numbers of the method that are no options. Symbols are those of docs/algorithm.md or of the
/// source named: [WB] Waechter and Biegler 2006, [Ipopt] the solver's options of that name, [G] the
/// study of the globalized method on 28 small problems, [R] measurements on random multimodal
/// problems and on problems without a local minmax (tests/problems), [H] the factorizations of
/// bench/horizon.cpp, [eps] rounding.
namespace ipminmax::parameters {

constexpr Index kSmallSystem = 300;  ///< rows of K up to which factors cost less than functions
constexpr int kHalvings = 60;        ///< of a step, to where the model is defined
constexpr Index kRoom = 1000;        ///< of lists that grow with the iterations, set aside at once
/// Shares of something, and what is small in it, that are not critical: a tenth and ten times of
/// them change no verdict (bench/constants.sh).
constexpr double kLittle = 0.1, kSmall = 1e-2, kHardly = 1e-6;

/// The fast path: Newton's method where both inertias are right.
namespace fast {
constexpr double kContraction = 0.9;  ///< kappa_f: of the least |g(z, mu)| of fast steps [G]
constexpr double kGrowth = 1e3;       ///< of it allowed where there are bounds [R]
constexpr int kStepsAboveLeast = 3;   ///< that may follow each other; 5 and 10 are as good [R]
constexpr double kFreezeContraction =
    0.25;  ///< of a full step: K_yy is taken to be right [CYH's freeze, H]
}  // namespace fast

/// The inner phase: ascent in y alone.
namespace inner {
constexpr double kSlopeShare = 0.5;       ///< theta: |q| against the predicted outer decrease [G]
constexpr double kValueShare = 0.1;       ///< t_in: |q| against 1 + |f_b| [R]
constexpr double kBarrierShare = 1e-2;    ///< |q| against mu where Max has bounds [G]
constexpr double kRoundingShare = 1e-14;  ///< of 1 + |f_b|: no gain is asked to be smaller [eps]
constexpr int kSteps = 50;                ///< of one maximization [G]
constexpr int kCorrections = 4;           ///< of a trial point of the minimizer [G]
constexpr double kLongStep =
    10.0;  ///< a longer step of y, over 1 + |y|, is cut; farther out y is away [G]
constexpr int kFarShiftedSteps =
    3;  ///< allowed once y has left its neighbourhood: it runs away [R]
constexpr double kStationary = 1e-3;     ///< E_y over min(1, mu) at which a wrong K_yy is left [G]
constexpr double kShortestStep = 1e-12;  ///< of the search [eps]
}  // namespace inner

/// The outer step: filter line search of the minimizer.
namespace outer {
constexpr int kRoughTrials = 4;      ///< with an inexact inner maximum [G]
constexpr int kExactTrials = 10;     ///< with an exact one [G]
constexpr double kExactGain = 1e-9;  ///< |q| of an exact one [G]
constexpr double kLongStep = 4.0;    ///< the longest step with Max variables, over 1 + |v| [G]
// Second-order correction, p_max and kappa_soc of [WB, 2.4].
constexpr int kSecondOrderSteps = 4;
constexpr double kSecondOrderDecrease = 0.99;
// watchdog_shortened_iter_trigger, watchdog_trial_iter_max, filter_reset_trigger, max_filter_resets
// of [Ipopt].
constexpr Index kShortenedBeforeWatchdog = 10;
constexpr Index kWatchdogTrials = 3;
constexpr Index kDominatedBeforeReset = 5;
constexpr Index kFilterResets = 5;
/// Gradient of the Lagrangian over that of f, 1 at least, from which multipliers of a minimization
/// are renewed.
constexpr double kRunawayDual = 1e10;
}  // namespace outer

/// Steps where no merit function helps.
namespace untested {
constexpr double kLongestJointStep = 10.0;   ///< over 1 + |v| [G]
constexpr Index kSoftSteps = 10;             ///< in a row; max_soft_resto_iters of [Ipopt]
constexpr double kSoftContraction = 0.9999;  ///< soft_resto_pderror_reduction_factor of [Ipopt]
}  // namespace untested

/// Feasibility restoration.
namespace restoration {
constexpr double kDecrease = 0.9;  ///< kappa_resto of [WB, 3.3]
constexpr double kPenalty = 1e3;   ///< rho of [WB, 3.3.1]
/// The proximal term falls with mu, as in [Ipopt], from one solve of the restoration problem to the
/// next, until its pull beside rho is nothing.
constexpr int kRounds = 8;
constexpr double kAlmostFeasible = 1e2;  ///< violation over tol below which nothing is restored [R]
}  // namespace restoration

/// Leaving first-order points along curvature of a wrong sign.
namespace escape {
constexpr int kIterations = 6;             ///< inverse iterations; 4 and 60 find the same
constexpr double kLength = 0.1;            ///< first length tried, over 1 + |v| [G]
constexpr double kBoundaryFraction = 0.9;  ///< tau of these moves
constexpr double kDecrease = 0.5;          ///< of the length
constexpr double kShortest = 1e-6;         ///< length, over the first
constexpr double kLeastGain = 1e-10;       ///< over 1 + |phi| [eps]
constexpr int kConstraintSteps = 8;        ///< back to the constraints
constexpr double kPenalty = 2.0;  ///< over the largest multiplier: an exact penalty of |c|_1
}  // namespace escape

/// When a search is given up, to begin anew elsewhere: cheap where there are few variables, so soon
/// [R]; and soon where factorizations are dear, for what the first setbacks do not lead out of the
/// next ones rarely do (six games by stages at falling prices of the disturbance).
namespace patience {
constexpr Index kFewestSetbacks = 2;
constexpr Index kVariablesPerSetback = 10;
constexpr double kProgress = 0.9;        ///< of the violation
constexpr double kSmallProgress = 1e-4;  ///< of phi, over 1 + |phi|
constexpr Index kStaleSteps = 3;         ///< without progress in either: a setback
}  // namespace patience

/// Algorithm 1.
namespace algorithm_one {
constexpr std::size_t kWatchedResiduals = 10;  ///< minmax_residual_watchdog looks back on
constexpr double kShortestWatchedStep = 1e-3;
}  // namespace algorithm_one

/// The filter, [WB, 2.3]; names there.
namespace filter {
constexpr double kGammaTheta = 1e-5;
constexpr double kGammaPhi = 1e-8;
constexpr double kDelta = 1.0;
constexpr double kThetaPower = 1.1;  ///< s_theta
constexpr double kPhiPower = 2.3;    ///< s_phi
constexpr double kEtaPhi = 1e-8;
constexpr double kGammaAlpha = 0.05;
constexpr double kThetaMin = 1e-4;     ///< theta_min over max(1, first violation)
constexpr double kThetaMax = 1e4;      ///< theta_max over it
constexpr double kRounding = 10.0;     ///< units of rounding that comparisons forgive; [Ipopt]
constexpr double kMostIncrease = 1e5;  ///< of phi over max(10, |phi|), minimizations; [Ipopt]:
                                       ///< Luksan's and Vlcek's 8th: 12 iterations for 51
}  // namespace filter

/// The barrier parameter's oracles, as in [Ipopt]; Nocedal, Waechter, Waltz 2009.
namespace barrier {
constexpr int kMostDecreases = 1000;          ///< of mu at one iterate
constexpr double kLargestSigma = 100.0;       ///< sigma_max
constexpr double kSmallestSigma = 1e-6;       ///< sigma_min
constexpr double kSigmaTolerance = 1e-2;      ///< quality_function_section_sigma_tol
constexpr int kSectionSteps = 8;              ///< quality_function_max_section_steps
constexpr double kFilterMargin = 1e-5;        ///< filter_margin_fact
constexpr double kLargestFilterMargin = 1.0;  ///< filter_max_margin
}  // namespace barrier

/// Divergence of a search, and when it ends elsewhere.
namespace divergence {
constexpr double kRunaway =
    1e10;  ///< size of a variable (scaled), over its bounds' and the start's
constexpr Index kRunawayIterations = 100;  ///< of a minimization beyond that
constexpr double kLargeMultiplier =
    1e6;  ///< of a Max constraint (scaled): Max has no room left [R]
// Growth of |v| by a Newton step, over 1 + |v|, that counts as a run to infinity when that many
// steps in a row pass through first-order points, each of them at least that share of the one
// before: towards a zero of order p they shrink by (p - 1)/p.
constexpr double kOutwardStep = 5e-4;
constexpr int kOutwardSteps = 3;
constexpr double kOutwardShare = 0.95;
constexpr int kStepsIntoValley = 10;  ///< of a minimization at its limit of iterations
// Second derivatives below this, that many times farther out than the start, have died out.
constexpr double kDiedOut = 1e-100;
constexpr double kFarAway = 10.0;
}  // namespace divergence

/// Iterations after a minimization has left a point whose curvature decides nothing, or as many as
/// that took where it is more.
constexpr Index kFewestAfterEscape = 40;

/// What the second-order tests of a solve may cost, in factorizations.
namespace test {
constexpr Index kForSmallSystems = 40;  ///< for each test
constexpr Index kShareOfTests = 5;      ///< elsewhere one for so many others, all tests together
constexpr Index kFewestForTests = 12;   ///< but for each test these: with 8 verdicts are lost
}  // namespace test

/// New starts [R].
namespace restart {
constexpr double kMargin = 1e-2;  ///< share of an interval that stays free at either end
/// Half-widths of the box, over max(1, |v|), without bounds: one after the other, around the start
/// and around zero.
inline constexpr std::array kReaches{3.0, 1.0, 10.0};
constexpr double kWideInterval = 100.0;  ///< reaches; wider bounds are no region of interest
constexpr Index kIterations = 300;       ///< after the first search, after which none begins
constexpr Index kIterationsOfAlgorithmOne = 150;  ///< of one search
/// Steps of a minimization with a shifted Hessian at one mu after which the other mu_strategy is
/// worth more.
constexpr Index kShiftedSteps = 200;
}  // namespace restart

}  // namespace ipminmax::parameters
