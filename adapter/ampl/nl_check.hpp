#pragma once

#include <string>

namespace ipminmax {

/// Reads an .nl file, text or binary, for its form only: every count, index, operation and string must
/// be what the header declares, every part be there. AMPL's library uses most of them unchecked.
///
/// Throws std::runtime_error, "cannot read FILE, line 12: ..." (byte instead of line in binary
/// files), at the first that is not so, and for models without variables, with logical or with
/// complementarity constraints.
void check_nl_file(const std::string& file);

/// The same for the content of a file that is called name in messages.
void check_nl_text(const std::string& text, const std::string& name);

}  // namespace ipminmax
