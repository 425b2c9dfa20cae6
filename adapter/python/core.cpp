// The extension module ipminmax._core: the C interface with NumPy arrays. ipminmax/problem.py is
// what users see.
//
// The interpreter's lock is released while a solve runs and taken in every callback. An exception
// of a Python function ends the solve and is raised by solve(). The first KeyboardInterrupt stops
// at the current iterate; a function that it hit is called once more, so that there is one.
#include <ipminmax.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using IntArray = py::array_t<int, py::array::c_style | py::array::forcecast>;

/// Leaves the solver after an exception of Python, which is kept in the problem.
struct ModelStopped {};

/// Raised by a model's function to say that it is undefined at this point
/// (ipminmax.EvaluationError).
py::handle evaluation_error;

py::array_t<double> to_array(const double* values, int count) {
  return py::array_t<double>(count, values);
}

/// Copies what a function returned; ValueError names the function when the size is wrong.
void take(const py::object& returned, const char* function, int count, double* values) {
  const Array array = Array::ensure(returned);
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
          std::vector<int> jac_rows, std::vector<int> jac_cols, std::vector<int> hess_rows,
          std::vector<int> hess_cols)
      : n_(n),
        m_(m),
        jac_rows_(std::move(jac_rows)),
        jac_cols_(std::move(jac_cols)),
        hess_rows_(std::move(hess_rows)),
        hess_cols_(std::move(hess_cols)) {
    const auto function = [&](const char* name) {
      return functions.contains(name) ? py::object(functions[name]) : py::none();
    };
    objective_ = function("objective");
    gradient_ = function("gradient");
    constraints_ = function("constraints");
    jacobian_ = function("jacobian");
    hessian_ = function("hessian");
    intermediate_ = function("intermediate");
    IntArray owners;
    if (!constraint_players.is_none()) owners = constraint_players.cast<IntArray>();
    problem_ = IpminmaxCreate(
        n, x_l.data(), x_u.data(), m, g_l.data(), g_u.data(), static_cast<int>(jac_rows_.size()),
        static_cast<int>(hess_rows_.size()), IPMINMAX_C_STYLE, eval_f, eval_g, eval_grad_f,
        eval_jac_g, hessian_.is_none() ? nullptr : eval_h, players.data(),
        constraint_players.is_none() ? nullptr : owners.data());
    if (problem_ == nullptr) throw py::value_error(IpminmaxMessage(nullptr));
    IpminmaxSetIntermediateCallback(problem_, intermediate);
  }
  ~Problem() { IpminmaxFree(problem_); }
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  [[nodiscard]] int variables() const { return n_; }
  [[nodiscard]] int constraints() const { return m_; }

  void add_option(const std::string& name, const py::object& value) {
    if (py::isinstance<py::str>(value)) {
      return require(
          IpminmaxAddStrOption(problem_, name.c_str(), value.cast<std::string>().c_str()));
    }
    // 1 for a real option and 1.0 for an integer one mean what they say.
    const auto number = value.cast<double>();
    const auto integer = static_cast<int>(std::clamp(number, -2147483648.0, 2147483647.0));
    const bool whole = static_cast<double>(integer) == number;
    if (whole && IpminmaxAddIntOption(problem_, name.c_str(), integer) == 1) return;
    const std::string message = IpminmaxMessage(problem_);
    const bool is_integer_option = message.find("a number option") == std::string::npos;
    if (whole && is_integer_option) throw py::value_error(message);
    require(IpminmaxAddNumOption(problem_, name.c_str(), number));
  }

  void set_scaling(double objective, const py::object& x, const py::object& g) {
    const Array x_scaling = optional(x, n_, "x_scaling"), g_scaling = optional(g, m_, "g_scaling");
    require(IpminmaxSetScaling(problem_, objective, pointer(x, x_scaling), pointer(g, g_scaling)));
  }

  void set_bounds(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                  const py::object& g_u) {
    const Array lb = optional(x_l, n_, "lb"), ub = optional(x_u, n_, "ub"),
                cl = optional(g_l, m_, "cl"), cu = optional(g_u, m_, "cu");
    require(IpminmaxSetBounds(problem_, pointer(x_l, lb), pointer(x_u, ub), pointer(g_l, cl),
                              pointer(g_u, cu)));
  }

  void open_output_file(const std::string& name, int level) {
    require(IpminmaxOpenOutputFile(problem_, name.c_str(), level));
  }

  py::dict solve(const Array& x0, const Array& lambda0, const Array& z_l0, const Array& z_u0,
                 bool again) {
    if (x0.size() != n_) throw py::value_error("x must have " + std::to_string(n_) + " entries");
    std::vector<double> x(x0.data(), x0.data() + n_), g = sized(m_), lambda = sized(m_),
                                                      z_l = sized(n_), z_u = sized(n_);
    if (!again) {
      start(lambda0, "lagrange", lambda);
      start(z_l0, "zl", z_l);
      start(z_u0, "zu", z_u);
    }
    double f = 0.0;
    error_ = nullptr;
    interrupted_ = false;
    int status = IPMINMAX_INTERNAL_ERROR;
    {
      const py::gil_scoped_release release;
      const auto run = again ? IpminmaxSolveAgain : IpminmaxSolve;
      status = run(problem_, x.data(), g.data(), &f, lambda.data(), z_l.data(), z_u.data(), this);
    }
    rethrow();
    py::dict info;
    info["x"] = to_array(x.data(), n_);
    info["g"] = to_array(g.data(), m_);
    info["obj_val"] = f;
    info["mult_g"] = to_array(lambda.data(), m_);
    info["mult_x_L"] = to_array(z_l.data(), n_);
    info["mult_x_U"] = to_array(z_u.data(), n_);
    info["status"] = status;
    info["status_name"] = IpminmaxStatusName(problem_);
    info["status_msg"] = IpminmaxMessage(problem_);
    info["interrupted"] = interrupted_;
    return info;
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
    result["reasons"] = std::string(c.reasons);
    result["hessian_disagrees"] = c.hessian_disagrees != 0;
    result["least_curvature"] = c.least_curvature;
    result["least_curvature_variable"] = c.least_curvature_variable;
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
    result["x"] = found.found != 0 ? py::object(to_array(x.data(), n_)) : py::none();
    return result;
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
    result["x"] = to_array(x.data(), n_);
    result["mult_x_L"] = to_array(z_l.data(), n_);
    result["mult_x_U"] = to_array(z_u.data(), n_);
    result["g"] = to_array(g.data(), m_);
    result["mult_g"] = to_array(lambda.data(), m_);
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
    result["x_L_violation"] = to_array(xl.data(), n_);
    result["x_U_violation"] = to_array(xu.data(), n_);
    result["compl_x_L"] = to_array(cl.data(), n_);
    result["compl_x_U"] = to_array(cu.data(), n_);
    result["grad_lag_x"] = to_array(grad.data(), n_);
    result["g_violation"] = to_array(g.data(), m_);
    result["compl_g"] = to_array(cg.data(), m_);
    return result;
  }

  void update_sensitivity() { require_sensitivity(IpminmaxUpdateSensitivity(problem_)); }

  py::dict derivative(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                      const py::object& g_u) {
    Output out(*this);
    const Array lb = optional(x_l, n_, "lb"), ub = optional(x_u, n_, "ub"),
                cl = optional(g_l, m_, "cl"), cu = optional(g_u, m_, "cu");
    require_sensitivity(IpminmaxGetDerivative(
        problem_, pointer(x_l, lb), pointer(x_u, ub), pointer(g_l, cl), pointer(g_u, cu),
        out.x.data(), out.lambda.data(), out.z_l.data(), out.z_u.data(), &out.f, &out.last));
    return out.dictionary("curvature");
  }

  py::dict reaction(const Array& dx) {
    Output out(*this);
    check_size(dx, n_, "dx");
    require_sensitivity(IpminmaxGetReaction(problem_, dx.data(), out.x.data(), out.lambda.data(),
                                            out.z_l.data(), out.z_u.data(), &out.f, &out.last));
    return out.dictionary("curvature");
  }

  py::dict predict(const py::object& x_l, const py::object& x_u, const py::object& g_l,
                   const py::object& g_u) {
    Output out(*this);
    const Array lb = optional(x_l, n_, "lb"), ub = optional(x_u, n_, "ub"),
                cl = optional(g_l, m_, "cl"), cu = optional(g_u, m_, "cu");
    require_sensitivity(IpminmaxPredict(
        problem_, pointer(x_l, lb), pointer(x_u, ub), pointer(g_l, cl), pointer(g_u, cu),
        out.x.data(), out.lambda.data(), out.z_l.data(), out.z_u.data(), &out.f, &out.last));
    return with_changes(out.dictionary("share"));
  }

  py::dict react(const Array& dx) {
    Output out(*this);
    check_size(dx, n_, "dx");
    require_sensitivity(IpminmaxPredictReaction(problem_, dx.data(), out.x.data(),
                                                out.lambda.data(), out.z_l.data(), out.z_u.data(),
                                                &out.f, &out.last));
    return with_changes(out.dictionary("share"));
  }

 private:
  struct Output {
    explicit Output(const Problem& of)
        : x(sized(of.n_)), lambda(sized(of.m_)), z_l(sized(of.n_)), z_u(sized(of.n_)) {}
    std::vector<double> x, lambda, z_l, z_u;
    double f = 0.0, last = 0.0;
    [[nodiscard]] py::dict dictionary(const char* last_name) const {
      py::dict result;
      result["x"] = py::array_t<double>(static_cast<py::ssize_t>(x.size()), x.data());
      result["mult_g"] =
          py::array_t<double>(static_cast<py::ssize_t>(lambda.size()), lambda.data());
      result["mult_x_L"] = py::array_t<double>(static_cast<py::ssize_t>(z_l.size()), z_l.data());
      result["mult_x_U"] = py::array_t<double>(static_cast<py::ssize_t>(z_u.size()), z_u.data());
      result["obj"] = f;
      result[last_name] = last;
      return result;
    }
  };

  static std::vector<double> sized(int count) {
    return std::vector<double>(static_cast<std::size_t>(count), 0.0);
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

  /// Runs a model's function; false: undefined here.
  template <class Function>
  bool run(Function function) {
    const py::gil_scoped_acquire lock;
    if (error_) throw ModelStopped{};
    for (;;) {
      try {
        function();
        return true;
      } catch (py::error_already_set& error) {
        if (error.matches(evaluation_error)) return false;
        if (!interrupted_ && error.matches(PyExc_KeyboardInterrupt)) {
          interrupted_ = true;
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

  static int eval_f(int n, double* x, int, double* f, void* user_data) {
    Problem& p = of(user_data);
    return p.run([&] { take(p.objective_(to_array(x, n)), "objective", 1, f); }) ? 1 : 0;
  }
  static int eval_grad_f(int n, double* x, int, double* grad, void* user_data) {
    Problem& p = of(user_data);
    return p.run([&] { take(p.gradient_(to_array(x, n)), "gradient", n, grad); }) ? 1 : 0;
  }
  static int eval_g(int n, double* x, int, int m, double* g, void* user_data) {
    Problem& p = of(user_data);
    if (m == 0) return 1;
    return p.run([&] { take(p.constraints_(to_array(x, n)), "constraints", m, g); }) ? 1 : 0;
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
    return p.run([&] { take(p.jacobian_(to_array(x, n)), "jacobian", entries, values); }) ? 1 : 0;
  }
  static int eval_h(int n, double* x, int, double sigma, int m, double* lambda, int, int entries,
                    int* rows, int* cols, double* values, void* user_data) {
    Problem& p = of(user_data);
    if (values == nullptr) {
      std::copy(p.hess_rows_.begin(), p.hess_rows_.end(), rows);
      std::copy(p.hess_cols_.begin(), p.hess_cols_.end(), cols);
      return 1;
    }
    return p.run([&] {
      take(p.hessian_(to_array(x, n), to_array(lambda, m), sigma), "hessian", entries, values);
    })
               ? 1
               : 0;
  }
  static int intermediate(int mode, int iter, double f, double inf_pr, double inf_du, double mu,
                          double d_norm, double shift, double alpha_du, double alpha_pr, int trials,
                          void* user_data) {
    Problem& p = of(user_data);
    bool go_on = true;
    p.run([&] {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (p.interrupted_ || p.intermediate_.is_none()) return;
      const py::object answer = p.intermediate_(mode, iter, f, inf_pr, inf_du, mu, d_norm, shift,
                                                alpha_du, alpha_pr, trials);
      go_on = answer.is_none() || answer.cast<bool>();
    });
    return go_on && !p.interrupted_ ? 1 : 0;
  }

  int n_, m_;
  std::vector<int> jac_rows_, jac_cols_, hess_rows_, hess_cols_;
  py::object objective_, gradient_, constraints_, jacobian_, hessian_, intermediate_;
  IpminmaxProblem problem_ = nullptr;
  std::exception_ptr error_;
  bool interrupted_ = false;
};

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "C interface of Ipminmax with NumPy arrays; use the package ipminmax";
  module.attr("__version__") = IpminmaxVersion();
  module.def("set_evaluation_error", [](py::object type) {
    evaluation_error = type.release();  // as long as the interpreter
  });
  py::class_<Problem>(module, "Problem")
      .def(py::init<int, int, py::dict, const Array&, const Array&, const Array&, const Array&,
                    const IntArray&, const py::object&, std::vector<int>, std::vector<int>,
                    std::vector<int>, std::vector<int>>())
      .def_property_readonly("n", &Problem::variables)
      .def_property_readonly("m", &Problem::constraints)
      .def("add_option", &Problem::add_option)
      .def("set_scaling", &Problem::set_scaling)
      .def("set_bounds", &Problem::set_bounds)
      .def("open_output_file", &Problem::open_output_file)
      .def("solve", &Problem::solve)
      .def("certificate", &Problem::certificate)
      .def("worst_case", &Problem::worst_case)
      .def("statistics", &Problem::statistics)
      .def("current_iterate", &Problem::current_iterate)
      .def("current_violations", &Problem::current_violations)
      .def("update_sensitivity", &Problem::update_sensitivity)
      .def("derivative", &Problem::derivative)
      .def("reaction", &Problem::reaction)
      .def("predict", &Problem::predict)
      .def("react", &Problem::react);
}
