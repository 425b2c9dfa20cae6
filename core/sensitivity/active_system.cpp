#include "core/sensitivity/active_system.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/active_set.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/scaling.hpp"
#include "core/kkt/block.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/parameters.hpp"
#include "core/point/point.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

std::vector<double> joined(std::span<const double> variables, std::span<const double> constraints) {
  std::vector<double> all(variables.begin(), variables.end());
  all.insert(all.end(), constraints.begin(), constraints.end());
  return all;
}

Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options) {
  Bounds bounds{joined(structure.variable_lower, structure.constraint_lower),
                joined(structure.variable_upper, structure.constraint_upper)};
  for (double& value : bounds.lower) {
    if (value <= options.nlp_lower_bound_inf) value = -kInfinity;
  }
  for (double& value : bounds.upper) {
    if (value >= options.nlp_upper_bound_inf) value = kInfinity;
  }
  return bounds;
}

std::vector<double> signs_of(const ProblemStructure& structure) {
  std::vector<double> signs;
  for (const auto* players : {&structure.variable_players, &structure.constraint_players}) {
    for (const Player player : *players) signs.push_back(player == Player::Min ? 1.0 : -1.0);
  }
  return signs;
}

std::string place_name(const ProblemStructure& structure, std::size_t place) {
  const std::size_t n = structure.variable_players.size();
  const auto& names = place < n ? structure.variable_names : structure.constraint_names;
  const std::size_t i = place < n ? place : place - n;
  return (place < n ? "variable " : "constraint ") +
         (i < names.size() ? names[i] : std::to_string(i));
}

namespace {

/// Derivatives that are known at a point, as a model that starts there.
class KnownDerivatives final : public Restructured {
 public:
  KnownDerivatives(Problem& problem, const std::vector<double>& v,
                   const std::vector<double>& jacobian, const std::vector<double>& hessian)
      : Restructured(problem), v_(v), jacobian_(jacobian), hessian_(hessian) {}
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);  // lengths do not depend on it
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double> values) override {
    std::ranges::copy(jacobian_, values.begin());
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double> values) override {
    std::ranges::copy(hessian_, values.begin());
    return true;
  }

 private:
  const std::vector<double>&v_, &jacobian_, &hessian_;
};

}  // namespace

std::vector<double> lengths_of(Problem& problem, const ProblemStructure& structure,
                               const SolverOptions& options, const std::vector<double>& v,
                               const std::vector<double>& jacobian,
                               const std::vector<double>& hessian) {
  std::vector<double> lengths(v.size() + structure.constraint_lower.size(), 1.0);
  SolverOptions unscaled = options;
  unscaled.nlp_scaling_method = Scaling::None;
  unscaled.hessian_approximation = HessianApproximation::Exact;
  unscaled.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  unscaled.warm_start_init_point = false;
  Counts counts;
  Timing timing;
  KnownDerivatives known(problem, v, jacobian, hessian);
  known.changed = structure;
  CanonicalProblem canonical(known, unscaled, counts, timing);
  if (!canonical.build().empty()) return lengths;
  Point point = unevaluated_point(canonical, canonical.starting_point());
  const auto visit = [&](auto use) {
    for (const IndexRange own : {canonical.x(), canonical.y()}) {
      for (const Index i : indices(own)) use(i, at(canonical.model_variable(i)));
    }
  };
  visit([&](Index i, std::size_t place) { point.iterate.v[i] = v[place]; });
  if (!evaluate_derivatives(canonical, point)) return lengths;
  const VariableScaling scaling = variable_scaling(canonical, point.iterate.v, point.evaluation);
  visit([&](Index i, std::size_t place) { lengths[place] = scaling.variable[i]; });
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const Index row = canonical.model_constraint(j);
    if (row >= 0) lengths[v.size() + at(row)] = 1.0 / scaling.constraint[j];
  }
  return lengths;
}

Hold hold_of(double value, double lower, double upper, double pressure, double length, int& weak) {
  weak = 0;
  if (lower == upper) return Hold::Fixed;
  const auto found = [&](int side, double strict_ratio) {
    return class_of(std::max(-side * pressure, 0.0) * length * length,
                    std::max(side < 0 ? value - lower : upper - value, 0.0), strict_ratio);
  };
  for (const int side : {1, -1}) {
    if (found(side, parameters::certificate::kStrictRatio) == BoundClass::WeaklyActive) weak = side;
  }
  if (found(-1, 1.0) == BoundClass::Active) return Hold::Lower;
  return found(1, 1.0) == BoundClass::Active ? Hold::Upper : Hold::Free;
}

}  // namespace ipminmax
