#include <array>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/spelling.hpp"

namespace ipminmax::inline IPMINMAX_IPOPT_ABI {
namespace {

/// What the list makes of a number: %g, in the C locale of the moment.
double as_listed(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return std::strtod(text.data(), nullptr);
}

}  // namespace

bool ExactOptionsList::SetNumericValue(const std::string& tag, double value, bool allow_clobber,
                                       bool dont_print) {
  touch(tag);
  if (!OptionsList::SetNumericValue(tag, value, allow_clobber, dont_print)) return false;
  // True also where an earlier value that must not be overwritten stays.
  double rounded = 0.0;
  if (OptionsList::GetNumericValue(tag, rounded, "") && rounded == as_listed(value)) {
    exact_[lower_case(tag)] = {value, rounded};
  }
  return true;
}

void ExactOptionsList::touch(const std::string& tag) {
  ++changes_;
  std::string name = lower_case(tag);
  if (std::ranges::find(touched_, name) == touched_.end()) touched_.push_back(std::move(name));
}

bool ExactOptionsList::GetNumericValue(const std::string& tag, double& value,
                                       const std::string& prefix) const {
  if (!OptionsList::GetNumericValue(tag, value, prefix)) return false;
  const auto found = exact_.find(lower_case(prefix + tag));
  if (found != exact_.end() && found->second.rounded == value) value = found->second.value;
  return true;
}

}  // namespace ipminmax::inline IPMINMAX_IPOPT_ABI
