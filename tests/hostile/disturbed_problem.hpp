#pragma once

#include <cstdint>
#include <new>
#include <span>
#include <stdexcept>
#include <vector>

#include <support/dice.hpp>

#include "core/model/forwarding_problem.hpp"

namespace ipminmax::testing {

/// What is wrong, or only odd, with the structure of a model.
enum class Disturbance : std::uint8_t {
  // Odd but allowed.
  None,
  Repeated,  ///< every entry in two parts, in any order, half of the Hessian's above the diagonal
  EmptyRow,  ///< a constraint without entries in the Jacobian, and so without influence
  // Wrong: refused before a function is called.
  RowOutside,
  ColumnOutside,
  NegativeIndex,
  HessianOutside,
  BoundNaN,
  ConstraintBoundNaN,
  CrossedBounds,
  LowerInfinite,
  UpperInfinite,
};
inline constexpr int kDisturbances = 12;
[[nodiscard]] constexpr bool is_wrong(Disturbance d) { return d > Disturbance::EmptyRow; }

/// What a function does instead of its work.
enum class Fault : std::uint8_t {
  Fails,
  NaN,
  Infinity,
  Throws,
  ThrowsNumber,
  ThrowsBadAlloc,
  Stops
};
inline constexpr int kFaults = 7;

/// A model with a disturbed structure whose n-th call commits a fault.
class DisturbedProblem final : public ForwardingProblem {
 public:
  /// Entries to disturb are drawn from seed. Where there is nothing to disturb so, was_disturbed is
  /// false.
  DisturbedProblem(Problem& problem, Disturbance disturbance, std::uint64_t seed);

  /// at: number of the call, from 1; 0: never. lasting: all later ones, too.
  void commit(Fault fault, int at, bool lasting) {
    fault_ = fault;
    at_ = at;
    lasting_ = lasting;
    calls_ = 0;
  }
  [[nodiscard]] bool was_disturbed() const { return disturbed_; }
  [[nodiscard]] int calls() const { return calls_; }
  /// Calls with a variable or multiplier that was NaN or infinite.
  [[nodiscard]] int calls_not_finite() const { return calls_not_finite_; }
  /// To be called in every iteration: false stops.
  [[nodiscard]] bool goes_on() const { return !stopped_; }
  void go_on() { stopped_ = false; }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override;

 private:
  struct Part {
    std::size_t source;
    double weight;
  };
  void repeat_entries(Dice& dice);
  [[nodiscard]] bool empty_row(Dice& dice);
  [[nodiscard]] bool spoil(Disturbance disturbance, Dice& dice);
  [[nodiscard]] bool is_asked_rightly(std::span<const double> numbers);
  [[nodiscard]] bool is_due();
  [[nodiscard]] bool finish(bool good, std::span<double> values);

  ProblemStructure structure_;
  std::vector<Part> jacobian_parts_, hessian_parts_;
  std::vector<double> values_;
  std::vector<double> lambda_;
  Index constant_row_ = -1;  ///< always at constant_
  double constant_ = 0.0;
  bool disturbed_ = false;
  Fault fault_ = Fault::Fails;
  int at_ = 0, calls_ = 0, calls_not_finite_ = 0;
  bool lasting_ = false, stopped_ = false;
};

}  // namespace ipminmax::testing
