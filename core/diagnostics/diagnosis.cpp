#include "core/diagnostics/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "core/certificate/scaling.hpp"
#include "core/diagnostics/remarks.hpp"
#include "core/differences/directional_check.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/model/structure_check.hpp"
#include "core/point/point.hpp"

namespace ipminmax {
namespace {

/// Longest entry of a step, over the size of the variables, for central differences of values.
constexpr double kStepOfValues = 1e-5;

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

SolverOptions unscaled_at_the_point(SolverOptions options) {
  options.nlp_scaling_method = Scaling::None;
  options.warm_start_init_point = true;
  options.warm_start_bound_push = options.warm_start_bound_frac = parameters::kConstant;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = parameters::kConstant;
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

/// here: first derivatives at v.
std::string find_wrong_gradient(CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                const Evaluation& here, const char* where) {
  const auto wrong =
      compare_first_derivatives(canonical, v, here, generic_step(canonical, v, kStepOfValues));
  if (!wrong) return {};
  const std::string of = wrong->index < 0 ? "the objective" : canonical.row_name(wrong->index);
  return "the gradient of " + of + " looks wrong " + where + beside(*wrong) +
         "\ntry derivative_test first-order";
}

std::optional<std::string> find_wrong_derivative(CanonicalProblem& canonical, bool has_hessian) {
  const Eigen::VectorXd v = canonical.starting_point().v;
  const Eigen::VectorXd lambda = canonical.starting_point().lambda;
  Evaluation here = unevaluated_point(canonical, canonical.starting_point()).evaluation;
  if (!canonical.first_derivatives(v, here)) return {};
  if (auto wrong = find_wrong_gradient(canonical, v, here, "at the last point"); !wrong.empty())
    return wrong;
  if (!has_hessian || !canonical.second_derivatives(v, lambda, here)) return {};
  const VariableScaling scaling = variable_scaling(canonical, v, here);
  DifferenceArrays arrays;
  constexpr double kWrong = 1e-3, kStep = 1e-6;  // of each variable's length
  if (const auto wrong =
          compare_second_derivatives(canonical, v, lambda, here, generic_step(canonical, v, kStep),
                                     scaling.variable, kWrong, arrays)) {
    return "the second derivatives in " + canonical.column_name(wrong->index) +
           " look wrong at the last point" + beside(*wrong) + "\ntry derivative_test second-order";
  }
  return std::string();
}

/// Says where the model is undefined a small step of Min's variables away, as far as bounds allow:
/// a search that ends there ends for this reason. Empty: not so, or there are no such variables.
std::string undefined_beside(CanonicalProblem& canonical) {
  constexpr double kSmallStep = 1e-2;  // of a variable's length
  const Eigen::VectorXd v = canonical.starting_point().v;
  const IndexRange x = canonical.x();
  Eigen::VectorXd there, c = Eigen::VectorXd::Zero(canonical.constraints());
  const auto moved = [&](Index i, double sign) {
    const double lower = canonical.lower()[i], upper = canonical.upper()[i];
    return std::clamp(v[i] + sign * kSmallStep * length_of(v[i], 0.0, lower, upper), lower, upper);
  };
  for (const double sign : {-1.0, 1.0}) {
    const auto is_defined = [&](Index count) {
      there = v;
      for (Index i = x.begin; i < x.begin + count; ++i) there[i] = moved(i, sign);
      double f = 0.0;
      return canonical.values(there, f, c);
    };
    if (is_defined(x.size()) || !is_defined(0)) continue;
    Index defined = 0, undefined = x.size();  // the first variables moved
    while (undefined - defined > 1) {
      const Index middle = defined + (undefined - defined) / 2;
      (is_defined(middle) ? defined : undefined) = middle;
    }
    const Index i = x.begin + defined;
    const double unit = canonical.variable_scale(i);
    return "the model is undefined if " + canonical.column_name(i) + " goes from " +
           number_text(v[i] / unit, 3) + " to " + number_text(moved(i, sign) / unit, 3) +
           "\nbound the variable where the model is defined, or check whether f has a minimum "
           "there";
  }
  return {};
}

/// Says which function carries fewer digits than a double: it stays the same over a small part of a
/// step over which it changes, and not over a larger part. Four values. Empty: none does, or it
/// cannot be told.
std::string few_digits(CanonicalProblem& canonical) {
  constexpr double kAside = 1e-2;  // of each variable's length
  constexpr double kPart = 1e-7;   // of that step: below the rounding of a float
  constexpr double kLarge = 1e-3;  // of it: over which only what is constant stays the same
  constexpr double kSeen = 2e-5;   // change over the step, beside the value, whose part is seen
  const Eigen::VectorXd v = canonical.starting_point().v;
  Eigen::VectorXd there = v;  // slacks stay
  const Eigen::VectorXd moved = aside(canonical, v, kAside);
  for (const IndexRange range : {canonical.x(), canonical.y()})
    there.segment(range.begin, range.size()) = moved.segment(range.begin, range.size());
  std::array<double, 4> f{};
  std::array<Eigen::VectorXd, 4> c;
  const std::array<Eigen::VectorXd, 4> points = {v, there, there + kPart * (there - v),
                                                 there + kLarge * (there - v)};
  for (const auto k : indices(points)) {
    c[k] = Eigen::VectorXd::Zero(canonical.constraints());
    if (!canonical.objective(points[k], f[k]) || !canonical.constraints(points[k], c[k])) {
      return {};
    }
  }
  const auto is_rounded = [&](double before, double here, double beside, double farther) {
    return here == beside && here != farther && std::abs(here - before) > kSeen * std::abs(here);
  };
  std::string name = is_rounded(f[0], f[1], f[2], f[3]) ? "the objective" : "";
  for (Index j = 0; name.empty() && j < canonical.constraints(); ++j)
    if (is_rounded(c[0][j], c[1][j], c[2][j], c[3][j])) name = canonical.row_name(j);
  if (name.empty()) return {};
  return name +
         " is rounded to few digits: it stays the same over a small step\ncompute it in double "
         "precision";
}

}  // namespace

void diagnose_failure(Problem& problem, const SolverOptions& options, Result& result) {
  if (!may_be_due_to_derivatives(result.status) || result.v.empty() || !is_finite(result)) return;
  const bool has_hessian = problem.structure().has_hessian &&
                           (options.hessian_approximation == HessianApproximation::Unset ||
                            options.hessian_approximation == HessianApproximation::Exact);
  const bool kink = result.status == Status::NoLocalMinmaxFound;
  const auto drop_first_line = [&] {  // which speaks of kinks
    const std::string rest =
        result.message.substr(std::min(result.message.find('\n'), result.message.size()));
    result.message = std::string(name_of(result.status)) + rest;
  };
  std::string help = unmet(problem.structure(), options, result);
  const bool joined = joins_players(problem.structure());
  if (help.empty() && kink && !joined)
    help = "check whether f has a minimum over x, or begin elsewhere (minmax_starts)";
  if (!help.empty()) {
    drop_first_line();
  } else if (joined) {
    help = remedies(problem.structure(), result);
  }
  AtResult at(problem, &result);
  const SolverOptions own = unscaled_at_the_point(options);
  CanonicalProblem canonical(at, own, result.counts, result.timing);
  const bool built = canonical.build().empty();
  std::string cause;
  if (built && (kink || result.status == Status::TinyStep ||
                result.status == Status::InertiaCorrectionFailed)) {
    cause = undefined_beside(canonical);
    if (cause.empty()) cause = few_digits(canonical);
  }
  if (!cause.empty() && kink) {
    drop_first_line();
    result.message += '\n' + cause;
    return;
  }
  if (!cause.empty()) help = std::move(cause);
  const auto wrong = built ? find_wrong_derivative(canonical, has_hessian) : std::nullopt;
  std::string verdict = wrong.value_or("");
  if (wrong && wrong->empty())
    verdict = "first and second derivatives agree with differences there";
  if (wrong && !wrong->empty()) {  // the cause, whatever else is seen
    help.clear();
    if (kink) drop_first_line();
  }
  for (const std::string& text : {verdict, help}) {
    if (text.empty()) continue;
    if (result.message.empty()) result.message = std::string(name_of(result.status));
    result.message += "\n" + text;
  }
}

std::string wrong_gradient_beside(Problem& problem, const SolverOptions& options, Result& result) {
  if (!is_finite(result)) return {};
  AtResult at(problem, &result);
  const SolverOptions own = unscaled_at_the_point(options);
  CanonicalProblem canonical(at, own, result.counts, result.timing);
  if (!canonical.build().empty()) return {};
  constexpr double kAside = 1e-3;
  const Eigen::VectorXd v = aside(canonical, canonical.starting_point().v, kAside);
  Evaluation here = unevaluated_point(canonical, canonical.starting_point()).evaluation;
  if (!canonical.first_derivatives(v, here)) return {};
  return find_wrong_gradient(canonical, v, here, "beside the answer");
}

}  // namespace ipminmax
