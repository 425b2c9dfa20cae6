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
#include <support/sanitizer.hpp>

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
      const std::string text = error.what();
      // What a sanitizer finds in the child is no refusal.
      EXPECT_EQ(text.find("Sanitizer"), std::string::npos) << text;
      EXPECT_EQ(text.find("runtime error"), std::string::npos) << text;
      return text;
    }
  }
  static std::string replaced(std::string text, const std::string& what, const std::string& by) {
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), by);
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

// Places of Jacobian entries follow from the column counts of segment k: the library wrote beyond
// its arrays, and so did we.
TEST_F(AmplDamaged, WrongColumnCountsAreRefused) {
  const std::string whole = game(Format::Text);
  ASSERT_EQ(message_for(whole), "");
  const std::size_t counts = whole.find("\nk");
  ASSERT_NE(counts, std::string::npos);
  const std::size_t line = whole.find('\n', counts + 1) + 1, end = whole.find('\n', line);
  for (const char* count : {"5", "2000", "0", "-1", "2147483647"}) {
    std::string text = whole;
    const std::string message = message_for(text.replace(line, end - line, count));
    EXPECT_NE(message.find("column count"), std::string::npos) << count << ": " << message;
  }
}

TEST_F(AmplDamaged, TheMessageNamesLineAndCause) {
  const std::string whole =
      "g3 1 1 0\n 2 1 1 0 0\n 1 1\n 0 0\n 2 2 2\n 0 0 0 1\n 0 0 0 0 0\n 2 2\n 0 0\n 0 0 0 0 0\n"
      "S0 1 player\n1 1\n"
      "C0\no0\nv0\nv1\n"
      "O0 0\no0\no5\nv0\nn2\no16\no5\nv1\nn2\n"
      "x1\n0 1\nr\n1 10\nb\n3\n3\nk1\n1\nJ0 2\n0 0\n1 0\nG0 2\n0 0\n1 0\n";
  ASSERT_EQ(message_for(whole), "");
  const struct {
    const char* what;
    const char* by;
    const char* message;
  } damages[] = {
      {"v1\n", "v2\n", "line 16: variable 2, but the header counts 2"},
      {"v1\n", "v-1\n", "line 16: variable -1"},
      {"J0 2\n0 0\n", "J0 2\n7 0\n", "line 36: variable 7"},
      {"J0 2\n0 0\n", "J0 2\n1 0\n", "variable 1"},
      {"G0 2\n0 0\n", "G0 2\n1 0\n", "variable 1 twice in a gradient"},
      {"G0 2\n0 0\n", "G0 2\n-1 0\n", "variable -1"},
      {"o5", "o99", "unknown operation o99"},
      {"o5", "o82", "unknown operation o82"},
      {"o5\nv0\nn2", "f0 1\nv0", "function 0, but the header counts 0"},
      {"o16", "o54\n3000", "3000 operands"},
      {"o0\nv0", "o57\nv0", "operation round has no derivatives"},
      {"n2", "h3:abc", "a string where a number is expected"},
      {"O0 0\n", "O1 0\n", "objective 1, but the header counts 1"},
      {"C0\n", "C7\n", "constraint 7, but the header counts 1"},
      {"C0\n", "V2 0 0\n", "a defined variable that the header does not count"},
      {"1 1\nC0", "2 1\nC0", "suffix of item 2"},
      {"x1\n0 1", "x1\n2 1", "start value 2"},
      {"x1\n0 1", "x9\n0 1", "9 start values"},
      {"k1\n1\n", "", "line 34: a number is missing"},
      {"\n3\n3\n", "\n3\n8\n", "no bounds of variable 1"},
      {"1 10", "1 nan", "a bound is not a number"},
      {" 2 2 2\n", " 3 2 2\n", "wrong counts in the header"},
      {" 0 0 0 0 0\nS", " 0 0 1 0 0\nS", "without defined variable 0"},
      {"x1", "Z1", "no known letter"},
  };
  for (const auto& damage : damages) {
    const std::string message = message_for(replaced(whole, damage.what, damage.by));
    EXPECT_NE(message.find(damage.message), std::string::npos)
        << damage.what << " -> " << damage.by << ": " << message;
  }
}

TEST_F(AmplDamaged, DefinedVariablesComeBeforeTheirUse) {
  const auto model = [](const char* definition, const char* objective) {
    return std::string(
               "g3 1 1 0\n 1 0 1 0 0\n 0 1\n 0 0\n 0 1 0\n 0 0 0 1\n 0 0 0 0 0\n 0 1\n"
               " 0 0\n 0 0 1 0 0\n") +
           definition + objective + "b\n3\nk0\nG0 1\n0 0\n";
  };
  const char* definition = "V1 1 0\n0 2\nn-3\n";  // 2 v0 - 3
  const char* objective = "O0 0\no5\nv1\nn2\n";
  EXPECT_EQ(message_for(model(definition, objective)), "");
  EXPECT_NE(message_for(model(objective, definition)).find("before its definition"),
            std::string::npos);
  EXPECT_NE(message_for(model("V1 0 0\no5\nv1\nn2\n", objective)).find("before its definition"),
            std::string::npos);
  EXPECT_NE(message_for(model("V1 1 0\n1 2\nn-3\n", objective)).find("variable 1"),
            std::string::npos);
}

TEST_F(AmplDamaged, AModelWithoutVariablesIsNotCalledDamaged) {
  const std::string model =
      "g3 1 1 0\n 0 0 1 0 0\n 0 0\n 0 0\n 0 0 0\n 0 0 0 1\n 0 0 0 0 0\n 0 0\n 0 0\n 0 0 0 0 0\n"
      "O0 0\nn5\n";
  for (const char* end : {"", "b\n", "b\nk0\n", "k-1\nb\n"})
    EXPECT_EQ(message_for(model + end), "") << end;
  EXPECT_NE(message_for(model + "G0 1\n0 1\n"), "");  // a gradient of what?
}

TEST_F(AmplDamaged, DeepFormulasDoNotEndTheProcess) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "a sanitizer takes the signal of a full stack";
  std::string objective = "O0 0\n";
  for (int i = 0; i < 2000000; ++i) objective += "o16\n";
  const std::string message = message_for(
      "g3 1 1 0\n 1 0 1 0 0\n 0 1\n 0 0\n 0 1 0\n 0 0 0 1\n 0 0 0 0 0\n 0 1\n 0 0\n"
      " 0 0 0 0 0\n" +
      objective + "v0\nb\n3\nk0\nG0 1\n0 0\n");
  if (!message.empty()) {
    EXPECT_NE(message.find("nested deeply"), std::string::npos) << message;
  }
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
    const std::string message = message_for(text);
    EXPECT_NE(message.find("wrong counts"), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace ipminmax::testing
