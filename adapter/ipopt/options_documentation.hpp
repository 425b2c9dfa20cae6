#pragma once

#include <string>
#include <vector>

#include "option_registry.hpp"

/// @file
/// The documentation of all options, made from the tables that also register them.
namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Every option of solver and application, grouped by category.
[[nodiscard]] std::vector<OptionInfo> list_options();

/// All options as plain text: name, range and default on one line, then what it means.
[[nodiscard]] std::string options_text();

/// What an option may be, as "number in (0, inf)".
[[nodiscard]] std::string values_of(const OptionInfo& option);

/// The options that were set, one line each: name, value, and whether it has an effect here.
[[nodiscard]] std::string user_options_text(const OptionsList& list);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
