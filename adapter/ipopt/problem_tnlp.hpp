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

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override;
  /// Writes the problem's names, if it has any, as idx_names.
  bool get_var_con_metadata(Index n, StringMetaDataMapType& var_string_md,
                            IntegerMetaDataMapType& var_integer_md,
                            NumericMetaDataMapType& var_numeric_md, Index m,
                            StringMetaDataMapType& con_string_md,
                            IntegerMetaDataMapType& con_integer_md,
                            NumericMetaDataMapType& con_numeric_md) override;
  bool get_bounds_info(Index n, double* x_l, double* x_u, Index m, double* g_l,
                       double* g_u) override;
  bool get_scaling_parameters(double& obj_scaling, bool& use_x_scaling, Index n, double* x_scaling,
                              bool& use_g_scaling, Index m, double* g_scaling) override;
  bool get_starting_point(Index n, bool init_x, double* x, bool init_z, double* z_L, double* z_U,
                          Index m, bool init_lambda, double* lambda) override;
  bool eval_f(Index n, const double* x, bool new_x, double& obj_value) override;
  bool eval_grad_f(Index n, const double* x, bool new_x, double* grad_f) override;
  bool eval_g(Index n, const double* x, bool new_x, Index m, double* g) override;
  bool eval_jac_g(Index n, const double* x, bool new_x, Index m, Index nele_jac, Index* iRow,
                  Index* jCol, double* values) override;
  bool eval_h(Index n, const double* x, bool new_x, double obj_factor, Index m,
              const double* lambda, bool new_lambda, Index nele_hess, Index* iRow, Index* jCol,
              double* values) override;
  bool eval_rows(Index n, const double* x, bool new_x, Index count, const Index* rows, Index m,
                 double* g, Index nele_jac, double* values) override;
  void finalize_solution(Ipopt::SolverReturn status, Index n, const double* x, const double* z_L,
                         const double* z_U, Index m, const double* g, const double* lambda,
                         double obj_value, const Ipopt::IpoptData* ip_data,
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

  bool get_variable_players(Index n, Player* players) override;
  bool get_constraint_players(Index m, Player* players) override;

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
