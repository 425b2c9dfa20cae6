#pragma once

#include <string>
#include <vector>

#include <IpOptionsList.hpp>

#include "ipopt_version.hpp"

/// The documentation of all options, made from the tables that also register them.
namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// One option as its documentation shows it.
struct DocumentedOption {
  struct Value {
    std::string name, text;
  };
  std::string name;
  std::string category;
  std::string type;           ///< "number", "integer", "yes/no", "choice" or "name"
  std::string range;          ///< "(0, inf)"; empty unless a number or an integer
  std::string default_value;  ///< empty when there is none
  std::string text;
  std::vector<Value> values;  ///< of a choice
};

/// Every option of solver and application, grouped by category.
[[nodiscard]] std::vector<DocumentedOption> list_options();

/// All options as plain text: name, range and default on one line, then what it means.
[[nodiscard]] std::string options_text();

/// The same as a Markdown page with a table per category, and what becomes of options that only
/// Ipopt has; docs/options.md is this text.
[[nodiscard]] std::string options_markdown();

/// The options that were set, one line each: name, value, and whether it has an effect here.
[[nodiscard]] std::string user_options_text(const Ipopt::OptionsList& list);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
