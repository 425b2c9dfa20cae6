// The questions of the other doors, asked of the executable, get the same answer.
#include <string>
#include <vector>

#include <answer.hpp>
#include <nl_problem.hpp>

#include <support/door_questions.hpp>
#include <support/doors.hpp>
#include <support/nl_writer.hpp>

#include "adapter/ipopt/tnlp_problem.hpp"
#include "ampl_fixture.hpp"
#include "core/answer.hpp"

namespace ipminmax::testing {
namespace {

using AmplDoor = Ampl;

/// Lines of a file.
std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST_F(AmplDoor, GivesTheAnswerOfTheLibrary) {
  for (const DoorQuestion& question : door_questions()) {
    const std::string file =
        put("door.nl",
            NlWriter(door_model(question.robust), kDoorStart, NlWriter::Format::Text).write());
    const Ipopt::SmartPtr<NlProblem> nl = new NlProblem(file, -1);
    TnlpProblem model(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(nl)));
    ASSERT_EQ(model.load(), "");
    const Answer answer = ipminmax::run(model, question.options());

    std::string arguments = "door -AMPL minmax_points_file=points.csv";
    for_each_option(question.options(), [&](const std::string& name, const auto& value) {
      using Value = std::decay_t<decltype(value)>;
      if constexpr (std::is_same_v<Value, std::string>) {
        arguments += " " + name + "=" + value;
      } else {
        arguments += " " + name + "=" + std::to_string(value);
      }
    });
    SCOPED_TRACE(arguments + (question.robust ? ", robust" : ""));
    ASSERT_EQ(run(arguments), 0) << err_;
    const std::vector<std::string> solution = lines_of(get("door.sol"));
    ASSERT_GT(solution.size(), 4U);
    std::vector<double> primals;
    for (const std::string& line : solution) {  // the variables are the last numbers before objno
      if (line.starts_with("objno")) break;
      char* end = nullptr;
      const double value = std::strtod(line.c_str(), &end);
      if (end == line.c_str() + line.size() && !line.empty()) primals.push_back(value);
    }
    ASSERT_GE(primals.size(), 2U);
    EXPECT_EQ(std::vector(primals.end() - 2, primals.end()), answer.best.v);
    const std::string text = get("door.sol");
    const auto said = statements(answer.best);
    EXPECT_NE(text.find("over all y: " + said[2]), std::string::npos) << said[2] << '\n' << text;
    EXPECT_NE(text.find("over x: " + said[3]), std::string::npos) << said[3] << '\n' << text;
    EXPECT_EQ(text.find("certified local minmax") != std::string::npos,
              answer.best.certificate.kind == PointKind::LocalMinmax);
    EXPECT_EQ(lines_of(get("points.csv")).size(), answer.points.size() + 1);
  }
}

}  // namespace
}  // namespace ipminmax::testing
