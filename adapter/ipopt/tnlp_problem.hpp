#pragma once

#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "../../core/options.hpp"
#include "../../core/problem.hpp"
#include "../../core/solver.hpp"
#include "minmax_tnlp.hpp"
#include "player_lists.hpp"

namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Makes a Problem from an Ipopt model. Calls the model in Ipopt's order:
///   1. load: get_nlp_info, get_var_con_metadata, get_bounds_info, structure of eval_jac_g,
///      structure of eval_h (if it returns false, the nonlinear variables instead), players,
///      get_bounds_info again
///   2. starting_point and evaluations, while the core solves; report after each iteration
///   3. finalize: finalize_metadata, finalize_solution
/// Exceptions of the model pass through.
class TnlpProblem : public Problem {
 public:
  /// model: a MinMaxTNLP, or a plain TNLP. Every variable of a plain TNLP is Min's unless its
  /// integer metadata "player" says otherwise (n entries, 0 Min, 1 Max; the same for constraints).
  /// options: the lists of minmax_max_variables, minmax_max_constraints, minmax_min_constraints;
  /// load fails if the model's own players disagree. hessian: with LimitedMemory eval_h is never
  /// called, as in Ipopt.
  explicit TnlpProblem(const Ipopt::SmartPtr<Ipopt::TNLP>& model, PlayerOptions options = {},
                       HessianApproximation hessian = HessianApproximation::Unset);

  /// Reads everything that does not change during a solve. Returns an empty text, or what is wrong.
  /// Call it before anything else, and again before another solve.
  [[nodiscard]] std::string load();
  /// Returns whether load failed because eval_jac_g gave no structure. Ipopt 3.14.13 and later have
  /// a status for this.
  [[nodiscard]] bool has_no_jacobian() const { return has_no_jacobian_; }
  /// Returns whether it was made from these arguments.
  [[nodiscard]] bool is_of(const Ipopt::SmartPtr<Ipopt::TNLP>& model, const PlayerOptions& options,
                           HessianApproximation hessian) const {
    return GetRawPtr(model_) == GetRawPtr(model) && options_ == options &&
           hessian_source_ == hessian;
  }

  /// Passes the iteration on to intermediate_callback or maximization_callback. Returns false if
  /// the model wants to stop.
  [[nodiscard]] bool report(const IterationInfo& info);

  /// Returns whether the model has given a starting point.
  [[nodiscard]] bool started() const { return started_; }

  /// Gives the answer to the model (finalize_metadata, finalize_solution). If the result has no
  /// vectors (an exception, functions undefined at the start), x is the starting point, and
  /// multipliers and constraint values are NaN.
  void finalize(Ipopt::SolverReturn status, const Result& result);

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    return model_->eval_f(n_, address(v), new_v, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    return model_->eval_grad_f(n_, address(v), new_v, address(grad));
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    return model_->eval_g(n_, address(v), new_v, m_, address(g));
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    return model_->eval_jac_g(n_, address(v), new_v, m_, jacobian_entries_, nullptr, nullptr,
                              address(values));
  }
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v,
                                     bool new_v, std::span<double> g) override {
    return ModelByRows::eval_rows_of(*model_, n_, address(v), new_v,
                                     static_cast<Index>(rows.size()), address(rows), m_, address(g),
                                     jacobian_entries_, nullptr);
  }
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v,
                                   bool new_v, std::span<double> values) override {
    return ModelByRows::eval_rows_of(*model_, n_, address(v), new_v,
                                     static_cast<Index>(rows.size()), address(rows), m_, nullptr,
                                     jacobian_entries_, address(values));
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return model_->eval_h(n_, address(v), new_v, sigma, m_, address(lambda), new_lambda,
                          hessian_entries_, nullptr, nullptr, address(values));
  }
  [[nodiscard]] const BoxFunctions* over_boxes() const override;
  [[nodiscard]] std::unique_ptr<Problem> clone() const override;

 private:
  struct Metadata {
    Ipopt::TNLP::StringMetaDataMapType strings;
    Ipopt::TNLP::IntegerMetaDataMapType integers;
    Ipopt::TNLP::NumericMetaDataMapType numbers;
  };

  // Each throws INVALID_TNLP if something is wrong.
  void load_sizes();
  void load_metadata();
  void load_bounds();
  /// Room for so many entries of a matrix, none of them set.
  void expect_entries(Index entries);
  void load_jacobian_structure();
  void load_hessian_structure();
  void load_nonlinear_variables();
  void read_players(bool of_variables);
  /// Models tell the structure call from the value call by which pointers are null, so an empty
  /// array needs an address too.
  template <class T>
  static T* address(std::span<T> values) {
    static std::remove_const_t<T> nothing{};
    return values.empty() ? &nothing : values.data();
  }
  template <class T>
  static T* address(std::vector<T>& values) {
    return address(std::span<T>(values));
  }
  [[nodiscard]] Index first_index() const { return index_style_ == Ipopt::TNLP::C_STYLE ? 0 : 1; }

  Ipopt::SmartPtr<Ipopt::TNLP> model_;
  PlayerOptions options_;
  HessianApproximation hessian_source_;
  Index n_ = 0;
  Index m_ = 0;
  Index jacobian_entries_ = 0;
  Index hessian_entries_ = 0;
  Ipopt::TNLP::IndexStyleEnum index_style_ = Ipopt::TNLP::C_STYLE;
  Metadata variable_metadata_;
  Metadata constraint_metadata_;
  ProblemStructure structure_;
  bool started_ = false;
  bool has_no_jacobian_ = false;
  std::vector<double> start_;  ///< the model's
  // Kept from call to call
  std::vector<Index> rows_, cols_;       ///< of a matrix, as its structure call left them
  std::vector<Player> implied_players_;  ///< where the model says nothing
  std::vector<double> unread_z_lower_, unread_z_upper_, unread_lambda_;  ///< of a cold start
  std::vector<double> unknown_;                                          ///< NaN
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
