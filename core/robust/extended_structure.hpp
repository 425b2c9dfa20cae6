#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/formulas/interval.hpp"
#include "core/model/indices.hpp"
#include "core/problem.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// How messages call what is added to a model.
struct Label {
  Index number = -1;  ///< index in the model, -1: none
  std::string name;
};

/// What the model calls an original, with the number of its copy.
inline Label label_of_copy(const std::vector<std::string>& names, const std::vector<Index>& numbers,
                           Index i, std::size_t copy) {
  const bool named = at(i) < names.size() && !names[at(i)].empty();
  return {.number = at(i) < numbers.size() ? numbers[at(i)] : i,
          .name = (named ? names[at(i)] + " in " : "") + "worst case " + std::to_string(copy)};
}

/// Adds the label of the element with index size.
inline void add_label(std::vector<std::string>& names, std::vector<Index>& numbers,
                      std::size_t size, Label label) {
  names.resize(size);
  names.push_back(std::move(label.name));
  if (numbers.empty()) numbers = numbers_below(size);
  numbers.push_back(label.number);
}

/// Adds a variable to the structure of a model that is extended. Returns its index.
inline Index add_variable(ProblemStructure& s, Player player, double lower, double upper,
                          Label label) {
  add_label(s.variable_names, s.variable_numbers, s.variable_players.size(), std::move(label));
  s.variable_players.push_back(player);
  s.variable_lower.push_back(lower);
  s.variable_upper.push_back(upper);
  return static_cast<Index>(s.variable_players.size()) - 1;
}

/// The same with a constraint, still without entries.
inline Index add_constraint(ProblemStructure& s, Player player, double lower, double upper,
                            Label label) {
  add_label(s.constraint_names, s.constraint_numbers, s.constraint_players.size(),
            std::move(label));
  s.constraint_players.push_back(player);
  s.constraint_lower.push_back(lower);
  s.constraint_upper.push_back(upper);
  return static_cast<Index>(s.constraint_players.size()) - 1;
}

inline void fix_variable(ProblemStructure& s, Index i, double value) {
  s.variable_lower[at(i)] = s.variable_upper[at(i)] = value;
}

inline void drop_constraint(ProblemStructure& s, Index j) {
  s.constraint_lower[at(j)] = -kInfinity;
  s.constraint_upper[at(j)] = kInfinity;
}

/// Functions over boxes of a model in another form, which derives from it: what follows from
/// disturbances stays. They are called only if the model's are known.
class BoxesOf : public BoxFunctions {
 public:
  /// functions: the model's; null: they are not known.
  explicit BoxesOf(const BoxFunctions* functions) : model_boxes(functions) {}
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    model_boxes->constraints_over(v, g);
  }
  bool is_concurrent() const override { return model_boxes->is_concurrent(); }
  Determined determined() const override { return model_boxes->determined(); }
  void determine(std::span<double> v) const override { model_boxes->determine(v); }

 protected:
  [[nodiscard]] const BoxFunctions* if_known() const {
    return model_boxes != nullptr ? this : nullptr;
  }

  const BoxFunctions* model_boxes;
};

}  // namespace ipminmax
