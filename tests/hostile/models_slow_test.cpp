// Models whose structure is odd are solved, and what is said of the answer is true; models whose
// structure is wrong are refused before a function is called. Through the core, Ipopt's interface
// and C.
//
// By hand: IPMINMAX_RUNS=20000 IPMINMAX_SEED=7 hostile_models_slow_test

#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <hostile/disturbed_problem.hpp>
#include <hostile/judge_certificate.hpp>
#include <problems/random_game.hpp>
#include <support/dice.hpp>
#include <support/doors.hpp>
#include <support/judge_truth.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

struct Case {
  explicit Case(std::uint64_t seed)
      : game(seed % 2 == 0 ? tame_game(seed) : random_game(seed)),
        disturbance(static_cast<Disturbance>(seed % kDisturbances)),
        model(game.model, game.start),
        seed_of_places(seed) {
    game.options.max_cpu_time = SolverOptions{}.max_cpu_time;
    game.options.minmax_residual_watchdog = false;  // without a name for the doors
    game.stop_at = std::numeric_limits<int>::max();
  }
  [[nodiscard]] DisturbedProblem problem() {
    return DisturbedProblem(model, disturbance, seed_of_places);
  }
  RandomGame game;
  Disturbance disturbance;
  AutodiffProblem model;
  std::uint64_t seed_of_places;
};

/// Options are looked at first.
bool is_refusal(Status status) {
  return status == Status::InvalidProblem || status == Status::InvalidOption;
}

void expect_right(Case& c, DisturbedProblem& problem, const Result& result) {
  if (is_wrong(c.disturbance)) {
    EXPECT_TRUE(is_refusal(result.status)) << name_of(result.status);
    EXPECT_EQ(problem.calls(), 0) << result.message;
    EXPECT_TRUE(result.v.empty());
    EXPECT_FALSE(result.message.empty());
  } else {
    EXPECT_EQ(problem.calls_not_finite(), 0);
    DisturbedProblem judged = c.problem();
    EXPECT_EQ(TruthJudge(judged, c.game.options, result, false).untruths(), "")
        << name_of(result.status);
  }
}

Result solve_by_core(Case& c) {
  SCOPED_TRACE("core");
  DisturbedProblem problem = c.problem();
  Result result = solve(problem, c.game.options);
  expect_right(c, problem, result);
  if (result.certificate.kind == PointKind::LocalMinmax) {
    DisturbedProblem judged = c.problem();
    const CertificateJudgement found =
        judge_certificate(judged, c.game.options, result, c.seed_of_places);
    EXPECT_NE(found.verdict, CertificateVerdict::False) << found.why;
  }
  return result;
}

void solve_by_tnlp(Case& c) {
  SCOPED_TRACE("TNLP");
  DisturbedProblem problem = c.problem();
  const SmartPtr<DoorTnlp> model = new DoorTnlp(problem, [] { return true; });
  const SmartPtr<MinMaxApplication> application = application_with(c.game.options);
  static_cast<void>(application->OptimizeTNLP(split(model, c.model.structure())));
  expect_right(c, problem, application->LastResult());
}

/// The answer is the core's.
void solve_by_c(Case& c, const Result& expected) {
  SCOPED_TRACE("C");
  DisturbedProblem problem = c.problem();
  CDoor door(problem, c.game.options, [] { return true; });
  if (door.get() == nullptr) {
    EXPECT_TRUE(is_wrong(c.disturbance)) << IpminmaxMessage(nullptr);
    EXPECT_STRNE(IpminmaxMessage(nullptr), "");
    return;
  }
  const CDoor::Answer answer = door.solve(c.game.start);
  if (is_wrong(c.disturbance)) {
    EXPECT_TRUE(answer.status == IPMINMAX_INVALID_PROBLEM_DEFINITION ||
                answer.status == IPMINMAX_INVALID_OPTION)
        << answer.status;
    EXPECT_EQ(problem.calls(), 0);
    EXPECT_EQ(answer.x, c.game.start);
    EXPECT_EQ(answer.f, 7.0);
  } else {
    EXPECT_EQ(std::string(IpminmaxStatusName(door.get())), name_of(expected.status));
    if (expected.v.empty()) return;
    EXPECT_TRUE(same(answer.x, expected.v) && same(answer.g, expected.constraints) &&
                same(answer.f, expected.objective) && same(answer.lambda, expected.lambda) &&
                same(answer.z_lower, expected.z_lower) && same(answer.z_upper, expected.z_upper));
  }
}

TEST(HostileModels, AreRefusedOrSolvedTruly) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 3000);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  std::uint64_t wrong = 0, certified = 0;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Case c(seed);
    if (!c.problem().was_disturbed()) continue;
    wrong += is_wrong(c.disturbance);
    const Result result = solve_by_core(c);
    certified += result.certificate.kind == PointKind::LocalMinmax;
    solve_by_tnlp(c);
    solve_by_c(c, result);
  }
  std::printf("%llu models, %llu of them wrong, %llu certificates\n",
              static_cast<unsigned long long>(runs), static_cast<unsigned long long>(wrong),
              static_cast<unsigned long long>(certified));
}

/// Says who owns what as told.
class ToldPlayers final : public MinMaxTNLP {
 public:
  ToldPlayers(const SmartPtr<Ipopt::TNLP>& model, int variable, int constraint)
      : model_(model), variable_(variable), constraint_(constraint) {}
  bool get_variable_players(Ipopt::Index n, Player* players) override {
    players[n - 1] = static_cast<Player>(variable_);
    return true;
  }
  bool get_constraint_players(Ipopt::Index m, Player* players) override {
    if (m > 0) players[m - 1] = static_cast<Player>(constraint_);
    return true;
  }
  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& jacobian, Ipopt::Index& hessian,
                    IndexStyleEnum& style) override {
    return model_->get_nlp_info(n, m, jacobian, hessian, style);
  }
  bool get_bounds_info(Ipopt::Index n, double* x_l, double* x_u, Ipopt::Index m, double* g_l,
                       double* g_u) override {
    return model_->get_bounds_info(n, x_l, x_u, m, g_l, g_u);
  }
  bool get_starting_point(Ipopt::Index n, bool init_x, double* x, bool init_z, double* z_l,
                          double* z_u, Ipopt::Index m, bool init_lambda, double* lambda) override {
    return model_->get_starting_point(n, init_x, x, init_z, z_l, z_u, m, init_lambda, lambda);
  }
  bool eval_f(Ipopt::Index n, const double* x, bool new_x, double& f) override {
    return model_->eval_f(n, x, new_x, f);
  }
  bool eval_grad_f(Ipopt::Index n, const double* x, bool new_x, double* grad) override {
    return model_->eval_grad_f(n, x, new_x, grad);
  }
  bool eval_g(Ipopt::Index n, const double* x, bool new_x, Ipopt::Index m, double* g) override {
    return model_->eval_g(n, x, new_x, m, g);
  }
  bool eval_jac_g(Ipopt::Index n, const double* x, bool new_x, Ipopt::Index m, Ipopt::Index entries,
                  Ipopt::Index* row, Ipopt::Index* col, double* values) override {
    return model_->eval_jac_g(n, x, new_x, m, entries, row, col, values);
  }
  bool eval_h(Ipopt::Index n, const double* x, bool new_x, double sigma, Ipopt::Index m,
              const double* lambda, bool new_lambda, Ipopt::Index entries, Ipopt::Index* row,
              Ipopt::Index* col, double* values) override {
    return model_->eval_h(n, x, new_x, sigma, m, lambda, new_lambda, entries, row, col, values);
  }
  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index, const double*, const double*,
                         const double*, Ipopt::Index, const double*, const double*, double,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  SmartPtr<Ipopt::TNLP> model_;
  int variable_, constraint_;
};

Model game_with_constraint() {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -1.0, 2.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(square(x) + x * y - square(y));
  model.constraint(x + y, -1.0, 3.0);
  return model;
}

TEST(HostileModels, OwnersThatAreNoPlayersAreRefused) {
  const Model game = game_with_constraint();
  AutodiffProblem inner(game, {0.5, 0.5});
  for (const auto& [variable, constraint] : {std::pair{7, 1}, {255, 1}, {1, 2}, {1, 200}}) {
    SCOPED_TRACE(std::to_string(variable) + " " + std::to_string(constraint));
    DisturbedProblem problem(inner, Disturbance::None, 1);
    const SmartPtr<DoorTnlp> model = new DoorTnlp(problem, [] { return true; });
    const SmartPtr<MinMaxApplication> application = application_with({});
    const SmartPtr<Ipopt::TNLP> told = new ToldPlayers(GetRawPtr(model), variable, constraint);
    EXPECT_EQ(application->OptimizeTNLP(told), Ipopt::Invalid_Problem_Definition);
    EXPECT_EQ(problem.calls(), 0);
    const double lower[] = {-1.0, -2.0}, upper[] = {2.0, 2.0};
    const double row_lower = -1.0, row_upper = 3.0;
    const int variables[] = {0, variable};
    const IpminmaxProblem c = IpminmaxCreate(
        2, lower, upper, 1, &row_lower, &row_upper, 2, 3, IPMINMAX_C_STYLE,
        [](int, double*, int, double*, void*) { return 1; },
        [](int, double*, int, int, double*, void*) { return 1; },
        [](int, double*, int, double*, void*) { return 1; },
        [](int, double*, int, int, int, int*, int*, double*, void*) { return 1; }, nullptr,
        variables, &constraint);
    EXPECT_EQ(c, nullptr);
    if (c != nullptr) IpminmaxFree(c);
  }
}

}  // namespace
}  // namespace ipminmax::testing
