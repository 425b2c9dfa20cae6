#include <algorithm>
#include <cmath>

#include "core/kkt/inertia_correction.hpp"
#include "core/model/parameters.hpp"

namespace ipminmax {
namespace {

/// Curvature below which K_yy counts as merely singular: line 7's theorem does not apply there.
/// That share of a variable's own curvature is its proximal term.
constexpr double kSingularShift = 1e-7;
/// A minimization whose corrections in a row at one mu all shift the multipliers' rows, this many
/// [R], goes on with a share of that shift, and back. Where s / z of inequalities that leave each
/// other no room is smaller than all of it, it keeps their multipliers from moving; a share may be
/// too small for the accuracy of a Jacobian that has dependent rows.
constexpr Index kStuckCorrections = 12;
/// Shifts after which missing eigenvalues are those of dependent rows.
constexpr int kRaisesInVain = 4;
/// Zero does not grow when multiplied, and a denormal number may not. Objectives may be scaled by
/// 1e-20: what is far less than the rounding of curvature then is no shift, and takes as long to
/// grow.
constexpr double kLeastShift = 1e-50;

std::optional<Inertia> inertia_of(const Factorization& f) {
  const bool counted =
      f.status == FactorizationStatus::Ok || f.status == FactorizationStatus::Singular;
  return counted ? std::optional(f.inertia) : std::nullopt;
}

}  // namespace

bool InertiaCorrection::economical() const {
  return options_.minmax_warm_start_shifts &&
         options_.minmax_globalization == Globalization::Filter;
}

double InertiaCorrection::first_shift(double last) const {
  if (!options_.minmax_warm_start_shifts || last == 0.0) return options_.first_hessian_perturbation;
  return std::max(
      {options_.min_hessian_perturbation, options_.perturb_dec_fact * last, kLeastShift});
}

double InertiaCorrection::next_shift(double shift, double last) const {
  if (shift == 0.0) return first_shift(last);
  // The very first shift of a solve is far from known, so it grows faster.
  const bool unknown = options_.minmax_warm_start_shifts && last == 0.0;
  return std::max(shift * (unknown ? options_.perturb_inc_fact_first : options_.perturb_inc_fact),
                  kLeastShift);
}

double InertiaCorrection::multiplier_shift(double mu) const {
  return options_.jacobian_regularization_value *
         std::pow(mu, options_.jacobian_regularization_exponent);
}

double InertiaCorrection::outer_multiplier_shift(double mu) {
  if (kkt_.layout().y.size() > 0) return multiplier_shift(mu);
  if (mu != stuck_.mu) stuck_ = {.mu = mu, .small_share = stuck_.small_share};
  if (++stuck_.corrections > kStuckCorrections) {
    stuck_ = {.mu = mu, .corrections = 1, .small_share = !stuck_.small_share};
  }
  constexpr double kShare = 1e-4;
  return (stuck_.small_share ? kShare : 1.0) * multiplier_shift(mu);
}

KktFactors InertiaCorrection::factorize_unshifted(KktPart which, double mu, const Evaluation& at,
                                                  Regularization& shift) {
  const bool inner = which == KktPart::Inner;
  const KktLayout& layout = kkt_.layout();
  const IndexRange variables = inner ? layout.y : layout.x;
  // A set of inequalities without interior has multipliers that grow, which tells.
  const bool has_equations =
      inner ? layout.lambda_y.size() > layout.y_slacks : layout.lambda_x.size() > layout.x_slacks;
  ShiftMemory::Singular& last = inner ? last_.inner : last_.full;
  for (ShiftMemory::Singular needed = last;;) {
    Regularization tried = shift;
    const auto proximal = [&] { return kkt_.proximal_curvature(at, kSingularShift); };
    if (needed.flat) (inner ? tried.proximal_y : tried.proximal_x) = proximal();
    if (needed.dependent) (inner ? tried.lambda_y : tried.lambda_x) = multiplier_shift(mu);
    const KktFactors found = inner ? factorize_inner(tried) : factorize(tried);
    const bool right =
        inner ? kkt_.has_expected_inner_inertia(found) : kkt_.has_expected_inertia(found);
    if (right) {
      last = needed;
      shift = tried;
      return found;
    }
    // Eigenvalues missing of the sign of the multipliers' rows, or of that of the variables.
    const Inertia& expected = inner ? layout.expected_inner() : layout.expected();
    const bool rows_lack = inner ? found.inertia.positive < expected.positive
                                 : found.inertia.negative < expected.negative;
    if (rows_lack && has_equations && !needed.dependent && multiplier_shift(mu) > 0.0) {
      needed.dependent = true;
    } else if (!needed.flat && variables.size() > 0 &&
               found.smallest_pivot <= part(*proximal(), variables).maxCoeff()) {
      needed.flat = true;  // of a matrix that is singular a pivot vanishes
    } else {
      return found;
    }
  }
}

bool InertiaCorrection::correct_inner(double mu, Regularization& shift, const Evaluation* at) {
  failed_y_ = 0.0;
  // They are known to depend on each other then, as in Ipopt.
  if (economical() && last_.inner.dependent) shift.lambda_y = multiplier_shift(mu);
  std::optional<KktSystem::Counting> search;
  for (int raises = 0;; ++raises) {
    const Factorization f = shift.y == 0.0 && at
                                ? factorize_unshifted(KktPart::Inner, mu, *at, shift)
                                : factorize_inner(shift);
    if (shift.y == 0.0) findings_.inner_at_zero = inertia_of(f);
    if (kkt_.has_expected_inner_inertia(f)) break;
    if (f.status == FactorizationStatus::OutOfMemory || kkt_.is_over()) return false;
    if (raises == 0) search.emplace(kkt_, FactorizationCause::Shifts);
    // Zero eigenvalues, or positive ones missing whatever the shift: J_yy may be rank-deficient.
    const bool dependent =
        f.inertia.zero > 0 ||
        (raises >= kRaisesInVain && f.inertia.positive < kkt_.layout().lambda_y.size());
    if (dependent && shift.lambda_y == 0.0 && multiplier_shift(mu) > 0.0 &&
        kkt_.layout().lambda_y.size() > 0) {
      shift.lambda_y = multiplier_shift(mu);
      continue;
    }
    failed_y_ = shift.y;
    shift.y = next_shift(shift.y, last_.y);
    if (shift.y > options_.max_hessian_perturbation) return false;
  }
  if (shift.y > 0.0) last_.y = shift.y;
  return true;
}

bool InertiaCorrection::correct_full(double mu, Regularization& shift, const Evaluation* at,
                                     bool zero_fails) {
  // Where the last first guess was too small, zero is not worth a factorization; minimizations try
  // it all the same, as Ipopt does.
  const double first = first_shift(last_.x);
  const bool sparing = economical() && kkt_.layout().y.size() > 0;
  if (zero_fails || (sparing && last_.first_x_failed && shift.x == 0.0)) shift.x = first;
  constexpr int kTimesDependent = 3;
  if (economical() && dependent_x_ >= kTimesDependent) shift.lambda_x = outer_multiplier_shift(mu);
  std::optional<KktSystem::Counting> search;
  for (int raises = 0;; ++raises) {
    Factorization f = at && raises == 0 && shift.x == 0.0 && shift.y == 0.0
                          ? factorize_unshifted(KktPart::Full, mu, *at, shift)
                          : factorize(shift);
    if (shift.x == 0.0 && shift.y == 0.0) findings_.full_at_zero = inertia_of(f);
    if (kkt_.has_expected_inertia(f)) break;
    if (raises == 0) {
      f = kkt_.make_certain();
      if (kkt_.has_expected_inertia(f)) break;
    }
    if (f.status == FactorizationStatus::OutOfMemory || kkt_.is_over()) return false;
    if (raises == 0) search.emplace(kkt_, FactorizationCause::Shifts);
    const bool dependent =
        f.inertia.zero > 0 ||
        (raises >= kRaisesInVain && f.inertia.negative < kkt_.layout().expected().negative);
    if (dependent && shift.lambda_x == 0.0 && multiplier_shift(mu) > 0.0 &&
        kkt_.layout().lambda_x.size() > 0) {
      shift.lambda_x = outer_multiplier_shift(mu);
      dependent_x_ += f.inertia.zero > 0 ? 1 : 0;
      continue;
    }
    const bool is_share = shift.lambda_x > 0.0 && shift.lambda_x < multiplier_shift(mu);
    // Inequalities may need the share.
    const bool at_once = raises == 0 && kkt_.layout().x_slacks == 0;
    if (is_share && (at_once || raises >= kRaisesInVain)) {
      Regularization whole = shift;
      whole.x = 0.0;
      whole.lambda_x = multiplier_shift(mu);
      if (!at_once || is_right(whole)) {  // the share is too small for these rows
        shift = whole;
        stuck_.small_share = false;
        continue;
      }
    }
    shift.x = next_shift(shift.x, last_.x);
    if (shift.x > options_.max_hessian_perturbation) return false;
  }
  last_.first_x_failed = shift.x > first;
  if (sparing && last_.x == 0.0 && shift.x > first) {
    const KktSystem::Counting counting(kkt_, FactorizationCause::Shifts);
    // The first shift of a solve grew in large strides: try half of the last one (of its
    // logarithm).
    Regularization smaller = shift;
    smaller.x /= std::sqrt(options_.perturb_inc_fact_first);
    if (is_right(smaller))
      shift = smaller;
    else if (!is_right(shift))
      return false;
  }
  if (shift.x > 0.0) last_.x = shift.x;
  if (shift.lambda_x == 0.0) dependent_x_ = 0;
  return true;
}

std::optional<Regularization> InertiaCorrection::correct(double mu) {
  Regularization shift;
  findings_ = {};
  if (!correct_inner(mu, shift)) return std::nullopt;
  // The right inertia of K at zero shift although K_yy's is wrong: the case of line 7.
  bool instability = false;
  if (options_.minmax_instability && shift.y > 0.0 && kkt_.layout().x.size() > 0) {
    Regularization none;
    none.lambda_x = shift.lambda_x;
    none.lambda_y = shift.lambda_y;
    const KktSystem::Counting counting(kkt_, FactorizationCause::Shifts);
    const Factorization f = factorize(none);
    findings_.full_at_zero = inertia_of(f);
    instability = kkt_.has_expected_inertia(f);
  }
  if (!correct_full(mu, shift)) return std::nullopt;
  if (instability && !raise_for_instability(shift)) return std::nullopt;
  findings_.inner = kkt_.layout().expected_inner();
  findings_.full = kkt_.layout().expected();
  return shift;
}

double InertiaCorrection::failing_inner_shift(const Regularization& shift) {
  if (failed_y_ > 0.0) return failed_y_;
  // Accepted at the first attempt: look below for a shift that fails.
  Regularization trial = shift;
  for (trial.y = shift.y / options_.perturb_inc_fact; trial.y > kSingularShift;
       trial.y /= options_.perturb_inc_fact) {
    if (kkt_.is_over()) break;
    if (!is_right_inner(trial)) return trial.y;
  }
  return 0.0;
}

void InertiaCorrection::grow_until_wrong(double fraction, Regularization& shift) {
  while (!kkt_.is_over()) {
    Regularization scaled = shift;
    scaled.x *= fraction;
    scaled.y *= fraction;
    if (!is_right(scaled)) return;
    const double raised = std::max(
        next_shift(shift.x, shift.x == 0.0 ? last_.x : 1.0),
        options_.minmax_warm_start_shifts ? options_.perturb_dec_fact * last_.raised_x : 0.0);
    if (raised > parameters::kRunaway) break;  // by rounding
    shift.x = raised;
  }
}

bool InertiaCorrection::raise_for_instability(Regularization& shift) {
  // Some mu in (0,1) with In(K + mu E) wrong. mu = failed / accepted delta_y lies below the largest
  // mu at which K_yy(mu) is singular, so a large delta_x makes K's inertia wrong there (proof of
  // the paper's Theorem "Stability and instability of modified Newton's method").
  const KktSystem::Counting counting(kkt_, FactorizationCause::Shifts);
  const double failed = failing_inner_shift(shift);
  if (failed <= kSingularShift) {
    Regularization singular = shift;
    singular.y = kSingularShift;
    if (is_right_inner(singular)) return is_right_inner(shift) && is_right(shift);
  }
  const double fraction = std::max(failed, kSingularShift) / shift.y;
  const double accepted_x = shift.x;
  findings_.line7_mu = fraction;
  grow_until_wrong(fraction, shift);
  if (shift.x > accepted_x) {
    ++counts_.instability_raises;
    last_.raised_x = shift.x;
  }
  // Larger delta_x keeps K's inertia in exact arithmetic; where rounding disagrees, do without.
  if (!is_right(shift)) {
    shift.x = accepted_x;
    if (!is_right(shift)) return false;
  }
  return is_right_inner(shift);
}

}  // namespace ipminmax
