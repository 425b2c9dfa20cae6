#pragma once

#include <string>

#include <IpJournalist.hpp>

#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// A journal that writes to a file, from its end on where append is set (Ipopt 3.11 cannot); null when
/// it cannot be opened. "stdout" and "stderr" are the streams, as in Ipopt.
[[nodiscard]] Ipopt::SmartPtr<Ipopt::Journal> open_journal(const std::string& name,
                                                           const std::string& file_name,
                                                           Ipopt::EJournalLevel level, bool append);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
