#pragma once

#include <optional>

#include "core/options.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Whether the iterates meet the tolerances of the first-order conditions, or the acceptable ones
/// for long enough. As Ipopt's.
class FirstOrderTest {
 public:
  explicit FirstOrderTest(const SolverOptions& options) : options_(options) {}

  [[nodiscard]] bool is_met(const KktError& error) const;
  [[nodiscard]] bool is_acceptable(const KktError& error) const;

  /// At each iterate: Solved, SolvedToAcceptableLevel, or nothing yet.
  [[nodiscard]] std::optional<Status> claim(const KktError& error, double objective);
  /// The iterates have moved elsewhere: acceptable ones are counted anew.
  void begin_anew() { acceptable_ = 0; }

 private:
  const SolverOptions& options_;
  Index acceptable_ = 0;  ///< iterates in a row
  double last_objective_ = 0.0;
};

}  // namespace ipminmax
