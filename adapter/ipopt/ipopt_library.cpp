#include <dlfcn.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>

#include <IpUtils.hpp>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/ipopt_library.hpp"
#include "adapter/ipopt/minmax_tnlp.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Real path of a loaded file, itself where there is none.
std::string real_path(const char* name) {
  std::array<char, PATH_MAX> path{};
  return realpath(name, path.data()) != nullptr ? path.data() : name;
}

bool is_ipopt_library(std::string_view path) {
  return path.substr(path.rfind('/') + 1).starts_with("libipopt.");
}

std::vector<std::string> loaded_ipopt_libraries() {
  std::vector<std::string> paths;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* data) {
        if (is_ipopt_library(info->dlpi_name)) {
          static_cast<std::vector<std::string>*>(data)->push_back(real_path(info->dlpi_name));
        }
        return 0;
      },
      &paths);
  std::ranges::sort(paths);
  paths.erase(std::unique(paths.begin(), paths.end()), paths.end());
  return paths;
}

/// How many were loaded and unloaded so far.
using LoadedLibraries = std::pair<unsigned long long, unsigned long long>;

LoadedLibraries loaded_libraries() {
  LoadedLibraries count;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* data) {
        *static_cast<LoadedLibraries*>(data) = {info->dlpi_adds, info->dlpi_subs};
        return 1;  // the same in all entries
      },
      &count);
  return count;
}

/// GetIpoptCurrentIterate came with Ipopt 3.14. It is looked for in the library itself: one that
/// depends on libipopt may have a function of that name, too.
bool is_from_3_14_on(const std::string& path) {
  void* library = dlopen(path.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (library == nullptr) return IPMINMAX_IPOPT_AT_LEAST(3, 14);
  Dl_info found{};
  void* function = dlsym(library, "GetIpoptCurrentIterate");
  const bool has = function != nullptr && dladdr(function, &found) != 0 &&
                   found.dli_fname != nullptr && real_path(found.dli_fname) == path;
  dlclose(library);
  return has;
}

}  // namespace

std::string ipopt_library_error(const std::vector<std::string>& paths,
                                bool (*has_iterate_queries)(const std::string& path)) {
  const std::string built =
      concat(IPOPT_VERSION_MAJOR, ".", IPOPT_VERSION_MINOR, ".", IPOPT_VERSION_RELEASE);
  if (paths.size() > 1) {
    std::string list;
    for (const std::string& path : paths) list += (list.empty() ? "" : ", ") + path;
    return "several Ipopt libraries are loaded (" + list + "), and Ipminmax was built with Ipopt " +
           built + ": a model compiled against another version cannot be called";
  }
  for (const std::string& path : paths) {
    const bool later = has_iterate_queries(path);
    if (later == IPMINMAX_IPOPT_AT_LEAST(3, 14)) continue;
    return path + " is of Ipopt " + (later ? "3.14 or later" : "3.13 or earlier") +
           ", and Ipminmax was built with Ipopt " + built;
  }
  return {};
}

std::string ipopt_library_error() {
  Dl_info found{};
  const bool is_shared = dladdr(reinterpret_cast<void*>(&Ipopt::CpuTime), &found) != 0 &&
                         found.dli_fname != nullptr && is_ipopt_library(found.dli_fname);
  return is_shared ? ipopt_library_error({real_path(found.dli_fname)}, is_from_3_14_on) : "";
}

std::string ipopt_library_error(const Ipopt::TNLP& model) {
  const bool linked_against_us = dynamic_cast<const MinMaxTNLP*>(&model) != nullptr &&
                                 dynamic_cast<const SplitTNLP*>(&model) == nullptr;
  if (linked_against_us) return {};
  // Looked for anew only where libraries have come or gone: files are asked for.
  struct Seen {
    LoadedLibraries libraries;
    std::string error;
  };
  thread_local std::optional<Seen> seen;
  const LoadedLibraries now = loaded_libraries();
  if (!seen || seen->libraries != now) {
    seen = {now, ipopt_library_error(loaded_ipopt_libraries(), is_from_3_14_on)};
  }
  return seen->error;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
