#include <algorithm>

#include "core/kkt/layout.hpp"

namespace ipminmax {

KktLayout::KktLayout(const CanonicalProblem& canonical)
    : x_slacks(canonical.x_slacks().size()), y_slacks(canonical.y_slacks().size()) {
  x = {0, canonical.x().size()};
  y = {x.end, x.end + canonical.y().size()};
  lambda_x = {y.end, y.end + canonical.min_constraints().size()};
  lambda_y = {lambda_x.end, lambda_x.end + canonical.max_constraints().size()};
}

Inertia KktLayout::expected() const {
  return {x.size() + x_slacks + lambda_y.size(), y.size() + y_slacks + lambda_x.size(), 0};
}

Inertia KktLayout::expected_inner() const { return {lambda_y.size(), y.size() + y_slacks, 0}; }

Inertia KktLayout::with_slacks(Inertia reduced) const {
  return {reduced.positive + x_slacks, reduced.negative + y_slacks, reduced.zero};
}

Inertia KktLayout::with_slacks_inner(Inertia reduced) const {
  return {reduced.positive, reduced.negative + y_slacks, reduced.zero};
}

std::vector<std::int8_t> KktLayout::signs() const {
  std::vector<std::int8_t> signs(at(dimension()));
  const auto set = [&](IndexRange range, std::int8_t sign) {
    std::fill(signs.begin() + range.begin, signs.begin() + range.end, sign);
  };
  set(x, 1);
  set(y, -1);
  set(lambda_x, -1);
  set(lambda_y, 1);
  return signs;
}

}  // namespace ipminmax
