#include "core/proof/local_minmax.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "core/formulas/interval.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/parameters.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Free and bounded variables that a proof is tried for: its cost grows with their cube.
constexpr std::size_t kMostVariables = 200;
/// Of the largest curvature: below, a variable's own is none.
constexpr double kFlat = 1e-10;

using Eigen::MatrixXd;
using Eigen::VectorXd;

Eigen::Index of(std::size_t i) { return static_cast<Eigen::Index>(i); }

[[noreturn]] void fail(const std::string& why) { throw std::domain_error(why); }

/// Numbers within `radius` of `middle`.
struct Enclosure {
  MatrixXd middle, radius;
  Enclosure(std::size_t rows, std::size_t cols)
      : middle(MatrixXd::Zero(of(rows), of(cols))), radius(middle) {}
  void set(std::size_t i, std::size_t j, const Interval& a) {
    const double m = a.middle();
    const Interval d = a - m;
    middle(of(i), of(j)) = m;
    radius(of(i), of(j)) = d.magnitude();
  }
};

/// A bound of one variable or constraint that holds with equality.
struct Active {
  std::size_t index;
  double bound;
  double sign;        ///< that its multiplier must have strictly; 0: any
  double next = 0.0;  ///< the number beside a variable's bound
};

/// The equations F(w) on a choice of active bounds and constraints.
class Equations {
 public:
  struct Values {
    Enclosure k, f;
    std::vector<Interval> slopes;  ///< of L along held(): z_lower - z_upper
    std::vector<Interval> g;       ///< m
  };

  Equations(const BoxFunctions& functions, double sigma, std::vector<double> v, std::size_t m,
            const std::function<bool()>& go_on)
      : functions_(functions), sigma_(sigma), v_(v.begin(), v.end()), g_(m), go_on_(go_on) {}

  std::vector<std::size_t> free;
  std::vector<Active> held, rows;

  [[nodiscard]] std::size_t size() const { return free.size() + rows.size(); }
  /// sign 0: of a variable that is fixed. inward: where other variables have their values.
  void hold(std::size_t variable, double bound, double sign = 0.0, double inward = 0.0) {
    v_[variable] = IntervalJet(bound);
    if (sign != 0.0) held.push_back({variable, bound, sign, std::nextafter(bound, inward)});
  }

  /// w: size(). Derivatives along pairs of blocks of variables: as many directions as a jet has.
  [[nodiscard]] Values evaluate(const std::vector<Interval>& w) {
    constexpr std::size_t kBlock = IntervalJet::kMostDirections / 2;
    std::vector<std::pair<std::size_t, Interval>> moving;
    for (const auto i : indices(free)) moving.emplace_back(free[i], w[i]);
    // Next to the bound, too: at a kink in a corner derivatives at the point alone are no one's.
    for (const Active& bound : held) {
      moving.emplace_back(bound.index, Interval(std::min(bound.bound, bound.next),
                                                std::max(bound.bound, bound.next)));
    }
    for (const auto& [variable, value] : moving) v_[variable] = IntervalJet(value);
    Values values{Enclosure(size(), size()), Enclosure(size(), 1),
                  std::vector<Interval>(held.size()), std::vector<Interval>(g_.size())};
    const std::size_t blocks = std::max<std::size_t>((moving.size() + kBlock - 1) / kBlock, 1);
    for (std::size_t a = 0; a < blocks; ++a) {
      for (std::size_t b = blocks > 1 ? a + 1 : a; b < blocks; ++b) {
        if (!go_on_()) fail("cut short");
        std::vector<std::size_t> along;
        const auto append = [&](std::size_t block) {
          const std::size_t end = std::min((block + 1) * kBlock, moving.size());
          for (std::size_t i = block * kBlock; i < end; ++i) along.push_back(i);
        };
        append(a);
        if (b != a) append(b);
        evaluate_along(along, moving, w, values);
      }
    }
    for (const auto k : indices(rows)) {
      values.f.set(free.size() + k, 0, values.g[rows[k].index] - rows[k].bound);
    }
    return values;
  }

 private:
  void evaluate_along(const std::vector<std::size_t>& along,
                      const std::vector<std::pair<std::size_t, Interval>>& moving,
                      const std::vector<Interval>& w, Values& values) {
    for (const auto d : indices(along)) {
      const auto& [variable, value] = moving[along[d]];
      v_[variable] = {value, d, along.size()};
    }
    IntervalJet lagrangian = IntervalJet(sigma_) * functions_.objective_over(v_);
    if (!g_.empty()) functions_.constraints_over(v_, g_);
    for (const auto k : indices(rows)) {
      lagrangian += IntervalJet(w[free.size() + k]) * g_[rows[k].index];
    }
    for (const auto d : indices(along)) {
      const std::size_t i = along[d];
      v_[moving[i].first] = IntervalJet(moving[i].second);
      if (i >= free.size()) {
        values.slopes[i - free.size()] = lagrangian.gradient(d);
        continue;
      }
      values.f.set(i, 0, lagrangian.gradient(d));
      for (std::size_t e = 0; e <= d; ++e) {
        if (along[e] >= free.size()) continue;
        values.k.set(i, along[e], lagrangian.hessian(d, e));
        values.k.set(along[e], i, lagrangian.hessian(d, e));
      }
      for (const auto k : indices(rows)) {
        const Interval& slope = g_[rows[k].index].gradient(d);
        values.k.set(i, free.size() + k, slope);
        values.k.set(free.size() + k, i, slope);
      }
    }
    for (const auto j : indices(g_)) values.g[j] = g_[j].value();
  }

  const BoxFunctions& functions_;
  double sigma_;
  std::vector<IntervalJet> v_, g_;
  const std::function<bool()>& go_on_;
};

/// Q and S with Q' K Q ~ S.
struct Congruence {
  MatrixXd q;
  VectorXd s;

  explicit Congruence(const MatrixXd& k) {
    VectorXd scale = VectorXd::Ones(k.rows());
    for (int round = 0; round < 10; ++round) {  // Ruiz: entries of size one
      const MatrixXd scaled = scale.asDiagonal() * k * scale.asDiagonal();
      for (Eigen::Index i = 0; i < k.rows(); ++i) {
        const double most = scaled.row(i).cwiseAbs().maxCoeff();
        if (!(most > 0.0) || !std::isfinite(most)) fail("K is singular");
        scale[i] /= std::sqrt(most);
      }
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scale.asDiagonal() * k *
                                                        scale.asDiagonal());
    const VectorXd& values = eigen.eigenvalues();
    if (!(values.cwiseAbs().minCoeff() > 0.0)) fail("K is singular");
    q = scale.asDiagonal() * eigen.eigenvectors() *
        values.cwiseAbs().cwiseSqrt().cwiseInverse().asDiagonal();
    s = values.cwiseSign();
  }

  /// |Q' K Q - S| in the maximum norm, at most: the middle's rounding, by the usual bound for sums
  /// of products in any order, counts as radius.
  [[nodiscard]] double error(const Enclosure& k) const {
    if (!k.middle.allFinite() || !k.radius.allFinite()) return kInfinity;
    const MatrixXd size = q.cwiseAbs();
    const double gamma = (2.0 * static_cast<double>(k.middle.rows()) + 16.0) * kEpsilon;
    MatrixXd e = (q.transpose() * k.middle * q - MatrixXd(s.asDiagonal())).cwiseAbs();
    e += size.transpose() * (k.radius + gamma * k.middle.cwiseAbs()) * size;
    return e.rowwise().sum().maxCoeff() * (1.0 + gamma) + gamma;
  }
  /// |Q' f|, at most.
  [[nodiscard]] double size_of(const Enclosure& f) const {
    if (!f.middle.allFinite() || !f.radius.allFinite()) return kInfinity;
    const double gamma = (2.0 * static_cast<double>(q.rows()) + 16.0) * kEpsilon;
    const MatrixXd most = (q.transpose() * f.middle).cwiseAbs() +
                          q.cwiseAbs().transpose() * (f.radius + gamma * f.middle.cwiseAbs());
    return most.maxCoeff() * (1.0 + gamma);
  }
  [[nodiscard]] bool has_positive(std::size_t expected) const {
    return static_cast<std::size_t>((s.array() > 0.0).count()) == expected;
  }
};

class LocalProof {
 public:
  LocalProof(Problem& problem, const SolverOptions& options, const std::function<bool()>& go_on,
             const Result& result)
      : s_(problem.structure()),
        options_(options),
        result_(result),
        functions_(*problem.over_boxes()),
        sigma_(result.objective_scale < 0.0 ? -1.0 : 1.0),
        determined_(functions_.determined()),
        ranges_(s_),
        equations_(functions_, sigma_, result.v, s_.constraint_lower.size(), go_on) {
    ranges_.see(result.v);
    if (const auto start = model_start(problem)) ranges_.see(*start);
  }

  /// Largest difference between a variable of the result and the proved point's.
  double run() {
    choose_active();
    if (equations_.size() == 0) return check(equations_.evaluate({}), {});
    const std::vector<double> w = newton();
    const std::vector<Interval> point(w.begin(), w.end());
    const Equations::Values at_point = equations_.evaluate(point);
    const Congruence full(at_point.k.middle);
    const double residual = full.size_of(at_point.f);
    if (!std::isfinite(residual)) fail("the formulas are not finite at the point");
    double tau = std::max(2.0 * residual, 1e-200);
    // More than one radius only where |E| is between 1/2 and 1.
    constexpr int kRadii = 4;
    for (int k = 0; k < kRadii; ++k) {
      const std::vector<Interval> ball = around(w, full.q, tau);
      const Equations::Values over = equations_.evaluate(ball);
      const double error = full.error(over.k);
      if (!(error < 1.0)) {
        fail("the derivatives change by more than the least curvature near the point");
      }
      if (residual + error * tau < tau) {
        check_inertias(full, over);
        return check(over, ball);
      }
      tau = 2.0 * residual / (1.0 - error);
    }
    fail("no ball around the point is mapped into itself");
  }

 private:
  [[nodiscard]] bool is_max(Player player) const { return player == Player::Max; }
  [[nodiscard]] double lower(double bound) const {
    return bound <= options_.nlp_lower_bound_inf ? -kInfinity : bound;
  }
  [[nodiscard]] double upper(double bound) const {
    return bound >= options_.nlp_upper_bound_inf ? kInfinity : bound;
  }

  /// Bounds and rows whose multiplier is large beside the distance to them, both measured with the
  /// curvature there. A wrong choice proves nothing.
  void choose_active() {
    const std::size_t n = s_.variable_lower.size(), m = s_.constraint_lower.size();
    std::vector<bool> computed(n), defining(m);
    for (const Index i : determined_.variables) computed[at(i)] = true;
    for (const Index j : determined_.constraints) defining[at(j)] = true;
    std::vector<std::size_t> moving;
    for (std::size_t i = 0; i < n; ++i) {
      if (computed[i]) continue;
      if (s_.variable_lower[i] == s_.variable_upper[i]) {
        equations_.hold(i, s_.variable_lower[i]);
        farthest_ = std::max(farthest_, std::abs(result_.v[i] - s_.variable_lower[i]));
      } else {
        moving.push_back(i);
      }
    }
    if (moving.size() > kMostVariables) {
      fail(std::to_string(moving.size()) + " variables, " + std::to_string(kMostVariables) +
           " at most are tried");
    }
    std::vector<Active> every_row;
    for (std::size_t j = 0; j < m; ++j) {
      if (!defining[j]) every_row.push_back({j, 0.0, 0.0});
    }
    equations_.free = moving;
    equations_.rows = every_row;
    const MatrixXd k = equations_.evaluate(returned()).k.middle;
    const double largest = k.topLeftCorner(of(moving.size()), of(moving.size())).diagonal().norm();
    const auto curvature = [&](std::size_t i) {  // 0: rounding, nothing to measure with
      const double own = std::abs(k(of(i), of(i)));
      return own > kFlat * largest ? own : 0.0;
    };
    equations_.free.clear();
    equations_.rows.clear();
    for (const auto i : indices(moving)) choose_bound(moving[i], curvature(i));
    for (const auto r : indices(every_row)) {
      double most = 0.0, slope = 0.0;
      for (const auto i : indices(moving)) {
        most = std::max(most, curvature(i));
        slope = std::max(slope, std::abs(k(of(moving.size() + r), of(i))));
      }
      if (slope > 0.0) choose_row(every_row[r].index, most / (slope * slope));
    }
  }

  /// Of a value with multipliers of its bounds: -1, the lower one is active, or 1, the upper one;
  /// 0: neither exceeds the distance times what that costs.
  static int active_side(double low, double high, double value, double at_low, double at_high,
                         double curvature) {
    const auto holds = [&](double multiplier, double distance) {
      return std::isfinite(distance) &&
             std::abs(multiplier) > (curvature > 0.0 ? curvature : 1.0) * std::max(distance, 0.0);
    };
    if (holds(at_low, value - low)) return -1;
    return holds(at_high, high - value) ? 1 : 0;
  }

  void choose_bound(std::size_t i, double curvature) {
    const double low = lower(s_.variable_lower[i]), high = upper(s_.variable_upper[i]);
    const double sign = is_max(s_.variable_players[i]) ? -1.0 : 1.0;
    const int side =
        active_side(low, high, result_.v[i], result_.z_lower[i], result_.z_upper[i], curvature);
    if (side == 0) return equations_.free.push_back(i);
    equations_.hold(i, side < 0 ? low : high, -side * sign, side < 0 ? high : low);
  }

  void choose_row(std::size_t j, double per_distance) {
    const double low = lower(s_.constraint_lower[j]), high = upper(s_.constraint_upper[j]);
    const double sign = is_max(s_.constraint_players[j]) ? -1.0 : 1.0;
    const double lambda = sigma_ * sign * result_.lambda[j];
    const int side = low == high
                         ? 0
                         : active_side(low, high, result_.constraints[j], std::min(lambda, 0.0),
                                       std::max(lambda, 0.0), per_distance);
    if (side == 0 && low < high) return;
    equations_.rows.push_back({j, side > 0 ? high : low, side * sign});
  }

  /// w of the result, for the present choice.
  [[nodiscard]] std::vector<Interval> returned() const {
    std::vector<Interval> w;
    for (const std::size_t i : equations_.free) w.emplace_back(result_.v[i]);
    for (const Active& row : equations_.rows) w.emplace_back(sigma_ * result_.lambda[row.index]);
    return w;
  }

  std::vector<double> newton() {
    std::vector<Interval> w = returned();
    double last = kInfinity;
    constexpr int kMostSteps = 10;
    for (int step = 0; step < kMostSteps; ++step) {
      const Equations::Values here = equations_.evaluate(w);
      const VectorXd d = here.k.middle.partialPivLu().solve(here.f.middle.col(0));
      const double size = here.f.middle.col(0).cwiseAbs().dot(d.cwiseAbs());  // of L
      if (!(size < last)) break;
      last = size;
      for (const auto i : indices(w)) w[i] = w[i].middle() - d[of(i)];
    }
    std::vector<double> end;
    for (const Interval& value : w) end.push_back(value.middle());
    return end;
  }

  static std::vector<Interval> around(const std::vector<double>& w, const MatrixXd& q, double tau) {
    const VectorXd reach = q.cwiseAbs().rowwise().sum();
    std::vector<Interval> ball;
    for (const auto i : indices(w)) {
      // Rounding of the sum: at most a part of rows times epsilon.
      const double radius = reach[of(i)] * (1.0 + static_cast<double>(w.size()) * kEpsilon);
      ball.push_back(Interval(w[i]) + Interval(-tau, tau) * Interval(radius));
    }
    return ball;
  }

  /// Min: n_x + m_y positive eigenvalues of K, Max: m_y of K_yy.
  void check_inertias(const Congruence& full, const Equations::Values& over) const {
    std::vector<std::size_t> inner;
    std::size_t min_variables = 0, max_rows = 0;
    for (const auto i : indices(equations_.free)) {
      if (is_max(s_.variable_players[equations_.free[i]])) {
        inner.push_back(i);
      } else {
        ++min_variables;
      }
    }
    for (const auto r : indices(equations_.rows)) {
      if (!is_max(s_.constraint_players[equations_.rows[r].index])) continue;
      inner.push_back(equations_.free.size() + r);
      ++max_rows;
    }
    if (!full.has_positive(min_variables + max_rows)) fail("the inertia of K is another one");
    if (inner.empty()) return;
    Enclosure k(inner.size(), inner.size());
    for (const auto a : indices(inner)) {
      for (const auto b : indices(inner)) {
        k.middle(of(a), of(b)) = over.k.middle(of(inner[a]), of(inner[b]));
        k.radius(of(a), of(b)) = over.k.radius(of(inner[a]), of(inner[b]));
      }
    }
    const Congruence part(k.middle);
    if (!(part.error(k) < 1.0)) fail("K_yy is not regular in the whole ball");
    if (!part.has_positive(max_rows)) fail("the inertia of K_yy is another one");
  }

  /// Strict signs over the ball of all multipliers of what is active and all distances of what is
  /// not. Returns how far the ball's farthest point is.
  [[nodiscard]] double check(const Equations::Values& over,
                             const std::vector<Interval>& ball) const {
    double distance = farthest_;
    const auto go_far = [&](std::size_t i, const Interval& value) {
      const double far = (value - Interval(result_.v[i])).magnitude();
      // A solution farther away is not the point's.
      constexpr double kNear = 1e-3;  // of the variable's range
      if (!(far <= kNear * ranges_.of(i))) {
        fail("the solution's " + variable_name(s_, static_cast<Index>(i)) + " may be " +
             number_text(far) + " away");
      }
      distance = std::max(distance, far);
    };
    const auto inside = [](const Interval& value, double low, double high) {
      return value.lower() > low && value.upper() < high;
    };
    const auto has_sign = [](const Interval& value, double sign) {
      return sign == 0.0 || (sign > 0.0 ? value.lower() > 0.0 : value.upper() < 0.0);
    };
    for (const auto k : indices(equations_.free)) {
      const std::size_t i = equations_.free[k];
      go_far(i, ball[k]);
      if (!inside(ball[k], lower(s_.variable_lower[i]), upper(s_.variable_upper[i]))) {
        fail("a bound of " + variable_name(s_, static_cast<Index>(i)) + " may be weakly active");
      }
    }
    for (const auto k : indices(equations_.held)) {
      const auto& [i, bound, sign, next] = equations_.held[k];
      go_far(i, bound);
      if (!has_sign(over.slopes[k], sign)) {
        fail("the bound of " + variable_name(s_, static_cast<Index>(i)) + " may be weakly active");
      }
    }
    std::vector<bool> active(over.g.size());
    for (const auto k : indices(equations_.rows)) {
      const auto& [j, bound, sign, next] = equations_.rows[k];
      active[j] = true;
      if (!has_sign(ball[equations_.free.size() + k], sign)) {
        fail(constraint_name(s_, static_cast<Index>(j)) + " may be weakly active");
      }
    }
    for (const Index j : determined_.constraints) active[at(j)] = true;
    for (const auto j : indices(active)) {
      if (active[j] ||
          inside(over.g[j], lower(s_.constraint_lower[j]), upper(s_.constraint_upper[j]))) {
        continue;
      }
      fail(constraint_name(s_, static_cast<Index>(j)) + " may be weakly active");
    }
    return distance;
  }

  const ProblemStructure& s_;
  const SolverOptions& options_;
  const Result& result_;
  const BoxFunctions& functions_;
  double sigma_;  ///< -1: f is maximized over x
  BoxFunctions::Determined determined_;
  VariableRanges ranges_;
  Equations equations_;
  double farthest_ = 0.0;  ///< of the variables that are fixed
};

}  // namespace

void prove_local_minmax(Problem& problem, const SolverOptions& options,
                        const std::function<bool()>& go_on, Result& result) {
  Certificate& certificate = result.certificate;
  certificate.proved = false;
  certificate.proved_within = kInfinity;
  try {
    if (certificate.kind != PointKind::LocalMinmax) fail("the point is not certified");
    if (result.over_y.branches > 0) fail("f is the largest of several branches");
    if (!robust_constraints(problem.structure()).empty()) {
      fail("robust constraints hold for every y, not near one");
    }
    certificate.proved_within = LocalProof(problem, options, go_on, result).run();
    certificate.proved = true;
    char text[120];
    std::snprintf(text, sizeof text,
                  "proved: a strict local minmax of the formulas lies within %.2g of the point",
                  certificate.proved_within);
    certificate.proof = text;
  } catch (const std::domain_error& error) {
    certificate.proof = std::string("not proved: ") + error.what();
  } catch (const std::bad_alloc&) {  // the result stands without it
    certificate.proof = "not proved: out of memory";
  }
}

}  // namespace ipminmax
