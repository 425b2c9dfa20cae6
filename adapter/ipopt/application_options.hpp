#pragma once

#include <array>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "option_registry.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Options of the application: output and options file, the players' lists. Names and meanings are
/// Ipopt's where Ipopt has them.
[[nodiscard]] const std::vector<OptionInfo>& application_option_table();

/// Begins a message's part where the file of option minmax_points_file was not written.
inline constexpr const char* kPointsNotWritten = "error writing minmax_points_file: ";

/// The solver's own, those of the application, and those that only Ipopt has.
[[nodiscard]] std::array<std::span<const OptionInfo>, 3> option_tables();

/// Registers the solver's options from option_table(), those of the application, and those that
/// only Ipopt has (ipopt_only_options.hpp).
void register_options(RegisteredOptions& registry);

/// A registry with the same options, each of which is made when it is first asked for: all of them
/// take longer than a small solve.
class OptionRegistry : public RegisteredOptions {
 public:
  Ipopt::SmartPtr<const RegisteredOption> GetOption(const std::string& name) override;
  /// Makes all of them.
  [[nodiscard]] const RegOptionsList& RegisteredOptionsList() const override;
};

/// Sets the options of a file in Ipopt's format: name and value separated by blanks or line ends,
/// # starts a comment, "..." quotes. As in Ipopt they cannot be overwritten by later Set calls
/// unless allow_clobber. Stops at the first error and returns it as "ipminmax.opt, line 3: unknown
/// option \"mu_int\"", or what cannot be read; empty when there is none. source: the file's name.
[[nodiscard]] std::string read_options(std::istream& input, const std::string& source,
                                       RegisteredOptions& registry, OptionsList& list,
                                       bool allow_clobber = false);

/// "unknown option "tool"; did you mean tol?"
[[nodiscard]] std::string unknown_option(const std::string& name,
                                         const RegisteredOptions& registry);

/// Sets one option from its text. allow_clobber: whether later calls may overwrite it. Returns what
/// is wrong ("tol = -1 is not in (0, inf)"), empty when nothing is.
[[nodiscard]] std::string set_option(const std::string& name, const std::string& text,
                                     RegisteredOptions& registry, OptionsList& list,
                                     bool allow_clobber);

/// Copies the values that were set to options and checks all, also for options of Ipopt that are
/// refused. Returns the first error, empty when there is none.
[[nodiscard]] std::string solver_options(const OptionsList& list, SolverOptions& options);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
