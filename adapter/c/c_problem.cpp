#include "adapter/c/c_problem.hpp"

#include <IpOptionsList.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "adapter/ipopt/point_arrays.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Ipopt::Number;

/// Callbacks made for Ipopt 3.14 return bool, of which a caller that reads an int finds only the
/// low byte defined (System V and AArch64 ABI).
bool is_true(int returned) { return static_cast<unsigned char>(returned) != 0; }
// Ipopt's C callbacks take pointers to non-const and promise not to write.
double* writable(const double* values) { return const_cast<double*>(values); }
Player player(int value) { return static_cast<Player>(value); }

/// Message of calls without a problem; no allocation, so that it can report out of memory.
thread_local std::array<char, 512> creation_message{};

void say_without_problem(const char* text) noexcept {
  std::snprintf(creation_message.data(), creation_message.size(), "%s", text);
}

}  // namespace

bool CallbackTNLP::get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                                IndexStyleEnum& index_style) {
  n = d_.n;
  m = d_.m;
  nnz_jac_g = d_.nele_jac;
  nnz_h_lag = d_.nele_hess;
  index_style = d_.index_style;
  return true;
}

bool CallbackTNLP::get_var_con_metadata(Index, StringMetaDataMapType& variable_strings,
                                        IntegerMetaDataMapType&, NumericMetaDataMapType&, Index,
                                        StringMetaDataMapType& constraint_strings,
                                        IntegerMetaDataMapType&, NumericMetaDataMapType&) {
  if (!variable_names.empty()) variable_strings["idx_names"] = variable_names;
  if (!constraint_names.empty()) constraint_strings["idx_names"] = constraint_names;
  return true;
}

bool CallbackTNLP::get_variable_players(Index, Player* players) {
  std::transform(d_.variable_players.begin(), d_.variable_players.end(), players, player);
  return true;
}

bool CallbackTNLP::get_constraint_players(Index, Player* players) {
  std::transform(d_.constraint_players.begin(), d_.constraint_players.end(), players, player);
  return true;
}

bool CallbackTNLP::get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l,
                                   Number* g_u) {
  copy_to(x_l, d_.x_lower);
  copy_to(x_u, d_.x_upper);
  copy_to(g_l, d_.g_lower);
  copy_to(g_u, d_.g_upper);
  return true;
}

bool CallbackTNLP::get_scaling_parameters(Number& obj_scaling, bool& use_x_scaling, Index,
                                          Number* x_scaling_out, bool& use_g_scaling, Index,
                                          Number* g_scaling_out) {
  obj_scaling = objective_scaling;
  use_x_scaling = !x_scaling.empty();
  use_g_scaling = !g_scaling.empty();
  copy_to(x_scaling_out, x_scaling);
  copy_to(g_scaling_out, g_scaling);
  return true;
}

bool CallbackTNLP::get_starting_point(Index, bool init_x, Number* x, bool init_z, Number* z_L,
                                      Number* z_U, Index, bool init_lambda, Number* lambda) {
  if (init_x) copy_to(x, start.x);
  if (init_z) copy_to(z_L, start.z_lower);
  if (init_z) copy_to(z_U, start.z_upper);
  if (init_lambda) copy_to(lambda, start.lambda);
  return true;
}

bool CallbackTNLP::eval_f(Index n, const Number* x, bool new_x, Number& obj_value) {
  return is_true(d_.eval_f(n, writable(x), new_x, &obj_value, user_data));
}

bool CallbackTNLP::eval_grad_f(Index n, const Number* x, bool new_x, Number* grad_f) {
  return is_true(d_.eval_grad_f(n, writable(x), new_x, grad_f, user_data));
}

bool CallbackTNLP::eval_g(Index n, const Number* x, bool new_x, Index m, Number* values) {
  return d_.eval_g == nullptr || is_true(d_.eval_g(n, writable(x), new_x, m, values, user_data));
}

bool CallbackTNLP::eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index nele_jac,
                              Index* iRow, Index* jCol, Number* values) {
  return d_.eval_jac_g == nullptr ||
         is_true(d_.eval_jac_g(n, writable(x), new_x, m, nele_jac, iRow, jCol, values, user_data));
}

bool CallbackTNLP::eval_rows(Index n, const Number* x, bool new_x, Index count, const Index* which,
                             Index m, Number* values_g, Index nele_jac, Number* values) {
  if (rows != nullptr) {
    return is_true(
        rows(n, writable(x), new_x, count, which, m, values_g, nele_jac, values, user_data));
  }
  return values_g != nullptr ? eval_g(n, x, new_x, m, values_g)
                             : eval_jac_g(n, x, new_x, m, nele_jac, nullptr, nullptr, values);
}

bool CallbackTNLP::eval_h(Index n, const Number* x, bool new_x, Number obj_factor, Index m,
                          const Number* lambda, bool new_lambda, Index nele_hess, Index* iRow,
                          Index* jCol, Number* values) {
  if (d_.eval_h == nullptr) return false;
  const bool done = is_true(d_.eval_h(n, writable(x), new_x, obj_factor, m, writable(lambda),
                                      new_lambda, nele_hess, iRow, jCol, values, user_data));
  if (!done && values == nullptr && needs_hessian) {
    THROW_EXCEPTION(  // Invalid_Option, as in Ipopt
        Ipopt::OPTION_INVALID,
        "eval_h returned 0 when asked for the structure of the Hessian; without second "
        "derivatives eval_h is NULL, or hessian_approximation finite-difference-values");
  }
  return done;
}

bool CallbackTNLP::intermediate_callback(Ipopt::AlgorithmMode mode, Index iter, Number obj_value,
                                         Number inf_pr, Number inf_du, Number mu, Number d_norm,
                                         Number regularization_size, Number alpha_du,
                                         Number alpha_pr, Index ls_trials, const Ipopt::IpoptData*,
                                         Ipopt::IpoptCalculatedQuantities*) {
  return intermediate == nullptr ||
         is_true(intermediate(static_cast<int>(mode), iter, obj_value, inf_pr, inf_du, mu, d_norm,
                              regularization_size, alpha_du, alpha_pr, ls_trials, user_data));
}

bool CallbackTNLP::maximization_callback(Index iter, Number value) {
  return intermediate == nullptr ||
         is_true(intermediate(2, iter, value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, user_data));
}

void CallbackTNLP::finalize_solution(Ipopt::SolverReturn, Index n, const Number* x,
                                     const Number* z_L, const Number* z_U, Index m,
                                     const Number* g_values, const Number* lambda, Number obj_value,
                                     const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) {
  answer.x.assign(x, x + n);
  answer.z_lower.assign(z_L, z_L + n);
  answer.z_upper.assign(z_U, z_U + n);
  answer.lambda.assign(lambda, lambda + m);
  g.assign(g_values, g_values + m);
  objective = obj_value;
  finalized = true;
}

void say(IpminmaxProblemInfo* problem, std::string text) noexcept {
  if (problem == nullptr) return say_without_problem(text.c_str());
  problem->fixed_message = nullptr;
  problem->message = std::move(text);
}

void say_fixed(IpminmaxProblemInfo* problem, const char* text) noexcept {
  if (problem == nullptr) return say_without_problem(text);
  problem->fixed_message = text;
}

const char* message_without_problem() noexcept { return creation_message.data(); }

std::string name_of_entry(const char* array, std::size_t i) {
  return std::string(array) + "[" + std::to_string(i) + "]";
}

std::vector<double> read_array(const double* values, Index count, const char* name,
                               std::string& error) {
  if (count <= 0 || !error.empty()) return {};
  if (values == nullptr) {
    error = std::string(name) + " is NULL";
    return {};
  }
  const std::vector<double> result(values, values + count);
  const auto nan = std::find_if(result.begin(), result.end(), [](double v) { return v != v; });
  if (nan != result.end()) {
    error = name_of_entry(name, static_cast<std::size_t>(nan - result.begin())) + " is NaN";
  }
  return result;
}

bool asks_for_hessian(const IpminmaxProblemInfo& problem) {
  std::string source;
  return !problem.application->Options()->GetStringValue("hessian_approximation", source, "") ||
         source == "exact";
}

void write_sized(const void* from, std::size_t known, void* to, std::size_t size) {
  known = std::min(known, size);
  std::memcpy(to, from, known);
  std::memset(static_cast<char*>(to) + known, 0, size - known);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
