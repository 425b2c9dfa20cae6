#include "child_process.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

#include "adapter/ipopt/concat.hpp"

namespace ipminmax {
namespace {

constexpr int kRefused = 3, kNoMemory = 4;  ///< exit codes of the child
/// What a child that waits may take, over its processor time: a machine may be busy.
constexpr unsigned kWaitOverWork = 10;

[[noreturn]] void run_child(unsigned seconds, const std::function<void()>& attempt) {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  for (const int number : {SIGALRM, SIGINT, SIGTERM, SIGXCPU, SIGXFSZ}) signal(number, SIG_DFL);
  rlimit work{};
  getrlimit(RLIMIT_CPU, &work);
  work.rlim_cur = std::min<rlim_t>(work.rlim_cur, seconds);
  setrlimit(RLIMIT_CPU, &work);
  alarm(kWaitOverWork * seconds);
  int code = 0;
  try {
    attempt();
  } catch (const std::bad_alloc&) {
    code = kNoMemory;
  } catch (const std::exception& error) {
    std::fflush(nullptr);
    const char* const text = error.what();
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, std::strlen(text));
    code = kRefused;
  }
  _exit(code);
}

/// Everything until all writers have closed their end; its begin is returned.
std::string read_all(int descriptor) {
  constexpr std::size_t kLongest = 4000;
  std::string text;
  char buffer[512];
  for (;;) {
    const ssize_t got = read(descriptor, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    text.append(buffer, std::min(static_cast<std::size_t>(got), kLongest - text.size()));
  }
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  return text;
}

/// Throws what the child's end means; text: what it wrote.
void judge_end(int status, const std::string& file, unsigned seconds, const std::string& text) {
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (code == 0) return;
  if (code == kRefused) throw std::runtime_error(text);
  if (code == kNoMemory || text.find("ran out of memory") != std::string::npos)
    throw std::bad_alloc();
  std::string reason;
  if (!WIFSIGNALED(status)) {
    reason = "AMPL's library refuses it";
  } else if (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGALRM) {
    reason = concat("no end after ", seconds, " seconds");
  } else if (WTERMSIG(status) == SIGKILL) {
    reason = "the process that read it was killed, perhaps for lack of memory";
  } else {
    reason = concat("AMPL's library crashes on it (signal ", WTERMSIG(status),
                    "); where formulas are nested deeply, a larger stack helps (ulimit -s)");
  }
  throw std::runtime_error("cannot read " + file + ": " + reason +
                           (text.empty() ? "" : "; it said:\n" + text));
}

}  // namespace

void try_in_child(const std::string& file, unsigned seconds, const std::function<void()>& attempt) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("cannot open a pipe to read " + file);
  std::fflush(nullptr);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    const bool no_memory = errno == ENOMEM;
    close(ends[0]);
    close(ends[1]);
    if (no_memory) throw std::bad_alloc();
    throw std::runtime_error("cannot start a process to read " + file);
  }
  if (child == 0) {
#ifdef __linux__
    prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
    if (getppid() != parent) _exit(0);
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    run_child(seconds, attempt);
  }
  close(ends[1]);
  const std::string text = read_all(ends[0]);
  close(ends[0]);
  int status = 0;
  pid_t ended = 0;
  do ended = waitpid(child, &status, 0);
  while (ended < 0 && errno == EINTR);
  if (ended != child) throw std::runtime_error("lost the process that read " + file);
  judge_end(status, file, seconds, text);
}

}  // namespace ipminmax
