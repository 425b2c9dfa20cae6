// Functions written with NumPy's operations, recorded once: they are called with an array of
// Formula objects, and what they compute is evaluated, differentiated and bounded over boxes
// without Python from then on. Branches on values and float() cannot be recorded: TypeError.
#include "formulas.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <ranges>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/formulas/autodiff_problem.hpp"
#include "interpreter.hpp"

namespace ipminmax::python {
namespace {

/// Operations of one recording, beyond which a function is better called than recorded.
constexpr std::size_t kMostOperations = 4'000'000;
/// Products of first derivatives that the Hessians of all functions may need.
constexpr double kMostProducts = 3e7;

/// kind of operation, function of the number type, method that NumPy calls
#define FUNCTIONS_OF_ONE(use)                                                            \
  use(Sqrt, sqrt, "sqrt") use(Exp, exp, "exp") use(Log, log, "log") use(Sin, sin, "sin") \
      use(Cos, cos, "cos") use(Tan, tan, "tan") use(Asin, asin, "arcsin")                \
          use(Acos, acos, "arccos") use(Atan, atan, "arctan") use(Sinh, sinh, "sinh")    \
              use(Cosh, cosh, "cosh") use(Tanh, tanh, "tanh") use(Abs, abs, "__abs__")

enum class Kind : std::uint8_t {
  Constant,
  Add,
  Subtract,
  Multiply,
  Divide,
  Power,
  Atan2,
  Hypot,
#define KIND(kind, function, method) kind,
  FUNCTIONS_OF_ONE(KIND)
#undef KIND
};

template <class T>
T apply(Kind kind, const T& a, const T& b) {
  switch (kind) {
    case Kind::Constant:
      break;
    case Kind::Add:
      return a + b;
    case Kind::Subtract:
      return a - b;
    case Kind::Multiply:
      return &a == &b ? square(a) : a * b;
    case Kind::Divide:
      return a / b;
    case Kind::Power:
      return pow(a, b);
    case Kind::Atan2:
      return atan2(a, b);
    case Kind::Hypot:
      return hypot(a, b);
#define APPLY(kind, function, method) \
  case Kind::kind:                    \
    return function(a);
      FUNCTIONS_OF_ONE(APPLY)
#undef APPLY
  }
  return a;
}

/// a and b: inputs 0, ..., n - 1, then earlier operations; -1: the constant.
struct Operation {
  Kind kind;
  bool is_total;  ///< defined for all finite inputs
  Index a, b;
  double constant;
  [[nodiscard]] bool is_like(const Operation& other) const {
    return kind == other.kind && a == other.a && b == other.b;
  }
};

/// The operations that were recorded.
struct Graph {
  Index inputs = 0;
  std::vector<Operation> operations{};

  [[nodiscard]] const Operation* find(Index node) const {
    return node < inputs ? nullptr : &operations[static_cast<std::size_t>(node - inputs)];
  }
};

/// An input, or the result of an operation.
struct Formula {
  std::shared_ptr<Graph> graph;
  Index node = 0;
};

bool is_constant(const Formula& a) {
  const Operation* of = a.graph->find(a.node);
  return of != nullptr && of->kind == Kind::Constant;
}
double constant_of(const Formula& a) { return a.graph->find(a.node)->constant; }

Formula add(const std::shared_ptr<Graph>& graph, Operation operation) {
  if (graph->operations.size() == kMostOperations) throw py::type_error("too many operations");
  const auto total = [&](Index node) {
    const Operation* of = graph->find(node);
    return of == nullptr || of->is_total;
  };
  constexpr std::array kPartial = {Kind::Divide, Kind::Sqrt, Kind::Exp,  Kind::Log, Kind::Tan,
                                   Kind::Asin,   Kind::Acos, Kind::Sinh, Kind::Cosh};
  const auto& [kind, is_total, a, b, p] = operation;
  const bool is_partial = kind == Kind::Power ? b >= 0 || p < 0.0 || p != std::floor(p)
                                              : std::ranges::count(kPartial, kind) > 0;
  operation.is_total = !is_partial && std::isfinite(p) && total(a) && total(b);
  graph->operations.push_back(operation);
  return {graph, graph->inputs + static_cast<Index>(graph->operations.size()) - 1};
}
Formula constant(const std::shared_ptr<Graph>& graph, double value) {
  return add(graph, {Kind::Constant, false, -1, -1, value});
}
/// With a number as second operand, or as first one. Zeros of a matrix leave nothing in the
/// pattern, unless what they multiply may be undefined.
Formula record(Kind kind, const Formula& a, double b, bool reflected = false) {
  if (is_constant(a)) {
    const Plain own = constant_of(a);
    return constant(a.graph,
                    (reflected ? apply(kind, Plain(b), own) : apply(kind, own, Plain(b))).value());
  }
  const Operation* of = a.graph->find(a.node);
  if (kind == Kind::Multiply && b == 0.0 && (of == nullptr || of->is_total))
    return constant(a.graph, 0.0);
  return add(a.graph, {kind, false, reflected ? -1 : a.node, reflected ? a.node : -1, b});
}
Formula record(Kind kind, const Formula& a, const Formula& b) {
  if (a.graph != b.graph) throw py::type_error("a number of another recording");
  const bool first = is_constant(a), second = is_constant(b);
  if (kind == Kind::Add && first && constant_of(a) == 0.0) return b;
  if (kind == Kind::Add && second && constant_of(b) == 0.0) return a;
  if (first) return record(kind, b, constant_of(a), true);
  if (second) return record(kind, a, constant_of(b));
  return add(a.graph, {kind, false, a.node, b.node, 0.0});
}
/// A function of one number.
Formula record(Kind kind, const Formula& a) {
  if (is_constant(a)) {
    const Plain own = constant_of(a);
    return constant(a.graph, apply(kind, own, own).value());
  }
  return add(a.graph, {kind, false, a.node, a.node, 0.0});
}

}  // namespace

/// Functions of a graph, and which operations each of them needs, in their order.
class Recording {
 public:
  /// Of numbers or Formula objects; any: one of the inputs.
  Recording(const Formula& any, const py::list& rows, const py::object& f) : graph_(any.graph) {
    for (const py::handle& row : rows) add_output(row);
    add_output(f);
    graph_ = std::make_shared<Graph>(*graph_);
    balance_sums();
    needed_.resize(outputs_.size() + 1);
    std::vector<std::size_t> seen(graph_->operations.size(), needed_.size());
    for (std::size_t j = 0; j <= rows.size(); ++j)
      needed_[j] = needed_for({&outputs_[j], 1}, j, seen);
    needed_.back() = needed_for({outputs_.data(), rows.size()}, rows.size() + 1, seen);
  }

  [[nodiscard]] std::size_t inputs() const { return static_cast<std::size_t>(graph_->inputs); }
  [[nodiscard]] std::size_t rows() const { return outputs_.size() - 1; }
  /// Has the same operations, with other numbers in them; false: they are others.
  [[nodiscard]] bool update(const Recording& again) {
    if (again.outputs_ != outputs_ ||
        !std::ranges::equal(again.graph_->operations, graph_->operations,
                            std::mem_fn(&Operation::is_like))) {
      return false;
    }
    graph_->operations = again.graph_->operations;
    return true;
  }

  /// Whether constraints are better evaluated together: each by itself they repeat operations, and
  /// each visits the inputs once.
  [[nodiscard]] bool has_much_in_common() const {
    constexpr std::size_t kRepeated = 3, kMostVisits = 100'000'000;
    std::size_t operations = 0;
    for (std::size_t j = 0; j < rows(); ++j) operations += needed_[j].size();
    return operations > kRepeated * needed_.back().size() || rows() * inputs() > kMostVisits;
  }

  /// Throws if there are kinks, or second derivatives cost more than calls do.
  void require_derivatives(bool by_rows) const {
    ProductCount count{std::vector<bool>(graph_->operations.size()),
                       std::vector<std::vector<Index>>(graph_->operations.size())};
    for (std::size_t j = by_rows ? 0 : rows(); j <= rows(); ++j) count_products(needed_[j], count);
    if (!by_rows) count_products(needed_.back(), count);
  }

  template <class T>
  T objective(std::span<const T> v) const {
    return run(rows(), v)[outputs_.back()];
  }
  template <class T>
  T row(std::size_t j, std::span<const T> v) const {
    return run(j, v)[outputs_[j]];
  }
  template <class T>
  void all_rows(std::span<const T> v, std::span<T> g) const {
    const Values<T> values = run(needed_.size() - 1, v);
    for (std::size_t j = 0; j < g.size(); ++j) g[j] = values[outputs_[j]];
  }

 private:
  [[nodiscard]] std::size_t at(Index node) const {
    return static_cast<std::size_t>(node - graph_->inputs);
  }
  [[nodiscard]] const Operation& operation(Index k) const {
    return graph_->operations[static_cast<std::size_t>(k)];
  }

  /// wanted, reads: of each operation, empty between sets.
  struct ProductCount {
    std::vector<bool> wanted;
    std::vector<std::vector<Index>> reads;
    double products = 0.0;
  };
  /// Of all operations with second derivatives |da| |db|, and what the sparse gradients of their
  /// operands take.
  void count_products(const std::vector<Index>& set, ProductCount& count) const {
    auto& [wanted, reads, products] = count;
    const auto want = [&](Index node) {
      if (node >= graph_->inputs) wanted[at(node)] = true;
    };
    const auto is_linear = [](Kind kind) { return kind == Kind::Add || kind == Kind::Subtract; };
    for (const Index k : std::views::reverse(set)) {
      if (operation(k).kind == Kind::Abs) throw py::type_error("abs has a kink");
      if (is_linear(operation(k).kind) && !wanted[static_cast<std::size_t>(k)]) continue;
      want(operation(k).a);
      want(operation(k).b);
    }
    const auto of = [&](Index node) {
      if (node < 0) return std::vector<Index>{};
      return node < graph_->inputs ? std::vector{node} : reads[at(node)];
    };
    for (const Index k : set) {
      const auto& [kind, is_total, a, b, value] = operation(k);
      if (is_linear(kind) && !wanted[static_cast<std::size_t>(k)]) continue;
      const std::vector<Index> of_a = of(a), of_b = of(b);
      if (!is_linear(kind))
        products += static_cast<double>(of_a.size()) * static_cast<double>(of_b.size());
      if (wanted[static_cast<std::size_t>(k)])
        std::ranges::set_union(of_a, of_b, std::back_inserter(reads[static_cast<std::size_t>(k)]));
      products += static_cast<double>(reads[static_cast<std::size_t>(k)].size());
      if (products > kMostProducts) throw py::type_error("second derivatives cost too much");
    }
    for (const Index k : set) {
      wanted[static_cast<std::size_t>(k)] = false;
      reads[static_cast<std::size_t>(k)].clear();
    }
  }

  /// Sums of many numbers as trees: the gradients of all that was added so far would take the
  /// square of their number.
  void balance_sums() {
    const std::vector<Operation> given = std::exchange(graph_->operations, {});
    const auto is_sum = [](const Operation& one) {
      return one.kind == Kind::Add && one.a >= 0 && one.b >= 0;
    };
    std::vector<Index> uses(given.size());  // each by what is no sum counts as two
    const auto use = [&](Index node, bool by_sum) {
      if (node >= graph_->inputs) uses[at(node)] += by_sum ? 1 : 2;
    };
    for (const Operation& operation : given) {
      use(operation.a, is_sum(operation));
      use(operation.b, is_sum(operation));
    }
    for (const Index output : outputs_) use(output, false);
    const auto is_part = [&](Index node) {
      return node >= graph_->inputs && is_sum(given[at(node)]) && uses[at(node)] == 1;
    };
    std::vector<Index> places(given.size());
    const auto place = [&](Index node) { return node < graph_->inputs ? node : places[at(node)]; };
    const auto add_last = [&](Operation operation) {
      graph_->operations.push_back(operation);
      return graph_->inputs + static_cast<Index>(graph_->operations.size()) - 1;
    };
    std::vector<Index> open, terms, sums;
    for (std::size_t k = 0; k < given.size(); ++k) {
      Operation operation = given[k];
      if (!is_sum(operation)) {
        operation.a = place(operation.a);
        operation.b = place(operation.b);
        places[k] = add_last(operation);
        continue;
      }
      if (is_part(graph_->inputs + static_cast<Index>(k))) continue;
      terms.clear();
      open = {operation.b, operation.a};
      while (!open.empty()) {
        const Index node = open.back();
        open.pop_back();
        if (is_part(node)) {
          open.push_back(given[at(node)].b);
          open.push_back(given[at(node)].a);
        } else {
          terms.push_back(place(node));
        }
      }
      for (; terms.size() > 1; std::swap(terms, sums)) {
        sums.clear();
        for (std::size_t i = 0; i + 1 < terms.size(); i += 2)
          sums.push_back(add_last({Kind::Add, true, terms[i], terms[i + 1], 0.0}));
        if (terms.size() % 2 == 1) sums.push_back(terms.back());
      }
      places[k] = terms.front();
    }
    for (Index& output : outputs_) output = place(output);
  }
  void add_output(const py::handle& value) {
    const Formula formula = py::isinstance<Formula>(value) ? value.cast<Formula>()
                                                           : constant(graph_, value.cast<double>());
    if (formula.graph != graph_) throw py::type_error("a number of another recording");
    outputs_.push_back(formula.node);
  }
  /// seen: of each operation the last set that has it.
  [[nodiscard]] std::vector<Index> needed_for(std::span<const Index> outputs, std::size_t set,
                                              std::vector<std::size_t>& seen) const {
    std::vector<Index> found, open;
    const auto visit = [&](Index node) {
      if (node < graph_->inputs || std::exchange(seen[at(node)], set) == set) return;
      open.push_back(node - graph_->inputs);
    };
    for (const Index output : outputs) visit(output);
    while (!open.empty()) {
      const Index k = open.back();
      open.pop_back();
      found.push_back(k);
      visit(operation(k).a);
      visit(operation(k).b);
    }
    std::ranges::sort(found);
    return found;
  }

  /// Inputs and results of operations, by node.
  template <class T>
  struct Values {
    std::span<const T> inputs, results;
    const T& operator[](Index node) const {
      const auto k = static_cast<std::size_t>(node);
      return k < inputs.size() ? inputs[k] : results[k - inputs.size()];
    }
  };
  template <class T>
  Values<T> run(std::size_t set, std::span<const T> v) const {
    std::vector<T>& results = std::get<std::vector<T>>(results_);
    results.resize(graph_->operations.size());
    const Values<T> values{v, results};
    for (const Index k : needed_[set]) {
      const auto& [kind, is_total, a, b, constant] = operation(k);
      T& result = results[static_cast<std::size_t>(k)];
      if (a >= 0 && b >= 0)
        result = apply(kind, values[a], values[b]);
      else if (kind == Kind::Constant)
        result = T(constant);
      else
        result = a >= 0 ? apply(kind, values[a], T(constant)) : apply(kind, T(constant), values[b]);
    }
    return values;
  }

  std::shared_ptr<Graph> graph_;
  std::vector<Index> outputs_;              ///< the constraints', then the objective's
  std::vector<std::vector<Index>> needed_;  ///< of each output, and of all constraints
  mutable std::tuple<std::vector<Plain>, std::vector<Taped>, std::vector<IntervalJet>> results_;
};

namespace {

struct Objective {
  std::shared_ptr<Recording> recording;
  template <class T>
  T objective(std::span<const T> v) const {
    return recording->objective(v);
  }
};

/// Each constraint is evaluated by itself.
struct ByRows : Objective {
  template <class T>
  T constraint(std::size_t j, std::span<const T> v) const {
    return recording->row(j, v);
  }
};

/// Constraints are evaluated together.
struct Together : Objective {
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    recording->all_rows(v, g);
  }
};

/// Recorded functions as methods of problem_obj. Where one is undefined its values are not finite,
/// which the solver sees.
class Formulas {
 public:
  using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
  using IntArray = py::array_t<int, py::array::c_style | py::array::forcecast>;
  using Numbers = py::array_t<double>;

  Formulas(const Array& start, std::shared_ptr<Recording> recording)
      : recording_(std::move(recording)) {
    if (!recording_ || size(start) != recording_->inputs()) throw py::value_error("size of start");
    const std::size_t m = recording_->rows();
    const bool together = recording_->has_much_in_common();
    recording_->require_derivatives(!together);
    ModelData data{.players = std::vector<Player>(size(start), Player::Min),
                   .start = {start.data(), start.data() + start.size()},
                   .constraint_lower = std::vector<double>(m),
                   .constraint_upper = std::vector<double>(m)};
    if (together)
      make<Together>(std::move(data));
    else
      make<ByRows>(std::move(data));
  }

  bool update(const Recording& again) {
    if (!recording_->update(again)) return false;
    forget_();
    return true;
  }

  double objective(const Array& v) {
    double f = 0.0;
    (void)problem_->objective(read(v), true, f);
    return f;
  }
  Numbers gradient(const Array& v) {
    return filled(size(v), [&](auto out) { (void)problem_->gradient(read(v), true, out); });
  }
  Numbers constraints(const Array& v) {
    return filled(recording_->rows(),
                  [&](auto out) { (void)problem_->constraints(read(v), true, out); });
  }
  Numbers jacobian(const Array& v) {
    return filled(structure().jacobian.size(),
                  [&](auto out) { (void)problem_->jacobian(read(v), true, out); });
  }
  Numbers hessian(const Array& v, const Array& lambda, double sigma) {
    if (size(lambda) != recording_->rows()) throw py::value_error("size of the multipliers");
    return filled(structure().hessian.size(), [&](auto out) {
      (void)problem_->hessian(read(v), true, sigma, {lambda.data(), size(lambda)}, true, out);
    });
  }
  Numbers constraint_rows(const Array& v, const IntArray& rows) {
    values_.resize(recording_->rows());
    (void)problem_->constraint_rows(indices(rows), read(v), true, values_);
    return filled(size(rows), [&](auto out) {
      std::ranges::transform(indices(rows), out.begin(), [&](int row) { return values_[at(row)]; });
    });
  }
  Numbers jacobian_rows(const Array& v, const IntArray& rows) {
    values_.resize(structure().jacobian.size());
    (void)problem_->jacobian_rows(indices(rows), read(v), true, values_);
    std::vector<double> found;
    for (const int row : indices(rows)) {
      const auto own = std::ranges::equal_range(structure().jacobian, row, {}, &Triplet::row);
      for (const Triplet& entry : own)
        found.push_back(values_[static_cast<std::size_t>(&entry - structure().jacobian.data())]);
    }
    return filled(found.size(), [&](auto out) { std::ranges::copy(found, out.begin()); });
  }
  [[nodiscard]] py::tuple jacobian_structure() const { return split(structure().jacobian); }
  [[nodiscard]] py::tuple hessian_structure() const { return split(structure().hessian); }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  template <class A>
  static std::size_t size(const A& array) {
    return static_cast<std::size_t>(array.size());
  }
  [[nodiscard]] std::span<const double> read(const Array& v) const {
    if (size(v) != recording_->inputs()) throw py::value_error("size of v");
    return {v.data(), size(v)};
  }
  [[nodiscard]] std::span<const int> indices(const IntArray& rows) const {
    for (const int row : std::span(rows.data(), size(rows))) {
      if (row < 0 || at(row) >= recording_->rows()) throw py::value_error("a row out of range");
    }
    return {rows.data(), size(rows)};
  }
  template <class Fill>
  static Numbers filled(std::size_t count, Fill fill) {
    Numbers found(static_cast<py::ssize_t>(count));
    fill(std::span(found.mutable_data(), count));
    return found;
  }
  [[nodiscard]] const ProblemStructure& structure() const { return problem_->structure(); }
  static py::tuple split(const std::vector<Triplet>& entries) {
    py::array_t<int> rows(static_cast<py::ssize_t>(entries.size())), cols(rows.size());
    for (std::size_t k = 0; k < entries.size(); ++k) {
      rows.mutable_data()[k] = entries[k].row;
      cols.mutable_data()[k] = entries[k].col;
    }
    return py::make_tuple(rows, cols);
  }
  template <class Model>
  void make(ModelData data) {
    auto problem = std::make_unique<AutodiffProblem<Model>>(Model{{recording_}}, std::move(data));
    forget_ = [of = problem.get()] { (void)of->functions(); };
    problem_ = std::move(problem);
  }

  std::shared_ptr<Recording> recording_;
  std::unique_ptr<Problem> problem_;
  std::function<void()> forget_;  ///< what was computed with other numbers
  std::vector<double> values_;
};

/// n numbers from which formulas are recorded.
py::list inputs(int n) {
  const auto graph = std::make_shared<Graph>(Graph{n});
  py::list found;
  for (int i = 0; i < n; ++i) found.append(Formula{graph, i});
  return found;
}

}  // namespace

const Recording& RecordedBoxes::recording() const {
  if (recording_) return *recording_;
  const Locked lock;
  try {
    recording_ = call(record_).cast<std::shared_ptr<Recording>>();
    return *recording_;
  } catch (py::error_already_set& error) {
    const std::string what = error.what();
    if (error.matches(PyExc_KeyboardInterrupt)) {
      PyErr_SetInterrupt();  // for the next callback
    } else if (!error.matches(PyExc_Exception) || error.matches(PyExc_MemoryError)) {
      raised_ = std::current_exception();  // SystemExit, for one
      throw std::runtime_error("stopped");
    }
    throw std::domain_error("a function cannot be recorded: " + what.substr(0, what.find('\n')));
  } catch (py::cast_error&) {
    throw std::domain_error("a function cannot be recorded: it returned what is no number");
  }
}

IntervalJet RecordedBoxes::objective_over(std::span<const IntervalJet> v) const {
  return recording().objective(v);
}

void RecordedBoxes::constraints_over(std::span<const IntervalJet> v,
                                     std::span<IntervalJet> g) const {
  if (recording().rows() != g.size()) {
    throw std::domain_error("a function returned " + std::to_string(recording().rows()) +
                            " numbers when it was recorded, not " + std::to_string(g.size()));
  }
  recording().all_rows(v, g);
}

void add_formulas(py::module_& module) {
  py::class_<Formula> number(module, "Formula", "A number that remembers how it was computed.");
  const auto operation = [&](const char* name, const char* reflected, Kind kind) {
    const auto with = [kind](const Formula& a, double b) { return record(kind, a, b); };
    const auto of = [kind](const Formula& b, double a) { return record(kind, b, a, true); };
    const auto both = [kind](const Formula& a, const Formula& b) { return record(kind, a, b); };
    number.def(name, both, py::is_operator()).def(name, with, py::is_operator());
    if (reflected != nullptr) number.def(reflected, of, py::is_operator());
  };
  operation("__add__", "__radd__", Kind::Add);
  operation("__sub__", "__rsub__", Kind::Subtract);
  operation("__mul__", "__rmul__", Kind::Multiply);
  operation("__truediv__", "__rtruediv__", Kind::Divide);
  operation("__pow__", "__rpow__", Kind::Power);
  operation("arctan2", nullptr, Kind::Atan2);
  operation("hypot", nullptr, Kind::Hypot);
  const auto method = [&](const char* name, auto function) { number.def(name, function); };
#define METHOD(kind, function, name) \
  method(name, [](const Formula& a) { return record(Kind::kind, a); });
  FUNCTIONS_OF_ONE(METHOD)
#undef METHOD
  method("fabs", [](const Formula& a) { return record(Kind::Abs, a); });
  method("__neg__", [](const Formula& a) { return record(Kind::Multiply, a, -1.0); });
  method("expm1",
         [](const Formula& a) { return record(Kind::Subtract, record(Kind::Exp, a), 1.0); });
  method("exp2", [](const Formula& a) { return record(Kind::Power, a, 2.0, true); });
  method("log1p", [](const Formula& a) { return record(Kind::Log, record(Kind::Add, a, 1.0)); });
  for (const auto& [name, base] : {std::pair{"log10", 10.0}, {"log2", 2.0}}) {
    method(name, [base = base](const Formula& a) {
      return record(Kind::Divide, record(Kind::Log, a), std::log(base));
    });
  }
  for (const char* name : {"__pos__", "conjugate"})
    method(name, [](const Formula& a) { return a; });
  for (const char* name :
       {"__bool__", "__eq__", "__ne__", "__lt__", "__le__", "__gt__", "__ge__"}) {
    number.def(name, [](const py::args&) -> bool {
      throw py::type_error("a formula cannot branch on its values");
    });
  }
  module.def("inputs", inputs);
  py::class_<Recording, std::shared_ptr<Recording>>(module, "Recording", "Functions as recorded.")
      .def(py::init<const Formula&, const py::list&, const py::object&>());
  py::class_<Formulas>(module, "Formulas", "The functions of a Recording, and their derivatives.")
      .def(py::init<const Formulas::Array&, std::shared_ptr<Recording>>())
      .def("update", &Formulas::update)
      .def("objective", &Formulas::objective)
      .def("gradient", &Formulas::gradient)
      .def("constraints", &Formulas::constraints)
      .def("jacobian", &Formulas::jacobian)
      .def("jacobianstructure", &Formulas::jacobian_structure)
      .def("hessian", &Formulas::hessian)
      .def("hessianstructure", &Formulas::hessian_structure)
      .def("constraint_rows", &Formulas::constraint_rows)
      .def("jacobian_rows", &Formulas::jacobian_rows);
}

}  // namespace ipminmax::python
