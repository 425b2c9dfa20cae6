#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "adapter/c/c_problem.hpp"
#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/ipopt_library.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/point_arrays.hpp"
#include "adapter/ipopt/status.hpp"
#include "core/version.h"

// The C interface: problems, options, solves.

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Problem = ::IpminmaxProblemInfo;
using Ipopt::SmartPtr;

// The header repeats these values, so that it does not need Ipopt's or the core's.
template <class Ours, class Theirs>
constexpr bool same(Ours ours, Theirs theirs) {
  return static_cast<int>(ours) == static_cast<int>(theirs);
}
static_assert([] {
  using enum Ipopt::ApplicationReturnStatus;
  const std::pair<int, int> statuses[] = {
      {IPMINMAX_SOLVE_SUCCEEDED, Solve_Succeeded},
      {IPMINMAX_SOLVED_TO_ACCEPTABLE_LEVEL, Solved_To_Acceptable_Level},
      {IPMINMAX_INFEASIBLE_PROBLEM_DETECTED, Infeasible_Problem_Detected},
      {IPMINMAX_SEARCH_DIRECTION_BECOMES_TOO_SMALL, Search_Direction_Becomes_Too_Small},
      {IPMINMAX_DIVERGING_ITERATES, Diverging_Iterates},
      {IPMINMAX_USER_REQUESTED_STOP, User_Requested_Stop},
      {IPMINMAX_FEASIBLE_POINT_FOUND, Feasible_Point_Found},
      {IPMINMAX_MAXIMUM_ITERATIONS_EXCEEDED, Maximum_Iterations_Exceeded},
      {IPMINMAX_RESTORATION_FAILED, Restoration_Failed},
      {IPMINMAX_ERROR_IN_STEP_COMPUTATION, Error_In_Step_Computation},
      {IPMINMAX_MAXIMUM_CPUTIME_EXCEEDED, Maximum_CpuTime_Exceeded},
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
      {IPMINMAX_MAXIMUM_WALLTIME_EXCEEDED, Maximum_WallTime_Exceeded},
#endif
      {IPMINMAX_NOT_ENOUGH_DEGREES_OF_FREEDOM, Not_Enough_Degrees_Of_Freedom},
      {IPMINMAX_INVALID_PROBLEM_DEFINITION, Invalid_Problem_Definition},
      {IPMINMAX_INVALID_OPTION, Invalid_Option},
      {IPMINMAX_INVALID_NUMBER_DETECTED, Invalid_Number_Detected},
      {IPMINMAX_UNRECOVERABLE_EXCEPTION, Unrecoverable_Exception},
      {IPMINMAX_NONIPOPT_EXCEPTION_THROWN, NonIpopt_Exception_Thrown},
      {IPMINMAX_INSUFFICIENT_MEMORY, Insufficient_Memory},
      {IPMINMAX_INTERNAL_ERROR, Internal_Error},
  };
  return std::ranges::all_of(statuses, [](auto pair) { return pair.first == pair.second; });
}());
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
              same(IPMINMAX_ANSWER_SMOOTH, InnerAnswer::Smooth) &&
              same(IPMINMAX_ANSWER_BEST_NOT_UNIQUE, InnerAnswer::BestNotUnique));
static_assert(same(IPMINMAX_NOT_TESTED, SecondOrder::NotTested) &&
              same(IPMINMAX_SATISFIED, SecondOrder::Satisfied) &&
              same(IPMINMAX_UNDECIDED, SecondOrder::Undecided) &&
              same(IPMINMAX_VIOLATED, SecondOrder::Violated) &&
              same(IPMINMAX_FLAT, SecondOrder::Flat));

std::vector<Player> read_players(const int* players, Index count, const char* name) {
  std::vector<Player> result;
  for (Index i = 0; players != nullptr && i < count; ++i) {
    if (players[i] != IPMINMAX_MIN && players[i] != IPMINMAX_MAX)
      refuse(name, "[", i, "] = ", players[i], "; it must be 0 (IPMINMAX_MIN) or 1 (IPMINMAX_MAX)");
    result.push_back(static_cast<Player>(players[i]));
  }
  return result;
}

/// Refuses wrong sizes and missing callbacks.
void check(const CallbackDefinition& d, int index_style, const int* variable_players) {
  if (d.n < 0) refuse("n = ", d.n, " is negative");
  if (d.m < 0) refuse("m = ", d.m, " is negative");
  if (d.nele_jac < 0) refuse("nele_jac = ", d.nele_jac, " is negative");
  if (d.nele_hess < 0) refuse("nele_hess = ", d.nele_hess, " is negative");
  if (d.m == 0 && d.nele_jac > 0) refuse("nele_jac = ", d.nele_jac, " without constraints");
  if (index_style != IPMINMAX_C_STYLE && index_style != IPMINMAX_FORTRAN_STYLE)
    refuse("index_style = ", index_style, "; it must be 0 (C) or 1 (Fortran)");
  if (d.eval_f == nullptr) refuse("eval_f is NULL");
  if (d.eval_grad_f == nullptr) refuse("eval_grad_f is NULL");
  if (d.m > 0 && d.eval_g == nullptr) refuse("eval_g is NULL");
  if (d.m > 0 && d.eval_jac_g == nullptr) refuse("eval_jac_g is NULL");
  if (d.n > 0 && variable_players == nullptr) refuse("variable_players is NULL");
}

/// Scaling factors that is_sane_scaling accepts.
std::string scalings() {
  return concat("[", text_of(kLeastScaling), ", ", text_of(kLargestScaling), "]");
}

/// Copies scaling factors; NULL is none.
std::vector<double> read_scaling(const double* values, Index count, const char* name) {
  std::vector<double> result = read_array(values, count, name, true);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!is_sane_scaling(result[i]))
      refuse(name, "[", i, "] = ", text_of(result[i]), " is not in ", scalings());
  }
  return result;
}

const char* name_of(Ipopt::RegisteredOptionType type) {
  if (type == Ipopt::OT_Number) return "a number";
  if (type == Ipopt::OT_Integer) return "an integer";
  return "a string";
}

int add_option(Problem* problem, const char* keyword, Ipopt::RegisteredOptionType type,
               auto make_text) noexcept {
  return guarded(problem, [&] {
    if (keyword == nullptr) refuse("the option's name is NULL");
    OptionRegistry registry;
    const SmartPtr<const Ipopt::RegisteredOption> option = registry.GetOption(keyword);
    if (IsNull(option)) refuse(unknown_option(keyword, registry));
    if (option->Type() != type)
      refuse(keyword, " is ", name_of(option->Type()), " option, not ", name_of(type), " option");
    require_none(
        set_option(keyword, make_text(), registry, *problem->application->Options(), true));
  });
}

bool is_warm(const Problem& problem) {
  bool warm = false;
  read_option(*problem.application->Options(), "warm_start_init_point", warm);
  return warm;
}

/// warm_start_init_point is yes while this lives. Where memory is too short for setting it back,
/// the next solve does.
class WarmStart : Uncopied {
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

/// Where IpminmaxSolve writes; all but x may be null.
struct Output : PointArrays {
  double* objective;
};

IpminmaxReturnStatus stop(Problem& problem, Status status, std::string message) {
  problem.status = ipminmax::name_of(status);
  say(&problem, std::move(message));
  return static_cast<IpminmaxReturnStatus>(application_status(status));
}

/// How the application solves.
using Call = Ipopt::ApplicationReturnStatus (MinMaxApplication::*)(const SmartPtr<Ipopt::TNLP>&);

/// Solves from the model's start, options read.
IpminmaxReturnStatus run(Problem& problem, const Output& out, Call call) {
  MinMaxApplication& application = *problem.application;
  const auto status = (application.*call)(GetRawPtr(problem.model));
  const Result& result = application.LastResult();
  problem.status = ipminmax::name_of(result.status);
  say(&problem, result.message);
  problem.answered = IsValid(application.Statistics());
  if (problem.model->finalized) {
    const Result& answer = problem.model->answer;
    fill(out, answer);
    if (out.objective != nullptr) *out.objective = answer.objective;
  }
  return static_cast<IpminmaxReturnStatus>(status);
}

IpminmaxReturnStatus start(Problem& problem, const Output& out, void* user_data, Call call) {
  const bool again = call == &MinMaxApplication::ReOptimizeTNLP;
  CallbackTNLP& model = *problem.model;
  const CallbackDefinition& d = model.definition;
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
  if (again) model.start = model.answer;
  model.start.v.assign(out.x, out.x + d.n);
  if (again) {
    const WarmStart warm(problem);
    if (!is_warm(problem)) {
      return stop(problem, Status::InvalidOption,
                  "the options file sets warm_start_init_point = no: cannot solve again from the "
                  "last multipliers");
    }
    return run(problem, out, call);
  }
  if (is_warm(problem)) {
    const char* missing = d.m > 0 && out.lambda == nullptr ? "mult_g"
                          : d.n > 0 && out.z_L == nullptr  ? "mult_x_L"
                          : d.n > 0 && out.z_U == nullptr  ? "mult_x_U"
                                                           : nullptr;
    if (missing != nullptr) {
      return stop(problem, Status::InvalidProblem,
                  concat("warm_start_init_point = yes, but ", missing, " is NULL"));
    }
    model.start.lambda.assign(out.lambda, out.lambda + d.m);
    model.start.z_lower.assign(out.z_L, out.z_L + d.n);
    model.start.z_upper.assign(out.z_U, out.z_U + d.n);
  }
  return run(problem, out, call);
}

IpminmaxReturnStatus solve_guarded(Problem* problem, const Output& out, void* user_data,
                                   Call call) noexcept {
  if (problem == nullptr || problem->solving) {
    say_fixed(problem, problem == nullptr
                           ? "the problem is NULL"
                           : "the problem is being solved: no solve inside its own callbacks");
    return IPMINMAX_INVALID_PROBLEM_DEFINITION;
  }
  const Solving solving(*problem);
  return attempt(problem, [&] { return start(*problem, out, user_data, call); });
}

}  // namespace
}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax

using namespace ipminmax;  // this file ends here

IpminmaxProblem IpminmaxCreate(int n, const double* x_L, const double* x_U, int m,
                               const double* g_L, const double* g_U, int nele_jac, int nele_hess,
                               int index_style, IpminmaxEval_F_CB eval_f, IpminmaxEval_G_CB eval_g,
                               IpminmaxEval_Grad_F_CB eval_grad_f, IpminmaxEval_Jac_G_CB eval_jac_g,
                               IpminmaxEval_H_CB eval_h, const int* variable_players,
                               const int* constraint_players) {
  IpminmaxProblem problem = nullptr;
  attempt(nullptr, [&] {
    CallbackDefinition d{n,           m,      nele_jac,   nele_hess, eval_f,
                         eval_grad_f, eval_g, eval_jac_g, eval_h};
    require_none(ipopt_library_error());
    check(d, index_style, variable_players);
    d.index_style =
        index_style == IPMINMAX_C_STYLE ? Ipopt::TNLP::C_STYLE : Ipopt::TNLP::FORTRAN_STYLE;
    d.x_lower = read_array(x_L, n, "x_L");
    d.x_upper = read_array(x_U, n, "x_U");
    d.g_lower = read_array(g_L, m, "g_L");
    d.g_upper = read_array(g_U, m, "g_U");
    d.variable_players = read_players(variable_players, n, "variable_players");
    d.constraint_players = read_players(constraint_players, m, "constraint_players");
    problem = new IpminmaxProblemInfo(std::move(d));
    return IPMINMAX_SOLVE_SUCCEEDED;
  });
  return problem;
}

void IpminmaxFree(IpminmaxProblem problem) {
  if (problem != nullptr && problem->solving) {
    return say_fixed(problem, "the problem is being solved: it is not freed");
  }
  delete problem;
}

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
  return add_option(problem, keyword, Ipopt::OT_Integer, [=] { return std::to_string(val); });
}

int IpminmaxOpenOutputFile(IpminmaxProblem problem, const char* file_name, int print_level) {
  return guarded(problem, [&] {
    if (file_name == nullptr) refuse("the file's name is NULL");
    if (print_level < 0 || print_level >= Ipopt::J_LAST_LEVEL)
      refuse("print_level = ", print_level, " is not in [0, ", Ipopt::J_LAST_LEVEL - 1, "]");
    const auto level = static_cast<Ipopt::EJournalLevel>(print_level);
    if (!problem->application->OpenOutputFile(file_name, level))
      refuse("cannot open output file \"", file_name, "\"");
  });
}

int IpminmaxSetScaling(IpminmaxProblem problem, double obj_scaling, const double* x_scaling,
                       const double* g_scaling) {
  return guarded(problem, [&] {
    CallbackTNLP& model = *problem->model;
    if (!is_sane_scaling(std::abs(obj_scaling)))
      refuse("obj_scaling = ", text_of(obj_scaling), " is not of a size in ", scalings());
    auto x = read_scaling(x_scaling, model.definition.n, "x_scaling");
    auto g = read_scaling(g_scaling, model.definition.m, "g_scaling");
    model.objective_scaling = obj_scaling;
    model.x_scaling = std::move(x);
    model.g_scaling = std::move(g);
  });
}

int IpminmaxSetBounds(IpminmaxProblem problem, const double* x_L, const double* x_U,
                      const double* g_L, const double* g_U) {
  return guarded(problem, [&] {
    if (problem->solving) refuse("the problem is being solved: its bounds cannot change");
    CallbackDefinition& d = problem->model->definition;
    const auto read = [&](const double* values, const std::vector<double>& present,
                          const char* name) {
      return values == nullptr ? present
                               : read_array(values, static_cast<Index>(present.size()), name);
    };
    auto x_lower = read(x_L, d.x_lower, "x_L"), x_upper = read(x_U, d.x_upper, "x_U");
    auto g_lower = read(g_L, d.g_lower, "g_L"), g_upper = read(g_U, d.g_upper, "g_U");
    d.x_lower = std::move(x_lower);
    d.x_upper = std::move(x_upper);
    d.g_lower = std::move(g_lower);
    d.g_upper = std::move(g_upper);
  });
}

int IpminmaxSetRowsCallback(IpminmaxProblem problem, IpminmaxEval_Rows_CB eval_rows) {
  return guarded(problem, [&] { problem->model->rows = eval_rows; });
}

int IpminmaxSetIntermediateCallback(IpminmaxProblem problem,
                                    IpminmaxIntermediate_CB intermediate_cb) {
  return guarded(problem, [&] { problem->model->intermediate = intermediate_cb; });
}

IpminmaxReturnStatus IpminmaxSolve(IpminmaxProblem problem, double* x, double* g, double* obj_val,
                                   double* mult_g, double* mult_x_L, double* mult_x_U,
                                   void* user_data) {
  return solve_guarded(problem, {{x, mult_x_L, mult_x_U, g, mult_g}, obj_val}, user_data,
                       &MinMaxApplication::OptimizeTNLP);
}

IpminmaxReturnStatus IpminmaxSolveAgain(IpminmaxProblem problem, double* x, double* g,
                                        double* obj_val, double* mult_g, double* mult_x_L,
                                        double* mult_x_U, void* user_data) {
  return solve_guarded(problem, {{x, mult_x_L, mult_x_U, g, mult_g}, obj_val}, user_data,
                       &MinMaxApplication::ReOptimizeTNLP);
}

IpminmaxReturnStatus IpminmaxSolveOverRanks(IpminmaxProblem problem, double* x, double* g,
                                            double* obj_val, double* mult_g, double* mult_x_L,
                                            double* mult_x_U, void* user_data) {
  return solve_guarded(problem, {{x, mult_x_L, mult_x_U, g, mult_g}, obj_val}, user_data,
                       &MinMaxApplication::OptimizeTNLPOverRanks);
}

const char* IpminmaxStatusName(IpminmaxProblem problem) {
  return problem != nullptr ? problem->status.c_str() : "";
}

const char* IpminmaxMessage(IpminmaxProblem problem) {
  if (problem == nullptr) return message_without_problem();
  return problem->fixed_message != nullptr ? problem->fixed_message : problem->message.c_str();
}

const char* IpminmaxVersion() { return IPMINMAX_VERSION; }
