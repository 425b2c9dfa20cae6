// Full disks, closed output, signals: an error and its exit code, and never a stale or cut .sol.

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <checked_file.hpp>
#include <child_process.hpp>
#include <nl_problem.hpp>
#include <support/nl_writer.hpp>

namespace ipminmax::testing {
namespace {

class AmplFaults : public Ampl {
 protected:
  void SetUp() override {
    Ampl::SetUp();
    Model model;
    Expression sum = model.variable(Player::Min, "x0");
    sum = square(sum - 1.0);
    for (int i = 1; i < 60; ++i)
      sum = sum + square(model.variable(Player::Min, "x" + std::to_string(i)) - 1.0 / i);
    model.objective(sum);
    put("model.nl", NlWriter(model, {}, NlWriter::Format::Text).write());
  }
  void put_stale() const { put("model.sol", "stale"); }
  [[nodiscard]] bool has_solution() const { return std::filesystem::exists(path("model.sol")); }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(folder_), {});
  }
};

TEST_F(AmplFaults, FilesThatCannotBeWrittenAreErrors) {
  EXPECT_EQ(run("model.nl -o/dev/full print_level=0"), 1);
  EXPECT_NE(err_.find("cannot write /dev/full: No space left"), std::string::npos) << err_;
  EXPECT_EQ(run("model.nl print_level=0 output_file=/dev/full file_print_level=5"), 1);
  EXPECT_NE(err_.find("cannot write /dev/full: No space left"), std::string::npos) << err_;
  EXPECT_EQ(run("model.nl print_level=0 -s output_file=nowhere/log"), 1);
  EXPECT_NE(err_.find("cannot write nowhere/log"), std::string::npos) << err_;
  ASSERT_EQ(run("model.nl print_level=0 -s output_file=log.txt file_print_level=5"), 0) << err_;
  EXPECT_NE(get("log.txt").find("EXIT: Local Minmax Found"), std::string::npos);
  const std::string once = get("log.txt");
  const std::string again = "model.nl print_level=0 output_file=log.txt file_print_level=5";
  ASSERT_EQ(run(again + " file_append=yes"), 0) << err_;
  EXPECT_TRUE(get("log.txt").starts_with(once));
  EXPECT_GT(get("log.txt").size(), once.size());
  ASSERT_EQ(run(again), 0) << err_;
  EXPECT_LT(get("log.txt").size(), 2 * once.size() - 100);
}

// Opening a pipe waits for its reader, and no signal ends that.
TEST_F(AmplFaults, PipesThatNobodyReadsAreErrors) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  for (const char* arguments :
       {"-opipe", "output_file=pipe file_print_level=5", "minmax_points_file=pipe"}) {
    EXPECT_EQ(run(std::string("model.nl print_level=0 ") + arguments, "timeout 20"), 1)
        << arguments;
    EXPECT_NE(err_.find("cannot write pipe"), std::string::npos) << err_;
  }
  EXPECT_EQ(run("model.nl print_level=0 linear_solver=ma57 hsllib=./pipe", "timeout 20"), 2);
  EXPECT_NE(err_.find("hsllib = ./pipe cannot be used: ./pipe is a pipe"), std::string::npos)
      << err_;
}

TEST_F(AmplFaults, PointsThatCannotBeWrittenAreErrors) {
  for (const char* file : {"/dev/full", "nowhere/points.csv"}) {
    EXPECT_EQ(run(std::string("model.nl -s print_level=0 minmax_points_file=") + file), 1);
    EXPECT_NE(err_.find(std::string("cannot write ") + file), std::string::npos) << err_;
    EXPECT_TRUE(has_solution());
  }
}

TEST_F(AmplFaults, NothingIsWrittenOverTheModel) {
  const std::string model = get("model.nl");
  for (const char* option : {"output_file", "minmax_points_file"}) {
    EXPECT_EQ(run(std::string("model print_level=0 ") + option + "=./model.nl"), 2);
    EXPECT_NE(err_.find(std::string(option) + " = ./model.nl would write over the model model.nl"),
              std::string::npos)
        << err_;
    EXPECT_EQ(get("model.nl"), model);
  }
}

// The limit on file sizes is 512 or 1024 bytes, the .sol longer: SIGXFSZ ended the program.
TEST_F(AmplFaults, AFileSizeLimitIsAnError) {
  put_stale();
  EXPECT_EQ(run("model.nl -AMPL print_level=0", "true && ulimit -f 1 &&"), 1);
  EXPECT_NE(err_.find("cannot write"), std::string::npos) << err_;
  EXPECT_NE(err_.find("File too large"), std::string::npos) << err_;
  EXPECT_FALSE(has_solution());
  EXPECT_EQ(files(), 3);  // model.nl, out.txt, err.txt: no temporary file
}

/// On a disk of its own, mounted by a child that may.
class AmplDisk : public AmplFaults {
 protected:
  void SetUp() override {
    AmplFaults::SetUp();
    may_mount_ = std::system("unshare -rm mount -t tmpfs none /tmp 2>/dev/null") == 0;
    if (!may_mount_) GTEST_SKIP() << "this process may not mount";
  }
  /// Exit code of the executable there, after some commands. What is left there goes to left_.
  int run_there(const std::string& before) {
    put("script.sh",
        "mkdir -p disk && mount -t tmpfs -o size=32k none disk && cd disk || exit 90\n"
        "cp ../model.nl . && printf stale > model.sol\n" +
            before +
            "\n'" IPMINMAX_EXECUTABLE
            "' model.nl -AMPL print_level=0 >../out.txt "
            "2>../err.txt\ncode=$?\nls > ../left.txt\ncat model.sol > ../left.sol\n"
            "exit $code\n");
    const std::string command = "cd '" + folder_.string() +
                                "' && OPENBLAS_NUM_THREADS=1 unshare -rm sh script.sh 2>/dev/null";
    const int status = std::system(command.c_str());
    err_ = get("err.txt");
    left_ = get("left.txt");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  bool may_mount_ = false;
  std::string left_;
};

TEST_F(AmplDisk, ThatHasRoomGetsTheSolution) {
  EXPECT_EQ(run_there(""), 0) << err_;
  EXPECT_NE(get("left.sol").find("objno 0 0"), std::string::npos);
}

TEST_F(AmplDisk, ThatIsFullIsAnErrorAndLeavesNothing) {
  EXPECT_EQ(run_there("rm model.sol; cat /dev/zero > fill 2>/dev/null"), 1);
  EXPECT_NE(err_.find("No space left"), std::string::npos) << err_;
  EXPECT_EQ(left_, "fill\nmodel.nl\n");
}

TEST_F(AmplDisk, ThatIsReadOnlyIsAnError) {
  EXPECT_EQ(run_there("mount -o remount,ro ."), 1);
  EXPECT_NE(err_.find("Read-only file system"), std::string::npos) << err_;
  EXPECT_EQ(run_there("rm model.sol; mount -o remount,ro ."), 1);
  EXPECT_NE(err_.find("Read-only file system"), std::string::npos) << err_;
  EXPECT_EQ(left_, "model.nl\n");
}

TEST_F(AmplFaults, StandardOutputThatCannotBeWrittenIsAnError) {
  for (const char* output : {">/dev/full 2>err.txt; exit $?; :", ">&- 2>err.txt; exit $?; :"}) {
    put_stale();
    EXPECT_EQ(run(std::string("model.nl -s ") + output), 1) << output;
    EXPECT_NE(get("err.txt").find("cannot write standard output"), std::string::npos) << output;
    EXPECT_NE(get("model.sol").find("objno 0 0"), std::string::npos);  // written whole
  }
  EXPECT_EQ(run("model.nl -AMPL print_level=0 >&- ; exit $?; :"), 0);  // there is nothing to print
}

TEST_F(AmplFaults, AFailedRunLeavesNoStaleSolution) {
  put_stale();
  EXPECT_EQ(run("model.nl -AMPL print_level=0 nonsense=1"), 2);
  EXPECT_FALSE(has_solution());
  put_stale();
  put("model.nl", "g3 1 1 0\n");
  EXPECT_EQ(run("model -s print_level=0"), 1);
  EXPECT_FALSE(has_solution());
  put_stale();
  EXPECT_EQ(run("model print_level=0"), 1);  // not asked for: not touched
  EXPECT_TRUE(has_solution());
}

TEST_F(AmplFaults, ALinkedSolutionFileStaysALink) {
  std::filesystem::create_symlink("target.sol", path("link.sol"));
  ASSERT_EQ(run("model.nl -olink.sol print_level=0"), 0) << err_;
  EXPECT_TRUE(std::filesystem::is_symlink(path("link.sol")));
  EXPECT_NE(get("target.sol").find("objno 0 0"), std::string::npos);
}

/// A running executable whose standard output is a small pipe: it waits until somebody reads.
class Running {
 public:
  Running(const std::string& folder, const std::string& argument) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    fcntl(ends[1], F_SETPIPE_SZ, 4096);
    process_ = fork();
    if (process_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      close(ends[0]);
      close(ends[1]);
      if (chdir(folder.c_str()) != 0) _exit(99);
      execl(IPMINMAX_EXECUTABLE, "ipminmax", argument.c_str(), "-AMPL", "max_iter=100000",
            "diverging_iterates_tol=1e300", static_cast<char*>(nullptr));
      _exit(98);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  void signal(int number) const { kill(process_, number); }
  /// Reads until the text has come, or all.
  std::string read_until(const std::string& text) {
    char buffer[256];
    for (ssize_t got = 0;
         seen_.find(text) == std::string::npos && (got = read(output_, buffer, sizeof buffer)) > 0;)
      seen_.append(buffer, static_cast<std::size_t>(got));
    return seen_;
  }
  /// Exit code, negative for a signal.
  int end() {
    read_until("no such text");
    close(output_);
    int status = 0;
    waitpid(process_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t process_ = -1;
  int output_ = -1;
  std::string seen_;
};

TEST_F(AmplFaults, SignalsStopTheSolveAndTheSolutionIsWritten) {
  Model model;  // descends for ever
  const Expression x = model.variable(Player::Min, "x"), y = model.variable(Player::Min, "y");
  model.objective(square(x) + 2.0 * x + x * y - square(y));
  put("endless.nl", NlWriter(model, {0.0, 1.0}, NlWriter::Format::Text).write());
  for (const int number : {SIGINT, SIGTERM}) {
    std::filesystem::remove(path("endless.sol"));
    Running run(folder_.string(), "endless.nl");
    ASSERT_NE(run.read_until("\niter").find("\niter"), std::string::npos);
    run.signal(number);
    EXPECT_EQ(run.end(), 0);
    const std::string solution = get("endless.sol");
    EXPECT_NE(solution.find("stopped by the user"), std::string::npos) << solution;
    EXPECT_NE(solution.find("objno 0 403"), std::string::npos) << solution;
    EXPECT_NE(solution.find("\n0\n0\n2\n2\n"), std::string::npos) << solution;  // has the point
  }
}

TEST_F(AmplFaults, AReadingChildEndsWithItsParent) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    close(ends[0]);
    try_in_child("endless", 600, [&] {
      [[maybe_unused]] const ssize_t written = write(ends[1], "x", 1);
      for (;;) pause();
    });
    _exit(0);
  }
  close(ends[1]);
  char letter = 0;
  ASSERT_EQ(read(ends[0], &letter, 1), 1);
  kill(parent, SIGKILL);
  waitpid(parent, nullptr, 0);
  pollfd descriptor{ends[0], POLLIN, 0};
  EXPECT_EQ(poll(&descriptor, 1, 30000), 1);  // the last writer is gone
  EXPECT_EQ(read(ends[0], &letter, 1), 0);
  close(ends[0]);
}

TEST_F(AmplFaults, TheChildsEndIsExplained) {
  const auto message = [](const std::function<void()>& attempt) -> std::string {
    try {
      try_in_child("a.nl", 1, attempt);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message([] {}), "");
  EXPECT_EQ(message([] { throw std::runtime_error("that is why"); }), "that is why");
  EXPECT_NE(message([] {
              for (volatile int k = 0;;) static_cast<void>(k);
            }).find("no end after 1 seconds"),
            std::string::npos);
  EXPECT_EQ(message([] { sleep(2); }), "");  // another program has the processor
  EXPECT_NE(message([] { raise(SIGKILL); }).find("killed"), std::string::npos);
  const std::string refused = message([] {
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, "bad line", 8);
    _exit(1);
  });
  EXPECT_NE(refused.find("refuses it; it said:\nbad line"), std::string::npos) << refused;
  EXPECT_THROW(try_in_child("a.nl", 9, [] { throw std::bad_alloc(); }), std::bad_alloc);
  EXPECT_THROW(try_in_child("a.nl", 9,
                            [] {
                              const char text[] = "malloc(80) failure: ran out of memory.\n";
                              [[maybe_unused]] const ssize_t written =
                                  write(STDERR_FILENO, text, sizeof text - 1);
                              _exit(1);
                            }),
               std::bad_alloc);
}

}  // namespace
}  // namespace ipminmax::testing
