// mpi_scaling 2|3 SIDE [REPEATS]: factorization by mumps_mpi of the matrix of a game on a grid of
// SIDE^2 or SIDE^3 points, symmetric indefinite, on the ranks that it is started with:
//   mpirun -n 1 mpi_scaling 3 44 : -n 3 ipminmax-worker --verbose
// Prints the predictions of the analysis, the shortest times and the peak memory of rank 0; workers
// tell theirs with --verbose.
//
// mpi_scaling solve SIDE [REPEATS]: a whole solve (quartic_grid, 2 SIDE^2 variables) beside one
// with the sequential MUMPS.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "core/solver.hpp"
#include "linalg/make_solver.hpp"
#include "planted_problem.hpp"

namespace {

using namespace ipminmax;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Points with an even number belong to Min (diagonal +), the others to Max (-); neighbours couple.
SymmetricMatrix grid(int dimensions, Index side) {
  std::vector<Triplet> entries;
  const Index layers = dimensions == 3 ? side : 1;
  const auto point = [&](Index i, Index j, Index k) { return (k * side + j) * side + i; };
  for (Index k = 0; k < layers; ++k) {
    for (Index j = 0; j < side; ++j) {
      for (Index i = 0; i < side; ++i) {
        const Index here = point(i, j, k);
        entries.push_back({here, here});
        if (i > 0) entries.push_back({here, point(i - 1, j, k)});
        if (j > 0) entries.push_back({here, point(i, j - 1, k)});
        if (k > 0) entries.push_back({here, point(i, j, k - 1)});
      }
    }
  }
  SymmetricMatrix matrix(side * side * layers, entries);
  const auto positions = matrix.triplet_positions();
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const bool diagonal = entries[e].row == entries[e].col;
    const double own = entries[e].row % 2 == 0 ? 4.0 : -4.0;
    matrix.values()[static_cast<std::size_t>(positions[e])] = diagonal ? own : 1.0;
  }
  return matrix;
}

// --- Whole solves --------------------------------------------------------------------------------

/// The shortest of some solves, in seconds.
double whole_solve(Index side, LinearSolver linear_solver, int repeats) {
  SolverOptions options;
  options.linear_solver = linear_solver;
  options.minmax_schur_complement = SchurComplementUse::No;
  double best = 1e20;
  for (int r = 0; r < repeats; ++r) {
    const auto problem = bench::quartic_grid(side);
    const Result result = solve(*problem, options);
    best = std::min(best, result.seconds);
    if (r > 0) continue;
    std::printf("%s: %s, %d iterations, %d factorizations (%.2f s of %.2f s)\n",
                linear_solver == LinearSolver::Mumps ? "mumps" : "mumps_mpi",
                std::string(name_of(result.certificate.kind)).c_str(), result.iterations,
                result.factorizations, result.timing.factorization, result.seconds);
  }
  return best;
}

int compare_solves(Index side, int repeats) {
  const double sequential = whole_solve(side, LinearSolver::Mumps, repeats);
  const double ranks = whole_solve(side, LinearSolver::MumpsMpi, repeats);
  std::printf("sequential %.2f s, ranks %.2f s, ratio %.2f\n", sequential, ranks,
              ranks / sequential);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: mpi_scaling 2|3 SIDE [REPEATS], mpi_scaling solve SIDE [REPEATS]\n", stderr);
    return 2;
  }
  if (std::strcmp(argv[1], "solve") == 0) {
    return compare_solves(std::atoi(argv[2]), argc > 3 ? std::atoi(argv[3]) : 2);
  }
  const SymmetricMatrix matrix = grid(std::atoi(argv[1]), std::atoi(argv[2]));
  const int repeats = argc > 3 ? std::atoi(argv[3]) : 3;
  const auto solver = make_symmetric_solver(
      LinearSolver::MumpsMpi, {.ordering = Ordering::Metis, .mumps_memory_percent = 50});
  auto begin = std::chrono::steady_clock::now();
  const Analysis analysis = solver->analyze(matrix, {});
  if (!analysis.ok) return 1;
  std::printf("unknowns %d, entries of L %.3e, flops %.3e, analysis %.2f s\n", matrix.dimension(),
              static_cast<double>(analysis.factor_entries), analysis.flops, seconds_since(begin));
  double factorization = 1e20, solution = 1e20;
  for (int k = 0; k < repeats; ++k) {
    begin = std::chrono::steady_clock::now();
    const Factorization result = solver->factorize(matrix);
    factorization = std::min(factorization, seconds_since(begin));
    if (result.status != FactorizationStatus::Ok) return 1;
    std::vector<double> rhs(static_cast<std::size_t>(matrix.dimension()), 1.0);
    begin = std::chrono::steady_clock::now();
    solver->solve_in_place(rhs);
    solution = std::min(solution, seconds_since(begin));
    if (k == 0) {
      std::printf("inertia +%d -%d\n", result.inertia.positive, result.inertia.negative);
    }
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("factorization %.3f s, solution %.4f s, peak memory of rank 0 %ld MB\n",
              factorization, solution, usage.ru_maxrss / 1024);
  return 0;
}
