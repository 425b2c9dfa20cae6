#pragma once

#include <ipminmax/core/kkt_system.hpp>
#include <ipminmax/core/options.hpp>
#include <ipminmax/core/timer.hpp>
#include <optional>

namespace ipminmax {

/// Chooses the shifts of the KKT matrices: the paper's (ConsLQAC) and line 7 of Algorithm 1.
///
/// First (delta_y, delta_ly) grow until K_yy has the expected inertia, then (delta_x, delta_lx)
/// until K has; x-values do not enter K_yy, so the inner answer stands. Both start at zero, then
/// at a fraction of the last shift used (Ipopt's rule) or, with cold shifts, at
/// first_hessian_perturbation as in the paper. Deterministic.
class InertiaCorrection {
 public:
  InertiaCorrection(KktSystem& kkt, const SolverOptions& options, Counts& counts, TimeLimit& limit)
      : kkt_(kkt), options_(options), counts_(counts), limit_(limit) {}

  /// Leaves K factorized with the returned shifts and K_yy with its part of them. Empty: no shift
  /// up to max_hessian_perturbation gave the inertias, or the time limit is exceeded.
  [[nodiscard]] std::optional<Regularization> correct(double mu);

  /// K_yy alone.
  [[nodiscard]] bool correct_inner(double mu, Regularization& shift);
  /// K, given shifts that are right for K_yy.
  /// zero_fails: the inertia without shift is known to be wrong already.
  [[nodiscard]] bool correct_full(double mu, Regularization& shift, bool zero_fails = false);

  /// Forgets the last shifts.
  void reset() { last_x_ = last_raised_x_ = last_y_ = 0.0; }

  /// Shift of Max at which K_yy still had a wrong inertia in the last correct_inner; 0 if none > 0.
  [[nodiscard]] double last_failed_y() const { return failed_y_; }

 private:
  [[nodiscard]] bool raise_for_instability(Regularization& shift);
  [[nodiscard]] double failing_inner_shift(const Regularization& shift);
  [[nodiscard]] double first_shift(double last) const;
  [[nodiscard]] double next_shift(double shift, double last) const;
  [[nodiscard]] double multiplier_shift(double mu) const;

  KktSystem& kkt_;
  const SolverOptions& options_;
  Counts& counts_;
  TimeLimit& limit_;
  bool first_x_failed_ = false;
  double last_x_ = 0.0;
  double last_raised_x_ = 0.0;  ///< of line 7; kept apart, it says nothing about K's own need
  double last_y_ = 0.0;
  double failed_y_ = 0.0;
};

}  // namespace ipminmax
