#pragma once

#include <algorithm>

#include <IpReferenced.hpp>
#include <IpTypes.hpp>

#include "../core/result.hpp"
#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Statistics of a solve, with the accessors of Ipopt's SolveStatistics (which cannot be filled from
/// outside Ipopt). LastResult() of the application says more.
class MinMaxStatistics : public Ipopt::ReferencedObject {
 public:
  explicit MinMaxStatistics(const Result& result)
      : iterations_(result.iterations),
        cpu_seconds_(result.cpu_seconds),
        wall_seconds_(result.seconds),
        objective_(result.objective),
        error_(result.error),
        counts_(result.counts) {}

  [[nodiscard]] Ipopt::Index IterationCount() const { return iterations_; }
  /// Seconds, function evaluations included.
  [[nodiscard]] Ipopt::Number TotalCpuTime() const { return cpu_seconds_; }
  [[nodiscard]] Ipopt::Number TotalCPUTime() const { return cpu_seconds_; }
  [[nodiscard]] Ipopt::Number TotalWallclockTime() const { return wall_seconds_; }
  [[nodiscard]] Ipopt::Number FinalObjective() const { return objective_; }

  void NumberOfEvaluations(Ipopt::Index& num_obj_evals, Ipopt::Index& num_constr_evals,
                           Ipopt::Index& num_obj_grad_evals, Ipopt::Index& num_constr_jac_evals,
                           Ipopt::Index& num_hess_evals) const {
    num_obj_evals = counts_.objective;
    num_constr_evals = counts_.constraints;
    num_obj_grad_evals = counts_.gradient;
    num_constr_jac_evals = counts_.jacobian;
    num_hess_evals = counts_.hessian;
  }

  /// Unscaled infinity norms, dual_inf that of both players; kkt_error is the largest of the three.
  void Infeasibilities(Ipopt::Number& dual_inf, Ipopt::Number& constr_viol,
                       Ipopt::Number& complementarity, Ipopt::Number& kkt_error) const {
    dual_inf = std::max(error_.dual_min, error_.dual_max);
    constr_viol = error_.primal;
    complementarity = error_.complementarity;
    kkt_error = std::max({dual_inf, constr_viol, complementarity});
  }

 private:
  Ipopt::Index iterations_;
  Ipopt::Number cpu_seconds_;
  Ipopt::Number wall_seconds_;
  Ipopt::Number objective_;
  KktError error_;
  Counts counts_;
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
