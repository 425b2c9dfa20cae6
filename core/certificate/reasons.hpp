#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/certificate/dependence.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Collects a certificate's reasons, in the model's names.
class Reasons {
 public:
  explicit Reasons(const CanonicalProblem& canonical) : canonical_(canonical) {}

  using Kind = CertificateReason::Kind;

  /// A weakly active bound alone is none: the test passes with many.
  [[nodiscard]] bool has_obstacle() const {
    return std::ranges::any_of(reasons_,
                               [](const auto& r) { return r.kind != Kind::WeaklyActive; });
  }
  void add(CertificateReason reason);
  void add(Kind kind, Player player, std::string text) {
    add({.kind = kind,
         .player = player,
         .text = std::move(text),
         .variables = {},
         .constraints = {}});
  }
  /// With the name of a canonical variable, or of a slack's inequality, in the middle.
  void add_about(Kind kind, Index i, const std::string& before, const std::string& after = {});
  void add_about_row(Kind kind, Index constraint, const std::string& before,
                     const std::string& after = {});
  /// One for each weakly active bound or inequality.
  void add_weakly_active(const ActiveBounds& set);
  void add_dependences(const Dependences& dependences);
  /// The bound near the point that was relaxed by most beside what it bounds, if that is much:
  /// bound_relax_factor means the same in no other units.
  void add_relaxed(const Iterate& iterate, const VariableScaling& scaling,
                   const SolverOptions& options);
  /// A step of canonical variables; before the names of its largest entries.
  void add_direction(Kind kind, Player player, const Vector& step, const char* before);

  [[nodiscard]] std::vector<CertificateReason> take() { return std::move(reasons_); }

 private:
  [[nodiscard]] std::string name_of_row(Index constraint) const;

  const CanonicalProblem& canonical_;
  std::vector<CertificateReason> reasons_;
};

}  // namespace ipminmax
