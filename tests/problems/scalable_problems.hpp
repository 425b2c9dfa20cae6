#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/problem.hpp"

/// Families of problems of any size with sparse derivatives that cost O(n), each with a solution
/// that is proven or follows from a formula. What the proofs need is stated at each family.
namespace ipminmax::testing {

struct ScalableProblem {
  std::string name;
  std::unique_ptr<Problem> problem{};
  /// A solution; multipliers with the signs of Result.
  std::vector<double> v{};
  std::vector<double> lambda{};
  std::vector<double> z_lower{}, z_upper{};
  double objective = 0.0;
  bool global = true;        ///< v is the global minmax
  bool unique_value = true;  ///< every local minmax has this objective
};

/// (x-a)'A(x-a)/2 + 2(x-a)'(y-b) - (y-b)'C(y-b)/2 + 1, A = tridiag(.2, cos i, .2) indefinite,
/// C = tridiag(-.25, 1, -.25). The Schur complement A + 4 C^-1 is positive definite. n + n
/// variables.
[[nodiscard]] ScalableProblem f01_quad(int n);

/// Quadratic in the box [-1,1] with planted active bounds and multipliers, indefinite in x and in
/// y: tridiagonal A and D, B = 2I + .3 shift. n + n variables; other solutions may exist.
[[nodiscard]] ScalableProblem f03_quad_box(int n);

/// sum (cos u_i - 1) + (cos v_i - 1) + 2 sin u_i sin v_i + .2 sin u_i sin v_{i+1}, u = x-a, v =
/// y-b: periodic, with stationary points of all inertias. n + n variables.
[[nodiscard]] ScalableProblem f05_trig(int n);

/// |x-y|^2/2 with a'x >= 1 and |y| <= 2: the farthest point of a ball, f convex in y. The value is
/// (|x|+2)^2/2 at x = a, |a| = 1. n + n variables.
[[nodiscard]] ScalableProblem f10_ball_halfspace(int n);

/// Robust least squares |(A+dA)x-(b+db)|^2/2, |[dA db]|_F <= rho (El Ghaoui, Lebret 1997). The
/// inner maximum is (|Ax-b| + rho sqrt(1+|x|^2))^2/2. n + rows(n+1) variables, own random data.
[[nodiscard]] ScalableProblem f12_robust_ls(int rows, int n);

/// Finite-horizon linear-quadratic difference game (Basar, Bernhard): a damped oscillator with
/// control u, disturbance w, states s in the Max block. The value is s0'P s0/2 by the coupled
/// Riccati recursion; the weight of w makes the maximization concave. T + 3T variables, 2T
/// equalities of Max.
[[nodiscard]] ScalableProblem f16_lq_game(int horizon);

/// The same with |u| <= .5 and |w| <= .02; convex-concave after elimination of the states, so a
/// KKT point is the saddle point. Solved by an active-set method of its own.
[[nodiscard]] ScalableProblem f17_mpc_box(int horizon);

/// Robust elliptic control: |z-zd|^2/2 + a|u|^2/2 - g|w|^2/2 with h K z = h(u+w), |u| <= 8 and the
/// 1-D Laplacian K. Convex-concave after elimination. N + 2N variables, N equalities of Max.
[[nodiscard]] ScalableProblem f19_pde(int nodes);

/// x'Ay on two unit spheres, A upper bidiagonal: the value is the smallest singular value. n + n.
[[nodiscard]] ScalableProblem f23_sphere(int n);

/// Few Min variables x against a grid of side^2 Max variables y, d = v - v*:
///
///     f = -|dx|^2/2 + 2 dx'P dy - dy'C dy/2 + s'd,   C = I - .1 per edge,   |y| <= 1,
///     sum x >= sum x*,   dy_i - dy_{i+1}/2 + dx_{i mod n}/(2 side) = 0 for every eighth i,
///
/// P has n orthonormal rows, the first of the discrete cosine transform, so that phi is convex
/// although f is concave in x. A quarter of the bounds is active. n + side^2 variables, side^2/8
/// equalities of Max.
[[nodiscard]] ScalableProblem f30_few_min(int n, int side);

/// Ten of these families, with few variables.
[[nodiscard]] std::vector<ScalableProblem> small_scalable_problems();

}  // namespace ipminmax::testing
