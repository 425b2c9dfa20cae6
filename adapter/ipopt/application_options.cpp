#include <IpJournalist.hpp>
#include <algorithm>
#include <cmath>
#include <istream>
#include <iterator>
#include <limits>
#include <optional>
#include <variant>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/spelling.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Integer = OptionInfo::Integer;
using Number = OptionInfo::Number;
using Flag = OptionInfo::Flag;
using Choice = OptionInfo::Choice;
using Name = OptionInfo::Name;

// --- Options files -------------------------------------------------------------------------------

/// Splits an options file as Ipopt does.
class Words {
 public:
  explicit Words(const std::string& text) : text_(text) {}

  /// The next word, without its quotes; none at the end, or where a quotation never ends.
  [[nodiscard]] std::optional<std::string> next() {
    begin_ = text_.find_first_not_of(kBlanks, end_);
    while (begin_ < text_.size() && text_[begin_] == '#')  // a comment
      begin_ = text_.find_first_not_of(kBlanks, text_.find('\n', begin_));
    if (begin_ >= text_.size()) return std::nullopt;
    const std::size_t quote = text_[begin_] == '"' ? 1 : 0, first = begin_ + quote;
    end_ = quote > 0 ? text_.find('"', first) : text_.find_first_of(kBlanks, first);
    is_open_ = quote > 0 && end_ == std::string::npos;
    if (is_open_) return std::nullopt;
    std::string word = text_.substr(first, end_ - first);
    end_ = std::min(end_, text_.size()) + quote;
    return word;
  }
  [[nodiscard]] bool in_open_quotation() const { return is_open_; }
  /// Where the last word begins, and the line of such a place, from 1.
  [[nodiscard]] std::size_t begin() const { return begin_; }
  [[nodiscard]] std::ptrdiff_t line(std::size_t place) const {
    return 1 + std::ranges::count(text_.substr(0, place), '\n');
  }

 private:
  static constexpr const char* kBlanks = " \t\n\v\f\r";

  const std::string& text_;
  std::size_t begin_ = 0, end_ = 0;  ///< of the last word
  bool is_open_ = false;
};

/// The option whose name is nearest, empty when none is near.
std::string similar_option(const std::string& name, const RegisteredOptions& registry) {
  std::string nearest;
  std::size_t least = 1 + std::min<std::size_t>(3, (name.size() + 1) / 3);
  constexpr std::size_t kLongest = 100;
  if (name.size() > kLongest) return nearest;
  for (const auto& [option, unused] : registry.RegisteredOptionsList()) {
    if (const std::size_t distance = edit_distance(name, option); distance < least) {
      least = distance;
      nearest = option;
    }
  }
  return nearest;
}

/// Whether the option already has this value; setting it again would only warn.
template <class Value>
bool is_set_to(const Value& value, const std::string& name, const OptionsList& list) {
  Value present{};
  return get_option(list, name, present) && present == value;
}

}  // namespace

std::string unknown_option(const std::string& name, const RegisteredOptions& registry) {
  const std::string similar = similar_option(name, registry);
  return concat("unknown option \"", name, "\"",
                similar.empty() ? "" : "; did you mean " + similar + "?");
}

std::string set_option(const std::string& name, const std::string& text,
                       RegisteredOptions& registry, OptionsList& list, bool allow_clobber) {
  const Ipopt::SmartPtr<const RegisteredOption> option = registry.GetOption(name);
  if (IsNull(option)) return unknown_option(name, registry);
  const std::string setting = name + " = " + text;
  bool done = false;
  if (option->Type() == Ipopt::OT_Number) {
    const auto value = parse_number(text);
    if (!value) return setting + " is not a number";
    // Ipopt's own check accepts NaN and infinity.
    if (!std::isfinite(*value) || !option->IsValidNumberSetting(*value)) {
      return setting + " is not in " + range_of(*option);
    }
    done = is_set_to(*value, name, list) || list.SetNumericValue(name, *value, allow_clobber);
  } else if (option->Type() == Ipopt::OT_Integer) {
    const auto value = parse_integer(text);
    if (!value) return setting + " is not an integer";
    if (!option->IsValidIntegerSetting(*value)) {
      return setting + " is not in " + range_of(*option);
    }
    done = is_set_to(*value, name, list) || list.SetIntegerValue(name, *value, allow_clobber);
  } else {
    if (!option->IsValidStringSetting(text)) {
      std::string error = setting + " is not one of:";
      for (const auto& entry : option->GetValidStrings()) {
        // Those of Ipopt alone are accepted, but not worth proposing.
        if (name != "linear_solver" || !is_ipopt_only_linear_solver(entry.value_))
          error += " " + entry.value_;
      }
      return error;
    }
    done = is_set_to(text, name, list) || list.SetStringValue(name, text, allow_clobber);
  }
  return done ? "" : setting + " was refused";
}

namespace {

// --- Typed values --------------------------------------------------------------------------------

void copy_option(const OptionInfo& info, const OptionsList& list, SolverOptions& options) {
  if (const auto* choice = std::get_if<Choice>(&info.kind)) {
    Index i = 0;
    if (list.GetEnumValue(std::string(info.name), i, "") && at(i) < choice->names.size())
      choice->set(options, at(i));  // others: Ipopt's solvers
    return;
  }
  std::visit(
      [&](const auto& kind) {
        if constexpr (requires { options.*kind.member; })
          read_option(list, info.name, options.*kind.member);
      },
      info.kind);
}

void register_row(RegisteredOptions& registry, OptionInfo info) {
  if (info.name == "linear_solver") {
    auto& choice = std::get<Choice>(info.kind);
    std::ranges::copy(ipopt_only_linear_solvers(), std::back_inserter(choice.names));
    choice.texts.resize(choice.names.size(), "Ipopt only; auto is used");
  }
  register_option(registry, info);
}

}  // namespace

std::array<std::span<const OptionInfo>, 3> option_tables() {
  return {option_table(), application_option_table(), ipopt_only_options()};
}

void register_options(RegisteredOptions& registry) {
  for (const auto table : option_tables()) {
    for (const OptionInfo& info : table) register_row(registry, info);
  }
}

Ipopt::SmartPtr<const RegisteredOption> OptionRegistry::GetOption(const std::string& name) {
  const auto known = RegisteredOptions::GetOption(name);
  if (IsValid(known)) return known;
  const std::string own = name.substr(name.rfind('.') + 1);  // a prefix ends with a dot
  for (const auto table : option_tables()) {
    const auto found = std::ranges::find(table, own, &OptionInfo::name);
    if (found == table.end()) continue;
    register_row(*this, *found);
    break;
  }
  return RegisteredOptions::GetOption(name);
}

const OptionRegistry::RegOptionsList& OptionRegistry::RegisteredOptionsList() const {
  for (const auto table : option_tables()) {
    for (const OptionInfo& info : table)
      static_cast<void>(const_cast<OptionRegistry*>(this)->GetOption(std::string(info.name)));
  }
  return RegisteredOptions::RegisteredOptionsList();
}

namespace {

using Rows = std::vector<OptionInfo>;

Rows output_rows() {
  const std::string_view category = "Output";
  constexpr int kLastLevel = Ipopt::J_LAST_LEVEL - 1;
  constexpr int kMost = std::numeric_limits<int>::max();
  return {
      {"print_level", category,
       "Verbosity of the console: 0 nothing, 1 errors, 2 options without effect, 3 summary, 4 also "
       "problem statistics and warnings, 5 also one line per iteration, 6 and above also the "
       "iterations of each of several starts.",
       Integer{nullptr, 0, kLastLevel, Ipopt::J_ITERSUMMARY}},
      {"minmax_points_file", category,
       "File for the distinct certified points of a multistart, comma-separated: rank, value, "
       "found (starts that ended there), first start, margin, status, variables; empty: none.",
       Name{""}},
      {"output_file", category, "Name of an output file; empty: none.", Name{""}},
      {"file_append", category,
       "Whether output is appended to existing files instead of replacing them.",
       Flag{nullptr, false}},
      {"file_print_level", category,
       "Verbosity of the output file, as print_level. If it is not set, the output file has the "
       "verbosity of the console.",
       Integer{nullptr, 0, kLastLevel, Ipopt::J_ITERSUMMARY}},
      {"print_frequency_iter", category,
       "An iteration is printed if its number is a multiple of this.",
       Integer{nullptr, 1, kMost, 1}},
      {"print_frequency_time", category,
       "An iteration is printed only if this many seconds have passed since the last printed one.",
       Number{nullptr, 0.0, kInfinity, false, true, 0.0}},
      {"print_info_string", category,
       "Whether the number of factorizations of K and of K_yy ends each iteration's line.",
       Flag{nullptr, false}},
      {"print_ipopt_log", category,
       "Whether iterations and final errors are printed as Ipopt prints them, for programs that "
       "read its log; the default with the executable's -AMPL.",
       Flag{nullptr, false}},
      {"print_user_options", category, "Whether the options that were set are printed.",
       Flag{nullptr, false}},
      {"print_options_documentation", category, "Whether all options are listed.",
       Flag{nullptr, false}},
      {"print_timing_statistics", category, "Whether the time of each stage is printed.",
       Flag{nullptr, false}},
      {"sb", category, "Whether the banner is suppressed.", Flag{nullptr, false}},
  };
}

Rows player_rows() {
  const std::string_view category = "Players";
  return {
      {"minmax_max_variables", category,
       "Variables of Max, for example \"3 5-9 wind\": indices from 0, ranges, names that the "
       "model gives (idx_names). wind also names wind[1], wind[2], ... It is an error if the "
       "model itself assigns players differently.",
       Name{""}},
      {"minmax_max_constraints", category,
       "Constraints given to Max although they read no variable of Max, listed in the "
       "same way.",
       Name{""}},
      {"minmax_min_constraints", category,
       "Constraints given to Min although they read a variable of Max, listed in the same way. "
       "They must hold for every value of these variables (robust constraints).",
       Name{""}},
  };
}

Rows other_rows() {
  const std::string_view category = "Miscellaneous";
  return {
      {"minmax_as_printed", category,
       "Whether Algorithm 1 is used as printed in the paper. This changes "
       "the defaults of minmax_globalization and a dozen more options (as_printed in "
       "core/options.hpp).",
       Flag{nullptr, false}},
      {"hsllib", "Linear Solver",
       "Library of linear_solver ma57 or ma97, loaded at run time. If it is not set and "
       "libhsl.so is not found, auto is used.",
       Name{"libhsl.so"}},
      {"pardisolib", "Linear Solver",
       "Library of linear_solver pardiso or pardisomkl, loaded at run time in the "
       "same way. If it is not set, pardisomkl takes libmkl_rt.so.",
       Name{"libpardiso.so"}},
      {"minmax_spral_library", "Linear Solver",
       "Library of linear_solver spral, loaded at run time in the same way. SPRAL "
       "needs OMP_CANCELLATION=TRUE in the environment.",
       Name{"libspral.so"}},
      {"option_file_name", category, "Name of the options file; empty: none.",
       Name{"ipminmax.opt"}},
  };
}

}  // namespace

const std::vector<OptionInfo>& application_option_table() {
  static const Rows table = [] {
    Rows all;
    for (const auto rows : {output_rows, player_rows, other_rows})
      std::ranges::move(rows(), std::back_inserter(all));
    return all;
  }();
  return table;
}

std::string read_options(std::istream& input, const std::string& source,
                         RegisteredOptions& registry, OptionsList& list, bool allow_clobber) {
  std::string text;
  for (char c = '\0'; input.get(c);) text += c;
  if (input.bad()) return source + " cannot be read";  // a folder, for one
  Words words(text);
  while (const auto name = words.next()) {
    const std::size_t begin = words.begin();
    const auto value = words.next();
    if (words.in_open_quotation()) break;
    const std::string error = value ? set_option(*name, *value, registry, list, allow_clobber)
                                    : concat("option \"", *name, "\" has no value");
    if (!error.empty()) return concat(source, ", line ", words.line(begin), ": ", error);
  }
  return words.in_open_quotation()
             ? concat(source, ", line ", words.line(words.begin()), ": a quotation never ends")
             : "";
}

std::string solver_options(const OptionsList& list, SolverOptions& options) {
  try {
    bool is_as_printed = false;
    read_option(list, "minmax_as_printed", is_as_printed);
    if (is_as_printed) options = as_printed(options);
    for (const OptionInfo& info : option_table()) {
      if (may_be_set(list, info.name)) copy_option(info, list, options);
    }
  } catch (const Ipopt::OPTION_INVALID& error) {
    return error.Message();
  }
  if (auto error = refused_ipopt_option(list); !error.empty()) return error;
  return check(options);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
