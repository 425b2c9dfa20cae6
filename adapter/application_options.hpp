#pragma once

#include <iosfwd>
#include <string>

#include <IpOptionsList.hpp>
#include <IpRegOptions.hpp>

#include <ipminmax/adapter/ipopt_version.hpp>
#include <ipminmax/core/options.hpp>

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Registers the solver's options from option_table() and those of the application (output and
/// options file), with Ipopt's names.
void register_options(Ipopt::RegisteredOptions& registry);

/// Sets the options of a file in Ipopt's format: name and value separated by blanks or line ends,
/// # starts a comment, "..." quotes. As in Ipopt they cannot be overwritten by later Set calls.
/// Stops at the first error and returns it as "ipminmax.opt, line 3: unknown option \"mu_int\"";
/// empty when there is none. source: the file's name.
[[nodiscard]] std::string read_options(std::istream& input, const std::string& source,
                                       Ipopt::RegisteredOptions& registry,
                                       Ipopt::OptionsList& list);

/// Sets one option from its text. allow_clobber: whether later calls may overwrite it. Returns what is
/// wrong ("tol = -1 is not in (0, inf)"), empty when nothing is.
[[nodiscard]] std::string set_option(const std::string& name, const std::string& text,
                                     Ipopt::RegisteredOptions& registry, Ipopt::OptionsList& list,
                                     bool allow_clobber);

/// Copies the values that were set to options and checks all. Returns the first error, empty when
/// there is none.
[[nodiscard]] std::string solver_options(const Ipopt::OptionsList& list, SolverOptions& options);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
