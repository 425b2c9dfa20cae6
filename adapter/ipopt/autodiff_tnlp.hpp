#pragma once

#include <typeinfo>
#include <utility>

#include "../../core/formulas/autodiff_problem.hpp"
#include "problem_tnlp.hpp"

namespace ipminmax {

/// A model written as formulas (core/autodiff_problem.hpp) as an Ipopt model with exact sparse
/// derivatives: for MinMaxApplication with its players, for IpoptApplication as a minimization over
/// all variables.
///
///   Ipopt::SmartPtr<Ipopt::TNLP> model = new ipminmax::AutodiffTNLP(Game{}, {.players = ...});
///   app->OptimizeTNLP(model);
///
/// finalize_solution, intermediate_callback and all other methods of a TNLP may be overridden.
/// Throws std::invalid_argument as AutodiffProblem does.
template <class Functions>
class AutodiffTNLP : private AutodiffProblem<Functions>, public GameTNLP {
 public:
  AutodiffTNLP(Functions formulas, ModelData data)
      : AutodiffProblem<Functions>(std::move(formulas), std::move(data)),
        GameTNLP(static_cast<AutodiffProblem<Functions>&>(*this)) {}

  /// As AutodiffProblem::functions: for the next solves.
  using AutodiffProblem<Functions>::functions;
  /// As AutodiffProblem::set_start: for the next solves.
  using AutodiffProblem<Functions>::set_start;
  [[nodiscard]] AutodiffProblem<Functions>& problem() { return *this; }
  /// Copies the formulas; null for a derived class that does not override it.
  [[nodiscard]] Ipopt::SmartPtr<Ipopt::TNLP> clone_model() const override {
    if (typeid(*this) != typeid(AutodiffTNLP)) return nullptr;
    return new AutodiffTNLP(functions(), this->data());
  }
};

}  // namespace ipminmax
