#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/differences/finite_difference_hessian.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Part of the room to a bound that one of up to four steps takes.
constexpr double kRoomUsed = 0.2;
/// Evaluations of a detection: these and one for so many variables.
constexpr Index kFewestEvaluations = 200, kVariablesPerEvaluation = 8;
/// Groups from which on a look at whether the last Hessian still holds costs a tenth of another.
constexpr Index kGroupsOfALook = 15;
/// Shares of the step tried where the model is undefined.
constexpr std::array kShorter{1.0, 0.1, 1e-2, 1e-3};
/// Second derivatives disagree with a slope of first ones beyond so many times the errors that are
/// seen, this share of their own size, and so many roundings.
constexpr double kErrors = 10.0, kShare = 1e-7, kErrorRoundings = 20.0;

/// Each pair once, row >= col.
void make_unique(std::vector<Triplet>& pattern) {
  for (Triplet& entry : pattern) {
    if (entry.row < entry.col) std::swap(entry.row, entry.col);
  }
  std::ranges::sort(pattern, {},
                    [](const Triplet& entry) { return std::pair(entry.row, entry.col); });
  pattern.erase(std::unique(pattern.begin(), pattern.end()), pattern.end());
}

}  // namespace

// --- Pattern -------------------------------------------------------------------------------------

FiniteDifferenceHessian::FiniteDifferenceHessian(Problem& model, const SolverOptions& options,
                                                 const std::vector<Triplet>* known)
    : model_(model),
      source_(model),
      step_(options.minmax_difference_step),
      structure_(model.structure()),
      warm_start_(options.warm_start_init_point) {
  if (!check_indices(structure_).empty()) return;
  const std::size_t n = structure_.variable_lower.size();
  free_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double lower = structure_.variable_lower[i], upper = structure_.variable_upper[i];
    if (!(lower <= upper)) return;
    free_[i] = lower < upper;
  }
  offsets_.resize(n);
  choose_pattern(known);
}

void FiniteDifferenceHessian::choose_pattern(const std::vector<Triplet>* known) {
  const bool given = std::exchange(structure_.has_hessian, true);
  set_pattern(given ? given_pattern() : known != nullptr ? *known : std::vector<Triplet>());
  if (given || known != nullptr || !take_start() || !all_finite(start_->v)) return;
  std::vector<Index> variables(free_.size());
  std::iota(variables.begin(), variables.end(), 0);
  if (structure_.nonlinear_variables) variables = *structure_.nonlinear_variables;
  std::erase_if(variables,
                [&](Index i) { return i < 0 || at(i) >= free_.size() || !free_[at(i)]; });
  sort_each_once(variables);
  PointSampler sampler(structure_, start_->v);
  const Index most =
      static_cast<Index>(free_.size()) / kVariablesPerEvaluation + kFewestEvaluations;
  set_pattern(detect_hessian_pattern(structure_, source_, sampler, variables, most));
  moved_ = true;
  verify_detection(start_->v, most);
}

std::vector<Triplet> FiniteDifferenceHessian::given_pattern() const {
  std::vector<Triplet> pattern = structure_.hessian;
  std::erase_if(pattern, [&](const Triplet& entry) {
    return !free_[at(entry.row)] || !free_[at(entry.col)];
  });
  make_unique(pattern);
  return pattern;
}

void FiniteDifferenceHessian::set_pattern(std::vector<Triplet> pattern) {
  structure_.hessian = std::move(pattern);
  kept_.clear();
  coloring_ = color_hessian(structure_.hessian, static_cast<Index>(free_.size()));
  for (auto& group : coloring_.groups) {
    std::ranges::stable_sort(group.entries, {}, &HessianColoring::Entry::col);
  }
}

/// At up to three points, as many as most evaluations in all allow: the certificate looks again.
void FiniteDifferenceHessian::verify_detection(std::span<const double> start, Index most) {
  // Each round ends with a pattern that has passed at fresh points, or one that has grown; rows
  // that disagree with nothing left to fill are not a matter of sparsity.
  PointSampler sampler(structure_, start);
  std::uniform_real_distribution<double> multiplier(0.5, 1.5);
  std::vector<double> point, values, errors;
  FirstDerivatives unused;
  constexpr int kPoints = 3;
  for (int passed = 0; passed < kPoints;) {
    constexpr Index kPerGroup = 4;  // two lengths, to both sides
    if (source_.gradients() + kPerGroup * groups() > most) return;
    if (!sampler.sample_defined(source_, point, unused)) return;
    std::vector<double> lambda(structure_.constraint_lower.size());
    for (double& value : lambda) value = multiplier(random_);
    const Multipliers multipliers{multiplier(random_), lambda};
    ++passed;
    if (!values_with_errors(point, multipliers, values, errors)) continue;
    const auto rows = disagreeing_rows(point, multipliers, values, errors, kShare);
    if (rows && !rows->empty() && fill(*rows)) passed = 0;
  }
}

bool FiniteDifferenceHessian::fill(const std::vector<Index>& rows) {
  // So many rows disagree only where differences fail altogether, as with noise.
  constexpr std::size_t kMostRows = 5000;
  if (rows.size() > kMostRows) return false;
  std::vector<Triplet> pattern = structure_.hessian;
  for (const Index i : rows) {
    for (const Index j : rows) {
      if (i >= j) pattern.push_back({i, j});
    }
  }
  make_unique(pattern);
  if (pattern.size() == structure_.hessian.size()) return false;
  set_pattern(std::move(pattern));
  return true;
}

bool FiniteDifferenceHessian::widen() {
  sort_each_once(missing_);
  return fill(std::exchange(missing_, {}));
}

// --- The model, passed on ------------------------------------------------------------------------

bool FiniteDifferenceHessian::take_start() {
  const std::vector<double> of_variables(structure_.variable_lower.size(), 0.0);
  Start start{of_variables, std::vector<double>(structure_.constraint_lower.size(), 0.0),
              of_variables, of_variables};
  StartingPoint request{start.v, warm_start_, start.lambda, start.z_lower, start.z_upper};
  if (!model_.starting_point(request)) return false;
  start_ = std::move(start);
  return true;
}

bool FiniteDifferenceHessian::starting_point(StartingPoint& start) {
  if (!start_ && !take_start()) return false;  // the model is asked once
  std::ranges::copy(start_->v, start.v.begin());
  std::ranges::copy(start_->lambda, start.lambda.begin());
  std::ranges::copy(start_->z_lower, start.z_lower.begin());
  std::ranges::copy(start_->z_upper, start.z_upper.begin());
  return true;
}

/// Whether the model has to be told of a new point: differences may have been taken in between.
bool FiniteDifferenceHessian::new_point(bool new_v) {
  return std::exchange(moved_, false) || new_v;
}

bool FiniteDifferenceHessian::objective(std::span<const double> v, bool new_v, double& f) {
  return model_.objective(v, new_point(new_v), f);
}

bool FiniteDifferenceHessian::constraints(std::span<const double> v, bool new_v,
                                          std::span<double> g) {
  return model_.constraints(v, new_point(new_v), g);
}

void FiniteDifferenceHessian::move_base(std::span<const double> v) {
  if (std::ranges::equal(v, base_v_)) return;
  base_gradient_ = base_jacobian_ = false;
  base_v_.assign(v.begin(), v.end());
}

bool FiniteDifferenceHessian::gradient(std::span<const double> v, bool new_v,
                                       std::span<double> grad) {
  if (!model_.gradient(v, new_point(new_v), grad)) return false;
  move_base(v);
  base_.gradient.assign(grad.begin(), grad.end());
  base_gradient_ = true;
  return true;
}

bool FiniteDifferenceHessian::jacobian(std::span<const double> v, bool new_v,
                                       std::span<double> values) {
  if (!model_.jacobian(v, new_point(new_v), values)) return false;
  move_base(v);
  base_.jacobian.assign(values.begin(), values.end());
  base_jacobian_ = true;
  return true;
}

// --- Differences ---------------------------------------------------------------------------------

/// Leaves the first derivatives at v that count in base_, evaluating only what the last calls did
/// not.
bool FiniteDifferenceHessian::load_base(std::span<const double> v, const Multipliers& multipliers) {
  move_base(v);
  const bool gradient = multipliers.sigma != 0.0 && !base_gradient_;
  const bool jacobian = multipliers.weigh_any_row() && !base_jacobian_;
  if (!gradient && !jacobian) return true;
  moved_ = true;
  if (!source_.evaluate(v, base_, gradient, jacobian)) {
    base_gradient_ = base_jacobian_ = false;
    return false;
  }
  base_gradient_ |= gradient;
  base_jacobian_ |= jacobian;
  return true;
}

double FiniteDifferenceHessian::length_at(std::size_t i, double v) const {
  return length_of(v, start_ ? start_->v[i] : 0.0, structure_.variable_lower[i],
                   structure_.variable_upper[i]);
}

FiniteDifferenceHessian::Offsets FiniteDifferenceHessian::offsets(std::size_t i, double v,
                                                                  double scale, Side side) const {
  const double largest = step_ * length_at(i, v);
  const double up = std::max(structure_.variable_upper[i] - v, 0.0);
  const double down = std::max(v - structure_.variable_lower[i], 0.0);
  double first = largest * scale;
  double second = -first;
  if (side != Side::Best || std::min(up, down) < largest) {
    const bool upwards = side == Side::Best ? up >= down : side == Side::Up;
    const double length = std::min(largest, kRoomUsed * (upwards ? up : down)) * scale;
    first = upwards ? length : -length;
    second = 2.0 * first;
  }
  const auto rounded = [v](double offset) {
    const volatile double moved = v + offset;
    return moved - v;
  };
  return {rounded(first), rounded(second)};
}

/// change = sigma (grad f - base) + (J - base)' lambda at trial_, so that what does not vary
/// cancels exactly; magnitude_ = the sizes of the terms that do, for their rounding errors. False:
/// undefined.
bool FiniteDifferenceHessian::find_change(const Multipliers& multipliers,
                                          std::vector<double>& change) {
  moved_ = true;
  if (!source_.evaluate(trial_, ahead_, multipliers.sigma != 0.0, multipliers.weigh_any_row())) {
    return false;
  }
  change.assign(free_.size(), 0.0);
  const auto add = [&](std::size_t i, double weight, double value, double base) {
    if (value == base) return;
    change[i] += weight * (value - base);
    magnitude_[i] += std::abs(weight) * std::max(std::abs(value), std::abs(base));
  };
  if (multipliers.sigma != 0.0) {
    for (const auto i : indices(change)) {
      add(i, multipliers.sigma, ahead_.gradient[i], base_.gradient[i]);
    }
  }
  for (const auto k : indices(structure_.jacobian)) {
    const auto [row, col] = structure_.jacobian[k];
    const double weight = multipliers.lambda[at(row)];
    if (weight != 0.0) add(at(col), weight, ahead_.jacobian[k], base_.jacobian[k]);
  }
  return true;
}

bool FiniteDifferenceHessian::difference(std::span<const Index> variables,
                                         std::span<const HessianColoring::Entry> entries,
                                         double scale, Side side, std::span<const double> v,
                                         const Multipliers& multipliers, std::span<double> values,
                                         std::span<double> rounding) {
  for (const Index j : variables) {
    offsets_[at(j)] = offsets(at(j), v[at(j)], scale, side);
    const auto [a, b] = offsets_[at(j)];
    if (a == 0.0 || b == 0.0 || a == b) return false;
  }
  magnitude_.assign(v.size(), 0.0);
  trial_.assign(v.begin(), v.end());
  for (const auto& [offset, change] :
       {std::pair{&Offsets::first, &first_}, std::pair{&Offsets::second, &second_}}) {
    for (const Index j : variables) trial_[at(j)] = v[at(j)] + offsets_[at(j)].*offset;
    if (!find_change(multipliers, *change)) return false;
  }
  for (const auto& entry : entries) {
    // Slope at 0 of the parabola through (0, 0), (a, first), (b, second).
    const auto [a, b] = offsets_[at(entry.col)];
    const double weight_first = b / a / (b - a);
    const double weight_second = -a / b / (b - a);
    const auto i = at(entry.row);
    values[at(entry.position)] = weight_first * first_[i] + weight_second * second_[i];
    if (!rounding.empty()) {
      rounding[at(entry.position)] =
          kEpsilon * magnitude_[i] * (std::abs(weight_first) + std::abs(weight_second));
    }
  }
  return true;
}

/// One variable, to any side and with ever smaller steps.
bool FiniteDifferenceHessian::difference_alone(std::span<const HessianColoring::Entry> entries,
                                               double scale, std::span<const double> v,
                                               const Multipliers& multipliers,
                                               std::span<double> values,
                                               std::span<double> rounding) {
  const std::array<Index, 1> variable{entries.front().col};
  for (const double shrink : kShorter) {
    for (const Side side : {Side::Best, Side::Up, Side::Down}) {
      if (difference(variable, entries, scale * shrink, side, v, multipliers, values, rounding)) {
        return true;
      }
    }
  }
  return false;
}

bool FiniteDifferenceHessian::differences(std::span<const double> v, const Multipliers& multipliers,
                                          double scale, std::span<double> values,
                                          std::span<double> rounding) {
  if (!load_base(v, multipliers)) return false;
  for (const auto& group : coloring_.groups) {
    if (difference(group.variables, group.entries, scale, Side::Best, v, multipliers, values,
                   rounding)) {
      continue;
    }
    const std::span<const HessianColoring::Entry> entries(group.entries);
    for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
      while (end < entries.size() && entries[end].col == entries[begin].col) ++end;
      if (!difference_alone(entries.subspan(begin, end - begin), scale, v, multipliers, values,
                            rounding)) {
        return false;
      }
    }
  }
  return true;
}

bool FiniteDifferenceHessian::hessian(std::span<const double> v, bool, double sigma,
                                      std::span<const double> lambda, bool,
                                      std::span<double> values) {
  const Multipliers multipliers{sigma, lambda};
  if (groups() < kGroupsOfALook) return differences(v, multipliers, 1.0, values, {});
  std::optional<std::vector<Index>> changed;
  if (!kept_.empty()) changed = disagreeing_rows(v, multipliers, kept_, kept_rounding_, 0.0);
  if (!changed || !changed->empty()) {
    kept_.clear();
    kept_rounding_.resize(values.size());
    if (!differences(v, multipliers, 1.0, values, kept_rounding_)) return false;
    kept_.assign(values.begin(), values.end());
  }
  std::ranges::copy(kept_, values.begin());
  kept_v_.assign(v.begin(), v.end());
  return true;
}

// --- Errors --------------------------------------------------------------------------------------

bool FiniteDifferenceHessian::values_with_errors(std::span<const double> v,
                                                 const Multipliers& multipliers,
                                                 std::vector<double>& values,
                                                 std::vector<double>& errors) {
  // Differences with an eighth of the step have hardly any error of second order, but eight times
  // the noise: the comparison shows both, and rounding at least is known.
  constexpr double kFine = 0.125;
  values.resize(structure_.hessian.size());
  errors.resize(values.size());
  std::vector<double> fine(values.size());
  if (!differences(v, multipliers, kFine, fine, {}) ||
      !differences(v, multipliers, 1.0, values, errors)) {
    return false;
  }
  for (const auto k : indices(values)) {
    errors[k] = 2.0 * (std::abs(values[k] - fine[k]) + errors[k]);
  }
  return true;
}

std::optional<std::vector<Index>> FiniteDifferenceHessian::disagreeing_rows(
    std::span<const double> v, const Multipliers& multipliers, std::span<const double> values,
    std::span<const double> errors, double share) {
  if (!load_base(v, multipliers)) return std::nullopt;
  std::uniform_real_distribution<double> part(0.5, 1.0);
  std::vector<double> direction(v.size(), 0.0);
  bool defined = false;
  for (const double scale : kShorter) {
    for (const auto i : indices(v)) {
      if (!free_[i]) continue;
      const bool up = structure_.variable_upper[i] - v[i] >= v[i] - structure_.variable_lower[i];
      direction[i] = part(random_) * offsets(i, v[i], scale, up ? Side::Up : Side::Down).first;
    }
    magnitude_.assign(v.size(), 0.0);
    defined = true;
    for (const auto& [length, change] :
         {std::pair{1.0, &first_}, std::pair{2.0, &second_}, std::pair{4.0, &third_}}) {
      trial_.assign(v.begin(), v.end());
      for (const auto i : indices(v)) trial_[i] += length * direction[i];
      defined = defined && find_change(multipliers, *change);
    }
    if (defined) break;
  }
  if (!defined) return std::nullopt;

  std::vector<double> product(v.size(), 0.0), size(v.size(), 0.0), error(v.size(), 0.0);
  for (const auto k : indices(values)) {
    const auto add = [&](Index row, Index col) {
      const double d = direction[at(col)];
      product[at(row)] += values[k] * d;
      size[at(row)] += std::abs(values[k] * d);
      error[at(row)] += errors[k] * std::abs(d);
    };
    const auto [row, col] = structure_.hessian[k];
    add(row, col);
    if (row != col) add(col, row);
  }
  std::vector<Index> rows;
  for (const auto i : indices(v)) {
    if (!free_[i]) continue;
    // Slopes at 0 from two pairs of points; their errors of second order are as 1 to 4.
    const double fine = 2.0 * first_[i] - 0.5 * second_[i];
    const double coarse = second_[i] - 0.25 * third_[i];
    const double slope = (4.0 * fine - coarse) / 3.0;
    const double allowed = kErrors * (std::abs(fine - coarse) + error[i]) + share * size[i] +
                           kErrorRoundings * kEpsilon * magnitude_[i];
    if (!(std::abs(product[i] - slope) <= allowed)) rows.push_back(static_cast<Index>(i));
  }
  return rows;
}

bool FiniteDifferenceHessian::hessian_errors(std::span<const double> v, double sigma,
                                             std::span<const double> lambda,
                                             std::span<double> row_errors) {
  const Multipliers multipliers{sigma, lambda};
  std::vector<double> values, errors;
  std::ranges::fill(row_errors, kInfinity);
  if (!values_with_errors(v, multipliers, values, errors)) return true;
  const auto rows = disagreeing_rows(v, multipliers, values, errors, kShare);
  if (!rows) return true;
  std::ranges::fill(row_errors, 0.0);
  if (!kept_.empty() && std::ranges::equal(v, kept_v_)) {  // what was returned may be of before
    for (const auto k : indices(errors)) errors[k] += std::abs(kept_[k] - values[k]);
  }
  for (const auto k : indices(errors)) {
    const auto [row, col] = structure_.hessian[k];
    row_errors[at(row)] += errors[k];
    if (row != col) row_errors[at(col)] += errors[k];
  }
  for (const Index i : *rows) row_errors[at(i)] = kInfinity;
  missing_.insert(missing_.end(), rows->begin(), rows->end());
  return true;
}

}  // namespace ipminmax
