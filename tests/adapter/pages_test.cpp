// The pages in docs/ name what the code names. Their programs are run by tests/docs.
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ipminmax/adapter/log.hpp>
#include <ipminmax/adapter/status.hpp>

namespace ipminmax {
namespace {

std::vector<std::string> lines_of(const std::string& page) {
  std::ifstream file(std::string(IPMINMAX_SOURCE_DIR) + "/docs/" + page);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  EXPECT_FALSE(lines.empty()) << page;
  return lines;
}

TEST(LogPage, DefinesEveryColumn) {
  const std::vector<std::string> page = lines_of("log.md");
  std::istringstream header(log::iteration_header());
  for (std::string column; header >> column;) {
    std::string cell;  // bars are escaped in a table
    for (const char c : column) cell += c == '|' ? std::string("\\|") : std::string(1, c);
    bool found = false;
    for (const std::string& line : page) found = found || line.starts_with("| `" + cell + "` |");
    EXPECT_TRUE(found) << column;
  }
  std::string shown = log::iteration_header();
  shown.pop_back();
  bool found = false;
  for (const std::string& line : page) found = found || line == "    " + shown;
  EXPECT_TRUE(found) << "the header shown is the one printed:\n" << shown;
}

TEST(StatusesPage, HasARowPerStatusWithItsReturnValue) {
  const std::vector<std::string> page = lines_of("statuses.md");
  for (int s = 0; s <= static_cast<int>(Status::OutOfMemory); ++s) {
    const auto status = static_cast<Status>(s);
    std::string returned(name_of(application_status(status)));
    if (status == Status::MaxWallTime) returned = "Maximum_WallTime_Exceeded";  // not in Ipopt 3.11
    const std::string start = "| " + std::string(name_of(status)) + " | `" + returned + "` |";
    int rows = 0;
    for (const std::string& line : page) rows += line.starts_with(start);
    EXPECT_EQ(rows, 1) << start;
  }
}

}  // namespace
}  // namespace ipminmax
