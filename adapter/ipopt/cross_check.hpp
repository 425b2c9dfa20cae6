#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "../../core/problem.hpp"
#include "../../core/result.hpp"
#include "minmax_tnlp.hpp"
#include "problem_tnlp.hpp"

/// @file
/// Comparison with Ipopt. A minimization or a maximization is solved by both solvers. For a minmax
/// problem Ipopt tries to improve the maximizer's answer.
namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Name and value, as in an options file.
using OptionSetting = std::pair<std::string, std::string>;

struct CrossCheckSettings {
  /// Options of both solvers. Ipopt does not get linear_solver (it keeps MUMPS) and names that
  /// begin with minmax_. Maximizations over y choose start and barrier themselves.
  std::vector<OptionSetting> options;
  /// Options of Ipopt alone, set after those.
  std::vector<OptionSetting> ipopt_options;
  /// Objectives f1 and f2 count as equal if |f1 - f2| <= tolerance max(1, |f1|).
  double tolerance = 1e-6;
  /// Points count as equal if every |v1 - v2| <= point_tolerance max(1, largest |v|).
  double point_tolerance = 1e-4;

  // Minmax problems only.
  /// A maximization near y* moves y_i by at most radius times its length: the larger of |y_i| at y*
  /// and at the problem's start. With two bounds, 2h apart, the length is at least min(h/10, 1) and
  /// at most h. Without two bounds it is at least 1 if y_i starts at 0.
  double radius = 1e-2;
  /// If f rises near y* by more than this times min(max(1, |f|), 100 times the range of f at y* and
  /// at all starts), then y* is no local maximum.
  double gain_tolerance = 1e-7;
  int near_starts = 4;  ///< maximizations near y*, the first from y*, the others from around it
  int far_starts = 2;   ///< maximizations over all y, from points some lengths away from y*
  unsigned seed = 1;    ///< of the starts
};

enum class CrossCheckVerdict : std::uint8_t {
  NotCompared,      ///< the model or an option is invalid, or there is no point; see message
  SameSolution,     ///< both succeed at the same point
  SameObjective,    ///< both succeed with the same objective at different points
  OursBetter,       ///< both succeed, this solver with the better objective
  IpoptBetter,      ///< both succeed, Ipopt with the better objective
  OnlyOursSolved,   ///< Ipopt did not succeed
  OnlyIpoptSolved,  ///< this solver did not succeed
  NeitherSolved,
  IpoptRefuted,      ///< Ipopt succeeds, but the second-order test refutes its point
  MaximumConfirmed,  ///< minmax: Ipopt finds no better y near y*
  MaximumRefuted     ///< minmax: Ipopt finds a better y near y*: the point is no local minmax
};
[[nodiscard]] std::string_view name_of(CrossCheckVerdict verdict);

/// Largest differences of the two answers; bound multipliers of fixed variables are left out.
struct AnswerDifference {
  double objective = 0.0;  ///< ours minus Ipopt's, over max(1, |Ipopt's|)
  double point = 0.0;      ///< of v, over max(1, largest |v|)
  double lambda = 0.0;     ///< over max(1, largest |lambda| of Ipopt), and so z_lower, z_upper
  double z_lower = 0.0;
  double z_upper = 0.0;
};

/// Result of Ipopt's maximizations over y at fixed x.
struct InnerMaximumCheck {
  double objective = 0.0;      ///< f(x*, y*)
  int near_runs = 0;           ///< number of maximizations near y*; 0 if no y is free
  int near_solved = 0;         ///< how many of them Ipopt reports as solved
  bool improved_near = false;  ///< refutes y* as a local maximum
  double best_near = 0.0;      ///< largest f found near y*, at feasible y
  std::vector<double> v_near;  ///< the point of best_near, n; empty unless improved_near
  /// Whether a better maximum was found elsewhere; it does not refute a local minmax.
  bool improved_far = false;
  double best_far = 0.0;
  std::vector<double> v_far;
};

/// Outcome of a cross check.
struct CrossCheck {
  CrossCheckVerdict verdict = CrossCheckVerdict::NotCompared;
  std::string message;  ///< why nothing could be compared
  Result ours;
  IpoptAnswer ipopt;  ///< not used for minmax problems
  /// Second-order test of this solver at Ipopt's point; NotTested if the point does not meet 100
  /// tol, or for minmax problems.
  Certificate ipopt_certificate;
  AnswerDifference difference;  ///< zero unless both have a point
  InnerMaximumCheck inner;      ///< minmax problems only
  Index variables = 0, min_variables = 0, constraints = 0;

  /// Returns a table of both answers and the verdict in words, as lines of ASCII text.
  [[nodiscard]] std::string report() const;
};

/// Solves the problem with both solvers from its starting point and compares.
///
/// Without Max variables both minimize; without Min variables both maximize. Otherwise this solver
/// solves the minmax problem. Then x is fixed at the answer x*, and Ipopt maximizes over y from the
/// answer y* and from points around it. Ipopt cannot check that x minimizes.
///
/// Prints nothing. Exceptions of the problem pass through. Several threads must not use the same
/// problem at once; see solve_with_ipopt for other restrictions.
[[nodiscard]] CrossCheck cross_check_with_ipopt(Problem& problem,
                                                const CrossCheckSettings& settings = {});

/// Does the same for an Ipopt model (for a minmax problem a MinMaxTNLP, or one with metadata
/// "player"). It calls only the functions that describe the problem, not finalize_solution,
/// finalize_metadata or intermediate_callback.
[[nodiscard]] CrossCheck cross_check_with_ipopt(const Ipopt::SmartPtr<Ipopt::TNLP>& model,
                                                const CrossCheckSettings& settings = {});

/// Lets Ipopt try to improve the maximizer's variables of a point v (n entries), without a solve.
/// The structure of the problem has to be one that solve does not refuse (InvalidProblem). Throws
/// std::invalid_argument if v has another size or an option is invalid, std::runtime_error if the
/// objective is undefined at v.
[[nodiscard]] InnerMaximumCheck check_inner_maximum(Problem& problem, const std::vector<double>& v,
                                                    const CrossCheckSettings& settings = {});

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
