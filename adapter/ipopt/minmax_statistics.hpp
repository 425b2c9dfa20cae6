#pragma once

#include <algorithm>

#include <IpReferenced.hpp>
#include <IpTypes.hpp>

#include "../../core/result.hpp"
#include "ipopt_version.hpp"

namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Statistics of a solve, with the accessors of Ipopt's SolveStatistics (which cannot be filled
/// from outside Ipopt). LastResult() of the application says more.
class MinMaxStatistics : public Ipopt::ReferencedObject {
 public:
  /// What a result does not hold.
  struct Extra {
    double bound_violation = 0.0;  ///< largest of the variables' bounds
    double system_seconds = 0.0;
  };
  MinMaxStatistics(const Result& result, const Extra& extra)
      : iterations_(result.iterations),
        cpu_seconds_(result.cpu_seconds),
        wall_seconds_(result.seconds),
        objective_(result.objective),
        objective_scale_(result.objective_scale),
        error_(result.error),
        counts_(result.counts),
        extra_(extra) {}

  [[nodiscard]] Index IterationCount() const { return iterations_; }
  /// Seconds, function evaluations included.
  [[nodiscard]] double TotalCpuTime() const { return cpu_seconds_; }
  [[nodiscard]] double TotalCPUTime() const { return cpu_seconds_; }
  [[nodiscard]] double TotalSysTime() const { return extra_.system_seconds; }
  [[nodiscard]] double TotalWallclockTime() const { return wall_seconds_; }
  [[nodiscard]] double FinalObjective() const { return objective_; }
  [[nodiscard]] double FinalScaledObjective() const { return objective_scale_ * objective_; }

  void NumberOfEvaluations(Index& num_obj_evals, Index& num_constr_evals, Index& num_obj_grad_evals,
                           Index& num_constr_jac_evals, Index& num_hess_evals) const {
    num_obj_evals = counts_.objective;
    num_constr_evals = counts_.constraints;
    num_obj_grad_evals = counts_.gradient;
    num_constr_jac_evals = counts_.jacobian;
    num_hess_evals = counts_.hessian;
  }

  /// Factorizations of K and of K_yy, without those of restorations, and those for one cause.
  void NumberOfFactorizations(Index& of_k, Index& of_k_yy) const {
    of_k = counts_.factorizations_full;
    of_k_yy = counts_.factorizations_inner;
  }
  void NumberOfFactorizations(FactorizationCause cause, Index& of_k, Index& of_k_yy) const {
    of_k = counts_.factorizations_for(cause).full;
    of_k_yy = counts_.factorizations_for(cause).inner;
  }

  /// Unscaled infinity norms, dual_inf that of both players; kkt_error is the largest of the three.
  void Infeasibilities(double& dual_inf, double& constr_viol, double& complementarity,
                       double& kkt_error) const {
    dual_inf = std::max(error_.dual_min, error_.dual_max);
    constr_viol = error_.primal;
    complementarity = error_.complementarity;
    kkt_error = std::max({dual_inf, constr_viol, complementarity});
  }
  /// As in Ipopt 3.14, with the violation of the variables' bounds.
  void Infeasibilities(double& dual_inf, double& constr_viol, double& varbounds_viol,
                       double& complementarity, double& kkt_error) const {
    Infeasibilities(dual_inf, constr_viol, complementarity, kkt_error);
    varbounds_viol = extra_.bound_violation;
  }

  /// In the solver's scaling; scaled_kkt_error is Ipopt's E_0. Bounds are not scaled.
  void ScaledInfeasibilities(double& scaled_dual_inf, double& scaled_constr_viol,
                             double& scaled_complementarity, double& scaled_kkt_error) const {
    scaled_dual_inf = error_.scaled_dual;
    scaled_constr_viol = error_.scaled_primal;
    scaled_complementarity = error_.scaled_complementarity;
    scaled_kkt_error = error_.total;
  }
  void ScaledInfeasibilities(double& scaled_dual_inf, double& scaled_constr_viol,
                             double& scaled_varbounds_viol, double& scaled_complementarity,
                             double& scaled_kkt_error) const {
    ScaledInfeasibilities(scaled_dual_inf, scaled_constr_viol, scaled_complementarity,
                          scaled_kkt_error);
    scaled_varbounds_viol = extra_.bound_violation;
  }

 private:
  Index iterations_;
  double cpu_seconds_;
  double wall_seconds_;
  double objective_;
  double objective_scale_;
  KktError error_;
  Counts counts_;
  Extra extra_;
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
