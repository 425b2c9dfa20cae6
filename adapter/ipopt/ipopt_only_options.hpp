#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "option_registry.hpp"

/// @file
/// Options of Ipopt that this solver does not have, so that programs and options files made for
/// Ipopt say what became of them. Which they are is read from the linked Ipopt's own registry.
///
///  - What changes the problem, its derivatives or the meaning of the answer is refused: ignoring
///
///      it would answer another question than the one asked.
///
///  - What only steers Ipopt's own algorithm (how mu decreases, line search, another linear solver)
///
///      is accepted and named in a message: the answer's meaning does not depend on it.
///
///  - Ipopt's default value asks for nothing, and nothing is said.
namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Those options, with Ipopt's types, ranges and values.
[[nodiscard]] const std::vector<OptionInfo>& ipopt_only_options();

/// Values of linear_solver that only Ipopt has: they are accepted and mean auto.
[[nodiscard]] std::vector<std::string_view> ipopt_only_linear_solvers();

[[nodiscard]] bool is_ipopt_only_linear_solver(std::string_view name);

/// First option that is refused, as "jacobian_approximation = finite-difference-values is an option
/// of Ipopt that is not available: ..."; empty when there is none.
[[nodiscard]] std::string refused_ipopt_option(const OptionsList& list);

/// One message for each option set that has no effect, as "mu_strategy = adaptive has no effect:
/// ...".
[[nodiscard]] std::vector<std::string> ignored_ipopt_options(const OptionsList& list);

/// Name and what to do instead, for the documentation. Names that end with * stand for all options
/// that begin so.
struct IpoptOptionAdvice {
  std::vector<std::string_view> names;
  std::string_view advice;
};
[[nodiscard]] const std::vector<IpoptOptionAdvice>& refused_ipopt_option_advice();
[[nodiscard]] const std::vector<IpoptOptionAdvice>& ignored_ipopt_option_advice();

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
