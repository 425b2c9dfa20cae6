#pragma once

#include <limits>
#include <optional>
#include <string>

#include "core/method/step_method.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Evaluates and measures a starting point, of which v without slacks is given and for a warm start
/// the multipliers: slacks, multipliers, functions and derivatives. A status: why that is
/// impossible; CanonicalProblem::evaluation_error says more.
[[nodiscard]] bool evaluate_start(const MethodContext& context, const SolverOptions& options,
                                  Point& point);

/// Where and how a search begins.
struct Start {
  enum class Rule : std::uint8_t { Chosen, AlgorithmOne };

  Point point;
  StepKind how = StepKind::None;
  Rule rule = Rule::Chosen;
  /// An iteration, at which no local minmax was found.
  Index ends_before = std::numeric_limits<Index>::max();
};

/// The starting points of a solve after the model's own: random ones, every other one in a box for
/// Algorithm 1.
class OtherStarts : MethodContext {
 public:
  explicit OtherStarts(const MethodContext& context) : MethodContext(context) {}

  /// The next one at which the model is defined. Shifts of earlier searches and raised accuracy of
  /// factorizations are forgotten. Empty: there is none.
  [[nodiscard]] std::optional<Start> next();
  /// Random points drawn.
  [[nodiscard]] Index drawn() const { return drawn_; }
  /// "failed from 3 other starting points, too (why no more)": Pyomo takes a line of the log that
  /// begins with a number for an iteration.
  [[nodiscard]] std::string describe() const;

 private:
  Index drawn_ = 0;
  Index first_iteration_ = 0;  ///< at the end of the search from the model's point
  Index most_iterations_ = 0;  ///< after it, until when searches begin
};

}  // namespace ipminmax
