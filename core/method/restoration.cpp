#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/method/parameters.hpp"
#include "core/method/restoration.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

namespace restoration = parameters::restoration;
/// The restoration problem as a model of its own: variables (v, p, n), all owned by Min.
class RestorationProblem final : public Problem {
 public:
  RestorationProblem(CanonicalProblem& canonical, double mu, const Point& from)
      : canonical_(canonical),
        n_(canonical.variables()),
        m_(canonical.constraints()),
        zeta_(std::sqrt(mu)),
        mu_(mu),
        from_(from),
        v_(from.iterate.v),
        c_(from.evaluation.c),
        lambda_(m_),
        evaluation_(from.evaluation) {
    weight_ = v_.cwiseAbs().cwiseMax(1.0).cwiseInverse().cwiseAbs2();
    const std::size_t size = at(n_ + 2 * m_);
    structure_.variable_players.assign(size, Player::Min);
    structure_.constraint_players.assign(at(m_), Player::Min);
    structure_.variable_lower.assign(size, 0.0);
    structure_.variable_upper.assign(size, kInfinity);
    std::copy_n(canonical.lower().data(), n_, structure_.variable_lower.begin());
    std::copy_n(canonical.upper().data(), n_, structure_.variable_upper.begin());
    structure_.constraint_lower.assign(at(m_), 0.0);
    structure_.constraint_upper.assign(at(m_), 0.0);
    for (const Triplet& entry : canonical.jacobian()) structure_.jacobian.push_back(entry);
    for (Index j = 0; j < m_; ++j) {
      const Index slack = canonical.slack_of(j);
      if (slack >= 0) structure_.jacobian.push_back({j, slack});
      structure_.jacobian.push_back({j, n_ + j});
      structure_.jacobian.push_back({j, n_ + m_ + j});
    }
    for (const Triplet& entry : canonical.hessian()) structure_.hessian.push_back(entry);
    for (Index i = 0; i < n_; ++i) structure_.hessian.push_back({i, i});
    structure_.nonlinear_variables.emplace(at(n_));
    std::iota(structure_.nonlinear_variables->begin(), structure_.nonlinear_variables->end(), 0);
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::copy_n(v_.data(), n_, start.v.begin());
    for (Index j = 0; j < m_; ++j) {
      // Minimizer of rho (p + n) - mu (ln p + ln n) with p - n = c, eq. (33).
      const double c = c_[j];
      const double half = (mu_ - restoration::kPenalty * c) / (2.0 * restoration::kPenalty);
      const double n = half + std::sqrt(half * half + mu_ * c / (2.0 * restoration::kPenalty));
      const double p = c + n;
      start.v[at(n_ + j)] = p;
      start.v[at(n_ + m_ + j)] = n;
      start.z_lower[at(n_ + j)] = mu_ / p;
      start.z_lower[at(n_ + m_ + j)] = mu_ / n;
    }
    for (Index i = 0; i < n_; ++i) {
      start.z_lower[at(i)] = std::min(restoration::kPenalty, from_.iterate.z_lower[i]);
      start.z_upper[at(i)] = std::min(restoration::kPenalty, from_.iterate.z_upper[i]);
    }
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> w, bool, double& f) override {
    load(w);
    f = 0.0;
    for (Index k = n_; k < n_ + 2 * m_; ++k) f += restoration::kPenalty * w[at(k)];
    f += 0.5 * zeta_ * (v_ - from_.iterate.v).cwiseAbs2().dot(weight_);
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> w, bool, std::span<double> grad) override {
    load(w);
    for (Index i = 0; i < n_; ++i) {
      grad[at(i)] = zeta_ * weight_[i] * (v_[i] - from_.iterate.v[i]);
    }
    std::fill(grad.begin() + n_, grad.end(), restoration::kPenalty);
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> w, bool, std::span<double> g) override {
    load(w);
    if (!canonical_.constraints(v_, c_)) return false;
    for (Index j = 0; j < m_; ++j) g[at(j)] = c_[j] - w[at(n_ + j)] + w[at(n_ + m_ + j)];
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> w, bool, std::span<double> values) override {
    load(w);
    if (!canonical_.first_derivatives(v_, evaluation_)) return false;
    auto out = std::copy(evaluation_.jacobian.begin(), evaluation_.jacobian.end(), values.begin());
    for (Index j = 0; j < m_; ++j) {
      if (canonical_.slack_of(j) >= 0) *out++ = -1.0;
      *out++ = -1.0;
      *out++ = 1.0;
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> w, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    load(w);
    std::copy(lambda.begin(), lambda.end(), lambda_.data());
    if (!canonical_.second_derivatives(v_, lambda_, evaluation_, 0.0)) {
      return false;
    }
    auto out = std::copy(evaluation_.hessian.begin(), evaluation_.hessian.end(), values.begin());
    for (Index i = 0; i < n_; ++i) *out++ = sigma * zeta_ * weight_[i];
    return true;
  }

  /// Largest pull of the proximal term at v, over the penalty: v is that far from stationary for
  /// the violation alone.
  [[nodiscard]] double pull(const Eigen::VectorXd& v) const {
    return zeta_ * max_norm((v - from_.iterate.v).cwiseProduct(weight_)) / restoration::kPenalty;
  }

  /// Reads v of (v, p, n) and evaluates c there; false when undefined.
  [[nodiscard]] bool read(std::span<const double> w, Eigen::VectorXd& v, Eigen::VectorXd& c) {
    load(w);
    v = v_;
    c.resize(m_);
    return canonical_.constraints(v_, c);
  }

 private:
  void load(std::span<const double> w) { std::copy_n(w.begin(), n_, v_.data()); }

  CanonicalProblem& canonical_;
  Index n_, m_;
  double zeta_, mu_;
  Point from_;
  Eigen::VectorXd v_, c_, lambda_, weight_;
  Evaluation evaluation_;
  ProblemStructure structure_;
};

SolverOptions restoration_options(const SolverOptions& options, double mu, Index iterations) {
  SolverOptions inner = options;
  inner.minmax_globalization = Globalization::Filter;
  inner.minmax_barrier_rule = BarrierRule::Ipopt;
  inner.mu_strategy = BarrierStrategy::Monotone;
  inner.nlp_scaling_method = Scaling::None;
  inner.obj_scaling_factor = 1.0;
  inner.bound_relax_factor = 0.0;
  inner.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  inner.max_iter = iterations;
  inner.mu_init = mu;
  inner.mu_target = 0.0;
  inner.warm_start_init_point = true;
  const double tiny = std::numeric_limits<double>::min();
  inner.warm_start_bound_push = inner.warm_start_bound_frac = tiny;
  inner.warm_start_slack_bound_push = inner.warm_start_slack_bound_frac = tiny;
  inner.warm_start_mult_bound_push = tiny;
  return inner;
}

bool was_limited(Status status) {
  return status == Status::MaxIterations || status == Status::MaxCpuTime ||
         status == Status::MaxWallTime || status == Status::UserStop;
}

}  // namespace

RestorationOutcome restore_feasibility(
    CanonicalProblem& canonical, const SolverOptions& options, double mu,
    const std::function<bool(const Eigen::VectorXd&, const Eigen::VectorXd&)>& acceptable,
    const Restorer& restorer, Point& point, Index& iterations) {
  double start_mu = std::max(mu, max_norm(point.evaluation.c));
  Point from = point;
  for (int round = 0; round < restoration::kRounds; ++round) {
    RestorationProblem problem(canonical, start_mu, from);
    Eigen::VectorXd v, c;
    bool restored = false;
    bool stopped = false;
    SolveObserver observer;
    observer.on_iteration = [&](const IterationInfo& info) {
      if (info.iteration == 0 || !problem.read(info.v, v, c)) return true;
      restored = acceptable(v, c);
      stopped = !restored && restorer.observe && !restorer.observe(info, point, v, c);
      return !restored && !stopped;
    };
    const Result result =
        restorer.solve(problem, restoration_options(options, start_mu, iterations), observer);
    iterations = std::max<Index>(0, iterations - result.iterations);
    if (restored || stopped) {
      point.iterate.v = v;
      return restored ? RestorationOutcome::Restored : RestorationOutcome::UserStop;
    }
    // A saddle of the violation counts as a minimum when no escape from it was found.
    if (!is_success(result.status) && result.status != Status::NotLocalMinmax) {
      return was_limited(result.status) ? RestorationOutcome::Stopped : RestorationOutcome::Failed;
    }
    if (!problem.read(result.v, v, c) || max_norm(c) <= options.constr_viol_tol) {
      return RestorationOutcome::Failed;
    }
    constexpr double kLeastPull = 1e-6;
    if (problem.pull(v) <= kLeastPull) {
      const bool pivots = options.linear_solver != LinearSolver::Ldlt;
      if (!pivots && result.certificate.second_order != SecondOrder::Satisfied)
        return RestorationOutcome::Unproved;
      Iterate& found = point.iterate;
      found.v = v;
      std::copy_n(result.lambda.begin(), found.lambda.size(), found.lambda.data());
      std::copy_n(result.z_lower.begin(), found.v.size(), found.z_lower.data());
      std::copy_n(result.z_upper.begin(), found.v.size(), found.z_upper.data());
      return RestorationOutcome::LocallyInfeasible;
    }
    // The proximal term holds v back: on from here with less of it.
    from.iterate.v = v;
    from.evaluation.c = c;
    constexpr double kLess = 1e-2;
    start_mu *= kLess;
  }
  return RestorationOutcome::Failed;
}

}  // namespace ipminmax
