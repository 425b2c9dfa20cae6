#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "adapter/application_options.hpp"
#include "adapter/ipopt_only_options.hpp"
#include "adapter/options_documentation.hpp"
#include "core/options.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Fewest digits that read back as the same number.
std::string number(double value) {
  if (std::isinf(value)) return value > 0.0 ? "inf" : "-inf";
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

std::string interval(double lower, bool lower_strict, double upper, bool upper_strict) {
  return (lower_strict ? "(" : "[") + number(lower) + ", " + number(upper) +
         (upper_strict ? ")" : "]");
}

std::string integer_interval(int lower, int upper) {
  const bool bounded = upper != std::numeric_limits<int>::max();
  return "[" + std::to_string(lower) + ", " + (bounded ? std::to_string(upper) + "]" : "inf)");
}

std::string yes_no(bool value) { return value ? "yes" : "no"; }

DocumentedOption document(const OptionInfo& info) {
  const SolverOptions defaults;
  DocumentedOption option{.name = std::string(info.name),
                          .category = std::string(info.category),
                          .type = {},
                          .range = {},
                          .default_value = {},
                          .text = std::string(info.text),
                          .values = {}};
  if (const auto* real = std::get_if<OptionInfo::Number>(&info.kind)) {
    option.type = "number";
    option.range = interval(real->lower, real->lower_strict, real->upper, real->upper_strict);
    option.default_value = number(defaults.*(real->member));
  } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
    option.type = "integer";
    option.range = integer_interval(integer->lower, integer->upper);
    option.default_value = std::to_string(defaults.*(integer->member));
  } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
    option.type = "yes/no";
    option.default_value = yes_no(defaults.*(flag->member));
  } else if (const auto* choice = std::get_if<OptionInfo::Choice>(&info.kind)) {
    option.type = "choice";
    option.default_value = std::string(choice->names.at(choice->get(defaults)));
    for (std::size_t i = 0; i < choice->names.size(); ++i) {
      option.values.push_back({std::string(choice->names[i]), std::string(choice->texts[i])});
    }
  }
  return option;
}

DocumentedOption document(const ApplicationOption& row) {
  DocumentedOption option{.name = std::string(row.name),
                          .category = std::string(row.category),
                          .type = {},
                          .range = {},
                          .default_value = {},
                          .text = std::string(row.text),
                          .values = {}};
  if (const auto* integer = std::get_if<ApplicationOption::Integer>(&row.kind)) {
    option.type = "integer";
    option.range = integer_interval(integer->lower, integer->upper);
    option.default_value = std::to_string(integer->value);
  } else if (const auto* real = std::get_if<ApplicationOption::Number>(&row.kind)) {
    option.type = "number";
    option.range = interval(real->lower, false, std::numeric_limits<double>::infinity(), true);
    option.default_value = number(real->value);
  } else if (const auto* flag = std::get_if<ApplicationOption::Flag>(&row.kind)) {
    option.type = "yes/no";
    option.default_value = yes_no(flag->value);
  } else {
    option.type = "name";
    option.default_value = std::string(std::get<ApplicationOption::Name>(row.kind).value);
  }
  return option;
}

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

/// Markdown: a bar would end the cell, < could begin a tag.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '|' || c == '*' || c == '<') result += '\\';
    result += c;
  }
  return result;
}

std::string code(const std::string& text) { return text.empty() ? "" : "`" + text + "`"; }

std::string markdown_row(const DocumentedOption& option) {
  std::string text = escaped(option.text);
  for (const auto& [name, meaning] : option.values) {
    text += "<br>" + code(name) + (meaning.empty() ? "" : ": " + escaped(meaning));
  }
  const std::string range =
      option.range.empty() ? option.type : option.type + " in " + option.range;
  return "| `" + option.name + "` | " + range + " | " + code(option.default_value) + " | " + text +
         " |\n";
}

std::string advice_table(const std::vector<IpoptOptionAdvice>& table) {
  std::string text = "\n| option | what to know |\n|---|---|\n";
  const std::vector<DocumentedOption> options = list_options();
  for (const IpoptOptionAdvice& row : table) {
    if (std::ranges::find(options, row.name, &DocumentedOption::name) != options.end()) continue;
    text += "| `" + std::string(row.name) + "` | " + escaped(row.advice) + " |\n";
  }
  return text;
}

}  // namespace

std::vector<DocumentedOption> list_options() {
  std::vector<DocumentedOption> options;
  for (const OptionInfo& info : option_table()) options.push_back(document(info));
  for (const ApplicationOption& row : application_option_table()) options.push_back(document(row));
  // Rows of a category need not stand together in the table.
  std::vector<std::string> categories;
  for (const DocumentedOption& option : options) {
    if (std::ranges::find(categories, option.category) == categories.end()) {
      categories.push_back(option.category);
    }
  }
  std::ranges::stable_sort(options, {}, [&](const DocumentedOption& option) {
    return std::ranges::find(categories, option.category) - categories.begin();
  });
  return options;
}

std::string options_text() {
  std::string text;
  std::string category;
  for (const DocumentedOption& option : list_options()) {
    if (option.category != category) {
      category = option.category;
      text += "\n### " + category + " ###\n\n";
    }
    const std::string range =
        option.range.empty() ? option.type : option.type + " in " + option.range;
    text += padded(option.name, 32) + " " + padded(range, 28) + " default " +
            (option.default_value.empty() ? "none" : option.default_value) + "\n";
    text += wrapped(option.text, 4);
    for (const auto& [name, meaning] : option.values) {
      text += wrapped(name + (meaning.empty() ? "" : ": " + meaning), 6);
    }
  }
  return text + "\n";
}

std::string options_markdown() {
  std::string text =
      "# Options\n\n"
      "Set with `app->Options()->SetNumericValue(name, value)`, `SetIntegerValue` and\n"
      "`SetStringValue`, or one `name value` per line in the file `ipminmax.opt`. Names, values "
      "and\n"
      "defaults are Ipopt's wherever the meaning is Ipopt's; own options begin with `minmax_`.\n"
      "`print_options_documentation yes` prints the same list.\n\n"
      "Made from the table of options in `core/options.cpp` and "
      "`adapter/application_options.cpp`;\n"
      "do not edit (`tests/adapter/options_documentation_test.cpp` says how to renew it).\n";
  std::string category;
  for (const DocumentedOption& option : list_options()) {
    if (option.category != category) {
      category = option.category;
      text +=
          "\n## " + category + "\n\n| option | value | default | meaning |\n|---|---|---|---|\n";
    }
    text += markdown_row(option);
  }
  text +=
      "\n## Options that only Ipopt has\n\n"
      "They are known by name, whichever version of Ipopt is linked, so that programs and options\n"
      "files made for Ipopt say what became of them. Setting one to Ipopt's default does "
      "nothing.\n\n"
      "Refused (`Invalid_Option`), because they change the problem or what the answer means:\n";
  text += advice_table(refused_ipopt_option_advice());
  text +=
      "\nAccepted with a message, because they only steer Ipopt's own algorithm; `*` stands for "
      "any\n"
      "ending, and every option that is not listed is of this kind:\n";
  text += advice_table(ignored_ipopt_option_advice());
  text +=
      "\nA `linear_solver` that only Ipopt has (`ma27`, `ma57`, `pardiso`, ...) is accepted with "
      "a\n"
      "message and means `auto`.\n";
  return text;
}

std::string user_options_text(const Ipopt::OptionsList& list) {
  std::string text = padded("Name", 34) + padded("Value", 26) + "used\n";
  const auto row = [&](const std::string& name, const std::string& value, bool used) {
    text += padded(name, 34) + padded(value, 26) + yes_no(used) + "\n";
  };
  for (const DocumentedOption& option : list_options()) {
    if (option.type == "number") {
      double value = 0.0;
      if (list.GetNumericValue(option.name, value, "")) row(option.name, number(value), true);
    } else if (option.type == "integer") {
      Ipopt::Index value = 0;
      if (list.GetIntegerValue(option.name, value, "")) {
        row(option.name, std::to_string(value), true);
      }
    } else {
      std::string value;
      if (list.GetStringValue(option.name, value, "")) {
        const auto others = ipopt_only_linear_solvers();
        const bool foreign =
            option.name == "linear_solver" && std::ranges::find(others, value) != others.end();
        row(option.name, value, !foreign);
      }
    }
  }
  for (const auto& [name, value] : set_ipopt_only_options(list)) row(name, value, false);
  return text;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
