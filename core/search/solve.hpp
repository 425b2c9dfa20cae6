#pragma once

#include <optional>
#include <string>

#include "core/method/restoration.hpp"
#include "core/model/budget.hpp"
#include "core/search/kept_work.hpp"
#include "core/search/search.hpp"

namespace ipminmax {

/// One solve: the best of a list of searches, all within one budget of iterations.
class Solve {
 public:
  /// kept: of the last solve, replaced by that of this one. Null: nothing is kept.
  Solve(Problem& problem, const SolverOptions& options, Budget& shared,
        const SolveObserver& observer, KeptWork* kept);
  /// A solve inside a solve, for its restoration: no restoration and no certificate of its own, and
  /// minmax_max_factorizations is what that one leaves it.
  [[nodiscard]] static Solve nested(Problem& problem, const SolverOptions& options, Budget& shared,
                                    const SolveObserver& observer);

  [[nodiscard]] Result run();

 private:
  /// What the searches work with.
  struct Machinery;

  [[nodiscard]] Result run_guarded();
  [[nodiscard]] Result run_checked();
  [[nodiscard]] Result search();
  [[nodiscard]] bool analyze(Machinery& machinery);
  [[nodiscard]] const KktAnalysis* kept_analysis() const;
  [[nodiscard]] SearchOutcome search_all(Machinery& machinery, Start& start);
  [[nodiscard]] SearchOutcome search_from(const Start& start, Machinery& machinery);
  /// Whether a search that is stuck is followed by one with the other mu_strategy.
  [[nodiscard]] bool may_change_rule() const;
  [[nodiscard]] std::optional<Start> start_with_other_rule(Machinery& machinery);
  [[nodiscard]] std::optional<Start> next_start(Machinery& machinery);
  [[nodiscard]] StepMethod& method_for(const Start& start, Machinery& machinery);
  [[nodiscard]] Restorer restorer(Machinery& machinery);
  [[nodiscard]] Result restoration(Machinery& machinery, Problem& problem,
                                   const SolverOptions& options, const SolveObserver& observer);
  [[nodiscard]] bool has_line_search() const;
  /// Names a constraint that no variable can mend.
  [[nodiscard]] std::optional<SearchOutcome> contradiction(const Search& search) const;
  /// Whether a solve that ended so returns the best point that it has seen instead of that.
  [[nodiscard]] bool returns_best(const BestPoint& best, const SearchOutcome& ended) const;
  void take_best(const BestPoint& best, SearchOutcome& outcome);
  [[nodiscard]] Result finish(Machinery& machinery, SearchOutcome outcome);
  [[nodiscard]] Result without_point(Status status, std::string message);
  void keep_work(const Machinery& machinery, Status status);
  void set_totals(Result& result) const;

  Solve(Problem& problem, const SolverOptions& options, Budget& shared,
        const SolveObserver& observer, Purpose purpose, KeptWork* kept);

  Problem& problem_;
  const SolverOptions& options_;
  Budget& shared_;
  const SolveObserver& observer_;
  Purpose purpose_;
  KeptWork* kept_;
  Counts counts_;
  Timing timing_;
  std::optional<SolveArrays> own_arrays_;
  SolveArrays& arrays_;
  TimeLimit limit_;
  IterationBudget budget_;
  CanonicalProblem canonical_;
  bool observer_threw_ = false;
};

}  // namespace ipminmax
