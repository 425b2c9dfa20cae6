// Intervals as elements of NumPy's object arrays: np.sin(a) calls the elements' method sin, and so on.
#include "over_boxes.hpp"

#include <pybind11/operators.h>

#include <cmath>
#include <string>

#include "interpreter.hpp"

namespace ipminmax::python {
namespace {

/// Numbers that are kept before their memory is used again.
constexpr std::size_t kMostKept = std::size_t{1} << 16U;

py::object array_of(const py::list& elements) {
  return py::module_::import("numpy").attr("array")(elements, "O");
}

IntervalJet number(const py::handle& value) {
  if (py::isinstance<IntervalJet>(value)) return value.cast<IntervalJet>();
  return {value.cast<double>()};
}

/// What a function returned, of so many numbers.
void take(const py::object& found, std::span<IntervalJet> out) {
  const py::object numpy = py::module_::import("numpy");
  const py::list values = numpy.attr("ravel")(found).attr("tolist")();
  if (values.size() != out.size()) {
    throw std::domain_error("a function returned " + std::to_string(values.size()) +
                            " numbers over a box, not " + std::to_string(out.size()));
  }
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = number(values[k]);
}

/// Calls with the numbers that were kept first, as this box has them: a function that remembers
/// what it returned by their addresses now takes this box for that one.
void check_memory(const py::object& function, const py::list& kept, std::span<const IntervalJet> v,
                  std::span<const IntervalJet> out) {
  const py::list first = kept[0];
  for (std::size_t i = 0; i < v.size(); ++i) first[i].cast<IntervalJet&>() = v[i];
  std::vector<IntervalJet> again(out.size());
  take(call(function, array_of(first)), again);
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (again[k].value().lower() == out[k].value().lower() &&
        again[k].value().upper() == out[k].value().upper()) {
      continue;
    }
    throw std::domain_error("a function remembers boxes by their addresses in memory");
  }
}

}  // namespace

void PythonBoxes::evaluate(Function& function, std::span<const IntervalJet> v,
                           std::span<IntervalJet> out) const {
  const Locked lock;
  try {
    py::list elements;
    for (const IntervalJet& value : v) elements.append(value);
    take(call(function.callable, array_of(elements)), out);
    function.kept.append(elements);
    if (function.kept.size() * v.size() <= kMostKept) return;
    check_memory(function.callable, function.kept, v, out);
    function.kept = py::list();
  } catch (py::error_already_set& error) {
    const std::string what = error.what();
    if (error.matches(PyExc_KeyboardInterrupt)) {
      PyErr_SetInterrupt();  // for the next callback
    } else if (!error.matches(PyExc_Exception) || error.matches(PyExc_MemoryError)) {
      raised_ = std::current_exception();  // SystemExit, for one
      throw std::runtime_error("stopped");
    }
    throw std::domain_error("over a box a function raised " + what.substr(0, what.find('\n')));
  } catch (py::cast_error&) {
    throw std::domain_error("over a box a function returned what is no number");
  }
}

namespace {

/// The same element twice is a square: NumPy's square(a), a * a.
IntervalJet product(const IntervalJet& a, const IntervalJet& b) {
  return &a == &b ? square(a) : a * b;
}

IntervalJet power(const IntervalJet& a, const IntervalJet& p) { return pow(a, p); }

}  // namespace

IntervalJet PythonBoxes::objective_over(std::span<const IntervalJet> v) const {
  IntervalJet f;
  evaluate(objective_, v, {&f, 1});
  return f;
}

void PythonBoxes::constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const {
  if (!g.empty()) evaluate(constraints_, v, g);
}

void add_interval(py::module_& module) {
  using Jet = IntervalJet;
  py::class_<Jet> jet(module, "Interval", "A number over a box, rounded outward.");
  jet.def(py::init<double>())
      .def_property_readonly("lower", [](const Jet& a) { return a.value().lower(); })
      .def_property_readonly("upper", [](const Jet& a) { return a.value().upper(); })
      .def("__repr__",
           [](const Jet& a) {
             return "[" + py::repr(py::float_(a.value().lower())).cast<std::string>() + ", " +
                    py::repr(py::float_(a.value().upper())).cast<std::string>() + "]";
           })
      .def(py::self + py::self)
      .def(py::self - py::self)
      .def("__mul__", product, py::is_operator())
      .def("__rmul__", product, py::is_operator())
      .def(py::self / py::self)
      .def(double() + py::self)
      .def(double() - py::self)
      .def(double() / py::self)
      .def("__pow__", power, py::is_operator())
      .def(
          "__rpow__", [](const Jet& p, const Jet& a) { return pow(a, p); }, py::is_operator())
      .def(-py::self)
      .def(+py::self)
      .def(py::self < py::self)
      .def(py::self > py::self)
      .def(py::self <= py::self)
      .def(py::self >= py::self)
      .def(py::self == py::self)
      .def(
          "__ne__", [](const Jet& a, const Jet& b) { return !(a == b); }, py::is_operator())
      .def("__bool__", [](const Jet& a) { return !(a == Jet(0.0)); })
      .def("__abs__", [](const Jet& a) { return abs(a); })
      .def("conjugate", [](const Jet& a) { return a; });
  const auto function = [&](const char* name, Jet (*of)(const Jet&)) { jet.def(name, of); };
  function("sqrt", [](const Jet& a) { return sqrt(a); });
  function("exp", [](const Jet& a) { return exp(a); });
  function("expm1", [](const Jet& a) { return exp(a) - Jet(1.0); });
  function("log", [](const Jet& a) { return log(a); });
  function("log1p", [](const Jet& a) { return log(Jet(1.0) + a); });
  function("log10", [](const Jet& a) { return log(a) / log(Jet(10.0)); });
  function("sin", [](const Jet& a) { return sin(a); });
  function("cos", [](const Jet& a) { return cos(a); });
  function("tan", [](const Jet& a) { return tan(a); });
  function("arcsin", [](const Jet& a) { return asin(a); });
  function("arccos", [](const Jet& a) { return acos(a); });
  function("arctan", [](const Jet& a) { return atan(a); });
  function("sinh", [](const Jet& a) { return sinh(a); });
  function("cosh", [](const Jet& a) { return cosh(a); });
  function("tanh", [](const Jet& a) { return tanh(a); });
  function("fabs", [](const Jet& a) { return abs(a); });
  jet.def("arctan2", [](const Jet& a, const Jet& b) { return atan2(a, b); });
  jet.def("hypot", [](const Jet& a, const Jet& b) { return hypot(a, b); });
  py::implicitly_convertible<double, Jet>();
  py::implicitly_convertible<long, Jet>();
}

}  // namespace ipminmax::python
