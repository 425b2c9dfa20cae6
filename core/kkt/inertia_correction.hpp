#pragma once

#include <optional>

#include "core/iteration.hpp"
#include "core/kkt/system.hpp"
#include "core/options.hpp"

namespace ipminmax {

/// The shifts last used, from which the next ones are guessed.
struct ShiftMemory {
  bool first_x_failed = false;  ///< the last first guess of delta_x was too small
  double x = 0.0;
  double raised_x = 0.0;  ///< of line 7; kept apart, it says nothing about K's own need
  double y = 0.0;
  /// What K_yy and K needed when they were right last: the models that count as unshifted.
  struct Singular {
    bool flat = false;       ///< a proximal term
    bool dependent = false;  ///< a shift of the multipliers' rows
  } inner{}, full{};
};

/// Chooses the shifts of the KKT matrices: the paper's (ConsLQAC) and line 7 of Algorithm 1.
///
/// First (delta_y, delta_ly) grow until K_yy has the expected inertia, then (delta_x, delta_lx)
/// until K has; x-values do not enter K_yy, so the inner answer stands. Both start at zero, then
/// at a fraction of the last shift used (Ipopt's rule) or, with cold shifts, at
/// first_hessian_perturbation as in the paper. Deterministic.
class InertiaCorrection {
 public:
  /// certainty: of the inertias.
  InertiaCorrection(KktSystem& kkt, const SolverOptions& options, Counts& counts,
                    Certainty certainty = Certainty::Usual)
      : kkt_(kkt), options_(options), counts_(counts), certainty_(certainty) {}

  /// Leaves K factorized with the returned shifts and K_yy with its part of them. Empty: no shift
  /// up to max_hessian_perturbation gave the inertias, or the time limit is exceeded.
  [[nodiscard]] std::optional<Regularization> correct(double mu);

  /// K_yy alone. at: where it was assembled, for shifts to begin as factorize_unshifted; or null.
  [[nodiscard]] bool correct_inner(double mu, Regularization& shift,
                                   const Evaluation* at = nullptr);
  /// K, given shifts that are right for K_yy. at: where it was assembled, as above; or null.
  /// zero_fails: the inertia without shift is known to be wrong already.
  [[nodiscard]] bool correct_full(double mu, Regularization& shift, const Evaluation* at = nullptr,
                                  bool zero_fails = false);

  /// K or K_yy, assembled there, without shift or, where it is only singular, with what that takes:
  /// a proximal term of its player for flat directions, a shift of the multipliers' rows for
  /// dependent ones. shift: of the other player on entry, right for K_yy.
  [[nodiscard]] KktFactors factorize_unshifted(KktPart which, double mu, const Evaluation& at,
                                               Regularization& shift);

  /// The last shifts, to be taken up by the next solve.
  [[nodiscard]] const ShiftMemory& memory() const { return last_; }
  void remember(const ShiftMemory& memory) { last_ = memory; }

  /// Forgets all that earlier corrections have shown.
  void begin_anew() {
    last_ = {};
    failed_y_ = 0.0;
    findings_ = {};
    dependent_x_ = 0;
    stuck_ = {};
  }

  /// Of the last correct.
  [[nodiscard]] const ShiftFindings& findings() const { return findings_; }

 private:
  [[nodiscard]] KktFactors factorize(Regularization shift) {
    if (shifts_slacks()) shift.slacks = shift.x;
    return kkt_.factorize(shift, certainty_);
  }
  /// Those of a minimization are, as in Ipopt; else, as in the paper, x alone.
  [[nodiscard]] bool shifts_slacks() const {
    return kkt_.layout().y.size() == 0 && options_.minmax_globalization == Globalization::Filter;
  }
  [[nodiscard]] KktFactors factorize_inner(const Regularization& shift) {
    return kkt_.factorize_inner(shift, certainty_);
  }
  [[nodiscard]] bool is_right(const Regularization& shift) {
    return kkt_.has_expected_inertia(factorize(shift));
  }
  [[nodiscard]] bool is_right_inner(const Regularization& shift) {
    return kkt_.has_expected_inner_inertia(factorize_inner(shift));
  }
  [[nodiscard]] bool raise_for_instability(Regularization& shift);
  [[nodiscard]] double failing_inner_shift(const Regularization& shift);
  /// Until K + fraction E has a wrong inertia.
  void grow_until_wrong(double fraction, Regularization& shift);
  /// Whether factorizations may be saved that Algorithm 1 spends.
  [[nodiscard]] bool economical() const;
  [[nodiscard]] double first_shift(double last) const;
  /// Zero: the first one.
  [[nodiscard]] double next_shift(double shift, double last) const;
  [[nodiscard]] double multiplier_shift(double mu) const;
  /// The same for the rows of lambda_x in a correction that needs it.
  [[nodiscard]] double outer_multiplier_shift(double mu);

  KktSystem& kkt_;
  const SolverOptions& options_;
  Counts& counts_;
  Certainty certainty_;
  ShiftMemory last_;
  double failed_y_ = 0.0;
  ShiftFindings findings_;
  Index dependent_x_ = 0;  ///< corrections in a row: K had zero eigenvalues until delta_l came
  /// Corrections of a minimization at one mu that needed a shift of the multipliers' rows.
  struct Stuck {
    double mu = 0.0;
    Index corrections = 0;
    bool small_share = false;
  } stuck_;
};

}  // namespace ipminmax
