#include "linalg/solver_library.hpp"

#include <dlfcn.h>

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <system_error>

namespace ipminmax {
namespace {

struct Library {
  std::string file;
  std::vector<const char*> shown_by;  ///< a function that shows that it can be used, by its names
  void* handle = nullptr;             ///< never closed: it may have threads
};

std::mutex& libraries_mutex() {
  static std::mutex mutex;
  return mutex;
}

std::map<LinearSolver, Library>& libraries() {
  using enum LinearSolver;
  static std::map<LinearSolver, Library> by_kind{
      {Ma57, {"libhsl.so", {"ma57bd_", "ma57bd", "MA57BD"}}},
      {Ma97, {"libhsl.so", {"ma97_factor_d"}}},
      {Spral, {"libspral.so", {"spral_ssids_factor_ptr32"}}},
      {Pardiso, {"libpardiso.so", {"pardiso", "pardiso_"}}},
      {PardisoMkl, {"libmkl_rt.so", {"pardiso", "pardiso_"}}}};
  return by_kind;
}

/// Under the mutex.
Library& library_of(LinearSolver kind) {
  const auto found = libraries().find(kind);
  if (found == libraries().end()) {
    throw SolverUnavailable("this solver has no library of its own");
  }
  return found->second;
}

}  // namespace

void use_solver_library(LinearSolver kind, const std::string& file) {
  const std::lock_guard lock(libraries_mutex());
  Library& library = library_of(kind);
  if (library.file == file) return;
  library.file = file;
  library.handle = nullptr;
}

LoadedFunction SolverLibrary::find(const std::vector<const char*>& names) const {
  const std::lock_guard lock(libraries_mutex());
  Library& library = library_of(kind);
  if (library.handle == nullptr) {
    std::error_code unknown;
    if (std::filesystem::is_fifo(library.file, unknown)) {  // opening it might wait for ever
      throw SolverUnavailable(library.file + " is a pipe");
    }
    library.handle = dlopen(library.file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library.handle == nullptr) throw SolverUnavailable(dlerror());
  }
  for (const char* name : names) {
    if (void* function = dlsym(library.handle, name); function != nullptr) return {function};
  }
  throw SolverUnavailable(library.file + " has no function " + names.front());
}

std::string missing_solver_library(LinearSolver kind) {
  const auto library = libraries().find(kind);
  if (library == libraries().end()) return {};
  try {
    static_cast<void>(SolverLibrary(kind).find(library->second.shown_by));
  } catch (const SolverUnavailable& error) {
    return error.what();
  }
  return {};
}

}  // namespace ipminmax
