#pragma once

#include <string>
#include <vector>

#include <IpTNLP.hpp>

#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Why the model must not be called: the virtual tables of Ipopt 3.11's and 3.14's TNLP differ, and
/// the process has loaded another version of Ipopt than this library was built with, or two
/// versions, so that the model may be of the other one. Empty where nothing is seen. A model of a
/// class of this library was linked against it and fits. Calls nothing of the model.
[[nodiscard]] std::string ipopt_library_error(const Ipopt::TNLP& model);

/// Why none of Ipopt's own classes must be used: a library preloaded into a program that is linked
/// with another version of Ipopt finds that one's. Empty where nothing is seen.
[[nodiscard]] std::string ipopt_library_error();

/// The same from the paths of the Ipopt libraries that are loaded; has_iterate_queries: whether
/// one, by its path, has the functions that came with 3.14.
[[nodiscard]] std::string ipopt_library_error(const std::vector<std::string>& paths,
                                              bool (*has_iterate_queries)(const std::string& path));

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
