#pragma once

#include <algorithm>
#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "adapter/ipopt/minmax_tnlp.hpp"
#include "adapter/ipopt/optional_players.hpp"
#include "adapter/ipopt/player_lists.hpp"
#include "core/result.hpp"
#include "nl_check.hpp"
#include "solution_file.hpp"

struct ASL;

namespace ipminmax {

class NlBoxes;

/// A model in AMPL's .nl format. Integer suffix `player` (0 or 1) carries the split: with a
/// `minimize` objective 0 is Min and 1 is Max. A `maximize` objective f is solved as -f: its player
/// 0 maximizes f, 1 minimizes it, and objective and gradients here are those of -f. A constraint
/// that reads variables of player 1 and is listed with 0, or has suffix `robust` 1, must hold for
/// all of their values.
class NlProblem : public MinMaxTNLP,
                  public OptionalPlayers,
                  public ModelOverBoxes,
                  public ModelByRows {
 public:
  /// Reads stub.nl (stub with or without its ending). objective: 1-based, 0 for none; -1 takes the
  /// first when there is one. Checks the file's form, then reads it and makes every call of a solve
  /// in a child process first, so that no file can end or stop this one. Throws std::runtime_error
  /// when the file cannot be used.
  NlProblem(const std::string& stub, int objective);
  ~NlProblem() override;

  /// What options minmax_max_variables, minmax_max_constraints and minmax_min_constraints list
  /// (adapter/player_lists.hpp), names as in the files .col and .row. Throws std::invalid_argument
  /// when a list is wrong or contradicts the suffix player or robust. A smart pointer has to own
  /// the problem.
  void set_players(const PlayerOptions& options);

  /// Point, multipliers and suffixes with AMPL's signs; message and solve_result are the caller's.
  /// Vectors that are not finite are left out.
  [[nodiscard]] SolutionFile solution_file(const Result& result) const;
  /// Whether the file is binary; the .sol then is, too.
  [[nodiscard]] bool is_binary() const;

  /// The solve stops at the next iteration once stop is not 0.
  void stop_when(const volatile std::sig_atomic_t& stop) { stop_ = &stop; }
  /// Functions and first derivatives that are undefined at a point end the solve at its next
  /// iteration. Not at once: what the second-order test tries beside a solution is no part of it.
  void halt_on_error() { halt_on_error_ = true; }
  /// Throws std::runtime_error then, and says on standard error what is undefined.
  void halt_where_undefined();

  [[nodiscard]] bool maximizes() const { return sign_ < 0.0; }
  [[nodiscard]] bool has_player(Player player) const {
    return std::ranges::find(variable_players_, player) != variable_players_.end();
  }
  /// Whether the file has the suffix player of variables.
  [[nodiscard]] bool has_player_suffix() const { return has_player_suffix_; }
  [[nodiscard]] bool gives_constraints_to_max() const override { return !max_constraints_.empty(); }
  /// A suffix of variables whose name is nearly that one; empty without.
  [[nodiscard]] std::string misspelt_suffix() const;
  /// Name of a variable that the model wants integer and that is continuous here; empty without.
  [[nodiscard]] std::string integer_variable() const;
  [[nodiscard]] std::string variable_name(int i) const;
  [[nodiscard]] std::string constraint_name(int i) const;
  [[nodiscard]] const std::vector<Player>& players() const { return variable_players_; }
  [[nodiscard]] int constraints() const;

  /// Reads the formulas from the file at the first call.
  [[nodiscard]] const BoxFunctions* over_boxes() override;
  bool get_variable_players(Index, Player* players) override {
    std::ranges::copy(variable_players_, players);
    return true;
  }
  bool get_constraint_players(Index, Player* players) override {
    for (const int i : max_constraints_) players[i] = Player::Max;
    for (const int i : robust_constraints_) players[i] = Player::Min;
    return true;
  }
  bool get_var_con_metadata(Index n, StringMetaDataMapType& variable_strings,
                            IntegerMetaDataMapType&, NumericMetaDataMapType&, Index m,
                            StringMetaDataMapType& constraint_strings, IntegerMetaDataMapType&,
                            NumericMetaDataMapType&) override {
    for (int i = 0; i < n; ++i) variable_strings["idx_names"].push_back(variable_name(i));
    for (int i = 0; i < m; ++i) constraint_strings["idx_names"].push_back(constraint_name(i));
    return true;
  }
  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override;
  bool get_bounds_info(Index n, double* x_l, double* x_u, Index m, double* g_l,
                       double* g_u) override;
  bool get_scaling_parameters(double& of_objective, bool& use_x, Index n, double* x, bool& use_g,
                              Index m, double* g) override;
  bool get_starting_point(Index n, bool init_x, double* x, bool init_z, double* z_L, double* z_U,
                          Index m, bool init_lambda, double* lambda) override;
  bool eval_f(Index, const double* x, bool, double& value) override {
    evaluate(x);
    value = f_;
    return f_is_defined_;
  }
  bool eval_grad_f(Index n, const double* x, bool new_x, double* gradient) override;
  bool eval_g(Index, const double* x, bool, Index, double* g) override {
    evaluate(x);
    std::ranges::copy(g_, g);
    return g_is_defined_;
  }
  bool eval_jac_g(Index n, const double* x, bool new_x, Index m, Index nele_jac, Index* rows,
                  Index* columns, double* values) override;
  bool eval_rows(Index n, const double* x, bool new_x, Index count, const Index* rows, Index m,
                 double* g, Index nele_jac, double* values) override;
  bool eval_h(Index n, const double* x, bool new_x, double sigma, Index m, const double* lambda,
              bool new_lambda, Index nele_hess, Index* rows, Index* columns,
              double* values) override;
  bool intermediate_callback(Ipopt::AlgorithmMode, Index, double, double, double, double, double,
                             double, double, double, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    return maximization_callback(0, 0.0);
  }
  bool maximization_callback(Index, double) override {
    halt_where_undefined();
    return !stop_ || *stop_ == 0;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const double*, const double*, const double*,
                         Index, const double*, const double*, double, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  void load(int objective);
  void read();
  [[nodiscard]] int variables() const;
  void read_players();
  void call_everything();
  /// ASL leaves variables out of its derivatives that the header counts as linear: throws when a
  /// function is nonlinear in one of them.
  void require_linear();
  [[nodiscard]] bool is_linear(const std::vector<double>& from, int first, int last);
  /// From now on at x.
  void move_to(const double* x);
  /// Evaluates f and g at x, which ASL's derivatives build on. Returns false if one is undefined.
  bool evaluate(const double* x);
  /// failed: what ASL says of an evaluation at x_.
  [[nodiscard]] bool is_defined(bool failed) {
    if (failed && halt_on_error_) undefined_at_ = x_;
    return !failed;
  }

  std::string file_, read_from_;  ///< not the same where a variable had to be added
  NlFacts facts_;
  std::unique_ptr<NlBoxes> boxes_;
  ASL* asl = nullptr;   ///< the name that the macros of AMPL's library expect
  int objective_ = -1;  ///< 0-based, -1 for none
  double sign_ = 1.0;   ///< -1: the model maximizes
  int hessian_entries_ = 0;
  std::vector<Player> variable_players_;
  std::vector<int> max_constraints_, robust_constraints_;
  std::vector<double> x_, g_, undefined_at_;
  bool evaluated_ = false;  ///< f_ and g_ are those of x_
  double f_ = 0.0;
  bool f_is_defined_ = false, g_is_defined_ = false;
  bool has_player_suffix_ = false;
  bool halt_on_error_ = false;
  const volatile std::sig_atomic_t* stop_ = nullptr;
};

/// stub.sol, for a stub with or without the ending .nl.
[[nodiscard]] std::string solution_file_name(const std::string& stub);

}  // namespace ipminmax
