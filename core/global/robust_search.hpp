#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/global/robust_answer.hpp"
#include "core/model/budget.hpp"
#include "core/robust/robust_copies.hpp"

namespace ipminmax {

/// Which Max variables f reads, from its gradient around the start. n.
[[nodiscard]] std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start);

/// The search for worst cases around a list of solves, from one start of x: an exchange of
/// scenarios, then worst cases that move with x.
class RobustSearch {
 public:
  /// starts: maximizations over y per side of a robust constraint; 0: worst cases are not looked
  /// for. Told in the name of start `start` of x.
  RobustSearch(const RobustForm& form, const SolverOptions& options, Index starts, Budget& budget,
               Index start);

  /// start: n values of the solved form; empty: the model's. The y of the start is the first worst
  /// case, unless worst cases of a constraint near this start are known, of the solved form.
  /// at_kink: x is the answer of a solve, and the maxima over y there are the first worst cases.
  [[nodiscard]] Result run(std::vector<double> start,
                           const std::vector<RobustWorstCase>& known = {}, bool at_kink = false);

 private:
  using WorstCases = std::vector<RobustCopies::WorstCase>;
  /// Where the next solve begins.
  struct Place {
    std::vector<double> v;
    WorstCases worst_cases{};
    bool moved = false;  ///< v is no longer the model's
    bool near = false;   ///< v is the answer of a solve
  };
  /// The problem of a list of worst cases, and its answer.
  struct Solved {
    std::unique_ptr<RobustCopies> copies;
    Result result;
  };
  /// How y is treated in rounds of solving and looking for worst cases.
  enum class Y {
    HeldCoarsely,  ///< few rounds, which bring x near
    Held,          ///< until no y violates a constraint
    Moving,        ///< it moves with x, until no other y violates a constraint
  };
  [[nodiscard]] Result solve_from(const Place& first);
  [[nodiscard]] bool exchange();
  [[nodiscard]] std::optional<std::vector<SideScan>> rounds(Y y);
  [[nodiscard]] Solved solve_worst_cases(bool from_afar);
  [[nodiscard]] std::vector<SideScan> scan(Index starts, const WorstCases& known);
  [[nodiscard]] bool add_violated(const std::vector<SideScan>& scans, double tolerance, bool held);
  [[nodiscard]] WorstCases many_scenarios();
  void release(const std::vector<SideScan>& scans, double nearly);
  void settle(const Solved& solved, const std::vector<SideScan>& scans);
  void report(const Solved& solved, const std::vector<SideScan>& scans, bool verified);
  [[nodiscard]] bool is_same_across_bounds(const Solved& solved);
  void name_infeasible(std::vector<double> start);  // robust_infeasible.cpp

  RobustForm form_;
  VariableRanges ranges_;
  const SolverOptions& options_;
  Index starts_;
  Budget& budget_;
  Index start_;
  SolveObserver observer_;
  RobustScopes scopes_;
  std::vector<RobustWorstCase> followed_;  ///< of the last solve, from which alone searches begin
  Place place_;
  std::size_t corners_added_ = 0;  ///< to the scenarios
  std::vector<bool> reads_y_;
  bool names_infeasible_ = true;
  bool restarts_ = false;  ///< searches that fail begin anew
  Index scans_ = 0;        ///< made
  Result answer_;
  Result work_;  ///< of all solves and maximizations
};

}  // namespace ipminmax
