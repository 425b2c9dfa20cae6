#pragma once

#include <optional>
#include <vector>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/units.hpp"
#include "core/kkt/system.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// What an ActiveSetSystem works with, kept from one to the next.
struct ActiveSetArrays {
  Evaluation scaled, reduced;
  std::vector<char> fixed;     ///< as bool, read often
  std::vector<bool> left_out;  ///< rows, or empty
  Eigen::VectorXd curvature;
  NewtonResidual rhs;  ///< of whoever solves with the system
  Step step;
};

/// The KKT system of the active set, in units: fixed variables (at active bounds) and the rows of
/// inactive inequalities are taken out, active inequalities are equalities. Uses the matrices of a
/// KktSystem, with rows that are taken out replaced by those of the identity, signs as expected.
class ActiveSetSystem {
 public:
  /// Whether doubtful bounds are fixed, per player.
  struct Doubtful {
    bool min_fixed = false, max_fixed = false;
    friend bool operator==(const Doubtful&, const Doubtful&) = default;
  };
  /// So that the verdict of the sufficient conditions holds whatever the doubtful bounds are: those
  /// of Min as inactive, for more directions are open to him; those of Max as active in K, for
  /// phi(x) is at least what he gets with them.
  static constexpr Doubtful kSufficient{.min_fixed = false, .max_fixed = true};

  /// The point's derivatives are copied. arrays: of no other system that is in use; null: its own.
  ActiveSetSystem(const CanonicalProblem& canonical, KktSystem& kkt, const BoundClasses& classes,
                  const Units& units, const Evaluation& evaluation,
                  ActiveSetArrays* arrays = nullptr);
  ActiveSetSystem(const ActiveSetSystem&) = delete;
  ActiveSetSystem& operator=(const ActiveSetSystem&) = delete;

  /// Assembles K and K_yy with min_times, max_times the error (per variable, in units; may be
  /// empty) added to the curvature of the players' variables: to W for Min, taken from W for Max.
  void assemble(Doubtful fixed, const Eigen::VectorXd& error = {}, double min_times = 0.0,
                double max_times = 0.0);

  [[nodiscard]] const CanonicalProblem& canonical() const { return canonical_; }
  [[nodiscard]] KktSystem& kkt() { return kkt_; }
  [[nodiscard]] const BoundClasses& classes() const { return classes_; }
  [[nodiscard]] const Units& units() const { return units_; }
  /// The matrices' derivatives of the last assemble.
  [[nodiscard]] const Evaluation& assembled() const { return arrays_.reduced; }
  /// Rows that are left out, or empty.
  [[nodiscard]] const std::vector<bool>& left_out() const { return arrays_.left_out; }
  /// Derivatives in units, nothing taken out.
  [[nodiscard]] const Evaluation& derivatives() const { return arrays_.scaled; }
  /// A right-hand side and solution for the next solve with the system, of any values.
  [[nodiscard]] NewtonResidual& rhs() { return arrays_.rhs; }
  [[nodiscard]] Step& step() { return arrays_.step; }

  /// With the doubtful bounds as in the last assemble.
  [[nodiscard]] bool is_fixed(Index variable) const {
    return arrays_.fixed[static_cast<std::size_t>(variable)] != 0;
  }
  [[nodiscard]] bool is_slack(Index variable) const {
    return canonical_.x_slacks().contains(variable) || canonical_.y_slacks().contains(variable);
  }
  /// Neither fixed nor a slack.
  [[nodiscard]] bool is_free(Index variable) const {
    return !is_fixed(variable) && !is_slack(variable);
  }
  /// Whether a constraint is an equality or an inequality counted as active, and not left out.
  [[nodiscard]] bool counts(Index constraint) const {
    if (classes_.is_left_out(constraint)) return false;
    const Index slack = canonical_.slack_of(constraint);
    return slack < 0 || is_fixed(slack);
  }

 private:
  const CanonicalProblem& canonical_;
  KktSystem& kkt_;
  const BoundClasses& classes_;
  const Units& units_;
  std::optional<ActiveSetArrays> own_;
  ActiveSetArrays& arrays_;
};

}  // namespace ipminmax
