#include "core/search/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "core/certificate/units.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/directional_check.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/norms.hpp"
#include "core/model/remarks.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"

namespace ipminmax {
namespace {

/// Longest entries of the steps, over the size of the variables: second differences of values would
/// need longer ones than differences of gradients.
constexpr double kStepOfValues = 1e-5;
constexpr double kStepOfGradients = 1e-6;
/// Error of W, in units in which none of its entries exceeds 1, that counts.
constexpr double kWrongCurvature = 1e-3;

bool may_be_due_to_derivatives(Status status) {
  using enum Status;
  switch (status) {
    case NotLocalMinmax:
    case NoLocalMinmaxFound:
    case InnerUnbounded:
    case OuterUnbounded:
    case DivergingIterates:
    case LocallyInfeasible:
    case InnerInfeasible:
    case MaxIterations:
    case TinyStep:
    case RestorationFailed:
    case InertiaCorrectionFailed:
    case LinearSolverFailed:
      return true;
    default:
      return false;
  }
}

/// The model with a result as its starting point.
class AtResult final : public ForwardingProblem {
 public:
  AtResult(Problem& model, const Result& result) : ForwardingProblem(model), result_(result) {}
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(result_.v, start.v.begin());
    if (!start.needs_multipliers) return true;
    std::ranges::copy(result_.lambda, start.lambda.begin());
    std::ranges::copy(result_.z_lower, start.z_lower.begin());
    std::ranges::copy(result_.z_upper, start.z_upper.begin());
    return true;
  }

 private:
  const Result& result_;
};

SolverOptions unscaled_at_the_point(SolverOptions options) {
  constexpr double kHardly = 1e-12;
  options.nlp_scaling_method = Scaling::None;
  options.warm_start_init_point = true;
  options.warm_start_bound_push = options.warm_start_bound_frac = kHardly;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = kHardly;
  options.warm_start_mult_init_max = 1e20;
  return options;
}

bool is_finite(const Result& result) {
  return all_finite(result.v) && all_finite(result.lambda) && all_finite(result.z_lower) &&
         all_finite(result.z_upper);
}

std::string beside(const Deviation& found) {
  char text[96];
  std::snprintf(text, sizeof text, " (%.3g along a small step, differences say %.3g)", found.exact,
                found.difference);
  return text;
}

std::string find_wrong_derivative(CanonicalProblem& canonical, bool has_hessian) {
  const Eigen::VectorXd v = canonical.starting_point().v;
  const Eigen::VectorXd lambda = canonical.starting_point().lambda;
  Evaluation here;
  here.c.setZero(canonical.constraints());
  here.gradient.setZero(canonical.variables());
  here.jacobian.assign(canonical.jacobian().size(), 0.0);
  here.hessian.assign(canonical.hessian().size(), 0.0);
  if (canonical.first_derivatives(v, here) != EvaluationStatus::Ok) return {};
  if (const auto wrong = compare_first_derivatives(canonical, v, here,
                                                   generic_step(canonical, v, kStepOfValues))) {
    const std::string of = wrong->index < 0 ? "the objective" : canonical.row_name(wrong->index);
    return "the gradient of " + of + " looks wrong at the last point" + beside(*wrong) +
           ": try derivative_test first-order";
  }
  if (!has_hessian || canonical.second_derivatives(v, lambda, here) != EvaluationStatus::Ok) {
    return {};
  }
  const Units units = units_of(canonical, v, here);
  DifferenceArrays arrays;
  if (const auto wrong = compare_second_derivatives(canonical, v, lambda, here,
                                                    generic_step(canonical, v, kStepOfGradients),
                                                    units.variable, kWrongCurvature, arrays)) {
    return "the second derivatives in " + canonical.column_name(wrong->index) +
           " look wrong at the last point" + beside(*wrong) + ": try derivative_test second-order";
  }
  return "first and second derivatives agree with differences there";
}

}  // namespace

void diagnose_failure(Problem& problem, const SolverOptions& options, Result& result) {
  if (!may_be_due_to_derivatives(result.status) || result.v.empty() || !is_finite(result)) return;
  const bool has_hessian = problem.structure().has_hessian &&
                           (options.hessian_approximation == HessianApproximation::Unset ||
                            options.hessian_approximation == HessianApproximation::Exact);
  const std::string help = remedies(problem.structure(), options, result);
  AtResult at(problem, result);
  const SolverOptions own = unscaled_at_the_point(options);
  CanonicalProblem canonical(at, own, result.counts, result.timing);
  const std::string verdict =
      canonical.build().empty() ? find_wrong_derivative(canonical, has_hessian) : "";
  for (const std::string& text : {verdict, help}) {
    if (text.empty()) continue;
    if (result.message.empty()) result.message = std::string(name_of(result.status));
    result.message += "; " + text;
  }
}

namespace {

/// A function's change over a step, what its gradients say of it, and the sizes of their terms.
struct Change {
  double actual = 0.0, said = 0.0, size = 0.0, value = 0.0;

  /// Relative to the terms; 0 where rounding may be why.
  [[nodiscard]] double error() const {
    constexpr double kRounding = 1e-12;  // of a value: differences of two, over a short step
    const double error = std::abs(actual - said);
    return error > kRounding * std::max(1.0, std::abs(value)) ? error / size : 0.0;
  }
};

/// A point near another, within the bounds, in a generic direction. Fixed variables stay.
std::vector<double> moved(const ProblemStructure& s, const std::vector<double>& v,
                          double relative) {
  std::mt19937_64 random(20220411);
  std::vector<double> to = v;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const double t = 0.5 + 0.5 * uniform(random);
    const double step = relative * t * std::max(1.0, std::abs(v[i]));
    const double sign = uniform(random) < 0.5 ? -1.0 : 1.0;
    const auto inside = [&](double place) {
      return place >= s.variable_lower[i] && place <= s.variable_upper[i];
    };
    if (inside(v[i] + sign * step)) {
      to[i] += sign * step;
    } else if (inside(v[i] - sign * step)) {
      to[i] -= sign * step;
    }
  }
  return to;
}

/// Of the objective, then of each constraint; empty: undefined on the way.
std::vector<Change> changes(Problem& problem, const Result& result, double relative) {
  const ProblemStructure& s = problem.structure();
  const std::vector<double>& v = result.v;
  const std::vector<double> to = moved(s, v, relative);
  const std::size_t m = s.constraint_players.size();
  std::vector<Change> change(m + 1);
  std::vector<double> gradient(v.size()), values(s.jacobian.size()), g(m);
  double f = 0.0;
  if (!problem.objective(to, true, f) || (m > 0 && !problem.constraints(to, false, g))) return {};
  const auto add = [&](Change& own, std::size_t i, double slope) {
    const double term = 0.5 * slope * (to[i] - v[i]);
    own.said += term;
    own.size += std::abs(term);
  };
  for (const std::vector<double>* end : {&to, &v}) {
    if (!problem.gradient(*end, end == &v, gradient)) return {};
    if (!values.empty() && !problem.jacobian(*end, false, values)) return {};
    for (std::size_t i = 0; i < v.size(); ++i) add(change[0], i, gradient[i]);
    for (std::size_t k = 0; k < values.size(); ++k) {
      add(change[static_cast<std::size_t>(s.jacobian[k].row) + 1],
          static_cast<std::size_t>(s.jacobian[k].col), values[k]);
    }
  }
  change[0].value = result.objective;
  change[0].actual = f - result.objective;
  for (std::size_t j = 0; j < m; ++j) {
    change[j + 1].value = result.constraints[j];
    change[j + 1].actual = g[j] - result.constraints[j];
  }
  return change;
}

void withdraw(const std::string& why, Result& result) {
  Certificate& c = result.certificate;
  c.kind = PointKind::FirstOrderPoint;
  c.second_order = SecondOrder::Undecided;
  c.answer = InnerAnswer::Unknown;
  c.margin = c.least_curvature = 0.0;
  c.least_curvature_variable = -1;
  c.reasons.insert(c.reasons.begin(), {.kind = CertificateReason::Kind::WrongHessian,
                                       .player = Player::Max,
                                       .text = why,
                                       .variables = {},
                                       .constraints = {}});
  result.message += "; " + why;
}

}  // namespace

void check_gradients(Problem& problem, Result& result) {
  constexpr double kWrong = 0.03;  // of the terms' sizes; that of the trapezoid falls with the step
  constexpr double kStep = 1e-3, kShorter = 1e-4;
  if (result.certificate.kind != PointKind::LocalMinmax ||
      !has_max_variables(problem.structure()) || !is_finite(result)) {
    return;
  }
  const auto compare = [&](double step) {
    result.counts.objective += 1;
    result.counts.gradient += 2;
    if (!result.constraints.empty()) result.counts.constraints += 1;
    if (!problem.structure().jacobian.empty()) result.counts.jacobian += 2;
    return changes(problem, result, step);
  };
  const std::vector<Change> far = compare(kStep);
  const auto is_wrong = [](const Change& change) { return change.error() > kWrong; };
  if (std::ranges::none_of(far, is_wrong)) return;
  const std::vector<Change> near = compare(kShorter);
  for (std::size_t j = 0; j < std::min(far.size(), near.size()); ++j) {
    // Where only the step was too long, the error falls with it.
    if (!is_wrong(far[j]) || !(near[j].error() > 0.5 * far[j].error())) continue;
    char text[200];
    std::snprintf(text, sizeof text,
                  "of %s changes by %.3g over a small step from the point, its gradients say %.3g: "
                  "try derivative_test first-order",
                  j == 0 ? "the objective"
                         : constraint_name(problem.structure(), static_cast<Index>(j) - 1).c_str(),
                  near[j].actual, near[j].said);
    withdraw(std::string("the first derivatives look wrong: the value ") + text, result);
    return;
  }
}

}  // namespace ipminmax
