// The fuzzers' corpus, findings among it, goes through their targets: nothing may crash, and under
// sanitizers nothing be found.

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include <fuzz/targets.hpp>
#include <nl_check.hpp>

namespace ipminmax::testing {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

template <class Target>
int replay(const char* folder, Target target) {
  int files = 0;
  for (const auto& entry :
       fs::directory_iterator(fs::path(IPMINMAX_SOURCE_DIR) / "tests/fuzz/corpus" / folder)) {
    SCOPED_TRACE(entry.path().string());
    target(bytes_of(entry.path()));
    ++files;
  }
  return files;
}

TEST(Corpus, NlFiles) { EXPECT_GE(replay("nl", fuzz_nl), 10); }

TEST(Corpus, OptionsFiles) { EXPECT_GE(replay("options", fuzz_options), 5); }

TEST(Corpus, CallsInC) { EXPECT_GE(replay("c", fuzz_c), 3); }

// Seeds that are refused would seed nothing.
TEST(Corpus, SeedsAreValid) {
  int seeds = 0;
  for (const auto& entry :
       fs::directory_iterator(fs::path(IPMINMAX_SOURCE_DIR) / "tests/fuzz/corpus/nl")) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("seed_")) continue;
    EXPECT_NO_THROW(check_nl_text(bytes_of(entry.path()), name)) << name;
    ++seeds;
  }
  EXPECT_GE(seeds, 10);
}

}  // namespace
}  // namespace ipminmax::testing
