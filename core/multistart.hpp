#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"
#include "solver.hpp"

namespace IPMINMAX_API ipminmax {

/// A certified local minmax that one or more starts led to.
struct DistinctPoint {
  Result result;          ///< of the first start with Status::Solved, else the first of all
  Index first_start = 0;  ///< that start
  Index found = 0;        ///< number of starts that ended here
};

/// Answer of a multistart.
struct MultistartResult {
  /// The best point, see better(). Its counts, iterations, factorizations and times are those of
  /// all starts together.
  Result best;
  Index best_start = 0;
  /// Certified points, the smallest local minmax value first (the largest without free Min
  /// variables); equal values in the order of the starts. A local minmax value says nothing about
  /// other branches of inner maxima: the first row is the best value known, neither a global minmax
  /// nor a bound of it. With minmax_worst_case_starts the largest value found over y at each
  /// point's x ranks the points (result.worst_case), and each higher branch found is one more
  /// start.
  std::vector<DistinctPoint> points;
  /// How often each status occurred, in the order of the enumeration; zero counts left out.
  std::vector<std::pair<Status, Index>> statuses;
  Index starts = 0;  ///< made, those that were interrupted included
  /// UserStop, MaxCpuTime or MaxWallTime when not all starts were made to their end.
  std::optional<Status> interrupted;
};

/// Makes one model; all must be the same problem.
using ProblemFactory = std::function<std::unique_ptr<Problem>()>;

/// Whether a is a better answer than b. Classes, best first:
///   1. certified local minmax: the smaller objective;
///   2. first-order point to tol or the acceptable level whose second-order test is undecided:
///      first those whose inner maximum is clear (inertia of K_yy as expected), as otherwise the
///      objective need not be a value of the maximum; then the smaller objective;
///   3. point that passed its own second-order test but is no success, for want of a worst case or of
///      an end: the smaller value at the worst y that is known, or the smaller violation;
///   4. feasible point that is not stationary: the smaller error.total, since its objective may be
///      small for want of maximization only;
///   5. first-order point that the second-order test refuted: the smaller error.total;
///   6. infeasible point: the smaller violation;
///   7. no point at all.
[[nodiscard]] bool better(const Result& a, const Result& b);

/// Solves from max(minmax_starts, 1 + given.size()) starting points and collects what was found.
///
/// Start 0 is the model's own and runs first, alone; when it ends for a reason that no other start
/// can change (invalid problem, option or too few degrees of freedom) it stays the only one. The
/// given points follow, then random ones, uniform in a box: [lower, upper] for a variable with two
/// bounds, else what the bounds leave of [s - r, s + r] around the model's start s with
/// r = minmax_start_radius max(1, |s|), a tenth and a hundredth of it in turn. Only the model's
/// start uses the model's multipliers (warm_start_init_point). Where none is certified and start 0
/// failed, one more begins as start 0 did and goes on as solve does (minmax_max_restarts), so that
/// no single solve finds more.
///
/// max_iter and tolerances hold for each start, max_cpu_time and max_wall_time for all together.
/// Two certified points are the same when each variable differs by at most minmax_distinct_tol of
/// its box or, without two bounds, of the spread of its values.
///
/// Without minmax_worst_case_starts the y of all starts (of at most 1000 uncertified ones) are
/// tried at the best point's x; where one is worse, best.worst_case.higher and the message say so.
/// With robust constraints, minmax_epigraph or minmax_epigraph_at_kinks each start is refined over
/// its worst cases (robust.hpp), and certified points with the same x are one, with the higher value.
/// minmax_max_factorizations holds for all starts together, which are then made one by one.
///
/// Calling thread only. Exceptions pass through as from solve; a given point whose length is not n
/// throws std::invalid_argument.
[[nodiscard]] MultistartResult multistart(Problem& problem, const SolverOptions& options,
                                          const MultistartObserver& observer = {},
                                          const std::vector<std::vector<double>>& given = {});

/// The same with up to `threads` threads (at least 1; the calling thread is one of them), each with
/// a model of its own made in the calling thread. The answer does not depend on the number of
/// threads unless a time limit or the observer interrupts. An exception of the model stops the
/// starts after its own; the exception of the earliest start passes through when all threads have
/// ended. MUMPS is not thread-safe and runs in one thread at a time, the other linear solvers in
/// parallel.
[[nodiscard]] MultistartResult multistart(const ProblemFactory& make_problem, int threads,
                                          const SolverOptions& options,
                                          const MultistartObserver& observer = {},
                                          const std::vector<std::vector<double>>& given = {});

/// The same with the starts on all MPI ranks, each with `threads` threads: a program of which every
/// rank calls this with the same problem, options and given points (mpirun -n 8 program); on one
/// rank it is multistart. All ranks return the same answer, which is the same, bit by bit, for any
/// number of ranks and threads: iterates and values of every start, points and their order, best,
/// statuses. (Times differ, and counts.analyses, as each thread makes its own.)
///
/// Rank 0 hands the starts out one by one, so that a slow one holds nobody up. on_result is called
/// on rank 0 for every start, on_iteration and message on the rank that makes the start; false
/// there stops all. The starts of a rank that dies are made by others where the launcher lets these
/// live (mpirun --enable-recovery); else the launcher's SIGTERM ends the starts with
/// Status::UserStop and the best point so far. max_cpu_time holds for each rank, max_wall_time for
/// all together; linear_solver mumps_mpi cannot be used, as no rank is a worker.
///
/// Loads libipminmax_mpi.so and initializes MPI unless the program has. The model's functions are
/// called in other threads than the calling one, which is the one that calls MPI. Throws
/// SolverUnavailable (linalg/symmetric_solver.hpp) where MPI cannot be used or not all ranks call
/// this within two minutes; an exception of a model stops all starts and passes through, on other
/// ranks as std::runtime_error.
[[nodiscard]] MultistartResult multistart_over_ranks(
    const ProblemFactory& make_problem, int threads, const SolverOptions& options,
    const MultistartObserver& observer = {}, const std::vector<std::vector<double>>& given = {});

/// This process among the ranks that share starts.
struct StartsRank {
  int rank = 0;
  int size = 1;
};
/// Joins the other ranks, which have to do the same or call multistart_over_ranks, and says who is
/// who: to print on rank 0 only. Throws as multistart_over_ranks.
[[nodiscard]] StartsRank join_ranks_for_starts();

/// The points as a table of comma-separated values, first line: rank, value (local minmax value),
/// found (starts that ended here), first_start, margin (of the certificate), status, v_0, v_1, ...;
/// numbers with all their digits.
[[nodiscard]] std::string points_as_csv(const MultistartResult& result);

}  // namespace ipminmax
