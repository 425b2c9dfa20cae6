#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <memory>
#include <span>

#include "core/formulas/interval.hpp"

namespace ipminmax::python {

class Recording;

/// The functions of a model over boxes, recorded when a solve asks for them first. An Exception
/// that they raise becomes a std::domain_error that says so.
class RecordedBoxes final : public BoxFunctions {
 public:
  /// raised: gets what ends the solve, whatever else is caught on the way.
  explicit RecordedBoxes(std::exception_ptr& raised) : raised_(raised) {}
  /// A callable that returns a Recording; for the garbage collector, and to be set and cleared.
  [[nodiscard]] pybind11::object& record() { return record_; }
  /// The next solve records anew.
  void forget() { recording_.reset(); }

  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override;
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override;

 private:
  const Recording& recording() const;

  std::exception_ptr& raised_;
  pybind11::object record_ = pybind11::none();
  mutable std::shared_ptr<const Recording> recording_;
};

/// The classes Formula, a number that remembers how it was computed, Recording, the functions of a
/// model as they were computed from such numbers, and Formulas, their derivatives.
void add_formulas(pybind11::module_& module);

}  // namespace ipminmax::python
