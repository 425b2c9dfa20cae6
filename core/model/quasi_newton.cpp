#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/quasi_newton.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

// limited_memory_max_history, limited_memory_max_skipping, limited_memory_init_val_max of Ipopt.
constexpr std::size_t kPairs = 6;
constexpr int kMostSkipped = 2;
constexpr double kLargestSigma = 1e8, kSmallestSigma = 1e-8;

}  // namespace

void LowRankHessian::subtract_product(const Eigen::VectorXd& v, Eigen::VectorXd& product) const {
  product -= diagonal.cwiseProduct(v);
  if (columns.cols() == 0) return;
  product += columns * inverse_middle.solve(columns.transpose() * v);
}

QuasiNewton::QuasiNewton(Index variables, std::vector<Index> nonlinear)
    : variables_(variables), nonlinear_(std::move(nonlinear)) {}

std::shared_ptr<const LowRankHessian> QuasiNewton::update(const CanonicalProblem& canonical,
                                                          const Eigen::VectorXd& v,
                                                          const Eigen::VectorXd& lambda,
                                                          const Evaluation& here) {
  const bool first = v_.size() == 0;
  if (!first) take(change(canonical, v, lambda, here));
  if (first || !last_) last_ = matrix();
  v_ = v;
  gradient_ = here.gradient;
  jacobian_ = here.jacobian;
  return last_;
}

QuasiNewton::Pair QuasiNewton::change(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                      const Eigen::VectorXd& lambda, const Evaluation& here) const {
  Eigen::VectorXd gradient = here.gradient - gradient_;
  for (const auto k : indices(jacobian_)) {
    const auto [row, col] = canonical.jacobian()[k];
    gradient[col] += (here.jacobian[k] - jacobian_[k]) * lambda[row];
  }
  Pair pair{Eigen::VectorXd::Zero(variables_), Eigen::VectorXd::Zero(variables_)};
  for (const Index i : nonlinear_) {
    pair.s[i] = v[i] - v_[i];
    pair.y[i] = gradient[i];
  }
  return pair;
}

/// Scaled to |s| = 1, which B does not see: pairs of the first and of the last steps differ by many
/// orders.
void QuasiNewton::take(Pair pair) {
  const double length = pair.s.norm();
  if (!(length > 0.0)) return;  // multipliers may have changed: B stays
  pair.s /= length;
  pair.y /= length;
  const double curvature = pair.s.dot(pair.y);
  const double least = std::sqrt(kEpsilon) * pair.y.norm();
  if (!(curvature > least) || !std::isfinite(curvature)) {
    if (++skipped_ <= kMostSkipped) return;
    pairs_.clear();
    sigma_ = 1.0;
  } else {
    if (pairs_.size() == kPairs) pairs_.erase(pairs_.begin());
    sigma_ = std::clamp(curvature, kSmallestSigma, kLargestSigma);
    pairs_.push_back(std::move(pair));
  }
  skipped_ = 0;
  last_ = nullptr;
}

/// B = sigma I - C M^-1 C', C = [sigma S, Y], M = [sigma S'S L; L' -D] with S'Y = L + D + R, L
/// strictly lower, D diagonal.
std::shared_ptr<const LowRankHessian> QuasiNewton::matrix() const {
  auto result = std::make_shared<LowRankHessian>();
  result->diagonal = Eigen::VectorXd::Zero(variables_);
  for (const Index i : nonlinear_) result->diagonal[i] = sigma_;
  const auto p = static_cast<Eigen::Index>(pairs_.size());
  result->columns.resize(variables_, 2 * p);
  result->middle.setZero(2 * p, 2 * p);
  for (Eigen::Index i = 0; i < p; ++i) {
    const Pair& row = pairs_[static_cast<std::size_t>(i)];
    result->columns.col(i) = sigma_ * row.s;
    result->columns.col(p + i) = row.y;
    for (Eigen::Index j = 0; j < p; ++j) {
      const Pair& col = pairs_[static_cast<std::size_t>(j)];
      result->middle(i, j) = sigma_ * row.s.dot(col.s);
      if (i > j) result->middle(i, p + j) = result->middle(p + j, i) = row.s.dot(col.y);
    }
    result->middle(p + i, p + i) = -row.s.dot(row.y);
  }
  if (p > 0) result->inverse_middle.compute(result->middle);
  return result;
}

}  // namespace ipminmax
