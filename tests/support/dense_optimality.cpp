#include <support/dense_optimality.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include <support/dense_algebra.hpp>

namespace ipminmax::testing {

DenseEvaluation::DenseEvaluation(Problem& problem, const Eigen::VectorXd& v) {
  const ProblemStructure& structure = problem.structure();
  const auto m = static_cast<Eigen::Index>(structure.constraint_lower.size());
  gradient.setZero(v.size());
  constraints.setZero(m);
  jacobian.setZero(m, v.size());
  std::vector<double> values(structure.jacobian.size());
  const std::span<const double> at(v.data(), static_cast<std::size_t>(v.size()));
  ok = problem.objective(at, true, objective) &&
       problem.gradient(at, true, {gradient.data(), at.size()}) &&
       problem.constraints(at, true, {constraints.data(), static_cast<std::size_t>(m)}) &&
       problem.jacobian(at, true, values);
  for (std::size_t k = 0; k < values.size(); ++k) {
    jacobian(structure.jacobian[k].row, structure.jacobian[k].col) += values[k];
  }
}

Eigen::MatrixXd dense_hessian(Problem& problem, const Eigen::VectorXd& v, double sigma,
                              const Eigen::VectorXd& lambda) {
  const ProblemStructure& structure = problem.structure();
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(v.size(), v.size());
  std::vector<double> values(structure.hessian.size());
  if (!problem.hessian({v.data(), static_cast<std::size_t>(v.size())}, true, sigma,
                       {lambda.data(), static_cast<std::size_t>(lambda.size())}, true, values)) {
    return Eigen::MatrixXd::Constant(v.size(), v.size(), std::nan(""));
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [row, col] = structure.hessian[k];
    h(row, col) += values[k];
    if (row != col) h(col, row) += values[k];
  }
  return h;
}

namespace {

/// The judge. Takes one evaluation point apart into the two players' active constraints.
class DenseJudge {
 public:
  DenseJudge(Problem& problem, const Eigen::VectorXd& v, const DenseTolerances& tolerances)
      : problem_(problem), v_(v), tolerances_(tolerances), evaluation_(problem, v) {
    if (!evaluation_.ok) return;
    collect_variables();
    collect_active();
  }

  /// With given multipliers, or with the least-squares multipliers of the active constraints.
  DenseOptimality judge(const Multipliers* given) {
    DenseOptimality result;
    if (!evaluation_.ok) return result;
    result.infeasibility = infeasibility_;
    if (given == nullptr) {
      estimate_multipliers();
    } else {
      take_multipliers(*given);
    }
    result.stationarity = stationarity_;
    for (Active& active : active_) {
      const double wanted = active.side * (active.owner == Player::Min ? 1.0 : -1.0);
      result.wrong_sign = std::max(result.wrong_sign, -wanted * active.multiplier);
      active.weak |= active.side != 0.0 && std::abs(active.multiplier) <= tolerances_.multiplier;
      result.weakly_active += active.weak ? 1 : 0;
    }
    const double scale = 1.0 + max_entry(evaluation_.gradient);
    const double tolerance = tolerances_.first_order * scale;
    const bool first_order = result.infeasibility <= tolerance &&
                             result.stationarity <= tolerance &&
                             result.wrong_sign <= tolerance + tolerances_.multiplier;
    result.verdict = first_order ? second_order(result) : Verdict::NotFirstOrder;
    return result;
  }

 private:
  struct Active {
    Player owner = Player::Min;
    Eigen::VectorXd gradient;
    double side = 0.0;  ///< +1 at the upper bound, -1 at the lower, 0 equality
    bool weak = false;
    double multiplier = 0.0;
    Eigen::Index constraint = -1;  ///< or
    Eigen::Index variable = -1;
  };

  static double max_entry(const Eigen::MatrixXd& a) {
    return a.size() == 0 ? 0.0 : a.lpNorm<Eigen::Infinity>();
  }

  static std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

  void collect_variables() {
    for (Eigen::Index i = 0; i < v_.size(); ++i) {
      (problem_.structure().variable_players[at(i)] == Player::Min ? x_ : y_).push_back(i);
    }
  }

  void collect_active() {
    const ProblemStructure& s = problem_.structure();
    infeasibility_ = 0.0;
    for (Eigen::Index i = 0; i < v_.size(); ++i) {
      Active active{.owner = s.variable_players[at(i)],
                    .gradient = Eigen::VectorXd::Unit(v_.size(), i),
                    .variable = i};
      add(active, v_[i], s.variable_lower[at(i)], s.variable_upper[at(i)]);
    }
    for (Eigen::Index i = 0; i < evaluation_.constraints.size(); ++i) {
      Active active{.owner = s.constraint_players[at(i)],
                    .gradient = evaluation_.jacobian.row(i).transpose(),
                    .constraint = i};
      add(active, evaluation_.constraints[i], s.constraint_lower[at(i)], s.constraint_upper[at(i)]);
    }
  }

  void add(Active& active, double value, double lower, double upper) {
    infeasibility_ = std::max({infeasibility_, lower - value, value - upper});
    if (lower == upper) {
      active_.push_back(active);
      return;
    }
    const double to_lower = value - lower;
    const double to_upper = upper - value;
    active.side = to_lower < to_upper ? -1.0 : 1.0;
    const double distance = std::min(to_lower, to_upper);
    if (!(distance <= tolerances_.inactive)) return;
    active.weak = distance > tolerances_.active;
    active_.push_back(active);
  }

  void estimate_multipliers() {
    Eigen::MatrixXd gradients(v_.size(), static_cast<Eigen::Index>(active_.size()));
    Eigen::Index k = 0;
    for (const Active& active : active_) {
      gradients.col(k++) = active.weak ? Eigen::VectorXd::Zero(v_.size()) : active.gradient;
    }
    Eigen::VectorXd residual = evaluation_.gradient;
    if (k > 0) {
      const Eigen::VectorXd multipliers = least_squares(gradients, -evaluation_.gradient);
      k = 0;
      for (Active& active : active_) active.multiplier = multipliers[k++];
      residual += gradients * multipliers;
    }
    stationarity_ = max_entry(residual);
  }

  void take_multipliers(const Multipliers& given) {
    for (Active& active : active_) {
      active.multiplier = active.constraint >= 0
                              ? given.lambda[active.constraint]
                              : given.z_upper[active.variable] - given.z_lower[active.variable];
    }
    const Eigen::VectorXd residual = evaluation_.gradient +
                                     evaluation_.jacobian.transpose() * given.lambda -
                                     given.z_lower + given.z_upper;
    stationarity_ = max_entry(residual);
  }

  /// Gradients of a player's active constraints, one per row.
  [[nodiscard]] Eigen::MatrixXd active_gradients(Player owner, bool with_weak) const {
    Eigen::MatrixXd rows(0, v_.size());
    for (const Active& active : active_) {
      if (active.owner != owner || (active.weak && !with_weak)) continue;
      rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
      rows.row(rows.rows() - 1) = active.gradient.transpose();
    }
    return rows;
  }

  struct Extremes {
    double smallest = std::numeric_limits<double>::infinity();
    double largest = -std::numeric_limits<double>::infinity();
  };
  static Extremes eigenvalues(const Eigen::MatrixXd& h, const Eigen::MatrixXd& basis) {
    if (basis.cols() == 0) return {};
    const Eigen::MatrixXd reduced = basis.transpose() * h * basis;
    const Eigen::VectorXd values = symmetric_eigenvalues(reduced);
    return {values.minCoeff(), values.maxCoeff()};
  }

  /// Phi'' = H_xx - N' M^-1 N with M = [H_yy A_y'; A_y 0], N = [H_yx; A_x]: the Hessian of
  /// x -> L(x, y(x)), where y(x) follows the inner maximum and A are the Max constraints.
  [[nodiscard]] Eigen::MatrixXd schur_complement(const Eigen::MatrixXd& h,
                                                 const Eigen::MatrixXd& max_rows) const {
    const auto ny = static_cast<Eigen::Index>(y_.size());
    const auto nx = static_cast<Eigen::Index>(x_.size());
    const Eigen::Index k = max_rows.rows();
    Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(ny + k, ny + k);
    inner.topLeftCorner(ny, ny) = h(y_, y_);
    inner.bottomLeftCorner(k, ny) = max_rows(Eigen::all, y_);
    inner.topRightCorner(ny, k) = inner.bottomLeftCorner(k, ny).transpose();
    Eigen::MatrixXd coupling(ny + k, nx);
    coupling.topRows(ny) = h(y_, x_);
    coupling.bottomRows(k) = max_rows(Eigen::all, x_);
    if (ny + k == 0 || nx == 0) return h(x_, x_);
    const Eigen::MatrixXd response = solve_pivoting(inner, coupling);
    return h(x_, x_) - coupling.transpose() * response;
  }

  Verdict second_order(DenseOptimality& result) {
    Eigen::VectorXd lambda = Eigen::VectorXd::Zero(evaluation_.constraints.size());
    for (const Active& active : active_) {
      if (active.constraint >= 0) lambda[active.constraint] = active.multiplier;
    }
    const Eigen::MatrixXd h = dense_hessian(problem_, v_, 1.0, lambda);
    const double tolerance = tolerances_.curvature * (1.0 + max_entry(h));

    const Eigen::MatrixXd max_rows = active_gradients(Player::Max, true);
    bool inner_independent = true;
    const Eigen::MatrixXd inner_basis = null_space(max_rows(Eigen::all, y_), inner_independent);
    result.inner_curvature = eigenvalues(h(y_, y_), inner_basis).largest;
    const Eigen::MatrixXd min_rows = active_gradients(Player::Min, true);
    bool outer_independent = true;
    const Eigen::MatrixXd outer_basis = null_space(min_rows(Eigen::all, x_), outer_independent);
    result.independent = inner_independent && outer_independent;
    // Curvature that weakly active constraints leave free must have the right sign all the more.
    if (!inner_independent) return Verdict::Undecided;
    if (result.inner_curvature > tolerance) return Verdict::NotLocalMinmax;
    if (result.inner_curvature > -tolerance) return Verdict::Undecided;
    const bool weak_max = std::ranges::any_of(
        active_, [](const Active& active) { return active.weak && active.owner == Player::Max; });
    if (weak_max) return Verdict::Undecided;

    result.outer_curvature = eigenvalues(schur_complement(h, max_rows), outer_basis).smallest;
    if (!outer_independent) return Verdict::Undecided;
    if (result.outer_curvature < -tolerance) return Verdict::NotLocalMinmax;
    if (result.outer_curvature < tolerance || result.weakly_active > 0) return Verdict::Undecided;
    return Verdict::LocalMinmax;
  }

  Problem& problem_;
  const Eigen::VectorXd v_;
  const DenseTolerances tolerances_;
  const DenseEvaluation evaluation_;
  std::vector<Eigen::Index> x_, y_;
  std::vector<Active> active_;
  double infeasibility_ = 0.0;
  double stationarity_ = 0.0;
};

}  // namespace

DenseOptimality dense_optimality(Problem& problem, std::span<const double> v,
                                 const Multipliers* given, const DenseTolerances& tolerances) {
  const Eigen::VectorXd point =
      Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  return DenseJudge(problem, point, tolerances).judge(given);
}

}  // namespace ipminmax::testing
