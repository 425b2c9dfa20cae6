// A child that is forked while another thread makes what is made once in a process can use it.
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include <gtest/gtest.h>

#include <support/sanitizer.hpp>

#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

TEST(Fork, WhileAnotherThreadMakesTheFirstApplication) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "whose allocator a fork may leave locked";
  alarm(100);  // a deadlock of this process
  for (int k = 0; k < 20; ++k) {
    // Processes in which there has been no application: one that forks while a thread of it makes
    // one.
    const pid_t process = fork();
    ASSERT_GE(process, 0);
    if (process == 0) {
      alarm(30);
      std::thread first(
          [] { const SmartPtr<MinMaxApplication> made = new MinMaxApplication(false); });
      std::this_thread::sleep_for(std::chrono::microseconds(100 + 200 * k));
      const pid_t child = fork();
      if (child == 0) {
        alarm(10);
        const SmartPtr<MinMaxApplication> second = new MinMaxApplication(false);
        std::_Exit(0);
      }
      int status = -1;
      const bool ended = waitpid(child, &status, 0) == child && status == 0;
      first.join();
      std::_Exit(ended ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(process, &status, 0), process);
    ASSERT_EQ(status, 0) << "fork " << k;
  }
  alarm(0);
}

}  // namespace
}  // namespace ipminmax
