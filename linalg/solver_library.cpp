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
  void* handle = nullptr;  // never closed: it may have threads
};

std::mutex& libraries_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// By kind; under the mutex.
Library& library_of(LinearSolver kind) {
  static std::map<LinearSolver, Library> libraries{{LinearSolver::Ma57, {"libhsl.so"}},
                                                   {LinearSolver::Ma97, {"libhsl.so"}},
                                                   {LinearSolver::Spral, {"libspral.so"}},
                                                   {LinearSolver::Pardiso, {"libpardiso.so"}},
                                                   {LinearSolver::PardisoMkl, {"libmkl_rt.so"}}};
  const auto found = libraries.find(kind);
  if (found == libraries.end()) throw SolverUnavailable("this solver has no library of its own");
  return found->second;
}

/// Null: not found.
void* find_function(const Library& library, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (void* function = dlsym(library.handle, name); function != nullptr) return function;
  }
  return nullptr;
}

}  // namespace

void use_solver_library(LinearSolver kind, const std::string& file) {
  const std::lock_guard lock(libraries_mutex());
  Library& library = library_of(kind);
  if (library.file != file) library = {file};
}

void* solver_function(LinearSolver kind, std::initializer_list<const char*> names) {
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
  void* function = find_function(library, names);
  if (function == nullptr) {
    throw SolverUnavailable(library.file + " has no function " + *names.begin());
  }
  return function;
}

std::string missing_solver_library(LinearSolver kind) {
  try {
    if (kind == LinearSolver::Ma57) {
      static_cast<void>(solver_function(kind, {"ma57bd_", "ma57bd", "MA57BD"}));
    } else if (kind == LinearSolver::Ma97) {
      static_cast<void>(solver_function(kind, {"ma97_factor_d"}));
    } else if (kind == LinearSolver::Spral) {
      static_cast<void>(solver_function(kind, {"spral_ssids_factor_ptr32"}));
    } else if (kind == LinearSolver::Pardiso || kind == LinearSolver::PardisoMkl) {
      static_cast<void>(solver_function(kind, {"pardiso", "pardiso_"}));
    }
  } catch (const SolverUnavailable& error) {
    return error.what();
  }
  return {};
}

}  // namespace ipminmax
