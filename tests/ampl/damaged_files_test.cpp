// Damaged .nl files are refused with a message; no file crashes or stops the program.

#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <ampl/ampl_fixture.hpp>
#include <nl_problem.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/nl_writer.hpp>

namespace ipminmax::testing {
namespace {

using Format = NlWriter::Format;

class AmplDamaged : public Ampl {
 protected:
  /// Reads and evaluates; the message when the file is refused.
  std::string message_for(const std::string& content) {
    const std::string file = put("damaged.nl", content);
    try {
      const NlProblem problem(file, -1);
      return {};
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  static std::string game(Format format) {
    const SmallProblem& problem = small_problem("eq_coupled");
    return NlWriter(problem.model, problem.starts.front(), format).write();
  }
  static std::string minimization(Format format) {
    const MinimizationProblem& problem = hock_schittkowski("hs071");
    return NlWriter(problem.model, problem.start, format).write();
  }
};

TEST_F(AmplDamaged, TheFilesThemselvesAreRead) {
  for (const Format format : {Format::Text, Format::Binary}) {
    EXPECT_EQ(message_for(game(format)), "");
    EXPECT_EQ(message_for(minimization(format)), "");
  }
}

TEST_F(AmplDamaged, EveryCutIsRefused) {
  for (const Format format : {Format::Text, Format::Binary}) {
    for (const std::string& whole : {game(format), minimization(format)}) {
      const std::size_t step = 1 + whole.size() / 100;
      for (std::size_t length = 0; length < whole.size(); length += step)
        EXPECT_NE(message_for(whole.substr(0, length)), "") << length << " of " << whole.size();
      EXPECT_NE(message_for(whole.substr(0, whole.size() - 1)), "");
    }
  }
}

TEST_F(AmplDamaged, CutsAtLineEndsAreRefused) {
  for (const std::string& whole : {game(Format::Text), minimization(Format::Text)}) {
    for (std::size_t end = whole.find('\n'); end + 1 < whole.size();
         end = whole.find('\n', end + 1))
      EXPECT_NE(message_for(whole.substr(0, end + 1)), "") << end;
  }
}

TEST_F(AmplDamaged, RandomDamageEndsInARefusalOrAModel) {
  std::mt19937 random(7);
  int refused = 0;
  constexpr int kFiles = 300;
  for (int i = 0; i < kFiles; ++i) {
    const Format format = i % 2 == 0 ? Format::Text : Format::Binary;
    std::string text = i % 4 < 2 ? game(format) : minimization(format);
    const auto place = [&] { return random() % text.size(); };
    switch (i % 3) {
      case 0:
        text[place()] = static_cast<char>(random() % 256);
        break;
      case 1:
        text.erase(place(), 1 + random() % 8);
        break;
      default:
        text.insert(place(), text.substr(place(), 1 + random() % 8));
    }
    refused += !message_for(text).empty();
  }
  EXPECT_GT(refused, kFiles / 2);
}

TEST_F(AmplDamaged, OtherFilesAreRefused) {
  for (const std::string& content :
       {std::string(), std::string("\n"), std::string("hello\n"), std::string(1000, '\0'),
        std::string("g3 1 1 0\n") + " 2000000000 2000000000 1 0 0\n",
        std::string("g3 1 1 0\n") + " -1 -1 -1 0 0\n"})
    EXPECT_NE(message_for(content), "");
}

TEST_F(AmplDamaged, ImpossibleCountsAreRefusedBeforeMemoryIsAsked) {
  for (const char* count : {"2000000000", "0", "-3"}) {
    std::string text = minimization(Format::Text);
    const std::size_t first = text.find('\n') + 2;
    text.replace(first, text.find(' ', first) - first, count);
    EXPECT_NE(message_for(text), "") << count;
    if (count[0] == '2') {
      EXPECT_NE(message_for(text).find("wrong counts"), std::string::npos) << message_for(text);
    }
  }
}

}  // namespace
}  // namespace ipminmax::testing
