// The same question through every door gives the same answer.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/consistent_result.hpp>
#include <support/door_questions.hpp>
#include <support/doors.hpp>

#include "core/answer.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;

class Doors : public ::testing::TestWithParam<testing::DoorQuestion> {
 protected:
  static void expect_same_in_c(Problem& problem, const SolverOptions& options,
                               const Answer& answer) {
    const Result& expected = answer.best;
    testing::CDoor door(problem, options, [] { return true; });
    const testing::CDoor::Answer own = door.solve(testing::kDoorStart);
    EXPECT_EQ(own.x, expected.v);
    EXPECT_EQ(own.f, expected.objective);
    EXPECT_EQ(own.lambda, expected.lambda);
    const auto said = statements(expected);
    for (int which = 0; which < 4; ++which) {
      EXPECT_EQ(IpminmaxStatement(door.get(), which), said.at(static_cast<std::size_t>(which)));
    }
    IpminmaxCertificate certificate;
    ASSERT_EQ(IpminmaxGetCertificate(door.get(), &certificate), 1);
    EXPECT_EQ(certificate.point_kind == IPMINMAX_LOCAL_MINMAX,
              expected.certificate.kind == PointKind::LocalMinmax);
    EXPECT_EQ(
        IpminmaxGetRobustWorstCases(door.get(), 0, nullptr, nullptr, nullptr, nullptr, nullptr),
        static_cast<int>(expected.worst_cases.size()));
    const std::size_t points = answer.points.size();
    std::vector<double> x(2 * points);
    std::vector<int> found(points);
    const int listed =
        IpminmaxGetPoints(door.get(), static_cast<int>(points), nullptr, found.data(), x.data());
    if (options.minmax_starts <= 1) return;
    ASSERT_EQ(listed, static_cast<int>(points));
    for (std::size_t k = 0; k < points; ++k) {
      EXPECT_EQ(std::vector(x.begin() + static_cast<std::ptrdiff_t>(2 * k),
                            x.begin() + static_cast<std::ptrdiff_t>(2 * k + 2)),
                answer.points[k].result.v);
      EXPECT_EQ(found[k], static_cast<int>(answer.points[k].found));
    }
  }
};

TEST_P(Doors, GiveTheSameAnswer) {
  AutodiffProblem problem(testing::door_model(GetParam().robust), testing::kDoorStart);
  const SolverOptions options = GetParam().options();
  const Answer answer = run(problem, options);
  const Result& expected = answer.best;
  testing::expect_consistent(expected);

  const auto expect_same = [&](const Result& result, const char* door) {
    EXPECT_EQ(result.v, expected.v) << door;
    EXPECT_EQ(result.status, expected.status) << door;
    EXPECT_EQ(result.objective, expected.objective) << door;
    EXPECT_EQ(result.certificate.kind, expected.certificate.kind) << door;
    EXPECT_EQ(result.factorizations, expected.factorizations) << door;
    EXPECT_EQ(result.worst_cases.size(), expected.worst_cases.size()) << door;
    EXPECT_EQ(statements(result), statements(expected)) << door;
  };
  expect_same(solve(problem, options), "solve");
  expect_same(multistart(problem, options).best, "multistart");
  expect_same(solve_robust(problem, options).result, "solve_robust");
  RepeatedSolver repeated;
  expect_same(repeated.solve(problem, options), "RepeatedSolver");

  const Ipopt::SmartPtr<MinMaxApplication> app = testing::application_with(options);
  const Ipopt::SmartPtr<Ipopt::TNLP> tnlp = new GameTNLP(problem);
  static_cast<void>(app->OptimizeTNLP(tnlp));
  expect_same(app->LastResult(), "MinMaxApplication");
  EXPECT_EQ(app->LastWorstCases().size(), expected.worst_cases.size());
  if (options.minmax_starts > 1) {
    ASSERT_EQ(app->LastPoints().size(), answer.points.size());
    for (std::size_t k = 0; k < answer.points.size(); ++k) {
      EXPECT_EQ(app->LastPoints()[k].result.v, answer.points[k].result.v);
      EXPECT_EQ(app->LastPoints()[k].found, answer.points[k].found);
    }
  }
  expect_same_in_c(problem, options, answer);
}

INSTANTIATE_TEST_SUITE_P(Questions, Doors, ::testing::ValuesIn(testing::door_questions()));

/// For doors in other languages: a line for each question. Success as Python says it: not where another
/// y is known to be worse, asked for or not.
TEST(DoorsTable, IsWrittenWhereAskedFor) {
  const char* file = std::getenv("IPMINMAX_DOORS_TABLE");
  if (file == nullptr) GTEST_SKIP() << "IPMINMAX_DOORS_TABLE names no file";
  std::ofstream table(file);
  table.precision(17);
  for (const testing::DoorQuestion& question : testing::door_questions()) {
    AutodiffProblem problem(testing::door_model(question.robust), testing::kDoorStart);
    const Answer answer = run(problem, question.options());
    const Result& best = answer.best;
    table << question.starts << '\t' << question.starts_of_y << '\t' << question.epigraph << '\t'
          << question.at_kinks << '\t' << question.robust << '\t'
          << (is_success(best.status) && !best.worst_case.higher) << '\t'
          << (best.certificate.kind == PointKind::LocalMinmax) << '\t' << best.v[0] << '\t'
          << best.v[1] << '\t' << best.objective << '\t' << answer.points.size() << '\t'
          << best.worst_cases.size();
    for (std::string statement : statements(best)) {
      std::ranges::replace(statement, '\n', ' ');  // a row is a line
      table << '\t' << statement;
    }
    table << '\n';
  }
  ASSERT_TRUE(table.flush());
}

}  // namespace
}  // namespace ipminmax
