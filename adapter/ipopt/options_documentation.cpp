#include <algorithm>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>
#include <variant>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/log.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/options_documentation.hpp"
#include "core/model/indices.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// text in lines of at most 80 columns, each after the indentation.
std::string wrapped(std::string_view text, std::size_t indentation) {
  const std::string indent(indentation, ' ');
  std::string result, line;
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;) {
    if (!line.empty() && indentation + line.size() + 1 + word.size() > 80)
      result += concat(indent, std::exchange(line, {}), "\n");
    line += (line.empty() ? "" : " ") + word;
  }
  return concat(result, indent, line, "\n");
}

}  // namespace

std::vector<OptionInfo> list_options() {
  const auto own = option_table();
  std::vector<OptionInfo> options(own.begin(), own.end());
  std::ranges::copy(application_option_table(), std::back_inserter(options));
  // Rows of a category need not stand together in the table.
  std::vector<std::string_view> categories;
  for (const OptionInfo& option : options) {
    if (std::ranges::find(categories, option.category) == categories.end()) {
      categories.push_back(option.category);
    }
  }
  std::ranges::stable_sort(options, {}, [&](const OptionInfo& option) {
    return std::ranges::find(categories, option.category) - categories.begin();
  });
  return options;
}

std::string values_of(const OptionInfo& option) {
  const std::string range = range_of(option);
  return type_of(option) + (range.empty() ? "" : " in " + range);
}

std::string options_text() {
  std::string text;
  std::string_view category;
  for (const OptionInfo& option : list_options()) {
    if (option.category != category) {
      category = option.category;
      text += concat("\n### ", category, " ###\n\n");
    }
    const std::string by_default = default_of(option);
    text +=
        log::format("%-31s  %-27s  default %s\n", std::string(option.name).c_str(),
                    values_of(option).c_str(), by_default.empty() ? "none" : by_default.c_str());
    text += wrapped(option.text, 4);
    if (const auto* choice = std::get_if<OptionInfo::Choice>(&option.kind)) {
      for (const auto i : indices(choice->names)) {
        const std::string_view meaning = choice->texts[i];
        text += wrapped(concat(choice->names[i], meaning.empty() ? "" : ": ", meaning), 6);
      }
    }
  }
  return text + "\n";
}

std::string user_options_text(const OptionsList& list) {
  std::string text;
  const auto row = [&](std::string_view name, const std::string& value, const char* used) {
    text += log::format("%-33s %-25s %s\n", std::string(name).c_str(), value.c_str(), used);
  };
  row("Name", "Value", "used");
  for (const OptionInfo& option : list_options()) {
    const auto value = value_of(option, list);
    const bool foreign =
        value && option.name == "linear_solver" && is_ipopt_only_linear_solver(*value);
    if (value) row(option.name, *value, foreign ? "no" : "yes");
  }
  for (const OptionInfo& option : ipopt_only_options()) {
    if (const auto value = value_of(option, list)) row(option.name, *value, "no");
  }
  return text;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
