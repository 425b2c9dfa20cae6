#pragma once

#include <cstdint>
#include <limits>
#include <ostream>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <support/autodiff_problem.hpp>

#include "core/problem.hpp"
#include "core/result.hpp"

/// First- and second-order conditions of a local minmax by dense linear algebra: multipliers, null
/// spaces and eigenvalues. Shares no code with the library, for judging answers.
/// hostile/judge_certificate.hpp looks for what refutes a certificate.
namespace ipminmax::testing {

using Extended = long double;
using ExtendedVector = Eigen::Matrix<Extended, Eigen::Dynamic, 1>;
using ExtendedMatrix = Eigen::Matrix<Extended, Eigen::Dynamic, Eigen::Dynamic>;

/// Dense values of a problem at a point. ok is false where the problem is undefined.
struct DenseEvaluation {
  bool ok = false;
  double objective = 0.0;
  Eigen::VectorXd gradient, constraints;
  Eigen::MatrixXd jacobian;

  DenseEvaluation(Problem& problem, const Eigen::VectorXd& v);
};

/// Hessian of sigma f + lambda' g, both triangles.
[[nodiscard]] Eigen::MatrixXd dense_hessian(Problem& problem, const Eigen::VectorXd& v,
                                            double sigma, const Eigen::VectorXd& lambda);

/// f and g with first derivatives, and the Hessian of f + lambda' g. False where undefined.
class ExtendedFunctions {
 public:
  virtual ~ExtendedFunctions() = default;
  [[nodiscard]] virtual const ProblemStructure& structure() const = 0;
  [[nodiscard]] virtual bool first(const ExtendedVector& v, ExtendedVector& gradient,
                                   ExtendedVector& g, ExtendedMatrix& jacobian) = 0;
  [[nodiscard]] virtual bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                                    ExtendedMatrix& hessian) = 0;
};

/// The formulas of a Model, swept in extended precision.
class ExtendedModel final : public ExtendedFunctions {
 public:
  explicit ExtendedModel(const Model& model);
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                           ExtendedMatrix& jacobian) override;
  [[nodiscard]] bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                            ExtendedMatrix& hessian) override;

 private:
  [[nodiscard]] ExtendedVector gradient_of(const Expression& e);

  Model model_;
  ProblemStructure structure_;
  std::vector<std::size_t> positions_;  ///< of the variables on the tape
  TapeSweeps<Extended> sweeps_;
};

/// Functions known in double precision only.
class ExtendedProblem final : public ExtendedFunctions {
 public:
  explicit ExtendedProblem(Problem& problem) : problem_(problem) {}
  [[nodiscard]] const ProblemStructure& structure() const override { return problem_.structure(); }
  [[nodiscard]] bool first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                           ExtendedMatrix& jacobian) override;
  [[nodiscard]] bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                            ExtendedMatrix& hessian) override;

 private:
  Problem& problem_;
};

enum class Verdict : std::uint8_t {
  NotFirstOrder,   ///< infeasible, not stationary, or a multiplier of the wrong sign
  LocalMinmax,     ///< the sufficient conditions hold
  Undecided,       ///< singular curvature, or dependent or weakly active constraints decide
  NotLocalMinmax,  ///< curvature of a definite wrong sign
};
[[nodiscard]] std::string_view verdict_name(Verdict verdict);
inline std::ostream& operator<<(std::ostream& out, Verdict v) { return out << verdict_name(v); }

struct DenseOptimality {
  Verdict verdict = Verdict::NotFirstOrder;
  double infeasibility = std::numeric_limits<double>::infinity();
  double stationarity = std::numeric_limits<double>::infinity();  ///< largest entry, both players
  double wrong_sign = 0.0;       ///< largest multiplier of the wrong sign
  double inner_curvature = 0.0;  ///< smallest over y of -f on tangents; want > 0
  double outer_curvature = 0.0;  ///< smallest over x of the inner maximum; want > 0
  int weakly_active = 0;
  bool independent = true;  ///< active gradients of each player
  double moved = 0.0;       ///< longest entry of the way from the returned point

  friend std::ostream& operator<<(std::ostream& out, const DenseOptimality& d) {
    return out << d.verdict << " infeasibility " << d.infeasibility << " stationarity "
               << d.stationarity << " wrong sign " << d.wrong_sign << " curvature over y "
               << d.inner_curvature << " over x " << d.outer_curvature << " weakly active "
               << d.weakly_active << " independent " << d.independent << " moved " << d.moved;
  }
};

/// Multipliers with the signs of Result.
struct Multipliers {
  Eigen::VectorXd lambda, z_lower, z_upper;
};

struct DenseTolerances {
  double first_order = 1e-6;  ///< relative to 1 + the largest entry of the objective's gradient
  double active = 1e-6;       ///< distance below which a bound is active
  double inactive = 1e-3;     ///< distance above which it is inactive; in between weakly active
  double multiplier = 1e-5;   ///< below which an active bound is weakly active
  double curvature = 1e-6;    ///< relative to 1 + the largest entry of the Hessian
};

/// At v, with given multipliers, or with the least-squares multipliers of the active constraints.
/// Weakly active constraints leave it undecided unless the sign is wrong on their faces, too.
[[nodiscard]] DenseOptimality dense_optimality(Problem& problem, std::span<const double> v,
                                               const Multipliers* given = nullptr,
                                               const DenseTolerances& tolerances = {});

/// At the solution of the active set's equations near the returned point, by Newton's method.
/// Weakly active constraints are one-sided.
[[nodiscard]] DenseOptimality optimality_near(ExtendedFunctions& functions, const Result& result);

}  // namespace ipminmax::testing
