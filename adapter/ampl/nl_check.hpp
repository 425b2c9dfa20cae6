#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace ipminmax {

struct NlFormulas;

/// What AMPL's library does not tell of a file.
struct NlFacts {
  int variables = 0;
  /// Constraints that suffix player lists with the value 0, which the library takes for not listed.
  std::vector<int> listed_as_min;
  /// Names of suffixes of variables that the library drops: all but player.
  std::vector<std::string> other_suffixes;
  struct Part {
    std::size_t begin = 0, end = 0;
  };
  Part bounds, columns;  ///< bytes of segments b, and k or K; empty where absent
  bool binary = false;
};

/// Reads an .nl file, text or binary, for its form only: every count, index, operation and string
/// must be what the header declares, every part be there. AMPL's library uses most of them
/// unchecked.
///
/// Throws std::runtime_error, "cannot read FILE, line 12: ..." (byte instead of line in binary
/// files), at the first that is not so, and for models with logical or with complementarity
/// constraints.
NlFacts check_nl_file(const std::string& file);

/// The same for the content of a file that is called name in messages.
NlFacts check_nl_text(const std::string& text, const std::string& name);

/// The formulas of a file that passes.
[[nodiscard]] NlFormulas read_nl_formulas(const std::string& file);

/// The file with one more variable, fixed at 0, in place of none, which AMPL's library does not
/// read.
[[nodiscard]] std::string with_a_fixed_variable(const std::string& file, const NlFacts& facts);

}  // namespace ipminmax
