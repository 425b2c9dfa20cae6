#pragma once

#include <string>
#include <vector>

#include "adapter/minmax_tnlp.hpp"
#include "core/result.hpp"

struct ASL;

namespace ipminmax {

/// A model in AMPL's .nl format. Integer suffix `player` (0 or 1) carries the split: with a
/// `minimize` objective 0 is Min and 1 is Max. A `maximize` objective f is solved as -f: its player
/// 0 maximizes f, 1 minimizes it, and objective and gradients here are those of -f.
class NlProblem : public MinMaxTNLP {
 public:
  /// Reads stub.nl (stub with or without its ending). objective: 1-based, 0 for none; -1 takes the
  /// first when there is one. Checks the file's form, then reads it and makes every call of a solve
  /// in a child process first, so that no file can end or stop this one. Throws std::runtime_error when the file cannot be used.
  NlProblem(const std::string& stub, int objective);
  ~NlProblem() override;
  NlProblem(const NlProblem&) = delete;
  NlProblem& operator=(const NlProblem&) = delete;

  /// Writes stub.sol, or the file named, with AMPL's signs of the multipliers. Throws
  /// std::runtime_error when it cannot be written.
  void write_solution(const std::string& message, int solve_result, const Result& result,
                      const std::string& file = "");

  [[nodiscard]] bool maximizes() const { return sign_ < 0.0; }
  [[nodiscard]] bool has_max_player() const;

  bool get_variable_players(Ipopt::Index n, Player* players) override;
  bool get_constraint_players(Ipopt::Index m, Player* players) override;
  bool get_var_con_metadata(Ipopt::Index n, StringMetaDataMapType& variable_strings,
                            IntegerMetaDataMapType&, NumericMetaDataMapType&, Ipopt::Index m,
                            StringMetaDataMapType& constraint_strings, IntegerMetaDataMapType&,
                            NumericMetaDataMapType&) override;
  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& nnz_jac_g,
                    Ipopt::Index& nnz_h_lag, IndexStyleEnum& index_style) override;
  bool get_bounds_info(Ipopt::Index n, double* x_l, double* x_u, Ipopt::Index m, double* g_l,
                       double* g_u) override;
  bool get_starting_point(Ipopt::Index n, bool init_x, double* x, bool init_z, double* z_L,
                          double* z_U, Ipopt::Index m, bool init_lambda, double* lambda) override;
  bool eval_f(Ipopt::Index n, const double* x, bool new_x, double& value) override;
  bool eval_grad_f(Ipopt::Index n, const double* x, bool new_x, double* gradient) override;
  bool eval_g(Ipopt::Index n, const double* x, bool new_x, Ipopt::Index m, double* g) override;
  bool eval_jac_g(Ipopt::Index n, const double* x, bool new_x, Ipopt::Index m,
                  Ipopt::Index nele_jac, Ipopt::Index* rows, Ipopt::Index* columns,
                  double* values) override;
  bool eval_h(Ipopt::Index n, const double* x, bool new_x, double sigma, Ipopt::Index m,
              const double* lambda, bool new_lambda, Ipopt::Index nele_hess, Ipopt::Index* rows,
              Ipopt::Index* columns, double* values) override;
  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index, const double*, const double*,
                         const double*, Ipopt::Index, const double*, const double*, double,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  void load(int objective);
  void read();
  void refuse_unsupported();
  /// Every index that the library hands over lies within its array, places of the Jacobian once.
  void require_valid_structure();
  void require_valid_hessian();
  void choose_objective(int objective);
  void read_players();
  void call_everything();
  /// ASL leaves variables out of its derivatives that the header counts as linear: throws when a
  /// function is nonlinear in one of them.
  void require_linear();
  [[nodiscard]] bool is_linear(const std::vector<double>& from, int first, int last);
  /// Values of f and g at x, which ASL's derivatives build on. False where one is undefined.
  bool evaluate(const double* x);

  std::string file_;
  ASL* asl_ = nullptr;
  int objective_ = -1;  ///< 0-based, -1 for none
  double sign_ = 1.0;   ///< -1: the model maximizes
  int hessian_entries_ = 0;
  std::vector<Player> variable_players_;
  std::vector<int> max_constraints_;
  std::vector<double> x_, g_;
  double f_ = 0.0;
  bool defined_ = false;
};

}  // namespace ipminmax
