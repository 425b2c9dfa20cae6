// Constraints that hold for every y, three ways on the same models with the same number of starts
// over y:
//   ours         solve_robust: worst cases that move with x
//   cutting sets Ipopt minimizes over x with the constraints at the y met so far, Ipopt maximizes
//                each constraint over y, and the largest of each joins (Mutapcic, Boyd 2009)
//   nested       Ipopt, limited memory, minimizes over x subject to phi_r(x) = max over y of
//                g_r(x, y) <= 0, value and gradient (envelope theorem) from maximizations by Ipopt
// Models: semi-infinite programs, and families with kinks in epigraph form. An answer is right when
// it violates nothing by more than 1e-6 and its objective is within 1e-6 of the optimum
// (semi-infinite), or within 1e-5 of the least worst case that any contestant found (families).

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <problems/branching_problems.hpp>
#include <problems/semi_infinite_programs.hpp>
#include <support/forwarding_problem.hpp>

#include "baselines/game.hpp"
#include "baselines/ipopt.hpp"
#include "core/robust.hpp"
#include "core/robust/robust_copies.hpp"
#include "measure.hpp"
#include "program.hpp"

namespace bench {
namespace {

using ipminmax::Budget;
using ipminmax::Player;
using ipminmax::ProblemStructure;
using ipminmax::RobustCopies;
using ipminmax::RobustScopes;
using ipminmax::testing::CountingProblem;

constexpr int kStarts = 20;  // of each maximization over y
constexpr double kTolerance = 1e-9, kViolation = 1e-7;
constexpr int kMostRounds = 60;

struct Found {
  bool claims = false;
  std::vector<double> v{};  ///< of the model
  Index solves = 0, maximizations = 0;
  double seconds = 0.0;
  ipminmax::Counts counts{};
};

/// One robust row of a model as the objective, for InnerProblem; Min's rows left out.
class RowOverY final : public ipminmax::testing::ForwardingProblem {
 public:
  RowOverY(Problem& model, Index row) : ForwardingProblem(model), model_(model), row_(row) {
    g_.resize(model.structure().constraint_lower.size());
    lambda_.resize(g_.size());
    j_.resize(model.structure().jacobian.size());
    structure_ = model.structure();
    structure_.jacobian.clear();
    for (std::size_t k = 0; k < j_.size(); ++k) {
      const ipminmax::Triplet entry = model.structure().jacobian[k];
      if (structure_.constraint_players[at(entry.row)] != Player::Max) continue;
      structure_.jacobian.push_back(entry);
      entries_.push_back(k);
    }
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    if (!model_.jacobian(v, true, j_)) return false;
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = j_[entries_[k]];
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    if (!model_.constraints(v, true, g_)) return false;
    f = g_[at(row_)];
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    if (!model_.jacobian(v, true, j_)) return false;
    std::ranges::fill(grad, 0.0);
    const ProblemStructure& s = model_.structure();
    for (std::size_t k = 0; k < j_.size(); ++k) {
      if (s.jacobian[k].row == row_) grad[at(s.jacobian[k].col)] += j_[k];
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    std::ranges::copy(lambda, lambda_.begin());
    lambda_[at(row_)] += sigma;
    return model_.hessian(v, true, 0.0, lambda_, true, values);
  }

 private:
  Problem& model_;
  Index row_;
  ProblemStructure structure_;
  std::vector<std::size_t> entries_;  ///< of the model's Jacobian, Max's
  std::vector<double> g_, lambda_, j_;
};

std::vector<Index> robust_rows(const ProblemStructure& s) {
  std::vector<Index> rows;
  for (const auto& [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] == Player::Min &&
        s.variable_players[at(col)] == Player::Max && std::ranges::find(rows, row) == rows.end()) {
      rows.push_back(row);
    }
  }
  return rows;
}

/// Maximizes rows over y by Ipopt from the same kind of starts as ours: the last y and random ones.
class Maximizer {
 public:
  Maximizer(Problem& model, Found& found)
      : model_(model), players_(model.structure()), found_(found) {}

  struct Maximum {
    double value = -2e19;
    std::vector<double> v{};
  };
  Maximum maximize(Index row, const std::vector<double>& v, int starts, double seconds) {
    RowOverY over_y(model_, row);
    InnerProblem inner(over_y, players_, v);
    const ProblemStructure& s = model_.structure();
    Random random(7);
    Maximum best;
    for (int start = 0; start < starts; ++start) {
      inner.point() = v;
      for (const Index i : players_.y) {
        if (start == 0) break;
        inner.point()[at(i)] = uniform(random, s.variable_lower[at(i)], s.variable_upper[at(i)]);
      }
      const IpoptAnswer answer = ipopt_.minimize(inner, seconds);
      ++found_.maximizations;
      if (solved_well(answer) && -answer.objective > best.value) {
        best = {-answer.objective, inner.point_with(answer.v)};
      }
    }
    return best;
  }

 private:
  Problem& model_;
  Players players_;
  Found& found_;
  IpoptMinimizer ipopt_{kTolerance};
};

Found solve_ours(Problem& model, const std::vector<double>&, double) {
  const CpuClock clock;
  Found found;
  ipminmax::SolverOptions options;
  options.minmax_worst_case_starts = kStarts;
  const ipminmax::RobustResult answer = ipminmax::solve_robust(model, options);
  found.claims = is_success(answer.result.status);
  found.v = answer.result.v;
  found.solves = answer.solves;
  found.maximizations = answer.maximizations;
  found.counts = answer.result.counts;
  found.seconds = clock.seconds();
  return found;
}

Found solve_by_cutting_sets(Problem& model, const std::vector<double>& start, double seconds) {
  const CpuClock clock;
  Found found;
  CountingProblem counted(model);
  const std::vector<Index> rows = robust_rows(model.structure());
  const std::vector<bool> reads_y(start.size(), false);
  Maximizer maximizer(counted, found);
  IpoptMinimizer ipopt(kTolerance);
  Budget budget{ipminmax::SolverOptions{}};
  ipminmax::WorstCases scenarios;
  std::vector<double> v = start;
  for (const Index row : rows) {
    const auto worst = maximizer.maximize(row, v, kStarts, seconds);
    scenarios.push_back({row, worst.v.empty() ? start : worst.v, true, true});
  }
  for (int round = 0; round < kMostRounds && clock.seconds() < seconds; ++round) {
    RobustCopies master(counted, v, scenarios, RobustScopes(model.structure()), reads_y, budget);
    const IpoptAnswer outer = ipopt.minimize(master, seconds - clock.seconds());
    ++found.solves;
    if (!solved_well(outer)) break;
    v.assign(outer.v.begin(), outer.v.begin() + static_cast<std::ptrdiff_t>(start.size()));
    found.v = v;
    bool any = false;
    for (const Index row : rows) {
      const auto worst = maximizer.maximize(row, v, kStarts, seconds - clock.seconds());
      if (worst.value <= kViolation) continue;
      scenarios.push_back({row, worst.v, true, true});
      any = true;
    }
    if (!any) {
      found.claims = true;
      break;
    }
  }
  found.counts = counted.counts();
  found.seconds = clock.seconds();
  return found;
}

/// min f(x) subject to phi_r(x) <= 0, for Ipopt.
class NestedProblem final : public Problem {
 public:
  NestedProblem(Problem& model, std::vector<double> start, Found& found, double seconds)
      : model_(model),
        players_(model.structure()),
        rows_(robust_rows(model.structure())),
        maximizer_(model, found),
        v_(std::move(start)),
        seconds_(seconds) {
    const ProblemStructure& s = model.structure();
    for (const Index i : players_.x) {
      structure_.variable_players.push_back(Player::Min);
      structure_.variable_lower.push_back(s.variable_lower[at(i)]);
      structure_.variable_upper.push_back(s.variable_upper[at(i)]);
    }
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      structure_.constraint_players.push_back(Player::Min);
      structure_.constraint_lower.push_back(-2e19);
      structure_.constraint_upper.push_back(0.0);
      for (std::size_t i = 0; i < players_.x.size(); ++i) {
        structure_.jacobian.push_back({static_cast<Index>(r), static_cast<Index>(i)});
      }
    }
    worst_.resize(rows_.size());
  }
  [[nodiscard]] std::vector<double> point(std::span<const double> x) {
    load(x);
    return v_;
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    for (std::size_t i = 0; i < players_.x.size(); ++i) start.v[i] = v_[at(players_.x[i])];
    return !start.needs_multipliers;
  }
  [[nodiscard]] bool objective(std::span<const double> x, bool, double& f) override {
    load(x);
    return model_.objective(v_, true, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> x, bool, std::span<double> grad) override {
    load(x);
    std::vector<double> all(v_.size());
    if (!model_.gradient(v_, true, all)) return false;
    for (std::size_t i = 0; i < x.size(); ++i) grad[i] = all[at(players_.x[i])];
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> x, bool, std::span<double> g) override {
    if (!maximize(x)) return false;
    for (std::size_t r = 0; r < g.size(); ++r) g[r] = worst_[r].value;
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> x, bool, std::span<double> values) override {
    if (!maximize(x)) return false;
    const ProblemStructure& s = model_.structure();
    std::vector<double> all(s.jacobian.size());
    std::ranges::fill(values, 0.0);
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (!model_.jacobian(worst_[r].v, true, all)) return false;
      for (std::size_t k = 0; k < all.size(); ++k) {
        const auto [row, col] = s.jacobian[k];
        if (row != rows_[r] || s.variable_players[at(col)] != Player::Min) continue;
        values[r * players_.x.size() + at(players_.place[at(col)])] += all[k];
      }
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double>) override {
    return false;  // limited memory
  }

 private:
  void load(std::span<const double> x) {
    for (std::size_t i = 0; i < x.size(); ++i) v_[at(players_.x[i])] = x[i];
  }
  bool maximize(std::span<const double> x) {
    if (std::ranges::equal(x, last_x_)) return last_ok_;
    last_x_.assign(x.begin(), x.end());
    load(x);
    last_ok_ = clock_.seconds() < seconds_;
    for (std::size_t r = 0; last_ok_ && r < rows_.size(); ++r) {
      std::vector<double> from = worst_[r].v.empty() ? v_ : worst_[r].v;
      for (const Index i : players_.x) from[at(i)] = v_[at(i)];
      worst_[r] = maximizer_.maximize(rows_[r], from, kStarts, seconds_ - clock_.seconds());
      last_ok_ = !worst_[r].v.empty();
    }
    return last_ok_;
  }

  Problem& model_;
  Players players_;
  std::vector<Index> rows_;
  Maximizer maximizer_;
  std::vector<Maximizer::Maximum> worst_;
  std::vector<double> v_, last_x_;
  double seconds_;
  CpuClock clock_;
  ProblemStructure structure_;
  bool last_ok_ = false;
};

Found solve_nested(Problem& model, const std::vector<double>& start, double seconds) {
  const CpuClock clock;
  Found found;
  CountingProblem counted(model);
  NestedProblem problem(counted, start, found, seconds);
  IpoptMinimizer ipopt(1e-7);
  ipopt.options().SetStringValue("hessian_approximation", "limited-memory");
  const IpoptAnswer answer = ipopt.minimize(problem, seconds);
  found.solves = 1;
  found.claims = solved_well(answer);
  if (!answer.v.empty()) found.v = problem.point(answer.v);
  found.counts = counted.counts();
  found.seconds = clock.seconds();
  return found;
}

struct Contestant {
  const char* name;
  Found (*solve)(Problem&, const std::vector<double>&, double);
};
constexpr std::array<Contestant, 3> kContestants = {{{"ours", solve_ours},
                                                     {"cutting sets, Ipopt", solve_by_cutting_sets},
                                                     {"nested, Ipopt", solve_nested}}};

struct Totals {
  int tried = 0, claims = 0, right = 0;
  Index solves = 0, maximizations = 0;
  double seconds = 0.0;
};

/// Sums over a group of models and its table.
class Group {
 public:
  explicit Group(std::string name) : name_(std::move(name)) {}

  template <class Judge>
  void play(const std::string& model_name, Problem& model, const std::vector<double>& start,
            double seconds, Table& table, Judge is_right) {
    std::array<Found, kContestants.size()> found;
    for (std::size_t k = 0; k < kContestants.size(); ++k) {
      const std::size_t turn = (k + at(played_)) % kContestants.size();
      found[turn] = kContestants[turn].solve(model, start, seconds);
    }
    ++played_;
    const std::array<bool, kContestants.size()> right = is_right(found);
    for (std::size_t k = 0; k < kContestants.size(); ++k) {
      const Found& f = found[k];
      double objective = std::nan("");
      if (!f.v.empty()) static_cast<void>(model.objective(f.v, true, objective));
      table.row().text(model_name).text(kContestants[k].name).text(f.claims ? "yes" : "no");
      table.text(right[k] ? "yes" : "no").number(objective, 9).integer(f.solves);
      table.integer(f.maximizations).integer(f.counts.constraints).integer(f.counts.hessian);
      table.time(f.seconds);
      Totals& total = totals_[k];
      ++total.tried;
      total.claims += f.claims ? 1 : 0;
      total.right += right[k] ? 1 : 0;
      total.solves += f.solves;
      total.maximizations += f.maximizations;
      total.seconds += f.seconds;
    }
  }
  void add_to(Table& table) const {
    for (std::size_t k = 0; k < kContestants.size(); ++k) {
      const Totals& total = totals_[k];
      table.row().text(name_).text(kContestants[k].name).integer(total.tried);
      table.integer(total.claims).integer(total.right).integer(total.solves);
      table.integer(total.maximizations).time(total.seconds);
    }
  }

 private:
  std::string name_;
  int played_ = 0;
  std::array<Totals, kContestants.size()> totals_{};
};

using Right = std::array<bool, kContestants.size()>;
using Answers = std::array<Found, kContestants.size()>;

void play_semi_infinite(Group& group, double seconds, Table& table) {
  using namespace ipminmax::testing;
  for (const SemiInfinite& p : semi_infinite_programs()) {
    const std::vector<double> start = start_of(p);
    AutodiffProblem model(model_of(p), start);
    group.play(p.name, model, start, seconds, table, [&](const Answers& answers) {
      Right right{};
      for (std::size_t k = 0; k < answers.size(); ++k) {
        if (answers[k].v.empty()) continue;
        SemiInfiniteRows rows(p);
        double violation = -2e19, f = 0.0;
        for (std::size_t row = 0; row < p.rows.size(); ++row) {
          violation = std::max(violation, rows.largest(answers[k].v, row).first);
        }
        const double optimum = cutting_plane_bound(p, answers[k].v);
        right[k] = violation <= 1e-6 && model.objective(answers[k].v, true, f) &&
                   std::abs(f - optimum) <= 1e-6 * std::max(1.0, std::abs(optimum));
      }
      return right;
    });
  }
}

void play_families(Group& group, ipminmax::testing::BranchingFamily family, int problems,
                   double seconds, Table& table) {
  using namespace ipminmax::testing;
  for (int k = 0; k < problems; ++k) {
    const BranchingProblem p = branching_problem(family, 1, 3001U + static_cast<unsigned>(k));
    AutodiffProblem model(p.model, p.starts.front());
    const std::unique_ptr<Problem> epigraph = ipminmax::make_epigraph(model);
    std::vector<double> start = p.starts.front();
    double f = 0.0;
    static_cast<void>(model.objective(start, true, f));
    start.push_back(f);
    group.play(p.name, *epigraph, start, seconds, table, [&](const Answers& answers) {
      std::array<double, kContestants.size()> worst{};
      double least = 2e19;
      for (std::size_t c = 0; c < answers.size(); ++c) {
        worst[c] = 2e19;
        if (answers[c].v.empty()) continue;
        Found ignored;
        Maximizer maximizer(*epigraph, ignored);
        std::vector<double> v = answers[c].v;
        v.back() = 0.0;  // t: the row is f
        const auto row = static_cast<Index>(epigraph->structure().constraint_lower.size()) - 1;
        worst[c] = maximizer.maximize(row, v, 2 * kStarts, seconds).value;
        if (answers[c].claims) least = std::min(least, worst[c]);
      }
      Right right{};
      for (std::size_t c = 0; c < answers.size(); ++c) {
        right[c] = answers[c].claims && worst[c] <= least + 1e-5 * std::max(1.0, std::abs(least));
      }
      return right;
    });
  }
}

void run(const Settings& settings, int problems, double limit) {
  Table table({"model", "contestant", "claims", "right", "objective", "solves", "maximizations",
               "g", "Hessians", "time"});
  Group programs("semi-infinite"), responses("responses"), networks("networks");
  play_semi_infinite(programs, limit, table);
  play_families(responses, ipminmax::testing::BranchingFamily::Response, problems, limit, table);
  play_families(networks, ipminmax::testing::BranchingFamily::Network, problems, limit, table);
  publish(table, "Constraints for every y", "robust", settings);
  Table totals(
      {"models", "contestant", "tried", "claims", "right", "solves", "maximizations", "CPU time"});
  for (const Group* group : {&programs, &responses, &networks}) group->add_to(totals);
  publish(totals, "Totals", "robust_totals", settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings{.seconds = 60.0, .csv = {}};
  int problems = 0;
  double limit = 5.0;
  CommandLine command_line(
      "robust: constraints for every y, ours against cutting sets and nesting");
  command_line.add("--problems", problems, "of each family (one for each 6 seconds)");
  command_line.add("--limit", limit, "CPU seconds for one solve (5)");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    if (problems == 0) problems = std::max(2, static_cast<int>(settings.seconds / 6.0));
    if (problems < 1) throw std::invalid_argument("--problems from 1 on");
    bench::print_environment();
    bench::run(settings, problems, limit);
  });
}
