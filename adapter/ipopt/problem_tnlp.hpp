#pragma once

#include <functional>
#include <vector>

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>

#include "../../core/problem.hpp"
#include "../../core/result.hpp"
#include "ipopt_version.hpp"
#include "minmax_tnlp.hpp"

namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Answer of Ipopt, in the units and with the signs of Result. Vectors are empty if Ipopt stopped
/// before its first iterate.
struct IpoptAnswer {
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  std::vector<double> v;            ///< n
  std::vector<double> lambda;       ///< m
  std::vector<double> z_lower;      ///< n; Ipopt 3.11 leaves those of fixed variables at zero
  std::vector<double> z_upper;      ///< n
  std::vector<double> constraints;  ///< m, values g(v)
  double objective = 0.0;
  Index iterations = 0;
  double seconds = 0.0;  ///< wall time
  Counts counts;         ///< the model's evaluations; factorizations_full with MUMPS only

  [[nodiscard]] bool solved() const { return status == Ipopt::Solve_Succeeded; }
};

/// Makes a model for Ipopt from a Problem (TnlpProblem does the reverse) and keeps Ipopt's answer.
/// Ipopt minimizes it over the variables of both players.
class ProblemTnlp : public Ipopt::TNLP, public ModelOverBoxes, public ModelByRows {
 public:
  /// The problem has to outlive the model, and its structure has to be valid (see solve).
  explicit ProblemTnlp(Problem& problem) : problem_(problem) {}
  [[nodiscard]] const BoxFunctions* over_boxes() override { return problem_.over_boxes(); }

  /// Filled by finalize_solution, except status, iterations, seconds and factorizations.
  [[nodiscard]] const IpoptAnswer& answer() const { return answer_; }

  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& nnz_jac_g,
                    Ipopt::Index& nnz_h_lag, IndexStyleEnum& index_style) override;
  /// Writes the problem's names, if it has any, as idx_names.
  bool get_var_con_metadata(Ipopt::Index n, StringMetaDataMapType& var_string_md,
                            IntegerMetaDataMapType& var_integer_md,
                            NumericMetaDataMapType& var_numeric_md, Ipopt::Index m,
                            StringMetaDataMapType& con_string_md,
                            IntegerMetaDataMapType& con_integer_md,
                            NumericMetaDataMapType& con_numeric_md) override;
  bool get_bounds_info(Ipopt::Index n, Ipopt::Number* x_l, Ipopt::Number* x_u, Ipopt::Index m,
                       Ipopt::Number* g_l, Ipopt::Number* g_u) override;
  bool get_scaling_parameters(Ipopt::Number& obj_scaling, bool& use_x_scaling, Ipopt::Index n,
                              Ipopt::Number* x_scaling, bool& use_g_scaling, Ipopt::Index m,
                              Ipopt::Number* g_scaling) override;
  bool get_starting_point(Ipopt::Index n, bool init_x, Ipopt::Number* x, bool init_z,
                          Ipopt::Number* z_L, Ipopt::Number* z_U, Ipopt::Index m, bool init_lambda,
                          Ipopt::Number* lambda) override;
  bool eval_f(Ipopt::Index n, const Ipopt::Number* x, bool new_x,
              Ipopt::Number& obj_value) override;
  bool eval_grad_f(Ipopt::Index n, const Ipopt::Number* x, bool new_x,
                   Ipopt::Number* grad_f) override;
  bool eval_g(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Index m,
              Ipopt::Number* g) override;
  bool eval_jac_g(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Index m,
                  Ipopt::Index nele_jac, Ipopt::Index* iRow, Ipopt::Index* jCol,
                  Ipopt::Number* values) override;
  bool eval_h(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Number obj_factor,
              Ipopt::Index m, const Ipopt::Number* lambda, bool new_lambda, Ipopt::Index nele_hess,
              Ipopt::Index* iRow, Ipopt::Index* jCol, Ipopt::Number* values) override;
  bool eval_rows(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Index count,
                 const Ipopt::Index* rows, Ipopt::Index m, Ipopt::Number* g, Ipopt::Index nele_jac,
                 Ipopt::Number* values) override;
  void finalize_solution(Ipopt::SolverReturn status, Ipopt::Index n, const Ipopt::Number* x,
                         const Ipopt::Number* z_L, const Ipopt::Number* z_U, Ipopt::Index m,
                         const Ipopt::Number* g, const Ipopt::Number* lambda,
                         Ipopt::Number obj_value, const Ipopt::IpoptData* ip_data,
                         Ipopt::IpoptCalculatedQuantities* ip_cq) override;

 private:
  Problem& problem_;
  IpoptAnswer answer_;
};

/// Makes a model with players for MinMaxApplication from a Problem. IpoptApplication minimizes it
/// over the variables of both.
class GameTNLP : public SplitTNLP {
 public:
  /// The problem has to outlive the model, and its structure has to be valid (see solve).
  explicit GameTNLP(Problem& problem)
      : SplitTNLP(new ProblemTnlp(problem), {}), problem_(problem) {}

  bool get_variable_players(Ipopt::Index n, Player* players) override;
  bool get_constraint_players(Ipopt::Index m, Player* players) override;

 private:
  Problem& problem_;
};

/// Minimizes the problem's objective over the variables of both players with Ipopt. Ipopt has its
/// default options, linear solver MUMPS and no output; set_options may change options. If Ipopt
/// does not know an option or does not allow its value, it returns Invalid_Option or throws.
/// Exceptions of the problem pass through. Holds the lock of MUMPS meanwhile, so solves in other
/// threads that use MUMPS wait.
[[nodiscard]] IpoptAnswer solve_with_ipopt(
    Problem& problem, const std::function<void(Ipopt::OptionsList&)>& set_options = {});

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
