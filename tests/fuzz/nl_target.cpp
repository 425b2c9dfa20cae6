#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <answer.hpp>
#include <fuzz/targets.hpp>
#include <nl_check.hpp>
#include <nl_problem.hpp>

#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax::testing {
namespace {

/// What the sanitizers write.
bool is_sanitizer_report(const std::string& text) {
  // A crash in the library alone ends the child, which is what the child is for.
  return (text.find("AddressSanitizer") != std::string::npos &&
          text.find("AddressSanitizer: SEGV") == std::string::npos &&
          text.find("AddressSanitizer: stack-overflow") == std::string::npos) ||
         text.find("runtime error:") != std::string::npos;
}

/// A file of this process, removed at its end.
class TemporaryFile {
 public:
  TemporaryFile()
      : name_((std::filesystem::is_directory("/dev/shm") ? std::filesystem::path("/dev/shm")
                                                         : std::filesystem::temp_directory_path()) /
              ("ipminmax_fuzz_" + std::to_string(getpid()) + ".nl")) {}
  ~TemporaryFile() { std::filesystem::remove(name_); }
  [[nodiscard]] std::string put(const std::string& bytes) const {
    std::ofstream(name_, std::ios::binary) << bytes;
    return name_.string();
  }

 private:
  std::filesystem::path name_;
};

void solve_briefly(const std::string& file) {
  const Ipopt::SmartPtr<NlProblem> problem = new NlProblem(file, -1);
  const Ipopt::SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
  application->Options()->SetIntegerValue("max_iter", 3);
  application->Options()->SetNumericValue("max_wall_time", 1.0);
  application->RethrowNonIpoptException(true);
  if (application->Initialize("") != Ipopt::Solve_Succeeded) std::abort();
  application->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(problem)));
  SolutionFile solution = problem->solution_file(application->LastResult());
  solution.message = message_of(application->LastResult(), *problem);
  if (solution.text().empty() || solution.binary().empty()) std::abort();
}

}  // namespace

void fuzz_nl(const std::string& bytes) {
  static const TemporaryFile file;
  try {
    check_nl_text(bytes, "fuzz.nl");
    solve_briefly(file.put(bytes));
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    if (!is_sanitizer_report(text)) return;  // refused
    std::fprintf(stderr, "%s\n", text.c_str());
    std::abort();
  }
}

}  // namespace ipminmax::testing
