#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "linalg/blas_threads.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/memory_limit.hpp"
#include "linalg/numbers.hpp"

extern "C" void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info,
                        unsigned long);

namespace ipminmax {
namespace {

/// Size of OpenBLAS's buffer of one thread on x86-64, the largest of its builds, and what it adds.
constexpr std::size_t kBlasBuffer = (std::size_t{128} + 16) << 20;

std::optional<double> first_number(const std::string& file_name) {
  std::ifstream file(file_name);
  std::string word;
  if (!(file >> word)) return std::nullopt;
  std::uint64_t value = 0;  // "max" is no number: no limit
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return static_cast<double>(value);
}

/// Value of a row "key value".
double value_of(const std::string& file_name, std::string_view key) {
  std::ifstream file(file_name);
  std::string name;
  double value = 0.0;
  while (file >> name >> value) {
    if (name == key) return value;
  }
  return 0.0;
}

/// What the limit of one group leaves; pages of files that nobody uses count as free.
double left_in_group(const std::string& folder, const char* limit_name, const char* usage_name,
                     std::string_view inactive_name) {
  const auto limit = first_number(folder + limit_name);
  const auto usage = first_number(folder + usage_name);
  if (!limit || !usage) return kInfinity;
  return *limit - *usage + value_of(folder + "memory.stat", inactive_name);
}

double address_space_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kInfinity;
  return static_cast<double>(limit.rlim_cur);
}

}  // namespace

double left_in_control_groups(const std::string& groups_file, const std::string& root) {
  std::ifstream groups(groups_file);
  double left = kInfinity;
  for (std::string row; std::getline(groups, row);) {
    const std::size_t first = row.find(':'), second = row.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + row.substr(first + 1, second - first - 1) + ",";
    const bool v2 = controllers == ",,";
    if (!v2 && controllers.find(",memory,") == std::string::npos) continue;
    const std::string mount = v2 ? root : root + "/memory";
    for (std::string path = row.substr(second + 1);; path.resize(path.rfind('/'))) {
      while (path.ends_with('/')) path.pop_back();
      const std::string folder = mount + path + "/";
      left =
          std::min(left, v2 ? left_in_group(folder, "memory.max", "memory.current", "inactive_file")
                            : left_in_group(folder, "memory.limit_in_bytes",
                                            "memory.usage_in_bytes", "total_inactive_file"));
      if (path.find('/') == std::string::npos) break;
    }
  }
  return left;
}

double available_memory(double max_process_bytes) {
  double pages_mapped = 0.0, pages_resident = 0.0;
  std::ifstream("/proc/self/statm") >> pages_mapped >> pages_resident;
  const auto page = static_cast<double>(sysconf(_SC_PAGESIZE));
  const double left = std::min({address_space_limit() - page * pages_mapped,
                                max_process_bytes - page * pages_resident,
                                left_in_control_groups("/proc/self/cgroup", "/sys/fs/cgroup")});
  return std::max(left, 0.0);
}

bool blas_has_memory() {
  static std::atomic<bool> has_memory{false};
  if (has_memory) return true;
  if (address_space_limit() < kInfinity) {
    const LibraryLock lock;
    const std::size_t bytes = kBlasBuffer * at(std::max(blas_threads(), 1));
    void* reserved = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                          MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (reserved == MAP_FAILED) return false;
    munmap(reserved, bytes);
    const int n = 1;
    int info = 0;
    double one = 1.0;
    dpotrf_("L", &n, &one, &n, &info, 1);
  }
  has_memory = true;
  return true;
}

}  // namespace ipminmax
