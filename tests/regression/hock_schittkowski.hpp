#pragma once

#include <string>
#include <vector>

#include <support/autodiff_problem.hpp>

namespace ipminmax::testing {

/// A minimization: every variable is the Min player's.
struct MinimizationProblem {
  std::string name{};
  Model model{};
  std::vector<double> start{};
  double objective = 0.0;       ///< best known
  bool degenerate = false;      ///< at the solution second-order sufficiency, the independence of
                                ///< the active gradients or strict complementarity fails
  bool nonunique = false;       ///< minimizers with the same objective are not isolated
  bool several_minima = false;  ///< local minima with other objectives are known
};

/// Problems of W. Hock and K. Schittkowski, Test Examples for Nonlinear Programming Codes (1981),
/// names hs001 to hs119, and K. Schittkowski, More Test Examples for Nonlinear Programming Codes
/// (1987), names from hs201, written from the published formulas, with the published starts. Left
/// out are those without a formula in elementary functions (67, 68, 69, 85, 87 to 92). Names with
/// a suffix are variants of ours that add what the collection lacks: free rows, repeated and
/// dependent rows, fixed variables, rows and bounds that say the same. Made once.
[[nodiscard]] const std::vector<MinimizationProblem>& hock_schittkowski();

/// Throws std::out_of_range when there is none.
[[nodiscard]] const MinimizationProblem& hock_schittkowski(const std::string& name);

/// The start with s (1 + |v_i|) u_i added to every v_i, u_i random in [-1, 1], the same in every
/// run; s = 0.1, 0.3, 1 and 3 in turn for draws 0, 1, 2, ...
[[nodiscard]] std::vector<double> perturbed_start(const MinimizationProblem& problem,
                                                  unsigned draw);

/// The other player pulls at the sum of all variables, around a solution v.
[[nodiscard]] Model twin(const Model& model, Player owner, const std::vector<double>& v);

}  // namespace ipminmax::testing
