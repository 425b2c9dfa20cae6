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

/// What tol and bound_relax_factor leave open, in the model's units.
class Tolerances {
 public:
  Tolerances(Problem& model, const Rewriting& rewriting, const Result& result,
             const SolverOptions& options)
      : r_(rewriting), options_(options) {
    RewrittenProblem rewritten(model, rewriting);
    std::vector<double> start;
    for (const Rewriting::Variable& u : r_.variables) start.push_back(u.start);
    const Steepest at_start(rewritten, start, std::vector<double>(r_.rows.size(), 0.0));
    const double dual_tol = options.tol * scaled(std::ranges::max(at_start.gradient));
    value_ = std::min(dual_tol, options.compl_inf_tol);
    // Scaling forgives at most a small part of the largest term.
    constexpr double kForgiven = 1e-4;
    const Steepest here(rewritten, result.v, result.lambda);
    for (std::size_t k = 0; k < start.size(); ++k) {
      const double term =
          std::max({here.terms[k], std::abs(result.z_lower[k]), std::abs(result.z_upper[k])});
      dual_.push_back(std::min(dual_tol, std::max(options.tol, kForgiven * term)));
    }
    add_rows(at_start, result, static_cast<std::size_t>(r_.model_rows));
    add_bounds(result, here.gradient);
  }

  /// Gain of value along a step that may remain.
  [[nodiscard]] double hidden(const VectorXd& step) const {
    double gain = value_;
    for (Index k = 0; k < r_.a.cols(); ++k) {
      double length = 0.0;  // of u_k along the step, at most
      for (Index i = 0; i < step.size(); ++i) {
        if (r_.a(i, k) != 0.0) length += std::abs(step[i] / r_.a(i, k));
      }
      gain += dual_[at(k)] * length;
    }
    return kSafety * gain / std::abs(r_.f_factor);
  }
  [[nodiscard]] double of_row(Index j) const {
    return kSafety * std::max(finite(below_[at(j)]), finite(above_[at(j)]));
  }
  [[nodiscard]] double of_bound(Index i) const { return kSafety * bounds_[at(i)]; }
  /// change: of the value, in the model's units.
  void add(double change) { value_ += change * std::abs(r_.f_factor); }

 private:
  static constexpr double kSafety = 3.0;

  /// Largest derivatives at a point, of f and by row, and largest terms of the Lagrangian's
  /// gradient by variable.
  struct Steepest {
    std::vector<double> gradient, rows, terms;
    Steepest(RewrittenProblem& model, const std::vector<double>& u,
             const std::vector<double>& lambda)
        : gradient(u.size(), 0.0), rows(lambda.size(), 0.0), terms(u.size(), 0.0) {
      const std::vector<Triplet>& places = model.structure().jacobian;
      std::vector<double> j(places.size(), 0.0);
      if (!model.gradient(u, true, gradient) || !model.jacobian(u, false, j)) return;
      for (std::size_t k = 0; k < u.size(); ++k) terms[k] = gradient[k] = std::abs(gradient[k]);
      for (std::size_t k = 0; k < j.size(); ++k) {
        const auto row = at(places[k].row), col = at(places[k].col);
        rows[row] = std::max(rows[row], std::abs(j[k]));
        terms[col] = std::max(terms[col], std::abs(lambda[row] * j[k]));
      }
    }
  };
  /// Inverse of the factor of nlp_scaling_method gradient-based.
  [[nodiscard]] double scaled(double largest) const {
    return std::clamp(largest / options_.nlp_scaling_max_gradient, 1.0,
                      1.0 / options_.nlp_scaling_min_value);
  }
  [[nodiscard]] double relaxed(double lower, double upper) const {
    double bound = 1.0;
    if (is_bound(lower)) bound = std::max(bound, std::abs(lower));
    if (is_bound(upper)) bound = std::max(bound, std::abs(upper));
    return std::min(options_.bound_relax_factor * bound, options_.constr_viol_tol);
  }
  [[nodiscard]] static double finite(double open) { return open < kInfinite ? open : 0.0; }
  void add_rows(const Steepest& at_start, const Result& result, std::size_t model_rows) {
    below_.assign(model_rows, kInfinite);
    above_ = below_;
    bounds_.assign(at(r_.b.size()), 0.0);
    for (std::size_t k = 0; k < r_.rows.size(); ++k) {
      const Rewriting::Row& row = r_.rows[k];
      const double open = relaxed(row.lower, row.upper) + options_.tol * scaled(at_start.rows[k]);
      value_ += std::abs(result.lambda[k]) * open;
      const double in_model = open / std::abs(row.factor);
      const std::size_t source = at(row.source);
      if (source >= model_rows) {
        bounds_[source - model_rows] += in_model;
      } else if (!row.is_redundant) {
        if (is_bound(row.lower)) below_[source] = std::min(below_[source], in_model);
        if (is_bound(row.upper)) above_[source] = std::min(above_[source], in_model);
      }
    }
  }
  /// Multipliers of Max's bounds are 0 where several y are active: then by the slope of f.
  void add_bounds(const Result& result, const std::vector<double>& slopes) {
    for (std::size_t k = 0; k < r_.variables.size(); ++k) {
      const double open = relaxed(r_.variables[k].lower, r_.variables[k].upper);
      const double v = result.v[k];
      const bool leaves = v < r_.variables[k].lower || v > r_.variables[k].upper;
      value_ += std::max(std::abs(result.z_lower[k]) + std::abs(result.z_upper[k]),
                         leaves ? slopes[k] : 0.0) *
                open;
      for (std::size_t i = 0; i < bounds_.size(); ++i) {
        bounds_[i] += open * std::abs(r_.a(static_cast<Index>(i), static_cast<Index>(k)));
      }
    }
  }

  const Rewriting& r_;
  const SolverOptions& options_;
  double value_ = 0.0;                 ///< of the rewritten model
  std::vector<double> dual_;           ///< by variable of the rewritten model
  std::vector<double> below_, above_;  ///< by row of the model: of its two sides
  std::vector<double> bounds_;         ///< by variable of the model
};

/// Values of one function over a grid of y.
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

/// The model's functions, and their values over a grid of y.
class YGrid {
 public:
  /// Along variables without two bounds the grid reaches from around.
  YGrid(const KnownModel& known, const VectorXd& around)
      : known_(known),
        model_(*known.problem),
        s_(model_.structure()),
        n_(std::ssize(s_.variable_players)),
        m_(std::ssize(s_.constraint_lower)) {
    for (Index i = 0; i < n_; ++i) {
      const double lower = s_.variable_lower[at(i)], upper = s_.variable_upper[at(i)];
      const bool bounded = is_bound(lower) && is_bound(upper);
      lower_.push_back(bounded ? lower : std::max(lower, around[i] - kReach));
      upper_.push_back(bounded ? upper : std::min(upper, around[i] + kReach));
    }
    robust_.assign(at(m_), false);
    for (const auto [row, col] : s_.jacobian) {
      if (s_.constraint_players[at(row)] == Player::Min && col >= known.x) robust_[at(row)] = true;
    }
    make_grid();
  }

  [[nodiscard]] bool empty() const { return y_.cols() == 0; }
  [[nodiscard]] double width(Index i) const { return upper_[at(i)] - lower_[at(i)]; }
  [[nodiscard]] bool is_robust(Index j) const { return robust_[at(j)]; }
  [[nodiscard]] bool has_robust() const {
    return std::ranges::find(robust_, true) != robust_.end();
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
    return model_.starting_point(start) ? v : VectorXd::Zero(n_);
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

  /// Of f, or of the excess of the rows, over the grid at an x.
  template <class Visit>
  void visit(VectorXd v, Visit&& each) const {
    for (Index k = 0; k < y_.cols(); ++k) {
      v.tail(n_ - known_.x) = y_.col(k);
      if (is_in_y(v)) each(v);
    }
  }
  [[nodiscard]] std::vector<OverY> rows_over_y(const VectorXd& v, bool all = false) const {
    std::vector<OverY> over(at(m_));
    const auto see = [&](const VectorXd& w) {
      const VectorXd g = rows(w);
      for (Index j = 0; j < m_; ++j) over[at(j)].see(excess(g, j), w);
    };
    if (!all && !has_robust()) {
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

 private:
  void make_grid() {
    const Index count = n_ - known_.x;
    if (count == 0) return;
    const int points = count == 1 ? 2001 : count == 2 ? 81 : 0;
    y_.resize(count, points == 0 ? 0 : static_cast<Index>(std::pow(points, count)));
    for (Index k = 0; k < y_.cols(); ++k) {
      Index rest = k;
      for (Index i = 0; i < count; ++i, rest /= points) {
        const std::size_t at_i = at(known_.x + i);
        y_(i, k) = lower_[at_i] + (upper_[at_i] - lower_[at_i]) *
                                      static_cast<double>(rest % points) / (points - 1);
      }
    }
  }

  const KnownModel& known_;
  Problem& model_;
  const ProblemStructure& s_;
  Index n_, m_;
  std::vector<double> lower_, upper_;
  std::vector<bool> robust_;
  MatrixXd y_;  ///< a column each
};

class GridJudge {
 public:
  GridJudge(const KnownModel& known, const Rewriting& rewriting, const Result& result,
            const SolverOptions& options)
      : known_(known),
        s_(known.problem->structure()),
        n_(std::ssize(s_.variable_players)),
        m_(std::ssize(s_.constraint_lower)),
        rewritten_v_(rewriting.original(result.v)),
        v_(rewritten_v_),
        grid_(known, v_),
        tolerances_(*known.problem, rewriting, result, options),
        over_y_(options.minmax_epigraph || options.minmax_worst_case_starts > 0),
        epigraph_(options.minmax_epigraph),
        certified_(result.certificate.kind == PointKind::LocalMinmax),
        is_unique_(std::ranges::none_of(result.certificate.reasons, [](const auto& reason) {
          return reason.text.starts_with("x is best but not unique");
        })) {
    is_relaxed_ = std::ranges::any_of(result.certificate.reasons, [](const auto& reason) {
      return reason.kind == CertificateReason::Kind::Relaxed;
    });
    for (Index i = known.x; i < n_; ++i)
      v_[i] = std::clamp(v_[i], s_.variable_lower[at(i)], s_.variable_upper[at(i)]);
    v_ = grid_.into_y(v_);
    add_freedom_of_y(rewriting, result);
  }

  Judgement judge() {
    judge_rows();
    judge_bounds();
    if (n_ > known_.x) judge_y();
    judge_answer();
    if (certified_ && known_.x > 0) judge_x();
    return judgement_;
  }

 private:
  /// Worst cases, each with a y of its own, lie in a relaxed Y, too.
  void add_freedom_of_y(const Rewriting& rewriting, const Result& result) {
    if (grid_.empty()) return;
    const std::vector<OverY> over = grid_.rows_over_y(v_, true);
    double freedom = 0.0;  // of the size of Y
    for (Index i = known_.x; i < n_; ++i) freedom += tolerances_.of_bound(i) / grid_.width(i);
    for (Index j = 0; j < m_; ++j) {
      if (s_.constraint_players[at(j)] == Player::Max && over[at(j)].range() > 0.0)
        freedom += tolerances_.of_row(j) / over[at(j)].range();
    }
    constexpr double kSteepness = 4.0;
    double change = grid_.f_over_y(v_).range();
    for (std::size_t k = 0; k < rewriting.rows.size(); ++k) {
      const Rewriting::Row& row = rewriting.rows[k];
      if (row.source < m_ && grid_.is_robust(row.source))
        change += std::abs(result.lambda[k] * row.factor / rewriting.f_factor) *
                  over[at(row.source)].range();
    }
    tolerances_.add(kSteepness * freedom * change);
  }

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
    const std::vector<OverY> over = grid_.rows_over_y(v_);
    const std::vector<OverY> at_start = grid_.rows_over_y(grid_.start());
    const VectorXd g = grid_.rows(rewritten_v_);
    for (Index j = 0; j < m_; ++j) {
      const double most = grid_.is_robust(j) ? over[at(j)].most : grid_.excess(g, j);
      const double range = std::max(over[at(j)].range(), at_start[at(j)].range());
      const double counts = 1e-3 * range;
      if (most <= std::max(counts, 1e-6)) continue;
      blame(most <= counts + tolerances_.of_row(j) && is_named(most, range),
            grid_.is_robust(j) ? say("row %td is violated by %.3g of %.3g at y = %.4g", j, most,
                                     range, over[at(j)].v[known_.x])
                               : say("row %td is violated by %.3g", j, most));
    }
  }
  void judge_bounds() {
    for (Index i = 0; i < n_; ++i) {
      const double value = rewritten_v_[i];
      const double most =
          std::max(s_.variable_lower[at(i)] - value, value - s_.variable_upper[at(i)]);
      if (most <= 1e-6) continue;
      blame(most <= tolerances_.of_bound(i) && is_named(most, grid_.width(i)),
            say("variable %td leaves its bounds by %.3g", i, most));
    }
  }

  [[nodiscard]] double phi_here(const VectorXd& v) const {
    return known_.phi ? known_.phi(v.head(known_.x)) : grid_.f(v);
  }

  void judge_y() {
    const double here = grid_.f(v_);
    if (known_.phi) {
      const double most = known_.phi(v_.head(known_.x));
      const double gap = most - here;
      if (over_y_ && gap > 1e-4 * (1.0 + std::abs(most)))
        blame(gap <= tolerances_.hidden(VectorXd::Zero(n_)),
              say("another y gives %.6g, not %.6g", most, here));
    }
    if (grid_.empty()) return;
    const OverY over = grid_.f_over_y(v_);
    if (!known_.phi && over_y_ && over.most > here + 1e-3 * over.range())
      blame(over.most - here <= tolerances_.hidden(over.v - v_),
            say("y = %.4g gives %.6g, not %.6g", over.v[known_.x], over.most, here));
    f_range_ = over.range();
    if (!grid_.is_in_y(v_) || !(certified_ || known_.smooth)) return;
    const VectorXd best = grid_.climb(v_);
    const double gain = grid_.f(best) - here;
    if (gain > 1e-5 * over.range())
      blame(gain <= tolerances_.hidden(best - v_),
            say("y = %.6g is no local maximum, %.6g gives %.3g more", v_[known_.x], best[known_.x],
                gain));
  }

  void judge_answer() {
    // Over all of y, or a certificate of a model with one local minmax at most.
    if (!known_.answer) return;
    if (!certified_ && !over_y_ && !grid_.has_robust() && n_ > known_.x) return;
    for (Index i = 0; i < known_.answer->size(); ++i) {
      const double right = (*known_.answer)[i];
      const double size = is_bound(s_.variable_lower[at(i)]) && is_bound(s_.variable_upper[at(i)])
                              ? grid_.width(i)
                              : std::max(1.0, std::abs(right));
      if (std::abs(v_[i] - right) <= 1e-2 * size) continue;
      VectorXd there = v_;
      there.head(known_.answer->size()) = *known_.answer;
      const double lost = phi_here(v_) - phi_here(there);
      double open = tolerances_.hidden(there - v_) + tolerances_.of_bound(i);
      for (Index j = 0; j < m_; ++j) open += tolerances_.of_row(j);
      blame(std::abs(lost) <= open, say("x%td = %.6g, right is %.6g", i, v_[i], right));
      return;
    }
  }

  /// Of unit length.
  [[nodiscard]] std::vector<VectorXd> directions() const {
    std::vector<VectorXd> all;
    const auto add = [&](const VectorXd& d) {
      if (!(d.norm() > 0.0)) return;
      all.emplace_back(d / d.norm());
      all.emplace_back(-d / d.norm());
    };
    if (known_.directions) {
      const MatrixXd more = known_.directions(v_.head(known_.x));
      for (Index k = 0; k < more.cols(); ++k) add(more.col(k));
    }
    Dice dice(7);
    const int many = known_.x == 1 ? 1 : known_.phi ? 40 : 12;
    for (int k = 0; k < many; ++k)
      add(VectorXd::NullaryExpr(known_.x, [&] { return dice.between(-1.0, 1.0); }));
    return all;
  }
  /// The value that x minimizes, at the x of w; w gets its y.
  [[nodiscard]] double phi(VectorXd& w) const {
    if (known_.phi || n_ == known_.x) return phi_here(w);
    w = epigraph_ ? grid_.climb(grid_.f_over_y(w).v) : follow(w);
    return grid_.f(w);
  }
  /// phi is not less, and not level, at x nearby.
  void judge_x() {
    if (n_ > known_.x && !known_.phi && grid_.empty()) return;
    VectorXd best = v_;
    const double here = std::max(phi_here(v_), phi(best));
    std::vector<double> open;  // excess of rows that is there already
    for (const OverY& over : grid_.rows_over_y(v_)) open.push_back(std::max(1e-9, over.most));
    for (const double reach : {1e-2, 1e-3}) {
      for (const VectorXd& d : directions()) {
        VectorXd w = v_;
        w.head(known_.x) += reach * d;
        if (known_.allowed ? !known_.allowed(w.head(known_.x)) : !is_in_x(w, open)) continue;
        const double gain = here - phi(w);
        const double counts = 1e-5 * reach * reach * std::max(1.0, f_range_);
        if (gain > counts + 1e-12 * std::abs(here)) {
          blame(gain <= tolerances_.hidden(w - v_),
                say("x0 = %.6g is no minimum, %.6g gives %.3g less", v_[0], w[0], gain));
          return;
        }
        if (known_.directions && is_unique_ && std::abs(gain) <= 1e-13 * (1.0 + std::abs(here))) {
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
      along = grid_.into_y(along);
      along = grid_.climb(along);
    }
    return along;
  }
  [[nodiscard]] bool is_in_x(const VectorXd& v, const std::vector<double>& open) const {
    for (Index i = 0; i < known_.x; ++i) {
      if (v[i] < s_.variable_lower[at(i)] || v[i] > s_.variable_upper[at(i)]) return false;
    }
    const std::vector<OverY> over = grid_.rows_over_y(v);
    for (Index j = 0; j < m_; ++j) {
      const bool of_max = s_.constraint_players[at(j)] == Player::Max;
      if (!of_max && !(over[at(j)].most <= open[at(j)])) return false;
    }
    return true;
  }

  const KnownModel& known_;
  const ProblemStructure& s_;
  Index n_, m_;
  VectorXd rewritten_v_;  ///< the answer in the model's units
  VectorXd v_;            ///< with y in Y(x)
  YGrid grid_;
  Tolerances tolerances_;
  double f_range_ = 0.0;
  bool over_y_, epigraph_, certified_, is_relaxed_ = false;
  bool is_unique_;  ///< x, as the certificate says
  Judgement judgement_;
};

}  // namespace

Judgement judge(const KnownModel& model, const Rewriting& rewriting, const Result& result,
                const SolverOptions& options) {
  if (result.certificate.kind != PointKind::LocalMinmax && !is_success(result.status)) return {};
  return GridJudge(model, rewriting, result, options).judge();
}

}  // namespace ipminmax::testing
