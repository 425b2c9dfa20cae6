#include "core/certificate/valley.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/certificate/walk.hpp"

namespace ipminmax {
namespace {

constexpr int kMostDirections = 6;
constexpr int kSolves = 4;  // of inverse iteration: the shift is far below all other curvature
constexpr double kLongest = 0.1;  // of the point in units
constexpr double kShorter = 0.25;
constexpr int kLengths = 6;
constexpr int kEnough = 3;             // lengths of one direction, together
constexpr double kAmplified = 0.1;     // by inverse iteration, times the tolerance
constexpr double kNoCurvature = 1e-6;  // over that of the variables alone
constexpr double kRounding = 1e-15;
constexpr double kConstant = 1e-12;  // change over |f| + length^2
constexpr double kMoved = 0.5;       // of the length: corrections must not lead back
constexpr double kClearGain = 1e-6;  // over 1 + |f|
constexpr double kExplained = 0.5;   // share of a change that may be of odd powers

class ValleySearch {
 public:
  ValleySearch(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point, bool inner)
      : canonical_(canonical),
        system_(system),
        point_(point),
        inner_(inner),
        owned_(inner ? canonical.y() : canonical.x()),
        walk_(canonical, system, point, inner ? Walk::Kind::InnerValley : Walk::Kind::Valley) {}

  Valley run(double margin, double tolerance);

 private:
  double tolerance_ = 0.0;
  [[nodiscard]] std::optional<Eigen::VectorXd> next_direction(double& curvature);
  [[nodiscard]] double curvature(const Eigen::VectorXd& d) const;
  [[nodiscard]] double own_curvature(const Eigen::VectorXd& d) const;
  [[nodiscard]] bool is_flat(const Eigen::VectorXd& direction);
  void look_for_descent(const Eigen::VectorXd& step, double length, double bend,
                        const Walk::End& end);
  [[nodiscard]] bool solve(const NewtonResidual& rhs, Step& step) {
    return inner_ ? system_.kkt().solve_inner(system_.assembled(), rhs, step)
                  : system_.kkt().solve(system_.assembled(), rhs, step);
  }

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const Point& point_;
  const bool inner_;
  const IndexRange owned_;
  Walk walk_;
  std::vector<Eigen::VectorXd> found_;  ///< in units, owned parts orthonormal
  std::optional<Eigen::VectorXd> descent_;
};

double ValleySearch::curvature(const Eigen::VectorXd& d) const {
  double sum = 0.0;
  const Evaluation& w = system_.assembled();
  for (std::size_t k = 0; k < w.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    sum += (i == j ? 1.0 : 2.0) * w.hessian[k] * d[i] * d[j];
  }
  return sum;
}

/// What the variables alone would have.
double ValleySearch::own_curvature(const Eigen::VectorXd& d) const {
  double sum = 0.0;
  const Evaluation& w = system_.assembled();
  for (std::size_t k = 0; k < w.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    if (i == j) sum += std::abs(w.hessian[k]) * d[i] * d[i];
  }
  return sum;
}

std::optional<Eigen::VectorXd> ValleySearch::next_direction(double& found) {
  NewtonResidual rhs = zero_step(canonical_);
  Step step = zero_step(canonical_);
  const auto number = static_cast<double>(found_.size());
  for (Index i = owned_.begin; i < owned_.end; ++i) {
    if (!system_.is_fixed(i)) rhs.v[i] = std::sin(1.0 + number + 1.3 * (number + 1.0) * i);
  }
  Eigen::VectorXd d = Eigen::VectorXd::Zero(canonical_.variables());
  for (int k = 0; k < kSolves; ++k) {
    if (!solve(rhs, step)) return {};
    d = step.v;
    for (Index i = 0; i < d.size(); ++i) {
      if (system_.is_slack(i) || system_.is_fixed(i)) d[i] = 0.0;
    }
    const auto own = [&](Eigen::VectorXd& v) { return v.segment(owned_.begin, owned_.size()); };
    for (Eigen::VectorXd& other : found_) d -= own(other).dot(own(d)) * other;
    const double norm = own(d).norm();
    // Without a tangent direction, or with curvature along all, little comes out.
    const bool grew = k == 0 || norm >= kAmplified / tolerance_;
    if (!(grew && norm > 0.0 && std::isfinite(norm))) return {};
    d /= norm;
    rhs.v.setZero();
    own(rhs.v) = own(d);
  }
  found = curvature(d);
  return d;
}

bool ValleySearch::is_flat(const Eigen::VectorXd& direction) {
  const Eigen::VectorXd step = walk_.step_along(direction);
  const double size = std::max(1.0, longest(canonical_, point_.iterate.v, system_.units()));
  double length = kLongest * size;
  int constant = 0;
  for (int k = 0; k < kLengths; ++k, length *= kShorter) {
    for (const double signed_length : {length, -length}) {
      const Walk::End end = walk_.take(step, signed_length);
      if (!end.reached) continue;
      const double allowed = kConstant * (std::abs(point_.evaluation.f) + length * length);
      const double extent = longest(canonical_, step, system_.units()) * length;
      if (end.moved < kMoved * extent) return false;
      if (!(std::abs(end.change) <= allowed)) {
        look_for_descent(step, signed_length, curvature(direction), end);
        return false;
      }
      if (++constant == kEnough) return true;
    }
  }
  return false;
}

/// At the end of a walk that does not stay at the same value, or on the other side, unless the
/// curvature explains most of a rise: then it rises there, too.
void ValleySearch::look_for_descent(const Eigen::VectorXd& step, double length, double bend,
                                    const Walk::End& end) {
  if (canonical_.y().size() > 0) return;
  const double explained = 0.5 * bend * length * length;
  if (explained > 0.0 && std::abs(end.change - explained) <= kExplained * explained) return;
  const auto falls = [&](const Walk::End& e) {
    return e.reached && e.change < -kClearGain * (1.0 + std::abs(point_.evaluation.f));
  };
  if (falls(end)) {
    descent_ = length * step;
  } else if (length > 0.0 && falls(walk_.take(step, -length))) {
    descent_ = -length * step;
  }
}

Valley ValleySearch::run(double margin, double tolerance) {
  tolerance_ = tolerance;
  KktSystem& kkt = system_.kkt();
  const bool right = inner_ ? kkt.has_expected_inner_inertia(kkt.factorize_inner({.y = margin}))
                            : kkt.has_expected_inertia(kkt.factorize({.x = margin, .y = -margin}));
  Valley valley;
  if (!right) return valley;
  while (static_cast<int>(found_.size()) < kMostDirections) {
    double curvature = 0.0;
    const auto direction = next_direction(curvature);
    valley.complete = !direction || std::abs(curvature) > tolerance * direction->squaredNorm();
    if (valley.complete) break;
    found_.push_back(*direction);
  }
  if (found_.empty()) return valley;
  walk_.set_free_directions(found_);
  valley.verdict = Valley::Verdict::Flat;
  valley.direction = walk_.step_along(found_.front());
  std::vector<Eigen::VectorXd> tried = {found_.front()};
  if (found_.size() > 1) {  // all together, as each costs evaluations
    tried.push_back(Eigen::VectorXd::Zero(canonical_.variables()));
    for (std::size_t k = 0; k < found_.size(); ++k) {
      tried.back() += std::cos(1.0 + static_cast<double>(k)) * found_[k];
    }
  }
  for (const Eigen::VectorXd& direction : tried) {
    const double allowed =
        kNoCurvature * own_curvature(direction) + kRounding * direction.squaredNorm();
    const bool none = std::abs(curvature(direction)) <= allowed;
    const bool may_fall = curvature(direction) <= margin * direction.squaredNorm();
    if ((none || may_fall) && is_flat(direction) && none) continue;
    valley.verdict = Valley::Verdict::Neither;
    valley.descent = std::move(descent_);
    valley.direction = walk_.step_along(direction);
    break;
  }
  return valley;
}

}  // namespace

Valley explore_valley(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                      double margin, double tolerance, bool inner) {
  system.assemble({.min_fixed = true, .max_fixed = true});
  return ValleySearch(canonical, system, point, inner).run(margin, tolerance);
}

}  // namespace ipminmax
