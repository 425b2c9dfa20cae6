// The extension module ipminmax._core: the C interface with NumPy arrays. ipminmax/problem.py is
// what users see.
//
// The interpreter's lock is released while a solve runs and taken in every callback. An exception
// of a Python function ends the solve and is raised by solve(). After Ctrl-C or a limit of time no
// function is called any more, and the solve returns the best point that it has reached.
#include <cxxabi.h>
#include <ipminmax.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <IpJournalist.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdarg>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "adapter/c/c_problem.hpp"
#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/status.hpp"
#include "core/answer.hpp"
#include "formulas.hpp"
#include "interpreter.hpp"

namespace py = pybind11;
using namespace py::literals;

namespace {

using ipminmax::python::call;
using ipminmax::python::Locked;
using ipminmax::python::sleep_until_the_end;
using ipminmax::python::unless_the_interpreter_ends;
using ipminmax::python::Unlocked;

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using IntArray = py::array_t<int, py::array::c_style | py::array::forcecast>;

/// Leaves the solver: the problem keeps the exception of Python, or knows why it stops.
struct ModelStopped : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "stopped"; }
};

/// Raised by a model's function to say that it is undefined at this point
/// (ipminmax.EvaluationError), and by one that found the time limit passed (LimitReached); what is
/// raised where a solution has no derivatives (NoSensitivity).
py::handle evaluation_error, limit_reached, no_sensitivity;

// --- The log ------------------------------------------------------------------------------------

/// The console: sys.stdout, which a notebook or a test redirects.
class PythonConsole : public Ipopt::Journal {
 public:
  using Journal::Journal;

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    write(text);
  }
  void PrintfImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* format,
                  va_list values) override {
    va_list again;
    va_copy(again, values);
    std::vector<char> text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, format, again)) + 1);
    va_end(again);
    std::vsnprintf(text.data(), text.size(), format, values);
    write(text.data());
  }
  void FlushBufferImpl() override {}  // Python's buffer is that of its lines

 private:
  static void write(const char* text) {
    const Locked lock;
    PyObject* out = PySys_GetObject("stdout");  // borrowed
    if (out == nullptr || out == Py_None) return;
    const int failed = unless_the_interpreter_ends([&] { return PyFile_WriteString(text, out); });
    if (failed == 0) return;
    const bool interrupt = PyErr_ExceptionMatches(PyExc_KeyboardInterrupt) != 0;
    PyErr_Clear();  // a log that cannot be written ends no solve
    if (interrupt) PyErr_SetInterrupt();
  }
};

// --- Values -------------------------------------------------------------------------------------

/// Of a text that C reads whole.
const char* c_string(const std::string& text) {
  if (text.find('\0') != std::string::npos) throw py::value_error("a text has a NUL byte");
  return text.c_str();
}

template <class T>
py::array_t<T> to_array(std::span<const T> values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}
py::array_t<double> to_array(const std::vector<double>& values) {
  return to_array(std::span(values));
}
double to_array(double value) { return value; }
py::object to_array_or_none(const std::vector<double>& values) {
  return values.empty() ? py::object(py::none()) : to_array(values);
}

/// Copies what a function returned; the error names the function when type or size are wrong.
void take(const py::object& returned, const char* function, int count, double* values) {
  if (count == 1 && PyFloat_CheckExact(returned.ptr()) != 0) {
    *values = PyFloat_AS_DOUBLE(returned.ptr());
    return;
  }
  if (returned.is_none()) throw py::type_error(std::string(function) + " returned None");
  const py::array any = py::array::ensure(returned);
  if (any && any.dtype().kind() == 'c') {
    throw py::type_error(std::string(function) + " returned complex numbers");
  }
  const Array array = any ? Array::ensure(any) : Array();
  if (!array) {
    PyErr_Clear();
    throw py::type_error(std::string(function) + " must return an array of numbers");
  }
  if (array.size() != count) {
    throw py::value_error(std::string(function) + " returned " + std::to_string(array.size()) +
                          " values instead of " + std::to_string(count));
  }
  std::copy_n(array.data(), count, values);
}

// --- What a solve has found, as problem.py describes it ------------------------------------------

py::object to_dict(const ipminmax::Certificate& from) {
  const auto inertia = [](const ipminmax::Inertia& i) {
    return py::make_tuple(i.positive, i.negative, i.zero);
  };
  py::list reasons;
  for (const auto& reason : from.reasons) reasons.append(reason.text);
  return py::dict(
      "kind"_a = static_cast<int>(from.kind),
      "second_order"_a = static_cast<int>(from.second_order), "inner"_a = inertia(from.inner),
      "inner_expected"_a = inertia(from.inner_expected), "full"_a = inertia(from.full),
      "full_expected"_a = inertia(from.full_expected), "margin"_a = from.margin,
      "licq_min"_a = from.licq_min, "licq_max"_a = from.licq_max,
      "weakly_active_min"_a = from.weakly_active_min,
      "weakly_active_max"_a = from.weakly_active_max,
      "finite_differences"_a = from.finite_differences, "hessian_error"_a = from.hessian_error,
      "hessian_disagrees"_a = from.hessian_disagrees, "least_curvature"_a = from.least_curvature,
      "least_curvature_variable"_a = from.least_curvature_variable,
      "answer"_a = static_cast<int>(from.answer), "reasons"_a = reasons, "proved"_a = from.proved,
      "proved_within"_a = from.proved_within, "proof"_a = from.proof);
}

py::object to_dict(const ipminmax::WorstCase& from) {
  if (from.starts == 0 && !from.higher) return py::none();
  const bool found = !from.v.empty();
  return py::dict("starts"_a = from.starts, "maxima"_a = from.maxima,
                  "competing"_a = from.competing, "higher"_a = from.higher,
                  "unbounded"_a = from.unbounded, "single_branch"_a = from.single_branch,
                  "stated_concave"_a = from.stated_concave,
                  "value"_a = found ? py::object(py::float_(from.value)) : py::none(),
                  "x"_a = to_array_or_none(from.v));
}

py::object to_dict(const ipminmax::RobustWorstCase& from) {
  return py::dict("constraint"_a = from.constraint, "value"_a = from.value,
                  "multiplier"_a = from.multiplier, "active"_a = from.active, "age"_a = from.age,
                  "x"_a = to_array(from.v));
}

py::object to_dict(const ipminmax::WorstCaseProof& from) {
  return py::dict("constraint"_a = from.constraint, "least"_a = from.least, "seen"_a = from.seen,
                  "proved"_a = from.proved, "complete"_a = from.complete, "boxes"_a = from.boxes,
                  "x"_a = to_array_or_none(from.v), "message"_a = from.message);
}

py::object to_dict(const ipminmax::DistinctPoint& from) {
  return py::dict("x"_a = to_array(from.result.v), "value"_a = from.result.objective,
                  "found"_a = from.found, "first_start"_a = from.first_start,
                  "margin"_a = from.result.certificate.margin);
}

/// Statistics.
py::object to_dict(const ipminmax::Result& from) {
  const ipminmax::Counts& counts = from.counts;
  const ipminmax::KktError& error = from.error;
  return py::dict("iterations"_a = from.iterations, "factorizations"_a = from.factorizations,
                  "analyses"_a = counts.analyses, "objective_evaluations"_a = counts.objective,
                  "gradient_evaluations"_a = counts.gradient,
                  "constraint_evaluations"_a = counts.constraints,
                  "jacobian_evaluations"_a = counts.jacobian,
                  "hessian_evaluations"_a = counts.hessian, "seconds"_a = from.seconds,
                  "cpu_seconds"_a = from.cpu_seconds, "primal_error"_a = error.primal,
                  "dual_error_min"_a = error.dual_min, "dual_error_max"_a = error.dual_max,
                  "complementarity_error"_a = error.complementarity, "error"_a = error.total);
}

template <class Found>
py::list to_list(const std::vector<Found>& values) {
  py::list list;
  for (const Found& value : values) list.append(to_dict(value));
  return list;
}

/// Functions of a model: their places in Problem, and their names.
enum Function { kF, kGradient, kG, kJacobian, kHessian, kRows, kJacobianRows, kIntermediate };
constexpr std::array kNames = {"objective", "gradient",        "constraints",   "jacobian",
                               "hessian",   "constraint_rows", "jacobian_rows", "intermediate"};

/// Places of the entries of a matrix.
struct Places {
  IntArray rows, cols;
  int copy(int* to_rows, int* to_cols) const {
    std::copy_n(rows.data(), rows.size(), to_rows);
    std::copy_n(cols.data(), cols.size(), to_cols);
    return 1;
  }
};

class Problem {
 public:
  Problem(int n, int m, const py::dict& functions, const Array& x_l, const Array& x_u,
          const Array& g_l, const Array& g_u, const IntArray& players,
          const std::optional<IntArray>& owners, const IntArray& jac_rows, const IntArray& jac_cols,
          const IntArray& hess_rows, const IntArray& hess_cols)
      : n_(n),
        m_(m),
        jacobian_{jac_rows, jac_cols},
        hessian_{hess_rows, hess_cols},
        console_(new PythonConsole("console", Ipopt::J_ITERSUMMARY)) {
    for (std::size_t k = 0; k < kNames.size(); ++k)
      functions_[k] = functions.contains(kNames[k]) ? py::object(functions[kNames[k]]) : py::none();
    problem_ =
        IpminmaxCreate(n, x_l.data(), x_u.data(), m, g_l.data(), g_u.data(),
                       static_cast<int>(jacobian_.rows.size()),
                       static_cast<int>(hessian_.rows.size()), IPMINMAX_C_STYLE, eval_f, eval_g,
                       eval_grad_f, eval_jac_g, functions.contains("hessian") ? eval_h : nullptr,
                       players.data(), owners ? owners->data() : nullptr);
    if (problem_ == nullptr) throw py::value_error(IpminmaxMessage(nullptr));
    IpminmaxSetIntermediateCallback(problem_, intermediate);
    if (has(kRows) && has(kJacobianRows)) {
      row_entries_.resize(size(m));
      for (int k = 0; k < jacobian_.rows.size(); ++k)
        row_entries_[size(jacobian_.rows.data()[k])].push_back(k);
      IpminmaxSetRowsCallback(problem_, eval_rows);
    }
    const auto journalist = problem_->application->Jnlst();
    journalist->DeleteAllJournals();
    journalist->AddJournal(Ipopt::GetRawPtr(console_));
  }
  ~Problem() { IpminmaxFree(problem_); }
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  [[nodiscard]] bool solving() const { return problem_->solving; }

  /// For the garbage collector: functions of the model that hold this problem make a cycle.
  template <class Visit>
  void for_each_object(Visit visit) {
    for (py::object& function : functions_) visit(function);
    visit(boxes_.record());
  }

  /// Of variables and constraints, for messages.
  void set_names(std::vector<std::string> variables, std::vector<std::string> constraints) {
    problem_->model->variable_names = std::move(variables);
    problem_->model->constraint_names = std::move(constraints);
  }

  /// A callable that returns a Recording of the functions, for proofs.
  void set_recorder(py::object record) {
    boxes_.record() = std::move(record);
    problem_->model->boxes = &boxes_;
  }

  void add_option(const std::string& name, const py::object& value) {
    const char* const key = c_string(name);
    if (py::isinstance<py::str>(value)) {
      const auto text = value.cast<std::string>();
      return require(IpminmaxAddStrOption(problem_, key, c_string(text)));
    }
    // 1 for a real option and 1.0 for an integer one mean what they say.
    const double number = PyNumber_Check(value.ptr()) != 0 ? PyFloat_AsDouble(value.ptr()) : -1.0;
    if (PyNumber_Check(value.ptr()) == 0 || PyErr_Occurred() != nullptr) {
      PyErr_Clear();
      throw py::type_error("the value of option " + name + " is a " +
                           std::string(Py_TYPE(value.ptr())->tp_name) +
                           ", not a number, a string or a bool");
    }
    const auto integer = static_cast<int>(std::clamp(number, -2147483648.0, 2147483647.0));
    const bool whole = static_cast<double>(integer) == number;
    if (whole && IpminmaxAddIntOption(problem_, key, integer) == 1) return;
    const std::string message = IpminmaxMessage(problem_);
    const bool is_integer_option = message.find("a number option") == std::string::npos;
    if (whole && is_integer_option) throw py::value_error(message);
    require(IpminmaxAddNumOption(problem_, key, number));
  }

  void set_scaling(double objective, const py::object& x, const py::object& g) {
    require(IpminmaxSetScaling(problem_, objective, Numbers(x, n_, "x_scaling").data(),
                               Numbers(g, m_, "g_scaling").data()));
  }

  void set_bounds(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                  const py::object& g_u) {
    require(IpminmaxSetBounds(problem_, Numbers(x_l, n_, "lb").data(),
                              Numbers(x_u, n_, "ub").data(), Numbers(g_l, m_, "cl").data(),
                              Numbers(g_u, m_, "cu").data()));
  }

  void open_output_file(const std::string& name, int level) {
    require(IpminmaxOpenOutputFile(problem_, c_string(name), level));
  }

  /// interrupted: by Ctrl-C before it began.
  py::dict solve(const Array& x0, const Array& lambda0, const Array& z_l0, const Array& z_u0,
                 bool again, bool interrupted) {
    Iterate at = zero();
    start(x0, "x", at.x);
    at.f = std::numeric_limits<double>::quiet_NaN();
    if (!again) {
      start(lambda0, "lagrange", at.lambda);
      start(z_l0, "zl", at.z_l);
      start(z_u0, "zu", at.z_u);
    }
    begin();
    interrupted_ = interrupted;
    int status = IPMINMAX_INTERNAL_ERROR;
    {
      const Unlocked unlocked;
      status = (again ? IpminmaxSolveAgain : IpminmaxSolve)(problem_, at.x.data(), at.g.data(),
                                                            &at.f, at.lambda.data(), at.z_l.data(),
                                                            at.z_u.data(), this);
    }
    rethrow();
    std::string name = IpminmaxStatusName(problem_), message = IpminmaxMessage(problem_);
    const ipminmax::Result& result = problem_->application->LastResult();
    // What was finished before stands: what follows a success may be cut short.
    if (cut_ && (interrupted_ || !ipminmax::is_success(result.status))) {
      const auto why = interrupted_ ? ipminmax::Status::UserStop : ipminmax::Status::MaxWallTime;
      status = static_cast<int>(ipminmax::application_status(why));
      name = ipminmax::name_of(why);
      message = std::string(interrupted_ ? "Ctrl-C" : "the time limit passed") +
                (result.v.empty() ? " before the first iterate: this is the starting point"
                                  : ": this is the best point that was reached");
      if (!std::isfinite(at.f) && f_.has(at.x)) at.f = f_.values.front();
    }
    const ipminmax::Result none;
    const ipminmax::Result& found = problem_->answered ? result : none;
    return py::dict(
        "x"_a = to_array(at.x), "g"_a = to_array(at.g), "obj_val"_a = at.f,
        "mult_g"_a = to_array(at.lambda), "mult_x_L"_a = to_array(at.z_l),
        "mult_x_U"_a = to_array(at.z_u), "status"_a = status, "status_name"_a = name,
        "status_msg"_a = message, "interrupted"_a = interrupted_,
        "iterations"_a = result.iterations,
        "certificate"_a = problem_->answered ? to_dict(result.certificate) : py::none(),
        "worst_case"_a = to_dict(found.worst_case), "worst_cases"_a = to_list(found.worst_cases),
        "proofs"_a = to_list(found.over_y.proofs),
        "points"_a = problem_->answered ? to_list(problem_->application->LastPoints()) : py::list(),
        "statements"_a = ipminmax::statements(result), "statistics"_a = to_dict(found),
        "history"_a = history_array());
  }

  /// Largest and least value; ValueError says why there are none.
  py::tuple gap(const Array& v) {
    check_size(v, n_, "v");
    begin();
    double most = 0.0, least = 0.0;
    int found = 0;
    {
      const Unlocked unlocked;
      found = IpminmaxFindGap(problem_, v.data(), &most, &least, nullptr, this);
    }
    rethrow();
    require(found);
    return py::make_tuple(most, least);
  }

  /// None outside the intermediate callback.
  py::object current_iterate() {
    Iterate at = zero();
    const int found = IpminmaxGetCurrentIterate(problem_, n_, at.x.data(), at.z_l.data(),
                                                at.z_u.data(), m_, at.g.data(), at.lambda.data());
    rethrow();
    if (found == 0) return py::none();
    return py::dict("x"_a = to_array(at.x), "mult_x_L"_a = to_array(at.z_l),
                    "mult_x_U"_a = to_array(at.z_u), "g"_a = to_array(at.g),
                    "mult_g"_a = to_array(at.lambda));
  }

  py::object current_violations() {
    std::vector<double> xl = sized(n_), xu = sized(n_), cl = sized(n_), cu = sized(n_),
                        grad = sized(n_), g = sized(m_), cg = sized(m_);
    const int found = IpminmaxGetCurrentViolations(problem_, n_, xl.data(), xu.data(), cl.data(),
                                                   cu.data(), grad.data(), m_, g.data(), cg.data());
    rethrow();
    if (found == 0) return py::none();
    return py::dict("x_L_violation"_a = to_array(xl), "x_U_violation"_a = to_array(xu),
                    "compl_x_L"_a = to_array(cl), "compl_x_U"_a = to_array(cu),
                    "grad_lag_x"_a = to_array(grad), "g_violation"_a = to_array(g),
                    "compl_g"_a = to_array(cg));
  }

  void update_sensitivity() { require_sensitivity(IpminmaxUpdateSensitivity(problem_)); }

  /// find: IpminmaxGetDerivative or IpminmaxPredict.
  template <auto find>
  py::dict along(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                 const py::object& g_u) {
    return found_by<find == IpminmaxPredict>(
        find, Numbers(x_l, n_, "lb").data(), Numbers(x_u, n_, "ub").data(),
        Numbers(g_l, m_, "cl").data(), Numbers(g_u, m_, "cu").data());
  }
  /// find: IpminmaxGetReaction or IpminmaxPredictReaction.
  template <auto find>
  py::dict after(const py::object& dx) {
    if (dx.is_none()) throw py::type_error("dx is None");
    return found_by<find == IpminmaxPredictReaction>(find, Numbers(dx, n_, "dx").data());
  }

 private:
  /// Numbers of a point, or derivatives of one.
  struct Iterate {
    std::vector<double> x, g, lambda, z_l, z_u;
    double f = 0.0;
  };
  [[nodiscard]] Iterate zero() const {
    return {sized(n_), sized(m_), sized(m_), sized(n_), sized(n_)};
  }

  /// What the C interface finds by these arguments.
  template <bool is_prediction, class Find, class... By>
  py::dict found_by(Find find, By... by) {
    Iterate out = zero();
    double last = 0.0;
    require_sensitivity(find(problem_, by..., out.x.data(), out.lambda.data(), out.z_l.data(),
                             out.z_u.data(), &out.f, &last));
    py::dict result("x"_a = to_array(out.x), "mult_g"_a = to_array(out.lambda),
                    "mult_x_L"_a = to_array(out.z_l), "mult_x_U"_a = to_array(out.z_u),
                    "obj"_a = out.f, py::arg(is_prediction ? "share" : "curvature") = last);
    if (!is_prediction) return result;
    std::vector<IpminmaxActiveSetChange> changes(
        size(IpminmaxGetActiveSetChanges(problem_, 0, nullptr)));
    IpminmaxGetActiveSetChanges(problem_, static_cast<int>(changes.size()), changes.data());
    py::list list;
    for (const auto& c : changes) {
      list.append(
          py::make_tuple(c.share, c.of_constraint != 0, c.index, c.upper != 0, c.enters != 0));
    }
    result["changes"] = list;
    result["message"] = IpminmaxMessage(problem_);
    return result;
  }

  static constexpr double kNoLimit = 1e19;

  static std::size_t size(int count) { return static_cast<std::size_t>(count); }
  static std::vector<double> sized(int count) { return std::vector<double>(size(count), 0.0); }
  [[nodiscard]] bool has(Function which) const { return !functions_[which].is_none(); }
  static void check_size(const Array& values, int count, const char* name) {
    if (values.size() == count) return;
    throw py::value_error(std::string(name) + " has " + std::to_string(values.size()) +
                          " entries, but there are " + std::to_string(count));
  }
  /// An argument; None: null.
  class Numbers {
   public:
    Numbers(const py::object& values, int count, const char* name) {
      if (values.is_none()) return;
      array_ = Array::ensure(values);
      PyErr_Clear();
      if (!*array_) throw py::type_error(std::string(name) + " must be an array of numbers");
      check_size(*array_, count, name);
    }
    [[nodiscard]] const double* data() const { return array_ ? array_->data() : nullptr; }

   private:
    std::optional<Array> array_;
  };
  static void start(const Array& values, const char* name, std::vector<double>& out) {
    if (values.size() == 0) return;
    check_size(values, static_cast<int>(out.size()), name);
    std::copy_n(values.data(), out.size(), out.begin());
  }
  void require(int success) const {
    if (success != 1) throw py::value_error(IpminmaxMessage(problem_));
  }
  void require_sensitivity(int success) {
    rethrow();
    if (success == 1) return;
    PyErr_SetString(no_sensitivity.ptr(), IpminmaxMessage(problem_));
    throw py::error_already_set();
  }
  /// Raises what a callback left, with the interpreter's lock held.
  void rethrow() {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

  // --- Stopping

  using Clock = std::chrono::steady_clock;

  void begin() {
    error_ = nullptr;
    interrupted_ = timed_out_ = cut_ = false;
    history_.clear();
    boxes_.forget();
    f_ = g_ = {};
    ipminmax::SolverOptions options;
    // What is wrong with options the solver says itself.
    (void)ipminmax::solver_options(*problem_->application->Options(), options);
    wall_limit_ = options.max_wall_time;
    cpu_limit_ = options.max_cpu_time;
    // What has been found by other starts or maximizations is worth reaching the next iterate for.
    patience_ = options.minmax_starts > 1 || options.minmax_worst_case_starts > 0 ||
                        options.minmax_epigraph || options.minmax_epigraph_at_kinks
                    ? 0.2
                    : 0.0;
    wall_start_ = Clock::now();
    cpu_start_ = std::clock();
  }

  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(Clock::now() - wall_start_).count();
  }
  [[nodiscard]] double cpu_seconds() const {
    return static_cast<double>(std::clock() - cpu_start_) / CLOCKS_PER_SEC;
  }

  /// Before each call of a function: whether there is a reason to stop, and time was left to reach
  /// the next iterate. No function is called any more then; the solver finds all of them undefined
  /// until it sees its limit, and returns what it has.
  [[nodiscard]] bool is_cut() {
    if (!interrupted_ && !timed_out_) {
      timed_out_ = (wall_limit_ < kNoLimit && seconds() >= wall_limit_) ||
                   (cpu_limit_ < kNoLimit && cpu_seconds() >= cpu_limit_);
      if (!timed_out_) return false;
      asked_at_ = seconds();
    }
    cut_ = seconds() - asked_at_ > patience_ * (interrupted_ ? 1.0 : std::min(1.0, wall_limit_));
    return cut_;
  }

  void note_interrupt() {
    if (std::exchange(interrupted_, true)) return;
    asked_at_ = seconds();
  }

  /// Runs a model's function; false: undefined here.
  template <class Function>
  bool run(Function function) {
    if (cut_) return false;
    const Locked lock;
    if (error_) throw ModelStopped{};
    for (;;) {
      try {
        if (is_cut()) return false;
        function();
        return true;
      } catch (abi::__forced_unwind&) {
        sleep_until_the_end();
      } catch (py::error_already_set& error) {
        if (error.matches(evaluation_error)) return false;
        if (error.matches(limit_reached)) {
          if (!std::exchange(timed_out_, true)) asked_at_ = seconds();
          continue;
        }
        if (!interrupted_ && error.matches(PyExc_KeyboardInterrupt)) {
          note_interrupt();
          continue;
        }
        error_ = std::current_exception();
      } catch (...) {
        error_ = std::current_exception();
      }
      throw ModelStopped{};
    }
  }

  static Problem& of(void* user_data) { return *static_cast<Problem*>(user_data); }

  /// Calls a function at x, and with more arguments.
  template <class... More>
  bool evaluate(Function which, const double* x, std::span<double> out, const More&... more) {
    return run([&] {
      const py::object found =
          call(functions_[which], to_array(std::span(x, size(n_))), to_array(more)...);
      take(found, kNames[which], static_cast<int>(out.size()), out.data());
    });
  }

  /// The last values of a function: the solver asks for those of an iterate more than once.
  struct Last {
    std::vector<double> x, values;
    [[nodiscard]] bool has(std::span<const double> at) const {
      return !values.empty() && std::ranges::equal(x, at);
    }
  };
  bool remembered(Last& last, Function which, const double* x, std::span<double> out) {
    const std::span at(x, size(n_));
    if (last.has(at)) {
      std::ranges::copy(last.values, out.begin());
    } else if (!evaluate(which, x, out)) {
      return false;
    } else {
      last = {{at.begin(), at.end()}, {out.begin(), out.end()}};
    }
    return true;
  }

  static int eval_f(int, double* x, int, double* f, void* user_data) {
    Problem& p = of(user_data);
    return p.remembered(p.f_, kF, x, {f, 1}) ? 1 : 0;
  }
  static int eval_grad_f(int n, double* x, int, double* grad, void* user_data) {
    return of(user_data).evaluate(kGradient, x, {grad, size(n)}) ? 1 : 0;
  }
  static int eval_g(int, double* x, int, int m, double* g, void* user_data) {
    Problem& p = of(user_data);
    return m == 0 || p.remembered(p.g_, kG, x, {g, size(m)}) ? 1 : 0;
  }
  static int eval_jac_g(int, double* x, int, int m, int entries, int* rows, int* cols,
                        double* values, void* user_data) {
    Problem& p = of(user_data);
    if (values == nullptr) return p.jacobian_.copy(rows, cols);
    return m == 0 || p.evaluate(kJacobian, x, {values, size(entries)}) ? 1 : 0;
  }
  /// Asked row by row, the entries of a row in the order of the structure.
  static int eval_rows(int, double* x, int, int count, const int* rows, int, double* g, int,
                       double* values, void* user_data) {
    Problem& p = of(user_data);
    const std::span asked(rows, size(count));
    std::vector<int>& places = p.row_places_;
    places.clear();
    for (const int row : asked) {
      if (g != nullptr) {
        places.push_back(row);
      } else {
        const std::vector<int>& entries = p.row_entries_[size(row)];
        places.insert(places.end(), entries.begin(), entries.end());
      }
    }
    p.row_values_.resize(places.size());
    const Function which = g != nullptr ? kRows : kJacobianRows;
    if (count > 0 && !p.evaluate(which, x, p.row_values_, asked)) return 0;
    for (std::size_t k = 0; k < places.size(); ++k)
      (g != nullptr ? g : values)[places[k]] = p.row_values_[k];
    return 1;
  }
  static int eval_h(int, double* x, int, double sigma, int m, double* lambda, int, int entries,
                    int* rows, int* cols, double* values, void* user_data) {
    Problem& p = of(user_data);
    if (values == nullptr) return p.hessian_.copy(rows, cols);
    if (!p.has(kHessian)) return 0;  // only the pattern is known
    const std::span<const double> weights(lambda, size(m));
    return p.evaluate(kHessian, x, {values, size(entries)}, weights, sigma) ? 1 : 0;
  }
  static int intermediate(int mode, int iter, double f, double inf_pr, double inf_du, double mu,
                          double d_norm, double shift, double alpha_du, double alpha_pr, int trials,
                          void* user_data) {
    Problem& p = of(user_data);
    if (mode != 2) {                      // not of a maximization over y at a held x
      if (iter == 0) p.history_.clear();  // of a search that begins anew the last part is kept
      p.history_.insert(p.history_.end(), {static_cast<double>(iter), f, inf_pr, inf_du, mu});
    }
    bool go_on = true;
    p.run([&] {
      if (PyErr_CheckSignals() != 0) {
        if (PyErr_ExceptionMatches(PyExc_KeyboardInterrupt) == 0) throw py::error_already_set();
        PyErr_Clear();
        p.note_interrupt();
      }
      if (p.interrupted_ || !p.has(kIntermediate)) return;
      const py::object answer = call(p.functions_[kIntermediate], mode, iter, f, inf_pr, inf_du, mu,
                                     d_norm, shift, alpha_du, alpha_pr, trials);
      try {
        go_on = answer.is_none() || answer.cast<bool>();
      } catch (const py::cast_error&) {
        throw py::type_error("intermediate must return True, False or None");
      }
    });
    return go_on && !p.interrupted_ ? 1 : 0;
  }

  [[nodiscard]] py::array_t<double> history_array() const {
    constexpr py::ssize_t kColumns = 5;
    return py::array_t<double>({static_cast<py::ssize_t>(history_.size()) / kColumns, kColumns},
                               history_.data());
  }

  int n_, m_;
  Places jacobian_, hessian_;
  std::array<py::object, kNames.size()> functions_;
  std::vector<std::vector<int>> row_entries_;  ///< of the Jacobian; where rows are asked for
  std::vector<int> row_places_;                ///< of the last call
  std::vector<double> row_values_;
  ipminmax::python::RecordedBoxes boxes_{error_};
  IpminmaxProblem problem_ = nullptr;
  Ipopt::SmartPtr<PythonConsole> console_;
  Last f_, g_;
  std::exception_ptr error_;
  std::vector<double> history_;  ///< rows of what the intermediate callback was told
  /// Reasons to stop, and whether no function is called any more for them.
  bool interrupted_ = false, timed_out_ = false, cut_ = false;
  double asked_at_ = 0.0, patience_ = 0.0, wall_limit_ = kNoLimit, cpu_limit_ = kNoLimit;
  Clock::time_point wall_start_;
  std::clock_t cpu_start_ = 0;
};

/// Null where its constructor failed.
Problem* problem_of(PyObject* self) {
  const auto place = reinterpret_cast<py::detail::instance*>(self)->get_value_and_holder();
  return place.holder_constructed() ? place.value_ptr<Problem>() : nullptr;
}

/// Lets the garbage collector see through a problem.
void collect_cycles(PyHeapTypeObject* heap_type) {
  PyTypeObject& type = heap_type->ht_type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    int stop = 0;
    if (Problem* problem = problem_of(self)) {
      problem->for_each_object([&](const py::object& object) {
        if (stop == 0 && object.ptr() != nullptr) stop = visit(object.ptr(), arg);
      });
    }
    return stop;
  };
  type.tp_clear = [](PyObject* self) {
    if (Problem* problem = problem_of(self)) {
      problem->for_each_object([](py::object& object) { object = py::none(); });
    }
    return 0;
  };
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "C interface of Ipminmax with NumPy arrays; use the package ipminmax";
  module.attr("__version__") = IpminmaxVersion();
  module.def("set_exceptions", [](py::object undefined, py::object late, py::object none) {
    evaluation_error = undefined.release();  // as long as the interpreter
    limit_reached = late.release();
    no_sensitivity = none.release();
  });
  ipminmax::python::add_formulas(module);
  py::class_<Problem>(module, "Problem", py::custom_type_setup(collect_cycles))
      .def(py::init<int, int, py::dict, const Array&, const Array&, const Array&, const Array&,
                    const IntArray&, const std::optional<IntArray>&, const IntArray&,
                    const IntArray&, const IntArray&, const IntArray&>())
      .def_property_readonly("solving", &Problem::solving)
      .def("add_option", &Problem::add_option)
      .def("set_scaling", &Problem::set_scaling)
      .def("set_bounds", &Problem::set_bounds)
      .def("set_recorder", &Problem::set_recorder)
      .def("set_names", &Problem::set_names)
      .def("open_output_file", &Problem::open_output_file)
      .def("solve", &Problem::solve)
      .def("gap", &Problem::gap)
      .def("current_iterate", &Problem::current_iterate)
      .def("current_violations", &Problem::current_violations)
      .def("update_sensitivity", &Problem::update_sensitivity)
      .def("derivative", &Problem::along<IpminmaxGetDerivative>)
      .def("reaction", &Problem::after<IpminmaxGetReaction>)
      .def("predict", &Problem::along<IpminmaxPredict>)
      .def("react", &Problem::after<IpminmaxPredictReaction>);
}
