// K by way of K_yy and its dense complement against K as a whole: predicted operations, one
// factorization, whole solves, and what minmax_schur_complement auto makes of it.

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <problems/scalable_problems.hpp>

#include "core/solver.hpp"
#include "kkt_matrices.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/schur_complement.hpp"
#include "planted_problem.hpp"
#include "program.hpp"

namespace bench {
namespace {

using ipminmax::Certainty;
using ipminmax::Index;
using ipminmax::SchurComplementUse;
using ipminmax::SymmetricSolver;

struct Source {
  std::string name;
  std::function<std::unique_ptr<ipminmax::Problem>()> problem;
};

std::vector<Source> sources() {
  using namespace ipminmax::testing;
  std::vector<Source> all;
  for (const int side : {10, 30, 100, 200}) {
    for (const int x : {1, 5, 20, 100}) {
      all.push_back({"few min " + std::to_string(x) + ", grid " + std::to_string(side),
                     [x, side] { return f30_few_min(x, side).problem; }});
    }
  }
  for (const int n : {100, 1000}) {
    all.push_back({"f01 quadratic " + std::to_string(n), [n] { return f01_quad(n).problem; }});
    all.push_back({"LQ game T=" + std::to_string(n), [n] { return f16_lq_game(n).problem; }});
  }
  all.push_back({"1-D elliptic 300", [] { return f19_pde(300).problem; }});
  all.push_back({"robust least squares 30x10", [] { return f12_robust_ls(30, 10).problem; }});
  all.push_back({"elliptic grid 16", [] { return elliptic_grid(16); }});
  all.push_back({"quartic grid 16", [] { return quartic_grid(16); }});
  return all;
}

std::unique_ptr<SymmetricSolver> analyzed(const KktMatrix& k, ipminmax::Analysis& analysis) {
  auto solver = make_symmetric_solver(ipminmax::LinearSolver::Auto, {.ldlt_gamma = 1e-10});
  analysis = solver->analyze(k.matrix, k.signs);
  if (!analysis.ok) throw std::runtime_error("out of memory in the analysis");
  return solver;
}

void compare(const Source& source, double seconds, Table& table) {
  const auto problem = source.problem();
  ipminmax::SolverOptions options;
  options.minmax_schur_complement = SchurComplementUse::No;
  const KktMatrices m = kkt_matrices_after(*problem, 2, options);
  ipminmax::Analysis full_analysis, inner_analysis;
  const auto full = analyzed(m.full, full_analysis);
  const auto inner = analyzed(m.inner, inner_analysis);
  ipminmax::SchurComplement schur(m.full.matrix, m.inner_row);
  const ipminmax::Factorization whole = full->factorize(m.full.matrix, Certainty::Usual);
  const ipminmax::Factorization part = inner->factorize(m.inner.matrix, Certainty::Usual);
  if (part.status != ipminmax::FactorizationStatus::Ok) return;

  std::array<ipminmax::Result, 3> results;  // no, yes, auto
  const auto whole_solve = [&](SchurComplementUse use, std::size_t which) {
    const Clock clock;
    ipminmax::SolverOptions o;
    o.minmax_schur_complement = use;
    results[which] = solve(*problem, o);
    return clock.seconds();
  };
  const std::vector<std::function<double()>> contestants = {
      [&] {
        const Clock clock;
        (void)full->factorize(m.full.matrix, Certainty::Usual);
        return clock.seconds();
      },
      [&] {
        const Clock clock;
        (void)(schur.form(m.full.matrix, *inner) && schur.factorize(m.full.matrix).inertia.zero);
        return clock.seconds();
      },
      [&] { return whole_solve(SchurComplementUse::No, 0); },
      [&] { return whole_solve(SchurComplementUse::Yes, 1); },
      [&] { return whole_solve(SchurComplementUse::Auto, 2); }};
  const auto times =
      alternate({.seconds = seconds, .min_rounds = 3, .max_rounds = 31}, contestants);
  const auto kind = [](const ipminmax::Factorization& f) {
    return f.trust.pivoted ? "pivoting" : "LDL'";
  };
  table.row().text(source.name).integer(m.full.matrix.dimension()).integer(schur.outer_dimension());
  table.text(kind(whole)).text(kind(part));
  table.number(schur.predict_flops(*inner) / full_analysis.flops);
  table.time(spread(times[0]).median).number(spread_of_ratios(times[1], times[0]));
  table.time(spread(times[2]).median).number(spread_of_ratios(times[3], times[2]));
  table.text(results[2].counts.factorizations_complement > 0 ? "yes" : "no");
  table.integer(results[0].counts.factorizations_full);
  table.integer(results[0].counts.factorizations_inner);
  table.integer(results[1].counts.factorizations_full);
  table.integer(results[1].counts.factorizations_inner);
  table.integer(results[1].counts.factorizations_complement);
  table.text(results[0].certificate.kind == results[1].certificate.kind ? "same" : "OTHER");
}

void run(const Settings& settings, const std::string& only) {
  Table table({"problem", "rows of K", "outer rows", "K by", "K_yy by", "flops S / K", "K", "S / K",
               "solve by K", "by S / by K", "auto", "no: K", "K_yy", "yes: K", "K_yy", "S",
               "verdict"});
  std::vector<Source> chosen;
  for (const Source& source : sources()) {
    if (source.name.find(only) != std::string::npos) chosen.push_back(source);
  }
  if (chosen.empty()) throw std::invalid_argument("no problem " + only);
  for (const Source& source : chosen) {
    compare(source, settings.seconds / static_cast<double>(chosen.size()), table);
  }
  publish(
      table,
      "K by way of K_yy (S: product with the inverse and dense complement, K_yy being factorized) "
      "against K as a whole; ratios below 1 favour the complement",
      "schur", settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  std::string only;
  CommandLine command_line("schur: K by way of K_yy and its dense complement");
  command_line.add("--problems", only, "only those whose name contains it");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    bench::print_environment();
    bench::run(settings, only);
  });
}
