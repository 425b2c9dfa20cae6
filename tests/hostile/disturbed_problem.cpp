#include <cmath>
#include <limits>

#include <hostile/disturbed_problem.hpp>

namespace ipminmax::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <class T>
T* any_of(Dice& dice, std::vector<T>& items) {
  if (items.empty()) return nullptr;
  return &items[static_cast<std::size_t>(dice.below(static_cast<int>(items.size())))];
}

}  // namespace

DisturbedProblem::DisturbedProblem(Problem& problem, Disturbance disturbance, std::uint64_t seed)
    : ForwardingProblem(problem), structure_(problem.structure()) {
  Dice dice(seed);
  for (std::size_t k = 0; k < structure_.jacobian.size(); ++k) jacobian_parts_.push_back({k, 1.0});
  for (std::size_t k = 0; k < structure_.hessian.size(); ++k) hessian_parts_.push_back({k, 1.0});
  if (disturbance == Disturbance::Repeated) repeat_entries(dice);
  disturbed_ = disturbance == Disturbance::EmptyRow
                   ? empty_row(dice)
                   : !is_wrong(disturbance) || spoil(disturbance, dice);
}

void DisturbedProblem::repeat_entries(Dice& dice) {
  const auto repeat = [&](std::vector<Triplet>& entries, std::vector<Part>& parts, bool mirror) {
    const std::vector<Triplet> all = entries;
    for (std::size_t k = 0; k < all.size(); ++k) {
      entries.push_back(mirror && dice.chance(0.5) ? Triplet{all[k].col, all[k].row} : all[k]);
      parts[k].weight = 2.0;
      parts.push_back({k, -1.0});
    }
    for (std::size_t k = entries.size(); k > 1; --k) {
      const auto other = static_cast<std::size_t>(dice.below(static_cast<int>(k)));
      std::swap(entries[k - 1], entries[other]);
      std::swap(parts[k - 1], parts[other]);
    }
  };
  repeat(structure_.jacobian, jacobian_parts_, false);
  repeat(structure_.hessian, hessian_parts_, true);
}

bool DisturbedProblem::empty_row(Dice& dice) {
  if (structure_.constraint_players.empty()) return false;
  constant_row_ =
      static_cast<Index>(dice.below(static_cast<int>(structure_.constraint_players.size())));
  constant_ = dice.one_of({0.0, 0.0, 0.5, -3.0, 1e6});
  if (dice.chance(0.5)) {  // met, as an equation
    structure_.constraint_lower[static_cast<std::size_t>(constant_row_)] = constant_;
    structure_.constraint_upper[static_cast<std::size_t>(constant_row_)] = constant_;
  }
  std::vector<Triplet> entries;
  std::vector<Part> parts;
  for (std::size_t k = 0; k < structure_.jacobian.size(); ++k) {
    if (structure_.jacobian[k].row == constant_row_) continue;
    entries.push_back(structure_.jacobian[k]);
    parts.push_back(jacobian_parts_[k]);
  }
  structure_.jacobian = std::move(entries);
  jacobian_parts_ = std::move(parts);
  return true;
}

bool DisturbedProblem::spoil(Disturbance disturbance, Dice& dice) {
  ProblemStructure& s = structure_;
  Triplet* entry =
      any_of(dice, disturbance == Disturbance::HessianOutside ? s.hessian : s.jacobian);
  const auto n = static_cast<Index>(s.variable_players.size());
  const auto m = static_cast<Index>(s.constraint_players.size());
  const auto variable = static_cast<std::size_t>(dice.below(n));
  switch (disturbance) {
    case Disturbance::RowOutside:
      if (entry) entry->row = dice.one_of({m, m + 1, std::numeric_limits<Index>::max()});
      return entry != nullptr;
    case Disturbance::ColumnOutside:
    case Disturbance::HessianOutside:
      if (entry) entry->col = dice.one_of({n, n + 7, std::numeric_limits<Index>::max()});
      return entry != nullptr;
    case Disturbance::NegativeIndex:
      if (entry) (dice.chance(0.5) ? entry->row : entry->col) = dice.one_of({-1, -2147483647});
      return entry != nullptr;
    case Disturbance::BoundNaN:
      (dice.chance(0.5) ? s.variable_lower : s.variable_upper)[variable] = kNaN;
      return true;
    case Disturbance::ConstraintBoundNaN:
      if (double* bound =
              any_of(dice, dice.chance(0.5) ? s.constraint_lower : s.constraint_upper)) {
        *bound = kNaN;
        return true;
      }
      return false;
    case Disturbance::CrossedBounds:
      s.variable_lower[variable] = 1.0;
      s.variable_upper[variable] = dice.one_of({0.0, 1.0 - 1e-15, -kInfinity});
      return true;
    case Disturbance::LowerInfinite:
      s.variable_lower[variable] = s.variable_upper[variable] =
          dice.one_of({kInfinity, 1e19, 3e20});
      return true;
    case Disturbance::UpperInfinite:
      s.variable_lower[variable] = s.variable_upper[variable] =
          dice.one_of({-kInfinity, -1e19, -3e20});
      return true;
    case Disturbance::None:
    case Disturbance::Repeated:
    case Disturbance::EmptyRow:
      break;
  }
  return false;
}

bool DisturbedProblem::is_asked_rightly(std::span<const double> numbers) {
  for (const double number : numbers) {
    if (std::isfinite(number)) continue;
    ++calls_not_finite_;
    return false;
  }
  return true;
}

bool DisturbedProblem::is_due() {
  ++calls_;
  return at_ > 0 && (lasting_ ? calls_ >= at_ : calls_ == at_);
}

/// The end of each function.
bool DisturbedProblem::finish(bool good, std::span<double> values) {
  if (!is_due()) return good;
  switch (fault_) {
    case Fault::Fails:
      return false;
    case Fault::NaN:
    case Fault::Infinity:
      if (!values.empty()) values.back() = fault_ == Fault::NaN ? kNaN : -kInfinity;
      return good;
    case Fault::Throws:
      throw std::runtime_error("a fault of the model");
    case Fault::ThrowsNumber:
      throw 7;
    case Fault::ThrowsBadAlloc:
      throw std::bad_alloc();
    case Fault::Stops:
      stopped_ = true;
      break;
  }
  return good;
}

bool DisturbedProblem::objective(std::span<const double> v, bool new_v, double& f) {
  return finish(is_asked_rightly(v) && ForwardingProblem::objective(v, new_v, f), {&f, 1});
}

bool DisturbedProblem::gradient(std::span<const double> v, bool new_v, std::span<double> grad) {
  return finish(is_asked_rightly(v) && ForwardingProblem::gradient(v, new_v, grad), grad);
}

bool DisturbedProblem::constraints(std::span<const double> v, bool new_v, std::span<double> g) {
  const bool good = is_asked_rightly(v) && ForwardingProblem::constraints(v, new_v, g);
  if (constant_row_ >= 0) g[static_cast<std::size_t>(constant_row_)] = constant_;
  return finish(good, g);
}

bool DisturbedProblem::jacobian(std::span<const double> v, bool new_v, std::span<double> values) {
  values_.resize(ForwardingProblem::structure().jacobian.size());
  const bool good = is_asked_rightly(v) && ForwardingProblem::jacobian(v, new_v, values_);
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = jacobian_parts_[k].weight * values_[jacobian_parts_[k].source];
  }
  return finish(good, values);
}

bool DisturbedProblem::hessian(std::span<const double> v, bool new_v, double sigma,
                               std::span<const double> lambda, bool new_lambda,
                               std::span<double> values) {
  values_.resize(ForwardingProblem::structure().hessian.size());
  lambda_.assign(lambda.begin(), lambda.end());
  if (constant_row_ >= 0) lambda_[static_cast<std::size_t>(constant_row_)] = 0.0;
  const bool good = is_asked_rightly(v) && is_asked_rightly(lambda) &&
                    ForwardingProblem::hessian(v, new_v, sigma, lambda_, new_lambda, values_);
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = hessian_parts_[k].weight * values_[hessian_parts_[k].source];
  }
  return finish(good, values);
}

}  // namespace ipminmax::testing
