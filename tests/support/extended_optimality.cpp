#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>

#include <support/extended_optimality.hpp>

namespace ipminmax::testing {
namespace {

class ExtendedJudge {
 public:
  ExtendedJudge(ExtendedFunctions& functions, const Result& result)
      : functions_(functions), s_(functions.structure()), v_(extended(result.v)) {
    start_ = v_;
    lambda_ = extended(result.lambda);
    lower_ = extended(result.z_lower);
    upper_ = extended(result.z_upper);
  }

  ExtendedOptimality judge() {
    ExtendedOptimality found;
    if (!functions_.first(v_, gradient_, g_, jacobian_)) return found;
    collect();
    for (int round = 0; round < kRounds; ++round) {
      if (!polish(found)) return found;
      if (!change_active_set()) break;
      if (round + 1 == kRounds) return found;
    }
    if (v_.size() > 0) found.moved = (v_ - start_).cwiseAbs().maxCoeff();
    if (!signs_are_right()) return found;
    second_order(found);
    // Newton's method creeps to a singular solution, and residuals are rounding long before it is
    // there.
    if (found.verdict == ExtendedVerdict::Strict && creeps_) {
      found.verdict = ExtendedVerdict::Singular;
    }
    return found;
  }

 private:
  static constexpr int kRounds = 8;
  static constexpr int kNewtonSteps = 40;
  static constexpr Extended kActiveRatio = 1;        // multiplier over distance
  static constexpr Extended kZeroDistance = 1e-10L;  // relative to the bound
  static constexpr Extended kZeroMultiplier = 1e-9L;
  static constexpr Extended kRank = 1e-9L;
  static constexpr Extended kArrived = 1e-6L;
  static constexpr Extended kCreeping = 1e-12L;  // last step that is not rounding
  static constexpr Extended kCreepingRatio =
      0.2L;                                      // of steps: 1/2 to a double zero, 2/3 to a triple
  static constexpr Extended kSingular = 1e-10L;  // of a Hessian whose diagonal is about one

  struct Bound {
    Player owner = Player::Min;
    Eigen::Index row = -1, variable = -1;  ///< one of them
    Extended at = 0;
    int side = 0;             ///< -1 lower, +1 upper, 0 equality
    Extended multiplier = 0;  ///< as in grad f + sum multiplier grad = 0
    bool active = false;
    bool weak = false;
  };

  static ExtendedVector extended(const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data(),
                                             static_cast<Eigen::Index>(values.size()))
        .cast<Extended>();
  }
  static std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] Extended value(const Bound& b) const {
    return b.row >= 0 ? g_[b.row] : v_[b.variable];
  }
  [[nodiscard]] Extended distance(const Bound& b) const { return b.side * (b.at - value(b)); }
  /// Nonnegative for the right sign.
  [[nodiscard]] static Extended pressing(const Bound& b) {
    return b.side * b.multiplier * (b.owner == Player::Min ? 1 : -1);
  }
  [[nodiscard]] static Extended size(const Bound& b) { return 1 + std::abs(b.at); }
  [[nodiscard]] ExtendedVector normal(const Bound& b) const {
    if (b.row >= 0) return jacobian_.row(b.row).transpose();
    return ExtendedVector::Unit(v_.size(), b.variable);
  }

  void collect() {
    const auto add = [&](Bound b, double lower, double upper, Extended low, Extended up) {
      if (lower == upper) {
        b.at = lower, b.multiplier = low + up, b.active = true;
        bounds_.push_back(b);
        return;
      }
      const auto side = [&](double bound, int which, Extended multiplier) {
        if (std::abs(bound) >= 1e19) return;
        b.at = bound, b.side = which, b.multiplier = multiplier;
        b.active = pressing(b) > kActiveRatio * std::max(distance(b), Extended{0}) &&
                   distance(b) < 1e-3L * size(b);
        bounds_.push_back(b);
      };
      side(lower, -1, low);
      side(upper, 1, up);
    };
    for (Eigen::Index i = 0; i < v_.size(); ++i) {
      add({.owner = s_.variable_players[at(i)], .variable = i}, s_.variable_lower[at(i)],
          s_.variable_upper[at(i)], -lower_[i], upper_[i]);
    }
    for (Eigen::Index j = 0; j < g_.size(); ++j) {
      const Extended down = std::min(lambda_[j], Extended{0}), up = lambda_[j] - down;
      const bool max = s_.constraint_players[at(j)] == Player::Max;
      add({.owner = s_.constraint_players[at(j)], .row = j}, s_.constraint_lower[at(j)],
          s_.constraint_upper[at(j)], max ? up : down, max ? down : up);
    }
    for (Bound& b : bounds_) {
      if (b.row >= 0 && b.side == 0) b.multiplier = lambda_[b.row];
    }
  }

  [[nodiscard]] ExtendedVector row_multipliers() const {
    ExtendedVector lambda = ExtendedVector::Zero(g_.size());
    for (const Bound& b : bounds_) {
      if (b.row >= 0 && b.active) lambda[b.row] += b.multiplier;
    }
    return lambda;
  }

  /// Newton's method for the equations of the active set, shortest steps where they are singular.
  bool polish(ExtendedOptimality& found) {
    std::vector<Bound*> active;
    for (Bound& b : bounds_) {
      if (b.active) active.push_back(&b);
    }
    const Eigen::Index n = v_.size(), m = static_cast<Eigen::Index>(active.size());
    ExtendedMatrix hessian, k(n + m, n + m);
    Extended last = std::numeric_limits<Extended>::infinity(), last_way = last;
    for (int step = 0;; ++step) {
      if (!functions_.first(v_, gradient_, g_, jacobian_) ||
          !functions_.second(v_, row_multipliers(), hessian)) {
        return false;
      }
      ExtendedVector rhs(n + m);
      rhs.head(n) = gradient_;
      k.setZero();
      k.topLeftCorner(n, n) = hessian;
      Extended scale = 1 + (n > 0 ? gradient_.cwiseAbs().maxCoeff() : 0);
      for (Eigen::Index i = 0; i < m; ++i) {
        const ExtendedVector a = normal(*active[at(i)]);
        k.col(n + i).head(n) = a;
        k.row(n + i).head(n) = a.transpose();
        rhs.head(n) += active[at(i)]->multiplier * a;
        rhs[n + i] = value(*active[at(i)]) - active[at(i)]->at;
        scale = std::max(scale, 1 + std::abs(active[at(i)]->at));
      }
      if (n + m == 0) return true;
      const Extended residual = rhs.cwiseAbs().maxCoeff() / scale;
      found.residual = residual;
      const bool stalls = !(residual < last / 2);
      const bool done = (stalls && residual < 1e-13L) || residual < 1e-17L;
      if (!done && step == kNewtonSteps) return false;
      last = std::min(last, residual);
      ExtendedVector row_size = k.cwiseAbs().rowwise().maxCoeff();
      for (Extended& d : row_size) d = d > 0 ? 1 / std::sqrt(d) : 1;
      Eigen::CompleteOrthogonalDecomposition<ExtendedMatrix> qr;
      qr.setThreshold(1e-14L);
      qr.compute(row_size.asDiagonal() * k * row_size.asDiagonal());
      const ExtendedVector d =
          row_size.cwiseProduct(qr.solve(ExtendedVector(-row_size.cwiseProduct(rhs))));
      if (!d.allFinite()) return false;
      // Where the equations are singular, residuals vanish far from the solution.
      const Extended way = n > 0 ? d.head(n).cwiseAbs().maxCoeff() : 0;
      const Extended extent = 1 + (n > 0 ? v_.cwiseAbs().maxCoeff() : 0);
      creeps_ = way > kCreeping * extent && way > kCreepingRatio * last_way;
      last_way = way;
      if (done) return way <= kArrived * extent;
      v_ += d.head(n);
      for (Eigen::Index i = 0; i < m; ++i) active[at(i)]->multiplier += d[n + i];
    }
  }

  /// Takes violated bounds in and those that pull out.
  bool change_active_set() {
    bool changed = false;
    for (Bound& b : bounds_) {
      if (b.side == 0) continue;
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
      if (b.side == 0) continue;
      if (distance(b) < -kZeroDistance * size(b)) return false;
      if (b.active && pressing(b) < -kZeroMultiplier) return false;
      b.weak = b.active ? pressing(b) < kZeroMultiplier : distance(b) < kZeroDistance * size(b);
    }
    return true;
  }

  [[nodiscard]] ExtendedMatrix normals(Player owner, bool weak) const {
    std::vector<ExtendedVector> rows;
    for (const Bound& b : bounds_) {
      const bool wanted = weak ? b.weak : b.active && !b.weak;
      if (wanted && b.owner == owner) {
        ExtendedVector a = normal(b);
        if (weak) a *= -b.side;  // inward
        rows.push_back(a);
      }
    }
    ExtendedMatrix matrix(static_cast<Eigen::Index>(rows.size()), v_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      matrix.row(static_cast<Eigen::Index>(i)) = rows[i].transpose();
    }
    return matrix;
  }

  /// Orthonormal columns with rows * columns = 0.
  static ExtendedMatrix null_space(const ExtendedMatrix& rows, bool& independent) {
    const Eigen::Index n = rows.cols();
    if (rows.rows() == 0) return ExtendedMatrix::Identity(n, n);
    ExtendedMatrix scaled = rows;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const Extended norm = rows.row(i).norm();
      if (norm > 0) scaled.row(i) /= norm;
    }
    if (n == 0) return ExtendedMatrix(0, 0);
    Eigen::ColPivHouseholderQR<ExtendedMatrix> qr;
    qr.setThreshold(kRank);
    qr.compute(scaled.transpose());
    independent = independent && qr.rank() == rows.rows();
    return ExtendedMatrix(qr.householderQ()).rightCols(n - qr.rank());
  }

  /// Least t'Ct of |t| = 1 over {t = basis u: rows t >= 0}: attained inside some face, where it is
  /// an eigenvalue.
  static Extended least_on_cone(const ExtendedMatrix& c, const ExtendedMatrix& rows) {
    constexpr Eigen::Index kMost = 12;
    const Eigen::Index k = std::min(rows.rows(), kMost);
    Extended least = std::numeric_limits<Extended>::infinity();
    for (std::uint32_t face = 0; face < (1U << k); ++face) {
      ExtendedMatrix held(0, c.cols());
      for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        if (i < k && (face >> i & 1U) == 0) continue;
        held.conservativeResize(held.rows() + 1, Eigen::NoChange);
        held.row(held.rows() - 1) = rows.row(i);
      }
      bool unused = true;
      const ExtendedMatrix basis = null_space(held, unused);
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

  [[nodiscard]] std::vector<Eigen::Index> owned(Player player) const {
    std::vector<Eigen::Index> variables;
    for (Eigen::Index i = 0; i < v_.size(); ++i) {
      if (s_.variable_players[at(i)] == player) variables.push_back(i);
    }
    return variables;
  }

  /// Scales a symmetric matrix and its tangent space to a diagonal of about one.
  /// at_start: what counts as size where the curvature vanishes on the way to the solution.
  static Extended least_curvature(ExtendedMatrix c, const ExtendedMatrix& at_start,
                                  const ExtendedMatrix& strong, ExtendedMatrix weak,
                                  bool& independent) {
    // Which directions there are does not depend on what counts as length.
    const ExtendedMatrix directions = null_space(strong, independent);
    if (directions.cols() == 0) return std::numeric_limits<Extended>::infinity();
    ExtendedVector d(c.rows());
    for (Eigen::Index i = 0; i < c.rows(); ++i) {
      const Extended size = Extended{1e-6L} * c.row(i).cwiseAbs().maxCoeff();
      const Extended own = std::max({std::abs(c(i, i)), std::abs(at_start(i, i)), size});
      d[i] = own > 0 ? 1 / std::sqrt(own) : 1;
    }
    c = d.asDiagonal() * c * d.asDiagonal();
    weak = weak * d.asDiagonal();
    const ExtendedMatrix scaled = d.cwiseInverse().asDiagonal() * directions;
    const ExtendedMatrix basis = Eigen::HouseholderQR<ExtendedMatrix>(scaled).householderQ() *
                                 ExtendedMatrix::Identity(scaled.rows(), scaled.cols());
    return least_on_cone(basis.transpose() * c * basis, weak * basis);
  }

  void second_order(ExtendedOptimality& found) {
    ExtendedMatrix h, before;
    if (!functions_.second(v_, row_multipliers(), h) ||
        !functions_.second(start_, row_multipliers(), before)) {
      return;
    }
    const auto x = owned(Player::Min), y = owned(Player::Max);
    for (const Bound& b : bounds_) found.weak += b.weak ? 1 : 0;
    const ExtendedMatrix max_strong = normals(Player::Max, false);
    const ExtendedMatrix max_weak = normals(Player::Max, true);
    bool max_independent = true, min_independent = true;
    const Extended inner = least_curvature(-h(y, y), before(y, y), max_strong(Eigen::all, y),
                                           max_weak(Eigen::all, y), max_independent);
    const ExtendedMatrix outer_h = phi_hessian(h, x, y, max_strong, max_weak);
    const Extended outer =
        least_curvature(outer_h, before(x, x), normals(Player::Min, false)(Eigen::all, x),
                        normals(Player::Min, true)(Eigen::all, x), min_independent);
    found.curvature = std::min(inner, outer);
    found.independent = max_independent && min_independent;
    if (inner < -kSingular) {
      found.verdict = ExtendedVerdict::Wrong;
    } else if (!max_independent && !x.empty()) {
      found.verdict = ExtendedVerdict::Dependent;
    } else if (inner < kSingular) {
      found.verdict = ExtendedVerdict::Singular;
    } else if (outer < -kSingular) {
      found.verdict = max_weak.rows() > 0 ? ExtendedVerdict::Dependent : ExtendedVerdict::Wrong;
    } else {
      found.verdict = outer < kSingular ? ExtendedVerdict::Singular : ExtendedVerdict::Strict;
    }
  }

  /// Of L(x, y(x)), y following on the face of all of Max's active constraints.
  [[nodiscard]] static ExtendedMatrix phi_hessian(const ExtendedMatrix& h,
                                                  const std::vector<Eigen::Index>& x,
                                                  const std::vector<Eigen::Index>& y,
                                                  const ExtendedMatrix& strong,
                                                  const ExtendedMatrix& weak) {
    const auto ny = static_cast<Eigen::Index>(y.size());
    ExtendedMatrix rows(strong.rows() + weak.rows(), h.cols());
    rows << strong, weak;
    const Eigen::Index k = rows.rows();
    if (ny + k == 0 || x.empty()) return h(x, x);
    ExtendedMatrix inner = ExtendedMatrix::Zero(ny + k, ny + k);
    inner.topLeftCorner(ny, ny) = h(y, y);
    inner.bottomLeftCorner(k, ny) = rows(Eigen::all, y);
    inner.topRightCorner(ny, k) = inner.bottomLeftCorner(k, ny).transpose();
    ExtendedMatrix coupling(ny + k, h(x, x).cols());
    coupling.topRows(ny) = h(y, x);
    coupling.bottomRows(k) = rows(Eigen::all, x);
    return h(x, x) - coupling.transpose() * inner.fullPivLu().solve(coupling);
  }

  ExtendedFunctions& functions_;
  const ProblemStructure& s_;
  bool creeps_ = false;  ///< Newton's method, at the end
  ExtendedVector v_, start_, lambda_, lower_, upper_;
  ExtendedVector gradient_, g_;
  ExtendedMatrix jacobian_;
  std::vector<Bound> bounds_;
};

}  // namespace

ExtendedOptimality extended_optimality(ExtendedFunctions& functions, const Result& result) {
  return ExtendedJudge(functions, result).judge();
}

}  // namespace ipminmax::testing
