// One allocation after the other fails: the answer is Insufficient_Memory (-102), nothing else
// happens, and the next solve is as if nothing had been.
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <ipminmax.h>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

// g++ sees one of the operators below through, not the other.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

namespace {

thread_local long countdown = 0;  // 0: all succeed; 1: the next fails
thread_local long made = 0;

void* allocate(std::size_t size, std::size_t alignment) {
  ++made;
  if (countdown > 0 && --countdown == 0) throw std::bad_alloc();
  void* memory = alignment > alignof(std::max_align_t)
                     ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                     : std::malloc(size > 0 ? size : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return allocate(size, 1);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

using Settings = std::vector<std::pair<const char*, const char*>>;

/// Every allocation of a solve.
class OutOfMemory : public ::testing::TestWithParam<Settings> {};

TEST_P(OutOfMemory, AnywhereInASolve) {
  const SmartPtr<Model> model = new Model;
  const SmartPtr<Ipopt::TNLP> game = new SplitTNLP(GetRawPtr(model), {1});
  const auto new_application = [] {
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
    for (const auto& [name, value] : GetParam()) {
      EXPECT_EQ(set_option(name, value, *app->RegOptions(), *app->Options(), true), "");
    }
    EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
    return app;
  };
  const auto first = new_application();
  ASSERT_EQ(first->OptimizeTNLP(game), Ipopt::Solve_Succeeded);  // fills the tables of a process
  const std::vector<double> solution = first->LastResult().v;
  made = 0;
  const auto counted = new_application();
  made = 0;
  ASSERT_EQ(counted->OptimizeTNLP(game), Ipopt::Solve_Succeeded);
  const long count = made;
  ASSERT_GT(count, 50);

  long refused = 0;
  const auto app = new_application();
  for (long k = 1; k <= count; ++k) {
    countdown = k;
    const auto status = app->OptimizeTNLP(game);
    countdown = 0;
    if (status == Ipopt::Insufficient_Memory) {
      ++refused;
      EXPECT_EQ(app->LastResult().status, Status::OutOfMemory) << k;
    } else {  // where less memory does
      EXPECT_EQ(status, Ipopt::Solve_Succeeded) << k << ": " << app->LastResult().message;
      EXPECT_EQ(app->LastResult().v, solution) << k;
    }
    ASSERT_EQ(app->OptimizeTNLP(game), Ipopt::Solve_Succeeded) << k;
    ASSERT_EQ(app->LastResult().v, solution) << k;
  }
  EXPECT_GT(refused, 50);
}

INSTANTIATE_TEST_SUITE_P(
    Of, OutOfMemory,
    ::testing::Values(Settings{}, Settings{{"linear_solver", "ldlt"}, {"mu_strategy", "adaptive"}},
                      Settings{{"hessian_approximation", "finite-difference-values"},
                               {"minmax_worst_case_starts", "2"}},
                      Settings{{"minmax_starts", "2"}}));

// min over v0, max over v1 of v0^2 + 4 v0 v1 - v1^2.
int eval_f(int, double* v, int, double* f, void*) {
  *f = v[0] * v[0] + 4.0 * v[0] * v[1] - v[1] * v[1];
  return 1;
}
int eval_grad_f(int, double* v, int, double* grad, void*) {
  grad[0] = 2.0 * v[0] + 4.0 * v[1];
  grad[1] = 4.0 * v[0] - 2.0 * v[1];
  return 1;
}
int eval_h(int, double*, int, double sigma, int, double*, int, int, int* row, int* col,
           double* values, void*) {
  if (values == nullptr) {
    row[0] = col[0] = col[1] = 0;
    row[1] = row[2] = col[2] = 1;
  } else {
    values[0] = 2.0 * sigma, values[1] = 4.0 * sigma, values[2] = -2.0 * sigma;
  }
  return 1;
}

/// IpminmaxSolveAgain sets warm_start_init_point for its own call only.
TEST(OutOfMemoryInC, InASecondSolveLeavesNoWarmStartBehind) {
  const double lower[] = {-10.0, -10.0}, upper[] = {10.0, 10.0};
  const int players[] = {IPMINMAX_MIN, IPMINMAX_MAX};
  const IpminmaxProblem problem =
      IpminmaxCreate(2, lower, upper, 0, nullptr, nullptr, 0, 3, IPMINMAX_C_STYLE, eval_f, nullptr,
                     eval_grad_f, nullptr, eval_h, players, nullptr);
  ASSERT_NE(problem, nullptr);
  ASSERT_EQ(IpminmaxAddIntOption(problem, "print_level", 0), 1);
  ASSERT_EQ(IpminmaxAddStrOption(problem, "option_file_name", ""), 1);
  double v[] = {3.0, 2.5};
  const auto solve = [&] {
    return IpminmaxSolve(problem, v, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr);
  };
  const auto again = [&] {
    return IpminmaxSolveAgain(problem, v, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr);
  };
  ASSERT_EQ(solve(), IPMINMAX_SOLVE_SUCCEEDED);
  ASSERT_EQ(again(), IPMINMAX_SOLVE_SUCCEEDED);
  made = 0;
  ASSERT_EQ(again(), IPMINMAX_SOLVE_SUCCEEDED);
  const long count = made;
  long refused = 0;
  for (long k = 1; k <= count; ++k) {
    ASSERT_EQ(solve(), IPMINMAX_SOLVE_SUCCEEDED) << k << ": " << IpminmaxMessage(problem);
    countdown = k;
    const auto status = again();
    countdown = 0;
    if (status != IPMINMAX_SOLVE_SUCCEEDED) {
      EXPECT_EQ(status, IPMINMAX_INSUFFICIENT_MEMORY) << k << ": " << IpminmaxMessage(problem);
      EXPECT_STREQ(IpminmaxMessage(problem), "out of memory") << k;
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);  // most arrays are those of the solve before
  IpminmaxFree(problem);
}

}  // namespace
}  // namespace ipminmax
