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

/// A certified local minmax at which one or more starts ended.
struct DistinctPoint {
  Result result;          ///< of the first start with Status::Solved, else of the first start
  Index first_start = 0;  ///< number of that start
  Index found = 0;        ///< number of starts that ended here
};

/// Answer of a multistart.
struct MultistartResult {
  /// The best point, see better(). Its counts, iterations, factorizations and times are those of
  /// all starts together.
  Result best;
  Index best_start = 0;
  /// Certified points, the smallest local minmax value first (the largest if all of Min's variables
  /// are fixed), equal values in the order of the starts. The first value is the best one known; it
  /// is neither the global minmax value nor a bound of it, since other maxima over y may be higher.
  /// With minmax_worst_case_starts points are ranked by the largest value found over y at their x
  /// (result.worst_case), and each higher maximum found is one more start.
  std::vector<DistinctPoint> points;
  /// Number of starts with each status, in the order of the enumeration, without zeros.
  std::vector<std::pair<Status, Index>> statuses;
  Index starts = 0;  ///< number of starts made, including interrupted ones
  /// UserStop, MaxCpuTime or MaxWallTime if not all starts were finished.
  std::optional<Status> interrupted;
};

/// Makes a model. All models that it makes must be the same problem.
using ProblemFactory = std::function<std::unique_ptr<Problem>()>;

/// Returns whether a is a better answer than b. Classes, best first:
///   1. certified local minmax: the smaller objective;
///   2. first-order point to tol or the acceptable level whose second-order test is undecided:
///      first those whose inner maximum is clear (inertia of K_yy as expected), as otherwise the
///      objective need not be a value of the maximum; then the smaller objective;
///   3. point that passed the second-order test but is no success (a y is known with a higher f or
///      a violated robust constraint, or the search was cut short): the smaller value at the y with
///      the highest f known, or the smaller violation;
///   4. feasible point that is not stationary: the smaller error.total, since its objective may be
///      small only because y is not a maximum;
///   5. first-order point that the second-order test refuted: the smaller error.total;
///   6. infeasible point: the smaller violation;
///   7. no point at all.
[[nodiscard]] bool better(const Result& a, const Result& b);

/// Solves from max(minmax_starts, 1 + given.size()) starting points and collects what was found.
/// MultistartObserver (iteration.hpp) has on_result(start, result), called after each start, and
/// on_iteration, which stops all starts by returning false.
///
/// Start 0 is the model's own and runs first, alone. If it ends for a reason that no other start
/// can change (invalid problem, invalid option, too few degrees of freedom), no other start is
/// made. The given points follow, then random ones, uniform in a box: [lower, upper] for a variable
/// with two bounds, else the part within the bounds of [s - r, s + r] around the model's start s,
/// with r in turn 1, 1/10 and 1/100 of minmax_start_radius max(1, |s|). Only start 0 uses the
/// model's multipliers (warm_start_init_point). If no point is certified and start 0 failed, one
/// more search begins at start 0 and makes restarts as solve does (minmax_max_restarts).
///
/// max_iter and tolerances hold for each start, max_cpu_time and max_wall_time for all together.
/// minmax_max_factorizations holds for all together, and the starts are then made one by one. Two
/// certified points are the same if each variable differs by at most minmax_distinct_tol of its box
/// or, without two bounds, of the spread of its values.
///
/// Without minmax_worst_case_starts f is evaluated at the best point's x with the y of all starts
/// (at most 1000 uncertified ones). If one gives a higher f, best.worst_case.higher is set and the
/// message says so.
///
/// With robust constraints, minmax_epigraph or minmax_epigraph_at_kinks each start is refined over
/// its worst cases (robust.hpp); certified points with the same x count as one, with the higher
/// value.
///
/// Runs in the calling thread. Exceptions pass through as from solve. Throws std::invalid_argument
/// if a given point has not n values.
[[nodiscard]] MultistartResult multistart(Problem& problem, const SolverOptions& options,
                                          const MultistartObserver& observer = {},
                                          const std::vector<std::vector<double>>& given = {});

/// Solves the same with up to `threads` threads (at least 1, the calling thread included). Each has
/// a model of its own, made in the calling thread. The answer does not depend on the number of
/// threads unless a time limit or the observer interrupts. If a model throws, later starts are not
/// made, and the exception of the earliest start passes through after all threads have ended. MUMPS
/// is not thread-safe and runs in one thread at a time; the other linear solvers run in parallel.
[[nodiscard]] MultistartResult multistart(const ProblemFactory& make_problem, int threads,
                                          const SolverOptions& options,
                                          const MultistartObserver& observer = {},
                                          const std::vector<std::vector<double>>& given = {});

/// Solves the same with the starts on all MPI ranks, each with `threads` threads. Every rank of the
/// program (mpirun -n 8 program) must call this with the same problem, options and given points.
/// All ranks return the same answer, bit by bit, for any number of ranks and threads; only times
/// and counts.analyses differ.
///
/// Rank 0 hands out the starts one by one. on_result is called on rank 0 for every start,
/// on_iteration and message on the rank that makes the start; false stops all ranks. If a rank dies
/// and the launcher lets the others live (mpirun --enable-recovery), they make its starts.
/// Otherwise the launcher's SIGTERM ends the starts with Status::UserStop and the best point so
/// far. max_cpu_time holds for each rank, max_wall_time for all together. linear_solver mumps_mpi
/// cannot be used.
///
/// Loads libipminmax_mpi.so, and initializes MPI if the program has not. The calling thread calls
/// MPI; other threads call the model. Throws SolverUnavailable (linalg/symmetric_solver.hpp) if MPI
/// cannot be used or not all ranks call this within two minutes. An exception of a model stops all
/// starts and passes through, on other ranks as std::runtime_error.
[[nodiscard]] MultistartResult multistart_over_ranks(
    const ProblemFactory& make_problem, int threads, const SolverOptions& options,
    const MultistartObserver& observer = {}, const std::vector<std::vector<double>>& given = {});

/// The number of this process among the ranks that share starts.
struct StartsRank {
  int rank = 0;
  int size = 1;
};
/// Joins the other ranks, which must do the same or call multistart_over_ranks. Returns this
/// process's rank, for example to print on rank 0 only. Throws as multistart_over_ranks.
[[nodiscard]] StartsRank join_ranks_for_starts();

/// Returns the points as comma-separated values with all digits. The first line names the columns:
/// rank, value (local minmax value), found (number of starts that ended here), first_start, margin
/// (of the certificate), status, v_0, v_1, ...
[[nodiscard]] std::string points_as_csv(const MultistartResult& result);

}  // namespace ipminmax
