#include <hostile/grid_judge.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

namespace ipminmax::testing {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kReach = 5.0;  ///< of grids along variables without bounds
bool is_bound(double value) { return std::abs(value) < 1e19; }
std::size_t at(Index i) { return static_cast<std::size_t>(i); }

template <class... Numbers>
std::string say(const char* format, Numbers... numbers) {
  char text[160];
  std::snprintf(text, sizeof text, format, numbers...);
  return text;
}

class GridJudge {
 public:
  GridJudge(const KnownModel& known, const Rewriting& rewriting, const Result& result,
            const SolverOptions& options)
      : known_(known),
        model_(*known.problem),
        s_(model_.structure()),
        r_(rewriting),
        result_(result),
        n_(std::ssize(s_.variable_players)),
        m_(std::ssize(s_.constraint_lower)),
        rewritten_v_(rewriting.original(result.v)),
        v_(rewritten_v_) {
    for (Index i = 0; i < n_; ++i) {
      const bool bounded = is_bound(s_.variable_lower[at(i)]) && is_bound(s_.variable_upper[at(i)]);
      lower_.push_back(bounded ? s_.variable_lower[at(i)]
                               : std::max(s_.variable_lower[at(i)], v_[i] - kReach));
      upper_.push_back(bounded ? s_.variable_upper[at(i)]
                               : std::min(s_.variable_upper[at(i)], v_[i] + kReach));
      if (i >= known.x)
        v_[i] = std::clamp(v_[i], s_.variable_lower[at(i)], s_.variable_upper[at(i)]);
    }
    robust_.assign(at(m_), false);
    for (const auto [row, col] : s_.jacobian) {
      if (s_.constraint_players[at(row)] == Player::Min && col >= known.x) robust_[at(row)] = true;
    }
    over_y_ = options.minmax_epigraph || options.minmax_worst_case_starts > 0;
    epigraph_ = options.minmax_epigraph;
    certified_ = result.certificate.kind == PointKind::LocalMinmax;
    find_tolerances(options);
    is_relaxed_ = std::ranges::any_of(result.certificate.reasons, [](const auto& reason) {
      return reason.kind == CertificateReason::Kind::Relaxed;
    });
    make_grid();
    v_ = into_y(v_);
    add_freedom_of_y();
  }

  Judgement judge() {
    judge_rows();
    if (n_ > known_.x) judge_y();
    judge_answer();
    if (certified_) judge_x();
    return judgement_;
  }

 private:
  // What tol and bound_relax_factor leave open, in the model's units.

  void find_tolerances(const SolverOptions& options) {
    const double tol = options.tol;
    RewrittenProblem rewritten(model_, r_);
    const ProblemStructure& s = rewritten.structure();
    std::vector<double> u = result_.v, g(u.size()), j(s.jacobian.size());
    // The largest term of each entry of the Lagrangian's gradient.
    terms_.assign(u.size(), 0.0);
    const auto see = [&](std::size_t k, double term) {
      terms_[k] = std::max(terms_[k], std::abs(term));
    };
    if (rewritten.gradient(u, true, g) && rewritten.jacobian(u, false, j)) {
      for (std::size_t k = 0; k < u.size(); ++k) {
        see(k, g[k]);
        see(k, result_.z_lower[k]);
        see(k, result_.z_upper[k]);
      }
      for (std::size_t k = 0; k < j.size(); ++k)
        see(at(s.jacobian[k].col), result_.lambda[at(s.jacobian[k].row)] * j[k]);
    }
    for (std::size_t k = 0; k < u.size(); ++k) u[k] = r_.variables[k].start;
    // Gradient-based scaling: factors at least 1e-8, gradients at most 100.
    const auto scaled = [](double largest) { return std::clamp(largest / 100.0, 1.0, 1e8); };
    double largest = 0.0;
    if (rewritten.gradient(u, true, g)) {
      for (const double value : g) largest = std::max(largest, std::abs(value));
    }
    constexpr double kSafety = 3.0;
    const double dual_tol = kSafety * tol * scaled(largest);
    value_tol_ = std::min(dual_tol, kSafety * options.compl_inf_tol);
    // What scaling forgives is at most a small part of the largest term.
    constexpr double kForgiven = 1e-4;
    for (double& term : terms_)
      term = std::min(dual_tol, kSafety * std::max(tol, kForgiven * term));
    std::vector<double> steepest(r_.rows.size(), 0.0);
    if (rewritten.jacobian(u, false, j)) {
      for (std::size_t k = 0; k < j.size(); ++k) {
        double& of_row = steepest[at(s.jacobian[k].row)];
        of_row = std::max(of_row, std::abs(j[k]));
      }
    }
    row_tol_.assign(at(m_), kInfinite);
    bound_tol_.assign(at(n_), 0.0);
    const auto of_bounds = [&](double lower, double upper) {
      double bound = 1.0;
      if (is_bound(lower)) bound = std::max(bound, std::abs(lower));
      if (is_bound(upper)) bound = std::max(bound, std::abs(upper));
      return std::min(options.bound_relax_factor * bound, options.constr_viol_tol);
    };
    for (std::size_t k = 0; k < r_.rows.size(); ++k) {
      const Rewriting::Row& row = r_.rows[k];
      const double open = kSafety * (of_bounds(row.lower, row.upper) + tol * scaled(steepest[k]));
      value_tol_ += std::abs(result_.lambda[k]) * open;
      if (row.source >= m_) {
        bound_tol_[at(row.source - m_)] += open / std::abs(row.factor);
      } else if (!row.is_redundant) {
        double& of_row = row_tol_[at(row.source)];
        of_row = std::min(of_row, open / std::abs(row.factor));
      }
    }
    for (std::size_t k = 0; k < r_.variables.size(); ++k) {
      const double open = kSafety * of_bounds(r_.variables[k].lower, r_.variables[k].upper);
      value_tol_ += (std::abs(result_.z_lower[k]) + std::abs(result_.z_upper[k])) * open;
      for (Index i = 0; i < n_; ++i)
        bound_tol_[at(i)] += open * std::abs(r_.a(i, static_cast<Index>(k)));
    }
  }
  /// Worst cases, each with a y of its own, lie in a relaxed Y, too.
  void add_freedom_of_y() {
    if (y_grid_.cols() == 0) return;
    const std::vector<OverY> over = rows_over_y(v_, true);
    double freedom = 0.0;  // of the size of Y
    for (Index i = known_.x; i < n_; ++i)
      freedom += bound_tol_[at(i)] / (upper_[at(i)] - lower_[at(i)]);
    for (Index j = 0; j < m_; ++j) {
      if (s_.constraint_players[at(j)] == Player::Max && over[at(j)].range() > 0.0)
        freedom += row_tol_[at(j)] / over[at(j)].range();
    }
    constexpr double kSteepness = 4.0;
    double change = std::abs(r_.f_factor) * f_over_y(v_).range();
    for (std::size_t k = 0; k < r_.rows.size(); ++k) {
      const Rewriting::Row& row = r_.rows[k];
      if (row.source < m_ && robust_[at(row.source)])
        change += std::abs(result_.lambda[k] * row.factor) * over[at(row.source)].range();
    }
    value_tol_ += kSteepness * freedom * change;
  }
  /// Gain of value along a step that a dual error of tol hides, and one of complementarity.
  [[nodiscard]] double hidden(const VectorXd& step) const {
    double gain = value_tol_;
    for (Index k = 0; k < r_.a.cols(); ++k) {
      double length = 0.0;  // of u_k along the step, at most
      for (Index i = 0; i < n_; ++i) {
        if (r_.a(i, k) != 0.0) length += std::abs(step[i] / r_.a(i, k));
      }
      gain += terms_[at(k)] * length;
    }
    return gain / std::abs(r_.f_factor);
  }

  // Grids of y.

  void make_grid() {
    const Index count = n_ - known_.x;
    if (count == 0) return;
    const int points = count == 1 ? 2001 : count == 2 ? 81 : 0;
    y_grid_.resize(count, points == 0 ? 0 : static_cast<Index>(std::pow(points, count)));
    for (Index k = 0; k < y_grid_.cols(); ++k) {
      Index rest = k;
      for (Index i = 0; i < count; ++i, rest /= points) {
        const std::size_t at_i = at(known_.x + i);
        y_grid_(i, k) = lower_[at_i] + (upper_[at_i] - lower_[at_i]) *
                                           static_cast<double>(rest % points) / (points - 1);
      }
    }
  }
  [[nodiscard]] double f(const VectorXd& v) const {
    double value = 0.0;
    return model_.objective({v.data(), at(n_)}, true, value) ? value : -kInfinite;
  }
  [[nodiscard]] VectorXd rows(const VectorXd& v) const {
    VectorXd g(m_);
    if (m_ > 0 && !model_.constraints({v.data(), at(n_)}, true, {g.data(), at(m_)}))
      g.setConstant(std::numeric_limits<double>::quiet_NaN());
    return g;
  }
  [[nodiscard]] double excess(const VectorXd& g, Index j) const {
    return std::max(s_.constraint_lower[at(j)] - g[j], g[j] - s_.constraint_upper[at(j)]);
  }
  /// Whether y may be played at x.
  [[nodiscard]] bool is_in_y(const VectorXd& v) const {
    for (Index i = known_.x; i < n_; ++i) {
      if (v[i] < s_.variable_lower[at(i)] || v[i] > s_.variable_upper[at(i)]) return false;
    }
    if (m_ == 0) return true;
    const VectorXd g = rows(v);
    for (Index j = 0; j < m_; ++j) {
      if (s_.constraint_players[at(j)] == Player::Max && !(excess(g, j) <= 1e-12)) return false;
    }
    return true;
  }

  [[nodiscard]] VectorXd start() const {
    VectorXd v(n_);
    StartingPoint start{.v = {v.data(), at(n_)}, .lambda = {}, .z_lower = {}, .z_upper = {}};
    return model_.starting_point(start) ? v : v_;
  }
  /// v, or with a y of Y(x) near its y.
  [[nodiscard]] VectorXd into_y(const VectorXd& v) const {
    if (n_ == known_.x || is_in_y(v)) return v;
    double nearest = kInfinite;
    VectorXd inside = v;
    visit(v, [&](const VectorXd& w) {
      if ((w - v).norm() >= nearest) return;
      nearest = (w - v).norm();
      inside = w;
    });
    return is_in_y(inside) ? climb(inside) : v;
  }

  struct OverY {
    double most = -kInfinite, least = kInfinite;
    VectorXd v;
    void see(double value, const VectorXd& where) {
      least = std::min(least, value);
      if (value <= most) return;
      most = value;
      v = where;
    }
    [[nodiscard]] double range() const { return most > least ? most - least : 0.0; }
  };
  /// Of f, or of the excess of the rows, over the grid at an x.
  template <class Visit>
  void visit(VectorXd v, Visit&& each) const {
    for (Index k = 0; k < y_grid_.cols(); ++k) {
      v.tail(n_ - known_.x) = y_grid_.col(k);
      if (is_in_y(v)) each(v);
    }
  }
  [[nodiscard]] std::vector<OverY> rows_over_y(const VectorXd& v, bool all = false) const {
    std::vector<OverY> over(at(m_));
    const auto see = [&](const VectorXd& w) {
      const VectorXd g = rows(w);
      for (Index j = 0; j < m_; ++j) over[at(j)].see(excess(g, j), w);
    };
    if (!all && std::ranges::find(robust_, true) == robust_.end()) {
      if (m_ > 0) see(v);
    } else {
      visit(v, see);
    }
    return over;
  }
  [[nodiscard]] OverY f_over_y(const VectorXd& v) const {
    OverY over;
    visit(v, [&](const VectorXd& w) { over.see(f(w), w); });
    return over;
  }
  /// y of the local maximum that ascent by ever smaller steps along 8 directions reaches.
  [[nodiscard]] VectorXd climb(VectorXd v) const {
    double best = is_in_y(v) ? f(v) : -kInfinite;
    const Index count = n_ - known_.x;
    for (double step = 3e-3; step > 1e-8;) {
      const VectorXd from = v;
      const int directions = count == 1 ? 2 : 8;
      for (int k = 0; k < directions; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / directions;
        VectorXd w = from;
        w[known_.x] += step * (upper_[at(known_.x)] - lower_[at(known_.x)]) * std::cos(angle);
        if (count > 1)
          w[known_.x + 1] +=
              step * (upper_[at(known_.x + 1)] - lower_[at(known_.x + 1)]) * std::sin(angle);
        for (Index i = known_.x; i < n_; ++i)
          w[i] = std::clamp(w[i], s_.variable_lower[at(i)], s_.variable_upper[at(i)]);
        if (!is_in_y(w)) continue;
        const double value = f(w);
        if (value <= best) continue;
        best = value;
        v = w;
      }
      if (v == from) step *= 0.4;
    }
    return v;
  }

  // The claims.

  void blame(bool tolerated, const std::string& what) {
    std::string& text = tolerated ? judgement_.tolerated : judgement_.wrong;
    if (!text.empty()) text += "; ";
    text += what;
  }

  /// What relaxed bounds change is small beside the range, or the certificate says so.
  [[nodiscard]] bool is_named(double excess, double range) const {
    constexpr double kSmallEffect = 0.03;
    return is_relaxed_ || excess <= kSmallEffect * range || range == 0.0;
  }

  void judge_rows() {
    const std::vector<OverY> over = rows_over_y(v_), at_start = rows_over_y(start());
    const VectorXd g = rows(rewritten_v_);
    for (Index j = 0; j < m_; ++j) {
      const double most = robust_[at(j)] ? over[at(j)].most : excess(g, j);
      const double range = std::max(over[at(j)].range(), at_start[at(j)].range());
      const double counts = 1e-3 * range;
      if (most <= std::max(counts, 1e-6)) continue;
      blame(most <= counts + row_tol_[at(j)] && is_named(most, range),
            robust_[at(j)] ? say("row %td is violated by %.3g of %.3g at y = %.4g", j, most, range,
                                 over[at(j)].v[known_.x])
                           : say("row %td is violated by %.3g", j, most));
    }
    for (Index i = 0; i < n_; ++i) {
      const double value = rewritten_v_[i];
      const double most =
          std::max(s_.variable_lower[at(i)] - value, value - s_.variable_upper[at(i)]);
      if (most > 1e-6)
        blame(most <= bound_tol_[at(i)] && is_named(most, upper_[at(i)] - lower_[at(i)]),
              say("variable %td leaves its bounds by %.3g", i, most));
    }
  }

  [[nodiscard]] double phi_here(const VectorXd& v) const {
    return known_.phi ? known_.phi(v.head(known_.x)) : f(v);
  }

  void judge_y() {
    const double here = f(v_);
    if (known_.phi) {
      const double most = known_.phi(v_.head(known_.x));
      const double gap = most - here;
      if (over_y_ && gap > 1e-4 * (1.0 + std::abs(most)))
        blame(gap <= hidden(VectorXd::Zero(n_)), say("another y gives %.6g, not %.6g", most, here));
    }
    if (y_grid_.cols() == 0) return;
    const OverY over = f_over_y(v_);
    if (!known_.phi && over_y_ && over.most > here + 1e-3 * over.range())
      blame(over.most - here <= hidden(over.v - v_),
            say("y = %.4g gives %.6g, not %.6g", over.v[known_.x], over.most, here));
    f_range_ = over.range();
    if (!is_in_y(v_)) return;
    const VectorXd best = climb(v_);
    const double gain = f(best) - here;
    if (gain > 1e-5 * over.range())
      blame(gain <= hidden(best - v_), say("y = %.6g is no local maximum, %.6g gives %.3g more",
                                           v_[known_.x], best[known_.x], gain));
  }

  void judge_answer() {
    // Over all of y, or a certificate of a model with one local minmax at most.
    if (!known_.answer) return;
    const bool has_robust = std::ranges::find(robust_, true) != robust_.end();
    if (!certified_ && !over_y_ && !has_robust && n_ > known_.x) return;
    for (Index i = 0; i < known_.answer->size(); ++i) {
      const double right = (*known_.answer)[i];
      const double size = is_bound(s_.variable_lower[at(i)]) && is_bound(s_.variable_upper[at(i)])
                              ? upper_[at(i)] - lower_[at(i)]
                              : std::max(1.0, std::abs(right));
      if (std::abs(v_[i] - right) <= 1e-2 * size) continue;
      VectorXd there = v_;
      there.head(known_.answer->size()) = *known_.answer;
      const double lost = phi_here(v_) - phi_here(there);
      double open = hidden(there - v_) + bound_tol_[at(i)];
      for (const double tol : row_tol_) open += tol;
      blame(std::abs(lost) <= open, say("x%td = %.6g, right is %.6g", i, v_[i], right));
      return;
    }
  }

  /// phi is not less, and not level, at x nearby.
  void judge_x() {
    if (known_.x == 0) return;
    std::vector<VectorXd> directions;
    if (known_.x == 1) {
      directions = {VectorXd::Ones(1), -VectorXd::Ones(1)};
    } else {
      Dice dice(7);
      for (int k = 0; k < 24; ++k) {
        VectorXd d = VectorXd::NullaryExpr(known_.x, [&] { return dice.between(-1.0, 1.0); });
        directions.push_back(d);
      }
    }
    const VectorXd x = v_.head(known_.x);
    if (known_.directions) {
      const MatrixXd more = known_.directions(x);
      for (Index k = 0; k < more.cols(); ++k) {
        directions.emplace_back(more.col(k));
        directions.emplace_back(-more.col(k));
      }
    }
    const bool whole = epigraph_ || known_.phi;
    const double here = whole && !known_.phi && n_ > known_.x
                            ? std::max(f(v_), f(climb(f_over_y(v_).v)))
                            : phi_here(v_);
    std::vector<double> open(at(m_), 0.0);
    const std::vector<OverY> now = rows_over_y(v_);
    for (Index j = 0; j < m_; ++j) open[at(j)] = std::max(1e-9, now[at(j)].most);
    for (const double reach : {1e-2, 1e-3}) {
      for (const VectorXd& d : directions) {
        if (!(d.norm() > 0.0)) continue;
        VectorXd w = v_;
        w.head(known_.x) += reach * d / d.norm();
        if (known_.allowed ? !known_.allowed(w.head(known_.x)) : !is_in_x(w, open)) continue;
        double there = 0.0;
        if (known_.phi || n_ == known_.x) {
          there = phi_here(w);
        } else if (whole) {
          there = f(climb(f_over_y(w).v));
        } else {
          if (y_grid_.cols() == 0) return;
          w = follow(w);
          there = f(w);
        }
        const double gain = here - there;
        const double counts = 1e-5 * reach * reach * std::max(1.0, f_range_);
        if (gain > counts + 1e-12 * std::abs(here)) {
          blame(gain <= hidden(w - v_),
                say("x0 = %.6g is no minimum, %.6g gives %.3g less", v_[0], w[0], gain));
          return;
        }
        if (known_.directions && std::abs(gain) <= 1e-13 * (1.0 + std::abs(here))) {
          blame(false, say("x0 = %.6g is no strict minimum, %.6g is as good", v_[0], w[0]));
          return;
        }
      }
    }
  }
  /// The maximum over y at the x of w that the one at v_ moves to.
  [[nodiscard]] VectorXd follow(const VectorXd& w) const {
    constexpr int kSteps = 4;
    VectorXd along = v_;
    for (int k = 1; k <= kSteps; ++k) {
      along.head(known_.x) = v_.head(known_.x) + (w - v_).head(known_.x) * k / kSteps;
      along = into_y(along);
      along = climb(along);
    }
    return along;
  }
  [[nodiscard]] bool is_in_x(const VectorXd& v, const std::vector<double>& open) const {
    for (Index i = 0; i < known_.x; ++i) {
      if (v[i] < s_.variable_lower[at(i)] || v[i] > s_.variable_upper[at(i)]) return false;
    }
    const std::vector<OverY> over = rows_over_y(v);
    for (Index j = 0; j < m_; ++j) {
      const bool of_max = s_.constraint_players[at(j)] == Player::Max;
      if (!of_max && !(over[at(j)].most <= open[at(j)])) return false;
    }
    return true;
  }

  const KnownModel& known_;
  Problem& model_;
  const ProblemStructure& s_;
  const Rewriting& r_;
  const Result& result_;
  Index n_, m_;
  VectorXd rewritten_v_;  ///< the answer in the model's units
  VectorXd v_;            ///< with y in Y(x)
  std::vector<double> lower_, upper_, row_tol_, bound_tol_, terms_;
  std::vector<bool> robust_;
  MatrixXd y_grid_;  ///< a column each
  double value_tol_ = 0.0, f_range_ = 0.0;
  bool is_relaxed_ = false, over_y_ = false, epigraph_ = false, certified_ = false;
  Judgement judgement_;
};

}  // namespace

Judgement judge(const KnownModel& model, const Rewriting& rewriting, const Result& result,
                const SolverOptions& options) {
  if (result.certificate.kind != PointKind::LocalMinmax && !is_success(result.status)) return {};
  return GridJudge(model, rewriting, result, options).judge();
}

}  // namespace ipminmax::testing
