#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>

#include "core/problem.hpp"
#include "core/result.hpp"

/// Second-order conditions by dense linear algebra in extended precision, at the solution of the
/// active set's equations near a returned point. Shares no code with the library, for judging its
/// verdicts.
namespace ipminmax::testing {

using Extended = long double;
using ExtendedVector = Eigen::Matrix<Extended, Eigen::Dynamic, 1>;
using ExtendedMatrix = Eigen::Matrix<Extended, Eigen::Dynamic, Eigen::Dynamic>;

/// f and g with first derivatives, and the Hessian of f + lambda' g.
class ExtendedFunctions {
 public:
  virtual ~ExtendedFunctions() = default;
  [[nodiscard]] virtual const ProblemStructure& structure() const = 0;
  /// False where undefined.
  [[nodiscard]] virtual bool first(const ExtendedVector& v, ExtendedVector& gradient,
                                   ExtendedVector& g, ExtendedMatrix& jacobian) = 0;
  [[nodiscard]] virtual bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                                    ExtendedMatrix& hessian) = 0;
};

/// The formulas of a Model, swept in extended precision.
class ExtendedModel final : public ExtendedFunctions {
 public:
  explicit ExtendedModel(const Model& model)
      : tape_(model.tape_),
        objective_(model.objective_),
        constraints_(model.constraints_),
        structure_(AutodiffProblem(model).structure()) {}

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                           ExtendedMatrix& jacobian) override {
    sweep(v);
    gradient = adjoint_of(objective_, v.size());
    g.resize(rows());
    jacobian.resize(rows(), v.size());
    for (Eigen::Index j = 0; j < rows(); ++j) {
      const Expression& row = constraints_[static_cast<std::size_t>(j)];
      g[j] = row.is_constant() ? Extended{row.constant()} : value_[row.position()];
      jacobian.row(j) = adjoint_of(row, v.size()).transpose();
    }
    return gradient.allFinite() && g.allFinite() && jacobian.allFinite();
  }

  [[nodiscard]] bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                            ExtendedMatrix& hessian) override {
    sweep(v);
    hessian.resize(v.size(), v.size());
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      hessian.col(i) = second_adjoint(lambda, i, v.size());
    }
    return hessian.allFinite();
  }

 private:
  struct Partial {
    Extended a = 0, b = 0, aa = 0, ab = 0;
  };
  [[nodiscard]] Eigen::Index rows() const { return static_cast<Eigen::Index>(constraints_.size()); }

  void sweep(const ExtendedVector& v) {
    value_.assign(tape_->size(), 0);
    partial_.assign(tape_->size(), {});
    for (std::size_t k = 0; k < tape_->size(); ++k) {
      const Operation& o = (*tape_)[k];
      const Extended a =
          o.kind == Operation::Kind::Variable ? v[static_cast<Eigen::Index>(o.a)] : value_[o.a];
      const Extended b = o.has_two_operands() ? value_[o.b] : 0;
      apply(o, a, b, value_[k], partial_[k]);
    }
  }
  static void apply(const Operation& o, Extended a, Extended b, Extended& value, Partial& p) {
    const Extended c = o.c;
    switch (o.kind) {
      case Operation::Kind::Variable:
        value = a;
        break;
      case Operation::Kind::Shift:
        value = a + c, p = {1};
        break;
      case Operation::Kind::Scale:
        value = c * a, p = {c};
        break;
      case Operation::Kind::Reciprocal:
        value = c / a, p = {-c / (a * a), 0, 2 * c / (a * a * a)};
        break;
      case Operation::Kind::Power:
        value = std::pow(a, c);
        p = {c * std::pow(a, c - 1), 0, c == 1 ? 0 : c * (c - 1) * std::pow(a, c - 2)};
        break;
      case Operation::Kind::Exp:
        value = std::exp(a), p = {value, 0, value};
        break;
      case Operation::Kind::Log:
        value = std::log(a), p = {1 / a, 0, -1 / (a * a)};
        break;
      case Operation::Kind::Sin:
        value = std::sin(a), p = {std::cos(a), 0, -value};
        break;
      case Operation::Kind::Cos:
        value = std::cos(a), p = {-std::sin(a), 0, -value};
        break;
      case Operation::Kind::Add:
        value = a + b, p = {1, 1};
        break;
      case Operation::Kind::Multiply:
        value = a * b, p = {b, a, 0, 1};
        break;
    }
  }

  /// Puts the adjoints of the variables together.
  [[nodiscard]] ExtendedVector collect(const std::vector<Extended>& adjoint, Eigen::Index n) const {
    ExtendedVector sum = ExtendedVector::Zero(n);
    for (std::size_t k = 0; k < tape_->size(); ++k) {
      if ((*tape_)[k].kind == Operation::Kind::Variable) {
        sum[static_cast<Eigen::Index>((*tape_)[k].a)] += adjoint[k];
      }
    }
    return sum;
  }
  [[nodiscard]] ExtendedVector adjoint_of(const Expression& e, Eigen::Index n) const {
    std::vector<Extended> adjoint(tape_->size(), 0);
    if (!e.is_constant()) adjoint[e.position()] = 1;
    for (std::size_t k = tape_->size(); k-- > 0;) {
      const Operation& o = (*tape_)[k];
      if (o.kind == Operation::Kind::Variable || adjoint[k] == 0) continue;
      adjoint[o.a] += partial_[k].a * adjoint[k];
      if (o.has_two_operands()) adjoint[o.b] += partial_[k].b * adjoint[k];
    }
    return collect(adjoint, n);
  }
  [[nodiscard]] ExtendedVector second_adjoint(const ExtendedVector& lambda, Eigen::Index direction,
                                              Eigen::Index n) const {
    const std::size_t size = tape_->size();
    std::vector<Extended> tangent(size, 0), adjoint(size, 0), slope(size, 0);
    for (std::size_t k = 0; k < size; ++k) {
      const Operation& o = (*tape_)[k];
      if (o.kind == Operation::Kind::Variable) {
        tangent[k] = static_cast<Eigen::Index>(o.a) == direction ? 1 : 0;
        continue;
      }
      tangent[k] = partial_[k].a * tangent[o.a];
      if (o.has_two_operands()) tangent[k] += partial_[k].b * tangent[o.b];
    }
    if (!objective_.is_constant()) adjoint[objective_.position()] += 1;
    for (Eigen::Index j = 0; j < rows(); ++j) {
      const Expression& row = constraints_[static_cast<std::size_t>(j)];
      if (!row.is_constant()) adjoint[row.position()] += lambda[j];
    }
    for (std::size_t k = size; k-- > 0;) {
      const Operation& o = (*tape_)[k];
      if (o.kind == Operation::Kind::Variable) continue;
      const Partial& p = partial_[k];
      Extended da = p.aa * tangent[o.a];
      if (o.has_two_operands()) {
        da += p.ab * tangent[o.b];
        adjoint[o.b] += p.b * adjoint[k];
        slope[o.b] += p.b * slope[k] + p.ab * tangent[o.a] * adjoint[k];
      }
      adjoint[o.a] += p.a * adjoint[k];
      slope[o.a] += p.a * slope[k] + da * adjoint[k];
    }
    return collect(slope, n);
  }

  std::shared_ptr<const Tape> tape_;
  Expression objective_;
  std::vector<Expression> constraints_;
  ProblemStructure structure_;
  std::vector<Extended> value_;
  std::vector<Partial> partial_;
};

/// Functions known in double precision only.
class ExtendedProblem final : public ExtendedFunctions {
 public:
  explicit ExtendedProblem(Problem& problem) : problem_(problem) {}
  [[nodiscard]] const ProblemStructure& structure() const override { return problem_.structure(); }

  [[nodiscard]] bool first(const ExtendedVector& v, ExtendedVector& gradient, ExtendedVector& g,
                           ExtendedMatrix& jacobian) override {
    const ProblemStructure& s = structure();
    const std::vector<double> at = rounded(v);
    std::vector<double> slope(at.size()), rows(s.constraint_lower.size());
    std::vector<double> values(s.jacobian.size());
    if (!problem_.gradient(at, true, slope) || !problem_.constraints(at, true, rows) ||
        !problem_.jacobian(at, true, values)) {
      return false;
    }
    const auto m = static_cast<Eigen::Index>(rows.size());
    gradient = Eigen::Map<const Eigen::VectorXd>(slope.data(), v.size()).cast<Extended>();
    g = Eigen::Map<const Eigen::VectorXd>(rows.data(), m).cast<Extended>();
    jacobian.setZero(m, v.size());
    for (std::size_t k = 0; k < values.size(); ++k) {
      jacobian(s.jacobian[k].row, s.jacobian[k].col) += values[k];
    }
    return true;
  }
  [[nodiscard]] bool second(const ExtendedVector& v, const ExtendedVector& lambda,
                            ExtendedMatrix& hessian) override {
    const ProblemStructure& s = structure();
    std::vector<double> values(s.hessian.size());
    if (!problem_.hessian(rounded(v), true, 1.0, rounded(lambda), true, values)) return false;
    hessian.setZero(v.size(), v.size());
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, col] = s.hessian[k];
      hessian(row, col) += values[k];
      if (row != col) hessian(col, row) += values[k];
    }
    return true;
  }

 private:
  static std::vector<double> rounded(const ExtendedVector& v) {
    std::vector<double> values(static_cast<std::size_t>(v.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<double>(v[static_cast<Eigen::Index>(i)]);
    }
    return values;
  }
  Problem& problem_;
};

enum class ExtendedVerdict : std::uint8_t {
  NoSolution,  ///< Newton's method finds none near, or its signs are wrong
  Strict,      ///< second-order sufficient conditions
  Dependent,   ///< of Max: dependent gradients, or his weakly active bounds decide
  Singular,    ///< curvature zero, as far as can be seen
  Wrong,       ///< a direction of wrong curvature
};
[[nodiscard]] inline std::string_view name_of(ExtendedVerdict verdict) {
  constexpr std::string_view kNames[] = {"no solution", "strict", "dependent", "singular", "wrong"};
  return kNames[static_cast<std::size_t>(verdict)];
}

struct ExtendedOptimality {
  ExtendedVerdict verdict = ExtendedVerdict::NoSolution;
  Extended residual = 0;  ///< of the equations
  Extended moved = 0;     ///< longest entry of the way from the returned point
  Extended curvature =
      0;         ///< least of Min's (of phi) and, negated, of Max's; of a diagonal of ones
  int weak = 0;  ///< active with multiplier zero
  bool independent = true;  ///< all active gradients of each player
};

/// The check at one returned point.
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

}  // namespace ipminmax::testing
