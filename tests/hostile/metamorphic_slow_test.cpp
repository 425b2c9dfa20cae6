// Models with known answers, written in other ways: in other units, shifted, permuted, with rows and
// variables that change nothing. No claim may be false, and few may be lost.
//
// By hand, any number of runs from any seed, each with a seed of its own:
//   METAMORPHIC_RUNS=10000 METAMORPHIC_SEED=7 hostile_metamorphic_slow_test
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <hostile/grid_judge.hpp>
#include <hostile/known_models.hpp>
#include <hostile/rewritten_problem.hpp>
#include <support/dice.hpp>

#include "core/answer.hpp"

namespace ipminmax::testing {
namespace {

struct Setting {
  const char* name;
  SolverOptions options;
};

std::vector<Setting> settings() {
  std::vector<Setting> all = {
      {"default", {}}, {"worst cases 8", {}}, {"epigraph", {}}, {"starts 5", {}}};
  all[1].options.minmax_worst_case_starts = 8;
  all[2].options.minmax_epigraph = true;
  all[3].options.minmax_starts = 5;
  for (Setting& setting : all) setting.options.minmax_max_factorizations = 20000;
  return all;
}

struct Counted {
  int runs = 0, certified_before = 0, wrong = 0, tolerated = 0, lost = 0;
};

bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

std::string numbers(const std::vector<double>& values) {
  std::string text;
  char number[40];
  for (const double value : values) {
    std::snprintf(number, sizeof number, " %.8g", value);
    text += number;
  }
  return text;
}

class Metamorphic {
 public:
  Metamorphic() {
    for (std::size_t k = 0; k < models_.size(); ++k) {
      for (std::size_t o = 0; o < settings_.size(); ++o) (void)unchanged(k, o);
    }
  }

  void run(std::uint64_t seed) {
    Dice dice(seed);
    const auto any = [&](std::size_t size) {
      return static_cast<std::size_t>(dice.below(static_cast<int>(size)));
    };
    const std::size_t k = any(models_.size()), option = any(settings_.size());
    const KnownModel& model = models_[k];
    const std::vector<Transformation>& all = transformations();
    Rewriting rewriting = Rewriting::unchanged(*model.problem);
    std::vector<std::size_t> chosen = {any(all.size())};
    if (dice.chance(0.5)) chosen.push_back(any(all.size()));
    std::ranges::sort(chosen);
    std::vector<std::string> names;
    std::string said;
    for (const std::size_t t : chosen) {
      if ((all[t].needs_saddle && !model.saddle) || (all[t].needs_wide && !model.wide)) continue;
      const std::optional<std::string> done = all[t].apply(rewriting, dice);
      if (!done) continue;
      names.push_back(all[t].name);
      said += (said.empty() ? "" : ", ") + *done;
    }
    if (names.empty()) return;
    RewrittenProblem problem(*model.problem, rewriting);
    const SolverOptions& options = settings_[option].options;
    const Result result = ipminmax::run(problem, options).best;
    const Judgement judgement = judge(model, rewriting, result, options);
    const Result& before = unchanged(k, option);
    // Of a variable that nothing reads no value is strictly best.
    const bool is_flat = std::ranges::find(names, "unread variable") != names.end();
    const bool lost =
        is_certified(before) && !is_certified(result) && !(is_flat && is_success(result.status));
    if (!judgement.wrong.empty() || !judgement.tolerated.empty() || lost)
      report(seed, model, said, settings_[option].name, rewriting, result, judgement, before);
    names.emplace_back("all");
    if (names.size() > 2) names[0] += " + " + names[1], names.erase(names.begin() + 1);
    for (const std::string& name : names) {
      Counted& counted = table_[name];
      ++counted.runs;
      counted.certified_before += is_certified(before) ? 1 : 0;
      counted.wrong += judgement.wrong.empty() ? 0 : 1;
      counted.tolerated += judgement.wrong.empty() && !judgement.tolerated.empty() ? 1 : 0;
      counted.lost += lost ? 1 : 0;
    }
  }

  void print() const {
    std::printf("%-36s %6s %6s %6s %9s %6s\n", "transformation", "runs", "cert.", "false",
                "tolerated", "lost");
    for (const auto& [name, c] : table_) {
      std::printf("%-36s %6d %6d %6d %9d %6d\n", name.c_str(), c.runs, c.certified_before, c.wrong,
                  c.tolerated, c.lost);
    }
  }
  [[nodiscard]] const Counted& all() { return table_["all"]; }

 private:
  const Result& unchanged(std::size_t k, std::size_t option) {
    const auto [place, is_new] = before_.try_emplace({k, option});
    if (is_new) {
      const KnownModel& model = models_[k];
      place->second = ipminmax::run(*model.problem, settings_[option].options).best;
      const Rewriting same = Rewriting::unchanged(*model.problem);
      const Judgement judgement = judge(model, same, place->second, settings_[option].options);
      if (!judgement.wrong.empty() || !judgement.tolerated.empty())
        report(0, model, "unchanged", settings_[option].name, same, place->second, judgement,
               place->second);
    }
    return place->second;
  }

  static void report(std::uint64_t seed, const KnownModel& model, const std::string& said,
                     const char* option, const Rewriting& rewriting, const Result& result,
                     const Judgement& judgement, const Result& before) {
    const Eigen::VectorXd v = rewriting.original(result.v);
    const bool is_false = !judgement.wrong.empty(), is_tolerated = !judgement.tolerated.empty();
    std::printf("%s seed %llu: %s | %s | %s | %s, %s | v =%s (unchanged:%s) | %s\n",
                is_false       ? "FALSE"
                : is_tolerated ? "TOLERATED"
                               : "LOST",
                static_cast<unsigned long long>(seed), model.name.c_str(), said.c_str(), option,
                name_of(result.status).data(), name_of(result.certificate.kind).data(),
                numbers({v.begin(), v.end()}).c_str(), numbers(before.v).c_str(),
                (is_false       ? judgement.wrong
                 : is_tolerated ? judgement.tolerated
                                : result.message.substr(0, 200))
                    .c_str());
  }

  std::vector<KnownModel> models_ = known_models();
  std::vector<Setting> settings_ = settings();
  std::map<std::pair<std::size_t, std::size_t>, Result> before_;
  std::map<std::string, Counted> table_;
};

TEST(Metamorphic, NoClaimIsFalseHoweverTheModelIsWritten) {
  const auto runs = number_from("METAMORPHIC_RUNS", 1000);
  const std::uint64_t seed = number_from("METAMORPHIC_SEED", 20261127);
  Metamorphic all;
  for (std::uint64_t k = 0; k < runs; ++k) all.run(seed + k);
  all.print();
  EXPECT_EQ(all.all().wrong, 0);
}

}  // namespace
}  // namespace ipminmax::testing
