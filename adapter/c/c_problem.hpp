#pragma once

#include <algorithm>
#include <cstddef>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "adapter/c/ipminmax.h"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/minmax_tnlp.hpp"
#include "adapter/ipopt/optional_players.hpp"
#include "adapter/ipopt/point_arrays.hpp"
#include "core/sensitivity.hpp"
#include "linalg/uncopied.hpp"

// What the C interface's functions work with.

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// What IpminmaxCreate was given; arrays have n or m entries.
struct CallbackDefinition {
  Index n, m, nele_jac, nele_hess;
  IpminmaxEval_F_CB eval_f;
  IpminmaxEval_Grad_F_CB eval_grad_f;
  IpminmaxEval_G_CB eval_g;
  IpminmaxEval_Jac_G_CB eval_jac_g;
  IpminmaxEval_H_CB eval_h;
  Ipopt::TNLP::IndexStyleEnum index_style = Ipopt::TNLP::C_STYLE;
  std::vector<double> x_lower{}, x_upper{}, g_lower{}, g_upper{};
  std::vector<Player> variable_players{};
  std::vector<Player> constraint_players{};  ///< m, or empty: implied
};

/// The C model as an Ipopt model.
class CallbackTNLP : public MinMaxTNLP,
                     public OptionalPlayers,
                     public ModelOverBoxes,
                     public ModelByRows {
 public:
  explicit CallbackTNLP(CallbackDefinition d) : definition(std::move(d)) {}

  [[nodiscard]] const BoxFunctions* over_boxes() override { return boxes; }
  [[nodiscard]] bool gives_constraints_to_max() const override {
    return !definition.constraint_players.empty();
  }

  CallbackDefinition definition;
  const BoxFunctions* boxes = nullptr;  ///< the functions over boxes, where they are known
  IpminmaxEval_Rows_CB rows = nullptr;
  IpminmaxIntermediate_CB intermediate = nullptr;
  bool needs_hessian = true;  ///< whether an eval_h must know its structure
  double objective_scaling = 1.0;
  std::vector<double> x_scaling, g_scaling;                   ///< n and m, or empty: none
  std::vector<std::string> variable_names, constraint_names;  ///< n and m, or empty: none
  void* user_data = nullptr;
  Result start;            ///< the point; multipliers may be empty unless the start is warm
  Result answer;           ///< point, values and multipliers of finalize_solution
  bool finalized = false;  ///< whether the current solve has an answer

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = definition.n;
    m = definition.m;
    nnz_jac_g = definition.nele_jac;
    nnz_h_lag = definition.nele_hess;
    index_style = definition.index_style;
    return true;
  }
  bool get_var_con_metadata(Index, StringMetaDataMapType& variable_strings, IntegerMetaDataMapType&,
                            NumericMetaDataMapType&, Index,
                            StringMetaDataMapType& constraint_strings, IntegerMetaDataMapType&,
                            NumericMetaDataMapType&) override {
    if (!variable_names.empty()) variable_strings["idx_names"] = variable_names;
    if (!constraint_names.empty()) constraint_strings["idx_names"] = constraint_names;
    return true;
  }
  bool get_variable_players(Index, Player* players) override {
    std::ranges::copy(definition.variable_players, players);
    return true;
  }
  bool get_constraint_players(Index, Player* players) override {
    std::ranges::copy(definition.constraint_players, players);
    return true;
  }
  bool get_bounds_info(Index, double* x_l, double* x_u, Index, double* g_l, double* g_u) override {
    copy_to(x_l, definition.x_lower);
    copy_to(x_u, definition.x_upper);
    copy_to(g_l, definition.g_lower);
    copy_to(g_u, definition.g_upper);
    return true;
  }
  bool get_scaling_parameters(double& obj_scaling, bool& use_x_scaling, Index,
                              double* x_scaling_out, bool& use_g_scaling, Index,
                              double* g_scaling_out) override {
    obj_scaling = objective_scaling;
    use_x_scaling = !x_scaling.empty();
    use_g_scaling = !g_scaling.empty();
    copy_to(x_scaling_out, x_scaling);
    copy_to(g_scaling_out, g_scaling);
    return true;
  }
  bool get_starting_point(Index, bool init_x, double* x, bool init_z, double* z_L, double* z_U,
                          Index, bool init_lambda, double* lambda) override {
    if (init_x) copy_to(x, start.v);
    if (init_z) copy_to(z_L, start.z_lower);
    if (init_z) copy_to(z_U, start.z_upper);
    if (init_lambda) copy_to(lambda, start.lambda);
    return true;
  }
  bool eval_f(Index n, const double* x, bool new_x, double& obj_value) override {
    return is_true(definition.eval_f(n, writable(x), new_x, &obj_value, user_data));
  }
  bool eval_grad_f(Index n, const double* x, bool new_x, double* grad_f) override {
    return is_true(definition.eval_grad_f(n, writable(x), new_x, grad_f, user_data));
  }
  bool eval_g(Index n, const double* x, bool new_x, Index m, double* values) override {
    return definition.eval_g == nullptr ||
           is_true(definition.eval_g(n, writable(x), new_x, m, values, user_data));
  }
  bool eval_jac_g(Index n, const double* x, bool new_x, Index m, Index nele_jac, Index* iRow,
                  Index* jCol, double* values) override {
    return definition.eval_jac_g == nullptr ||
           is_true(definition.eval_jac_g(n, writable(x), new_x, m, nele_jac, iRow, jCol, values,
                                         user_data));
  }
  bool eval_rows(Index n, const double* x, bool new_x, Index count, const Index* which, Index m,
                 double* values_g, Index nele_jac, double* values) override {
    if (rows != nullptr) {
      return is_true(
          rows(n, writable(x), new_x, count, which, m, values_g, nele_jac, values, user_data));
    }
    return values_g != nullptr ? eval_g(n, x, new_x, m, values_g)
                               : eval_jac_g(n, x, new_x, m, nele_jac, nullptr, nullptr, values);
  }
  bool eval_h(Index n, const double* x, bool new_x, double obj_factor, Index m,
              const double* lambda, bool new_lambda, Index nele_hess, Index* iRow, Index* jCol,
              double* values) override {
    if (definition.eval_h == nullptr) return false;
    const bool done =
        is_true(definition.eval_h(n, writable(x), new_x, obj_factor, m, writable(lambda),
                                  new_lambda, nele_hess, iRow, jCol, values, user_data));
    if (!done && values == nullptr && needs_hessian) {
      THROW_EXCEPTION(  // Invalid_Option, as in Ipopt
          Ipopt::OPTION_INVALID,
          "eval_h returned 0 when asked for the structure of the Hessian; without second "
          "derivatives eval_h is NULL, or hessian_approximation finite-difference-values");
    }
    return done;
  }
  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iter, double obj_value, double inf_pr,
                             double inf_du, double mu, double d_norm, double regularization_size,
                             double alpha_du, double alpha_pr, Index ls_trials,
                             const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    return intermediate == nullptr ||
           is_true(intermediate(static_cast<int>(mode), iter, obj_value, inf_pr, inf_du, mu, d_norm,
                                regularization_size, alpha_du, alpha_pr, ls_trials, user_data));
  }
  bool maximization_callback(Index iter, double value) override {
    return intermediate == nullptr ||
           is_true(intermediate(2, iter, value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, user_data));
  }
  void finalize_solution(Ipopt::SolverReturn, Index n, const double* x, const double* z_L,
                         const double* z_U, Index m, const double* g, const double* lambda,
                         double obj_value, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    answer.v.assign(x, x + n);
    answer.z_lower.assign(z_L, z_L + n);
    answer.z_upper.assign(z_U, z_U + n);
    answer.lambda.assign(lambda, lambda + m);
    answer.constraints.assign(g, g + m);
    answer.objective = obj_value;
    finalized = true;
  }

 private:
  /// Callbacks made for Ipopt 3.14 return bool, of which a caller that reads an int finds only the
  /// low byte defined (System V and AArch64 ABI).
  static bool is_true(int returned) { return static_cast<unsigned char>(returned) != 0; }
  /// Ipopt's C callbacks take pointers to non-const and promise not to write.
  static double* writable(const double* values) { return const_cast<double*>(values); }
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax

/// What an IpminmaxProblem points to.
struct IpminmaxProblemInfo {
  explicit IpminmaxProblemInfo(ipminmax::CallbackDefinition definition)
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
  std::string statement;                           ///< the last one given out
  std::string message;
  const char* fixed_message = nullptr;  ///< in place of message, where memory is short
};

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// The message of the problem; without one, of calls without a problem.
void say(IpminmaxProblemInfo* problem, std::string text) noexcept;
/// The same without an allocation, so that it can report out of memory.
void say_fixed(IpminmaxProblemInfo* problem, const char* text) noexcept;
/// Of the last call without a problem.
[[nodiscard]] const char* message_without_problem() noexcept;

/// A function of the model may be called while this lives.
class Solving : Uncopied {
 public:
  explicit Solving(IpminmaxProblemInfo& problem) : problem_(problem) { problem.solving = true; }
  ~Solving() { problem_.solving = false; }

 private:
  IpminmaxProblemInfo& problem_;
};

/// What is wrong with a call: the message of the problem.
struct Refused {
  std::string why;
};
[[noreturn]] void refuse(const auto&... why) { throw Refused{concat(why...)}; }
inline void require_none(const std::string& error) {
  if (!error.empty()) refuse(error);
}

/// Runs action, which returns a status. No exception leaves.
template <class Action>
IpminmaxReturnStatus attempt(IpminmaxProblemInfo* problem, Action action) noexcept {
  try {
    return action();
  } catch (Refused& refused) {
    say(problem, std::move(refused.why));
    return IPMINMAX_INVALID_PROBLEM_DEFINITION;
  } catch (const std::bad_alloc&) {
    say_fixed(problem, "out of memory");
    return IPMINMAX_INSUFFICIENT_MEMORY;
  } catch (...) {
    say_fixed(problem, "internal error: unexpected exception");
    return IPMINMAX_INTERNAL_ERROR;
  }
}

/// Runs action; 1 when it ends. No exception leaves.
template <class Action>
int guarded(IpminmaxProblemInfo* problem, Action action) noexcept {
  if (problem == nullptr) {
    say_fixed(nullptr, "the problem is NULL");
    return 0;
  }
  return attempt(problem, [&] {
           action();
           return IPMINMAX_SOLVE_SUCCEEDED;
         }) == IPMINMAX_SOLVE_SUCCEEDED;
}

/// Copies count entries. Refuses NULL, unless it means none (may_be_null), and NaN.
[[nodiscard]] std::vector<double> read_array(const double* values, Index count, const char* name,
                                             bool may_be_null = false);
/// Whether second derivatives are asked of the model: a callback for them then has to answer.
[[nodiscard]] bool asks_for_hessian(const IpminmaxProblemInfo& problem);

/// As much of a structure as the caller's has, size bytes; what his has beyond is zero. Structures
/// keep their first entries when they grow.
void write_sized(const void* from, std::size_t known, void* to, std::size_t size);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
