#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/formulas/interval.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// The formulas of an .nl file: variables, then defined variables, then functions of both.
struct NlFormulas {
  /// One of a tree in prefix order: an operation with its number of operands, a variable, a number.
  struct Node {
    static constexpr int kNumber = -1, kVariable = -2, kFunction = -3;
    int operation = kNumber;
    int operands = 0;  ///< of an operation, or the variable
    double number = 0.0;
  };
  struct Formula {
    std::size_t begin = 0, end = 0;  ///< nodes
    std::vector<std::pair<int, double>> linear{};
  };
  std::vector<Node> nodes;
  std::vector<Formula> constraints, objectives;
  std::vector<std::pair<int, Formula>> defined;  ///< with their variables, each before it is read
};

/// The functions of an .nl file over boxes.
class NlBoxes final : public BoxFunctions {
 public:
  /// objective: -1 for none, f is 0 then. sign: of f.
  NlBoxes(NlFormulas formulas, int variables, int objective, double sign)
      : formulas_(std::move(formulas)),
        variables_(at(variables)),
        objective_(objective),
        sign_(sign) {}

  /// All throw std::domain_error where an operation cannot be enclosed.
  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    return all_over(v, {});
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    static_cast<void>(all_over(v, g));
  }
  [[nodiscard]] IntervalJet all_over(std::span<const IntervalJet> v,
                                     std::span<IntervalJet> g) const override;
  [[nodiscard]] bool is_concurrent() const override { return true; }

 private:
  using Jets = std::vector<IntervalJet>;
  [[nodiscard]] IntervalJet value(const NlFormulas::Formula& formula, const Jets& v) const;

  NlFormulas formulas_;
  std::size_t variables_;
  int objective_;
  double sign_;
};

}  // namespace ipminmax
