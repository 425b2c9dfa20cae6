// A program as users write them, run by the scripts of this folder:
//   program solve [--thread]       one solve with linear_solver mumps_mpi, in a thread of its own
//   program loop                    solves a larger problem again and again until one fails
//   program large FILE              a small problem and, when FILE is there, one with large factors
//   program compare K               verdicts and values beside those of the sequential MUMPS, of
//                                   every K-th small problem and of large ones
//   program starts FILE THREADS STARTS   starts on all ranks; what was found goes to FILE
//   program one_process FILE THREADS STARTS   the same without MPI
//   program slow_starts STARTS      starts that take 0.15 s each
//   program proofs FILE             proofs over y on all ranks; what they say goes to FILE
//   program proof_that_throws       one whose model throws on the last rank
// Compiled with IPMINMAX_TEST_CALLS_MPI it is a program that calls MPI itself: its first argument
// is the thread level, 0 to 3.
#ifdef IPMINMAX_TEST_CALLS_MPI
#include <mpi.h>
#endif

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <ios>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <problems/scalable_problems.hpp>
#include <problems/small_problems.hpp>
#include <support/without_hessian.hpp>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/multistart.hpp"
#include "core/proof.hpp"
#include "core/solver.hpp"

namespace {

using namespace ipminmax;
using namespace ipminmax::testing;
using ipminmax::testing::AutodiffProblem;

SolverOptions on_ranks() {
  SolverOptions options;
  options.linear_solver = LinearSolver::MumpsMpi;
  return options;
}

int tell(const Result& result) {
  std::printf("%s: %s\n", std::string(name_of(result.status)).c_str(), result.message.c_str());
  std::fflush(stdout);
  return result.status == Status::Solved ? 0 : 3;
}

int solve_once(bool in_thread) {
  const ScalableProblem family = f01_quad(200);
  Result result;
  const auto work = [&] { result = solve(*family.problem, on_ranks()); };
  if (in_thread) {
    std::thread(work).join();
  } else {
    work();
  }
  return tell(result);
}

int solve_until_failure() {
  const ScalableProblem family = f30_few_min(10, 60);
  SolverOptions options = on_ranks();
  options.minmax_schur_complement = SchurComplementUse::No;
  for (int k = 0; k < 1000; ++k) {
    const Result result = solve(*family.problem, options);
    if (k == 0) {
      std::puts("first solve done");
      std::fflush(stdout);
    }
    if (result.status != Status::Solved) return tell(result);
  }
  return 0;
}

/// A small problem; when the file is there, one whose factors are large.
int solve_large(const char* file) {
  int code = solve_once(false);
  std::puts("first solve done");
  std::fflush(stdout);
  while (!std::ifstream(file)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const ScalableProblem family = f30_few_min(20, 200);
  SolverOptions options = on_ranks();
  options.minmax_schur_complement = SchurComplementUse::No;
  options.max_iter = 1;
  return code + tell(solve(*family.problem, options));
}

// --- The same certificates as with the sequential MUMPS ------------------------------------------

bool compare(const std::string& name, Problem& problem) {
  SolverOptions options;
  options.linear_solver = LinearSolver::Mumps;
  const Result expected = solve(problem, options);
  options.linear_solver = LinearSolver::MumpsMpi;
  const Result found = solve(problem, options);
  const bool same = found.status == expected.status &&
                    found.certificate.kind == expected.certificate.kind &&
                    found.certificate.second_order == expected.certificate.second_order &&
                    found.certificate.inner == expected.certificate.inner &&
                    found.certificate.full == expected.certificate.full &&
                    std::abs(found.objective - expected.objective) <=
                        1e-5 * std::max(1.0, std::abs(expected.objective));
  if (!same) {
    std::printf("%s: %s, objective %.12g; sequential %s, %.12g\n", name.c_str(),
                std::string(name_of(found.status)).c_str(), found.objective,
                std::string(name_of(expected.status)).c_str(), expected.objective);
  }
  return same;
}

int compare_all(std::size_t stride) {
  int different = 0, compared = 0;
  const auto check = [&](const std::string& name, Problem& problem) {
    ++compared;
    if (!compare(name, problem)) ++different;
  };
  const std::vector<SmallProblem>& smalls = small_problems();
  for (std::size_t k = 0; k < smalls.size(); k += stride) {
    const SmallProblem& small = smalls[k];
    if (small.expectation != Expectation::Local && small.expectation != Expectation::Global) {
      continue;  // no answer that rounding leaves alone
    }
    AutodiffProblem problem(small.model, small.starts.front());
    check(small.name, problem);
  }
  const std::function<ScalableProblem()> families[] = {
      [] { return f01_quad(100); },       [] { return f03_quad_box(60); },
      [] { return f05_trig(40); },        [] { return f10_ball_halfspace(20); },
      [] { return f12_robust_ls(6, 3); }, [] { return f16_lq_game(40); },
      [] { return f17_mpc_box(40); },     [] { return f19_pde(40); },
      [] { return f23_sphere(20); },      [] { return f30_few_min(3, 20); }};
  for (const auto& make : families) {
    const ScalableProblem family = make();
    check(family.name, *family.problem);
  }
  for (const Ipopt::Index horizon : {20, 40, 160}) {
    TnlpProblem problem(
        new chauffeur::ChauffeurTNLP(chauffeur::refined(horizon), {}, {0.01, 0.002, 0.001}));
    if (const std::string error = problem.load(); !error.empty()) {
      std::puts(error.c_str());
      return 1;
    }
    check("chauffeur " + std::to_string(horizon), problem);
  }
  std::printf("%d compared, %d different\n", compared, different);
  return different == 0 && compared > 20 ? 0 : 1;
}

// --- Starts --------------------------------------------------------------------------------------

void write(std::ofstream& file, const Result& result) {
  file << name_of(result.status) << ' ' << result.iterations << ' ' << result.objective << ' '
       << result.error.total << ' ' << result.certificate.margin;
  for (const auto* values : {&result.v, &result.lambda, &result.z_lower, &result.z_upper}) {
    for (const double value : *values) file << ' ' << value;
  }
  const Counts& c = result.counts;
  file << " | " << c.objective << ' ' << c.gradient << ' ' << c.constraints << ' ' << c.jacobian
       << ' ' << c.hessian << ' ' << c.factorizations_full << ' ' << c.factorizations_inner << ' '
       << c.solves << '\n';
}

void write(std::ofstream& file, const MultistartResult& found) {
  write(file, found.best);
  file << found.best_start << ' ' << found.starts << '\n';
  for (const auto& [status, count] : found.statuses)
    file << name_of(status) << ' ' << count << '\n';
  for (const DistinctPoint& point : found.points) {
    file << point.first_start << ' ' << point.found << ' ';
    write(file, point.result);
  }
}

/// A model that owns the one that its second derivatives are taken from.
class OwnedWithoutHessian final : public ForwardingProblem {
 public:
  explicit OwnedWithoutHessian(std::unique_ptr<Problem> model)
      : OwnedWithoutHessian(std::move(model), 0) {}

  [[nodiscard]] const ProblemStructure& structure() const override { return without_.structure(); }

 private:
  OwnedWithoutHessian(std::unique_ptr<Problem> model, int)
      : ForwardingProblem(*model), model_(std::move(model)), without_(*model_) {}
  std::unique_ptr<Problem> model_;
  WithoutHessian without_;
};

int share_starts(const char* file_name, int threads, int starts, bool over_ranks) {
  SolverOptions options;
  options.minmax_starts = starts;
  options.minmax_start_radius = 3.0;
  std::ofstream file(file_name);
  file << std::hexfloat;
  const auto run = [&](const ProblemFactory& make) {
    const MultistartResult found = over_ranks ? multistart_over_ranks(make, threads, options)
                                              : multistart(make, threads, options);
    write(file, found);
    std::printf("%d starts, %zu points\n", found.starts, found.points.size());
  };
  for (const char* name : {"paper_f3", "tc5", "rh7"}) {
    const SmallProblem& small = small_problem(name);
    run([&] { return std::make_unique<AutodiffProblem>(small.model, small.starts.front()); });
  }
  options.linear_solver = LinearSolver::Mumps;
  run([] { return std::move(f05_trig(8).problem); });
  options.linear_solver = LinearSolver::Auto;
  options.minmax_schur_complement = SchurComplementUse::Yes;
  run([] { return std::move(f05_trig(6).problem); });
  options.minmax_schur_complement = SchurComplementUse::Auto;
  options.minmax_starts = starts / 4;
  run([] { return std::make_unique<OwnedWithoutHessian>(f05_trig(5).problem); });
  return file ? 0 : 1;
}

/// Takes its time; start 0 is fast.
class Slow final : public ForwardingProblem {
 public:
  explicit Slow(std::unique_ptr<Problem> model) : Slow(std::move(model), 0) {}
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    if (slow_) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return ForwardingProblem::objective(v, new_v, f);
  }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    slow_ = false;
    return ForwardingProblem::starting_point(start);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v, std::span<double> g) override {
    slow_ = true;
    return ForwardingProblem::gradient(v, new_v, g);
  }

 private:
  Slow(std::unique_ptr<Problem> model, int) : ForwardingProblem(*model), model_(std::move(model)) {}
  std::unique_ptr<Problem> model_;
  bool slow_ = false;
};

int share_slow_starts(int starts) {
  SolverOptions options;
  options.minmax_starts = starts;
  MultistartObserver observer;
  observer.on_result = [](Index start, const Result&) {
    if (start == 10) std::puts("under way");
    std::fflush(stdout);
  };
  observer.message = [](Index, std::string_view text) {
    std::printf("%s\n", std::string(text).c_str());
    std::fflush(stdout);
  };
  const MultistartResult found = multistart_over_ranks(
      [] { return std::make_unique<Slow>(f05_trig(4).problem); }, 1, options, observer);
  if (join_ranks_for_starts().rank > 0) return 0;
  std::printf("%d starts, %zu points, %s\n", found.starts, found.points.size(),
              found.best.message.c_str());
  std::fflush(stdout);
  return found.starts == starts ? 0 : 4;
}

// --- Proofs --------------------------------------------------------------------------------------

/// The six-hump camel, in a disc.
struct Camel {
  bool throws = false;  ///< over boxes
  template <class T>
  T objective(std::span<const T> v) const {
    if (std::is_same_v<T, IntervalJet> && throws) throw std::runtime_error("the model throws");
    const T a = square(v[1]), b = square(v[2]);
    return v[0] - (a * (4.0 - 2.1 * a + square(a) / 3.0) + v[1] * v[2] + b * (4.0 * b - 4.0));
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = square(v[1]) + square(v[2]);
  }
};

ProvableProblem<Camel> camel(double radius, bool throws) {
  return {Camel{throws},
          {.players = {Player::Min, Player::Max, Player::Max},
           .start = {0.5, 0.0, 0.0},
           .lower = {0.0, -3.0, -2.0},
           .upper = {1.0, 3.0, 2.0},
           .constraint_lower = {-2e19},
           .constraint_upper = {radius * radius}}};
}

int share_proofs(const char* file_name) {
  std::ofstream file(file_name);
  file << std::hexfloat;
  const std::vector<double> v = {0.5, 0.0, 0.0};
  for (const double radius : {10.0, 0.5}) {
    for (const Index most_boxes : {1'000'000, 640}) {
      auto problem = camel(radius, false);
      ProofRequest request;
      request.tolerance = 1e-8;
      request.most_boxes = most_boxes;
      const WorstCaseProof proof = prove_worst_case_over_ranks(problem, v, {}, request);
      file << proof.seen << ' ' << proof.proved << ' ' << proof.boxes << ' ' << proof.complete
           << ' ' << proof.left << " | " << proof.message;
      for (const double value : proof.v) file << ' ' << value;
      file << '\n';
    }
  }
  return file ? 0 : 1;
}

int throw_in_a_proof() {
  const auto [rank, size] = join_ranks_for_starts();
  auto problem = camel(1.0, rank == size - 1);
  try {
    const std::vector<double> v = {0.5, 0.0, 0.0};
    static_cast<void>(prove_worst_case_over_ranks(problem, v, {}));
  } catch (const std::runtime_error& error) {
    std::puts(error.what());
    std::fflush(stdout);
    return 0;
  }
  return 5;
}

int run(int argc, char** argv) {
  const std::string task = argc > 1 ? argv[1] : "";
  if (task == "solve") return solve_once(argc > 2);
  if (task == "loop") return solve_until_failure();
  if (task == "large" && argc > 2) return solve_large(argv[2]);
  if (task == "compare" && argc > 2) return compare_all(std::stoul(argv[2]));
  if ((task == "starts" || task == "one_process") && argc > 4) {
    return share_starts(argv[2], std::atoi(argv[3]), std::atoi(argv[4]), task == "starts");
  }
  if (task == "slow_starts" && argc > 2) return share_slow_starts(std::atoi(argv[2]));
  if (task == "proofs" && argc > 2) return share_proofs(argv[2]);
  if (task == "proof_that_throws") return throw_in_a_proof();
  std::fputs("unknown task\n", stderr);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
#ifdef IPMINMAX_TEST_CALLS_MPI
  int provided = 0;
  const int levels[] = {MPI_THREAD_SINGLE, MPI_THREAD_FUNNELED, MPI_THREAD_SERIALIZED,
                        MPI_THREAD_MULTIPLE};
  MPI_Init_thread(&argc, &argv, levels[std::atoi(argv[1])], &provided);
  const int exit_code = run(argc - 1, argv + 1);
  MPI_Finalize();
  return exit_code;
#else
  return run(argc, argv);
#endif
}
