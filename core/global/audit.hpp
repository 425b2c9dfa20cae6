#pragma once

#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "core/global/points.hpp"
#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// The y that any part of a solve has met. Each may refute an answer. Threads may add at once.
class Witnesses {
 public:
  Witnesses() = default;  ///< of none
  explicit Witnesses(const ProblemStructure& structure);
  /// v: n values or more, of which Max's are kept, if there is memory for them.
  void add(std::span<const double> v) { add(v, met_); }
  /// The y of a result and of its worst cases.
  void add(const Result& result) {
    add(result.v);
    add(result.worst_case.v);
    for (const RobustWorstCase& worst : result.worst_cases) add(worst.v);
  }
  /// All of another list, of the same model.
  void add(const Witnesses& others);
  /// Where a maximization began: it shows the range of a function, and refutes nothing.
  void add_start(std::span<const double> v) { add(v, starts_); }
  /// Of each the values of Max's variables, in their order.
  [[nodiscard]] Points all() const { return copy_of(met_); }
  [[nodiscard]] Points starts() const { return copy_of(starts_); }

 private:
  std::vector<std::size_t> max_variables_;
  std::size_t most_ = 0;  ///< that are kept, the last ones
  struct List {
    Points kept{};
    std::size_t next = 0;
  };
  void add(std::span<const double> v, List& list);
  void keep(std::vector<double> y, List& list);
  [[nodiscard]] Points copy_of(const List& list) const {
    const std::lock_guard lock(mutex_);
    return list.kept;
  }

  mutable std::mutex mutex_;
  List met_, starts_;
};

/// "name = value, ..." of what a constraint's worst case chooses. v: n.
[[nodiscard]] std::string describe_y(const ProblemStructure& s, Index constraint,
                                     const std::vector<double>& v);

/// How far the difference of f between two y at the same x may come from the error of x: its change
/// as each Min variable moves by tol of its size. v, other: n values each.
[[nodiscard]] double change_with_x(Problem& model, const std::vector<double>& v,
                                   const std::vector<double>& other, double tol);

/// The last word on an answer: the only place that takes back a success or a certificate, and it
/// grants none. It evaluates the model as the user gave it, at the answer's x with each y of the
/// witnesses that Max's constraints allow there, and compares in the range of what is compared.
///
/// Taken back is what was cut short (as the budget knows), what was asked for and not
/// finished, a value that another y exceeds (where other y were asked for), a robust constraint
/// that a y violates, a K_yy that clearly has a wrong sign, and numbers that are not finite. A y
/// that refutes the answer is kept: of f in result.worst_case, of a robust constraint as the last
/// of result.worst_cases.
/// counts: evaluations are added. Without memory the budget is stopped.
void audit(Problem& model, const SolverOptions& options, const Witnesses& witnesses, Budget& budget,
           Result& result, Counts& counts);

}  // namespace ipminmax
