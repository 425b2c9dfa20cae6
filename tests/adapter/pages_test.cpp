// The pages in docs/ name what the code names. Their programs are run by tests/docs.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "adapter/ipopt/log.hpp"
#include "adapter/ipopt/status.hpp"
#include "core/model/status_table.hpp"

namespace ipminmax {
namespace {

std::vector<std::string> lines_of(const std::string& page) {
  std::ifstream file(std::string(IPMINMAX_SOURCE_DIR) + "/docs/" + page);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  EXPECT_FALSE(lines.empty()) << page;
  return lines;
}

/// A file of the repository, as pages name it: from its top, from core/, or as an installed header.
bool is_there(const std::string& name) {
  const std::filesystem::path root(IPMINMAX_SOURCE_DIR);
  for (const char* folder : {"", "core", "examples", "examples/python", "tests"})
    if (std::filesystem::exists(root / folder / name)) return true;
  return false;
}

TEST(Pages, NameFilesThatAreThere) {
  const std::regex file(
      R"(((?:ipminmax/)?(?:adapter|bench|core|examples|linalg|method|search|tests)/[\w./-]+\.(?:cpp|c|hpp|h|md|nl|py|sh)))");
  int names = 0;
  for (const auto& page : std::filesystem::directory_iterator(IPMINMAX_SOURCE_DIR "/docs")) {
    if (page.path().extension() != ".md") continue;
    for (const std::string& line : lines_of(page.path().filename().string())) {
      for (std::sregex_iterator found(line.begin(), line.end(), file), end; found != end; ++found) {
        std::string name = found->str(1);
        if (name.starts_with("ipminmax/")) name.erase(0, std::string("ipminmax/").size());
        EXPECT_TRUE(is_there(name)) << page.path().filename() << ": " << name;
        ++names;
      }
    }
  }
  EXPECT_GT(names, 50);
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
  for (int s = 0; s <= static_cast<int>(Status::WorstCaseNotMet); ++s) {
    const auto status = static_cast<Status>(s);
    std::string returned(name_of(application_status(status)));
    if (status == Status::MaxWallTime) returned = "Maximum_WallTime_Exceeded";  // not in Ipopt 3.11
    const std::string start = "| " + std::string(name_of(status)) + " | `" + returned + "` |";
    int rows = 0;
    for (const std::string& line : page) rows += line.starts_with(start);
    EXPECT_EQ(rows, 1) << start;
  }
}

/// The lines of a named block.
std::vector<std::string> block_of(const std::vector<std::string>& page, const std::string& name) {
  std::vector<std::string> block;
  bool inside = false;
  for (const std::string& line : page) {
    if (inside && line == "```") return block;
    if (inside) block.push_back(line);
    inside = inside || line == "```cpp " + name;
  }
  ADD_FAILURE() << "no block " << name;
  return block;
}

// The page promises how little changes.
TEST(PortingPage, FourLinesOfTheProgramDiffer) {
  const std::vector<std::string> page = lines_of("porting.md");
  const std::vector<std::string> before = block_of(page, "before.cpp");
  const std::vector<std::string> after = block_of(page, "after.cpp");
  const auto missing = [](const std::vector<std::string>& lines,
                          const std::vector<std::string>& from) {
    return std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
      return std::find(from.begin(), from.end(), line) == from.end();
    });
  };
  EXPECT_EQ(missing(before, after), 4);
  EXPECT_EQ(missing(after, before), 3);
  EXPECT_EQ(before.size(), after.size() + 1);
}

/// The programs that the page promises: `folder/name` in the second column.
TEST(GuaranteesPage, EveryPromiseNamesTestsThatExist) {
  const std::filesystem::path tests = std::filesystem::path(IPMINMAX_SOURCE_DIR) / "tests";
  int promises = 0;
  bool holds = false;
  for (const std::string& line : lines_of("guarantees.md")) {
    if (line.starts_with("## ")) holds = line == "## Holds";
    if (!holds || !line.starts_with("| ") || line.starts_with("| promise |")) continue;
    const std::size_t column = line.rfind(" | ");
    ASSERT_NE(column, std::string::npos) << line;
    int named = 0;
    for (std::size_t begin = line.find('`', column); begin != std::string::npos; ++named) {
      const std::size_t end = line.find('`', begin + 1);
      ASSERT_NE(end, std::string::npos) << line;
      const std::string name = line.substr(begin + 1, end - begin - 1);
      EXPECT_TRUE(exists(tests / (name + ".cpp")) || exists(tests / (name + ".c"))) << name;
      begin = line.find('`', end + 1);
    }
    EXPECT_GT(named, 0) << line;
    ++promises;
  }
  EXPECT_GT(promises, 20);
}

TEST(ReadmePage, ListsEveryPage) {
  std::ifstream file(std::string(IPMINMAX_SOURCE_DIR) + "/README.md");
  std::ostringstream readme;
  readme << file.rdbuf();
  int pages = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(IPMINMAX_SOURCE_DIR) + "/docs")) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".md")) continue;
    EXPECT_NE(readme.str().find("`" + name + "`"), std::string::npos) << name;
    ++pages;
  }
  EXPECT_GT(pages, 5);
}

TEST(AmplPage, HasARowPerSolveResult) {
  std::string page;
  for (const std::string& line : lines_of("ampl.md")) page += line + "\n";
  std::set<int> results;
  for (int i = 0; i <= static_cast<int>(Status::WorstCaseNotMet); ++i) {
    results.insert(row_of(static_cast<Status>(i)).solve_result);
  }
  for (const int result : results) {
    const std::string number = std::to_string(result);
    bool found = false;
    for (const char* left : {"| ", ", "}) {
      for (const char* right : {" |", ","}) {
        found = found || page.find(left + number + right) != std::string::npos;
      }
    }
    EXPECT_TRUE(found) << number;
  }
  EXPECT_GT(results.size(), 15U);
}

}  // namespace
}  // namespace ipminmax
