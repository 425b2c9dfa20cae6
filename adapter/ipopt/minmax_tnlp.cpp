#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "adapter/ipopt/minmax_tnlp.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Indices of a SplitTNLP's constructor, and whose they are to be.
struct IndexList {
  const char* name;  ///< of the constructor's argument
  const char* what;  ///< "variable" or "constraint"
  const std::vector<Index>& indices;
  Player player;
};

/// Gives players[i] to the list's player for every index i. first_place: room.
void give(const IndexList& list, Index size, std::vector<std::ptrdiff_t>& first_place,
          Player* players) {
  const auto name = [&] { return std::string("SplitTNLP: ") + list.name; };
  first_place.assign(at(size), -1);
  for (const auto k : indices(list.indices)) {
    const Index i = list.indices[k];
    if (i < 0 || i >= size) {
      THROW_EXCEPTION(Ipopt::TNLP::INVALID_TNLP,
                      name() + "[" + std::to_string(k) + "] = " + std::to_string(i) +
                          " is out of range: the model has " + std::to_string(size) + " " +
                          list.what + "s (indices are 0-based)");
    }
    std::ptrdiff_t& place = first_place[at(i)];
    if (place >= 0) {
      THROW_EXCEPTION(Ipopt::TNLP::INVALID_TNLP, name() + " holds index " + std::to_string(i) +
                                                     " twice, at places " + std::to_string(place) +
                                                     " and " + std::to_string(k));
    }
    place = static_cast<std::ptrdiff_t>(k);
    players[i] = list.player;
  }
}

}  // namespace

bool ObservableTNLP::get_curr_iterate([[maybe_unused]] const Ipopt::IpoptData* ip_data,
                                      [[maybe_unused]] Ipopt::IpoptCalculatedQuantities* ip_cq,
                                      bool scaled, Index n, double* x, double* z_L, double* z_U,
                                      Index m, double* g, double* lambda) const {
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
  if (ip_data != nullptr) {
    return TNLP::get_curr_iterate(ip_data, ip_cq, scaled, n, x, z_L, z_U, m, g, lambda);
  }
#endif
  return get_current_iterate(scaled, n, x, z_L, z_U, m, g, lambda);
}

bool ObservableTNLP::get_curr_violations([[maybe_unused]] const Ipopt::IpoptData* ip_data,
                                         [[maybe_unused]] Ipopt::IpoptCalculatedQuantities* ip_cq,
                                         bool scaled, Index n, double* x_L_violation,
                                         double* x_U_violation, double* compl_x_L,
                                         double* compl_x_U, double* grad_lag_x, Index m,
                                         double* nlp_constraint_violation, double* compl_g) const {
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
  if (ip_data != nullptr) {
    return TNLP::get_curr_violations(ip_data, ip_cq, scaled, n, x_L_violation, x_U_violation,
                                     compl_x_L, compl_x_U, grad_lag_x, m, nlp_constraint_violation,
                                     compl_g);
  }
#endif
  return get_current_violations(scaled, n, x_L_violation, x_U_violation, compl_x_L, compl_x_U,
                                grad_lag_x, m, nlp_constraint_violation, compl_g);
}

bool MinMaxTNLP::get_constraint_players(Index, Player*) { return true; }

bool MinMaxTNLP::maximization_callback(Index, double) { return true; }

SplitTNLP::SplitTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model, std::vector<Index> max_variables,
                     std::vector<Index> max_constraints, std::vector<Index> min_constraints)
    : model_(model),
      max_variables_(std::move(max_variables)),
      max_constraints_(std::move(max_constraints)),
      min_constraints_(std::move(min_constraints)) {
  if (IsNull(model_)) throw std::invalid_argument("SplitTNLP: the model is null");
}

bool ModelByRows::eval_rows_of(Ipopt::TNLP& model, Index n, const double* x, bool new_x,
                               Index count, const Index* rows, Index m, double* g, Index nele_jac,
                               double* values) {
  if (auto* by_rows = dynamic_cast<ModelByRows*>(&model))
    return by_rows->eval_rows(n, x, new_x, count, rows, m, g, nele_jac, values);
  return g != nullptr ? model.eval_g(n, x, new_x, m, g)
                      : model.eval_jac_g(n, x, new_x, m, nele_jac, nullptr, nullptr, values);
}

bool SplitTNLP::eval_rows(Index n, const double* x, bool new_x, Index count, const Index* rows,
                          Index m, double* g, Index nele_jac, double* values) {
  return eval_rows_of(*model_, n, x, new_x, count, rows, m, g, nele_jac, values);
}

const BoxFunctions* SplitTNLP::over_boxes() {
  auto* model = dynamic_cast<ModelOverBoxes*>(GetRawPtr(model_));
  return model != nullptr ? model->over_boxes() : nullptr;
}

bool SplitTNLP::get_variable_players(Index n, Player* players) {
  give({"max_variables", "variable", max_variables_, Player::Max}, n, first_place_, players);
  return true;
}

bool SplitTNLP::get_constraint_players(Index m, Player* players) {
  for (const Index j : min_constraints_) {
    if (std::ranges::find(max_constraints_, j) != max_constraints_.end()) {
      THROW_EXCEPTION(
          Ipopt::TNLP::INVALID_TNLP,
          "SplitTNLP: max_constraints and min_constraints both hold index " + std::to_string(j));
    }
  }
  give({"max_constraints", "constraint", max_constraints_, Player::Max}, m, first_place_, players);
  give({"min_constraints", "constraint", min_constraints_, Player::Min}, m, first_place_, players);
  return true;
}

bool SplitTNLP::get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                             IndexStyleEnum& index_style) {
  return model_->get_nlp_info(n, m, nnz_jac_g, nnz_h_lag, index_style);
}

bool SplitTNLP::get_var_con_metadata(Index n, StringMetaDataMapType& var_string_md,
                                     IntegerMetaDataMapType& var_integer_md,
                                     NumericMetaDataMapType& var_numeric_md, Index m,
                                     StringMetaDataMapType& con_string_md,
                                     IntegerMetaDataMapType& con_integer_md,
                                     NumericMetaDataMapType& con_numeric_md) {
  return model_->get_var_con_metadata(n, var_string_md, var_integer_md, var_numeric_md, m,
                                      con_string_md, con_integer_md, con_numeric_md);
}

bool SplitTNLP::get_bounds_info(Index n, double* x_l, double* x_u, Index m, double* g_l,
                                double* g_u) {
  return model_->get_bounds_info(n, x_l, x_u, m, g_l, g_u);
}

bool SplitTNLP::get_scaling_parameters(double& obj_scaling, bool& use_x_scaling, Index n,
                                       double* x_scaling, bool& use_g_scaling, Index m,
                                       double* g_scaling) {
  return model_->get_scaling_parameters(obj_scaling, use_x_scaling, n, x_scaling, use_g_scaling, m,
                                        g_scaling);
}

bool SplitTNLP::get_variables_linearity(Index n, LinearityType* var_types) {
  return model_->get_variables_linearity(n, var_types);
}

bool SplitTNLP::get_constraints_linearity(Index m, LinearityType* const_types) {
  return model_->get_constraints_linearity(m, const_types);
}

bool SplitTNLP::get_starting_point(Index n, bool init_x, double* x, bool init_z, double* z_L,
                                   double* z_U, Index m, bool init_lambda, double* lambda) {
  return model_->get_starting_point(n, init_x, x, init_z, z_L, z_U, m, init_lambda, lambda);
}

bool SplitTNLP::get_warm_start_iterate(Ipopt::IteratesVector& warm_start_iterate) {
  return model_->get_warm_start_iterate(warm_start_iterate);
}

bool SplitTNLP::eval_f(Index n, const double* x, bool new_x, double& obj_value) {
  return model_->eval_f(n, x, new_x, obj_value);
}

bool SplitTNLP::eval_grad_f(Index n, const double* x, bool new_x, double* grad_f) {
  return model_->eval_grad_f(n, x, new_x, grad_f);
}

bool SplitTNLP::eval_g(Index n, const double* x, bool new_x, Index m, double* g) {
  return model_->eval_g(n, x, new_x, m, g);
}

bool SplitTNLP::eval_jac_g(Index n, const double* x, bool new_x, Index m, Index nele_jac,
                           Index* iRow, Index* jCol, double* values) {
  return model_->eval_jac_g(n, x, new_x, m, nele_jac, iRow, jCol, values);
}

bool SplitTNLP::eval_h(Index n, const double* x, bool new_x, double obj_factor, Index m,
                       const double* lambda, bool new_lambda, Index nele_hess, Index* iRow,
                       Index* jCol, double* values) {
  return model_->eval_h(n, x, new_x, obj_factor, m, lambda, new_lambda, nele_hess, iRow, jCol,
                        values);
}

void SplitTNLP::finalize_solution(Ipopt::SolverReturn status, Index n, const double* x,
                                  const double* z_L, const double* z_U, Index m, const double* g,
                                  const double* lambda, double obj_value,
                                  const Ipopt::IpoptData* ip_data,
                                  Ipopt::IpoptCalculatedQuantities* ip_cq) {
  model_->finalize_solution(status, n, x, z_L, z_U, m, g, lambda, obj_value, ip_data, ip_cq);
}

void SplitTNLP::finalize_metadata(Index n, const StringMetaDataMapType& var_string_md,
                                  const IntegerMetaDataMapType& var_integer_md,
                                  const NumericMetaDataMapType& var_numeric_md, Index m,
                                  const StringMetaDataMapType& con_string_md,
                                  const IntegerMetaDataMapType& con_integer_md,
                                  const NumericMetaDataMapType& con_numeric_md) {
  model_->finalize_metadata(n, var_string_md, var_integer_md, var_numeric_md, m, con_string_md,
                            con_integer_md, con_numeric_md);
}

bool SplitTNLP::intermediate_callback(Ipopt::AlgorithmMode mode, Index iter, double obj_value,
                                      double inf_pr, double inf_du, double mu, double d_norm,
                                      double regularization_size, double alpha_du, double alpha_pr,
                                      Index ls_trials, const Ipopt::IpoptData* ip_data,
                                      Ipopt::IpoptCalculatedQuantities* ip_cq) {
  return model_->intermediate_callback(mode, iter, obj_value, inf_pr, inf_du, mu, d_norm,
                                       regularization_size, alpha_du, alpha_pr, ls_trials, ip_data,
                                       ip_cq);
}

Index SplitTNLP::get_number_of_nonlinear_variables() {
  return model_->get_number_of_nonlinear_variables();
}

bool SplitTNLP::get_list_of_nonlinear_variables(Index num_nonlin_vars, Index* pos_nonlin_vars) {
  return model_->get_list_of_nonlinear_variables(num_nonlin_vars, pos_nonlin_vars);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
