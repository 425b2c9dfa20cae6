#include "core/differences/directional_check.hpp"

#include <algorithm>
#include <cmath>

#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/iterate.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

constexpr double kOfDeviation = 0.1;  ///< that rounding may be, or it says nothing
constexpr double kOfDistance = 0.1;   ///< to a bound, that a step may go

/// Roundings of a derivative, over epsilon and the sum of its terms.
constexpr double kRoundings = 100.0;
/// Disagreement of two differences, times this, that may be their error.
constexpr double kDoubt = 10.0;
/// Shorter steps that have to confirm a wrong slope, over the first, and how far, relatively, what
/// they say may deviate from what that says.
constexpr double kShorterSteps[] = {1e-1, 1e-2};
constexpr double kSameSlope = 0.2;

/// Of steps of differences; 0 of slacks.
double length(const CanonicalProblem& canonical, const Eigen::VectorXd& v, Index i) {
  if (canonical.x_slacks().contains(i) || canonical.y_slacks().contains(i)) return 0.0;
  return length_of(v[i], 0.0, canonical.lower()[i], canonical.upper()[i]);
}

/// In the variables that are no slacks.
void lagrangian_gradient(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         const Eigen::VectorXd& lambda, Eigen::VectorXd& gradient) {
  gradient = evaluation.gradient;
  add_transposed_product(canonical, evaluation, lambda, gradient);
}

/// Sums of its terms' sizes.
void size_of_terms(const CanonicalProblem& canonical, const Evaluation& evaluation,
                   const Eigen::VectorXd& lambda, Eigen::VectorXd& size) {
  size = evaluation.gradient.cwiseAbs();
  for (const auto k : indices(evaluation.jacobian)) {
    const auto [row, col] = canonical.jacobian()[k];
    size[col] += std::abs(evaluation.jacobian[k] * lambda[row]);
  }
}

}  // namespace

std::optional<Deviation> compare_second_derivatives(
    CanonicalProblem& canonical, const Eigen::VectorXd& v, const Eigen::VectorXd& lambda,
    const Evaluation& evaluation, const Eigen::VectorXd& step, const Eigen::VectorXd& lengths,
    double tolerance, const DifferenceArrays& arrays) {
  const double longest = max_norm(step.cwiseQuotient(lengths));
  if (!(longest > 0.0)) return std::nullopt;
  Eigen::VectorXd &exact = arrays.first.v, &near = arrays.first.z_lower;
  Eigen::VectorXd &here = arrays.second.v, &there = arrays.second.z_lower;  // gradients
  Eigen::VectorXd &here_size = arrays.first.z_upper, &moved = arrays.second.z_upper;
  lagrangian_gradient(canonical, evaluation, lambda, here);
  exact.setZero(step.size());
  add_hessian_product(canonical, evaluation, step, exact);
  arrays.end = evaluation;
  // (gradient at v + factor step - gradient at v) / factor; false where undefined.
  const auto difference = [&](double factor, Eigen::VectorXd& quotient) {
    moved = v + factor * step;
    if (!canonical.first_derivatives(moved, arrays.end)) return false;
    lagrangian_gradient(canonical, arrays.end, lambda, there);
    quotient = (there - here) / factor;
    return true;
  };
  double sign = 1.0;
  if (!difference(sign, near) && !difference(sign = -1.0, near)) return std::nullopt;
  const auto norm_in_lengths = [&](const auto& gradient) {
    return max_norm(gradient.cwiseProduct(lengths));
  };
  if (norm_in_lengths(near - exact) <= tolerance * longest) return std::nullopt;

  // The error of first order in the step is extrapolated away.
  Eigen::VectorXd far;
  if (!difference(2.0 * sign, far)) return std::nullopt;
  const Eigen::VectorXd better = 2.0 * near - far;
  size_of_terms(canonical, evaluation, lambda, here_size);
  const double doubt =
      kDoubt * norm_in_lengths(near - far) + kRoundings * kEpsilon * norm_in_lengths(here_size);
  Index row = 0;
  const Eigen::VectorXd deviation = (better - exact).cwiseProduct(lengths).cwiseAbs();
  if (!deviation.allFinite()) return std::nullopt;
  if (!(deviation.maxCoeff(&row) > tolerance * longest + doubt)) return std::nullopt;
  // Beside a singularity, as of a power next to zero, second derivatives change within the step:
  // shorter ones tell, as long as they exceed rounding.
  for (const double share : {1e-2, 1e-4}) {
    const double rounding = kRoundings * kEpsilon * here_size[row] / share;
    if (!(rounding <= kOfDeviation * std::abs(better[row] - exact[row]))) break;
    Eigen::VectorXd first, second;
    if (!difference(share * sign, first) || !difference(2.0 * share * sign, second)) break;
    const double closer = 2.0 * first[row] - second[row];
    const double allowed =
        kDoubt * std::abs(first[row] - second[row]) + rounding + tolerance * longest / lengths[row];
    if (std::abs(closer - exact[row]) <= allowed) return std::nullopt;
  }
  return Deviation{.index = row, .exact = exact[row], .difference = better[row]};
}

namespace {

/// Slopes of the constraints and, last, the objective along a step, from values: central
/// differences, extrapolated, what they differ by from each other, and rounding.
struct MeasuredSlopes {
  Eigen::VectorXd better, doubt, rounding;
};

/// Over a share of the step, as slopes along all of it; none where the model is not defined.
std::optional<MeasuredSlopes> measure_slopes(CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                             const Eigen::VectorXd& step, double share) {
  const Index m = canonical.constraints();
  const auto values = [&](double factor, Eigen::VectorXd& to) {
    double f = 0.0;
    Eigen::VectorXd c(m);
    if (!canonical.values(v + factor * share * step, f, c)) return false;
    to << c, f;
    return true;
  };
  Eigen::VectorXd ahead(m + 1), behind(m + 1), far_ahead(m + 1), far_behind(m + 1);
  if (!values(1.0, ahead) || !values(-1.0, behind) || !values(2.0, far_ahead) ||
      !values(-2.0, far_behind)) {
    return std::nullopt;
  }
  const Eigen::VectorXd near = 0.5 / share * (ahead - behind);
  const Eigen::VectorXd far = 0.25 / share * (far_ahead - far_behind);
  return MeasuredSlopes{
      .better = (4.0 * near - far) / 3.0,
      .doubt = (near - far).cwiseAbs(),
      .rounding = kRoundings * kEpsilon / share * ahead.cwiseAbs().cwiseMax(behind.cwiseAbs())};
}

}  // namespace

std::optional<Deviation> compare_first_derivatives(CanonicalProblem& canonical,
                                                   const Eigen::VectorXd& v,
                                                   const Evaluation& evaluation,
                                                   const Eigen::VectorXd& step) {
  const Index m = canonical.constraints();
  // Entry m is the objective's.
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(m + 1);
  Eigen::VectorXd size = slope;
  const auto add = [&](Index row, double term) {
    slope[row] += term;
    size[row] += std::abs(term);
  };
  for (const auto k : indices(evaluation.jacobian)) {
    const auto [row, col] = canonical.jacobian()[k];
    add(row, evaluation.jacobian[k] * step[col]);
  }
  for (Index i = 0; i < v.size(); ++i) add(m, evaluation.gradient[i] * step[i]);

  const auto measured = measure_slopes(canonical, v, step, 1.0);
  if (!measured) return std::nullopt;
  const auto deviates = [&](const MeasuredSlopes& by, Index row) {
    constexpr double kAgrees = 1e-4;  // beside the terms
    const double allowed = kAgrees * std::max(size[row], std::abs(by.better[row])) +
                           kDoubt * by.doubt[row] + by.rounding[row];
    return std::abs(by.better[row] - slope[row]) / allowed;
  };
  Index worst = -1;
  double largest = 1.0;
  for (Index row = 0; row <= m; ++row) {
    const double times = deviates(*measured, row);
    if (!(times > largest)) continue;
    largest = times;
    worst = row;
  }
  if (worst < 0) return std::nullopt;
  // Beside a pole the slope changes within the step, and differences over it and twice it may agree
  // by chance: a much shorter step has to say the same, as long as rounding lets it.
  const double better = measured->better[worst], deviation = std::abs(better - slope[worst]);
  for (const double share : kShorterSteps) {
    const auto closer = measure_slopes(canonical, v, step, share);
    if (!closer || !(closer->rounding[worst] <= kOfDeviation * deviation)) continue;
    const double other = closer->better[worst];
    const double same = kSameSlope * std::max(std::abs(better), std::abs(other)) +
                        closer->rounding[worst] + measured->rounding[worst];
    if (!(std::abs(other - better) <= same) || !(deviates(*closer, worst) > 1.0))
      return std::nullopt;
  }
  return Deviation{.index = worst == m ? -1 : worst, .exact = slope[worst], .difference = better};
}

void keep_within_bounds(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double share,
                        Eigen::VectorXd& step) {
  for_each_bound(canonical, v, [&](Index i, int side, double distance) {
    const double room = share * std::max(distance, 0.0);
    step[i] = side < 0 ? std::max(step[i], -room) : std::min(step[i], room);
  });
}

Eigen::VectorXd generic_step(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                             double relative) {
  Eigen::VectorXd step = Eigen::VectorXd::Zero(v.size());
  for (Index i = 0; i < v.size(); ++i) {
    const double size = relative * length(canonical, v, i);
    step[i] = (i % 2 == 0 ? size : -size) * (0.6 + 0.4 * std::sin(1.0 + i));
  }
  // Steps are made in both directions.
  keep_within_bounds(canonical, v, kOfDistance, step);
  step = -step;
  keep_within_bounds(canonical, v, kOfDistance, step);
  return step;
}

Eigen::VectorXd aside(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                      double relative) {
  Eigen::VectorXd up(v.size());
  for (Index i = 0; i < v.size(); ++i) up[i] = relative * length(canonical, v, i);
  Eigen::VectorXd down = -up;
  keep_within_bounds(canonical, v, 0.5, up);
  keep_within_bounds(canonical, v, 0.5, down);
  return v + (up.cwiseAbs().array() >= down.cwiseAbs().array()).select(up, down);
}

}  // namespace ipminmax
