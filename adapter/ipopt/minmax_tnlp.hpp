#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include <IpSmartPtr.hpp>
#include <IpTNLP.hpp>

#include "../../core/problem.hpp"
#include "ipopt_version.hpp"

namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

static_assert(std::is_same_v<Ipopt::Number, double> && std::is_same_v<Ipopt::Index, int>,
              "Ipminmax needs an Ipopt with double precision numbers and int indices");

/// Writes the iterate as MinMaxApplication::GetCurrentIterate does. Call it inside a model's
/// intermediate_callback or finalize_solution. x, z_L and z_U have n entries, g and lambda m; each
/// may be null. Returns false and writes nothing if it is called elsewhere, if n or m are wrong, or
/// if GetCurrentIterate returns false.
[[nodiscard]] bool get_current_iterate(bool scaled, Index n, double* x, double* z_L, double* z_U,
                                       Index m, double* g, double* lambda);

/// Writes the violations that MinMaxApplication::GetCurrentViolations returns; core/violations.hpp
/// defines each array. The last two arrays have m entries, the others n; each may be null. Returns
/// false and writes nothing under the conditions of get_current_iterate.
[[nodiscard]] bool get_current_violations(bool scaled, Index n, double* x_L_violation,
                                          double* x_U_violation, double* compl_x_L,
                                          double* compl_x_U, double* grad_lag_x, Index m,
                                          double* nlp_constraint_violation, double* compl_g);

/// Base of models that call get_curr_iterate or get_curr_violations in intermediate_callback or
/// finalize_solution. Ipopt 3.14's TNLP has these functions; here they also work with this
/// library's applications, whichever Ipopt it was built with. If Ipopt itself solves the model,
/// Ipopt 3.14 answers, and with an older Ipopt they return false.
class ObservableTNLP : public Ipopt::TNLP {
 public:
  bool get_curr_iterate(const Ipopt::IpoptData* ip_data,
                        [[maybe_unused]] Ipopt::IpoptCalculatedQuantities* ip_cq, bool scaled,
                        Index n, double* x, double* z_L, double* z_U, Index m, double* g,
                        double* lambda) const {
    if (ip_data != nullptr) {
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
      return TNLP::get_curr_iterate(ip_data, ip_cq, scaled, n, x, z_L, z_U, m, g, lambda);
#endif
    }
    return get_current_iterate(scaled, n, x, z_L, z_U, m, g, lambda);
  }
  bool get_curr_violations(const Ipopt::IpoptData* ip_data,
                           [[maybe_unused]] Ipopt::IpoptCalculatedQuantities* ip_cq, bool scaled,
                           Index n, double* x_L_violation, double* x_U_violation, double* compl_x_L,
                           double* compl_x_U, double* grad_lag_x, Index m,
                           double* nlp_constraint_violation, double* compl_g) const {
    if (ip_data != nullptr) {
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
      return TNLP::get_curr_violations(ip_data, ip_cq, scaled, n, x_L_violation, x_U_violation,
                                       compl_x_L, compl_x_U, grad_lag_x, m,
                                       nlp_constraint_violation, compl_g);
#endif
    }
    return get_current_violations(scaled, n, x_L_violation, x_U_violation, compl_x_L, compl_x_U,
                                  grad_lag_x, m, nlp_constraint_violation, compl_g);
  }
};

/// An Ipopt model that says which player owns each variable and each constraint. It has one vector
/// of variables, one of constraints, one objective f (which Min minimizes and Max maximizes) and
/// one Hessian, that of obj_factor f + lambda' g, for both players.
class MinMaxTNLP : public ObservableTNLP {
 public:
  /// Writes the owner of each variable into players: n entries, all Min on entry. Return true.
  /// False or the exception INVALID_TNLP ends the solve with Invalid_Problem_Definition; the
  /// message of the exception is printed.
  virtual bool get_variable_players(Index n, Player* players) = 0;

  /// Changes the owners of constraints: m entries, on entry the defaults (Max if the constraint has
  /// a Jacobian entry in a Max variable, else Min). A constraint of Min that reads Max variables is
  /// robust: x must meet it for every y (docs/robust_constraints.md). Fails as
  /// get_variable_players.
  virtual bool get_constraint_players(Index m, Player* players);

  /// Is called, instead of intermediate_callback, in each iteration of a maximization over y at
  /// fixed x. value is that of the function maximized (f or a robust constraint) at the iterate.
  /// Return false to stop the whole solve; it then returns its best finished point.
  virtual bool maximization_callback(Index iter, double value);
};

/// Second base class of an Ipopt model whose functions can be evaluated over boxes of its
/// variables, as minmax_worst_case_proof needs.
class ModelOverBoxes {
 public:
  virtual ~ModelOverBoxes() = default;
  /// Returns the functions over boxes (core/proof.hpp), or null if the model has none.
  [[nodiscard]] virtual const BoxFunctions* over_boxes() = 0;
};

/// Second base class of an Ipopt model that can be cloned. With the option minmax_threads above 1
/// several threads then maximize the robust constraints over y.
class ClonableModel {
 public:
  virtual ~ClonableModel() = default;
  /// Returns another object for the same model, or null if there is none. It must give the same
  /// values as this one; a thread evaluates it while others evaluate other clones. The callbacks of
  /// this object are called by one thread at a time, while its own functions are not evaluated.
  [[nodiscard]] virtual Ipopt::SmartPtr<Ipopt::TNLP> clone_model() const = 0;
  /// Returns a clone of the model if it is a ClonableModel, else null.
  [[nodiscard]] static Ipopt::SmartPtr<Ipopt::TNLP> clone_of(const Ipopt::TNLP& model) {
    const auto* clonable = dynamic_cast<const ClonableModel*>(&model);
    return clonable != nullptr ? clonable->clone_model() : nullptr;
  }
};

/// Second base class of an Ipopt model that can evaluate single constraints (rows) faster than all.
/// A maximization of a robust constraint over y then evaluates only this row and Max's rows. eval_h
/// should skip rows with lambda 0.
class ModelByRows {
 public:
  virtual ~ModelByRows() = default;
  /// Writes the values of `count` rows (0-based, ascending) into g (m entries) or, if g is null,
  /// their entries of the Jacobian into values (nele_jac entries). Other entries may stay as they
  /// are. Returns false if a function is undefined at x.
  [[nodiscard]] virtual bool eval_rows(Index n, const double* x, bool new_x, Index count,
                                       const Index* rows, Index m, double* g, Index nele_jac,
                                       double* values) = 0;
  /// Calls eval_rows if the model is a ModelByRows, else eval_g or eval_jac_g for all rows.
  [[nodiscard]] static bool eval_rows_of(Ipopt::TNLP& model, Index n, const double* x, bool new_x,
                                         Index count, const Index* rows, Index m, double* g,
                                         Index nele_jac, double* values) {
    if (auto* by_rows = dynamic_cast<ModelByRows*>(&model))
      return by_rows->eval_rows(n, x, new_x, count, rows, m, g, nele_jac, values);
    return g != nullptr ? model.eval_g(n, x, new_x, m, g)
                        : model.eval_jac_g(n, x, new_x, m, nele_jac, nullptr, nullptr, values);
  }
};

/// Gives variables and constraints of an unmodified Ipopt model to Max, and passes every call on to
/// that model. An index that is out of range or given twice ends the solve with
/// Invalid_Problem_Definition.
class SplitTNLP : public MinMaxTNLP,
                  public ModelOverBoxes,
                  public ModelByRows,
                  public ClonableModel {
 public:
  /// max_variables: 0-based indices of the variables that the maximizer chooses.
  /// max_constraints: 0-based indices of constraints given to Max besides the default ones.
  /// min_constraints: 0-based indices of constraints given to Min; one that reads Max variables is
  /// robust: it must hold for all of their values (docs/robust_constraints.md).
  /// Throws std::invalid_argument if model is null.
  SplitTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model, std::vector<Index> max_variables,
            std::vector<Index> max_constraints = {}, std::vector<Index> min_constraints = {});

  /// Returns the model that is split.
  [[nodiscard]] Ipopt::SmartPtr<Ipopt::TNLP> model() const { return model_; }

  [[nodiscard]] const BoxFunctions* over_boxes() override {
    auto* model = dynamic_cast<ModelOverBoxes*>(GetRawPtr(model_));
    return model != nullptr ? model->over_boxes() : nullptr;
  }
  /// Splits a clone of the model; null for a derived class that does not override it.
  [[nodiscard]] Ipopt::SmartPtr<Ipopt::TNLP> clone_model() const override;
  bool get_variable_players(Index n, Player* players) override;
  bool get_constraint_players(Index m, Player* players) override;

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    return model_->get_nlp_info(n, m, nnz_jac_g, nnz_h_lag, index_style);
  }
  bool get_var_con_metadata(Index n, StringMetaDataMapType& var_string_md,
                            IntegerMetaDataMapType& var_integer_md,
                            NumericMetaDataMapType& var_numeric_md, Index m,
                            StringMetaDataMapType& con_string_md,
                            IntegerMetaDataMapType& con_integer_md,
                            NumericMetaDataMapType& con_numeric_md) override {
    return model_->get_var_con_metadata(n, var_string_md, var_integer_md, var_numeric_md, m,
                                        con_string_md, con_integer_md, con_numeric_md);
  }
  bool get_bounds_info(Index n, double* x_l, double* x_u, Index m, double* g_l,
                       double* g_u) override {
    return model_->get_bounds_info(n, x_l, x_u, m, g_l, g_u);
  }
  bool get_scaling_parameters(double& obj_scaling, bool& use_x_scaling, Index n, double* x_scaling,
                              bool& use_g_scaling, Index m, double* g_scaling) override {
    return model_->get_scaling_parameters(obj_scaling, use_x_scaling, n, x_scaling, use_g_scaling,
                                          m, g_scaling);
  }
  bool get_variables_linearity(Index n, LinearityType* var_types) override {
    return model_->get_variables_linearity(n, var_types);
  }
  bool get_constraints_linearity(Index m, LinearityType* const_types) override {
    return model_->get_constraints_linearity(m, const_types);
  }
  bool get_starting_point(Index n, bool init_x, double* x, bool init_z, double* z_L, double* z_U,
                          Index m, bool init_lambda, double* lambda) override {
    return model_->get_starting_point(n, init_x, x, init_z, z_L, z_U, m, init_lambda, lambda);
  }
  bool get_warm_start_iterate(Ipopt::IteratesVector& warm_start_iterate) override {
    return model_->get_warm_start_iterate(warm_start_iterate);
  }
  bool eval_f(Index n, const double* x, bool new_x, double& obj_value) override {
    return model_->eval_f(n, x, new_x, obj_value);
  }
  bool eval_grad_f(Index n, const double* x, bool new_x, double* grad_f) override {
    return model_->eval_grad_f(n, x, new_x, grad_f);
  }
  bool eval_g(Index n, const double* x, bool new_x, Index m, double* g) override {
    return model_->eval_g(n, x, new_x, m, g);
  }
  bool eval_jac_g(Index n, const double* x, bool new_x, Index m, Index nele_jac, Index* iRow,
                  Index* jCol, double* values) override {
    return model_->eval_jac_g(n, x, new_x, m, nele_jac, iRow, jCol, values);
  }
  bool eval_h(Index n, const double* x, bool new_x, double obj_factor, Index m,
              const double* lambda, bool new_lambda, Index nele_hess, Index* iRow, Index* jCol,
              double* values) override {
    return model_->eval_h(n, x, new_x, obj_factor, m, lambda, new_lambda, nele_hess, iRow, jCol,
                          values);
  }
  bool eval_rows(Index n, const double* x, bool new_x, Index count, const Index* rows, Index m,
                 double* g, Index nele_jac, double* values) override {
    return eval_rows_of(*model_, n, x, new_x, count, rows, m, g, nele_jac, values);
  }  // the model's
  void finalize_solution(Ipopt::SolverReturn status, Index n, const double* x, const double* z_L,
                         const double* z_U, Index m, const double* g, const double* lambda,
                         double obj_value, const Ipopt::IpoptData* ip_data,
                         Ipopt::IpoptCalculatedQuantities* ip_cq) override {
    model_->finalize_solution(status, n, x, z_L, z_U, m, g, lambda, obj_value, ip_data, ip_cq);
  }
  void finalize_metadata(Index n, const StringMetaDataMapType& var_string_md,
                         const IntegerMetaDataMapType& var_integer_md,
                         const NumericMetaDataMapType& var_numeric_md, Index m,
                         const StringMetaDataMapType& con_string_md,
                         const IntegerMetaDataMapType& con_integer_md,
                         const NumericMetaDataMapType& con_numeric_md) override {
    model_->finalize_metadata(n, var_string_md, var_integer_md, var_numeric_md, m, con_string_md,
                              con_integer_md, con_numeric_md);
  }
  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iter, double obj_value, double inf_pr,
                             double inf_du, double mu, double d_norm, double regularization_size,
                             double alpha_du, double alpha_pr, Index ls_trials,
                             const Ipopt::IpoptData* ip_data,
                             Ipopt::IpoptCalculatedQuantities* ip_cq) override {
    return model_->intermediate_callback(mode, iter, obj_value, inf_pr, inf_du, mu, d_norm,
                                         regularization_size, alpha_du, alpha_pr, ls_trials,
                                         ip_data, ip_cq);
  }
  Index get_number_of_nonlinear_variables() override {
    return model_->get_number_of_nonlinear_variables();
  }
  bool get_list_of_nonlinear_variables(Index num_nonlin_vars, Index* pos_nonlin_vars) override {
    return model_->get_list_of_nonlinear_variables(num_nonlin_vars, pos_nonlin_vars);
  }

 private:
  Ipopt::SmartPtr<Ipopt::TNLP> model_;
  std::vector<Index> max_variables_;
  std::vector<Index> max_constraints_;
  std::vector<Index> min_constraints_;
  std::vector<std::ptrdiff_t> first_place_;  ///< work
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
