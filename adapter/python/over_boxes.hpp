#pragma once

#include <pybind11/pybind11.h>

#include <span>
#include <utility>

#include "core/interval.hpp"

namespace ipminmax::python {

/// Functions written with NumPy's operations, over boxes: they are called with arrays of Interval
/// objects. What they raise becomes a std::domain_error that says so.
class PythonBoxes final : public BoxFunctions {
 public:
  /// Callables of an array of n that return a number, or m of them.
  void set(pybind11::object objective, pybind11::object constraints) {
    objective_ = std::move(objective);
    constraints_ = std::move(constraints);
  }
  /// For the garbage collector, and to be cleared.
  [[nodiscard]] pybind11::object& objective() { return objective_; }
  [[nodiscard]] pybind11::object& constraints() { return constraints_; }

  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override;
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override;

 private:
  pybind11::object objective_ = pybind11::none(), constraints_ = pybind11::none();
};

/// The class Interval of the module: a number over a box, with NumPy's operations.
void add_interval(pybind11::module_& module);

}  // namespace ipminmax::python
