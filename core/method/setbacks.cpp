#include "core/method/setbacks.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <string_view>

namespace ipminmax {
namespace {

constexpr std::array<std::string_view, 5> kTexts = {
    "no maximum over y in reach", "another branch of y became the higher one",
    "to and fro without progress", "infeasible", "no step acceptable"};
/// Min variables that are shown.
constexpr Index kShown = 3;

}  // namespace

Index Setbacks::total() const { return std::accumulate(counts_.begin(), counts_.end(), Index{0}); }

std::string Setbacks::describe(const CanonicalProblem& canonical, const Eigen::VectorXd& v) const {
  std::string text;
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    if (counts_[k] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(kTexts[k]) + " (" +
            std::to_string(counts_[k]) + (counts_[k] == 1 ? " time)" : " times)");
  }
  const IndexRange x = canonical.x();
  for (Index i = x.begin; i < std::min(x.end, x.begin + kShown); ++i) {
    char value[32];
    std::snprintf(value, sizeof value, "%.4g", v[i] / canonical.variable_scale(i));
    text += (i == x.begin ? ", last at " : ", ") + canonical.column_name(i) + " = " + value;
  }
  return text + (x.size() > kShown ? ", ..." : "");
}

}  // namespace ipminmax
