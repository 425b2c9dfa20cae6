// Backtracking with a filter along a line: what the block is told.
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "core/method/filter.hpp"

namespace ipminmax {
namespace {

/// A block whose trial points are listed.
class Listed {
 public:
  Listed(std::vector<Merit> trials, std::vector<Merit> corrections)
      : trials_(std::move(trials)), corrections_(std::move(corrections)) {
    point_.evaluation.c = corrected_c_ = Eigen::VectorXd::Zero(1);
  }
  [[nodiscard]] const Point& from() const { return point_; }
  [[nodiscard]] const Point& trial() const { return point_; }
  [[nodiscard]] Eigen::VectorXd& corrected_c() { return corrected_c_; }
  [[nodiscard]] Trial evaluate(double, StepLength) { return {true, trials_.at(tried_++)}; }
  [[nodiscard]] std::optional<StepLength> correct(const Eigen::VectorXd&) const {
    return StepLength{.primal = 1.0, .dual = 1.0};
  }
  [[nodiscard]] Trial evaluate_corrected(double, double) {
    return {true, corrections_.at(corrected_++)};
  }
  void passed(bool dominated) { told.push_back(dominated); }
  [[nodiscard]] static bool complete() { return true; }

  std::vector<bool> told;

 private:
  std::vector<Merit> trials_, corrections_;
  std::size_t tried_ = 0, corrected_ = 0;
  Point point_;
  Eigen::VectorXd corrected_c_;
};

TEST(FilterSearch, TellsOfCorrectionsThatFollowARejectionByTheFilter) {
  Budget budget{SolverOptions{}};
  SolveLimit limit(budget);
  const SearchLine line{.from = {1.0, 1.0},
                        .slope = 1.0,
                        .longest = {.primal = 1.0, .dual = 1.0},
                        .smallest = 1e-3,
                        .trials = 10};
  const auto told = [&](const Merit& first, const Merit& corrected) {
    Filter filter;
    filter.add({0.1, 0.5});
    Listed block({first}, {corrected});
    const SearchEnd end = filter_search(block, filter, line, limit);
    EXPECT_TRUE(end.accepted && end.corrected);
    return block.told;
  };
  const Merit dominated{1.0, 0.6}, no_better{2.0, 2.0}, accepted{0.05, 0.6};
  EXPECT_EQ(told(dominated, accepted), std::vector<bool>{true});
  EXPECT_EQ(told(no_better, accepted), std::vector<bool>{false});
}

}  // namespace
}  // namespace ipminmax
