#include "adapter/ipopt/option_registry.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <variant>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

using Number = OptionInfo::Number;
using Integer = OptionInfo::Integer;
using Flag = OptionInfo::Flag;
using Choice = OptionInfo::Choice;
using Name = OptionInfo::Name;

/// What is said or done of each kind of option.
template <class... Cases>
struct Kinds : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Kinds(Cases...) -> Kinds<Cases...>;

constexpr int kLeast = std::numeric_limits<int>::min(), kMost = std::numeric_limits<int>::max();

void add_number(RegisteredOptions& registry, const std::string& name, const std::string& text,
                const Number& o) {
  const bool bounded_below = std::isfinite(o.lower);
  const bool bounded_above = std::isfinite(o.upper);
  if (bounded_below && bounded_above) {
    registry.AddBoundedNumberOption(name, text, o.lower, o.lower_strict, o.upper, o.upper_strict,
                                    o.by_default);
  } else if (bounded_below) {
    registry.AddLowerBoundedNumberOption(name, text, o.lower, o.lower_strict, o.by_default);
  } else if (bounded_above) {
    registry.AddUpperBoundedNumberOption(name, text, o.upper, o.upper_strict, o.by_default);
  } else {
    registry.AddNumberOption(name, text, o.by_default);
  }
}

}  // namespace

std::string text_of(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::optional<double> parse_number(std::string text) {
  const auto exponent = [](char c) { return c == 'd' || c == 'D'; };
  if (text.find_first_of("0123456789") != std::string::npos) {
    std::replace_if(text.begin(), text.end(), exponent, 'e');
  }
  if (text.starts_with('+')) text.erase(0, 1);
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range && text.find("e-") == std::string::npos) {
    return text.starts_with('-') ? -kInfinity : kInfinity;
  }
  return value;
}

std::optional<int> parse_integer(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  int value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

void register_option(RegisteredOptions& registry, const OptionInfo& info) {
  registry.SetRegisteringCategory(std::string(info.category));
  const std::string name(info.name), text(info.text);
  std::visit(
      Kinds{[&](const Number& o) { add_number(registry, name, text, o); },
            [&](const Integer& o) {
              registry.AddBoundedIntegerOption(name, text, o.lower, o.upper, o.by_default);
            },
            [&](const Flag&) {
              registry.AddStringOption2(name, text, default_of(info), "no", "", "yes", "");
            },
            [&](const Choice& o) {
              registry.AddStringOption(name, text, default_of(info),
                                       {o.names.begin(), o.names.end()},
                                       {o.texts.begin(), o.texts.end()});
            },
            [&](const Name&) { registry.AddStringOption1(name, text, default_of(info), "*", ""); }},
      info.kind);
}

std::string type_of(const OptionInfo& info) {
  constexpr std::array kTypes = {"number", "integer", "yes/no", "choice", "name"};
  static_assert(kTypes.size() == std::variant_size_v<decltype(info.kind)>);
  return kTypes[info.kind.index()];
}

std::string range_of(const OptionInfo& info) {
  if (const auto* o = std::get_if<Number>(&info.kind)) {
    return concat(o->lower_strict ? "(" : "[", text_of(o->lower), ", ", text_of(o->upper),
                  o->upper_strict ? ")" : "]");
  }
  if (const auto* o = std::get_if<Integer>(&info.kind)) {
    return (o->lower > kLeast ? "[" + std::to_string(o->lower) : "(-inf") + ", " +
           (o->upper < kMost ? std::to_string(o->upper) + "]" : "inf)");
  }
  return {};
}

std::string range_of(const RegisteredOption& option) {
  OptionInfo info{};
  info.kind = integer_of(option);
  if (option.Type() == Ipopt::OT_Number) info.kind = number_of(option);
  return range_of(info);
}

Number number_of(const RegisteredOption& option) {
  return {.member = nullptr,
          .lower = option.HasLower() ? option.LowerNumber() : -kInfinity,
          .upper = option.HasUpper() ? option.UpperNumber() : kInfinity,
          .lower_strict = !option.HasLower() || option.LowerStrict(),
          .upper_strict = !option.HasUpper() || option.UpperStrict(),
          .by_default = option.DefaultNumber()};
}

Integer integer_of(const RegisteredOption& option) {
  return {.member = nullptr,
          .lower = option.HasLower() ? option.LowerInteger() : kLeast,
          .upper = option.HasUpper() ? option.UpperInteger() : kMost,
          .by_default = option.DefaultInteger()};
}

std::string default_of(const OptionInfo& info) {
  return std::visit(Kinds{[](const Number& o) { return text_of(o.by_default); },
                          [](const Integer& o) { return std::to_string(o.by_default); },
                          [](const Flag& o) { return std::string(o.by_default ? "yes" : "no"); },
                          [](const Choice& o) { return std::string(o.names.at(o.by_default)); },
                          [](const Name& o) { return std::string(o.by_default); }},
                    info.kind);
}

std::optional<std::string> value_of(const OptionInfo& info, const OptionsList& list) {
  const std::string name(info.name);
  if (std::holds_alternative<Number>(info.kind)) {
    if (double value = 0.0; get_option(list, name, value)) return text_of(value);
  } else if (std::holds_alternative<Integer>(info.kind)) {
    if (Index value = 0; get_option(list, name, value)) return std::to_string(value);
  } else if (std::string value; get_option(list, name, value)) {
    return value;
  }
  return std::nullopt;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
