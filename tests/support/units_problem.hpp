#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <support/dice.hpp>
#include <support/forwarding_problem.hpp>

#include "core/result.hpp"

namespace ipminmax::testing {

/// The same problem in other units: variables u_i = v_i / unit_i, constraints and f times a factor
/// each.
class UnitsProblem final : public ForwardingProblem {
 public:
  UnitsProblem(Problem& problem, std::vector<double> units, std::vector<double> factors,
               double of_objective = 1.0)
      : ForwardingProblem(problem),
        structure_(problem.structure()),
        units_(std::move(units)),
        factors_(std::move(factors)),
        of_objective_(of_objective),
        v_(units_.size()),
        lambda_(factors_.size()) {
    for (std::size_t i = 0; i < units_.size(); ++i) {
      change(structure_.variable_lower[i], 1.0 / units_[i]);
      change(structure_.variable_upper[i], 1.0 / units_[i]);
    }
    for (std::size_t j = 0; j < factors_.size(); ++j) {
      change(structure_.constraint_lower[j], factors_[j]);
      change(structure_.constraint_upper[j], factors_[j]);
    }
  }
  /// Powers of ten from 10^-digits to 10^digits.
  [[nodiscard]] static UnitsProblem random(Problem& problem, int digits, std::uint64_t seed) {
    Dice dice(seed);
    const auto powers = [&](std::size_t size) {
      std::vector<double> all(size);
      for (double& unit : all) unit = std::pow(10.0, dice.below(2 * digits + 1) - digits);
      return all;
    };
    const ProblemStructure& structure = problem.structure();
    std::vector<double> units = powers(structure.variable_players.size());
    return {problem, std::move(units), powers(structure.constraint_players.size())};
  }

  /// Of a point in these units, that of the problem.
  [[nodiscard]] std::vector<double> original(std::span<const double> u) const {
    std::vector<double> v(u.size());
    for (std::size_t i = 0; i < u.size(); ++i) v[i] = units_[i] * u[i];
    return v;
  }

  /// Of a result in these units, that of the problem.
  [[nodiscard]] Result original(Result result) const {
    result.v = original(std::span<const double>(result.v));
    result.objective /= of_objective_;
    for (std::size_t j = 0; j < factors_.size(); ++j)
      result.lambda[j] *= factors_[j] / of_objective_;
    for (std::size_t i = 0; i < units_.size(); ++i) {
      result.z_lower[i] /= units_[i] * of_objective_;
      result.z_upper[i] /= units_[i] * of_objective_;
    }
    return result;
  }
  /// Of a result of the problem, that in these units.
  [[nodiscard]] Result in_units(Result result) const {
    result.objective *= of_objective_;
    for (std::size_t j = 0; j < factors_.size(); ++j) {
      result.lambda[j] *= of_objective_ / factors_[j];
      result.constraints[j] *= factors_[j];
    }
    for (std::size_t i = 0; i < units_.size(); ++i) {
      result.v[i] /= units_[i];
      result.z_lower[i] *= units_[i] * of_objective_;
      result.z_upper[i] *= units_[i] * of_objective_;
    }
    return result;
  }
  [[nodiscard]] double unit(std::size_t variable) const { return units_[variable]; }
  [[nodiscard]] double factor(std::size_t constraint) const { return factors_[constraint]; }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (start.needs_multipliers || !ForwardingProblem::starting_point(start)) return false;
    for (std::size_t i = 0; i < units_.size(); ++i) start.v[i] /= units_[i];
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> u, bool new_v, double& f) override {
    const bool defined = ForwardingProblem::objective(at(u), new_v, f);
    f *= of_objective_;
    return defined;
  }
  [[nodiscard]] bool gradient(std::span<const double> u, bool new_v,
                              std::span<double> grad) override {
    if (!ForwardingProblem::gradient(at(u), new_v, grad)) return false;
    for (std::size_t i = 0; i < units_.size(); ++i) grad[i] *= units_[i] * of_objective_;
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> u, bool new_v,
                                 std::span<double> g) override {
    if (!ForwardingProblem::constraints(at(u), new_v, g)) return false;
    for (std::size_t j = 0; j < factors_.size(); ++j) g[j] *= factors_[j];
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> u, bool new_v,
                              std::span<double> values) override {
    if (!ForwardingProblem::jacobian(at(u), new_v, values)) return false;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, col] = structure_.jacobian[k];
      values[k] *= factors_[static_cast<std::size_t>(row)] * units_[static_cast<std::size_t>(col)];
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> u, bool new_v, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    for (std::size_t j = 0; j < factors_.size(); ++j) lambda_[j] = factors_[j] * lambda[j];
    if (!ForwardingProblem::hessian(at(u), new_v, of_objective_ * sigma, lambda_, true, values))
      return false;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, col] = structure_.hessian[k];
      values[k] *= units_[static_cast<std::size_t>(row)] * units_[static_cast<std::size_t>(col)];
    }
    return true;
  }

 private:
  static void change(double& bound, double factor) {
    if (std::abs(bound) < 1e19) bound *= factor;
  }
  [[nodiscard]] std::span<const double> at(std::span<const double> u) {
    for (std::size_t i = 0; i < units_.size(); ++i) v_[i] = units_[i] * u[i];
    return v_;
  }

  ProblemStructure structure_;
  std::vector<double> units_, factors_;
  double of_objective_;
  std::vector<double> v_, lambda_;
};

}  // namespace ipminmax::testing
