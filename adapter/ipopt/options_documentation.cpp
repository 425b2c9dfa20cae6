#include <algorithm>
#include <iterator>
#include <string_view>
#include <variant>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/options_documentation.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
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

/// "number in (0, inf)"
std::string values_of(const OptionInfo& option) {
  const std::string range = range_of(option);
  return type_of(option) + (range.empty() ? "" : " in " + range);
}

/// Calls visit(name, meaning) for each value of a choice.
template <class Visit>
void for_each_choice(const OptionInfo& option, Visit visit) {
  const auto* choice = std::get_if<OptionInfo::Choice>(&option.kind);
  for (std::size_t i = 0; choice != nullptr && i < choice->names.size(); ++i) {
    visit(std::string(choice->names[i]), std::string(choice->texts[i]));
  }
}

std::string markdown_row(const OptionInfo& option) {
  std::string text = escaped(option.text);
  for_each_choice(option, [&](const std::string& name, const std::string& meaning) {
    text += "<br>" + code(name) + (meaning.empty() ? "" : ": " + escaped(meaning));
  });
  return "| `" + std::string(option.name) + "` | " + values_of(option) + " | " +
         code(default_of(option)) + " | " + text + " |\n";
}

std::string advice_table(const std::vector<IpoptOptionAdvice>& table) {
  std::string text = "\n| option | what to know |\n|---|---|\n";
  const std::vector<OptionInfo> options = list_options();
  for (const IpoptOptionAdvice& row : table) {
    std::string names;
    for (const std::string_view name : row.names) {
      if (std::ranges::find(options, name, &OptionInfo::name) == options.end())
        names += (names.empty() ? "`" : ", `") + std::string(name) + "`";
    }
    if (!names.empty()) text += "| " + names + " | " + escaped(row.advice) + " |\n";
  }
  return text;
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
    for_each_choice(option, [&](const std::string& name, const std::string& meaning) {
      text += wrapped(name + (meaning.empty() ? "" : ": " + meaning), 6);
    });
  }
  return text + "\n";
}

std::string options_markdown() {
  std::string text =
      "# Options\n\n"
      "Names, values and defaults are Ipopt's if the meaning is Ipopt's. Options that Ipopt does "
      "not have\nbegin with `minmax_`. [`glossary.md`](glossary.md) explains K and K_yy, "
      "[`algorithm.md`](algorithm.md) names the paper.\n"
      "`print_options_documentation yes` prints this list. Set options so:\n\n"
      "| from | how |\n|---|---|\n"
      "| C++ | `app->Options()->SetNumericValue(name, value)`, `SetIntegerValue`, "
      "`SetStringValue` |\n"
      "| C++ core | members of `SolverOptions`: those about the method ([`core.md`](core.md)) |\n"
      "| Python | `options={\"tol\": 1e-9}` |\n"
      "| C, CasADi, Pyomo | `IpminmaxAddNumOption(problem, name, value)`; `{\"ipminmax\": {name: "
      "value}}`; `solver.options[name] = value` |\n"
      "| a file | one `name value` per line in `ipminmax.opt` of the working folder, a value with "
      "blanks in double quotes. It has the last word, but not for the executable "
      "([`ampl.md`](ampl.md)) |\n"
      "| the executable | `name=value` on the command line, quoted for the shell if the value has "
      "blanks |\n\n"
      "Made from the table of options in `core/options.cpp` and "
      "`adapter/ipopt/application_options.cpp`;\n"
      "do not edit (`tests/adapter/options_documentation_test.cpp` says how to renew it).\n";
  std::string_view category;
  for (const OptionInfo& option : list_options()) {
    if (option.category != category) {
      category = option.category;
      text += "\n## " + std::string(category) +
              "\n\n| option | value | default | meaning |\n|---|---|---|---|\n";
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
      "\nA `linear_solver` that only Ipopt has (`ma27`, `ma86`, `wsmp`, ...) is accepted with "
      "a\n"
      "message and means `auto`.\n";
  return text;
}

std::string user_options_text(const OptionsList& list) {
  std::string text = padded("Name", 34) + padded("Value", 26) + "used\n";
  const auto row = [&](const std::string& name, const std::string& value, bool used) {
    text += padded(name, 34) + padded(value, 26) + (used ? "yes" : "no") + "\n";
  };
  const auto others = ipopt_only_linear_solvers();
  for (const OptionInfo& option : list_options()) {
    const auto value = value_of(option, list);
    if (!value) continue;
    const bool foreign =
        option.name == "linear_solver" && std::ranges::find(others, *value) != others.end();
    row(std::string(option.name), *value, !foreign);
  }
  for (const OptionInfo& option : ipopt_only_options()) {
    if (const auto value = value_of(option, list)) row(std::string(option.name), *value, false);
  }
  return text;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
