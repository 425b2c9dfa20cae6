// One allocation after the other fails while a model is read, AMPL's library's among them: in the
// process that tries the file and in the one that reads it then. Both end in order: "out of
// memory", by exception or, where AMPL's library ends its process, by exit code 1.
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <nl_problem.hpp>
#include <support/failing_malloc.hpp>
#include <support/nl_writer.hpp>
#include <support/sanitizer.hpp>

namespace ipminmax::testing {
namespace {

constexpr int kRead = 0, kEndedByAmpl = 1, kNoMemory = 100, kOther = 101;

/// Forked children of this process do not fail.
void spare_children() {
  pthread_atfork(nullptr, nullptr, [] { failing_malloc.disarm(); });
}

/// Reads and evaluates, as a solve does.
void use(const std::string& file) {
  NlProblem problem(file, -1);
  const std::vector<double> x(3, 0.5);
  double f = 0.0;
  problem.eval_f(3, x.data(), true, f);
}

class AmplOutOfMemory : public Ampl {
 protected:
  void SetUp() override {
    if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "allocator replaced by a sanitizer";
    Ampl::SetUp();
    Model model;
    const Expression x = model.variable(Player::Min, "x"), y = model.variable(Player::Max, "y");
    const Expression z = model.variable(Player::Min, "z");
    model.objective(exp(x * y) - square(y - z) + sin(z));
    model.constraint(square(x) + z * x, -1.0, 1.0);
    model.constraint(y * z, -2.0, 2.0);
    file_ = put("model.nl", NlWriter(model, {}, NlWriter::Format::Text).write());
    use(file_);  // fills the tables of a process
  }

  /// Calls of the whole, the trying process's not counted.
  [[nodiscard]] long count() const {
    failing_malloc.count(Allocator::Own);
    use(file_);
    return failing_malloc.disarm();
  }

  /// How a process ends whose k-th allocation, and all later ones if lasting, fails.
  [[nodiscard]] int end_of(long k, bool lasting, bool children_too) const {
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child == 0) {
      alarm(20);
      if (std::freopen("/dev/null", "w", stderr) == nullptr) std::_Exit(kOther);
      if (!children_too) spare_children();
      int code = kRead;
      failing_malloc.arm(Allocator::Own, k, lasting);
      try {
        use(file_);
      } catch (const std::bad_alloc&) {
        code = kNoMemory;
      } catch (const std::exception& error) {
        failing_malloc.disarm();
        std::printf("allocation %ld: %s\n", k, error.what());
        std::fflush(nullptr);
        code = kOther;
      }
      std::_Exit(code);
    }
    int status = -1;
    return child > 0 && waitpid(child, &status, 0) == child ? status : -1;
  }

  void try_all(bool children_too) {
    const long calls = count();
    ASSERT_GT(calls, 50);
    std::map<int, int> ends;
    for (const bool lasting : {false, true}) {
      for (long k = 1; k <= calls; k += lasting ? 5 : 1) {
        SCOPED_TRACE("allocation " + std::to_string(k) + (lasting ? " and later" : ""));
        const int status = end_of(k, lasting, children_too);
        ASSERT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
        const int code = WEXITSTATUS(status);
        EXPECT_TRUE(code == kRead || code == kEndedByAmpl || code == kNoMemory) << code;
        ++ends[code];
      }
    }
    std::printf("%ld allocations: read %d, out of memory %d, ended by AMPL's library %d\n", calls,
                ends[kRead], ends[kNoMemory], ends[kEndedByAmpl]);
    EXPECT_GT(ends[kNoMemory], 20);
  }

  std::string file_;
};

TEST_F(AmplOutOfMemory, WhileTheFileIsTried) { try_all(true); }

TEST_F(AmplOutOfMemory, WhileItIsReadThen) { try_all(false); }

}  // namespace
}  // namespace ipminmax::testing
