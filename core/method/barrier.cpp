#include <algorithm>
#include <cmath>
#include <utility>

#include "core/method/barrier.hpp"
#include "core/method/parameters.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

namespace barrier = parameters::barrier;

/// Calls use(distance * multiplier) for every bound of the iterate moved by steps.
template <class Use>
void for_each_product(const CanonicalProblem& canonical, const Iterate& iterate, Use use) {
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    use(distance * multiplier_of(iterate, i, side) / canonical.weight(i, iterate));
  });
}

double mean_square(const Eigen::VectorXd& v) {
  return v.size() == 0 ? 0.0 : v.squaredNorm() / static_cast<double>(v.size());
}

double mean_square_of_products(const CanonicalProblem& canonical, const Iterate& iterate) {
  double sum = 0.0;
  Index bounds = 0;
  for_each_product(canonical, iterate, [&](double product) {
    sum += product * product;
    ++bounds;
  });
  return sum / static_cast<double>(std::max<Index>(bounds, 1));
}

}  // namespace

double final_barrier(const SolverOptions& options, double objective_scale) {
  const double target = std::min(options.tol, options.compl_inf_tol * objective_scale) /
                        (options.barrier_tol_factor + 1.0);
  return std::max(target, options.mu_target);
}

double next_barrier(double mu, double mu_final, const std::function<double(double)>& scaled_error,
                    const std::function<double(double)>& norm, const SolverOptions& options) {
  const double kappa_mu = options.mu_linear_decrease_factor;
  if (options.minmax_barrier_rule == BarrierRule::Paper) {
    // b <- sigma b when |g(z, b)| <= b, lines 13 and 14 of Algorithm 1
    return mu > mu_final && norm(mu) <= mu ? std::max(mu_final, kappa_mu * mu) : mu;
  }
  // mu <- max(mu_final, min(kappa_mu mu, mu^theta_mu)), Waechter and Biegler 2006, eq. (7)
  // A factor next to 1 leaves the rest to the next iterates; one that rounds to 1 would never end
  // here.
  for (int k = 0; k < parameters::kRoom && mu > mu_final &&
                  scaled_error(mu) <= options.barrier_tol_factor * mu;
       ++k) {
    mu = std::max(mu_final,
                  std::min(kappa_mu * mu, std::pow(mu, options.mu_superlinear_decrease_power)));
  }
  return mu;
}

double boundary_fraction(double mu, const SolverOptions& options) {
  return std::max(options.tau_min, 1.0 - mu);
}

Complementarity complementarity_of(const CanonicalProblem& canonical, const Iterate& iterate) {
  Complementarity products;
  products.smallest = kInfinity;
  for_each_product(canonical, iterate, [&](double product) {
    products.average += product;
    products.smallest = std::min(products.smallest, product);
    ++products.bounds;
  });
  if (products.bounds == 0) return {};
  products.average /= static_cast<double>(products.bounds);
  return products;
}

double loqo_barrier(const Complementarity& products) {
  if (!(products.average > 0.0)) return 0.0;
  // 0.1 min(0.05 (1 - xi)/xi, 2)^3 times the average
  const double xi = products.smallest / products.average;
  const double factor = xi > 0.0 ? std::min(0.05 * (1.0 - xi) / xi, 2.0) : 2.0;
  return 0.1 * std::pow(factor, 3.0) * products.average;
}

double probing_barrier(const CanonicalProblem& canonical, const Iterate& iterate,
                       const Step& affine, OracleWork& work) {
  const double average = complementarity_of(canonical, iterate).average;
  if (!(average > 0.0)) return 0.0;
  Iterate& moved = work.moved;
  moved = iterate;
  advance(canonical, affine, largest_step(canonical, iterate, affine, 1.0), moved);
  const double ratio = std::max(0.0, complementarity_of(canonical, moved).average / average);
  return std::min(std::pow(ratio, 3.0), barrier::kLargestSigma) * average;
}

SquaredResidual squared_residual(const CanonicalProblem& canonical, const Point& point) {
  return {.dual = mean_square(point.dual),
          .primal = mean_square(point.evaluation.c),
          .complementarity = mean_square_of_products(canonical, point.iterate)};
}

double quality_function_barrier(const CanonicalProblem& canonical, const Iterate& iterate,
                                const SquaredResidual& residual, const Step& affine,
                                const Step& centering, double tau_min, OracleWork& work) {
  const double average = complementarity_of(canonical, iterate).average;
  Step& step = work.step;
  Iterate& moved = work.moved;
  const auto quality = [&](double sigma) {
    step.v = affine.v + sigma * centering.v;
    step.lambda = affine.lambda + sigma * centering.lambda;
    step.z_lower = affine.z_lower + sigma * centering.z_lower;
    step.z_upper = affine.z_upper + sigma * centering.z_upper;
    const double tau = std::max(tau_min, 1.0 - sigma * average);
    const StepLength alpha = largest_step(canonical, iterate, step, tau);
    moved = iterate;
    advance(canonical, step, alpha, moved);
    const double left_dual = 1.0 - alpha.dual;
    const double left_primal = 1.0 - alpha.primal;
    return left_dual * left_dual * residual.dual + left_primal * left_primal * residual.primal +
           mean_square_of_products(canonical, moved);
  };
  // Golden section for log(sigma), on the side of sigma = 1 on which the quality improves.
  constexpr double kSectionTol = 1e-2;  // quality_function_section_sigma_tol
  const bool above = quality(1.0 - kSectionTol) > quality(1.0);
  double low = above ? 0.0 : std::log(barrier::kSmallestSigma);
  double high = above ? std::log(barrier::kLargestSigma) : 0.0;
  const double golden = (3.0 - std::sqrt(5.0)) / 2.0;
  double left = low + golden * (high - low);
  double right = high - golden * (high - low);
  double left_value = quality(std::exp(left));
  double right_value = quality(std::exp(right));
  for (int k = 0; k < barrier::kSectionSteps && high - low > kSectionTol; ++k) {
    if (left_value > right_value) {
      low = std::exchange(left, right);
      left_value = right_value;
      right = high - golden * (high - low);
      right_value = quality(std::exp(right));
    } else {
      high = std::exchange(right, left);
      right_value = left_value;
      left = low + golden * (high - low);
      left_value = quality(std::exp(left));
    }
  }
  double best = std::exp(left_value < right_value ? left : right);
  double best_value = std::min(left_value, right_value);
  for (const double end : {above ? barrier::kLargestSigma : barrier::kSmallestSigma, 1.0}) {
    if (const double value = quality(end); value < best_value) {
      best = end;
      best_value = value;
    }
  }
  return best * average;
}

double least_adaptive_barrier(const SolverOptions& options, double objective_scale) {
  const double half = 0.5 * std::min(options.tol, options.compl_inf_tol * objective_scale);
  return std::max(std::min(options.mu_min, half), options.mu_target);
}

AdaptiveBarrier::AdaptiveBarrier(const SolverOptions& options, double lowest, double least_free,
                                 double first_average)
    : options_(options),
      lowest_(lowest),
      least_free_(least_free),
      largest_(
          std::max({options.mu_max > 0.0 ? options.mu_max : options.mu_max_fact * first_average,
                    lowest, least_free})) {
  residuals_.reserve(at(std::min(options.adaptive_mu_kkterror_red_iters, parameters::kRoom)) + 1);
  filter_.reserve(at(std::min(options.max_iter, parameters::kRoom)));
}

void AdaptiveBarrier::reset() {
  free_ = true;
  residuals_.clear();
  filter_.clear();
}

bool AdaptiveBarrier::progress(const BarrierState& now) const {
  switch (options_.adaptive_mu_globalization) {
    case AdaptiveGlobalization::KktError:
      return residuals_.size() < at(options_.adaptive_mu_kkterror_red_iters) ||
             std::ranges::any_of(residuals_, [&](double earlier) {
               return now.residual <= options_.adaptive_mu_kkterror_red_fact * earlier;
             });
    case AdaptiveGlobalization::ObjectiveFilter: {
      const double margin = parameters::filter::kGammaTheta * std::min(1.0, now.barrier_error);
      return std::ranges::all_of(filter_, [&](const Merit& earlier) {
        return now.merit.theta + margin <= earlier.theta || now.merit.phi + margin <= earlier.phi;
      });
    }
    case AdaptiveGlobalization::NeverMonotone:
      return true;
  }
  return true;
}

void AdaptiveBarrier::remember(const BarrierState& now) {
  if (options_.adaptive_mu_globalization == AdaptiveGlobalization::KktError) {
    residuals_.push_back(now.residual);
    while (residuals_.size() > at(options_.adaptive_mu_kkterror_red_iters)) {
      residuals_.erase(residuals_.begin());
    }
  } else if (options_.adaptive_mu_globalization == AdaptiveGlobalization::ObjectiveFilter) {
    std::erase_if(filter_, [&](const Merit& earlier) {
      return earlier.theta >= now.merit.theta && earlier.phi >= now.merit.phi;
    });
    filter_.push_back(now.merit);
  }
}

double AdaptiveBarrier::next(double mu, const BarrierState& now,
                             const std::function<std::optional<double>()>& oracle,
                             const std::function<double(double)>& monotone) {
  const bool never_monotone =
      options_.adaptive_mu_globalization == AdaptiveGlobalization::NeverMonotone;
  const bool advances = never_monotone || (now.step_accepted && progress(now));
  const bool was_free = free_;
  free_ = advances;
  if (free_) {
    remember(now);
    if (const auto chosen = oracle(); chosen && std::isfinite(*chosen)) {
      return std::clamp(*chosen, least_free_, largest_);
    }
    free_ = false;
  }
  if (!was_free) return monotone(mu);
  return std::clamp(options_.adaptive_mu_monotone_init_factor * now.average, lowest_, largest_);
}

}  // namespace ipminmax
