#include "core/certificate/witness.hpp"

#include <algorithm>
#include <cmath>

namespace ipminmax {
namespace {

constexpr double kGrowth = 8.0;  // of the shift
constexpr int kMostShifts = 16;
constexpr double kConstraintShift = 1e-10;  // for dependent constraints
constexpr int kMostSolves = 20;             // of inverse iteration
constexpr double kSettled = 1e-2;           // relative change of the curvature that ends it
constexpr double kClearlyWrong = 2.0;       // curvature over error and margin
constexpr double kFirstLength = 0.1;        // of a trial, over the size of the point in units
constexpr double kBeyond = 10.0;            // length over the distance to the solution
constexpr int kTrials = 12;
constexpr double kShorter = 0.25;
constexpr int kCorrections = 6;       // back to the constraints and to the inner maximum
constexpr double kShareOfGain = 0.1;  // of the gain predicted that has to come
constexpr double kRounding = 1e-14;   // of the value
constexpr double kNegligible = 1e-6;  // residual over length^2 that needs no correction
constexpr double kSmall = 1e-2;       // that is accepted

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

class WitnessSearch {
 public:
  WitnessSearch(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                bool inner)
      : canonical_(canonical),
        system_(system),
        point_(point),
        inner_(inner),
        begin_(inner ? canonical.y().begin : 0),
        owned_end_(inner ? canonical.variables() : canonical.y().begin) {}

  std::optional<WrongCurvature> run(double margin, double distance);

 private:
  [[nodiscard]] bool right_with(double shift);
  [[nodiscard]] bool find_direction();
  [[nodiscard]] double curvature(const Eigen::VectorXd& d) const;
  void make_step();
  [[nodiscard]] bool gains(double length);
  struct Trial {
    Eigen::VectorXd v, lambda;
    Evaluation evaluation;
  };
  [[nodiscard]] bool evaluate(Trial& trial);
  [[nodiscard]] bool correct(Trial& trial, double& residual);
  [[nodiscard]] double lagrangian(const Evaluation& evaluation) const;
  [[nodiscard]] bool is_inside(const Eigen::VectorXd& v, const Eigen::VectorXd& c) const;
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

/// Inverse iteration with the least shift, by factors, that makes the matrix right: turns to the
/// direction of the worst curvature on the tangent space.
bool WitnessSearch::find_direction() {
  double shift = 1e-6;
  for (int k = 0; !right_with(shift); ++k, shift *= kGrowth) {
    if (k == kMostShifts) return false;
  }
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
    curvature_ = curvature(units_direction_);
    if (k > 1 && curvature_ > 0.0 && std::abs(curvature_ - last) <= kSettled * curvature_) break;
    last = curvature_;
  }
  return curvature_ > 0.0;
}

/// Slacks of open inequalities move with their constraint.
void WitnessSearch::make_step() {
  step_ = units_direction_.cwiseProduct(system_.units().variable);
  const auto slack_of = canonical_.slack_of_constraint();
  for (std::size_t k = 0; k < point_.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    const Index slack = slack_of[at(row)];
    if (slack >= 0 && !system_.is_fixed(slack)) {
      step_[slack] += point_.evaluation.jacobian[k] * step_[col];
    }
  }
}

/// Bounds and open inequalities, of which c tells by how much their slack is off.
bool WitnessSearch::is_inside(const Eigen::VectorXd& v, const Eigen::VectorXd& c) const {
  Eigen::VectorXd at_end = v;
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < c.size(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && !system_.is_fixed(slack)) at_end[slack] += c[j];
  }
  return std::ranges::all_of(canonical_.lower_bounded(),
                             [&](Index i) { return at_end[i] >= canonical_.lower()[i]; }) &&
         std::ranges::all_of(canonical_.upper_bounded(),
                             [&](Index i) { return at_end[i] <= canonical_.upper()[i]; });
}

bool WitnessSearch::evaluate(Trial& trial) {
  return canonical_.values(trial.v, trial.evaluation.f, trial.evaluation.c) ==
             EvaluationStatus::Ok &&
         canonical_.first_derivatives(trial.v, trial.evaluation) == EvaluationStatus::Ok;
}

/// f with what the violation left over is worth.
double WitnessSearch::lagrangian(const Evaluation& evaluation) const {
  double value = evaluation.f;
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) value += point_.iterate.lambda[j] * evaluation.c[j];
  }
  return value;
}

/// One Newton step with the matrix at hand back to the constraints and, for Min, to the inner maximum.
/// residual: what was left before, in units.
bool WitnessSearch::correct(Trial& trial, double& residual) {
  const Units& units = system_.units();
  NewtonResidual rhs = zero_step(canonical_);
  Step step = zero_step(canonical_);
  const IndexRange rows{inner_ ? canonical_.max_constraints().begin : 0, canonical_.constraints()};
  for (Index j = rows.begin; j < rows.end; ++j) {
    if (system_.counts(j)) rhs.lambda[j] = -units.constraint[j] * trial.evaluation.c[j];
  }
  if (!inner_) {
    Eigen::VectorXd gradient = trial.evaluation.gradient;
    for (std::size_t k = 0; k < trial.evaluation.jacobian.size(); ++k) {
      const auto [row, col] = canonical_.jacobian()[k];
      if (system_.counts(row)) gradient[col] += trial.evaluation.jacobian[k] * trial.lambda[row];
    }
    for (Index i = canonical_.y().begin; i < canonical_.y().end; ++i) {
      if (!system_.is_fixed(i)) rhs.v[i] = -units.variable[i] * gradient[i];
    }
  }
  residual = 0.0;
  for (const Eigen::VectorXd* part : {&rhs.v, &rhs.lambda}) {
    if (part->size() > 0) residual = std::max(residual, part->lpNorm<Eigen::Infinity>());
  }
  if (residual == 0.0) return true;
  if (!solve(rhs, step)) return false;
  for (Index i = begin_; i < canonical_.variables(); ++i) {
    if (!system_.is_slack(i) && !system_.is_fixed(i)) trial.v[i] += units.variable[i] * step.v[i];
  }
  for (Index j = rows.begin; j < rows.end; ++j) {
    if (system_.counts(j)) trial.lambda[j] += units.constraint[j] * step.lambda[j];
  }
  return evaluate(trial);
}

/// Whether the value changes as the curvature says after a step of this length and corrections.
bool WitnessSearch::gains(double length) {
  const double predicted = 0.5 * length * length * curvature_;
  if (!(predicted > kRounding * std::abs(point_.evaluation.f))) return false;
  Trial trial{point_.iterate.v + length * step_, point_.iterate.lambda, point_.evaluation};
  if (!evaluate(trial)) return false;
  double residual = 0.0;
  for (int k = 0; k < kCorrections; ++k) {
    if (!correct(trial, residual)) return false;
    if (residual <= kNegligible * length * length) break;
  }
  if (!(residual <= kSmall * length * length)) return false;
  if (!is_inside(trial.v, trial.evaluation.c)) return false;
  const double change = lagrangian(trial.evaluation) - lagrangian(point_.evaluation);
  return (inner_ ? change : -change) >= kShareOfGain * predicted;
}

std::optional<WrongCurvature> WitnessSearch::run(double margin, double distance) {
  if (!find_direction()) return {};
  if (!(curvature_ > kClearlyWrong * margin * units_direction_.squaredNorm())) return {};
  make_step();
  const double size = std::max(1.0, longest(canonical_, point_.iterate.v, system_.units()));
  double length = kFirstLength * size;
  for (int k = 0; k < kTrials && length >= kBeyond * distance; ++k, length *= kShorter) {
    // In both directions, so that no slope left over counts.
    if (gains(length) && gains(-length)) {
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

}  // namespace ipminmax
