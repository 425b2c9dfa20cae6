#pragma once

#include <cmath>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/model/compare.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Points of a model, or of one player in it: as many values each.
using Points = std::vector<std::vector<double>>;

/// Throws std::invalid_argument if v, which the message calls `what`, has not n values.
inline void require_size(const std::string& what, const ProblemStructure& s,
                         std::span<const double> v) {
  const std::size_t n = s.variable_players.size();
  if (v.size() != n) {
    throw std::invalid_argument(what + " has " + std::to_string(v.size()) + " values for " +
                                std::to_string(n) + " variables");
  }
}

/// The same if they are not finite.
inline void require_point(const std::string& what, const ProblemStructure& s,
                          std::span<const double> v) {
  require_size(what, s, v);
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i]))
      throw std::invalid_argument(what + " is not finite in variable " + std::to_string(i));
  }
}

/// Max's variables of n values, in their order.
[[nodiscard]] std::vector<double> max_part(const ProblemStructure& structure,
                                           const std::vector<double>& v);

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

/// The ranges of variables that moved from the model's start to v, which may have gone to zero.
[[nodiscard]] VariableRanges moves_from_start(Problem& model, const std::vector<double>& v);

/// How far the difference of f between two y at the same x may come from the error of x: its change
/// as each Min variable moves by tol of its size. v, other: n values each.
[[nodiscard]] double change_with_x(Problem& model, const std::vector<double>& v,
                                   const std::vector<double>& other, double tol);

}  // namespace ipminmax
