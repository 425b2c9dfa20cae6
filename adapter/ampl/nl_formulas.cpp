#include "nl_formulas.hpp"
#include "core/model/indices.hpp"

#include <stdexcept>
#include <string>

namespace ipminmax {
namespace {

[[noreturn]] void refuse(int operation) {
  throw std::domain_error("operation o" + std::to_string(operation) +
                          " of the file cannot be enclosed");
}

/// max(a, b); by its formula it has no second derivatives where the order is open.
IntervalJet larger(const IntervalJet& a, const IntervalJet& b) {
  return IntervalJet(0.5) * (a + b + abs(a - b));
}

/// Numbers of operations: D. M. Gay, "Writing .nl files".
IntervalJet unary(int operation, const IntervalJet& a) {
  const IntervalJet one(1.0);
  switch (operation) {
    case 15:
      return abs(a);
    case 16:
      return -a;
    case 37:
      return tanh(a);
    case 38:
      return tan(a);
    case 39:
      return sqrt(a);
    case 40:
      return sinh(a);
    case 41:
      return sin(a);
    case 42:
      return log(a) / log(IntervalJet(10.0));
    case 43:
      return log(a);
    case 44:
      return exp(a);
    case 45:
      return cosh(a);
    case 46:
      return cos(a);
    case 47:
      return IntervalJet(0.5) * (log(one + a) - log(one - a));
    case 49:
      return atan(a);
    case 50:
      return log(a + sqrt(square(a) + one));
    case 51:
      return asin(a);
    case 52:
      return log(a + sqrt(square(a) - one));
    case 53:
      return acos(a);
    default:
      refuse(operation);
  }
}

IntervalJet binary(int operation, const IntervalJet& a, const IntervalJet& b) {
  switch (operation) {
    case 0:
      return a + b;
    case 1:
      return a - b;
    case 2:
      return a * b;
    case 3:
      return a / b;
    case 5:
      return pow(a, b);
    case 6:
      return larger(a - b, IntervalJet(0.0));
    case 48:
      return atan2(a, b);
    default:
      refuse(operation);
  }
}

constexpr int kLeast = 11, kLargest = 12, kSum = 54;
bool is_list(int operation) {
  return operation == kLeast || operation == kLargest || operation == kSum;
}

/// operands: the first one last.
IntervalJet list(int operation, std::span<const IntervalJet> operands) {
  IntervalJet result = operands.back();
  for (std::size_t k = operands.size() - 1; k-- > 0;) {
    if (operation == kSum) {
      result += operands[k];
    } else if (operation == kLargest) {
      result = larger(result, operands[k]);
    } else {
      result = -larger(-result, -operands[k]);
    }
  }
  return result;
}

}  // namespace

/// From the last node to the first, operands before operations.
IntervalJet NlBoxes::value(const NlFormulas::Formula& formula, const Jets& v) const {
  using Node = NlFormulas::Node;
  Jets stack;
  for (std::size_t k = formula.end; k-- > formula.begin;) {
    const Node& node = formulas_.nodes[k];
    if (node.operation == Node::kNumber) {
      stack.emplace_back(node.number);
    } else if (node.operation == Node::kVariable) {
      stack.push_back(v[at(node.operands)]);
    } else if (node.operation == Node::kFunction) {
      throw std::domain_error("an imported function of the file cannot be enclosed");
    } else {
      const auto count = at(node.operands);
      const std::span operands = std::span(stack).last(count);
      const IntervalJet result = is_list(node.operation) ? list(node.operation, operands)
                                 : count == 1            ? unary(node.operation, operands[0])
                                              : binary(node.operation, operands[1], operands[0]);
      stack.resize(stack.size() - count);
      stack.push_back(result);
    }
  }
  IntervalJet sum = stack.back();
  for (const auto& [variable, factor] : formula.linear) {
    sum += IntervalJet(factor) * v[at(variable)];
  }
  return sum;
}

IntervalJet NlBoxes::all_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const {
  Jets all(v.begin(), v.end());
  all.resize(variables_ + formulas_.defined.size());
  for (const auto& [variable, formula] : formulas_.defined) {
    all[at(variable)] = value(formula, all);
  }
  for (const auto j : indices(g)) g[j] = value(formulas_.constraints[j], all);
  if (objective_ < 0) return {0.0};
  return IntervalJet(sign_) * value(formulas_.objectives[at(objective_)], all);
}

}  // namespace ipminmax
