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

  /// Whether a reason other than a weakly active bound was added. Points with weakly active bounds
  /// may be certified.
  [[nodiscard]] bool has_obstacle() const {
    return std::ranges::any_of(reasons_,
                               [](const auto& r) { return r.kind != Kind::WeaklyActive; });
  }
  void add(CertificateReason reason);
  void add(Kind kind, std::string text, Player player = Player::Min) {
    add({kind, player, std::move(text)});
  }
  /// Adds before + name + after, with the name of a canonical variable or of a slack's inequality.
  void add_about(Kind kind, Index i, const std::string& before, const std::string& after = {});
  void add_about_row(Kind kind, Index constraint, const std::string& before,
                     const std::string& after = {});
  /// One for each weakly active bound or inequality.
  void add_weakly_active(const ActiveBounds& set);
  void add_dependences(const Dependences& dependences);
  /// Names the bound near the point whose relaxation is largest relative to the size of its
  /// variable, if that is much. bound_relax_factor depends on the units of the model.
  void add_relaxed(const Iterate& iterate, const VariableScaling& scaling,
                   const SolverOptions& options);
  /// Adds before and the names of the largest entries of a step of canonical variables.
  void add_direction(Kind kind, Player player, const Vector& step, const char* before);

  [[nodiscard]] std::vector<CertificateReason> take() { return std::move(reasons_); }

 private:
  [[nodiscard]] std::string name_of_row(Index constraint) const;

  const CanonicalProblem& canonical_;
  std::vector<CertificateReason> reasons_;
};

}  // namespace ipminmax
