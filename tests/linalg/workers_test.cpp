// Threads that wait for pieces of one caller's work.
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cfenv>
#include <csignal>
#include <cstdlib>
#include <set>
#include <thread>
#include <vector>

#include <support/sanitizer.hpp>

#include "linalg/workers.hpp"

namespace ipminmax {
namespace {

TEST(Workers, DoEveryPieceOnceInThreadsOfTheirOwn) {
  Workers workers;
  std::vector<int> done(8, 0);
  for (int pass = 1; pass <= 200; ++pass) {
    const int count = pass % 9;
    std::vector<std::thread::id> where(static_cast<std::size_t>(count));
    workers.run(count, [&](int k) {
      ++done[static_cast<std::size_t>(k)];
      where[static_cast<std::size_t>(k)] = std::this_thread::get_id();
    });
    EXPECT_EQ(std::set(where.begin(), where.end()).size(), where.size());
    if (count > 0) {
      EXPECT_EQ(where.front(), std::this_thread::get_id());
    }
  }
  for (int k = 0; k < 8; ++k) {
    int expected = 0;
    for (int pass = 1; pass <= 200; ++pass) expected += pass % 9 > k ? 1 : 0;
    EXPECT_EQ(done[static_cast<std::size_t>(k)], expected);
  }
}

TEST(Workers, RoundAsTheCallerDoes) {
  Workers workers;
  std::array<double, 2> third{};
  const auto divide = [&] {
    workers.run(2, [&](int k) {
      volatile double three = 3.0;
      third[static_cast<std::size_t>(k)] = 1.0 / three;
    });
  };
  divide();
  EXPECT_EQ(third[0], third[1]);
  const double nearest = third[0];
  std::fesetround(FE_UPWARD);
  divide();
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(third[0], third[1]);
  EXPECT_GT(third[0], nearest);
}

TEST(Workers, LeaveSignalsToTheOtherThreads) {
  Workers workers;
  std::array<bool, 2> blocked{};
  workers.run(2, [&](int k) {
    sigset_t mask;
    pthread_sigmask(SIG_SETMASK, nullptr, &mask);
    blocked[static_cast<std::size_t>(k)] = sigismember(&mask, SIGINT) == 1;
  });
  EXPECT_FALSE(blocked[0]);
  EXPECT_TRUE(blocked[1]);
}

TEST(Workers, AreMadeAnewInAForkedChild) {
  Workers workers;
  workers.run(3, [](int) {});
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(30);
    std::atomic<int> sum{0};
    {
      Workers never_used_here;
      workers.run(3, [&](int k) { sum += k; });
    }
    std::_Exit(sum == 3 ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  std::atomic<int> sum{0};
  workers.run(3, [&](int k) { sum += k; });
  EXPECT_EQ(sum, 3);
}

TEST(Workers, EndInAForkedChildThatNeverUsesThem) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(30);
    auto* workers = new Workers;
    workers->run(2, [](int) {});
    const pid_t grandchild = fork();
    if (grandchild == 0) {
      alarm(10);
      delete workers;
      std::_Exit(0);
    }
    int status = -1;
    const bool ended = waitpid(grandchild, &status, 0) == grandchild && status == 0;
    delete workers;
    std::_Exit(ended ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST(Workers, LeaveTheWorkToTheCallerWhereThereAreNoThreadsToBeHad) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "which needs address space";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(30);
    const rlimit none{1 << 20, 1 << 20};  // less than there is: no new stack can be mapped
    setrlimit(RLIMIT_AS, &none);
    Workers workers;
    constexpr int kPieces = 100;
    std::atomic<int> sum{0}, by_caller{0};
    const std::thread::id caller = std::this_thread::get_id();
    for (int pass = 0; pass < 2; ++pass) {
      workers.run(kPieces, [&](int k) {
        sum += k;
        if (std::this_thread::get_id() == caller) ++by_caller;
      });
    }
    std::_Exit(sum == kPieces * (kPieces - 1) && by_caller > kPieces ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace ipminmax
