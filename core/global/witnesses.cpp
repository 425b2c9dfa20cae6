#include "core/global/witnesses.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/robust_scope.hpp"

namespace ipminmax {
namespace {

/// Numbers that witnesses may take: 80 MB.
constexpr std::size_t kMostKeptNumbers = 10'000'000;
}  // namespace

std::vector<double> max_part(const ProblemStructure& structure, const std::vector<double>& v) {
  std::vector<double> values;
  for (const std::size_t i : variables_of(structure, Player::Max)) values.push_back(v[i]);
  return values;
}

VariableRanges moves_from_start(Problem& model, const std::vector<double>& v) {
  VariableRanges sizes(model.structure());
  sizes.see(v);
  if (const auto start = model_start(model)) sizes.see(*start);
  return sizes;
}

std::string describe_y(const ProblemStructure& s, Index constraint, const std::vector<double>& v) {
  const RobustScope scope = RobustScopes(s).of(constraint);
  std::string text;
  constexpr int kMostNames = 6;
  int said = 0;
  for (const Index i : scope.variables) {
    if (std::ranges::binary_search(scope.dependent, i) ||
        s.variable_lower[at(i)] == s.variable_upper[at(i)]) {
      continue;
    }
    if (said++ == kMostNames) return text + ", ...";
    text += (said > 1 ? ", " : "") + variable_name(s, i) + " = " + number_text(v[at(i)], 6);
  }
  return text;
}

double change_with_x(Problem& model, const std::vector<double>& v, const std::vector<double>& other,
                     double tol) {
  constexpr double kLeastAccurate = 1e-4;  // of x's sizes, where f is small beside the tolerance
  std::vector<double> at_v(v.size()), at_other(v.size());
  if (!model.gradient(v, true, at_v) || !model.gradient(other, true, at_other)) return 0.0;
  const VariableRanges sizes = moves_from_start(model, v);
  for (std::size_t i = 0; i < v.size(); ++i) at_v[i] -= at_other[i];
  const double change =
      change_by_min(model.structure(), at_v, [&](std::size_t i) { return sizes.of(i); });
  // tol is absolute in f: x is as accurate as that allows.
  const double accuracy = std::clamp(tol / change, tol, std::max(tol, kLeastAccurate));
  return change > 0.0 && std::isfinite(change) ? accuracy * change : 0.0;
}

Witnesses::Witnesses(const ProblemStructure& structure)
    : max_variables_(variables_of(structure, Player::Max)),
      most_(kMostKeptNumbers / std::max<std::size_t>(1, max_variables_.size())) {}

void Witnesses::add(std::span<const double> v, List& list) try {
  if (max_variables_.empty() || most_ == 0 || v.size() <= max_variables_.back()) return;
  std::vector<double> y;
  y.reserve(max_variables_.size());
  for (const std::size_t i : max_variables_) y.push_back(v[i]);
  if (all_finite(y)) keep(std::move(y), list);
} catch (const std::bad_alloc&) {  // one witness less
}

void Witnesses::add(const Witnesses& others) try {
  for (const auto& y : others.met_.kept) keep(y, met_);
  for (const auto& y : others.starts_.kept) keep(y, starts_);
} catch (const std::bad_alloc&) {  // some less
}

void Witnesses::keep(std::vector<double> y, List& list) {
  const std::lock_guard lock(mutex_);
  if (list.kept.size() < most_) {
    list.kept.push_back(std::move(y));
  } else {
    list.kept[list.next++ % most_] = std::move(y);
  }
}

}  // namespace ipminmax
