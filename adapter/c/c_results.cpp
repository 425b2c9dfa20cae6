#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "adapter/c/c_problem.hpp"
#include "adapter/ipopt/point_arrays.hpp"
#include "core/answer.hpp"
#include "core/gap.hpp"
#include "linalg/numbers.hpp"

// The C interface: what a solve has found, the current iterate, the worst case.

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Problem = ::IpminmaxProblemInfo;

IpminmaxInertia to_c(const Inertia& inertia) {
  return {inertia.positive, inertia.negative, inertia.zero};
}

/// The current iterate. Refuses array sizes other than the problem's.
Result current_iterate(const Problem& problem, int n, int m) {
  const CallbackDefinition& d = problem.model->definition;
  if (n != d.n) refuse("n = ", n, ", but there are ", d.n);
  if (m != d.m) refuse("m = ", m, ", but there are ", d.m);
  Result current;
  if (!problem.application->GetCurrentIterate(current))
    refuse("there is a current iterate only inside the intermediate callback");
  return current;
}

/// Sizes of the structures when they were first fixed: those of a caller who does not tell. They
/// stay as they are when a structure grows.
constexpr std::size_t kFirstCertificate =
    offsetof(IpminmaxCertificate, least_curvature_variable) + sizeof(int);
constexpr std::size_t kFirstStatistics =
    offsetof(IpminmaxStatistics, objective_scale) + sizeof(double);
constexpr std::size_t kFirstWorstCase = offsetof(IpminmaxWorstCase, stated_concave) + sizeof(int);

/// Fills the caller's structure and array.
void write(Problem& problem, const WorstCase& from, IpminmaxWorstCase* target, std::size_t size,
           double* worst_x) {
  IpminmaxWorstCase to{};
  to.starts = from.starts;
  to.maxima = from.maxima;
  to.competing = from.competing;
  to.value = from.value;
  to.found = from.v.empty() ? 0 : 1;
  to.higher = from.higher;
  to.unbounded = from.unbounded;
  to.single_branch = from.single_branch;
  to.stated_concave = from.stated_concave;
  write_sized(&to, sizeof to, target, size);
  problem.branches = from.branches;
  copy_to(worst_x, from.v);
}

/// Asks about a point as IpminmaxSolve would: reads the options file; refuses calls from callbacks
/// of the model. ask: takes the application, the model and n values.
template <class Ask>
void ask_at(Problem& problem, const double* x, void* user_data, const Ask& ask) {
  if (problem.solving) refuse("the problem is being solved");
  const std::vector<double> v = read_array(x, problem.model->definition.n, "x");
  if (problem.application->Initialize() != Ipopt::Solve_Succeeded)
    refuse(problem.application->LastResult().message);
  problem.model->user_data = user_data;
  problem.model->needs_hessian = asks_for_hessian(problem);
  problem.model->start.v = v;
  const Solving solving(problem);
  require_none(ask(*problem.application, GetRawPtr(problem.model), v));
}

void require_answer(const Problem& problem, const void* target) {
  if (target == nullptr) refuse("the structure to be filled is NULL");
  if (!problem.answered) refuse("no solve has reached a first iterate");
}

}  // namespace
}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax

using namespace ipminmax;  // this file ends here

// A name in parentheses is the function, not the macro.

int(IpminmaxGetCertificate)(IpminmaxProblem problem, IpminmaxCertificate* certificate) {
  return IpminmaxGetCertificateSized(problem, certificate, kFirstCertificate);
}

int IpminmaxGetCertificateSized(IpminmaxProblem problem, IpminmaxCertificate* certificate,
                                size_t size) {
  return guarded(problem, [&] {
    require_answer(*problem, certificate);
    const Certificate& from = problem->application->LastResult().certificate;
    IpminmaxCertificate to{};
    to.point_kind = static_cast<IpminmaxPointKind>(from.kind);
    to.second_order = static_cast<IpminmaxSecondOrder>(from.second_order);
    to.inner = to_c(from.inner);
    to.inner_expected = to_c(from.inner_expected);
    to.full = to_c(from.full);
    to.full_expected = to_c(from.full_expected);
    to.margin = from.margin;
    to.licq_min = from.licq_min;
    to.licq_max = from.licq_max;
    to.weakly_active_min = from.weakly_active_min;
    to.weakly_active_max = from.weakly_active_max;
    to.finite_differences = from.finite_differences;
    to.hessian_error = from.hessian_error;
    to.hessian_disagrees = from.hessian_disagrees;
    to.least_curvature = from.least_curvature;
    to.least_curvature_variable = from.least_curvature_variable;
    to.answer = static_cast<IpminmaxAnswer>(from.answer);
    problem->reasons.clear();
    for (const CertificateReason& reason : from.reasons) {
      if (!problem->reasons.empty()) problem->reasons += '\n';
      problem->reasons += reason.text;
    }
    to.reasons = problem->reasons.c_str();
    write_sized(&to, sizeof to, certificate, size);
  });
}

int(IpminmaxGetStatistics)(IpminmaxProblem problem, IpminmaxStatistics* statistics) {
  return IpminmaxGetStatisticsSized(problem, statistics, kFirstStatistics);
}

int IpminmaxGetStatisticsSized(IpminmaxProblem problem, IpminmaxStatistics* statistics,
                               size_t size) {
  return guarded(problem, [&] {
    Result current;
    const bool now = statistics != nullptr && problem->application->GetCurrentIterate(current);
    if (!now) require_answer(*problem, statistics);
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
    write_sized(&to, sizeof to, statistics, size);
  });
}

int IpminmaxGetCurrentIterate(IpminmaxProblem problem, int n, double* x, double* z_L, double* z_U,
                              int m, double* g, double* lambda) {
  return guarded(problem, [&] { fill({x, z_L, z_U, g, lambda}, current_iterate(*problem, n, m)); });
}

int IpminmaxGetCurrentViolations(IpminmaxProblem problem, int n, double* x_L_violation,
                                 double* x_U_violation, double* compl_x_L, double* compl_x_U,
                                 double* grad_lag_x, int m, double* nlp_constraint_violation,
                                 double* compl_g) {
  return guarded(problem, [&] {
    static_cast<void>(current_iterate(*problem, n, m));  // there has to be one
    Violations found;
    if (!problem->application->GetCurrentViolations(found))
      refuse("the first derivatives are undefined at the iterate");
    fill({x_L_violation, x_U_violation, compl_x_L, compl_x_U, grad_lag_x, nlp_constraint_violation,
          compl_g},
         found);
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
    if (worst_case == nullptr) refuse("the structure to be filled is NULL");
    ask_at(*problem, x, user_data, [&](auto& application, auto* model, auto& v) {
      WorstCaseCheck check;
      const std::string error = application.CheckWorstCase(model, v, starts, check);
      if (error.empty()) write(*problem, check.found, worst_case, size, worst_x);
      return error;
    });
  });
}

int IpminmaxFindGap(IpminmaxProblem problem, const double* x, double* most, double* least,
                    int* saddle_point, void* user_data) {
  return guarded(problem, [&] {
    ask_at(*problem, x, user_data, [&](auto& application, auto* model, auto& v) {
      DualityGap gap;
      std::string error = application.FindGap(model, v, gap);
      if (most != nullptr) *most = gap.most;
      if (least != nullptr) *least = gap.least;
      if (saddle_point != nullptr) *saddle_point = gap.saddle_point;
      return error.empty() && std::isnan(gap.size()) ? gap.message : error;
    });
  });
}

int(IpminmaxGetWorstCase)(IpminmaxProblem problem, IpminmaxWorstCase* worst_case, double* worst_x) {
  return IpminmaxGetWorstCaseSized(problem, worst_case, kFirstWorstCase, worst_x);
}

int IpminmaxGetWorstCaseSized(IpminmaxProblem problem, IpminmaxWorstCase* worst_case, size_t size,
                              double* worst_x) {
  return guarded(problem, [&] {
    require_answer(*problem, worst_case);
    write(*problem, problem->application->LastResult().worst_case, worst_case, size, worst_x);
  });
}

int IpminmaxGetWorstCaseBranches(IpminmaxProblem problem, int capacity, double* values) {
  if (problem == nullptr) return 0;
  const std::vector<double>& branches = problem->branches;
  const int most = std::min(capacity, static_cast<int>(branches.size()));
  if (values != nullptr) std::copy_n(branches.begin(), most, values);
  return static_cast<int>(branches.size());
}

int IpminmaxGetRobustWorstCases(IpminmaxProblem problem, int capacity, int* constraints,
                                double* values, double* multipliers, int* active, double* worst_x) {
  if (problem == nullptr || problem->solving || !problem->answered) return 0;
  const std::vector<RobustWorstCase>& found = problem->application->LastWorstCases();
  const int most = std::min(capacity, static_cast<int>(found.size()));
  for (int k = 0; k < most; ++k) {
    const RobustWorstCase& from = found[at(k)];
    const auto put = [k](auto* to, auto value) {
      if (to != nullptr) to[k] = value;
    };
    put(constraints, from.constraint);
    put(values, from.value);
    put(multipliers, from.multiplier);
    put(active, from.active);
    if (worst_x != nullptr) std::ranges::copy(from.v, worst_x + at(k) * from.v.size());
  }
  return static_cast<int>(found.size());
}

int IpminmaxGetPoints(IpminmaxProblem problem, int capacity, double* values, int* found,
                      double* x) {
  if (problem == nullptr || problem->solving || !problem->answered) return 0;
  const std::vector<DistinctPoint>& points = problem->application->LastPoints();
  const int most = std::min(capacity, static_cast<int>(points.size()));
  for (int k = 0; k < most; ++k) {
    const DistinctPoint& from = points[at(k)];
    if (values != nullptr) values[k] = from.result.objective;
    if (found != nullptr) found[k] = from.found;
    if (x != nullptr) std::ranges::copy(from.result.v, x + at(k) * from.result.v.size());
  }
  return static_cast<int>(points.size());
}

const char* IpminmaxStatement(IpminmaxProblem problem, int which) {
  if (problem == nullptr || problem->solving || !problem->answered || which < 0 || which > 3) {
    return "";
  }
  const auto read = [&] {
    problem->statement = statements(problem->application->LastResult())[at(which)];
  };
  return guarded(problem, read) != 0 ? problem->statement.c_str() : "";
}
