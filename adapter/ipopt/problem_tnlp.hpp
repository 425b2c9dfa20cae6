#pragma once

#include <algorithm>
#include <functional>
#include <span>
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
                    IndexStyleEnum& index_style) override {
    const ProblemStructure& structure = problem_.structure();
    n = static_cast<Index>(structure.variable_lower.size());
    m = static_cast<Index>(structure.constraint_lower.size());
    nnz_jac_g = static_cast<Index>(structure.jacobian.size());
    nnz_h_lag = static_cast<Index>(structure.hessian.size());
    index_style = C_STYLE;
    return true;
  }
  /// Writes the problem's names, if it has any, as idx_names.
  bool get_var_con_metadata(Index, StringMetaDataMapType& var_string_md, IntegerMetaDataMapType&,
                            NumericMetaDataMapType&, Index, StringMetaDataMapType& con_string_md,
                            IntegerMetaDataMapType&, NumericMetaDataMapType&) override {
    const ProblemStructure& structure = problem_.structure();
    if (!structure.variable_names.empty()) var_string_md["idx_names"] = structure.variable_names;
    if (!structure.constraint_names.empty())
      con_string_md["idx_names"] = structure.constraint_names;
    return true;
  }
  bool get_bounds_info(Index, double* x_l, double* x_u, Index, double* g_l, double* g_u) override {
    const ProblemStructure& structure = problem_.structure();
    std::ranges::copy(structure.variable_lower, x_l);
    std::ranges::copy(structure.variable_upper, x_u);
    std::ranges::copy(structure.constraint_lower, g_l);
    std::ranges::copy(structure.constraint_upper, g_u);
    return true;
  }
  bool get_scaling_parameters(double& obj_scaling, bool& use_x_scaling, Index, double* x_scaling,
                              bool& use_g_scaling, Index, double* g_scaling) override {
    UserScaling scaling;
    if (!problem_.user_scaling(scaling)) return false;
    obj_scaling = scaling.objective;
    use_x_scaling = !scaling.variables.empty();
    use_g_scaling = !scaling.constraints.empty();
    std::ranges::copy(scaling.variables, x_scaling);
    std::ranges::copy(scaling.constraints, g_scaling);
    return true;
  }
  bool get_starting_point(Index n, bool, double* x, bool init_z, double* z_L, double* z_U, Index m,
                          bool init_lambda, double* lambda) override {
    std::fill_n(x, n, 0.0);
    StartingPoint start{{x, x + n}, init_z && init_lambda, {}, {}, {}};  // both or none
    if (start.needs_multipliers) {
      std::fill_n(z_L, n, 0.0);
      std::fill_n(z_U, n, 0.0);
      std::fill_n(lambda, m, 0.0);
      start.z_lower = {z_L, z_L + n};
      start.z_upper = {z_U, z_U + n};
      start.lambda = {lambda, lambda + m};
    }
    return problem_.starting_point(start);
  }
  bool eval_f(Index n, const double* x, bool new_x, double& obj_value) override {
    ++answer_.counts.objective;
    return problem_.objective({x, x + n}, new_x, obj_value);
  }
  bool eval_grad_f(Index n, const double* x, bool new_x, double* grad_f) override {
    ++answer_.counts.gradient;
    return problem_.gradient({x, x + n}, new_x, {grad_f, grad_f + n});
  }
  bool eval_g(Index n, const double* x, bool new_x, Index m, double* g) override {
    ++answer_.counts.constraints;
    return problem_.constraints({x, x + n}, new_x, {g, g + m});
  }
  bool eval_jac_g(Index n, const double* x, bool new_x, Index, Index nele_jac, Index* iRow,
                  Index* jCol, double* values) override {
    if (values == nullptr) return copy_structure(problem_.structure().jacobian, iRow, jCol);
    ++answer_.counts.jacobian;
    return problem_.jacobian({x, x + n}, new_x, {values, values + nele_jac});
  }
  bool eval_h(Index n, const double* x, bool new_x, double obj_factor, Index m,
              const double* lambda, bool new_lambda, Index nele_hess, Index* iRow, Index* jCol,
              double* values) override {
    if (values == nullptr) return copy_structure(problem_.structure().hessian, iRow, jCol);
    ++answer_.counts.hessian;
    return problem_.hessian({x, x + n}, new_x, obj_factor, {lambda, lambda + m}, new_lambda,
                            {values, values + nele_hess});
  }
  bool eval_rows(Index n, const double* x, bool new_x, Index count, const Index* rows, Index m,
                 double* g, Index nele_jac, double* values) override {
    const std::span asked(rows, rows + count);
    return g != nullptr
               ? problem_.constraint_rows(asked, {x, x + n}, new_x, {g, g + m})
               : problem_.jacobian_rows(asked, {x, x + n}, new_x, {values, values + nele_jac});
  }
  void finalize_solution(Ipopt::SolverReturn status, Index n, const double* x, const double* z_L,
                         const double* z_U, Index m, const double* g, const double* lambda,
                         double obj_value, const Ipopt::IpoptData* ip_data,
                         Ipopt::IpoptCalculatedQuantities* ip_cq) override;

 private:
  static bool copy_structure(const std::vector<Triplet>& triplets, Index* rows, Index* cols) {
    for (const auto& [row, col] : triplets) {
      *rows++ = row;
      *cols++ = col;
    }
    return true;
  }

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
  bool get_constraint_players(Index, Player* players) override {
    std::ranges::copy(problem_.structure().constraint_players, players);
    return true;
  }

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
