#pragma once

#include <array>

#include "core/model/parameters.hpp"
#include "core/result.hpp"

/// The numbers of the method that are no options. Symbols are those of docs/algorithm.md or of the
/// source named: [WB] Waechter and Biegler 2006, [Ipopt] the solver's options of that name, [G] the
/// study of the globalized method on 28 small problems, [R] measurements on random multimodal
/// problems and on problems without a local minmax (tests/problems), [H] the factorizations of
/// bench/horizon.cpp, [eps] rounding.
namespace ipminmax::parameters {

constexpr Index kSmallSystem = 300;  ///< rows of K up to which factors cost less than functions

/// Length of a step over 1 + |v| (of an ascent, |y|) beyond which it is cut or shows that y, or
/// all, runs away [G].
constexpr double kLongStep = 10.0;

/// The fast path: Newton's method where both inertias are right.
namespace fast {
constexpr double kGrowth = 1e3;  ///< of the least |g(z, mu)|, allowed where there are bounds [R]
constexpr double kFreezeContraction =
    0.25;  ///< of a full step: K_yy is taken to be right [CYH's freeze, H]
}  // namespace fast

/// The inner phase: ascent in y alone.
namespace inner {
constexpr double kSlopeShare = 0.5;       ///< theta: |q| against the predicted outer decrease [G]
constexpr double kRoundingShare = 1e-14;  ///< of 1 + |f_b|: no gain is asked to be smaller [eps]
constexpr int kSteps = 50;                ///< of one maximization [G]
}  // namespace inner

/// The outer step: filter line search of the minimizer.
namespace outer {
constexpr double kLongStep = 4.0;  ///< the longest step with Max variables, over 1 + |v| [G]
constexpr double kSecondOrderDecrease = 0.99;  ///< kappa_soc of [WB, 2.4]
constexpr Index kFilterResets = 5;  ///< filter_reset_trigger and max_filter_resets of [Ipopt]
}  // namespace outer

constexpr double kSoftContraction = 0.9999;  ///< soft_resto_pderror_reduction_factor of [Ipopt]

/// Feasibility restoration.
namespace restoration {
constexpr double kPenalty = 1e3;  ///< rho of [WB, 3.3.1]
/// The proximal term falls with mu, as in [Ipopt], from one solve of the restoration problem to the
/// next, until its pull beside rho is nothing.
constexpr int kRounds = 8;
}  // namespace restoration

/// Leaving first-order points along curvature of a wrong sign.
namespace escape {
constexpr double kLeastGain = 1e-10;  ///< over 1 + |phi| [eps]
constexpr int kConstraintSteps = 8;   ///< back to the constraints
}  // namespace escape

/// A search that shows more signs of a stall is given up, to begin anew elsewhere: this is cheap if
/// there are few variables [R]. If factorizations are dear, the search rarely recovers after more
/// signs (six games by stages at falling prices of the disturbance).
constexpr Index kFewestStallSigns = 2;

/// The filter, [WB, 2.3]; names there.
namespace filter {
constexpr double kGammaTheta = 1e-5;  ///< and filter_margin_fact of [Ipopt]
constexpr double kGammaPhi = 1e-8;    ///< and eta_phi; delta = 1
constexpr double kThetaPower = 1.1;   ///< s_theta
constexpr double kPhiPower = 2.3;     ///< s_phi
constexpr double kGammaAlpha = 0.05;
constexpr double kThetaMin = 1e-4;     ///< theta_min over max(1, first violation)
constexpr double kThetaMax = 1e4;      ///< theta_max over it
constexpr double kRounding = 10.0;     ///< units of rounding that comparisons forgive; [Ipopt]
constexpr double kMostIncrease = 1e5;  ///< of phi over max(10, |phi|), minimizations; [Ipopt]:
                                       ///< Luksan's and Vlcek's 8th: 12 iterations for 51
}  // namespace filter

/// The barrier parameter's oracles, as in [Ipopt]; Nocedal, Waechter, Waltz 2009.
namespace barrier {
constexpr double kLargestSigma = 100.0;  ///< sigma_max
constexpr double kSmallestSigma = 1e-6;  ///< sigma_min
constexpr int kSectionSteps = 8;         ///< quality_function_max_section_steps
}  // namespace barrier

/// Divergence of a search, and when it ends elsewhere.
namespace divergence {
constexpr double kLargeMultiplier =
    1e6;  ///< of a Max constraint (scaled): Max has no room left [R]
// Newton steps through first-order points that show a run to infinity: so many, a variable grows in
// each by this share of its size, and by at least that share of the step before: towards a zero of
// order p steps shrink by (p - 1)/p.
constexpr int kOutwardSteps = 3;
constexpr double kOutwardStep = 5e-4;
constexpr double kOutwardShare = 0.95;
}  // namespace divergence

/// What the second-order tests of a solve may cost, in factorizations.
namespace test {
constexpr Index kForSmallSystems = 40;  ///< for each test
constexpr Index kShareOfTests = 5;      ///< elsewhere one for so many others, all tests together
constexpr Index kFewestForTests = 12;   ///< but for each test these: with 8 verdicts are lost
}  // namespace test

/// New starts [R].
namespace restart {
/// Half-widths of the box, over max(1, |v|), without bounds: one after the other, around the start
/// and around zero.
inline constexpr std::array kReaches{3.0, 1.0, 10.0};
constexpr Index kIterations = 300;  ///< after the first search, after which none begins
constexpr Index kIterationsOfAlgorithmOne = 150;  ///< of one search
}  // namespace restart

}  // namespace ipminmax::parameters
