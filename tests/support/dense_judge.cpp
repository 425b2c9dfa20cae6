#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <Eigen/Dense>

#include <support/active_rows.hpp>
#include <support/dense_judge.hpp>

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

ExtendedModel::ExtendedModel(const Model& model)
    : model_(model), structure_(AutodiffProblem(model).structure()), sweeps_(model.shared_tape()) {
  for (std::size_t i = 0; i < model.variables(); ++i) {
    positions_.push_back(model.variable(i).position());
  }
}

ExtendedVector ExtendedModel::gradient_of(const Expression& e) {
  sweeps_.clear_seeds();
  sweeps_.seed(e, 1);
  sweeps_.back();
  return ExtendedVector::NullaryExpr(
      static_cast<Eigen::Index>(positions_.size()),
      [&](Eigen::Index i) { return sweeps_.adjoint(positions_[static_cast<std::size_t>(i)]); });
}

bool ExtendedModel::first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                          ExtendedMatrix& jacobian) {
  sweeps_.forward(std::span<const Extended>(v.data(), positions_.size()));
  gradient = gradient_of(model_.objective());
  const std::vector<Expression>& rows = model_.constraints();
  g.resize(static_cast<Eigen::Index>(rows.size()));
  jacobian.resize(g.size(), v.size());
  for (Eigen::Index j = 0; j < g.size(); ++j) {
    g[j] = sweeps_.value(rows[static_cast<std::size_t>(j)]);
    jacobian.row(j) = gradient_of(rows[static_cast<std::size_t>(j)]).transpose();
  }
  return gradient.allFinite() && g.allFinite() && jacobian.allFinite();
}

bool ExtendedModel::second(const ExtendedVector& v, const ExtendedVector& lambda,
                           ExtendedMatrix& hessian) {
  sweeps_.forward(std::span<const Extended>(v.data(), positions_.size()));
  hessian.resize(v.size(), v.size());
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    sweeps_.tangent(i);
    sweeps_.clear_seeds();
    sweeps_.seed(model_.objective(), 1);
    for (Eigen::Index j = 0; j < lambda.size(); ++j) {
      sweeps_.seed(model_.constraints()[static_cast<std::size_t>(j)], lambda[j]);
    }
    sweeps_.back_with_tangent();
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      hessian(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) =
          sweeps_.adjoint_tangent(positions_[k]);
    }
  }
  return hessian.allFinite();
}

bool ExtendedProblem::first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                            ExtendedMatrix& jacobian) {
  const DenseEvaluation here(problem_, v.cast<double>());
  gradient = here.gradient.cast<Extended>();
  g = here.constraints.cast<Extended>();
  jacobian = here.jacobian.cast<Extended>();
  return here.ok;
}

bool ExtendedProblem::second(const ExtendedVector& v, const ExtendedVector& lambda,
                             ExtendedMatrix& hessian) {
  hessian = dense_hessian(problem_, v.cast<double>(), 1.0, lambda.cast<double>()).cast<Extended>();
  return hessian.allFinite();
}

std::string_view verdict_name(Verdict verdict) {
  constexpr std::string_view kNames[] = {"NotFirstOrder", "LocalMinmax", "Undecided",
                                         "NotLocalMinmax"};
  return kNames[static_cast<std::size_t>(verdict)];
}

namespace {

constexpr Extended kInfinity = std::numeric_limits<Extended>::infinity();
constexpr int kRounds = 8;
constexpr int kNewtonSteps = 40;
constexpr Extended kZeroDistance = 1e-10L;  // relative to the bound
constexpr Extended kZeroMultiplier = 1e-9L;
constexpr Extended kRank = 1e-14L;
constexpr Extended kArrived = 1e-6L;
constexpr Extended kCreeping = 1e-12L;     // last step that is not rounding
constexpr Extended kCreepingRatio = 0.2L;  // of steps: 1/2 to a double zero, 2/3 to a triple
constexpr Extended kSingular = 1e-10L;     // of a Hessian whose diagonal is about one

ExtendedVector extended(std::span<const double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()))
      .cast<Extended>();
}

class PointJudge {
 public:
  PointJudge(ExtendedFunctions& functions, std::span<const double> v)
      : functions_(functions), v_(extended(v)), start_(v_) {
    const ProblemStructure& s = functions.structure();
    Places all(v.size());
    std::iota(all.begin(), all.end(), 0);
    for (const Row& row : rows_of(s, all, -1e19, 1e19, [](double, double) { return 0.0; })) {
      bounds_.push_back({row});
    }
    for (const Eigen::Index i : all) {
      (s.variable_players[static_cast<std::size_t>(i)] == Player::Min ? x_ : y_).push_back(i);
    }
  }

  DenseOptimality at_point(const Multipliers* given, const DenseTolerances& tolerances) {
    DenseOptimality found;
    if (!functions_.first(v_, gradient_, g_, jacobian_)) return found;
    find_active(tolerances, found);
    found.stationarity = static_cast<double>(given ? take(*given) : estimate());
    for (Bound& b : bounds_) {
      if (!b.active) continue;
      found.wrong_sign = std::max(found.wrong_sign, -static_cast<double>(pressing(b)));
      b.weak |= b.row.side != 0.0 && std::abs(b.multiplier) <= tolerances.multiplier;
    }
    const double allowed = tolerances.first_order * static_cast<double>(1 + max_norm(gradient_));
    const bool first_order = found.infeasibility <= allowed && found.stationarity <= allowed &&
                             found.wrong_sign <= allowed + tolerances.multiplier;
    if (first_order) found.verdict = second_order(found, &tolerances);
    return found;
  }

  DenseOptimality near_point(const Result& result) {
    DenseOptimality found;
    if (!functions_.first(v_, gradient_, g_, jacobian_)) return found;
    guess_active(result);
    for (int round = 0; round < kRounds; ++round) {
      if (!polish(found)) return found;
      if (!change_active_set()) break;
      if (round + 1 == kRounds) return found;
    }
    found.infeasibility = found.stationarity;
    found.moved = static_cast<double>(max_norm(v_ - start_));
    if (!signs_are_right()) return found;
    found.verdict = second_order(found, nullptr);
    // Newton's method creeps to a singular solution, and residuals are rounding long before it is
    // there.
    if (found.verdict == Verdict::LocalMinmax && creeps_) found.verdict = Verdict::Undecided;
    return found;
  }

 private:
  struct Bound {
    Row row;
    Extended multiplier = 0;  ///< as in grad f + sum multiplier grad = 0
    bool active = false;
    bool weak = false;
  };

  [[nodiscard]] Extended distance(const Bound& b) const { return b.row.distance(v_, g_); }
  /// Nonnegative for the right sign.
  [[nodiscard]] static Extended pressing(const Bound& b) { return b.row.wanted(b.multiplier); }
  [[nodiscard]] static Extended size(const Bound& b) { return 1 + std::abs(b.row.bound); }
  [[nodiscard]] ExtendedVector normal(const Bound& b) const {
    if (!b.row.is_variable) return jacobian_.row(b.row.index).transpose();
    return ExtendedVector::Unit(v_.size(), b.row.index);
  }

  // --- At the point ---------------------------------------------------------------------------
  void find_active(const DenseTolerances& tolerances, DenseOptimality& found) {
    found.infeasibility = 0.0;
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      Bound& b = bounds_[k];
      const auto to_bound = static_cast<double>(
          b.row.side == 0.0 ? -std::abs(b.row.value(v_, g_) - b.row.bound) : distance(b));
      found.infeasibility = std::max(found.infeasibility, -to_bound);
      b.active = b.row.side == 0.0 || to_bound <= tolerances.inactive;
      b.weak = b.row.side != 0.0 && to_bound > tolerances.active;
      // Of a narrow interval the nearer end.
      if (k == 0 || !b.active || !bounds_[k - 1].active) continue;
      Bound& other = bounds_[k - 1];
      if (other.row.is_variable != b.row.is_variable || other.row.index != b.row.index) continue;
      (distance(other) < distance(b) ? b : other).active = false;
    }
    for (Bound& b : bounds_) b.weak = b.weak && b.active;
  }

  /// Returns the largest entry of the Lagrangian's gradient.
  Extended estimate() {
    ExtendedMatrix normals = ExtendedMatrix::Zero(v_.size(), std::ssize(bounds_));
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      if (!bounds_[k].active || bounds_[k].weak) continue;
      normals.col(static_cast<Eigen::Index>(k)) = normal(bounds_[k]);
    }
    if (normals.size() == 0) return max_norm(gradient_);
    Eigen::CompleteOrthogonalDecomposition<ExtendedMatrix> qr;
    qr.setThreshold(std::numeric_limits<double>::epsilon() *
                    static_cast<double>(std::min(normals.rows(), normals.cols())));
    qr.compute(normals);
    const ExtendedVector multipliers = qr.solve(ExtendedVector(-gradient_));
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      bounds_[k].multiplier = multipliers[static_cast<Eigen::Index>(k)];
    }
    return max_norm(gradient_ + normals * multipliers);
  }
  Extended take(const Multipliers& given) {
    const Eigen::VectorXd z = given.z_upper - given.z_lower;
    for (Bound& b : bounds_) {
      b.multiplier = b.row.is_variable ? z[b.row.index] : given.lambda[b.row.index];
    }
    return max_norm(gradient_ + jacobian_.transpose() * given.lambda.cast<Extended>() +
                    z.cast<Extended>());
  }

  // --- Near the point -------------------------------------------------------------------------
  void guess_active(const Result& result) {
    for (Bound& b : bounds_) {
      const auto place = static_cast<std::size_t>(b.row.index);
      const bool equation = b.row.side == 0.0;
      if (b.row.is_variable) {
        b.multiplier = (b.row.side > 0.0 ? 0.0 : -result.z_lower[place]) +
                       (b.row.side < 0.0 ? 0.0 : result.z_upper[place]);
      } else if (equation || b.row.wanted(result.lambda[place]) > 0.0) {
        b.multiplier = result.lambda[place];
      }
      b.active = equation || (pressing(b) > std::max(distance(b), Extended{0}) &&
                              distance(b) < 1e-3L * size(b));
    }
  }

  [[nodiscard]] ExtendedVector row_multipliers() const {
    ExtendedVector lambda = ExtendedVector::Zero(g_.size());
    for (const Bound& b : bounds_) {
      if (!b.row.is_variable && b.active) lambda[b.row.index] += b.multiplier;
    }
    return lambda;
  }

  /// Newton's method for the equations of the active set, shortest steps where they are singular.
  bool polish(DenseOptimality& found) {
    std::vector<Bound*> active;
    for (Bound& b : bounds_) {
      if (b.active) active.push_back(&b);
    }
    const Eigen::Index n = v_.size(), m = std::ssize(active);
    ExtendedMatrix hessian, rows(m, n);
    Extended last = kInfinity, last_way = kInfinity;
    for (int step = 0;; ++step) {
      if (!functions_.first(v_, gradient_, g_, jacobian_) ||
          !functions_.second(v_, row_multipliers(), hessian)) {
        return false;
      }
      ExtendedVector rhs(n + m);
      rhs.head(n) = gradient_;
      Extended scale = 1 + max_norm(gradient_);
      for (Eigen::Index i = 0; i < m; ++i) {
        const Bound& b = *active[static_cast<std::size_t>(i)];
        rows.row(i) = normal(b).transpose();
        rhs.head(n) += b.multiplier * rows.row(i).transpose();
        rhs[n + i] = b.row.value(v_, g_) - b.row.bound;
        scale = std::max(scale, size(b));
      }
      if (n + m == 0) return true;
      const Extended residual = max_norm(rhs) / scale;
      found.stationarity = static_cast<double>(residual);
      const bool stalls = !(residual < last / 2);
      const bool done = (stalls && residual < 1e-13L) || residual < 1e-17L;
      if (!done && step == kNewtonSteps) return false;
      last = std::min(last, residual);
      const ExtendedVector d =
          solve_symmetric(kkt_matrix(hessian, rows), ExtendedVector(-rhs), 1, kRank);
      if (!d.allFinite()) return false;
      // Where the equations are singular, residuals vanish far from the solution.
      const Extended way = max_norm(d.head(n)), extent = 1 + max_norm(v_);
      creeps_ = way > kCreeping * extent && way > kCreepingRatio * last_way;
      last_way = way;
      if (done) return way <= kArrived * extent;
      v_ += d.head(n);
      for (Eigen::Index i = 0; i < m; ++i) {
        active[static_cast<std::size_t>(i)]->multiplier += d[n + i];
      }
    }
  }

  /// Takes violated bounds in and those that pull out.
  bool change_active_set() {
    bool changed = false;
    for (Bound& b : bounds_) {
      if (b.row.side == 0.0) continue;
      if (!b.active && distance(b) < -kZeroDistance * size(b)) {
        b.active = changed = true;
        b.multiplier = 0;
      } else if (b.active && pressing(b) < -kZeroMultiplier) {
        b.active = false;
        changed = true;
      }
    }
    return changed;
  }

  [[nodiscard]] bool signs_are_right() {
    for (Bound& b : bounds_) {
      if (b.row.side == 0.0) continue;
      if (distance(b) < -kZeroDistance * size(b)) return false;
      if (b.active && pressing(b) < -kZeroMultiplier) return false;
      b.weak = b.active ? pressing(b) < kZeroMultiplier : distance(b) < kZeroDistance * size(b);
    }
    return true;
  }

  // --- Curvature ------------------------------------------------------------------------------
  /// Of one player's strongly active bounds, or inward ones of the weakly active.
  [[nodiscard]] ExtendedMatrix normals(Player owner, bool weak) const {
    ExtendedMatrix rows(0, v_.size());
    for (const Bound& b : bounds_) {
      if (b.row.owner != owner || (weak ? !b.weak : !b.active || b.weak)) continue;
      rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
      rows.row(rows.rows() - 1) = (weak ? -b.row.side : 1.0) * normal(b).transpose();
    }
    return rows;
  }

  /// Least t'Ct of |t| = 1 over {t = basis u: rows t >= 0}: attained inside some face, where it is
  /// an eigenvalue.
  static Extended least_on_cone(const ExtendedMatrix& c, const ExtendedMatrix& rows) {
    constexpr Eigen::Index kMost = 12;
    const Eigen::Index k = std::min(rows.rows(), kMost);
    Extended least = kInfinity;
    for (std::uint32_t face = 0; face < (1U << k); ++face) {
      Places held;
      for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        if (i >= k || (face >> i & 1U) != 0) held.push_back(i);
      }
      bool unused = true;
      const ExtendedMatrix basis =
          null_space_of_directions(ExtendedMatrix(rows(held, Eigen::all)), unused);
      if (basis.cols() == 0) continue;
      const Eigen::SelfAdjointEigenSolver<ExtendedMatrix> eigen(basis.transpose() * c * basis);
      for (Eigen::Index e = 0; e < basis.cols(); ++e) {
        const ExtendedVector t = rows * (basis * eigen.eigenvectors().col(e));
        const Extended slack = 1e-12L;
        const bool inside = t.size() == 0 || t.minCoeff() >= -slack || t.maxCoeff() <= slack;
        if (inside) least = std::min(least, eigen.eigenvalues()[e]);
      }
    }
    return least;
  }

  /// On strong t = 0, weak t >= 0. at_start: with it a diagonal is scaled to about one, as what
  /// counts as size where curvature vanishes on the way to the solution; null: nothing is scaled.
  static Extended least_curvature(ExtendedMatrix c, const ExtendedMatrix* at_start,
                                  const ExtendedMatrix& strong, ExtendedMatrix weak,
                                  bool& independent) {
    // Which directions there are does not depend on what counts as length.
    ExtendedMatrix basis =
        at_start ? null_space_of_directions(strong, independent) : null_space(strong, independent);
    if (basis.cols() == 0) return kInfinity;
    if (at_start) {
      ExtendedVector d(c.rows());
      for (Eigen::Index i = 0; i < c.rows(); ++i) {
        const Extended size = Extended{1e-6L} * max_norm(c.row(i));
        const Extended own = std::max({std::abs(c(i, i)), std::abs((*at_start)(i, i)), size});
        d[i] = own > 0 ? 1 / std::sqrt(own) : 1;
      }
      c = d.asDiagonal() * c * d.asDiagonal();
      weak = weak * d.asDiagonal();
      const ExtendedMatrix scaled = d.cwiseInverse().asDiagonal() * basis;
      basis = Eigen::HouseholderQR<ExtendedMatrix>(scaled).householderQ() *
              ExtendedMatrix::Identity(scaled.rows(), scaled.cols());
    }
    return least_on_cone(basis.transpose() * c * basis, weak * basis);
  }

  /// tolerances: of a point that is no exact solution, where a weakly active bound may be strongly
  /// active or none, and dependent gradients mean that other multipliers may be right.
  Verdict second_order(DenseOptimality& found, const DenseTolerances* tolerances) {
    ExtendedMatrix h, before;
    if (!functions_.second(v_, row_multipliers(), h) ||
        !functions_.second(start_, row_multipliers(), before)) {
      return Verdict::NotFirstOrder;
    }
    bool max_is_weak = false;
    for (Bound& b : bounds_) {
      found.weakly_active += b.weak ? 1 : 0;
      max_is_weak = max_is_weak || (b.weak && b.row.owner == Player::Max);
      if (tolerances) b.weak = false;  // on the faces of all of them
    }
    const Extended zero = tolerances ? tolerances->curvature * (1 + max_norm(h)) : kSingular;
    const ExtendedMatrix max_strong = normals(Player::Max, false);
    const ExtendedMatrix max_weak = normals(Player::Max, true);
    ExtendedMatrix max_rows(max_strong.rows() + max_weak.rows(), v_.size());
    max_rows << max_strong, max_weak;
    const auto least = [&](const ExtendedMatrix& c, const Places& own, Player player,
                           bool& independent) {
      const ExtendedMatrix at_start = before(own, own);
      return least_curvature(c, tolerances ? nullptr : &at_start,
                             normals(player, false)(Eigen::all, own),
                             normals(player, true)(Eigen::all, own), independent);
    };
    bool max_independent = true, min_independent = true;
    const Extended inner = least(-h(y_, y_), y_, Player::Max, max_independent);
    const Extended outer =
        least(schur_complement(h, max_rows, x_, y_), x_, Player::Min, min_independent);
    found.inner_curvature = static_cast<double>(inner);
    found.outer_curvature = static_cast<double>(outer);
    found.independent = max_independent && min_independent;
    if (tolerances && !max_independent) return Verdict::Undecided;
    if (inner < -zero) return Verdict::NotLocalMinmax;
    if (inner < zero || (!max_independent && !x_.empty())) return Verdict::Undecided;
    if (tolerances && (max_is_weak || !min_independent)) return Verdict::Undecided;
    if (outer < -zero) return max_is_weak ? Verdict::Undecided : Verdict::NotLocalMinmax;
    if (outer < zero || (tolerances && found.weakly_active > 0)) return Verdict::Undecided;
    return Verdict::LocalMinmax;
  }

  ExtendedFunctions& functions_;
  Places x_, y_;
  bool creeps_ = false;  ///< Newton's method, at the end
  ExtendedVector v_, start_, gradient_, g_;
  ExtendedMatrix jacobian_;
  std::vector<Bound> bounds_;
};

}  // namespace

DenseOptimality dense_optimality(Problem& problem, std::span<const double> v,
                                 const Multipliers* given, const DenseTolerances& tolerances) {
  ExtendedProblem functions(problem);
  return PointJudge(functions, v).at_point(given, tolerances);
}

DenseOptimality optimality_near(ExtendedFunctions& functions, const Result& result) {
  return PointJudge(functions, result.v).near_point(result);
}

}  // namespace ipminmax::testing
