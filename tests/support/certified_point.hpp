#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <support/autodiff_problem.hpp>

#include "core/certificate/certificate.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/point.hpp"

namespace ipminmax::testing {

/// A point in the model's units with multipliers of the constraints. Bound multipliers are those
/// that make it stationary; a point stays away from its active bounds as on the central path.
class CertifiedPoint {
 public:
  CertifiedPoint(Problem& problem, const std::vector<double>& v,
                 const std::vector<double>& lambda = {}, const SolverOptions& options = {})
      : options_(options), canonical_(problem, options_, counts_, timing_) {
    options_.nlp_scaling_method = Scaling::None;
    options_.bound_relax_factor = 0.0;
    if (const std::string error = canonical_.build(); !error.empty()) {
      throw std::invalid_argument(error);
    }
    kkt_ = std::make_unique<KktSystem>(canonical_, options_, counts_, timing_);
    EXPECT_TRUE(kkt_->analyze());
    place(problem.structure(), v, lambda);
  }

  static constexpr double kMu = 1e-9;

  Certificate certify() {
    ipminmax::Point point{iterate_, evaluation_, {}};
    renew_dual(canonical_, point);
    CertificateArrays arrays;
    return ipminmax::certify(canonical_, *kkt_, point, kMu, options_, 100, arrays).certificate;
  }

  /// Factorizations of K and of K_yy so far.
  [[nodiscard]] const Counts& counts() const { return counts_; }

  /// A multiplier other than the stationary one, with the distance that belongs to it.
  void set_bound(Index i, bool lower, double distance, double z) {
    (lower ? iterate_.z_lower : iterate_.z_upper)[i] = z;
    iterate_.v[i] = lower ? canonical_.lower()[i] + distance : canonical_.upper()[i] - distance;
    evaluate();
  }

 private:
  void place(const ProblemStructure& shape, const std::vector<double>& v,
             const std::vector<double>& lambda) {
    const Index n = canonical_.variables();
    iterate_ = {Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(canonical_.constraints()),
                Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
    evaluation_.c.setZero(canonical_.constraints());
    evaluation_.gradient.setZero(n);
    evaluation_.jacobian.assign(canonical_.jacobian().size(), 0.0);
    evaluation_.hessian.assign(canonical_.hessian().size(), 0.0);
    Index x = canonical_.x().begin;
    Index y = canonical_.y().begin;
    for (std::size_t i = 0; i < v.size(); ++i) {
      iterate_.v[shape.variable_players[i] == Player::Min ? x++ : y++] = v[i];
    }
    Index min = canonical_.min_constraints().begin;
    Index max = canonical_.max_constraints().begin;
    for (std::size_t j = 0; j < lambda.size(); ++j) {
      iterate_.lambda[shape.constraint_players[j] == Player::Min ? min++ : max++] = lambda[j];
    }
    EXPECT_TRUE(canonical_.constraints(iterate_.v, evaluation_.c));
    for (Index j = 0; j < canonical_.constraints(); ++j) {
      const Index slack = canonical_.slack_of_constraint()[static_cast<std::size_t>(j)];
      if (slack >= 0) iterate_.v[slack] = evaluation_.c[j];
    }
    evaluate();
    // sign (z_lower - z_upper) = grad f + J' lambda; the slacks' rows are -lambda.
    Eigen::VectorXd gradient = evaluation_.gradient;
    for (std::size_t k = 0; k < evaluation_.jacobian.size(); ++k) {
      const auto [row, col] = canonical_.jacobian()[k];
      gradient[col] += evaluation_.jacobian[k] * iterate_.lambda[row];
    }
    for (Index j = 0; j < canonical_.constraints(); ++j) {
      const Index slack = canonical_.slack_of_constraint()[static_cast<std::size_t>(j)];
      if (slack >= 0) gradient[slack] = -iterate_.lambda[j];
    }
    const auto give = [&](Index i, double distance, double force, double& z, double direction) {
      z = distance > 1e-6 ? kMu / distance : std::max(force, 1e-12);
      if (distance <= 1e-6) iterate_.v[i] += direction * (kMu / z - distance);
    };
    const Eigen::VectorXd start = iterate_.v;
    for (const Index i : canonical_.lower_bounded()) {
      give(i, start[i] - canonical_.lower()[i], canonical_.sign(i) * gradient[i],
           iterate_.z_lower[i], 1.0);
    }
    for (const Index i : canonical_.upper_bounded()) {
      give(i, canonical_.upper()[i] - start[i], -canonical_.sign(i) * gradient[i],
           iterate_.z_upper[i], -1.0);
    }
    evaluate();
  }

  void evaluate() {
    EXPECT_TRUE(canonical_.values(iterate_.v, evaluation_.f, evaluation_.c));
    EXPECT_TRUE(canonical_.first_derivatives(iterate_.v, evaluation_));
    EXPECT_TRUE(canonical_.second_derivatives(iterate_.v, iterate_.lambda, evaluation_));
  }

  SolverOptions options_;
  Counts counts_;
  Timing timing_;
  CanonicalProblem canonical_;
  std::unique_ptr<KktSystem> kkt_;
  Iterate iterate_;
  Evaluation evaluation_;
};

/// The certificate of a model at a point.
inline Certificate certify(const Model& model, const std::vector<double>& v,
                           const std::vector<double>& lambda = {}) {
  AutodiffProblem problem(model, v);
  return CertifiedPoint(problem, v, lambda).certify();
}

}  // namespace ipminmax::testing
