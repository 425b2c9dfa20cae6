// What leaves through the doors, Ipopt's interface and C, is the core's result, which is true of its own
// point: random small problems with random options, models that fail, stops by the user.
//
// By hand: IPMINMAX_RUNS=20000 IPMINMAX_SEED=7 adapter_truthful_doors_slow_test

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <ipminmax.h>

#include <problems/random_game.hpp>
#include <support/judge_truth.hpp>

#include "adapter/minmax_application.hpp"
#include "adapter/problem_tnlp.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// Calls set(name, value) for every option that is not at its default, value a double, an int or
/// a string.
template <class Set>
void for_each_option(const SolverOptions& options, Set set) {
  const SolverOptions defaults;
  for (const OptionInfo& info : option_table()) {
    const std::string name(info.name);
    if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
      const double value = options.*number->member;
      if (value != defaults.*number->member) set(name, value);
    } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
      const int value = options.*integer->member;
      if (value != defaults.*integer->member) set(name, value);
    } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
      const bool value = options.*flag->member;
      if (value != defaults.*flag->member) set(name, std::string(value ? "yes" : "no"));
    } else if (const auto* choice = std::get_if<OptionInfo::Choice>(&info.kind)) {
      const std::size_t value = choice->get(options);
      if (value != choice->get(defaults)) set(name, std::string(choice->names[value]));
    }
  }
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }
bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return same(x, y); });
}

class GameTnlp final : public ProblemTnlp {
 public:
  GameTnlp(Problem& problem, int stop_at) : ProblemTnlp(problem), stop_at_(stop_at) {}
  bool intermediate_callback(Ipopt::AlgorithmMode, Ipopt::Index, Ipopt::Number, Ipopt::Number,
                             Ipopt::Number, Ipopt::Number, Ipopt::Number, Ipopt::Number,
                             Ipopt::Number, Ipopt::Number, Ipopt::Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    return calls_++ < stop_at_;
  }

 private:
  int stop_at_, calls_ = 0;
};

std::vector<Ipopt::Index> indices_of_max(const std::vector<Player>& players) {
  std::vector<Ipopt::Index> indices;
  for (std::size_t i = 0; i < players.size(); ++i) {
    if (players[i] == Player::Max) indices.push_back(static_cast<Ipopt::Index>(i));
  }
  return indices;
}

/// The core's result, after a comparison with what finalize_solution was given.
Result through_tnlp(const RandomGame& game, Problem& problem) {
  const SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
  for_each_option(game.options, [&](const std::string& name, const auto& value) {
    Ipopt::OptionsList& list = *application->Options();
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, double>) {
      EXPECT_TRUE(list.SetNumericValue(name, value)) << name;
    } else if constexpr (std::is_same_v<Value, int>) {
      EXPECT_TRUE(list.SetIntegerValue(name, value)) << name;
    } else {
      EXPECT_TRUE(list.SetStringValue(name, value)) << name;
    }
  });
  // Drawn options may contradict each other; what is refused is refused by the solve as well.
  static_cast<void>(application->Initialize(""));
  const SmartPtr<GameTnlp> model = new GameTnlp(problem, game.stop_at);
  const ProblemStructure& s = problem.structure();
  static_cast<void>(application->OptimizeTNLP(new SplitTNLP(
      GetRawPtr(model), indices_of_max(s.variable_players), indices_of_max(s.constraint_players))));
  Result result = application->LastResult();
  const IpoptAnswer& told = model->answer();
  if (!result.v.empty()) {
    EXPECT_TRUE(same(told.v, result.v) && same(told.lambda, result.lambda) &&
                same(told.z_lower, result.z_lower) && same(told.z_upper, result.z_upper) &&
                same(told.constraints, result.constraints) &&
                same(told.objective, result.objective));
  } else if (!told.v.empty()) {  // undefined at the start
    EXPECT_TRUE(std::isnan(told.objective));
    for (const auto* values : {&told.lambda, &told.z_lower, &told.z_upper, &told.constraints}) {
      for (const double value : *values) EXPECT_TRUE(std::isnan(value));
    }
  }
  return result;
}

/// What the C callbacks are given.
struct CModel {
  Problem& problem;
  int stop_at;
  int calls = 0;
};
std::span<double> array(double* values, int size) {
  return {values, static_cast<std::size_t>(size)};
}
Problem& problem_of(void* data) { return static_cast<CModel*>(data)->problem; }
int structure(const std::vector<Triplet>& entries, int* row, int* col) {
  for (std::size_t k = 0; k < entries.size(); ++k) {
    row[k] = static_cast<int>(entries[k].row);
    col[k] = static_cast<int>(entries[k].col);
  }
  return 1;
}

int eval_f(int n, double* x, int new_x, double* f, void* data) {
  return problem_of(data).objective(array(x, n), new_x != 0, *f) ? 1 : 0;
}
int eval_grad_f(int n, double* x, int new_x, double* grad, void* data) {
  return problem_of(data).gradient(array(x, n), new_x != 0, array(grad, n)) ? 1 : 0;
}
int eval_g(int n, double* x, int new_x, int m, double* g, void* data) {
  return problem_of(data).constraints(array(x, n), new_x != 0, array(g, m)) ? 1 : 0;
}
int eval_jac_g(int n, double* x, int new_x, int, int entries, int* row, int* col, double* values,
               void* data) {
  if (values == nullptr) return structure(problem_of(data).structure().jacobian, row, col);
  return problem_of(data).jacobian(array(x, n), new_x != 0, array(values, entries)) ? 1 : 0;
}
int eval_h(int n, double* x, int new_x, double sigma, int m, double* lambda, int new_lambda,
           int entries, int* row, int* col, double* values, void* data) {
  if (values == nullptr) return structure(problem_of(data).structure().hessian, row, col);
  return problem_of(data).hessian(array(x, n), new_x != 0, sigma, array(lambda, m), new_lambda != 0,
                                  array(values, entries))
             ? 1
             : 0;
}
int intermediate(int, int, double, double, double, double, double, double, double, double, int,
                 void* data) {
  auto& model = *static_cast<CModel*>(data);
  return model.calls++ < model.stop_at ? 1 : 0;
}

/// Expects the arrays, errors and kind that C gives to be those of the result.
void expect_same_in_c(const RandomGame& game, Problem& problem, const Result& result) {
  const ProblemStructure& s = problem.structure();
  const auto n = static_cast<int>(s.variable_players.size());
  const auto m = static_cast<int>(s.constraint_players.size());
  const auto players = [](const std::vector<Player>& owners) {
    std::vector<int> numbers;
    for (const Player owner : owners) {
      numbers.push_back(owner == Player::Max ? IPMINMAX_MAX : IPMINMAX_MIN);
    }
    return numbers;
  };
  const std::vector<int> variable_players = players(s.variable_players);
  const std::vector<int> constraint_players = players(s.constraint_players);
  IpminmaxProblem c = IpminmaxCreate(
      n, s.variable_lower.data(), s.variable_upper.data(), m,
      m > 0 ? s.constraint_lower.data() : nullptr, m > 0 ? s.constraint_upper.data() : nullptr,
      static_cast<int>(s.jacobian.size()), static_cast<int>(s.hessian.size()), IPMINMAX_C_STYLE,
      eval_f, eval_g, eval_grad_f, eval_jac_g, eval_h, variable_players.data(),
      m > 0 ? constraint_players.data() : nullptr);
  ASSERT_NE(c, nullptr) << IpminmaxMessage(nullptr);
  IpminmaxAddIntOption(c, "print_level", 0);
  IpminmaxAddStrOption(c, "option_file_name", "");
  for_each_option(game.options, [&](const std::string& name, const auto& value) {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, double>) {
      EXPECT_EQ(IpminmaxAddNumOption(c, name.c_str(), value), 1) << name;
    } else if constexpr (std::is_same_v<Value, int>) {
      EXPECT_EQ(IpminmaxAddIntOption(c, name.c_str(), value), 1) << name;
    } else {
      EXPECT_EQ(IpminmaxAddStrOption(c, name.c_str(), value.c_str()), 1) << name;
    }
  });
  IpminmaxSetIntermediateCallback(c, intermediate);
  CModel model{problem, game.stop_at};
  std::vector<double> x = game.start, g(s.constraint_players.size()), lambda(g.size());
  std::vector<double> z_lower(x.size()), z_upper(x.size());
  double f = 7.0;
  IpminmaxSolve(c, x.data(), g.data(), &f, lambda.data(), z_lower.data(), z_upper.data(), &model);
  EXPECT_EQ(std::string(IpminmaxStatusName(c)), name_of(result.status));
  if (!result.v.empty()) {
    EXPECT_TRUE(same(x, result.v) && same(g, result.constraints) && same(f, result.objective) &&
                same(lambda, result.lambda) && same(z_lower, result.z_lower) &&
                same(z_upper, result.z_upper));
    IpminmaxStatistics statistics{};
    ASSERT_EQ(IpminmaxGetStatistics(c, &statistics), 1);
    EXPECT_TRUE(same(statistics.primal_error, result.error.primal) &&
                same(statistics.dual_error_min, result.error.dual_min) &&
                same(statistics.dual_error_max, result.error.dual_max) &&
                same(statistics.complementarity_error, result.error.complementarity) &&
                same(statistics.error, result.error.total));
    IpminmaxCertificate certificate{};
    ASSERT_EQ(IpminmaxGetCertificate(c, &certificate), 1);
    EXPECT_EQ(static_cast<int>(certificate.point_kind), static_cast<int>(result.certificate.kind));
  }
  IpminmaxFree(c);
}

TEST(TruthfulDoors, OfRandomGames) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 1500);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 100001);
  for (std::uint64_t seed = first; seed < first + runs && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomGame game = random_game(seed);
    game.options.max_cpu_time = SolverOptions{}.max_cpu_time;  // the same end twice
    AutodiffProblem model(game.model, game.start);
    FailingProblem problem(model, game), again(model, game);
    const Result result = through_tnlp(game, problem);
    EXPECT_EQ(TruthJudge(model, game.options, result, game.fails_from > 0).untruths(), "")
        << name_of(result.status);
    EXPECT_EQ(problem.calls_not_finite(), 0);
    expect_same_in_c(game, again, result);
  }
}

}  // namespace
}  // namespace ipminmax::testing
