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

/// The same as a Markdown page with a table per category, and what becomes of options that only
/// Ipopt has; docs/options.md is this text.
[[nodiscard]] std::string options_markdown();

/// The options that were set, one line each: name, value, and whether it has an effect here.
[[nodiscard]] std::string user_options_text(const OptionsList& list);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
