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
/// Ipopt as the reference: one and the same model solved by both solvers where it is a
/// minimization or a maximization; where it is a minmax problem, Ipopt's attempt to improve the
/// maximizer's answer.
namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Name and value, as in an options file.
using OptionSetting = std::pair<std::string, std::string>;

struct CrossCheckSettings {
  /// For this solver, and for Ipopt where it knows the option and it means the same: all but
  /// linear_solver (Ipopt keeps MUMPS) and names that begin with minmax_. Maximizations over y
  /// choose start and barrier themselves.
  std::vector<OptionSetting> options;
  /// For Ipopt alone, after those.
  std::vector<OptionSetting> ipopt_options;
  /// Objectives f1 and f2 count as equal when |f1 - f2| <= tolerance max(1, |f1|).
  double tolerance = 1e-6;
  /// Points count as equal when every |v1 - v2| <= point_tolerance max(1, largest |v|).
  double point_tolerance = 1e-4;

  // Minmax problems only.
  /// A maximization near y* stays within radius times the length of y_i: its size there or at the
  /// problem's start, at most half of its box.
  double radius = 1e-2;
  /// Gain (relative as tolerance, but to no more than 100 times the range of f at all starts) above
  /// which y* is no local maximum.
  double gain_tolerance = 1e-7;
  int near_starts = 4;  ///< maximizations near y*, the first from y*, the others from around it
  int far_starts = 2;   ///< maximizations over all y, from up to these lengths away
  unsigned seed = 1;    ///< of the starts
};

enum class CrossCheckVerdict : std::uint8_t {
  NotCompared,      ///< the model or an option is invalid, or nobody has a point; see message
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
  double point = 0.0;      ///< of v, over max(1, largest |v|), as all that follow
  double lambda = 0.0;
  double z_lower = 0.0;
  double z_upper = 0.0;
};

/// What Ipopt makes of the maximization over y at fixed x.
struct InnerMaximumCheck {
  double objective = 0.0;      ///< f(x*, y*)
  int near_runs = 0;           ///< maximizations near y*; none when no y is free
  int near_solved = 0;         ///< of them, reported as solved by Ipopt
  bool improved_near = false;  ///< refutes y* as a local maximum
  double best_near = 0.0;      ///< largest f found near y*, at feasible y
  std::vector<double> v_near;  ///< its point, n; empty when not improved
  /// A better maximum elsewhere says nothing against a local minmax, but worth knowing.
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
  /// Second-order test of this solver at Ipopt's point; NotTested where the point does not meet
  /// 100 tol, or for minmax problems.
  Certificate ipopt_certificate;
  AnswerDifference difference;  ///< where both have a point
  InnerMaximumCheck inner;      ///< minmax problems only
  Index variables = 0, min_variables = 0, constraints = 0;

  /// Table of all that, and the verdict in words; plain ASCII lines.
  [[nodiscard]] std::string report() const;
};

/// Solves the problem with both solvers from its starting point and compares.
///
/// Without Max variables both minimize; without Min variables both maximize. Otherwise this solver
/// solves the minmax problem, x is fixed at its answer x*, and Ipopt maximizes over y from its
/// answer y* and from around it; Ipopt has no way to check the minimizer's side.
///
/// Prints nothing. Exceptions of the problem pass through. Not for several threads at once with
/// the same problem; see solve_with_ipopt for others.
[[nodiscard]] CrossCheck cross_check_with_ipopt(Problem& problem,
                                                const CrossCheckSettings& settings = {});

/// The same for an Ipopt model (MinMaxTNLP or with metadata "player" for a minmax problem). Of the
/// model only the functions that describe the problem are called: no finalize_solution, no
/// finalize_metadata, no intermediate_callback.
[[nodiscard]] CrossCheck cross_check_with_ipopt(const Ipopt::SmartPtr<Ipopt::TNLP>& model,
                                                const CrossCheckSettings& settings = {});

/// Only the second half: can Ipopt improve the maximizer's part of any point v (n entries)?
/// The structure of the problem has to be valid (see solve). Throws std::invalid_argument when v
/// has another size or an option is invalid, std::runtime_error when the objective is undefined at
/// v.
[[nodiscard]] InnerMaximumCheck check_inner_maximum(Problem& problem, const std::vector<double>& v,
                                                    const CrossCheckSettings& settings = {});

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
