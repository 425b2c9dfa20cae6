// ReOptimizeTNLP allocates nothing: all that a solve works with is kept by the application. Counted
// are malloc and its kin in the whole process, from the call to the return, once the arrays are
// there: the first solve makes them, the second one those that only a warm solve needs.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <examples/chauffeur_tnlp.hpp>
#include <support/count_allocations.hpp>

#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax {
namespace {

using Ipopt::Index;
using Ipopt::Number;
using testing::allocation_counter;

constexpr Number kNone = 2e19;

/// f = v'Hv/2 + q'v + sum of quartic_i v_i^4 / 4, rows A v within bounds.
struct Game {
  std::vector<Player> players;
  std::vector<Number> lower, upper, start;
  std::vector<std::vector<Number>> hessian;  ///< symmetric
  std::vector<Number> linear, quartic;
  std::vector<std::vector<Number>> rows;
  std::vector<Number> row_lower, row_upper;
};

/// Allocates nothing once it is there.
class SmallGame : public MinMaxTNLP, public Game {
 public:
  explicit SmallGame(Game game) : Game(std::move(game)) {}

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = size();
    m = static_cast<Index>(rows.size());
    nnz_jac_g = 0;
    for (const std::vector<Number>& row : rows) {
      nnz_jac_g += n - static_cast<Index>(std::ranges::count(row, 0.0));
    }
    nnz_h_lag = n * (n + 1) / 2;
    index_style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* x_l, Number* x_u, Index, Number* g_l, Number* g_u) override {
    std::ranges::copy(lower, x_l);
    std::ranges::copy(upper, x_u);
    std::ranges::copy(row_lower, g_l);
    std::ranges::copy(row_upper, g_u);
    return true;
  }
  bool get_variable_players(Index, Player* owners) override {
    std::ranges::copy(players, owners);
    return true;
  }
  bool get_starting_point(Index, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override {
    std::ranges::copy(start, x);
    return true;
  }
  bool eval_f(Index, const Number* x, bool, Number& f) override {
    f = 0.0;
    for (std::size_t i = 0; i < linear.size(); ++i) {
      f += linear[i] * x[i] + 0.25 * quartic[i] * std::pow(x[i], 4);
      for (std::size_t j = 0; j < linear.size(); ++j) f += 0.5 * x[i] * hessian[i][j] * x[j];
    }
    return true;
  }
  bool eval_grad_f(Index, const Number* x, bool, Number* gradient) override {
    for (std::size_t i = 0; i < linear.size(); ++i) {
      gradient[i] = linear[i] + quartic[i] * std::pow(x[i], 3);
      for (std::size_t j = 0; j < linear.size(); ++j) gradient[i] += hessian[i][j] * x[j];
    }
    return true;
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    for (std::size_t j = 0; j < rows.size(); ++j) {
      g[j] = 0.0;
      for (std::size_t i = 0; i < linear.size(); ++i) g[j] += rows[j][i] * x[i];
    }
    return true;
  }
  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index* row, Index* col,
                  Number* values) override {
    std::size_t k = 0;
    for (std::size_t j = 0; j < rows.size(); ++j) {
      for (std::size_t i = 0; i < linear.size(); ++i) {
        if (rows[j][i] == 0.0) continue;
        if (values != nullptr) {
          values[k] = rows[j][i];
        } else {
          row[k] = static_cast<Index>(j);
          col[k] = static_cast<Index>(i);
        }
        ++k;
      }
    }
    return true;
  }
  bool eval_h(Index, const Number* x, bool, Number sigma, Index, const Number*, bool, Index,
              Index* row, Index* col, Number* values) override {
    std::size_t k = 0;
    for (std::size_t i = 0; i < linear.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j, ++k) {
        if (values != nullptr) {
          values[k] = sigma * (hessian[i][j] + (i == j ? 3.0 * quartic[i] * x[i] * x[i] : 0.0));
        } else {
          row[k] = static_cast<Index>(i);
          col[k] = static_cast<Index>(j);
        }
      }
    }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*,
                         Index, const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  [[nodiscard]] Index size() const { return static_cast<Index>(linear.size()); }
};

/// x = v0, y = v1 in [-1/2, 1/2], where its upper bound is active: y wants (x + 1).
Game bounded_answer() {
  Game game;
  game.players = {Player::Min, Player::Max};
  game.lower = {-3.0, -0.5};
  game.upper = {kNone, 0.5};
  game.start = {0.3, 0.1};
  game.hessian = {{2.0, 1.0}, {1.0, -1.0}};
  game.linear = {-1.0, 1.0};
  game.quartic = {0.5, -0.1};
  return game;
}

/// Two variables each; x0 + x1 >= 1 is active, y0 + y1 + x0 <= 5 is not, nor any bound.
Game open_inequality() {
  Game game;
  game.players = {Player::Min, Player::Max, Player::Min, Player::Max};
  game.lower = {-5.0, -5.0, -kNone, -kNone};
  game.upper = {5.0, kNone, kNone, 5.0};
  game.start = {0.4, 0.2, 0.4, -0.1};
  game.hessian = {
      {2.0, 0.5, 0.1, 0.2}, {0.5, -2.0, 0.3, 0.1}, {0.1, 0.3, 3.0, 0.4}, {0.2, 0.1, 0.4, -3.0}};
  game.linear = {0.3, 0.4, -0.2, 0.5};
  game.quartic = {0.2, -0.2, 0.1, 0.0};
  game.rows = {{1.0, 0.0, 1.0, 0.0}, {1.0, 1.0, 0.0, 1.0}};
  game.row_lower = {1.0, -kNone};
  game.row_upper = {kNone, 5.0};
  return game;
}

/// The same with both inequalities active, and an equation of each player's.
Game active_inequalities() {
  Game game = open_inequality();
  game.rows = {{1.0, 0.0, 1.0, 0.0}, {0.0, 1.0, 0.0, 2.0}, {1.0, 1.0, 0.0, 0.0}};
  game.row_lower = {1.0, 0.1, -kNone};
  game.row_upper = {1.0, 0.1, 0.4};
  return game;
}

/// No Max variables: an ordinary minimization.
Game minimization() {
  Game game = open_inequality();
  game.players.assign(4, Player::Min);
  for (std::size_t i : {1U, 3U}) {
    for (std::size_t j = 0; j < 4; ++j) {
      game.hessian[i][j] = game.hessian[j][i] = i == j ? 2.0 : 0.0;
    }
    game.quartic[i] = 0.3;
  }
  return game;
}

struct Application {
  Ipopt::SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);

  explicit Application(const std::string& linear_solver) {
    app->Options()->SetIntegerValue("print_level", 0);
    app->Options()->SetStringValue("sb", "yes");
    app->Options()->SetStringValue("linear_solver", linear_solver);
    EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  }

  /// Solves again, counted. renew: before each solve, given its number.
  template <class Renew>
  void expect_no_allocation(const Ipopt::SmartPtr<Ipopt::TNLP>& model, Renew&& renew) {
    constexpr int kWarmUp = 2, kCounted = 5;
    for (int k = 0; k < kWarmUp + kCounted; ++k) {
      renew(k);
      allocation_counter.start();
      const auto status = k == 0 ? app->OptimizeTNLP(model) : app->ReOptimizeTNLP(model);
      allocation_counter.stop();
      ASSERT_EQ(status, Ipopt::Solve_Succeeded) << k << ": " << app->LastResult().message;
      EXPECT_EQ(app->LastResult().certificate.kind, PointKind::LocalMinmax) << k;
      EXPECT_GT(app->LastResult().iterations, 2) << k;
      if (k == 0) {
        EXPECT_GT(allocation_counter.all, 100) << "nothing is counted";
      }
      if (k >= kWarmUp) {
        EXPECT_EQ(allocation_counter.all, 0) << k;
      }
    }
  }
};

class ReOptimize : public ::testing::TestWithParam<const char*> {};

TEST_P(ReOptimize, AllocatesNothingInAPursuit) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  const chauffeur::Parameters parameters;
  Ipopt::SmartPtr<chauffeur::ChauffeurTNLP> model =
      new chauffeur::ChauffeurTNLP(parameters, {}, chauffeur::Control{0.01, 0.002, 0.001});
  Application application(GetParam());
  chauffeur::State state{};
  std::vector<chauffeur::Control> controls;
  application.expect_no_allocation(GetRawPtr(model), [&](int k) {
    if (k > 0) {
      const std::vector<double>& v = application.app->LastResult().v;
      const std::size_t stage = v.size() / static_cast<std::size_t>(parameters.horizon);
      controls.clear();
      for (std::size_t i = 0; i < v.size(); i += stage) {
        controls.push_back({v[i], v[i + 4], v[i + 5]});
      }
      state = chauffeur::advance(state, chauffeur::saturate(controls.front(), parameters),
                                 parameters.speed);
      std::shift_left(controls.begin(), controls.end(), 1);
      model->set_controls(controls);
    }
    model->set_state(state);
  });
}

TEST_P(ReOptimize, AllocatesNothingInSmallProblems) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  const std::pair<const char*, Game (*)()> games[] = {{"bounded answer", bounded_answer},
                                                      {"open inequality", open_inequality},
                                                      {"active inequalities", active_inequalities},
                                                      {"minimization", minimization}};
  for (const auto& [name, make] : games) {
    SCOPED_TRACE(name);
    Ipopt::SmartPtr<SmallGame> game = new SmallGame(make());
    Application application(GetParam());
    application.expect_no_allocation(GetRawPtr(game), [&](int k) {
      game->linear[0] += 0.003 * k;
      game->start[0] -= 0.002 * k;
    });
  }
}

TEST_P(ReOptimize, AllocatesNothingForAModelThatIsSplitFromOutside) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  Ipopt::SmartPtr<SmallGame> game = new SmallGame(open_inequality());
  Application application(GetParam());
  application.expect_no_allocation(new SplitTNLP(GetRawPtr(game), {1, 3}),
                                   [&](int k) { game->linear[1] += 0.003 * k; });
}

INSTANTIATE_TEST_SUITE_P(Solvers, ReOptimize, ::testing::Values("auto", "ldlt"),
                         [](const ::testing::TestParamInfo<const char*>& c) {
                           return std::string(c.param);
                         });

}  // namespace
}  // namespace ipminmax
