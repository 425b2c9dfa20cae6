#include <pthread.h>
#include <sanitizer/common_interface_defs.h>

#include <cstddef>
#include <cstdint>

#include <fuzz/targets.hpp>

/// In the child that reads a file first, exit() is a refusal and no finding of libFuzzer's.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  return pthread_atfork(nullptr, nullptr,
                        [] { static_cast<void>(__sanitizer_acquire_crash_state()); });
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ipminmax::testing::fuzz_nl({reinterpret_cast<const char*>(data), size});
  return 0;
}
