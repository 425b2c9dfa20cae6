// ReOptimizeTNLP: options are read when they have changed, whichever way, and only then; nothing is
// formatted that nobody reads.
#include <IpSolveStatistics.hpp>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include <support/count_allocations.hpp>

#include "adapter/ipopt/minmax_application.hpp"
#include "model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using testing::allocation_counter;

class SolvingAgain : public ::testing::Test {
 protected:
  void SetUp() override {
    application_->Options()->SetIntegerValue("print_level", 0);
    application_->Options()->SetStringValue("sb", "yes");
    ASSERT_EQ(application_->Initialize(""), Ipopt::Solve_Succeeded);
    ASSERT_EQ(application_->OptimizeTNLP(game_), Ipopt::Solve_Succeeded);
  }
  [[nodiscard]] Ipopt::ApplicationReturnStatus again() {
    return application_->ReOptimizeTNLP(game_);
  }

  SmartPtr<Model> model_ = new Model;
  SmartPtr<Ipopt::TNLP> game_ = new SplitTNLP(GetRawPtr(model_), {1});
  SmartPtr<MinMaxApplication> application_ = new MinMaxApplication(false);
};

TEST_F(SolvingAgain, TakesOptionsThatHaveChanged) {
  const SmartPtr<Ipopt::OptionsList> options = application_->Options();
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
  options->SetIntegerValue("max_iter", 0);
  EXPECT_EQ(again(), Ipopt::Maximum_Iterations_Exceeded);
  options->SetIntegerValue("max_iter", 100);
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
  options->SetNumericValue("mu_init", 1e-5);
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
  const int iterations = application_->LastResult().iterations;
  options->SetNumericValue("mu_init", 10.0);
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
  EXPECT_GT(application_->LastResult().iterations, iterations);
  options->SetStringValue("fixed_variable_treatment", "relax_bounds");
  options->SetNumericValue("bound_relax_factor", 0.0);
  EXPECT_EQ(again(), Ipopt::Invalid_Option);
  EXPECT_EQ(again(), Ipopt::Invalid_Option);
}

TEST_F(SolvingAgain, TakesOptionsFromAStreamAndFromAnotherList) {
  const SmartPtr<Ipopt::OptionsList> options = application_->Options();
  const SmartPtr<Ipopt::OptionsList> before =
      new Ipopt::OptionsList(application_->RegOptions(), application_->Jnlst());
  *before = *options;
  std::istringstream text("max_iter 0\n");
  EXPECT_TRUE(options->ReadFromStream(*application_->Jnlst(), text));
  EXPECT_EQ(again(), Ipopt::Maximum_Iterations_Exceeded);
  *options = *before;
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
  options->SetIntegerValue("max_iter", 0);
  EXPECT_EQ(again(), Ipopt::Maximum_Iterations_Exceeded);
  options->clear();
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
}

TEST_F(SolvingAgain, OptionsSetInTheCallbackHoldFromTheNextSolveOn) {
  model_->on_iteration = [&](Ipopt::Index) {
    application_->Options()->SetIntegerValue("max_iter", 1);
    return true;
  };
  EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
  EXPECT_GT(application_->LastResult().iterations, 1);
  EXPECT_EQ(again(), Ipopt::Maximum_Iterations_Exceeded);
}

TEST_F(SolvingAgain, AllocatesAsOftenEveryTime) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  model_->calls.reserve(100000);
  model_->iterations.reserve(1000);
  int last = 0;
  for (int time = 0; time < 3; ++time) {
    allocation_counter.start();
    EXPECT_EQ(again(), Ipopt::Solve_Succeeded);
    allocation_counter.stop();
    const int now = allocation_counter.all;
    if (time > 1) {
      EXPECT_EQ(now, last);
    }
    last = now;
  }
  // Vectors of a point and of a solve; parsing the options alone took thousands.
  EXPECT_LT(last, 1000);
  std::printf("%d allocations in a solve\n", last);
}

}  // namespace
}  // namespace ipminmax
