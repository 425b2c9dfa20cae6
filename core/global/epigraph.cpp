#include <algorithm>
#include <cmath>
#include <limits>

#include "core/model/extended_structure.hpp"
#include "core/model/model_start.hpp"
#include "core/model/norms.hpp"
#include "core/robust.hpp"

namespace ipminmax {
namespace {

/// min t subject to the model's constraints and f(x, y) - t <= 0, a robust constraint.
class Epigraph final : public Problem {
 public:
  explicit Epigraph(Problem& model) : model_(model), structure_(model.structure()) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    n_ = add_variable(structure_, Player::Min, -kInfinity, kInfinity, {-1, "t"});
    m_ = add_constraint(structure_, Player::Min, -kInfinity, 0.0, {-1, "f - t"});
    entries_ = structure_.jacobian.size();
    for (Index i = 0; i <= n_; ++i) structure_.jacobian.push_back({m_, i});
    structure_.nonlinear_variables.reset();
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (start.needs_multipliers) return false;
    const auto own = model_start(model_);
    if (!own) return false;
    std::ranges::copy(*own, start.v.begin());
    double f = 0.0;
    if (all_finite(*own) && model_.objective(*own, true, f) && std::isfinite(f)) start.v.back() = f;
    return true;
  }
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    if (!model_.user_scaling(scaling)) return false;
    if (!scaling.variables.empty()) scaling.variables.push_back(std::abs(scaling.objective));
    if (!scaling.constraints.empty()) scaling.constraints.push_back(std::abs(scaling.objective));
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = v.back();
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    grad.back() = 1.0;
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    const auto own = v.first(size(n_));
    double f = 0.0;
    if (m_ > 0 && !model_.constraints(own, true, g.first(size(m_)))) return false;
    if (!model_.objective(own, m_ == 0, f)) return false;
    g.back() = f - v.back();
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    const auto own = v.first(size(n_));
    if (entries_ > 0 && !model_.jacobian(own, true, values.first(entries_))) return false;
    values.back() = -1.0;
    return model_.gradient(own, entries_ == 0, values.subspan(entries_, size(n_)));
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    return model_.hessian(v.first(size(n_)), true, lambda.back(), lambda.first(size(m_)), true,
                          values);
  }
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    row_errors.back() = 0.0;
    return model_.hessian_errors(v.first(size(n_)), lambda.back(), lambda.first(size(m_)),
                                 row_errors.first(size(n_)));
  }

 private:
  static std::size_t size(Index i) { return static_cast<std::size_t>(i); }

  Problem& model_;
  ProblemStructure structure_;
  Index n_ = 0, m_ = 0;
  std::size_t entries_ = 0;  ///< of the model's Jacobian
};

}  // namespace

std::unique_ptr<Problem> make_epigraph(Problem& model) { return std::make_unique<Epigraph>(model); }

}  // namespace ipminmax
