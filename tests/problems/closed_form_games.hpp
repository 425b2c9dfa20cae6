#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

/// A game whose best answer y is not unique, with what is known of it by hand.
struct ClosedForm {
  std::unique_ptr<Problem> problem;
  Eigen::Index x = 0;                                     ///< Min's variables, the first ones
  std::function<double(const Eigen::VectorXd& x)> phi;    ///< max over y of f; infinite: none is
  std::function<bool(const Eigen::VectorXd& x)> allowed;  ///< of Min
  /// Directions of x, as columns, along which phi may fall although it rises along random ones:
  /// those on which the pieces that are largest agree.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& x)> suspects;
  /// The least phi, where it is convex and known; its minimizer is unique then.
  std::optional<double> optimum{};
  double accuracy = 1e-6;  ///< of the value, relative
};

/// x'Ax/2 + x'B (y - y*) on boxes: phi is the same with |.|_1.
[[nodiscard]] ClosedForm bilinear_game(std::uint64_t seed);
/// The largest of quadratic functions, as sum q_i f_i(x) with q in the simplex.
[[nodiscard]] ClosedForm finite_maximum(std::uint64_t seed);
/// p'Aq on two simplices of up to 8 strategies, in one game of ten up to 50; some with two equal
/// rows.
[[nodiscard]] ClosedForm matrix_game(std::uint64_t seed);
/// x'Qx/2 + c'x + y'(Ax - b): phi is infinite but where Ax = b.
[[nodiscard]] ClosedForm lagrangian(std::uint64_t seed);
/// A generator V, lower triangular, of Gaussian samples whose covariance is to be S = TT':
/// tr W'(S - VV'), |W_ij| <= 1.
[[nodiscard]] ClosedForm wasserstein_gan(std::uint64_t seed);
/// A generator at x beside data at a and a linear discriminator y: h(y'a) + h(-y'x) with
/// h(t) = -ln(1 + e^-t), and weight r |x - a|^2 / 2.
[[nodiscard]] ClosedForm dirac_gan(std::uint64_t seed);
/// |x|^2 / 2 - |By - Cx|^2 / 2 with fewer rows than y has entries: f is largest on a ridge of y.
[[nodiscard]] ClosedForm ridge(std::uint64_t seed);

/// min c'x, (a_r + P_r u)'x <= b_r for every u in [-1, 1]^k, r = 1..m: linear with |P_r'x|_1. Each row
/// has a u of its own.
[[nodiscard]] ClosedForm robust_linear_program(std::uint64_t seed);

struct ClosedFormFamily {
  const char* name;
  ClosedForm (*game)(std::uint64_t seed);
};
[[nodiscard]] const std::vector<ClosedFormFamily>& closed_form_families();

/// What phi does around x, where points are exact to about 1e-7.
enum class Around : std::uint8_t { Strict, Lower, Open };
[[nodiscard]] Around look_around(const ClosedForm& game, const Eigen::VectorXd& x,
                                 std::uint64_t seed);

struct ClosedFormJudgement {
  bool best = false;  ///< the value is phi(x)
  Around around = Around::Open;
  [[nodiscard]] bool strict() const { return best && around == Around::Strict; }
  [[nodiscard]] bool refuted() const { return !best || around == Around::Lower; }
};
/// Of a result with a point.
[[nodiscard]] ClosedFormJudgement judge(const ClosedForm& game, const Result& result,
                                        std::uint64_t seed);

}  // namespace ipminmax::testing
