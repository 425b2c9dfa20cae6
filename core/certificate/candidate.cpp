#include "core/certificate/candidate.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/parameters.hpp"
#include "core/model/products.hpp"
#include "core/point/step_length.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

Eigen::VectorXd sizes_of(const CanonicalProblem& canonical, const Point& point) {
  return point.iterate.v.cwiseAbs().cwiseMax(canonical.starting_point().v.cwiseAbs());
}

/// What the gradient of L is a sum of, and what variables of these sizes change it by.
Eigen::VectorXd terms_of_gradient(const CanonicalProblem& canonical, const Point& point,
                                  const Eigen::VectorXd& size) {
  const Evaluation& here = point.evaluation;
  Eigen::VectorXd terms = here.gradient.cwiseAbs();
  for (std::size_t k = 0; k < here.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    terms[i] += std::abs(here.hessian[k]) * size[j];
    if (i != j) terms[j] += std::abs(here.hessian[k]) * size[i];
  }
  for (std::size_t k = 0; k < here.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    terms[col] += std::abs(here.jacobian[k] * point.iterate.lambda[row]);
  }
  return terms;
}

/// Whether the gradient along Max's free variables vanishes at the end of the Newton step: no step
/// takes the slope away of what f is linear in, and K with it is singular. Along a face of worst
/// cases all that it is a sum of is rounding of other terms, over the variable's whole size.
bool is_stationary_at_end(const CanonicalProblem& canonical, const Candidate& candidate) {
  const Point& point = candidate.point;
  const Iterate& end = candidate.newton.end.iterate;
  Eigen::VectorXd left = point.evaluation.gradient;
  add_hessian_product(canonical, point.evaluation, end.v - point.iterate.v, left);
  add_transposed_product(canonical, point.evaluation,
                         without_inactive(canonical, candidate.classes, end.lambda), left);
  const Eigen::VectorXd size = sizes_of(canonical, point);
  const Eigen::VectorXd terms = terms_of_gradient(canonical, point, size);
  const double none = parameter::kRounding * terms.cwiseProduct(size).maxCoeff();
  for (Index i = canonical.y().begin; i < canonical.y().end; ++i) {
    if (candidate.classes[i] != BoundClass::Inactive) continue;
    const double slope = std::abs(left[i]);
    if (!(slope <= parameter::kHardly * terms[i] || slope * size[i] <= none)) return false;
  }
  return true;
}

/// Of the candidate at v with lambda; null: undefined there.
const Evaluation* rounded_derivatives(CanonicalProblem& canonical, Candidate& candidate,
                                      const Eigen::VectorXd& v, const Eigen::VectorXd& lambda) {
  if (!candidate.rounded || candidate.rounded->v != v || candidate.rounded->lambda != lambda) {
    candidate.rounded = RoundedDerivatives{v, lambda, candidate.point.evaluation};
    if (canonical.first_derivatives(v, candidate.rounded->evaluation) != EvaluationStatus::Ok ||
        canonical.second_derivatives(v, lambda, candidate.rounded->evaluation) !=
            EvaluationStatus::Ok) {
      candidate.rounded.reset();
      return nullptr;
    }
  }
  return &candidate.rounded->evaluation;
}

}  // namespace

Eigen::VectorXd without_inactive(const CanonicalProblem& canonical, const BoundClasses& classes,
                                 Eigen::VectorXd lambda) {
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const Index slack = canonical.slack_of(j);
    const bool inactive = slack >= 0 && classes[slack] == BoundClass::Inactive;
    if (inactive || classes.is_held(j)) lambda[j] = 0.0;
  }
  return lambda;
}

Units certain_units(CanonicalProblem& canonical, Candidate& candidate) {
  const Point& point = candidate.point;
  Evaluation certain = point.evaluation;
  for (std::size_t k = 0; k < candidate.newton.hessian_change.size(); ++k) {
    if (std::abs(certain.hessian[k]) < parameter::kConfirmed * candidate.newton.hessian_change[k]) {
      certain.hessian[k] = 0.0;
    }
  }
  const Eigen::VectorXd size = sizes_of(canonical, point);
  Eigen::VectorXd step = parameter::kRounding * size;
  keep_within_bounds(canonical, point.iterate.v, parameter::kLittle, step);
  const Evaluation* there =
      rounded_derivatives(canonical, candidate, point.iterate.v + step,
                          without_inactive(canonical, candidate.classes, point.iterate.lambda));
  const auto measured = [&] {
    return units_of(canonical, point.iterate.v, certain,
                    {.min_first = candidate.min_first});
  };
  if (there == nullptr) return measured();
  const auto keep = [](double changed, double& value) {
    if (!(std::abs(changed - value) <= std::abs(value))) value = 0.0;
  };
  for (std::size_t k = 0; k < certain.hessian.size(); ++k) {
    if (certain.hessian[k] != 0.0) keep(there->hessian[k], certain.hessian[k]);
  }
  for (std::size_t k = 0; k < certain.jacobian.size(); ++k) {
    keep(there->jacobian[k], certain.jacobian[k]);
  }
  return measured();
}

bool drop_inactive_multipliers(CanonicalProblem& canonical, const BoundClasses& classes,
                               Point& point) {
  const Eigen::VectorXd lambda = without_inactive(canonical, classes, point.iterate.lambda);
  if (lambda == point.iterate.lambda) return true;
  return canonical.second_derivatives(point.iterate.v, lambda, point.evaluation) ==
         EvaluationStatus::Ok;
}

Eigen::VectorXd error_of(TestContext& c, const Point& point, const BoundClasses& classes,
                         const Units& units) {
  Eigen::VectorXd error = c.hessian_error_in(units);
  Eigen::VectorXd lambda = point.iterate.lambda;
  bool any = false;
  for (Index j = 0; j < c.canonical.constraints(); ++j) {
    const Index slack = c.canonical.slack_of(j);
    if (slack < 0 || classes[slack] == BoundClass::Active) continue;
    any = any || classes[slack] == BoundClass::Doubtful;
    lambda[j] = 0.0;
  }
  if (error.size() == 0) error.setZero(c.canonical.variables());
  if (!any) return error;
  Evaluation without = point.evaluation;
  if (c.canonical.second_derivatives(point.iterate.v, lambda, without) != EvaluationStatus::Ok) {
    return Eigen::VectorXd::Constant(c.canonical.variables(), kInfinity);
  }
  for (std::size_t k = 0; k < without.hessian.size(); ++k) {
    without.hessian[k] -= point.evaluation.hessian[k];
  }
  add_row_sums(c.canonical, without.hessian, units.variable, error);
  return error;
}

bool evaluate(CanonicalProblem& canonical, Point& point) {
  return canonical.constraints(point.iterate.v, point.evaluation.c) == EvaluationStatus::Ok &&
         evaluate_derivatives(canonical, point) == EvaluationStatus::Ok;
}

bool evaluate_objective(CanonicalProblem& canonical, Point& point) {
  return canonical.objective(point.iterate.v, point.evaluation.f) == EvaluationStatus::Ok;
}

void confirm(TestContext& c, Candidate& candidate, ActiveSetSystem& system) {
  system.assemble(ActiveSetSystem::kSufficient);
  candidate.error = error_of(c, candidate.point, candidate.classes, candidate.units);
  Regularization shift;
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step, double /*share*/) {
    return solve_accurately(c.kkt, system.assembled(), rhs, step, shift);
  };
  const auto converges = [&] {
    return c.newton_confirms(system, candidate.point, solve, candidate.newton, shift.y > 0.0);
  };
  candidate.converges = converges();
  if (!candidate.converges && candidate.proximal > 0.0) {  // to one of several solutions
    shift.y = candidate.proximal;
    candidate.converges = converges();
  }
  if (candidate.proximal > 0.0) {
    candidate.converges = candidate.converges && is_stationary_at_end(c.canonical, candidate);
  }
  if (candidate.newton.done) candidate.error += candidate.newton.error;
}

std::vector<bool> droppable(const CanonicalProblem& canonical, const Dependences& dependences) {
  std::vector<bool> rows(at(canonical.constraints()), false);
  for (const Dependence& dependence : dependences.found) {
    rows[at(dependence.row)] = dependence.identical;
  }
  return rows;
}

bool rows_are_left_out(const CanonicalProblem& canonical, const Candidate& candidate, bool of_max) {
  if (!candidate.dependences) return true;
  const auto open = [&](const Dependence& d) {
    const bool max = canonical.max_constraints().contains(d.row);
    return (max || !of_max) && !candidate.classes.is_redundant(d.row);
  };
  return candidate.dependences->complete &&
         std::ranges::none_of(candidate.dependences->found, open);
}

bool is_near(const TestContext& c, const Iterate& from, const Eigen::VectorXd& to,
             const Units& units, double share) {
  const double size = size_of_problem(c.canonical, from, units);
  const Eigen::VectorXd& start = c.canonical.starting_point().v;
  for (const IndexRange own : {c.canonical.x(), c.canonical.y()}) {
    for (Index i = own.begin; i < own.end; ++i) {
      const double length = std::abs(to[i] - from.v[i]);
      if (!(length <= share * size * units.variable[i])) return false;
      const double own_size = std::max(std::abs(from.v[i]), std::abs(start[i]));
      const bool within_size = length <= parameter::kTrace * own_size;
      const bool within_one =
          length <= parameter::kTrace && length <= c.far() * size * units.variable[i];
      if (!within_size && !within_one) return false;
    }
  }
  return true;
}

}  // namespace ipminmax
