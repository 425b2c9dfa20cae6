#include <algorithm>
#include <iterator>
#include <string_view>
#include <variant>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/options_documentation.hpp"
#include "core/model/indices.hpp"

namespace ipminmax::inline IPMINMAX_IPOPT_ABI {
namespace {

/// text in lines of at most 80 columns, each after the indentation.
std::string wrapped(std::string_view text, std::size_t indentation) {
  const std::string indent(indentation, ' ');
  std::string result;
  std::string line;
  while (!text.empty()) {
    const std::size_t blank = std::min(text.find(' '), text.size());
    const std::string word(text.substr(0, blank));
    text.remove_prefix(std::min(blank + 1, text.size()));
    if (!line.empty() && indentation + line.size() + 1 + word.size() > 80) {
      result += indent + line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return result + indent + line + "\n";
}

std::string padded(const std::string& text, std::size_t width) {
  return text + std::string(text.size() < width ? width - text.size() : 1, ' ');
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
      text += "\n### " + std::string(category) + " ###\n\n";
    }
    const std::string by_default = default_of(option);
    text += padded(std::string(option.name), 32) + " " + padded(values_of(option), 28) +
            " default " + (by_default.empty() ? "none" : by_default) + "\n";
    text += wrapped(option.text, 4);
    if (const auto* choice = std::get_if<OptionInfo::Choice>(&option.kind)) {
      for (const auto i : indices(choice->names)) {
        const std::string meaning(choice->texts[i]);
        text += wrapped(std::string(choice->names[i]) + (meaning.empty() ? "" : ": " + meaning), 6);
      }
    }
  }
  return text + "\n";
}

std::string user_options_text(const OptionsList& list) {
  std::string text = padded("Name", 34) + padded("Value", 26) + "used\n";
  const auto row = [&](const std::string& name, const std::string& value, bool used) {
    text += padded(name, 34) + padded(value, 26) + (used ? "yes" : "no") + "\n";
  };
  for (const OptionInfo& option : list_options()) {
    const auto value = value_of(option, list);
    if (!value) continue;
    const bool foreign = option.name == "linear_solver" && is_ipopt_only_linear_solver(*value);
    row(std::string(option.name), *value, !foreign);
  }
  for (const OptionInfo& option : ipopt_only_options()) {
    if (const auto value = value_of(option, list)) row(std::string(option.name), *value, false);
  }
  return text;
}

}  // namespace ipminmax::inline IPMINMAX_IPOPT_ABI
