#pragma once

#include <link.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include <support/sanitizer.hpp>

/// Lets chosen calls of malloc and its kin fail, those of operator new and of shared libraries
/// among them, by taking glibc's place. For one source file of an executable; not under sanitizers.
namespace ipminmax::testing {

/// Who allocates, by the return address.
enum class Allocator {
  Own,   ///< the executable, the C++ library, Ipopt, METIS, AMPL's library
  Other  ///< MUMPS, Fortran, BLAS, the C library and all else
};

class FailingMalloc {
 public:
  /// Counts only.
  void count(Allocator whose) { arm(whose, 0, false); }
  /// From now on the k-th call of this thread fails, k >= 1; lasting: and all later ones.
  void arm(Allocator whose, long k, bool lasting) {
    find_own_objects();
    whose_ = whose;
    at_ = k;
    lasting_ = lasting;
    calls_ = 0;
    on_ = true;
  }
  /// Calls since then.
  long disarm() {
    on_ = false;
    return calls_;
  }
  [[nodiscard]] bool fails(const void* caller) {
    if (!on_ || is_own(caller) != (whose_ == Allocator::Own)) return false;
    ++calls_;
    if (at_ == 0 || calls_ < at_ || (calls_ > at_ && !lasting_)) return false;
    errno = ENOMEM;
    return true;
  }

 private:
  struct Range {
    std::uintptr_t begin, end;
  };
  [[nodiscard]] bool is_own(const void* address) const {
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    for (const Range& range : own_) {
      if (at >= range.begin && at < range.end) return true;
    }
    return false;
  }
  /// Executable segments; the executable itself has no name.
  void find_own_objects() {
    const auto visit = [](dl_phdr_info* object, std::size_t, void* data) {
      const std::string_view path = object->dlpi_name;
      const std::string_view name = path.substr(path.rfind('/') + 1);
      if (!path.empty() && !name.starts_with("libstdc++") && !name.starts_with("libmetis") &&
          !name.starts_with("libipopt") && !name.starts_with("libamplsolver")) {
        return 0;
      }
      auto& self = *static_cast<FailingMalloc*>(data);
      for (int k = 0; k < object->dlpi_phnum; ++k) {
        const auto& segment = object->dlpi_phdr[k];
        if (segment.p_type != PT_LOAD || (segment.p_flags & PF_X) == 0) continue;
        const std::uintptr_t begin = object->dlpi_addr + segment.p_vaddr;
        if (self.ranges_ < self.own_.size()) {
          self.own_[self.ranges_++] = {begin, begin + segment.p_memsz};
        }
      }
      return 0;
    };
    if (ranges_ == 0) dl_iterate_phdr(visit, this);
  }

  bool on_ = false, lasting_ = false;
  Allocator whose_ = Allocator::Own;
  long at_ = 0, calls_ = 0;
  std::array<Range, 16> own_{};
  std::size_t ranges_ = 0;
};

inline thread_local constinit FailingMalloc failing_malloc;

}  // namespace ipminmax::testing

#if !IPMINMAX_UNDER_SANITIZER
// The names called are glibc's own for its allocator. Not inlined, or the compiler warns of what it
// takes for a use after free().
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

[[gnu::noinline]] void* malloc(std::size_t size) {
  if (ipminmax::testing::failing_malloc.fails(__builtin_return_address(0))) return nullptr;
  return __libc_malloc(size);
}
[[gnu::noinline]] void* calloc(std::size_t count, std::size_t size) {
  if (ipminmax::testing::failing_malloc.fails(__builtin_return_address(0))) return nullptr;
  return __libc_calloc(count, size);
}
[[gnu::noinline]] void* realloc(void* old, std::size_t size) {
  if (ipminmax::testing::failing_malloc.fails(__builtin_return_address(0))) return nullptr;
  return __libc_realloc(old, size);
}
[[gnu::noinline]] void* aligned_alloc(std::size_t alignment, std::size_t size) {
  if (ipminmax::testing::failing_malloc.fails(__builtin_return_address(0))) return nullptr;
  return __libc_memalign(alignment, size);
}
[[gnu::noinline]] int posix_memalign(void** memory, std::size_t alignment,
                                     std::size_t size) noexcept {
  if (ipminmax::testing::failing_malloc.fails(__builtin_return_address(0))) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : ENOMEM;
}
}
#endif
