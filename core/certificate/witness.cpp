#include "core/certificate/witness.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/walk.hpp"

namespace ipminmax {
namespace {

constexpr double kGrowth = 16.0;  // of the shift
constexpr int kMostShifts = 12;
constexpr double kConstraintShift = 1e-10;  // for dependent constraints
constexpr int kMostSolves = 20;             // of inverse iteration
constexpr double kSettled = 1e-2;           // relative change of the curvature that ends it
constexpr double kClearlyWrong = 2.0;       // curvature over error and margin
constexpr double kFirstLength = 0.1;        // of a trial, over the size of the point in units
constexpr double kBeyond = 10.0;            // length over the distance to the solution
constexpr int kTrials = 12;
constexpr double kShorter = 0.25;
constexpr double kAmplified = 1e-3;   // by inverse iteration, over what the shift alone would do
constexpr double kTangent = 1e-6;     // sum of a row's terms over their sizes
constexpr double kNothing = 1e-9;     // row of length one times a direction of length one
constexpr double kMoved = 0.5;        // of the length: corrections must not lead back
constexpr double kShareOfGain = 0.1;  // of the gain predicted that has to come
constexpr double kViolationsShare = 0.5;  // of the gain, at most
constexpr double kRounding = 1e-14;       // of the value

class WitnessSearch {
 public:
  WitnessSearch(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                bool inner)
      : canonical_(canonical),
        system_(system),
        point_(point),
        inner_(inner),
        begin_(inner ? canonical.y().begin : 0),
        owned_end_(inner ? canonical.variables() : canonical.y().begin),
        walk_(canonical, system, point, inner ? Walk::Kind::Inner : Walk::Kind::Outer) {}

  std::optional<WrongCurvature> run(double margin, double distance);
  /// Along a direction in units that may be closed the other way; the matrix is factorized.
  std::optional<WrongCurvature> run_along(const Eigen::VectorXd& direction, double distance);

 private:
  [[nodiscard]] bool right_with(double shift);
  [[nodiscard]] bool find_direction();
  [[nodiscard]] bool turn_to_least_curvature(double shift);
  [[nodiscard]] double curvature(const Eigen::VectorXd& d) const;
  [[nodiscard]] double curvature_of_all(const Eigen::VectorXd& d) const;
  [[nodiscard]] bool is_tangent() const;
  [[nodiscard]] bool gains(double length);
  [[nodiscard]] bool gains_beyond_slope(double length);
  [[nodiscard]] std::optional<WrongCurvature> try_steps(double distance, bool one_way);
  [[nodiscard]] bool solve(const NewtonResidual& rhs, Step& step) {
    return inner_ ? system_.kkt().solve_inner(system_.assembled(), rhs, step)
                  : system_.kkt().solve(system_.assembled(), rhs, step);
  }
  /// Min's own variables, or Max's: those whose curvature is asked for.
  [[nodiscard]] bool is_owned(Index i) const {
    return i >= begin_ && i < owned_end_ && !system_.is_slack(i) && !system_.is_fixed(i);
  }

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const Point& point_;
  const bool inner_;
  const Index begin_, owned_end_;
  Walk walk_;
  Eigen::VectorXd units_direction_;  ///< in units, owned part of length 1
  Eigen::VectorXd step_;             ///< the same in the canonical problem's lengths
  double curvature_ = 0.0;           ///< along it; of the sign that is wrong: > 0
};

bool WitnessSearch::right_with(double shift) {
  KktSystem& kkt = system_.kkt();
  const Regularization shifted{.x = inner_ ? 0.0 : shift,
                               .y = inner_ ? shift : 0.0,
                               .lambda_x = kConstraintShift,
                               .lambda_y = kConstraintShift};
  return inner_ ? kkt.has_expected_inner_inertia(kkt.factorize_inner(shifted))
                : kkt.has_expected_inertia(kkt.factorize(shifted));
}

/// d'Wd, negative for Max.
double WitnessSearch::curvature(const Eigen::VectorXd& d) const {
  double sum = 0.0;
  const Evaluation& w = system_.assembled();
  for (std::size_t k = 0; k < w.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    sum += (i == j ? 1.0 : 2.0) * w.hessian[k] * d[i] * d[j];
  }
  return inner_ ? sum : -sum;
}

/// The same with what fixed variables move along.
double WitnessSearch::curvature_of_all(const Eigen::VectorXd& d) const {
  double sum = 0.0;
  const Evaluation& w = system_.derivatives();
  for (std::size_t k = 0; k < w.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    sum += (i == j ? 1.0 : 2.0) * w.hessian[k] * d[i] * d[j];
  }
  return inner_ ? sum : -sum;
}

/// Inverse iteration with a shift that makes the matrix right, a smaller one where that finds
/// nothing: turns to the direction of the worst curvature on the tangent space.
bool WitnessSearch::find_direction() {
  for (const double first : {1e-2, 1e-4, 1e-6}) {
    double shift = first;
    for (int k = 0; !right_with(shift); ++k, shift *= kGrowth) {
      if (k == kMostShifts) return false;
    }
    if (turn_to_least_curvature(shift)) return true;
    if (shift > first) return false;
  }
  return false;
}

bool WitnessSearch::turn_to_least_curvature(double shift) {
  NewtonResidual rhs = zero_step(canonical_);
  Step step = zero_step(canonical_);
  for (Index i = begin_; i < owned_end_; ++i) {
    if (is_owned(i)) rhs.v[i] = std::sin(1.0 + i);
  }
  double last = 0.0;
  for (int k = 0; k < kMostSolves; ++k) {
    if (!solve(rhs, step)) return false;
    double norm = 0.0;
    for (Index i = begin_; i < owned_end_; ++i) {
      if (is_owned(i)) norm += step.v[i] * step.v[i];
    }
    norm = std::sqrt(norm);
    if (!(norm > 0.0 && std::isfinite(norm))) return false;
    units_direction_ = step.v / norm;
    for (Index i = 0; i < units_direction_.size(); ++i) {
      if (system_.is_slack(i) || system_.is_fixed(i)) units_direction_[i] = 0.0;
      rhs.v[i] = is_owned(i) ? units_direction_[i] : 0.0;
    }
    // Without a tangent direction what comes out is rounding.
    if (k > 0 && norm < kAmplified / shift) return false;
    curvature_ = curvature(units_direction_);
    if (k > 1 && curvature_ > 0.0 && std::abs(curvature_ - last) <= kSettled * curvature_) break;
    last = curvature_;
  }
  return curvature_ > 0.0;
}

/// Where gradients are nearly dependent in units, the relaxed constraints let directions pass that
/// cross them: each row has to cancel within itself.
bool WitnessSearch::is_tangent() const {
  const Evaluation& all = system_.derivatives();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(canonical_.constraints()), size = sum;
  for (std::size_t k = 0; k < all.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    const double term = all.jacobian[k] * units_direction_[col];
    sum[row] += term;
    size[row] += std::abs(term);
  }
  for (Index j = inner_ ? canonical_.max_constraints().begin : 0; j < sum.size(); ++j) {
    const double allowed = std::max(kTangent * size[j], kNothing * units_direction_.norm());
    if (system_.counts(j) && std::abs(sum[j]) > allowed) return false;
  }
  return true;
}

/// Whether the value changes as the curvature says after a step of this length and corrections.
bool WitnessSearch::gains(double length) {
  const double predicted = 0.5 * length * length * curvature_;
  if (!(predicted > kRounding * std::abs(point_.evaluation.f))) return false;
  const Walk::End end = walk_.take(step_, length);
  const double extent = std::abs(length) * longest(canonical_, step_, system_.units());
  // Where gradients are dependent a violation may be all that the gain is worth.
  return end.reached && end.moved >= kMoved * extent &&
         end.left <= kViolationsShare * std::abs(end.change) &&
         (inner_ ? end.change : -end.change) >= kShareOfGain * predicted;
}

/// The same where the way back is closed: the value has to fall, and by more than a slope explains.
bool WitnessSearch::gains_beyond_slope(double length) {
  const double predicted = 0.5 * length * length * curvature_;
  if (!gains(length)) return false;
  const Walk::End whole = walk_.take(step_, length), half = walk_.take(step_, 0.5 * length);
  const double bend = whole.change - 2.0 * half.change;  // half of the predicted change
  return half.reached && (inner_ ? bend : -bend) >= 0.5 * kShareOfGain * predicted;
}

std::optional<WrongCurvature> WitnessSearch::run(double margin, double distance) {
  if (!find_direction() || !is_tangent()) return {};
  if (!(curvature_ > kClearlyWrong * margin * units_direction_.squaredNorm())) return {};
  return try_steps(distance, false);
}

std::optional<WrongCurvature> WitnessSearch::run_along(const Eigen::VectorXd& direction,
                                                       double distance) {
  double norm = 0.0;
  for (Index i = begin_; i < owned_end_; ++i) {
    if (!system_.is_slack(i)) norm += direction[i] * direction[i];
  }
  if (!(norm > 0.0)) return {};
  units_direction_ = direction / std::sqrt(norm);
  curvature_ = curvature_of_all(units_direction_);
  if (!(curvature_ > 0.0)) return {};
  return try_steps(distance, true);
}

std::optional<WrongCurvature> WitnessSearch::try_steps(double distance, bool one_way) {
  step_ = walk_.step_along(units_direction_);
  const double size = std::max(1.0, longest(canonical_, point_.iterate.v, system_.units()));
  double length = kFirstLength * size;
  for (int k = 0; k < kTrials && length >= kBeyond * distance; ++k, length *= kShorter) {
    // In both directions, so that no slope left over counts.
    if (one_way ? gains_beyond_slope(length) : gains(length) && gains(-length)) {
      return WrongCurvature{inner_ ? Player::Max : Player::Min, step_};
    }
  }
  return {};
}

}  // namespace

std::optional<WrongCurvature> find_witness(CanonicalProblem& canonical, ActiveSetSystem& system,
                                           const Point& point, double margin, double distance,
                                           Player owner) {
  const bool inner = owner == Player::Max;
  system.assemble({.min_fixed = true, .max_fixed = inner});
  return WitnessSearch(canonical, system, point, inner).run(margin, distance);
}

std::optional<WrongCurvature> try_witness(CanonicalProblem& canonical, ActiveSetSystem& system,
                                          const Point& point, const Eigen::VectorXd& direction,
                                          double distance, Player owner) {
  return WitnessSearch(canonical, system, point, owner == Player::Max)
      .run_along(direction, distance);
}

}  // namespace ipminmax
