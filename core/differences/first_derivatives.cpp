#include "core/differences/first_derivatives.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {

bool FirstDerivativeSource::evaluate(std::span<const double> v, FirstDerivatives& derivatives,
                                     bool want_gradient, bool want_jacobian) {
  const ProblemStructure& structure = model_.structure();
  derivatives.gradient.resize(v.size());
  derivatives.jacobian.resize(structure.jacobian.size());
  if (!all_finite(v)) return false;  // no model is asked there
  bool new_v = true;
  if (want_gradient) {
    ++gradients_;
    if (!model_.gradient(v, new_v, derivatives.gradient) || !all_finite(derivatives.gradient)) {
      return false;
    }
    new_v = false;
  }
  if (!want_jacobian || structure.constraint_lower.empty()) return true;
  ++jacobians_;
  return model_.jacobian(v, new_v, derivatives.jacobian) && all_finite(derivatives.jacobian);
}

}  // namespace ipminmax
