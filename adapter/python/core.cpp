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
/// (ipminmax.EvaluationError), and by one that found the time limit passed (LimitReached).
py::handle evaluation_error, limit_reached;

// --- The log ------------------------------------------------------------------------------------

/// The console: sys.stdout, which a notebook or a test redirects, line by line; the terminal's
/// standard output where sys.stdout is that, so that a line of progress can be refreshed.
class PythonConsole : public Ipopt::Journal {
 public:
  using Journal::Journal;
  bool is_terminal = false;

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
  void FlushBufferImpl() override {
    if (is_terminal) std::fflush(stdout);
  }

 private:
  void write(const char* text) {
    if (is_terminal) {
      std::fputs(text, stdout);
      return;
    }
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

py::array_t<double> to_array(const double* values, int count) {
  return py::array_t<double>(count, values);
}
py::array_t<double> to_array(const std::vector<double>& values) {
  return to_array(values.data(), static_cast<int>(values.size()));
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

class Problem {
 public:
  Problem(int n, int m, py::dict functions, const Array& x_l, const Array& x_u, const Array& g_l,
          const Array& g_u, const IntArray& players, const py::object& constraint_players,
          const IntArray& jac_rows, const IntArray& jac_cols, const IntArray& hess_rows,
          const IntArray& hess_cols, bool has_hessian_pattern)
      : n_(n),
        m_(m),
        jac_rows_(to_vector(jac_rows)),
        jac_cols_(to_vector(jac_cols)),
        hess_rows_(to_vector(hess_rows)),
        hess_cols_(to_vector(hess_cols)),
        console_(new PythonConsole("console", Ipopt::J_ITERSUMMARY)) {
    const auto function = [&](const char* name) {
      return functions.contains(name) ? py::object(functions[name]) : py::none();
    };
    objective_ = function("objective");
    gradient_ = function("gradient");
    constraints_ = function("constraints");
    jacobian_ = function("jacobian");
    hessian_ = function("hessian");
    constraint_rows_ = function("constraint_rows");
    jacobian_rows_ = function("jacobian_rows");
    intermediate_ = function("intermediate");
    IntArray owners;
    if (!constraint_players.is_none()) owners = constraint_players.cast<IntArray>();
    problem_ = IpminmaxCreate(
        n, x_l.data(), x_u.data(), m, g_l.data(), g_u.data(), static_cast<int>(jac_rows_.size()),
        static_cast<int>(hess_rows_.size()), IPMINMAX_C_STYLE, eval_f, eval_g, eval_grad_f,
        eval_jac_g, hessian_.is_none() && !has_hessian_pattern ? nullptr : eval_h, players.data(),
        constraint_players.is_none() ? nullptr : owners.data());
    if (problem_ == nullptr) throw py::value_error(IpminmaxMessage(nullptr));
    IpminmaxSetIntermediateCallback(problem_, intermediate);
    if (!constraint_rows_.is_none() && !jacobian_rows_.is_none()) {
      row_entries_.resize(size(m));
      for (std::size_t k = 0; k < jac_rows_.size(); ++k)
        row_entries_[size(jac_rows_[k])].push_back(static_cast<int>(k));
      IpminmaxSetRowsCallback(problem_, eval_rows);
    }
    const auto journalist = problem_->application->Jnlst();
    journalist->DeleteAllJournals();
    journalist->AddJournal(Ipopt::GetRawPtr(console_));
  }
  ~Problem() { IpminmaxFree(problem_); }
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  /// Whether a limit of time of the solve that runs has passed.
  [[nodiscard]] bool limit_passed() const {
    if (wall_limit_ < kNoLimit && seconds() >= wall_limit_) return true;
    return cpu_limit_ < kNoLimit &&
           static_cast<double>(std::clock() - cpu_start_) / CLOCKS_PER_SEC >= cpu_limit_;
  }

  [[nodiscard]] bool solving() const { return problem_->solving; }
  [[nodiscard]] int variables() const { return n_; }
  [[nodiscard]] int constraints() const { return m_; }

  /// For the garbage collector: functions of the model that hold this problem make a cycle.
  [[nodiscard]] std::array<py::object*, 9> functions() {
    return {&objective_,       &gradient_,      &constraints_,  &jacobian_,      &hessian_,
            &constraint_rows_, &jacobian_rows_, &intermediate_, &boxes_.record()};
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
    const Array x_scaling = optional(x, n_, "x_scaling"), g_scaling = optional(g, m_, "g_scaling");
    require(IpminmaxSetScaling(problem_, objective, pointer(x, x_scaling), pointer(g, g_scaling)));
  }

  void set_bounds(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                  const py::object& g_u) {
    const Sides to(*this, x_l, x_u, g_l, g_u);
    require(IpminmaxSetBounds(problem_, to.lb, to.ub, to.cl, to.cu));
  }

  void open_output_file(const std::string& name, int level) {
    require(IpminmaxOpenOutputFile(problem_, c_string(name), level));
  }

  /// log_on_terminal: sys.stdout is the terminal. interrupted: by Ctrl-C before it began.
  py::dict solve(const Array& x0, const Array& lambda0, const Array& z_l0, const Array& z_u0,
                 bool again, bool log_on_terminal, bool interrupted) {
    check_size(x0, n_, "x");
    Iterate at{
        std::vector<double>(x0.data(), x0.data() + n_), sized(m_), sized(m_), sized(n_), sized(n_),
        std::numeric_limits<double>::quiet_NaN()};
    if (!again) {
      start(lambda0, "lagrange", at.lambda);
      start(z_l0, "zl", at.z_l);
      start(z_u0, "zu", at.z_u);
    }
    begin(log_on_terminal);
    interrupted_ = interrupted;
    int status = IPMINMAX_INTERNAL_ERROR;
    {
      const Unlocked unlocked;
      status = run_solver(at, again);
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
      if (!std::isfinite(at.f) && f_.has(n_, at.x.data())) at.f = f_.values.front();
    }
    py::dict info;
    info["x"] = to_array(at.x);
    info["g"] = to_array(at.g);
    info["obj_val"] = at.f;
    info["mult_g"] = to_array(at.lambda);
    info["mult_x_L"] = to_array(at.z_l);
    info["mult_x_U"] = to_array(at.z_u);
    info["status"] = status;
    info["status_name"] = name;
    info["status_msg"] = message;
    info["interrupted"] = interrupted_;
    info["iterations"] = result.iterations;
    info["history"] = history_array();
    return info;
  }

  /// Worst cases of the robust constraints, and of f (constraint m) with minmax_epigraph.
  [[nodiscard]] py::list worst_cases() const {
    py::list result;
    if (!problem_->answered) return result;
    for (const auto& from : problem_->application->LastWorstCases()) {
      py::dict one;
      one["constraint"] = from.constraint;
      one["value"] = from.value;
      one["multiplier"] = from.multiplier;
      one["active"] = from.active;
      one["age"] = from.age;
      one["x"] = to_array(from.v);
      result.append(one);
    }
    return result;
  }

  /// Of f (constraint -1) and robust constraints, with minmax_worst_case_proof.
  [[nodiscard]] py::list proofs() const {
    py::list result;
    if (!problem_->answered) return result;
    for (const auto& from : problem_->application->LastResult().over_y.proofs) {
      py::dict one;
      one["constraint"] = from.constraint;
      one["least"] = from.least;
      one["seen"] = from.seen;
      one["proved"] = from.proved;
      one["complete"] = from.complete;
      one["boxes"] = from.boxes;
      one["x"] = from.v.empty() ? py::object(py::none()) : py::object(to_array(from.v));
      one["message"] = from.message;
      result.append(one);
    }
    return result;
  }

  /// Why the solve stopped, what the point is, what was looked at over y and over x.
  [[nodiscard]] std::vector<std::string> statements() const {
    const auto found = ipminmax::statements(problem_->application->LastResult());
    return {found.begin(), found.end()};
  }

  /// Certified points of a multistart, the best first.
  [[nodiscard]] py::list points() const {
    py::list result;
    if (!problem_->answered) return result;
    for (const auto& from : problem_->application->LastPoints()) {
      py::dict one;
      one["x"] = to_array(from.result.v);
      one["value"] = from.result.objective;
      one["found"] = from.found;
      one["first_start"] = from.first_start;
      one["margin"] = from.result.certificate.margin;
      result.append(one);
    }
    return result;
  }

  [[nodiscard]] py::object certificate() const {
    IpminmaxCertificate c{};
    if (IpminmaxGetCertificate(problem_, &c) == 0) return py::none();
    const auto inertia = [](const IpminmaxInertia& i) {
      return py::make_tuple(i.positive, i.negative, i.zero);
    };
    py::dict result;
    result["kind"] = static_cast<int>(c.point_kind);
    result["second_order"] = static_cast<int>(c.second_order);
    result["inner"] = inertia(c.inner);
    result["inner_expected"] = inertia(c.inner_expected);
    result["full"] = inertia(c.full);
    result["full_expected"] = inertia(c.full_expected);
    result["margin"] = c.margin;
    result["licq_min"] = c.licq_min != 0;
    result["licq_max"] = c.licq_max != 0;
    result["weakly_active_min"] = c.weakly_active_min;
    result["weakly_active_max"] = c.weakly_active_max;
    result["finite_differences"] = c.finite_differences != 0;
    result["hessian_error"] = c.hessian_error;
    result["answer"] = static_cast<int>(c.answer);
    result["hessian_disagrees"] = c.hessian_disagrees != 0;
    result["least_curvature"] = c.least_curvature;
    result["least_curvature_variable"] = c.least_curvature_variable;
    const auto& found = problem_->application->LastResult().certificate;
    py::list reasons;
    for (const auto& reason : found.reasons) reasons.append(reason.text);
    result["reasons"] = reasons;
    result["proved"] = found.proved;
    result["proved_within"] = found.proved_within;
    result["proof"] = found.proof;
    return result;
  }

  [[nodiscard]] py::object worst_case() const {
    IpminmaxWorstCase found{};
    std::vector<double> x(static_cast<std::size_t>(n_));
    if (IpminmaxGetWorstCase(problem_, &found, x.data()) == 0) return py::none();
    if (found.starts == 0 && found.higher == 0) return py::none();
    py::dict result;
    result["starts"] = found.starts;
    result["maxima"] = found.maxima;
    result["competing"] = found.competing;
    result["higher"] = found.higher != 0;
    result["unbounded"] = found.unbounded != 0;
    result["single_branch"] = found.single_branch != 0;
    result["stated_concave"] = found.stated_concave != 0;
    result["value"] = found.found != 0 ? py::object(py::float_(found.value)) : py::none();
    result["x"] = found.found != 0 ? py::object(to_array(x)) : py::none();
    return result;
  }

  /// Largest and least value; ValueError says why there are none.
  py::tuple gap(const Array& v) {
    check_size(v, n_, "v");
    begin(false);
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

  [[nodiscard]] py::object statistics() const {
    IpminmaxStatistics s{};
    if (IpminmaxGetStatistics(problem_, &s) == 0) return py::none();
    py::dict result;
    result["iterations"] = s.iterations;
    result["factorizations"] = s.factorizations;
    result["analyses"] = s.analyses;
    result["objective_evaluations"] = s.objective_evaluations;
    result["gradient_evaluations"] = s.gradient_evaluations;
    result["constraint_evaluations"] = s.constraint_evaluations;
    result["jacobian_evaluations"] = s.jacobian_evaluations;
    result["hessian_evaluations"] = s.hessian_evaluations;
    result["seconds"] = s.seconds;
    result["cpu_seconds"] = s.cpu_seconds;
    result["primal_error"] = s.primal_error;
    result["dual_error_min"] = s.dual_error_min;
    result["dual_error_max"] = s.dual_error_max;
    result["complementarity_error"] = s.complementarity_error;
    result["error"] = s.error;
    return result;
  }

  /// None outside the intermediate callback.
  py::object current_iterate() {
    std::vector<double> x = sized(n_), z_l = sized(n_), z_u = sized(n_), g = sized(m_),
                        lambda = sized(m_);
    const int found = IpminmaxGetCurrentIterate(problem_, n_, x.data(), z_l.data(), z_u.data(), m_,
                                                g.data(), lambda.data());
    rethrow();
    if (found == 0) return py::none();
    py::dict result;
    result["x"] = to_array(x);
    result["mult_x_L"] = to_array(z_l);
    result["mult_x_U"] = to_array(z_u);
    result["g"] = to_array(g);
    result["mult_g"] = to_array(lambda);
    return result;
  }

  py::object current_violations() {
    std::vector<double> xl = sized(n_), xu = sized(n_), cl = sized(n_), cu = sized(n_),
                        grad = sized(n_), g = sized(m_), cg = sized(m_);
    const int found = IpminmaxGetCurrentViolations(problem_, n_, xl.data(), xu.data(), cl.data(),
                                                   cu.data(), grad.data(), m_, g.data(), cg.data());
    rethrow();
    if (found == 0) return py::none();
    py::dict result;
    result["x_L_violation"] = to_array(xl);
    result["x_U_violation"] = to_array(xu);
    result["compl_x_L"] = to_array(cl);
    result["compl_x_U"] = to_array(cu);
    result["grad_lag_x"] = to_array(grad);
    result["g_violation"] = to_array(g);
    result["compl_g"] = to_array(cg);
    return result;
  }

  void update_sensitivity() { require_sensitivity(IpminmaxUpdateSensitivity(problem_)); }

  py::dict derivative(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                      const py::object& g_u) {
    return along(IpminmaxGetDerivative, {*this, x_l, x_u, g_l, g_u}, "curvature");
  }
  py::dict predict(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                   const py::object& g_u) {
    return with_changes(along(IpminmaxPredict, {*this, x_l, x_u, g_l, g_u}, "share"));
  }
  py::dict reaction(const Array& dx) { return after(IpminmaxGetReaction, dx, "curvature"); }
  py::dict react(const Array& dx) {
    return with_changes(after(IpminmaxPredictReaction, dx, "share"));
  }

 private:
  struct Output {
    explicit Output(const Problem& of)
        : x(sized(of.n_)), lambda(sized(of.m_)), z_l(sized(of.n_)), z_u(sized(of.n_)) {}
    std::vector<double> x, lambda, z_l, z_u;
    double f = 0.0, last = 0.0;
    [[nodiscard]] py::dict dictionary(const char* last_name) const {
      py::dict result;
      result["x"] = to_array(x);
      result["mult_g"] = to_array(lambda);
      result["mult_x_L"] = to_array(z_l);
      result["mult_x_U"] = to_array(z_u);
      result["obj"] = f;
      result[last_name] = last;
      return result;
    }
  };

  /// Of all bounds, or changes of them; None: null.
  struct Sides {
    Sides(const Problem& of, const py::object& x_l, const py::object& x_u, const py::object& g_l,
          const py::object& g_u)
        : arrays{optional(x_l, of.n_, "lb"), optional(x_u, of.n_, "ub"), optional(g_l, of.m_, "cl"),
                 optional(g_u, of.m_, "cu")},
          lb(pointer(x_l, arrays[0])),
          ub(pointer(x_u, arrays[1])),
          cl(pointer(g_l, arrays[2])),
          cu(pointer(g_u, arrays[3])) {}
    std::array<Array, 4> arrays;
    const double *lb, *ub, *cl, *cu;
  };
  template <class Function>
  py::dict along(Function function, const Sides& by, const char* last_name) {
    Output out(*this);
    require_sensitivity(function(problem_, by.lb, by.ub, by.cl, by.cu, out.x.data(),
                                 out.lambda.data(), out.z_l.data(), out.z_u.data(), &out.f,
                                 &out.last));
    return out.dictionary(last_name);
  }
  template <class Function>
  py::dict after(Function function, const Array& dx, const char* last_name) {
    Output out(*this);
    check_size(dx, n_, "dx");
    require_sensitivity(function(problem_, dx.data(), out.x.data(), out.lambda.data(),
                                 out.z_l.data(), out.z_u.data(), &out.f, &out.last));
    return out.dictionary(last_name);
  }

  static constexpr double kNoLimit = 1e19;
  struct Iterate {
    std::vector<double> x, g, lambda, z_l, z_u;
    double f = 0.0;
  };

  static std::size_t size(int count) { return static_cast<std::size_t>(count); }
  static std::vector<double> sized(int count) { return std::vector<double>(size(count), 0.0); }
  static std::vector<int> to_vector(const IntArray& values) {
    return {values.data(), values.data() + values.size()};
  }
  static void check_size(const Array& values, int count, const char* name) {
    if (values.size() == count) return;
    throw py::value_error(std::string(name) + " has " + std::to_string(values.size()) +
                          " entries, but there are " + std::to_string(count));
  }
  static Array optional(const py::object& values, int count, const char* name) {
    if (values.is_none()) return Array(0);
    auto array = values.cast<Array>();
    check_size(array, count, name);
    return array;
  }
  static const double* pointer(const py::object& values, const Array& array) {
    return values.is_none() ? nullptr : array.data();
  }
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
    if (success != 1) throw std::runtime_error(IpminmaxMessage(problem_));
  }
  [[nodiscard]] py::dict with_changes(py::dict result) const {
    const int count = IpminmaxGetActiveSetChanges(problem_, 0, nullptr);
    std::vector<IpminmaxActiveSetChange> changes(static_cast<std::size_t>(count));
    IpminmaxGetActiveSetChanges(problem_, count, changes.data());
    py::list list;
    for (const auto& c : changes) {
      list.append(
          py::make_tuple(c.share, c.of_constraint != 0, c.index, c.upper != 0, c.enters != 0));
    }
    result["changes"] = list;
    result["message"] = IpminmaxMessage(problem_);
    return result;
  }

  /// Raises what a callback left, with the interpreter's lock held.
  void rethrow() {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

  // --- Stopping

  using Clock = std::chrono::steady_clock;

  void begin(bool log_on_terminal) {
    error_ = nullptr;
    interrupted_ = timed_out_ = cut_ = false;
    history_.clear();
    boxes_.forget();
    f_.known = g_.known = false;
    console_->is_terminal = log_on_terminal;
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

  /// The one call of the solver.
  int run_solver(Iterate& at, bool again) {
    const auto solver = again ? IpminmaxSolveAgain : IpminmaxSolve;
    return solver(problem_, at.x.data(), at.g.data(), &at.f, at.lambda.data(), at.z_l.data(),
                  at.z_u.data(), this);
  }

  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(Clock::now() - wall_start_).count();
  }

  /// Before each call of a function: whether there is a reason to stop, and time was left to reach
  /// the next iterate. No function is called any more then; the solver finds all of them undefined
  /// until it sees its limit, and returns what it has.
  [[nodiscard]] bool is_cut() {
    if (!interrupted_ && !timed_out_) {
      timed_out_ = limit_passed();
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

  /// The last values of a function: the solver asks for those of an iterate more than once.
  struct Last {
    std::vector<double> x, values;
    bool known = false;
    [[nodiscard]] bool has(int n, const double* at) const {
      return known && std::equal(x.begin(), x.end(), at, at + n);
    }
    void keep(int n, const double* at, int count, const double* found) {
      x.assign(at, at + n);
      values.assign(found, found + count);
      known = true;
    }
  };

  static int eval_f(int n, double* x, int, double* f, void* user_data) {
    Problem& p = of(user_data);
    if (p.f_.has(n, x)) {
      *f = p.f_.values.front();
      return 1;
    }
    if (!p.run([&] { take(call(p.objective_, to_array(x, n)), "objective", 1, f); })) return 0;
    p.f_.keep(n, x, 1, f);
    return 1;
  }
  static int eval_grad_f(int n, double* x, int, double* grad, void* user_data) {
    Problem& p = of(user_data);
    return p.run([&] { take(call(p.gradient_, to_array(x, n)), "gradient", n, grad); }) ? 1 : 0;
  }
  static int eval_g(int n, double* x, int, int m, double* g, void* user_data) {
    Problem& p = of(user_data);
    if (m == 0) return 1;
    if (p.g_.has(n, x)) {
      std::copy_n(p.g_.values.begin(), m, g);
      return 1;
    }
    if (!p.run([&] { take(call(p.constraints_, to_array(x, n)), "constraints", m, g); })) return 0;
    p.g_.keep(n, x, m, g);
    return 1;
  }
  static int eval_jac_g(int n, double* x, int, int m, int entries, int* rows, int* cols,
                        double* values, void* user_data) {
    Problem& p = of(user_data);
    if (values == nullptr) {
      std::copy(p.jac_rows_.begin(), p.jac_rows_.end(), rows);
      std::copy(p.jac_cols_.begin(), p.jac_cols_.end(), cols);
      return 1;
    }
    if (m == 0) return 1;
    const auto jacobian = [&] {
      take(call(p.jacobian_, to_array(x, n)), "jacobian", entries, values);
    };
    return p.run(jacobian) ? 1 : 0;
  }
  /// Asked row by row, the entries of a row in the order of the structure.
  static int eval_rows(int n, double* x, int, int count, const int* rows, int, double* g, int,
                       double* values, void* user_data) {
    Problem& p = of(user_data);
    std::vector<int>& places = p.row_places_;
    places.clear();
    for (int k = 0; k < count; ++k) {
      if (g != nullptr) {
        places.push_back(rows[k]);
      } else {
        const std::vector<int>& entries = p.row_entries_[size(rows[k])];
        places.insert(places.end(), entries.begin(), entries.end());
      }
    }
    p.row_values_.resize(places.size());
    const auto find = [&] {
      take(call(g != nullptr ? p.constraint_rows_ : p.jacobian_rows_, to_array(x, n),
                py::array_t<int>(count, rows)),
           g != nullptr ? "constraint_rows" : "jacobian_rows", static_cast<int>(places.size()),
           p.row_values_.data());
    };
    if (count > 0 && !p.run(find)) return 0;
    for (std::size_t k = 0; k < places.size(); ++k)
      (g != nullptr ? g : values)[places[k]] = p.row_values_[k];
    return 1;
  }
  static int eval_h(int n, double* x, int, double sigma, int m, double* lambda, int, int entries,
                    int* rows, int* cols, double* values, void* user_data) {
    Problem& p = of(user_data);
    if (values == nullptr) {
      std::copy(p.hess_rows_.begin(), p.hess_rows_.end(), rows);
      std::copy(p.hess_cols_.begin(), p.hess_cols_.end(), cols);
      return 1;
    }
    if (p.hessian_.is_none()) return 0;  // only the pattern is known
    const auto hessian = [&] {
      take(call(p.hessian_, to_array(x, n), to_array(lambda, m), sigma), "hessian", entries,
           values);
    };
    return p.run(hessian) ? 1 : 0;
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
      if (p.interrupted_ || p.intermediate_.is_none()) return;
      const py::object answer = call(p.intermediate_, mode, iter, f, inf_pr, inf_du, mu, d_norm,
                                     shift, alpha_du, alpha_pr, trials);
      go_on = answer.is_none() || answer.cast<bool>();
    });
    return go_on && !p.interrupted_ ? 1 : 0;
  }

  [[nodiscard]] py::array_t<double> history_array() const {
    constexpr py::ssize_t kColumns = 5;
    return py::array_t<double>({static_cast<py::ssize_t>(history_.size()) / kColumns, kColumns},
                               history_.data());
  }

  int n_, m_;
  std::vector<int> jac_rows_, jac_cols_, hess_rows_, hess_cols_;
  py::object objective_, gradient_, constraints_, jacobian_, hessian_, intermediate_;
  py::object constraint_rows_, jacobian_rows_;
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
    if (Problem* problem = problem_of(self)) {
      for (const py::object* function : problem->functions()) Py_VISIT(function->ptr());
    }
    return 0;
  };
  type.tp_clear = [](PyObject* self) {
    if (Problem* problem = problem_of(self)) {
      for (py::object* function : problem->functions()) *function = py::none();
    }
    return 0;
  };
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "C interface of Ipminmax with NumPy arrays; use the package ipminmax";
  module.attr("__version__") = IpminmaxVersion();
  module.attr("STATUS_OF_TIME_LIMIT") =
      static_cast<int>(ipminmax::application_status(ipminmax::Status::MaxWallTime));
  module.def("set_exceptions", [](py::object undefined, py::object late) {
    evaluation_error = undefined.release();  // as long as the interpreter
    limit_reached = late.release();
  });
  ipminmax::python::add_formulas(module);
  py::class_<Problem>(module, "Problem", py::custom_type_setup(collect_cycles))
      .def(py::init<int, int, py::dict, const Array&, const Array&, const Array&, const Array&,
                    const IntArray&, const py::object&, const IntArray&, const IntArray&,
                    const IntArray&, const IntArray&, bool>())
      .def_property_readonly("n", &Problem::variables)
      .def_property_readonly("m", &Problem::constraints)
      .def_property_readonly("solving", &Problem::solving)
      .def("add_option", &Problem::add_option)
      .def("set_scaling", &Problem::set_scaling)
      .def("set_bounds", &Problem::set_bounds)
      .def("set_recorder", &Problem::set_recorder)
      .def("set_names", &Problem::set_names)
      .def("open_output_file", &Problem::open_output_file)
      .def("solve", &Problem::solve)
      .def("limit_passed", &Problem::limit_passed)
      .def("worst_cases", &Problem::worst_cases)
      .def("proofs", &Problem::proofs)
      .def("points", &Problem::points)
      .def("statements", &Problem::statements)
      .def("certificate", &Problem::certificate)
      .def("worst_case", &Problem::worst_case)
      .def("gap", &Problem::gap)
      .def("statistics", &Problem::statistics)
      .def("current_iterate", &Problem::current_iterate)
      .def("current_violations", &Problem::current_violations)
      .def("update_sensitivity", &Problem::update_sensitivity)
      .def("derivative", &Problem::derivative)
      .def("reaction", &Problem::reaction)
      .def("predict", &Problem::predict)
      .def("react", &Problem::react);
}
