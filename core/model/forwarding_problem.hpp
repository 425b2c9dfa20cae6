#pragma once

#include <algorithm>
#include <memory>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Passes everything on to another problem, which must outlive it, but single rows and clones: what
/// derives from it may have other ones.
class ForwardingProblem : public Problem {
 public:
  explicit ForwardingProblem(Problem& model) : model_(&model) {}

  [[nodiscard]] const ProblemStructure& structure() const override { return model_->structure(); }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    return model_->starting_point(start);
  }
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    return model_->user_scaling(scaling);
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    return model_->objective(v, new_v, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    return model_->gradient(v, new_v, grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    return model_->constraints(v, new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    return model_->jacobian(v, new_v, values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return model_->hessian(v, new_v, sigma, lambda, new_lambda, values);
  }
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    return model_->hessian_errors(v, sigma, lambda, row_errors);
  }
  [[nodiscard]] const BoxFunctions* over_boxes() const override { return model_->over_boxes(); }

 protected:
  [[nodiscard]] Problem& model() const { return *model_; }

  /// A copy of a form of a model, which has a clone of the model; null: there is none with the
  /// model's patterns.
  template <class Form>
  [[nodiscard]] static std::unique_ptr<Form> cloned(const Form& form) {
    std::shared_ptr<Problem> model = form.model().clone();
    const ProblemStructure& s = form.model().structure();
    if (!model || model->structure().jacobian != s.jacobian ||
        model->structure().hessian != s.hessian) {
      return nullptr;
    }
    auto copy = std::make_unique<Form>(form);
    copy->model_ = model.get();
    copy->owned_ = std::move(model);
    return copy;
  }

 private:
  Problem* model_;
  std::shared_ptr<Problem> owned_;  ///< of a clone
};

/// The same with the model's rows.
class SameRows : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v,
                                     bool new_v, std::span<double> g) override {
    return model().constraint_rows(rows, v, new_v, g);
  }
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v,
                                   bool new_v, std::span<double> values) override {
    return model().jacobian_rows(rows, v, new_v, values);
  }
};

/// A model of which the structure is changed, not its size.
class Restructured : public SameRows {
 public:
  explicit Restructured(Problem& model) : SameRows(model), changed(model.structure()) {}
  [[nodiscard]] const ProblemStructure& structure() const override { return changed; }

  ProblemStructure changed;
};

/// What evaluates some rows evaluates all of them as those.
template <class Base>
class ByRows : public Base {
 public:
  using Base::Base;
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    return this->constraint_rows(all(), v, new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    return this->jacobian_rows(all(), v, new_v, values);
  }

 private:
  std::span<const Index> all() {
    all_.resize(this->structure().constraint_players.size());
    std::iota(all_.begin(), all_.end(), 0);
    return all_;
  }
  std::vector<Index> all_;
};

/// A model with a result as its starting point; null: its own.
class AtResult final : public SameRows {
 public:
  AtResult(Problem& model, const Result* result) : SameRows(model), result_(result) {}
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (result_ == nullptr) return model().starting_point(start);
    std::ranges::copy(result_->v, start.v.begin());
    if (!start.needs_multipliers) return true;
    std::ranges::copy(result_->lambda, start.lambda.begin());
    std::ranges::copy(result_->z_lower, start.z_lower.begin());
    std::ranges::copy(result_->z_upper, start.z_upper.begin());
    return true;
  }
  void set(const Result* result) { result_ = result; }

 private:
  const Result* result_;
};

}  // namespace ipminmax
