// How people solve minmax problems today, against our solver: success over random starts, time and
// evaluations. A success is a point next to which the library certifies a local minmax; a claim
// without it is false. What each contestant does stands in baselines/game.hpp.

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "baselines/game.hpp"
#include "program.hpp"

namespace bench {
namespace {

struct Contestant {
  const char* name;
  Answer (*solve)(Game&, std::span<const double>, const Limits&);
};

constexpr std::array<Contestant, 8> kContestants = {{
    {"ours (filter)", solve_filter},
    {"ours (Algorithm 1)", solve_algorithm_one},
    {"pure Newton", solve_pure_newton},
    {"single level, Ipopt", solve_single_level},
    {"nested, Ipopt", solve_nested_ipopt},
    {"cutting sets, Ipopt", solve_cutting_set},
    {"gradient descent ascent", solve_gda},
    {"extragradient", solve_extragradient},
}};

/// What one contestant did on one game, by start.
struct Score {
  std::vector<double> seconds{};
  std::vector<Answer> answers{};
  std::vector<bool> certified{};
};

/// All contestants on every start in turn, in an order that rotates. Each start is solved `rounds`
/// times; the median time counts.
std::array<Score, kContestants.size()> play(Game& game, int starts, int rounds,
                                            const Limits& limits) {
  Random tuning(1);
  tune_first_order(game, tuning);
  Random random(2026);
  std::array<Score, kContestants.size()> scores;
  for (int start = 0; start < starts; ++start) {
    const std::vector<double> v = game.random_start(random);
    std::array<std::vector<double>, kContestants.size()> times;
    std::array<Answer, kContestants.size()> answers;
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t k = 0; k < kContestants.size(); ++k) {
        const std::size_t turn = (k + at(start + round)) % kContestants.size();
        // A solve that takes long needs no repetition.
        if (round > 0 && times[turn].front() > 0.1) continue;
        answers[turn] = kContestants[turn].solve(game, v, limits);
        times[turn].push_back(answers[turn].seconds);
      }
    }
    for (std::size_t k = 0; k < kContestants.size(); ++k) {
      Score& score = scores[k];
      const Answer& answer = answers[k];
      score.certified.push_back(answer.certified ||
                                (answer.applicable && is_local_minmax(*game.problem, answer.v)));
      score.seconds.push_back(spread(times[k]).median);
      score.answers.push_back(answer);
    }
  }
  return scores;
}

/// Median over the certified solves.
double median_count(const Score& score, Index ipminmax::Counts::*count) {
  std::vector<double> values;
  for (std::size_t k = 0; k < score.answers.size(); ++k) {
    if (score.certified[k]) values.push_back(score.answers[k].counts.*count);
  }
  return spread(std::move(values)).median;
}

void run(const Settings& settings, int starts, int rounds, const Limits& limits,
         const std::string& only) {
  Table table({"game", "n", "m", "contestant", "certified", "claims", "false claims", "time",
               "time / ours", "f", "gradients", "Hessians"});
  std::array<int, kContestants.size()> successes{}, false_claims{}, tried{};
  std::array<std::vector<double>, kContestants.size()> ratios;
  bool found = false;
  for (Game& game : games()) {
    if (game.name.find(only) == std::string::npos) continue;
    found = true;
    const auto scores = play(game, starts, rounds, limits);
    for (std::size_t k = 0; k < kContestants.size(); ++k) {
      const Score& score = scores[k];
      const ipminmax::ProblemStructure& s = game.problem->structure();
      table.row().text(game.name).integer(std::ssize(s.variable_lower));
      table.integer(std::ssize(s.constraint_lower)).text(kContestants[k].name);
      if (!score.answers.front().applicable) {
        table.text("not applicable");
        for (int column = 0; column < 7; ++column) table.none();
        continue;
      }
      int certified = 0, claims = 0, wrong = 0;
      std::vector<double> seconds, own, ours;
      for (std::size_t i = 0; i < score.answers.size(); ++i) {
        certified += score.certified[i] ? 1 : 0;
        claims += score.answers[i].claims ? 1 : 0;
        wrong += score.answers[i].claims && !score.certified[i] ? 1 : 0;
        if (score.certified[i]) seconds.push_back(score.seconds[i]);
        if (score.certified[i] && scores[0].certified[i]) {
          own.push_back(score.seconds[i]);
          ours.push_back(scores[0].seconds[i]);
        }
      }
      const Spread ratio = spread_of_ratios(own, ours);
      const std::string of = "/" + std::to_string(starts);
      table.text(std::to_string(certified) + of).integer(claims).integer(wrong);
      table.time(spread(seconds)).number(ratio);
      table.number(median_count(score, &ipminmax::Counts::objective), 6);
      table.number(median_count(score, &ipminmax::Counts::gradient), 6);
      table.number(median_count(score, &ipminmax::Counts::hessian), 6);
      successes[k] += certified;
      false_claims[k] += wrong;
      tried[k] += starts;
      if (!own.empty()) ratios[k].push_back(ratio.median);
    }
  }
  if (!found) throw std::invalid_argument("no game " + only);
  publish(table,
          "Random starts; time and evaluations: median [quartiles] over the certified solves; "
          "time / ours where both are certified",
          "baselines", settings);
  Table totals(
      {"contestant", "certified", "false claims", "time / ours (geometric mean)", "games"});
  for (std::size_t k = 0; k < kContestants.size(); ++k) {
    totals.row().text(kContestants[k].name);
    totals.text(std::to_string(successes[k]) + "/" + std::to_string(tried[k]));
    totals.integer(false_claims[k]).number(geometric_mean(ratios[k]));
    totals.integer(std::ssize(ratios[k]));
  }
  publish(totals, "Over the games to which a method applies", "baselines_totals", settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings{.seconds = 150.0, .csv = {}};
  int starts = 0;
  int rounds = 3;
  bench::Limits limits;
  std::string game;
  CommandLine command_line("baselines: ways to solve a minmax problem");
  command_line.add("--starts", starts, "random starts for each game (one for each 15 seconds)");
  command_line.add("--rounds", rounds, "repetitions of quick solves (3)");
  command_line.add("--limit", limits.seconds, "CPU seconds for one solve (5)");
  command_line.add("--game", game, "only those whose name contains it");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    if (starts == 0) starts = std::max(3, static_cast<int>(settings.seconds / 15.0));
    if (starts < 1 || rounds < 1) throw std::invalid_argument("--starts and --rounds from 1 on");
    bench::print_environment();
    bench::run(settings, starts, rounds, limits, game);
  });
}
