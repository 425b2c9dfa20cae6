#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "adapter/c/c_problem.hpp"
#include "adapter/ipopt/point_arrays.hpp"
#include "linalg/numbers.hpp"

// The C interface: how a solution follows bounds and Min's variables.

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Problem = ::IpminmaxProblemInfo;

/// Size of the structure when it was first fixed: that of a caller who does not tell. It stays as
/// it is when the structure grows.
constexpr std::size_t kFirstActiveSetChange =
    offsetof(IpminmaxActiveSetChange, enters) + sizeof(int);

/// Runs action with the sensitivity.
template <class Action>
void with_sensitivity(Problem& problem, Action action) {
  if (!problem.sensitivity_fits)
    refuse("no sensitivity: IpminmaxUpdateSensitivity has not succeeded since the last solve");
  try {
    action(problem.sensitivity);
  } catch (const std::invalid_argument& wrong) {
    refuse(wrong.what());
  } catch (const std::runtime_error& singular) {
    refuse(singular.what());
  }
}

/// Changes of the bounds; NULL is none.
struct BoundArrays {
  const double *x_L, *x_U, *g_L, *g_U;
};

template <class Action>
int along_bounds(Problem* problem, const BoundArrays& by, Action action) {
  return guarded(problem, [&] {
    const CallbackDefinition& d = problem->model->definition;
    const BoundChange change{.variable_lower = read_array(by.x_L, d.n, "dx_L", true),
                             .variable_upper = read_array(by.x_U, d.n, "dx_U", true),
                             .constraint_lower = read_array(by.g_L, d.m, "dg_L", true),
                             .constraint_upper = read_array(by.g_U, d.m, "dg_U", true)};
    with_sensitivity(*problem, [&](Sensitivity& of) { action(of, change); });
  });
}

template <class Action>
int after_move(Problem* problem, const double* dx_min, Action action) {
  return guarded(problem, [&] {
    const std::vector<double> move = read_array(dx_min, problem->model->definition.n, "dx_min");
    with_sensitivity(*problem, [&](Sensitivity& of) { action(of, move); });
  });
}

/// Output arrays of a derivative or prediction; all may be null.
struct SensitivityOutput {
  double *x, *mult_g, *mult_x_L, *mult_x_U, *obj, *last;
};

template <class Found>
void copy_out(const Found& found, double last, const SensitivityOutput& out) {
  copy_to(out.x, found.v);
  copy_to(out.mult_g, found.lambda);
  copy_to(out.mult_x_L, found.z_lower);
  copy_to(out.mult_x_U, found.z_upper);
  if (out.obj != nullptr) *out.obj = found.objective;
  if (out.last != nullptr) *out.last = last;
}

void write(const SolutionDerivative& found, const SensitivityOutput& out) {
  copy_out(found, found.objective_curvature, out);
}

void write(Prediction found, Problem& problem, const SensitivityOutput& out) {
  copy_out(found, found.share, out);
  problem.changes = std::move(found.changes);
  say(&problem, std::move(found.message));
}

}  // namespace
}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax

using namespace ipminmax;  // this file ends here

int IpminmaxUpdateSensitivity(IpminmaxProblem problem) {
  return guarded(problem, [&] {
    if (problem->solving) refuse("the problem is being solved");
    const Solving solving(*problem);  // the model's functions are called
    problem->changes.clear();
    problem->sensitivity_fits = false;
    if (!problem->answered) refuse("no solve has reached a first iterate");
    require_none(problem->application->UpdateSensitivity(problem->sensitivity));
    problem->sensitivity_fits = true;
  });
}

int IpminmaxGetDerivative(IpminmaxProblem problem, const double* dx_L, const double* dx_U,
                          const double* dg_L, const double* dg_U, double* dx, double* dmult_g,
                          double* dmult_x_L, double* dmult_x_U, double* dobj, double* d2obj) {
  return along_bounds(problem, {dx_L, dx_U, dg_L, dg_U}, [&](auto& sensitivity, const auto& by) {
    write(sensitivity.derivative(by), {dx, dmult_g, dmult_x_L, dmult_x_U, dobj, d2obj});
  });
}

int IpminmaxGetReaction(IpminmaxProblem problem, const double* dx_min, double* dx, double* dmult_g,
                        double* dmult_x_L, double* dmult_x_U, double* dobj, double* d2obj) {
  return after_move(problem, dx_min, [&](auto& sensitivity, const auto& move) {
    write(sensitivity.reaction(move), {dx, dmult_g, dmult_x_L, dmult_x_U, dobj, d2obj});
  });
}

int IpminmaxPredict(IpminmaxProblem problem, const double* dx_L, const double* dx_U,
                    const double* dg_L, const double* dg_U, double* x, double* mult_g,
                    double* mult_x_L, double* mult_x_U, double* obj, double* share) {
  return along_bounds(problem, {dx_L, dx_U, dg_L, dg_U}, [&](auto& sensitivity, const auto& by) {
    write(sensitivity.predict(by), *problem, {x, mult_g, mult_x_L, mult_x_U, obj, share});
  });
}

int IpminmaxPredictReaction(IpminmaxProblem problem, const double* dx_min, double* x,
                            double* mult_g, double* mult_x_L, double* mult_x_U, double* obj,
                            double* share) {
  return after_move(problem, dx_min, [&](auto& sensitivity, const auto& move) {
    write(sensitivity.react(move), *problem, {x, mult_g, mult_x_L, mult_x_U, obj, share});
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
    const ActiveSetChange& from = problem->changes[at(k)];
    const IpminmaxActiveSetChange to{from.share, from.of_constraint, from.index, from.upper,
                                     from.enters};
    write_sized(&to, sizeof to, reinterpret_cast<char*>(changes) + at(k) * size, size);
  }
  return count;
}
