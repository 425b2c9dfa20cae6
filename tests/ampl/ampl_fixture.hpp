#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace ipminmax::testing {

/// A folder of its own for each test.
class Ampl : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern =
        (std::filesystem::temp_directory_path() / "ipminmax_ampl_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }

  // NOLINTNEXTLINE(modernize-use-nodiscard): it writes a file
  std::string put(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }
  [[nodiscard]] std::string get(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(path(name), std::ios::binary).rdbuf();
    return text.str();
  }

  /// Exit code; output and errors are in out_ and err_.
  int run(const std::string& arguments, const std::string& environment = "") {
    const std::string command = "cd '" + folder_.string() + "' && OPENBLAS_NUM_THREADS=1 " +
                                environment + " '" IPMINMAX_EXECUTABLE "' " + arguments +
                                " >out.txt 2>err.txt";
    const int status = std::system(command.c_str());
    out_ = get("out.txt");
    err_ = get("err.txt");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::filesystem::path folder_;
  std::string out_, err_;
};

}  // namespace ipminmax::testing
