// What the certificate says of the answers of several thousand solves, to see what a change of it
// changes.
//
//   verdicts FILE [GAMES [SEED]]  solves the Hock-Schittkowski problems and their minmax twins, the
//                                 small, multimodal and scalable problems, semi-infinite programs, GAMES
//                                 (200) random games of each family from SEED (1) on; a line each
//   verdicts --compare A B        counts both files' verdicts by family, the factorizations, and
//                                 names what is certified or refuted in one file alone
//
// A certificate that an independent check of the games refutes is marked as false.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <hostile/judge_certificate.hpp>
#include <hostile/trap_game.hpp>
#include <problems/closed_form_games.hpp>
#include <problems/random_game.hpp>
#include <problems/random_multimodal.hpp>
#include <problems/scalable_problems.hpp>
#include <problems/semi_infinite_programs.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <regression/not_minima.hpp>
#include <regression/scalable_nlp.hpp>
#include <support/units_problem.hpp>

#include "core/solver.hpp"
#ifdef IPMINMAX_CHANGE_NUMBERS  // by bench/constants.sh
#include IPMINMAX_CHANGE_NUMBERS
#endif

namespace ipminmax::testing {
namespace {

/// Says whether a certificate is false; empty: nobody knows.
using Judge = std::function<bool(const Result& result)>;

class Writer {
 public:
  explicit Writer(std::ostream& file) : file_(file) {}

  Result run(std::string name, Problem& problem, const SolverOptions& options,
             const Judge& is_false = {}) {
    std::ranges::replace(name, ' ', '_');
    Result result = solve(problem, options);
    const Certificate& found = result.certificate;
    const bool certified = found.kind == PointKind::LocalMinmax;
    file_ << name << ' ' << (is_success(result.status) ? "solved" : "not") << ' '
          << name_of(found.second_order) << ' ' << static_cast<int>(found.answer) << ' '
          << result.factorizations << ' '
          << (certified && is_false && is_false(result) ? "false" : "-");
    for (const CertificateReason& reason : found.reasons) file_ << " | " << reason.text;
    file_ << '\n';
    return result;
  }

 private:
  std::ostream& file_;
};

/// With units of 10^-3 to 10^3, and of 10^-6 to 10^6.
void write_in_units(Writer& writer, const std::string& name, Problem& problem, std::uint64_t seed) {
  for (const int digits : {3, 6}) {
    UnitsProblem other = UnitsProblem::random(problem, digits, seed);
    writer.run("units_" + std::to_string(digits) + '/' + name, other, {});
  }
}

void write_minimizations(Writer& writer, bool in_units) {
  std::uint64_t seed = 0;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    const Result result = writer.run("hs/" + known.name, problem, {});
    if (in_units) write_in_units(writer, known.name, problem, ++seed);
    if (!is_success(result.status) || known.model.variables() >= 64) continue;
    std::vector<double> start = known.start;
    start.push_back(0.1);
    for (const Player owner : {Player::Min, Player::Max}) {
      AutodiffProblem game(twin(known.model, owner, result.v), start);
      const std::string family = owner == Player::Min ? "min_twin" : "max_twin";
      writer.run(family + '/' + known.name, game, {});
      if (in_units) write_in_units(writer, known.name + '.' + family, game, ++seed);
    }
  }
  for (const IllPosed& known : ill_posed()) {
    AutodiffProblem problem(known.model, known.start);
    writer.run("ill_posed/" + known.name, problem, {});
  }
  for (const NotMinimum& known : not_minima()) {
    AutodiffProblem problem(known.model, known.start);
    writer.run("not_minima/" + known.name, problem, {});
  }
  for (const ScalableNlp& family : scalable_nlps()) {
    for (const Index n : {20, 100}) {
      const auto problem = family.make(n);
      writer.run("scalable_nlp/" + family.name + '.' + std::to_string(n), *problem, {});
    }
  }
}

void write_collections(Writer& writer, std::uint64_t games, std::uint64_t first) {
  for (const SmallProblem& known : small_problems()) {
    for (std::size_t k = 0; k < known.starts.size(); ++k) {
      AutodiffProblem problem(known.model, known.starts[k]);
      writer.run("small/" + known.name + '.' + std::to_string(k), problem, {});
    }
  }
  for (ScalableProblem& family : small_scalable_problems()) {
    writer.run("scalable/" + family.name, *family.problem, {});
  }
  for (const SemiInfinite& program : semi_infinite_programs()) {
    AutodiffProblem problem(model_of(program), start_of(program));
    writer.run("semi_infinite/" + program.name, problem, {});
  }
  constexpr MultimodalKind kKinds[] = {MultimodalKind::Free, MultimodalKind::Box,
                                       MultimodalKind::Constrained};
  for (std::uint64_t seed = first; seed < first + games / 4; ++seed) {
    for (const MultimodalKind kind : kKinds) {
      const MultimodalProblem many =
          random_multimodal(kind, 1 + static_cast<int>(seed % 4), 1, seed);
      AutodiffProblem problem(many.model, many.starts[0]);
      writer.run(
          "multimodal/" + std::to_string(static_cast<int>(kind)) + '.' + std::to_string(seed),
          problem, {});
    }
  }
}

void write_games(Writer& writer, std::uint64_t games, std::uint64_t first) {
  const std::pair<const char*, RandomGame (*)(std::uint64_t)> hostile[] = {{"tame", tame_game},
                                                                           {"trap", trap_game}};
  for (const auto& [name, make] : hostile) {
    for (std::uint64_t seed = first; seed < first + 5 * games; ++seed) {
      const RandomGame game = make(seed);
      AutodiffProblem problem(game.model, game.start);
      writer.run(std::string(name) + '/' + std::to_string(seed), problem, game.options,
                 [&](const Result& result) {
                   return judge_certificate(problem, game.options, result, seed).verdict ==
                          CertificateVerdict::False;
                 });
    }
  }
  for (const ClosedFormFamily& family : closed_form_families()) {
    for (std::uint64_t seed = first; seed < first + games / 2; ++seed) {
      const ClosedForm game = family.game(seed);
      writer.run(std::string(family.name) + '/' + std::to_string(seed), *game.problem, {},
                 [&](const Result& result) { return judge(game, result, seed).refuted(); });
    }
  }
}

struct Verdict {
  bool solved = false, is_false = false;
  std::string second_order;
  int answer = 0, factorizations = 0;
};

std::map<std::string, Verdict> read(std::istream& file) {
  std::map<std::string, Verdict> all;
  for (std::string text; std::getline(file, text);) {
    std::istringstream words(text);
    std::string name, solved, judged;
    Verdict v;
    words >> name >> solved >> v.second_order >> v.answer >> v.factorizations >> judged;
    v.solved = solved == "solved";
    v.is_false = judged == "false";
    all[name] = v;
  }
  return all;
}

std::map<std::string, Verdict> read(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  return read(file);
}

void compare(const std::string& first, const std::string& second) {
  const auto a = read(first), b = read(second);
  struct Row {
    int runs = 0, lost = 0, gained = 0, refuted_less = 0, refuted_more = 0, others = 0;
    std::array<int, 2> certified{}, refuted{}, untrue{};
    std::array<long, 2> factorizations{};
  };
  std::map<std::string, Row> rows;
  for (const auto& entry : a) {
    const std::string& name = entry.first;
    const Verdict& before = entry.second;
    const auto place = b.find(name);
    if (place == b.end()) continue;
    const Verdict& after = place->second;
    for (Row* row : {&rows[name.substr(0, name.find('/'))], &rows["~ all"]}) {
      ++row->runs;
      const std::array<const Verdict*, 2> both = {&before, &after};
      for (std::size_t k = 0; k < 2; ++k) {
        row->certified[k] += both[k]->second_order == "satisfied";
        row->refuted[k] += both[k]->second_order == "violated";
        row->untrue[k] += both[k]->is_false;
        row->factorizations[k] += both[k]->factorizations;
      }
      const auto changes = [&](const char* what) {
        return (after.second_order == what) - (before.second_order == what);
      };
      row->lost += changes("satisfied") < 0;
      row->gained += changes("satisfied") > 0;
      row->refuted_less += changes("violated") < 0;
      row->refuted_more += changes("violated") > 0;
      row->others += before.second_order == after.second_order &&
                     (before.answer != after.answer || before.solved != after.solved);
    }
    if (before.second_order != after.second_order || after.is_false) {
      std::printf("  %-32s %s -> %s%s\n", name.c_str(), before.second_order.c_str(),
                  after.second_order.c_str(), after.is_false ? ", FALSE" : "");
    }
  }
  std::printf("%-16s %6s %13s %11s %11s %11s %9s %6s %15s\n", "family", "runs", "certified",
              "lost,gained", "refuted", "lost,gained", "false", "other", "factorizations");
  for (const auto& [name, r] : rows) {
    std::printf("%-16s %6d %6d %6d %5d %5d %5d %5d %5d %5d %4d %4d %6d %7ld %7ld\n", name.c_str(),
                r.runs, r.certified[0], r.certified[1], r.lost, r.gained, r.refuted[0],
                r.refuted[1], r.refuted_less, r.refuted_more, r.untrue[0], r.untrue[1], r.others,
                r.factorizations[0], r.factorizations[1]);
  }
}

void write(std::ostream& file, std::uint64_t games, std::uint64_t first) {
  Writer writer(file);
  if (first == 1) write_minimizations(writer, games >= 20);
  write_collections(writer, games, first);
  write_games(writer, games, first);
}

#ifdef IPMINMAX_CHANGE_NUMBERS
/// The verdicts of a table of games of these seeds and the collections.
std::map<std::string, Verdict> table(std::uint64_t games) {
  std::stringstream text;
  write(text, games, 1);
  return read(text);
}

void change_numbers(std::uint64_t games) {
  const auto before = table(games);
  std::printf("%zu solves\n%-32s %8s %8s | %9s | %9s | %6s %14s %5s\n", before.size(), "number",
              "value", "tried", "certified", "solved", "differ", "factorizations", "false");
  for (const auto& number : parameters::kNumbers) {
    const bool is_count =
        number.value == std::floor(number.value) && number.value > 1.0 && number.value < 1000.0;
    const double factor = is_count ? 3.0 : 10.0;
    for (const double times : {1.0 / factor, factor}) {
      double tried = is_count ? std::ceil(number.value * times) : number.value * times;
      // A share stays one: beyond it loops may not end.
      if (number.value < 1.0 && tried >= 1.0) tried = 1.0 - 0.1 * (1.0 - number.value);
      number.set(tried);
      std::array<int, 2> certified{}, solved{};  // lost, gained
      int differ = 0, untrue = 0;
      long factorizations = 0;
      for (const auto& [name, after] : table(games)) {
        const Verdict& was = before.at(name);
        const bool then = was.second_order == "satisfied", now = after.second_order == "satisfied";
        certified[0] += then && !now;
        certified[1] += now && !then;
        solved[0] += was.solved && !after.solved;
        solved[1] += after.solved && !was.solved;
        differ +=
            was.second_order != after.second_order || was.factorizations != after.factorizations;
        factorizations += after.factorizations - was.factorizations;
        untrue += after.is_false;
      }
      std::printf("%-32s %8g %8g | %4d %4d | %4d %4d | %6d %+14ld %5d\n", number.name.c_str(),
                  number.value, tried, certified[0], certified[1], solved[0], solved[1], differ,
                  factorizations, untrue);
      std::fflush(stdout);
    }
    number.set(number.value);
  }
}
#endif

}  // namespace
}  // namespace ipminmax::testing

int main(int argc, char** argv) {
  const auto number = [&](int k, std::uint64_t otherwise) -> std::uint64_t {
    return argc > k ? std::strtoull(argv[k], nullptr, 10) : otherwise;
  };
  try {
    if (argc >= 2 && argc <= 4 && argv[1][0] != '-') {
      std::ofstream file(argv[1]);
      ipminmax::testing::write(file, number(2, 200), number(3, 1));
      if (!file) throw std::runtime_error(std::string("cannot write ") + argv[1]);
      return 0;
    }
#ifdef IPMINMAX_CHANGE_NUMBERS
    if (argc == 3 && std::string_view(argv[1]) == "--constants") {
      ipminmax::testing::change_numbers(number(2, 5));
      return 0;
    }
#endif
    if (argc == 4 && std::string_view(argv[1]) == "--compare") {
      ipminmax::testing::compare(argv[2], argv[3]);
      return 0;
    }
    std::fprintf(stderr, "usage: verdicts FILE [GAMES [SEED]] | verdicts --compare FILE FILE\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "verdicts: %s\n", error.what());
  }
  return 2;
}
