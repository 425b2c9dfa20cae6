#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <span>
#include <utility>

#include "core/formulas/interval.hpp"

namespace ipminmax::python {

/// Functions written with NumPy's operations, over boxes: they are called with arrays of Interval
/// objects. An Exception that they raise becomes a std::domain_error that says so.
class PythonBoxes final : public BoxFunctions {
 public:
  /// raised: gets what ends the solve, whatever else is caught on the way.
  explicit PythonBoxes(std::exception_ptr& raised) : raised_(raised) {}
  /// Callables of an array of n that return a number, or m of them.
  void set(pybind11::object objective, pybind11::object constraints) {
    objective_ = Function{std::move(objective), pybind11::list()};
    constraints_ = Function{std::move(constraints), pybind11::list()};
  }
  /// For the garbage collector, and to be cleared.
  [[nodiscard]] pybind11::object& objective() { return objective_.callable; }
  [[nodiscard]] pybind11::object& constraints() { return constraints_.callable; }

  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override;
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override;

 private:
  /// kept: the numbers of boxes, alive so that each has an address of its own.
  struct Function {
    pybind11::object callable = pybind11::none();
    pybind11::list kept{};
  };
  void evaluate(Function& function, std::span<const IntervalJet> v,
                std::span<IntervalJet> out) const;

  std::exception_ptr& raised_;
  mutable Function objective_, constraints_;
};

/// The class Interval of the module: a number over a box, with NumPy's operations.
void add_interval(pybind11::module_& module);

}  // namespace ipminmax::python
