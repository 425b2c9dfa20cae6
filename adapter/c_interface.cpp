#include <IpOptionsList.hpp>
#include <IpRegOptions.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "adapter/application_options.hpp"
#include "adapter/ipminmax.h"
#include "adapter/minmax_application.hpp"
#include "adapter/minmax_tnlp.hpp"
#include "adapter/optional_players.hpp"
#include "adapter/point_arrays.hpp"
#include "core/sensitivity.hpp"
#include "core/version.h"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using Ipopt::SmartPtr;

// The header repeats these values, so that it does not need Ipopt's or the core's.
template <class Ours, class Theirs>
constexpr bool same(Ours ours, Theirs theirs) {
  return static_cast<int>(ours) == static_cast<int>(theirs);
}
static_assert(same(IPMINMAX_SOLVE_SUCCEEDED, Ipopt::Solve_Succeeded));
static_assert(same(IPMINMAX_SOLVED_TO_ACCEPTABLE_LEVEL, Ipopt::Solved_To_Acceptable_Level));
static_assert(same(IPMINMAX_INFEASIBLE_PROBLEM_DETECTED, Ipopt::Infeasible_Problem_Detected));
static_assert(same(IPMINMAX_SEARCH_DIRECTION_BECOMES_TOO_SMALL,
                   Ipopt::Search_Direction_Becomes_Too_Small));
static_assert(same(IPMINMAX_DIVERGING_ITERATES, Ipopt::Diverging_Iterates));
static_assert(same(IPMINMAX_USER_REQUESTED_STOP, Ipopt::User_Requested_Stop));
static_assert(same(IPMINMAX_FEASIBLE_POINT_FOUND, Ipopt::Feasible_Point_Found));
static_assert(same(IPMINMAX_MAXIMUM_ITERATIONS_EXCEEDED, Ipopt::Maximum_Iterations_Exceeded));
static_assert(same(IPMINMAX_RESTORATION_FAILED, Ipopt::Restoration_Failed));
static_assert(same(IPMINMAX_ERROR_IN_STEP_COMPUTATION, Ipopt::Error_In_Step_Computation));
static_assert(same(IPMINMAX_MAXIMUM_CPUTIME_EXCEEDED, Ipopt::Maximum_CpuTime_Exceeded));
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
static_assert(same(IPMINMAX_MAXIMUM_WALLTIME_EXCEEDED, Ipopt::Maximum_WallTime_Exceeded));
#endif
static_assert(same(IPMINMAX_NOT_ENOUGH_DEGREES_OF_FREEDOM, Ipopt::Not_Enough_Degrees_Of_Freedom));
static_assert(same(IPMINMAX_INVALID_PROBLEM_DEFINITION, Ipopt::Invalid_Problem_Definition));
static_assert(same(IPMINMAX_INVALID_OPTION, Ipopt::Invalid_Option));
static_assert(same(IPMINMAX_INVALID_NUMBER_DETECTED, Ipopt::Invalid_Number_Detected));
static_assert(same(IPMINMAX_UNRECOVERABLE_EXCEPTION, Ipopt::Unrecoverable_Exception));
static_assert(same(IPMINMAX_NONIPOPT_EXCEPTION_THROWN, Ipopt::NonIpopt_Exception_Thrown));
static_assert(same(IPMINMAX_INSUFFICIENT_MEMORY, Ipopt::Insufficient_Memory));
static_assert(same(IPMINMAX_INTERNAL_ERROR, Ipopt::Internal_Error));
static_assert(same(IPMINMAX_MIN, Player::Min) && same(IPMINMAX_MAX, Player::Max));
static_assert(same(IPMINMAX_C_STYLE, Ipopt::TNLP::C_STYLE) &&
              same(IPMINMAX_FORTRAN_STYLE, Ipopt::TNLP::FORTRAN_STYLE));
static_assert(same(IPMINMAX_LOCAL_MINMAX, PointKind::LocalMinmax) &&
              same(IPMINMAX_FIRST_ORDER_POINT, PointKind::FirstOrderPoint) &&
              same(IPMINMAX_FEASIBLE_POINT, PointKind::FeasiblePoint) &&
              same(IPMINMAX_INFEASIBLE_POINT, PointKind::InfeasiblePoint) &&
              same(IPMINMAX_UNKNOWN_POINT, PointKind::Unknown));
static_assert(same(IPMINMAX_ANSWER_UNKNOWN, InnerAnswer::Unknown) &&
              same(IPMINMAX_ANSWER_STRICTLY_BEST, InnerAnswer::StrictlyBest) &&
              same(IPMINMAX_ANSWER_UNIQUE, InnerAnswer::Unique) &&
              same(IPMINMAX_ANSWER_SMOOTH, InnerAnswer::Smooth));
static_assert(same(IPMINMAX_NOT_TESTED, SecondOrder::NotTested) &&
              same(IPMINMAX_SATISFIED, SecondOrder::Satisfied) &&
              same(IPMINMAX_UNDECIDED, SecondOrder::Undecided) &&
              same(IPMINMAX_VIOLATED, SecondOrder::Violated) &&
              same(IPMINMAX_FLAT, SecondOrder::Flat));

std::size_t size_of(Index n) { return static_cast<std::size_t>(n); }

/// What IpminmaxCreate was given; arrays have n or m entries.
struct Definition {
  Index n = 0, m = 0, nele_jac = 0, nele_hess = 0;
  Ipopt::TNLP::IndexStyleEnum index_style = Ipopt::TNLP::C_STYLE;
  std::vector<double> x_lower, x_upper, g_lower, g_upper;
  std::vector<int> variable_players;
  std::vector<int> constraint_players;  ///< m, or empty: implied
  IpminmaxEval_F_CB eval_f = nullptr;
  IpminmaxEval_G_CB eval_g = nullptr;
  IpminmaxEval_Grad_F_CB eval_grad_f = nullptr;
  IpminmaxEval_Jac_G_CB eval_jac_g = nullptr;
  IpminmaxEval_H_CB eval_h = nullptr;
};

/// Primal and dual variables: n, m, n, n.
struct Point {
  std::vector<double> x, lambda, z_lower, z_upper;
};

/// The C model as an Ipopt model.
class CallbackTNLP : public MinMaxTNLP, public OptionalPlayers {
 public:
  explicit CallbackTNLP(Definition definition) : d_(std::move(definition)) {}

  [[nodiscard]] const Definition& definition() const { return d_; }
  [[nodiscard]] Definition& definition() { return d_; }

  IpminmaxIntermediate_CB intermediate = nullptr;
  bool needs_hessian = true;  ///< whether an eval_h must know its structure
  double objective_scaling = 1.0;
  std::vector<double> x_scaling, g_scaling;  ///< n and m, or empty: none
  void* user_data = nullptr;
  Point start;   ///< multipliers may be empty unless the start is warm
  Point answer;  ///< of finalize_solution
  std::vector<double> g;
  double objective = 0.0;

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = d_.n;
    m = d_.m;
    nnz_jac_g = d_.nele_jac;
    nnz_h_lag = d_.nele_hess;
    index_style = d_.index_style;
    return true;
  }

  bool get_variable_players(Index, Player* players) override {
    std::transform(d_.variable_players.begin(), d_.variable_players.end(), players, player);
    return true;
  }

  bool get_constraint_players(Index, Player* players) override {
    std::transform(d_.constraint_players.begin(), d_.constraint_players.end(), players, player);
    return true;
  }

  bool get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l, Number* g_u) override {
    copy_to(x_l, d_.x_lower);
    copy_to(x_u, d_.x_upper);
    copy_to(g_l, d_.g_lower);
    copy_to(g_u, d_.g_upper);
    return true;
  }

  bool get_scaling_parameters(Number& obj_scaling, bool& use_x_scaling, Index,
                              Number* x_scaling_out, bool& use_g_scaling, Index,
                              Number* g_scaling_out) override {
    obj_scaling = objective_scaling;
    use_x_scaling = !x_scaling.empty();
    use_g_scaling = !g_scaling.empty();
    copy_to(x_scaling_out, x_scaling);
    copy_to(g_scaling_out, g_scaling);
    return true;
  }

  bool get_starting_point(Index, bool init_x, Number* x, bool init_z, Number* z_L, Number* z_U,
                          Index, bool init_lambda, Number* lambda) override {
    if (init_x) copy_to(x, start.x);
    if (init_z) copy_to(z_L, start.z_lower);
    if (init_z) copy_to(z_U, start.z_upper);
    if (init_lambda) copy_to(lambda, start.lambda);
    return true;
  }

  bool eval_f(Index n, const Number* x, bool new_x, Number& obj_value) override {
    return is_true(d_.eval_f(n, writable(x), new_x, &obj_value, user_data));
  }

  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* grad_f) override {
    return is_true(d_.eval_grad_f(n, writable(x), new_x, grad_f, user_data));
  }

  bool eval_g(Index n, const Number* x, bool new_x, Index m, Number* values) override {
    return d_.eval_g == nullptr || is_true(d_.eval_g(n, writable(x), new_x, m, values, user_data));
  }

  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index nele_jac, Index* iRow,
                  Index* jCol, Number* values) override {
    return d_.eval_jac_g == nullptr || is_true(d_.eval_jac_g(n, writable(x), new_x, m, nele_jac,
                                                             iRow, jCol, values, user_data));
  }

  bool eval_h(Index n, const Number* x, bool new_x, Number obj_factor, Index m,
              const Number* lambda, bool new_lambda, Index nele_hess, Index* iRow, Index* jCol,
              Number* values) override {
    if (d_.eval_h == nullptr) return false;
    const bool done = is_true(d_.eval_h(n, writable(x), new_x, obj_factor, m, writable(lambda),
                                        new_lambda, nele_hess, iRow, jCol, values, user_data));
    if (!done && values == nullptr && needs_hessian) {
      THROW_EXCEPTION(  // Invalid_Option, as in Ipopt
          Ipopt::OPTION_INVALID,
          "eval_h returned 0 when asked for the structure of the Hessian; without second "
          "derivatives "
          "eval_h is NULL, or hessian_approximation finite-difference-values");
    }
    return done;
  }

  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iter, Number obj_value, Number inf_pr,
                             Number inf_du, Number mu, Number d_norm, Number regularization_size,
                             Number alpha_du, Number alpha_pr, Index ls_trials,
                             const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    return intermediate == nullptr ||
           is_true(intermediate(static_cast<int>(mode), iter, obj_value, inf_pr, inf_du, mu, d_norm,
                                regularization_size, alpha_du, alpha_pr, ls_trials, user_data));
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number* z_L,
                         const Number* z_U, Index m, const Number* g_values, const Number* lambda,
                         Number obj_value, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    answer.x.assign(x, x + n);
    answer.z_lower.assign(z_L, z_L + n);
    answer.z_upper.assign(z_U, z_U + n);
    answer.lambda.assign(lambda, lambda + m);
    g.assign(g_values, g_values + m);
    objective = obj_value;
    finalized = true;
  }

  bool finalized = false;  ///< whether the current solve has an answer

 private:
  /// Callbacks made for Ipopt 3.14 return bool, of which a caller that reads an int finds only the
  /// low byte defined (System V and AArch64 ABI).
  static bool is_true(int returned) { return static_cast<unsigned char>(returned) != 0; }
  // Ipopt's C callbacks take pointers to non-const and promise not to write.
  static double* writable(const double* values) { return const_cast<double*>(values); }
  static Player player(int value) { return static_cast<Player>(value); }

  Definition d_;
};

/// Message of calls without a problem; no allocation, so that it can report out of memory.
thread_local std::array<char, 512> creation_message{};

void say_without_problem(const char* text) noexcept {
  std::snprintf(creation_message.data(), creation_message.size(), "%s", text);
}

std::string at(const char* array, std::size_t i) {
  return std::string(array) + "[" + std::to_string(i) + "]";
}

/// Copies count entries; error names the array when it is missing or the entry that is NaN.
std::vector<double> read_array(const double* values, Index count, const char* name,
                               std::string& error) {
  if (count <= 0 || !error.empty()) return {};
  if (values == nullptr) {
    error = std::string(name) + " is NULL";
    return {};
  }
  const std::vector<double> result(values, values + count);
  const auto nan = std::find_if(result.begin(), result.end(), [](double v) { return v != v; });
  if (nan != result.end()) error = at(name, size_of(Index(nan - result.begin()))) + " is NaN";
  return result;
}

std::vector<int> read_players(const int* players, Index count, const char* name,
                              std::string& error) {
  if (players == nullptr || count <= 0 || !error.empty()) return {};
  const std::vector<int> result(players, players + count);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (result[i] == IPMINMAX_MIN || result[i] == IPMINMAX_MAX) continue;
    error = at(name, i) + " = " + std::to_string(result[i]) +
            "; it must be 0 (IPMINMAX_MIN) or 1 (IPMINMAX_MAX)";
    break;
  }
  return result;
}

/// What is wrong with sizes and callbacks; empty when nothing is.
std::string error_of(const Definition& d, int index_style, const int* variable_players) {
  if (d.n < 0) return "n = " + std::to_string(d.n) + " is negative";
  if (d.m < 0) return "m = " + std::to_string(d.m) + " is negative";
  if (d.nele_jac < 0) return "nele_jac = " + std::to_string(d.nele_jac) + " is negative";
  if (d.nele_hess < 0) return "nele_hess = " + std::to_string(d.nele_hess) + " is negative";
  if (d.m == 0 && d.nele_jac > 0) {
    return "nele_jac = " + std::to_string(d.nele_jac) + " without constraints";
  }
  if (index_style != IPMINMAX_C_STYLE && index_style != IPMINMAX_FORTRAN_STYLE) {
    return "index_style = " + std::to_string(index_style) + "; it must be 0 (C) or 1 (Fortran)";
  }
  if (d.eval_f == nullptr) return "eval_f is NULL";
  if (d.eval_grad_f == nullptr) return "eval_grad_f is NULL";
  if (d.m > 0 && d.eval_g == nullptr) return "eval_g is NULL";
  if (d.m > 0 && d.eval_jac_g == nullptr) return "eval_jac_g is NULL";
  if (d.n > 0 && variable_players == nullptr) return "variable_players is NULL";
  return {};
}

template <class Value>
std::string text_of(Value value) {
  std::array<char, 64> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

/// Copies scaling factors; NULL is none.
std::vector<double> read_scaling(const double* values, Index count, const char* name,
                                 std::string& error) {
  if (values == nullptr) return {};
  std::vector<double> result = read_array(values, count, name, error);
  for (std::size_t i = 0; i < result.size() && error.empty(); ++i) {
    if (!is_sane_scaling(result[i])) {
      error = at(name, i) + " = " + text_of(result[i]) + " is not in [" + text_of(kLeastScaling) +
              ", " + text_of(kLargestScaling) + "]";
    }
  }
  return result;
}

std::string name_of(Ipopt::RegisteredOptionType type) {
  if (type == Ipopt::OT_Number) return "a number";
  if (type == Ipopt::OT_Integer) return "an integer";
  return "a string";
}

}  // namespace
}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax

/// What an IpminmaxProblem points to.
struct IpminmaxProblemInfo {
  explicit IpminmaxProblemInfo(ipminmax::Definition definition)
      : model(new ipminmax::CallbackTNLP(std::move(definition))),
        application(new ipminmax::MinMaxApplication) {}

  Ipopt::SmartPtr<ipminmax::CallbackTNLP> model;
  Ipopt::SmartPtr<ipminmax::MinMaxApplication> application;
  bool solving = false;
  bool answered = false;       ///< whether the last solve has an iterate to report
  bool warm_for_once = false;  ///< warm_start_init_point is to be no again
  std::string status;          ///< name of the last solve's status
  ipminmax::Sensitivity sensitivity;
  bool sensitivity_fits = false;                   ///< whether it is that of the last solve
  std::vector<ipminmax::ActiveSetChange> changes;  ///< of the last prediction
  std::string reasons;                             ///< of the last certificate asked for
  std::vector<double> branches;                    ///< of the last worst case given out
  std::string message;
  const char* fixed_message = nullptr;  ///< in place of message, where memory is short
};

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Problem = ::IpminmaxProblemInfo;

void say(Problem* problem, std::string text) noexcept {
  if (problem == nullptr) return say_without_problem(text.c_str());
  problem->fixed_message = nullptr;
  problem->message = std::move(text);
}

void say_fixed(Problem* problem, const char* text) noexcept {
  if (problem == nullptr) return say_without_problem(text);
  problem->fixed_message = text;
}

/// Runs action, which returns an error or nothing; 1 when there is none. No exception leaves.
template <class Action>
int guarded(Problem* problem, Action action) noexcept {
  if (problem == nullptr) {
    say_without_problem("the problem is NULL");
    return 0;
  }
  try {
    std::string error = action();
    if (error.empty()) return 1;
    say(problem, std::move(error));
  } catch (const std::bad_alloc&) {
    say_fixed(problem, "out of memory");
  } catch (...) {
    say_fixed(problem, "internal error: unexpected exception");
  }
  return 0;
}

int add_option(Problem* problem, const char* keyword, Ipopt::RegisteredOptionType type,
               auto make_text) noexcept {
  return guarded(problem, [&]() -> std::string {
    if (keyword == nullptr) return "the option's name is NULL";
    const auto registry = problem->application->RegOptions();
    const SmartPtr<const Ipopt::RegisteredOption> option = registry->GetOption(keyword);
    const std::string name(keyword);
    if (Ipopt::IsNull(option)) return unknown_option(name, *registry);
    if (option->Type() != type) {
      return name + " is " + name_of(option->Type()) + " option, not " + name_of(type) + " option";
    }
    return set_option(name, make_text(), *registry, *problem->application->Options(), true);
  });
}

bool is_warm(const Problem& problem) {
  bool warm = false;
  problem.application->Options()->GetBoolValue("warm_start_init_point", warm, "");
  return warm;
}

/// warm_start_init_point is yes while this lives. Where memory is too short for setting it back,
/// the next solve does.
class WarmStart {
 public:
  explicit WarmStart(Problem& problem) : problem_(problem) {
    if (is_warm(problem)) return;
    problem.warm_for_once = true;
    set(problem, "yes");
  }
  ~WarmStart() {
    try {
      end(problem_);
    } catch (...) {  // bad_alloc
    }
  }
  WarmStart(const WarmStart&) = delete;
  WarmStart& operator=(const WarmStart&) = delete;

  static void end(Problem& problem) {
    if (!problem.warm_for_once) return;
    set(problem, "no");
    problem.warm_for_once = false;
  }

 private:
  static void set(Problem& problem, const char* value) {
    problem.application->Options()->SetStringValue("warm_start_init_point", value);
  }
  Problem& problem_;
};

/// Whether second derivatives are asked of the model: a callback for them then has to answer.
bool asks_for_hessian(const Problem& problem) {
  std::string source;
  return !problem.application->Options()->GetStringValue("hessian_approximation", source, "") ||
         source == "exact";
}

/// Where IpminmaxSolve writes; all but x may be null.
struct Output {
  double *x, *g, *objective, *lambda, *z_lower, *z_upper;
};

IpminmaxReturnStatus stop(Problem& problem, Status status, std::string message) {
  problem.status = ipminmax::name_of(status);
  say(&problem, std::move(message));
  return status == Status::InvalidOption ? IPMINMAX_INVALID_OPTION
         : status == Status::OutOfMemory ? IPMINMAX_INSUFFICIENT_MEMORY
                                         : IPMINMAX_INVALID_PROBLEM_DEFINITION;
}

/// Copies the answer out.
void write(const CallbackTNLP& model, const Output& out) {
  copy_to(out.x, model.answer.x);
  copy_to(out.g, model.g);
  copy_to(out.lambda, model.answer.lambda);
  copy_to(out.z_lower, model.answer.z_lower);
  copy_to(out.z_upper, model.answer.z_upper);
  if (out.objective != nullptr) *out.objective = model.objective;
}

enum class Call : std::uint8_t { Solve, Again, OverRanks };

/// Solves from the model's start, options read.
IpminmaxReturnStatus run(Problem& problem, const Output& out, Call call) {
  MinMaxApplication& application = *problem.application;
  const SmartPtr<Ipopt::TNLP> model = Ipopt::GetRawPtr(problem.model);
  const auto status = call == Call::Again       ? application.ReOptimizeTNLP(model)
                      : call == Call::OverRanks ? application.OptimizeTNLPOverRanks(model)
                                                : application.OptimizeTNLP(model);
  const Result& result = application.LastResult();
  problem.status = ipminmax::name_of(result.status);
  say(&problem, result.message);
  problem.answered = Ipopt::IsValid(application.Statistics());
  if (problem.model->finalized) write(*problem.model, out);
  return static_cast<IpminmaxReturnStatus>(status);
}

IpminmaxReturnStatus start(Problem& problem, const Output& out, void* user_data, Call call) {
  const bool again = call == Call::Again;
  CallbackTNLP& model = *problem.model;
  const Definition& d = model.definition();
  if (again && !problem.answered) {
    return stop(problem, Status::InvalidProblem,
                "IpminmaxSolveAgain needs a last solve with a final point");
  }
  WarmStart::end(problem);
  problem.answered = false;
  problem.sensitivity_fits = false;
  model.finalized = false;
  model.user_data = user_data;
  if (d.n > 0 && out.x == nullptr) return stop(problem, Status::InvalidProblem, "x is NULL");
  if (problem.application->Initialize() != Ipopt::Solve_Succeeded) {
    const Result& failure = problem.application->LastResult();
    return stop(problem, failure.status, failure.message);
  }

  model.needs_hessian = asks_for_hessian(problem);
  model.start.x.assign(out.x, out.x + d.n);
  if (again) {
    model.start.lambda = model.answer.lambda;
    model.start.z_lower = model.answer.z_lower;
    model.start.z_upper = model.answer.z_upper;
    const WarmStart warm(problem);
    if (!is_warm(problem)) {
      return stop(problem, Status::InvalidOption,
                  "the options file sets warm_start_init_point = no: cannot solve again from the "
                  "last multipliers");
    }
    return run(problem, out, call);
  }
  if (is_warm(problem)) {
    const char* missing = d.m > 0 && out.lambda == nullptr    ? "mult_g"
                          : d.n > 0 && out.z_lower == nullptr ? "mult_x_L"
                          : d.n > 0 && out.z_upper == nullptr ? "mult_x_U"
                                                              : nullptr;
    if (missing != nullptr) {
      return stop(problem, Status::InvalidProblem,
                  std::string("warm_start_init_point = yes, but ") + missing + " is NULL");
    }
    model.start.lambda.clear();
    if (d.m > 0) model.start.lambda.assign(out.lambda, out.lambda + d.m);
    model.start.z_lower.assign(out.z_lower, out.z_lower + d.n);
    model.start.z_upper.assign(out.z_upper, out.z_upper + d.n);
  }
  return run(problem, out, call);
}

IpminmaxReturnStatus solve_guarded(Problem* problem, const Output& out, void* user_data,
                                   Call call) noexcept {
  if (problem == nullptr) {
    say_without_problem("the problem is NULL");
    return IPMINMAX_INVALID_PROBLEM_DEFINITION;
  }
  if (problem->solving) {
    say_fixed(problem, "the problem is being solved: no solve inside its own callbacks");
    return IPMINMAX_INVALID_PROBLEM_DEFINITION;
  }
  problem->solving = true;
  IpminmaxReturnStatus status = IPMINMAX_INTERNAL_ERROR;
  try {
    status = start(*problem, out, user_data, call);
  } catch (const std::bad_alloc&) {
    say_fixed(problem, "out of memory");
    status = IPMINMAX_INSUFFICIENT_MEMORY;
  } catch (...) {
    say_fixed(problem, "internal error: unexpected exception");
  }
  problem->solving = false;
  return status;
}

IpminmaxInertia to_c(const Inertia& inertia) {
  return {inertia.positive, inertia.negative, inertia.zero};
}

constexpr const char* kNoCallback =
    "there is a current iterate only inside the intermediate callback";

/// What is wrong with array sizes given to the functions for the current iterate.
std::string error_of_sizes(const Problem& problem, int n, int m) {
  const Definition& d = problem.model->definition();
  if (n != d.n) return "n = " + std::to_string(n) + ", but there are " + std::to_string(d.n);
  if (m != d.m) return "m = " + std::to_string(m) + ", but there are " + std::to_string(d.m);
  return {};
}

constexpr const char* kNoSensitivity =
    "no sensitivity: IpminmaxUpdateSensitivity has not succeeded since the last solve";

/// Copies bounds' changes; NULL is none.
BoundChange read_change(const Definition& d, const double* dx_L, const double* dx_U,
                        const double* dg_L, const double* dg_U, std::string& error) {
  const auto read = [&](const double* values, Index count, const char* name) {
    return values == nullptr ? std::vector<double>() : read_array(values, count, name, error);
  };
  BoundChange change;
  change.variable_lower = read(dx_L, d.n, "dx_L");
  change.variable_upper = read(dx_U, d.n, "dx_U");
  change.constraint_lower = read(dg_L, d.m, "dg_L");
  change.constraint_upper = read(dg_U, d.m, "dg_U");
  return change;
}

/// Runs action with the sensitivity; errors of its arguments are returned.
template <class Action>
std::string with_sensitivity(Problem& problem, std::string error, Action action) {
  if (!error.empty()) return error;
  if (!problem.sensitivity_fits) return kNoSensitivity;
  try {
    action(problem.sensitivity);
  } catch (const std::invalid_argument& wrong) {
    return wrong.what();
  } catch (const std::runtime_error& singular) {
    return singular.what();
  }
  return {};
}

/// Output arrays of a derivative or prediction; all may be null.
struct SensitivityOutput {
  double *x, *mult_g, *mult_x_L, *mult_x_U, *obj, *last;
};

void write(const SolutionDerivative& found, const SensitivityOutput& out) {
  copy_to(out.x, found.v);
  copy_to(out.mult_g, found.lambda);
  copy_to(out.mult_x_L, found.z_lower);
  copy_to(out.mult_x_U, found.z_upper);
  if (out.obj != nullptr) *out.obj = found.objective;
  if (out.last != nullptr) *out.last = found.objective_curvature;
}

void write(Prediction found, Problem& problem, const SensitivityOutput& out) {
  copy_to(out.x, found.v);
  copy_to(out.mult_g, found.lambda);
  copy_to(out.mult_x_L, found.z_lower);
  copy_to(out.mult_x_U, found.z_upper);
  if (out.obj != nullptr) *out.obj = found.objective;
  if (out.last != nullptr) *out.last = found.share;
  problem.changes = std::move(found.changes);
  say(&problem, std::move(found.message));
}

/// Sizes of the structures when they were first fixed: those of a caller who does not tell. They
/// stay as they are when a structure grows.
constexpr std::size_t kFirstCertificate =
    offsetof(IpminmaxCertificate, least_curvature_variable) + sizeof(int);
constexpr std::size_t kFirstStatistics =
    offsetof(IpminmaxStatistics, objective_scale) + sizeof(double);
constexpr std::size_t kFirstWorstCase = offsetof(IpminmaxWorstCase, stated_concave) + sizeof(int);
constexpr std::size_t kFirstActiveSetChange =
    offsetof(IpminmaxActiveSetChange, enters) + sizeof(int);

/// As much of a structure as the caller's has; what his has beyond is zero.
template <class Structure>
void write_sized(const Structure& from, void* to, std::size_t size) {
  const std::size_t known = std::min(size, sizeof(Structure));
  std::memcpy(to, &from, known);
  std::memset(static_cast<char*>(to) + known, 0, size - known);
}

/// A structure of the caller's.
template <class Structure>
struct Target {
  Structure* structure;
  std::size_t size;
};

/// Fills the caller's structure and array.
void write(Problem& problem, const WorstCase& from, Target<IpminmaxWorstCase> target,
           double* worst_x) {
  IpminmaxWorstCase to{};
  to.starts = from.starts;
  to.maxima = from.maxima;
  to.competing = from.competing;
  to.value = from.value;
  to.found = from.v.empty() ? 0 : 1;
  to.higher = from.higher ? 1 : 0;
  to.unbounded = from.unbounded ? 1 : 0;
  to.single_branch = from.single_branch ? 1 : 0;
  to.stated_concave = from.stated_concave ? 1 : 0;
  write_sized(to, target.structure, target.size);
  problem.branches = from.branches;
  copy_to(worst_x, from.v);
}

/// As IpminmaxSolve would: the options file is read, and no callback of the model may call this.
std::string check_worst_case_of(Problem& problem, const double* x, int starts,
                                Target<IpminmaxWorstCase> target, double* worst_x,
                                void* user_data) {
  if (problem.solving) return "the problem is being solved";
  if (target.structure == nullptr) return "the structure to be filled is NULL";
  std::string error;
  const std::vector<double> v = read_array(x, problem.model->definition().n, "x", error);
  if (!error.empty()) return error;
  if (problem.application->Initialize() != Ipopt::Solve_Succeeded) {
    return problem.application->LastResult().message;
  }
  problem.model->user_data = user_data;
  problem.model->needs_hessian = asks_for_hessian(problem);
  problem.model->start.x = v;
  problem.solving = true;
  WorstCaseCheck check;
  try {
    error = problem.application->CheckWorstCase(Ipopt::GetRawPtr(problem.model), v, starts, check);
  } catch (...) {
    problem.solving = false;
    throw;
  }
  problem.solving = false;
  if (error.empty()) write(problem, check.found, target, worst_x);
  return error;
}

std::string error_of_answer(const Problem& problem, const void* target) {
  if (target == nullptr) return "the structure to be filled is NULL";
  if (!problem.answered) return "no solve has reached a first iterate";
  return {};
}

}  // namespace
}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax

// --- The C functions
// ------------------------------------------------------------------------------

using namespace ipminmax;  // this file ends here

IpminmaxProblem IpminmaxCreate(int n, const double* x_L, const double* x_U, int m,
                               const double* g_L, const double* g_U, int nele_jac, int nele_hess,
                               int index_style, IpminmaxEval_F_CB eval_f, IpminmaxEval_G_CB eval_g,
                               IpminmaxEval_Grad_F_CB eval_grad_f, IpminmaxEval_Jac_G_CB eval_jac_g,
                               IpminmaxEval_H_CB eval_h, const int* variable_players,
                               const int* constraint_players) {
  try {
    Definition d;
    d.n = n;
    d.m = m;
    d.nele_jac = nele_jac;
    d.nele_hess = nele_hess;
    d.eval_f = eval_f;
    d.eval_g = eval_g;
    d.eval_grad_f = eval_grad_f;
    d.eval_jac_g = eval_jac_g;
    d.eval_h = eval_h;
    std::string error = error_of(d, index_style, variable_players);
    d.index_style =
        index_style == IPMINMAX_C_STYLE ? Ipopt::TNLP::C_STYLE : Ipopt::TNLP::FORTRAN_STYLE;
    d.x_lower = read_array(x_L, n, "x_L", error);
    d.x_upper = read_array(x_U, n, "x_U", error);
    d.g_lower = read_array(g_L, m, "g_L", error);
    d.g_upper = read_array(g_U, m, "g_U", error);
    d.variable_players = read_players(variable_players, n, "variable_players", error);
    d.constraint_players = read_players(constraint_players, m, "constraint_players", error);
    if (error.empty()) return new IpminmaxProblemInfo(std::move(d));
    say_without_problem(error.c_str());
  } catch (const std::bad_alloc&) {
    say_without_problem("out of memory");
  } catch (...) {
    say_without_problem("internal error: unexpected exception");
  }
  return nullptr;
}

void IpminmaxFree(IpminmaxProblem problem) { delete problem; }

int IpminmaxAddStrOption(IpminmaxProblem problem, const char* keyword, const char* val) {
  if (problem != nullptr && val == nullptr) {
    say_fixed(problem, "the option's value is NULL");
    return 0;
  }
  return add_option(problem, keyword, Ipopt::OT_String, [=] { return std::string(val); });
}

int IpminmaxAddNumOption(IpminmaxProblem problem, const char* keyword, double val) {
  return add_option(problem, keyword, Ipopt::OT_Number, [=] { return text_of(val); });
}

int IpminmaxAddIntOption(IpminmaxProblem problem, const char* keyword, int val) {
  return add_option(problem, keyword, Ipopt::OT_Integer, [=] { return text_of(val); });
}

int IpminmaxOpenOutputFile(IpminmaxProblem problem, const char* file_name, int print_level) {
  return guarded(problem, [&]() -> std::string {
    if (file_name == nullptr) return "the file's name is NULL";
    if (print_level < 0 || print_level >= Ipopt::J_LAST_LEVEL) {
      return "print_level = " + std::to_string(print_level) + " is not in [0, " +
             std::to_string(Ipopt::J_LAST_LEVEL - 1) + "]";
    }
    const auto level = static_cast<Ipopt::EJournalLevel>(print_level);
    if (problem->application->OpenOutputFile(file_name, level)) return {};
    return "cannot open output file \"" + std::string(file_name) + "\"";
  });
}

int IpminmaxSetScaling(IpminmaxProblem problem, double obj_scaling, const double* x_scaling,
                       const double* g_scaling) {
  return guarded(problem, [&]() -> std::string {
    CallbackTNLP& model = *problem->model;
    std::string error;
    if (!is_sane_scaling(std::abs(obj_scaling))) {
      return "obj_scaling = " + text_of(obj_scaling) + " is not of a size in [" +
             text_of(kLeastScaling) + ", " + text_of(kLargestScaling) + "]";
    }
    auto x = read_scaling(x_scaling, model.definition().n, "x_scaling", error);
    auto g = read_scaling(g_scaling, model.definition().m, "g_scaling", error);
    if (!error.empty()) return error;
    model.objective_scaling = obj_scaling;
    model.x_scaling = std::move(x);
    model.g_scaling = std::move(g);
    return {};
  });
}

int IpminmaxSetBounds(IpminmaxProblem problem, const double* x_L, const double* x_U,
                      const double* g_L, const double* g_U) {
  return guarded(problem, [&]() -> std::string {
    if (problem->solving) return "the problem is being solved: its bounds cannot change";
    Definition& d = problem->model->definition();
    std::string error;
    const auto read = [&](const double* values, const std::vector<double>& present,
                          const char* name) {
      return values == nullptr
                 ? present
                 : read_array(values, static_cast<Index>(present.size()), name, error);
    };
    auto x_lower = read(x_L, d.x_lower, "x_L"), x_upper = read(x_U, d.x_upper, "x_U");
    auto g_lower = read(g_L, d.g_lower, "g_L"), g_upper = read(g_U, d.g_upper, "g_U");
    if (!error.empty()) return error;
    d.x_lower = std::move(x_lower);
    d.x_upper = std::move(x_upper);
    d.g_lower = std::move(g_lower);
    d.g_upper = std::move(g_upper);
    return {};
  });
}

int IpminmaxSetIntermediateCallback(IpminmaxProblem problem,
                                    IpminmaxIntermediate_CB intermediate_cb) {
  return guarded(problem, [&]() -> std::string {
    problem->model->intermediate = intermediate_cb;
    return {};
  });
}

IpminmaxReturnStatus IpminmaxSolve(IpminmaxProblem problem, double* x, double* g, double* obj_val,
                                   double* mult_g, double* mult_x_L, double* mult_x_U,
                                   void* user_data) {
  return solve_guarded(problem, {x, g, obj_val, mult_g, mult_x_L, mult_x_U}, user_data,
                       Call::Solve);
}

IpminmaxReturnStatus IpminmaxSolveAgain(IpminmaxProblem problem, double* x, double* g,
                                        double* obj_val, double* mult_g, double* mult_x_L,
                                        double* mult_x_U, void* user_data) {
  return solve_guarded(problem, {x, g, obj_val, mult_g, mult_x_L, mult_x_U}, user_data,
                       Call::Again);
}

IpminmaxReturnStatus IpminmaxSolveOverRanks(IpminmaxProblem problem, double* x, double* g,
                                            double* obj_val, double* mult_g, double* mult_x_L,
                                            double* mult_x_U, void* user_data) {
  return solve_guarded(problem, {x, g, obj_val, mult_g, mult_x_L, mult_x_U}, user_data,
                       Call::OverRanks);
}

// A name in parentheses is the function, not the macro.

int(IpminmaxGetCertificate)(IpminmaxProblem problem, IpminmaxCertificate* certificate) {
  return IpminmaxGetCertificateSized(problem, certificate, kFirstCertificate);
}

int IpminmaxGetCertificateSized(IpminmaxProblem problem, IpminmaxCertificate* certificate,
                                size_t size) {
  return guarded(problem, [&]() -> std::string {
    if (auto error = error_of_answer(*problem, certificate); !error.empty()) return error;
    const Certificate& from = problem->application->LastResult().certificate;
    IpminmaxCertificate to{};
    to.point_kind = static_cast<IpminmaxPointKind>(from.kind);
    to.second_order = static_cast<IpminmaxSecondOrder>(from.second_order);
    to.inner = to_c(from.inner);
    to.inner_expected = to_c(from.inner_expected);
    to.full = to_c(from.full);
    to.full_expected = to_c(from.full_expected);
    to.margin = from.margin;
    to.licq_min = from.licq_min ? 1 : 0;
    to.licq_max = from.licq_max ? 1 : 0;
    to.weakly_active_min = from.weakly_active_min;
    to.weakly_active_max = from.weakly_active_max;
    to.finite_differences = from.finite_differences ? 1 : 0;
    to.hessian_error = from.hessian_error;
    to.hessian_disagrees = from.hessian_disagrees ? 1 : 0;
    to.least_curvature = from.least_curvature;
    to.least_curvature_variable = from.least_curvature_variable;
    to.answer = static_cast<IpminmaxAnswer>(from.answer);
    problem->reasons.clear();
    for (const CertificateReason& reason : from.reasons) {
      if (!problem->reasons.empty()) problem->reasons += '\n';
      problem->reasons += reason.text;
    }
    to.reasons = problem->reasons.c_str();
    write_sized(to, certificate, size);
    return {};
  });
}

int(IpminmaxGetStatistics)(IpminmaxProblem problem, IpminmaxStatistics* statistics) {
  return IpminmaxGetStatisticsSized(problem, statistics, kFirstStatistics);
}

int IpminmaxGetStatisticsSized(IpminmaxProblem problem, IpminmaxStatistics* statistics,
                               size_t size) {
  return guarded(problem, [&]() -> std::string {
    Result current;
    const bool now = statistics != nullptr && problem->application->GetCurrentIterate(current);
    if (!now) {
      if (auto error = error_of_answer(*problem, statistics); !error.empty()) return error;
    }
    IpminmaxStatistics to{};
    const Result& from = now ? current : problem->application->LastResult();
    to.iterations = from.iterations;
    to.factorizations = from.factorizations;
    to.analyses = from.counts.analyses;
    to.objective_evaluations = from.counts.objective;
    to.gradient_evaluations = from.counts.gradient;
    to.constraint_evaluations = from.counts.constraints;
    to.jacobian_evaluations = from.counts.jacobian;
    to.hessian_evaluations = from.counts.hessian;
    to.seconds = from.seconds;
    to.cpu_seconds = from.cpu_seconds;
    to.primal_error = from.error.primal;
    to.dual_error_min = from.error.dual_min;
    to.dual_error_max = from.error.dual_max;
    to.complementarity_error = from.error.complementarity;
    to.error = from.error.total;
    to.objective_scale = from.objective_scale;
    write_sized(to, statistics, size);
    return {};
  });
}

int IpminmaxGetCurrentIterate(IpminmaxProblem problem, int n, double* x, double* z_L, double* z_U,
                              int m, double* g, double* lambda) {
  return guarded(problem, [&]() -> std::string {
    if (auto error = error_of_sizes(*problem, n, m); !error.empty()) return error;
    Result current;
    if (!problem->application->GetCurrentIterate(current)) return kNoCallback;
    fill({x, z_L, z_U, g, lambda}, current);
    return {};
  });
}

int IpminmaxGetCurrentViolations(IpminmaxProblem problem, int n, double* x_L_violation,
                                 double* x_U_violation, double* compl_x_L, double* compl_x_U,
                                 double* grad_lag_x, int m, double* nlp_constraint_violation,
                                 double* compl_g) {
  return guarded(problem, [&]() -> std::string {
    if (auto error = error_of_sizes(*problem, n, m); !error.empty()) return error;
    Result inside;
    if (!problem->application->GetCurrentIterate(inside)) return kNoCallback;
    Violations found;
    if (!problem->application->GetCurrentViolations(found)) {
      return "the first derivatives are undefined at the iterate";
    }
    fill({x_L_violation, x_U_violation, compl_x_L, compl_x_U, grad_lag_x, nlp_constraint_violation,
          compl_g},
         found);
    return {};
  });
}

int(IpminmaxCheckWorstCase)(IpminmaxProblem problem, const double* x, int starts,
                            IpminmaxWorstCase* worst_case, double* worst_x, void* user_data) {
  return IpminmaxCheckWorstCaseSized(problem, x, starts, worst_case, kFirstWorstCase, worst_x,
                                     user_data);
}

int IpminmaxCheckWorstCaseSized(IpminmaxProblem problem, const double* x, int starts,
                                IpminmaxWorstCase* worst_case, size_t size, double* worst_x,
                                void* user_data) {
  return guarded(problem, [&] {
    return check_worst_case_of(*problem, x, starts, {worst_case, size}, worst_x, user_data);
  });
}

int(IpminmaxGetWorstCase)(IpminmaxProblem problem, IpminmaxWorstCase* worst_case, double* worst_x) {
  return IpminmaxGetWorstCaseSized(problem, worst_case, kFirstWorstCase, worst_x);
}

int IpminmaxGetWorstCaseSized(IpminmaxProblem problem, IpminmaxWorstCase* worst_case, size_t size,
                              double* worst_x) {
  return guarded(problem, [&]() -> std::string {
    if (auto error = error_of_answer(*problem, worst_case); !error.empty()) return error;
    write(*problem, problem->application->LastResult().worst_case, {worst_case, size}, worst_x);
    return {};
  });
}

int IpminmaxGetWorstCaseBranches(IpminmaxProblem problem, int capacity, double* values) {
  if (problem == nullptr) return 0;
  const std::vector<double>& branches = problem->branches;
  const int most = std::min(capacity, static_cast<int>(branches.size()));
  for (int k = 0; values != nullptr && k < most; ++k) values[k] = branches[size_of(k)];
  return static_cast<int>(branches.size());
}

int IpminmaxGetRobustWorstCases(IpminmaxProblem problem, int capacity, int* constraints,
                                double* values, double* multipliers, int* active, double* worst_x) {
  if (problem == nullptr || problem->solving || !problem->answered) return 0;
  const std::vector<RobustWorstCase>& found = problem->application->LastWorstCases();
  const int most = std::min(capacity, static_cast<int>(found.size()));
  for (int k = 0; k < most; ++k) {
    const RobustWorstCase& from = found[size_of(k)];
    const auto put = [k](auto* to, auto value) {
      if (to != nullptr) to[k] = value;
    };
    put(constraints, static_cast<int>(from.constraint));
    put(values, from.value);
    put(multipliers, from.multiplier);
    put(active, from.active ? 1 : 0);
    if (worst_x != nullptr) std::ranges::copy(from.v, worst_x + size_of(k) * from.v.size());
  }
  return static_cast<int>(found.size());
}

int IpminmaxUpdateSensitivity(IpminmaxProblem problem) {
  return guarded(problem, [&]() -> std::string {
    if (problem->solving) return "the problem is being solved";
    problem->changes.clear();
    problem->sensitivity_fits = false;
    if (!problem->answered) return "no solve has reached a first iterate";
    std::string error = problem->application->UpdateSensitivity(problem->sensitivity);
    problem->sensitivity_fits = error.empty();
    return error;
  });
}

int IpminmaxGetDerivative(IpminmaxProblem problem, const double* dx_L, const double* dx_U,
                          const double* dg_L, const double* dg_U, double* dx, double* dmult_g,
                          double* dmult_x_L, double* dmult_x_U, double* dobj, double* d2obj) {
  return guarded(problem, [&] {
    std::string error;
    const BoundChange change =
        read_change(problem->model->definition(), dx_L, dx_U, dg_L, dg_U, error);
    return with_sensitivity(*problem, error, [&](Sensitivity& sensitivity) {
      write(sensitivity.derivative(change), {dx, dmult_g, dmult_x_L, dmult_x_U, dobj, d2obj});
    });
  });
}

int IpminmaxGetReaction(IpminmaxProblem problem, const double* dx_min, double* dx, double* dmult_g,
                        double* dmult_x_L, double* dmult_x_U, double* dobj, double* d2obj) {
  return guarded(problem, [&] {
    std::string error;
    const std::vector<double> move =
        read_array(dx_min, problem->model->definition().n, "dx_min", error);
    return with_sensitivity(*problem, error, [&](Sensitivity& sensitivity) {
      write(sensitivity.reaction(move), {dx, dmult_g, dmult_x_L, dmult_x_U, dobj, d2obj});
    });
  });
}

int IpminmaxPredict(IpminmaxProblem problem, const double* dx_L, const double* dx_U,
                    const double* dg_L, const double* dg_U, double* x, double* mult_g,
                    double* mult_x_L, double* mult_x_U, double* obj, double* share) {
  return guarded(problem, [&] {
    std::string error;
    const BoundChange change =
        read_change(problem->model->definition(), dx_L, dx_U, dg_L, dg_U, error);
    return with_sensitivity(*problem, error, [&](Sensitivity& sensitivity) {
      write(sensitivity.predict(change), *problem, {x, mult_g, mult_x_L, mult_x_U, obj, share});
    });
  });
}

int IpminmaxPredictReaction(IpminmaxProblem problem, const double* dx_min, double* x,
                            double* mult_g, double* mult_x_L, double* mult_x_U, double* obj,
                            double* share) {
  return guarded(problem, [&] {
    std::string error;
    const std::vector<double> move =
        read_array(dx_min, problem->model->definition().n, "dx_min", error);
    return with_sensitivity(*problem, error, [&](Sensitivity& sensitivity) {
      write(sensitivity.react(move), *problem, {x, mult_g, mult_x_L, mult_x_U, obj, share});
    });
  });
}

int(IpminmaxGetActiveSetChanges)(IpminmaxProblem problem, int capacity,
                                 IpminmaxActiveSetChange* changes) {
  return IpminmaxGetActiveSetChangesSized(problem, capacity, changes, kFirstActiveSetChange);
}

int IpminmaxGetActiveSetChangesSized(IpminmaxProblem problem, int capacity,
                                     IpminmaxActiveSetChange* changes, size_t size) {
  if (problem == nullptr) return 0;
  const int count = static_cast<int>(problem->changes.size());
  for (int k = 0; k < std::min(count, capacity) && changes != nullptr; ++k) {
    const ActiveSetChange& from = problem->changes[static_cast<std::size_t>(k)];
    const IpminmaxActiveSetChange to{from.share, from.of_constraint ? 1 : 0, from.index,
                                     from.upper ? 1 : 0, from.enters ? 1 : 0};
    write_sized(to, reinterpret_cast<char*>(changes) + static_cast<std::size_t>(k) * size, size);
  }
  return count;
}

const char* IpminmaxStatusName(IpminmaxProblem problem) {
  return problem != nullptr ? problem->status.c_str() : "";
}

const char* IpminmaxMessage(IpminmaxProblem problem) {
  if (problem == nullptr) return creation_message.data();
  return problem->fixed_message != nullptr ? problem->fixed_message : problem->message.c_str();
}

const char* IpminmaxVersion() { return IPMINMAX_VERSION; }
