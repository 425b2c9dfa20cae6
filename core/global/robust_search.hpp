#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/model/budget.hpp"
#include "core/robust/robust_copies.hpp"

namespace ipminmax {

/// A model in the form in which it is solved and as it was asked for: the same, its epigraph form,
/// which has one more variable and one more row, both last, or one of them with its rows in other
/// units.
struct RobustForm {
  Problem& solved;
  Problem& asked;
  RowUnits units;        ///< of solved
  Witnesses& witnesses;  ///< to which maxima over y are added
};

/// Which Max variables f reads, from its gradient around the start. n.
[[nodiscard]] std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start);

/// The search for worst cases around a list of solves, from one start of x.
class RobustSearch {
 public:
  /// starts: maximizations over y per side of a robust constraint; 0: worst cases are not looked
  /// for. Told in the name of start `start` of x.
  RobustSearch(RobustForm form, const SolverOptions& options, Index starts, Budget& budget,
               Index start);

  /// start: n values of the solved form; empty: the model's. The y of the start is the first worst
  /// case, unless worst cases of a constraint near this start are known, of the solved form.
  [[nodiscard]] Result run(std::vector<double> start,
                           const std::vector<RobustWorstCase>& known = {});
  /// Begins with the maxima over y at the x of start.
  [[nodiscard]] Result run_from_maxima(std::vector<double> start);

 private:
  /// Rounds of solving and looking for worst cases or scenarios.
  static constexpr Index kMostRounds = 30;
  /// Violation, beside the range of a row, up to which scenarios alone are exchanged first.
  static constexpr double kCoarse = 1e-3;
  /// Distance to the bound, beside the range of a row, up to which a maximum gets a copy.
  static constexpr double kNearlyActive = 1e-2;
  /// Distance, beside the range of each variable, up to which a maximum is that of a copy or of a
  /// scenario, which has moved or been left behind.
  static constexpr double kSameBranch = 0.05;

  /// Where the next solve begins.
  struct Place {
    std::vector<double> v;
    std::vector<RobustCopies::WorstCase> worst_cases{};
    bool moved = false;  ///< v is no longer the model's
    bool near = false;   ///< v is the answer of a solve
  };
  /// The problem of a list of worst cases, and its answer.
  struct Solved {
    std::unique_ptr<RobustCopies> copies;
    Result result;
  };
  [[nodiscard]] Result solve_from(const Place& first);
  void begin_anew(const Place& first);
  void choose_copies();
  void start_at_known(const std::vector<RobustWorstCase>& known);
  [[nodiscard]] bool solve_rounds();
  [[nodiscard]] Solved solve_worst_cases();
  [[nodiscard]] Solved solve_once(bool near);
  void hold_inactive(const RobustCopies& copies, const Result& result);
  void keep_point(const RobustCopies& copies, const Result& result);
  [[nodiscard]] bool look_further(const RobustCopies& copies, const Result& result, Index round);
  [[nodiscard]] bool add_violated(const std::vector<SideScan>& scans, double tolerance, bool held);
  [[nodiscard]] bool drop_inactive(const RobustCopies& copies, const Result& result);
  [[nodiscard]] std::vector<SideScan> scan(Index starts,
                                           const std::vector<RobustCopies::WorstCase>& known,
                                           const std::vector<SideScan>* before = nullptr);
  [[nodiscard]] bool wants_last_look(const std::vector<SideScan>& scans) const;
  [[nodiscard]] bool is_same(const RobustCopies::WorstCase& a, const RobustCopies::WorstCase& b,
                             double tol) const;

  // Scenarios; robust_scenarios.cpp.
  [[nodiscard]] bool exchange_from();
  [[nodiscard]] bool add_corners(const std::vector<SideScan>& scans);
  [[nodiscard]] std::optional<std::vector<SideScan>> exchange(double tolerance, bool reports);
  void take_scenarios();
  [[nodiscard]] std::vector<RobustCopies::WorstCase> active_scenarios(const RobustCopies& copies,
                                                                      const Result& result) const;
  [[nodiscard]] std::vector<double> gradient_in_x(const RobustCopies::WorstCase& one);
  void release(const std::vector<SideScan>& scans, double nearly);
  void add_missed(const std::vector<RobustCopies::WorstCase>& active,
                  const std::vector<SideScan>& scans);
  [[nodiscard]] bool leads_to(const RobustCopies::WorstCase& from,
                              const RobustCopies::WorstCase& to,
                              const std::vector<SideScan>& scans);

  void name_infeasible(std::vector<double> start);  // robust_infeasible.cpp

  // The answer; robust_answer.cpp.
  void report(const RobustCopies& copies, const Result& result);
  void tell_what_is_open(const std::vector<SideScan>& scans);
  [[nodiscard]] std::optional<std::size_t> highest_branch(const RobustCopies& copies,
                                                          const Result& result) const;
  [[nodiscard]] Result in_asked_shape(const RobustCopies& copies, const Result& result) const;
  void take_units_back(Result& result) const;
  [[nodiscard]] std::vector<RobustWorstCase> list_worst_cases(const RobustCopies& copies,
                                                              const Result& result) const;
  [[nodiscard]] Result finish();

  Problem& model_;  ///< in the form that is solved
  Problem& asked_;
  RowUnits units_;
  Witnesses& witnesses_;
  VariableRanges ranges_;
  const SolverOptions& options_;
  Index starts_;
  Budget& budget_;
  Index start_;
  SolveObserver observer_;
  RobustScopes scopes_;
  Place place_;
  std::size_t corners_added_ = 0;                ///< to the scenarios
  std::vector<RobustCopies::WorstCase> active_;  ///< scenarios that hold x, of the last exchange
  std::vector<bool> reads_y_;
  bool names_infeasible_ = true;
  bool restarts_ = false;         ///< searches that fail begin anew
  std::vector<double> verified_;  ///< where the answer was checked over all of y; empty: was not
  Index scans_ = 0;               ///< made
  std::vector<RobustWorstCase> highest_;  ///< of each constraint, as the last scan saw it
  double violation_;                      ///< largest of the last scan; NaN: none was made
  Result answer_;
  Result work_;  ///< of all solves and maximizations
};

}  // namespace ipminmax
