#include "linalg/mpi_library.hpp"

#include <dlfcn.h>
#include <dmumps_c.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <vector>

#include "linalg/solver_lost.hpp"

#if defined(__SANITIZE_ADDRESS__)
#define IPMINMAX_WITH_ADDRESS_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define IPMINMAX_WITH_ADDRESS_SANITIZER 1
#endif
#endif

namespace ipminmax {
namespace {

constexpr const char* kName = "libipminmax_mpi.so";
constexpr const char* kVariable = "IPMINMAX_MPI_LIBRARY";

/// Files to try, the first that can be loaded counts.
[[maybe_unused]] std::vector<std::string> candidates() {
  if (const char* given = std::getenv(kVariable); given != nullptr && *given != '\0') {
    return {given};
  }
  std::vector<std::string> files;
  Dl_info self{};
  if (dladdr(reinterpret_cast<const void*>(&mpi_plugin), &self) != 0 && self.dli_fname != nullptr) {
    const std::string file = self.dli_fname;
    const std::size_t slash = file.rfind('/');
    const std::string folder = slash == std::string::npos ? "." : file.substr(0, slash);
    files.push_back(folder + "/" + kName);
    files.push_back(folder + "/../" IPMINMAX_LIBDIR "/" + kName);
  }
  files.emplace_back(kName);
  return files;
}

[[noreturn]] void unavailable(const std::string& reason) {
  throw SolverUnavailable("MPI cannot be used: " + reason);
}

const mpi::Plugin& load() {
#ifdef IPMINMAX_WITH_ADDRESS_SANITIZER
  unavailable("not in a program with AddressSanitizer, which forbids RTLD_DEEPBIND");
#elif !defined(RTLD_DEEPBIND)
  unavailable("this C library has no RTLD_DEEPBIND, which keeps the parallel MUMPS apart");
#else
  // The process may hold the sequential MUMPS and its stub of MPI: the plugin's own come first for
  // the plugin (DEEPBIND), and nobody else sees them (LOCAL).
  std::string reason;
  void* library = nullptr;
  for (const std::string& file : candidates()) {
    library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
    if (library != nullptr) break;
    const std::string error = dlerror();
    // What is missing inside a plugin that is there says more than that others are not there.
    const bool absent = error.find(file + ": cannot open shared object file") == 0;
    if (reason.empty() || !absent) reason = error;
  }
  if (library == nullptr) {
    unavailable(reason + "; " + kName +
                " is built where MPI and the parallel MUMPS are installed (" + kVariable +
                " names it when it is elsewhere)");
  }
  const auto entry =
      reinterpret_cast<const mpi::Plugin* (*)()>(dlsym(library, "ipminmax_mpi_plugin"));
  const mpi::Plugin* plugin = entry != nullptr ? entry() : nullptr;
  if (plugin == nullptr || plugin->interface_number != mpi::kInterface ||
      plugin->mumps_structure_size != sizeof(DMUMPS_STRUC_C)) {
    unavailable(std::string(kName) + " is of another version of this library or of MUMPS");
  }
  return *plugin;
#endif
}

/// Of calls after a join.
void require(const char* error) {
  if (error != nullptr) throw SolverLost(error);
}

void join_ranks(const mpi::Plugin& plugin) {
  static std::atomic<bool> joined = false;  // once: what fails later has failed on the way
  if (const char* error = plugin.join(mpi::Role::Solver, library_version()); error != nullptr) {
    if (joined) throw SolverLost(error);
    throw SolverUnavailable(error);
  }
  joined = true;
}

}  // namespace

const char* library_version() { return IPMINMAX_VERSION; }

const mpi::Plugin& mpi_plugin() {
  static std::mutex mutex;
  static const mpi::Plugin* loaded = nullptr;
  const std::lock_guard lock(mutex);
  if (loaded == nullptr) loaded = &load();
  return *loaded;
}

MpiMumps::MpiMumps(void* data, int initialize) : plugin_(mpi_plugin()), data_(data) {
  join_ranks(plugin_);
  instance_ = plugin_.create(data);
  static_cast<DMUMPS_STRUC_C*>(data)->job = initialize;
  run();
}

void MpiMumps::run() { require(plugin_.run(instance_, data_)); }

}  // namespace ipminmax
