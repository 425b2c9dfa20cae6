#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/dependence.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Collects a certificate's reasons, in the model's names.
class Reasons {
 public:
  explicit Reasons(const CanonicalProblem& canonical) : canonical_(canonical) {}

  using Kind = CertificateReason::Kind;

  void add(Kind kind, Player player, std::string text);
  /// One for each doubtful bound or inequality.
  void add_weakly_active(const BoundClasses& classes);
  void add_dependences(const Dependences& dependences);
  /// A step of canonical variables; before and after the names of its largest entries.
  void add_direction(Kind kind, Player player, const Eigen::VectorXd& step, const char* before);

  [[nodiscard]] std::vector<CertificateReason> take() { return std::move(reasons_); }

 private:
  void add(CertificateReason reason);
  [[nodiscard]] std::string name_of_row(Index constraint) const;

  const CanonicalProblem& canonical_;
  std::vector<CertificateReason> reasons_;
};

}  // namespace ipminmax
