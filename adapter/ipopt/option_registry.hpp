#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <IpOptionsList.hpp>
#include <IpRegOptions.hpp>

#include "../../core/options.hpp"
#include "ipopt_version.hpp"

/// @file
/// Options, whosever they are, as Ipopt's registry has them and as texts.
namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

using Ipopt::OptionsList;
using Ipopt::RegisteredOption;
using Ipopt::RegisteredOptions;

/// The shortest text that reads back as this number, as "0.1"; also inf and -inf.
[[nodiscard]] std::string text_of(double value);

/// The whole text as a number, whatever the locale; Fortran's exponent letter d is accepted, as in
/// Ipopt. Infinite or zero beyond the range of double.
[[nodiscard]] std::optional<double> parse_number(std::string text);
[[nodiscard]] std::optional<int> parse_integer(std::string_view text);

/// Registers an option under its category, with its type, range, values and default.
void register_option(RegisteredOptions& registry, const OptionInfo& info);

/// "number", "integer", "yes/no", "choice" or "name".
[[nodiscard]] std::string type_of(const OptionInfo& info);
/// "(0, inf)"; empty unless a number or an integer.
[[nodiscard]] std::string range_of(const OptionInfo& info);
/// The same of an option as Ipopt's registry has it.
[[nodiscard]] std::string range_of(const RegisteredOption& option);
[[nodiscard]] OptionInfo::Number number_of(const RegisteredOption& option);
[[nodiscard]] OptionInfo::Integer integer_of(const RegisteredOption& option);
/// Numbers with the fewest digits that read back as the same.
[[nodiscard]] std::string default_of(const OptionInfo& info);
/// The value in the list as default_of writes it; none: it was not set.
[[nodiscard]] std::optional<std::string> value_of(const OptionInfo& info, const OptionsList& list);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
