#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <vector>

#include <Eigen/Core>

#include <hostile/judge_certificate.hpp>
#include <support/active_rows.hpp>
#include <support/dense_algebra.hpp>
#include <support/dense_judge.hpp>

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNear = 1e-3;      // movement of the polish over |v| + kOrigin
constexpr double kAtOnce = 1e-8;    // the same, where it does not matter whether it contracts
constexpr double kContracts = 0.3;  // second Newton step over the first
constexpr double kOrigin = 1e-2;
constexpr double kSmallest = 1e-9;    // of variables in models with small units
constexpr double kCertain = 1e-13;    // as kWeak, what rounding does not explain
constexpr double kSign = 1e-9;        // curvature of an equilibrated matrix that has a sign
constexpr double kWeak = 1e-9;        // multiplier times gradient over the terms that it balances
constexpr double kTouching = 1e-14;   // distance over 1 + |bound|
constexpr double kOutside = 1e-8;     // violation over 1 + |bound|
constexpr double kShareOfGain = 0.1;  // of the predicted change that has to come
constexpr double kRounding = 1e-13;   // of values
constexpr int kMostNewtonSteps = 40;
constexpr int kMostFlips = 8;   // of rows on the way from a guess of the active set to a solution
constexpr double kReach = 0.5;  // of that way over |v| + kOrigin

/// Least eigenvalue of h on the directions of a basis, in units in which it is equilibrated;
/// +infinity without directions. Zero where the sign is that of entries of the basis which may be
/// rounding.
double smallest_curvature(const MatrixXd& h, const MatrixXd& basis) {
  if (basis.cols() == 0) return std::numeric_limits<double>::infinity();
  const auto smallest = [&](const MatrixXd& directions) {
    const MatrixXd reduced = directions.transpose() * h * directions;
    const VectorXd d = equilibration(reduced);
    return symmetric_eigenvalues(d.asDiagonal() * reduced * d.asDiagonal())[0];
  };
  constexpr double kRoundings = 1e-12;  // of a direction of length one
  const double given = smallest(basis);
  const double rounded = smallest((basis.cwiseAbs().array() > kRoundings).select(basis, 0.0));
  return (given < 0.0) == (rounded < 0.0) ? given : 0.0;
}

class CertificateJudge {
 public:
  CertificateJudge(Problem& problem, const SolverOptions& options, const Result& result,
                   std::uint64_t seed)
      : problem_(problem),
        s_(problem.structure()),
        options_(options),
        sigma_(result.objective_scale < 0.0 ? -1.0 : 1.0),
        given_(map(result.v)),
        lambda_(sigma_ * map(result.lambda)),
        z_(sigma_ * (map(result.z_upper) - map(result.z_lower))),
        random_(seed) {
    for (std::size_t i = 0; i < result.v.size(); ++i) {
      const auto place = static_cast<Eigen::Index>(i);
      if (s_.variable_lower[i] == s_.variable_upper[i]) {
        given_[place] = s_.variable_lower[i];
        continue;
      }
      (s_.variable_players[i] == Player::Min ? x_ : y_).push_back(place);
    }
    free_ = x_;
    free_.insert(free_.end(), y_.begin(), y_.end());
  }

  CertificateJudgement run() {
    CertificateJudgement best = doubtful("no active set leads to a solution near by");
    for (const bool relaxed : {false, true}) {
      list_rows(relaxed);
      std::set<std::vector<std::size_t>> tried;
      const auto confirms = [&](const std::vector<std::size_t>& active, bool is_guess) {
        if (!tried.insert(active).second) return false;
        const CertificateJudgement found = judge(active);
        const bool confirmed = found.verdict == CertificateVerdict::Confirmed;
        // Only the answer's own active set, where it is clear, refutes anything, and no other guess
        // at which the signs are right.
        const bool first = is_guess && tried.size() == 1;
        if (confirmed || (first && best.verdict == CertificateVerdict::Doubtful)) best = found;
        if (found.signs_are_right && best.verdict == CertificateVerdict::False) best = found;
        return confirmed;
      };
      // In the rows' own units, too.
      const auto clear = guess(1e-2, false);
      const bool is_clear =
          clear == guess(1e2, false) && clear == guess(1e-2) && clear == guess(1e2);
      std::vector<std::vector<std::size_t>> guesses;
      for (const double threshold : {1.0, 1e2, 1e-2, 1e4, 1e-4, 1e7, 1e-7}) {
        guesses.push_back(guess(threshold));
        if (confirms(guesses.back(), is_clear)) return best;
      }
      for (const auto& active : guesses) {
        for (std::size_t i = 0; i < rows_.size(); ++i) {
          for (std::size_t j = 0; j <= i; ++j) {
            if (confirms(flipped(flipped(active, i), i == j ? rows_.size() : j), false)) {
              return best;
            }
          }
        }
      }
      if (options_.bound_relax_factor == 0.0) break;
    }
    return best;
  }

 private:
  static VectorXd map(const std::vector<double>& values) {
    return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  }
  static CertificateJudgement doubtful(const std::string& why) {
    return {.verdict = CertificateVerdict::Doubtful, .why = why};
  }
  static CertificateJudgement weak_signs(const std::string& why) {
    return {.verdict = CertificateVerdict::Doubtful, .why = why, .signs_are_right = true};
  }

  void list_rows(bool relaxed) {
    const auto relaxation = [&](double bound, double width) {
      double size = std::max(1.0, std::abs(bound));
      if (width > 0.0) size = std::min(size, 100.0 * width);
      return relaxed ? std::min(options_.bound_relax_factor * size, options_.constr_viol_tol) : 0.0;
    };
    rows_ = testing::rows_of(s_, free_, options_.nlp_lower_bound_inf, options_.nlp_upper_bound_inf,
                             relaxation);
  }

  /// Equations, and inequalities whose multiplier is at least threshold times their distance;
  /// scaled: with gradients of length 1.
  [[nodiscard]] std::vector<std::size_t> guess(double threshold, bool scaled = true) {
    const DenseEvaluation here(problem_, given_);
    std::vector<std::size_t> active;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Row& row = rows_[k];
      const double length =
          row.is_variable || !scaled ? 1.0 : here.jacobian.row(row.index).lpNorm<Eigen::Infinity>();
      const double distance = std::abs(row.bound - row.value(given_, here.constraints));
      const double multiplier =
          row.wanted(row.is_variable ? z_[row.index] : lambda_[row.index]) * length;
      if (row.side == 0.0 || multiplier * length > threshold * distance) active.push_back(k);
    }
    return active;
  }

  /// With inequality i instead of without it, or the other way round.
  [[nodiscard]] std::vector<std::size_t> flipped(std::vector<std::size_t> active,
                                                 std::size_t i) const {
    if (i >= rows_.size() || rows_[i].side == 0.0) return active;
    const auto place = std::ranges::lower_bound(active, i);
    if (place != active.end() && *place == i) {
      active.erase(place);
    } else {
      active.insert(place, i);
    }
    return active;
  }

  /// A point on an active set with its multipliers, one for each active row.
  struct State {
    VectorXd v, multipliers;
  };
  struct System {
    VectorXd gradient;  ///< of the Lagrangian, n
    VectorXd violation;
    MatrixXd hessian, rows;  ///< n x n, active x n
    VectorXd g;
    VectorXd terms;  ///< n, sums of the gradient's terms without signs
    double f = 0.0;
  };

  [[nodiscard]] bool evaluate(const std::vector<std::size_t>& active, const State& z, System& out) {
    if (!z.v.allFinite() || !z.multipliers.allFinite()) return false;
    const DenseEvaluation here(problem_, z.v);
    if (!here.ok) return false;
    const Eigen::Index n = z.v.size(), k = static_cast<Eigen::Index>(active.size());
    out.f = sigma_ * here.objective;
    out.g = here.constraints;
    out.gradient = sigma_ * here.gradient;
    out.terms = out.gradient.cwiseAbs();
    out.rows.setZero(k, n);
    out.violation.setZero(k);
    VectorXd lambda = VectorXd::Zero(here.constraints.size());
    for (Eigen::Index a = 0; a < k; ++a) {
      const Row& row = rows_[active[static_cast<std::size_t>(a)]];
      if (row.is_variable) {
        out.rows(a, row.index) = 1.0;
      } else {
        out.rows.row(a) = here.jacobian.row(row.index);
        lambda[row.index] += z.multipliers[a];
      }
      out.violation[a] = row.value(z.v, here.constraints) - row.bound;
      const VectorXd part = z.multipliers[a] * out.rows.row(a).transpose();
      out.gradient += part;
      out.terms += part.cwiseAbs();
    }
    out.hessian = dense_hessian(problem_, z.v, sigma_, lambda);
    return out.hessian.allFinite() && out.gradient.allFinite();
  }

  /// One Newton step in the variables given on the rows given (places within active).
  [[nodiscard]] bool newton_step(const System& here, const Places& variables, const Places& rows,
                                 State& z, double& length) const {
    const auto n = static_cast<Eigen::Index>(variables.size());
    const auto k = static_cast<Eigen::Index>(rows.size());
    VectorXd rhs(n + k);
    rhs << -here.gradient(variables), -here.violation(rows);
    if (n + k == 0) {
      length = 0.0;
      return true;
    }
    const MatrixXd kkt =
        kkt_matrix<double>(here.hessian(variables, variables), here.rows(rows, variables));
    const VectorXd step = solve_symmetric(kkt, rhs);
    if (!step.allFinite()) return false;
    length = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index place = variables[static_cast<std::size_t>(i)];
      length = std::max(length, std::abs(step[i]) / (1e-3 + std::abs(given_[place])));
      z.v[place] += step[i];
    }
    for (Eigen::Index a = 0; a < k; ++a) {
      z.multipliers[rows[static_cast<std::size_t>(a)]] += step[n + a];
    }
    return true;
  }

  /// Newton's method until its steps are rounding.
  [[nodiscard]] bool newton(const std::vector<std::size_t>& active, const Places& variables,
                            const Places& rows, State& z, bool* contracts = nullptr) {
    System here;
    double last = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kMostNewtonSteps; ++k) {
      if (!evaluate(active, z, here)) return false;
      double length = 0.0;
      if (!newton_step(here, variables, rows, z, length)) return false;
      if (contracts && k == 1) *contracts = length <= kContracts * last;
      if (length <= 1e-14 || (last <= 1e-9 && length >= 0.1 * last)) return true;
      last = length;
    }
    return last <= 1e-9;
  }

  [[nodiscard]] CertificateJudgement judge(const std::vector<std::size_t>& active) {
    State z{given_, VectorXd::Zero(static_cast<Eigen::Index>(active.size()))};
    Places all_rows;
    for (std::size_t a = 0; a < active.size(); ++a) {
      const Row& row = rows_[active[a]];
      z.multipliers[static_cast<Eigen::Index>(a)] =
          row.is_variable ? z_[row.index] : lambda_[row.index];
      all_rows.push_back(static_cast<Eigen::Index>(a));
    }
    bool contracts = true;
    if (!newton(active, free_, all_rows, z, &contracts))
      return doubtful("Newton's method does not converge");
    System here;
    if (!evaluate(active, z, here)) return doubtful("undefined at the solution");
    // Far is where Newton's method does not say at once that the solution is there.
    if (!contracts && max_norm(z.v - given_) > kNear * (kOrigin + max_norm(given_))) {
      return doubtful("the next solution is far: " + std::to_string(max_norm(z.v - given_)));
    }
    CertificateJudgement found = judge_solution(active, z, here);
    // It may be another solution than the one that is meant: beside large variables a short way is
    // long.
    const bool moved = max_norm(z.v - given_) > kAtOnce * (kOrigin + max_norm(given_));
    if (!contracts && moved && found.verdict == CertificateVerdict::False) {
      found.verdict = CertificateVerdict::Doubtful;
    }
    if (found.verdict != CertificateVerdict::False) return found;
    if (found.wrong_row ? leads_on(active, z, *found.wrong_row) : has_neighbour(active, z)) {
      return doubtful("the solution is beyond this one: " + found.why);
    }
    return found;
  }

  /// Whether Newton's method from z on the active set ends in a solution that is no farther than
  /// reach (over |v| + kOrigin) from the given point, and what it is.
  [[nodiscard]] bool solves(const std::vector<std::size_t>& active, double reach, State& z,
                            CertificateJudgement& found) {
    Places all_rows(active.size());
    std::iota(all_rows.begin(), all_rows.end(), 0);
    System here;
    if (!newton(active, free_, all_rows, z) || !evaluate(active, z, here)) return false;
    if (max_norm(z.v - given_) > reach * (kOrigin + max_norm(given_))) return false;
    found = judge_solution(active, z, here);
    return true;
  }

  /// A multiplier of the wrong sign or a violated row refutes the guess of the active set; whether
  /// the claim is false shows where the active-set method ends that begins with that row.
  [[nodiscard]] bool leads_on(std::vector<std::size_t> active, State z, std::size_t row) {
    for (int k = 0; k < kMostFlips; ++k) {
      const std::vector<std::size_t> before = active;
      const VectorXd multipliers = z.multipliers;
      active = flipped(before, row);
      z.multipliers = multipliers_on(active, before, multipliers);
      State from_given{given_, z.multipliers};
      CertificateJudgement found;
      if (!solves(active, kReach, z, found)) {
        z = from_given;
        if (!solves(active, kReach, z, found)) return false;
      }
      if (found.verdict == CertificateVerdict::Confirmed) return true;
      if (!found.wrong_row) return false;
      row = *found.wrong_row;
    }
    return false;
  }

  /// Newton's method may end at the saddle between two solutions that are both near.
  [[nodiscard]] bool has_neighbour(const std::vector<std::size_t>& active, const State& z) {
    for (const Eigen::Index i : free_) {
      for (const double step : {1e-8, -1e-8, 1e-6, -1e-6, 1e-4, -1e-4}) {
        State moved = z;
        moved.v[i] += step * (1.0 + std::abs(z.v[i]));
        CertificateJudgement found;
        if (solves(active, kNear, moved, found) && found.verdict == CertificateVerdict::Confirmed) {
          return true;
        }
      }
    }
    return false;
  }

  [[nodiscard]] CertificateJudgement judge_solution(const std::vector<std::size_t>& active,
                                                    const State& z, const System& here) {
    std::vector<bool> is_active(rows_.size(), false), weak(active.size(), false);
    bool weak_max = false;
    for (std::size_t a = 0; a < active.size(); ++a) {
      const Row& row = rows_[active[a]];
      is_active[active[a]] = true;
      if (row.side == 0.0) continue;
      const double multiplier = row.wanted(z.multipliers[static_cast<Eigen::Index>(a)]);
      const double share = share_of(here, z.v, static_cast<Eigen::Index>(a), multiplier);
      if (share < -kWeak) {
        return are_independent(active, here, row.owner)
                   ? wrong("a multiplier of the wrong sign", active[a])
                   : doubtful("dependent gradients: other multipliers may have the right sign");
      }
      weak[a] = share <= kWeak;
      weak_max = weak_max || (weak[a] && row.owner == Player::Max);
    }
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Row& row = rows_[k];
      if (is_active[k]) continue;
      const double distance = row.distance(z.v, here.g);
      if (distance >= -kOutside * (1.0 + std::abs(row.bound))) continue;
      if (distance < -moved_by_relaxation(row, z.v)) return wrong("outside of a bound", k);
      return doubtful("outside of a bound by what bounds are relaxed by");
    }
    if (const auto touched = touching(active, z, here); touched != active) {
      State wider{z.v, multipliers_on(touched, active, z.multipliers)};
      System there;
      if (!evaluate(touched, wider, there)) return doubtful("undefined at the solution");
      return judge_solution(touched, wider, there);
    }
    System certain = here;
    certain.hessian = certain_entries(active, z, here);
    const CertificateJudgement found = judge_curvature(active, z, certain, weak, weak_max);
    // Beside a pole all is uncertain: what was left out may be what holds.
    if (found.verdict == CertificateVerdict::False &&
        judge_curvature(active, z, here, weak, weak_max).verdict != CertificateVerdict::False) {
      return doubtful("with second derivatives that rounding may make: " + found.why);
    }
    if (found.verdict == CertificateVerdict::Confirmed || !has_pulling(active, z, here, weak)) {
      return found;
    }
    return weak_signs("a multiplier that is little but not zero: " + found.why);
  }

  /// With the inequalities that are zero away without a multiplier.
  [[nodiscard]] std::vector<std::size_t> touching(std::vector<std::size_t> active, const State& z,
                                                  const System& here) const {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const double distance = rows_[k].distance(z.v, here.g);
      if (std::abs(distance) > kTouching * (1.0 + std::abs(rows_[k].bound))) continue;
      const auto place = std::ranges::lower_bound(active, k);
      if (place == active.end() || *place != k) active.insert(place, k);
    }
    return active;
  }
  [[nodiscard]] static VectorXd multipliers_on(const std::vector<std::size_t>& active,
                                               const std::vector<std::size_t>& before,
                                               const VectorXd& multipliers) {
    VectorXd on = VectorXd::Zero(static_cast<Eigen::Index>(active.size()));
    for (std::size_t a = 0; a < active.size(); ++a) {
      const auto place = std::ranges::lower_bound(before, active[a]);
      if (place == before.end() || *place != active[a]) continue;
      on[static_cast<Eigen::Index>(a)] = multipliers[place - before.begin()];
    }
    return on;
  }

  /// Second derivatives without those that rounding of the point and of its multipliers makes.
  [[nodiscard]] MatrixXd certain_entries(const std::vector<std::size_t>& active, const State& z,
                                         const System& here) {
    MatrixXd certain = here.hessian;
    for (const double sign : {1.0, -1.0}) {
      State near = z;
      near.v.array() += sign * kRounding * (z.v.array().abs() + kOrigin);
      for (Eigen::Index a = 0; a < near.multipliers.size(); ++a) {
        Eigen::Index most = 0;
        const double length = here.rows.row(a).cwiseAbs().maxCoeff(&most);
        const double balanced = length > 0.0 ? here.terms[most] / length : 0.0;
        near.multipliers[a] += sign * kRounding * (std::abs(z.multipliers[a]) + balanced);
      }
      System there;
      if (!evaluate(active, near, there)) continue;
      const auto change = (there.hessian - here.hessian).cwiseAbs().array();
      certain = (change >= certain.cwiseAbs().array()).select(0.0, certain);
    }
    return certain;
  }

  /// What a row may be violated by at a point that is moved back from relaxed bounds of variables.
  [[nodiscard]] double moved_by_relaxation(const Row& row, const VectorXd& v) {
    const double own = options_.bound_relax_factor * (1.0 + std::abs(row.bound));
    if (row.is_variable) return own;
    const DenseEvaluation here(problem_, v);
    const VectorXd size = v.cwiseAbs().cwiseMax(1.0);
    return own + 2.0 * options_.bound_relax_factor *
                     here.jacobian.row(row.index).cwiseAbs().dot(size.transpose());
  }

  /// Of the multipliers that count as zero, whether one is not beside variables of their own sizes,
  /// however small these are.
  [[nodiscard]] bool has_pulling(const std::vector<std::size_t>& active, const State& z,
                                 const System& here, const std::vector<bool>& weak) const {
    for (std::size_t a = 0; a < active.size(); ++a) {
      if (!weak[a]) continue;
      const auto place = static_cast<Eigen::Index>(a);
      const double multiplier = rows_[active[a]].wanted(z.multipliers[place]);
      if (share_of(here, z.v, place, multiplier, kSmallest) > kCertain) return true;
    }
    return false;
  }

  /// Where the way down from a saddle ends, too near to be told from it: a bound of Min, or one
  /// that holds him by no multiplier.
  [[nodiscard]] bool is_next_to_a_bound(const std::vector<std::size_t>& active, const State& z,
                                        const System& here, const std::vector<bool>& weak) const {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Row& row = rows_[k];
      if (row.owner == Player::Max) continue;
      const auto place = std::ranges::lower_bound(active, k);
      if (place != active.end() && *place == k) {
        if (weak[static_cast<std::size_t>(place - active.begin())]) return true;
        continue;
      }
      const double distance = row.distance(z.v, here.g);
      if (distance <= kNear * (kOrigin + max_norm(z.v))) return true;
    }
    return false;
  }

  /// A multiplier's share, with its sign, in the terms that it balances: those of the gradient, and
  /// what the gradient changes by over a small part of the point.
  [[nodiscard]] static double share_of(const System& here, const VectorXd& v, Eigen::Index row,
                                       double multiplier, double origin = kOrigin) {
    const VectorXd size = v.cwiseAbs().array() + origin;
    const VectorXd change = here.hessian.cwiseAbs() * size;
    double share = 0.0;
    for (Eigen::Index i = 0; i < here.rows.cols(); ++i) {
      const double part = std::abs(here.rows(row, i));
      const double terms = here.terms[i] + change[i];
      if (part > 0.0 && terms > 0.0) share = std::max(share, part / terms);
    }
    return share * multiplier;
  }

  [[nodiscard]] Places rows_of(const std::vector<std::size_t>& active, Player owner,
                               const std::vector<bool>* without) const {
    Places places;
    for (std::size_t a = 0; a < active.size(); ++a) {
      if (rows_[active[a]].owner != owner || (without && (*without)[a])) continue;
      places.push_back(static_cast<Eigen::Index>(a));
    }
    return places;
  }

  /// Gradients of one player's active rows in his variables.
  [[nodiscard]] bool are_independent(const std::vector<std::size_t>& active, const System& here,
                                     Player owner) const {
    bool independent = true;
    const Places rows = rows_of(active, owner, nullptr);
    static_cast<void>(null_space_of_directions<double>(
        here.rows(rows, owner == Player::Min ? x_ : y_), independent));
    return independent;
  }

  [[nodiscard]] CertificateJudgement judge_curvature(const std::vector<std::size_t>& active,
                                                     const State& z, const System& here,
                                                     const std::vector<bool>& weak, bool weak_max) {
    bool independent = true;
    const Places strong = rows_of(active, Player::Max, &weak);
    const double inner =
        smallest_curvature(-here.hessian(y_, y_),
                           null_space_of_directions<double>(here.rows(strong, y_), independent));
    // With dependent gradients other multipliers may be right, or nothing else be feasible.
    if (!independent) return doubtful("dependent gradients of the maximizer");
    if (inner < -kSign) return wrong("inner curvature " + text(-inner));
    if (inner <= kSign) return weak_signs("inner curvature " + text(-inner));
    if (x_.empty()) return sample(active, z, here, inner);
    double outer = std::numeric_limits<double>::infinity();
    for (const bool with_weak : {false, true}) {
      const Places max_rows = rows_of(active, Player::Max, with_weak ? nullptr : &weak);
      static_cast<void>(null_space_of_directions<double>(here.rows(max_rows, y_), independent));
      if (!independent) return doubtful("dependent gradients of the maximizer");
      const MatrixXd schur = complement(here, max_rows);
      const Places min_rows = rows_of(active, Player::Min, &weak);
      const MatrixXd basis = null_space_of_directions<double>(here.rows(min_rows, x_), independent);
      // With dependent gradients of the minimizer other multipliers may be right.
      const double curvature = smallest_curvature(schur, basis);
      if (!independent && curvature < -kSign) {
        return doubtful("dependent gradients of the minimizer");
      }
      outer = std::min(outer, curvature);
      if (!weak_max) break;
    }
    if (outer < -kSign && is_next_to_a_bound(active, z, here, weak)) {
      return doubtful("a saddle next to a bound");
    }
    if (outer < -kSign) return wrong("outer curvature " + text(outer));
    if (outer <= kSign) return weak_signs("outer curvature " + text(outer));
    return sample(active, z, here, std::min(inner, outer));
  }

  [[nodiscard]] MatrixXd complement(const System& here, const Places& max_rows) const {
    return schur_complement<double>(here.hessian, here.rows(max_rows, Eigen::all), x_, y_);
  }

  // --- Values ------------------------------------------------------------------------------------
  /// Of what values are sums of, as far as f and its slopes show.
  [[nodiscard]] double size_of_values(const System& here, const VectorXd& v) {
    return 1.0 + std::abs(here.f) + here.terms.dot(v.cwiseAbs()) + noise(here, v) / kRounding;
  }
  /// What values of f differ by at points that differ by rounding: where large terms cancel it is
  /// much more than rounding of f.
  [[nodiscard]] double noise(const System& here, const VectorXd& v) {
    constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
    double most = 0.0;
    for (int k = 0; k < 8; ++k) {
      VectorXd near = v;
      for (double& value : near) value *= 1.0 + kEpsilon * std::round(3.0 * normal());
      const DenseEvaluation there(problem_, near);
      if (there.ok) most = std::max(most, std::abs(sigma_ * there.objective - here.f));
    }
    return most;
  }
  [[nodiscard]] double normal() { return std::normal_distribution<double>()(random_); }

  /// Values along curves on the active set and at random feasible points agree with the verdict.
  [[nodiscard]] CertificateJudgement sample(const std::vector<std::size_t>& active, const State& z,
                                            const System& here, double curvature) {
    for (int k = 0; k < 3; ++k) {
      if (!y_.empty() && !changes(active, z, here, Player::Max)) {
        return wrong("the value rises over y");
      }
      if (!x_.empty() && !changes(active, z, here, Player::Min)) {
        return wrong("the inner maximum falls over x");
      }
    }
    if (!none_better(z, here)) return wrong("a better point was drawn");
    return {.verdict = CertificateVerdict::Confirmed, .why = "curvature " + text(curvature)};
  }

  /// Along a random tangent of one player's active rows in both directions, the maximizer following
  /// where x moves: whether f changes by what the curvature predicts. False needs the three
  /// shortest lengths at which rounding does not hide the change to agree: far away higher
  /// derivatives make it.
  [[nodiscard]] bool changes(const std::vector<std::size_t>& active, const State& z,
                             const System& here, Player mover) {
    const Places own = rows_of(active, mover, nullptr);
    const Places& variables = mover == Player::Min ? x_ : y_;
    const Places max_rows = rows_of(active, Player::Max, nullptr);
    const MatrixXd h =
        mover == Player::Min ? complement(here, max_rows) : MatrixXd(-here.hessian(y_, y_));
    bool independent = true;
    const MatrixXd basis = null_space_of_directions<double>(here.rows(own, variables), independent);
    if (basis.cols() == 0) return true;
    const VectorXd weights = VectorXd::NullaryExpr(basis.cols(), [&] { return normal(); });
    const VectorXd d = equilibration<double>(basis.transpose() * h * basis);
    const VectorXd direction = basis * VectorXd(d.asDiagonal() * weights / weights.norm());
    const double slope = direction.dot(h * direction);
    double last = std::numeric_limits<double>::quiet_NaN();
    int equal = 0;
    // Where there is little curvature its length may be many periods of the function.
    double longest = 1.0;
    for (std::size_t i = 0; i < variables.size(); ++i) {
      const double size = std::max(std::abs(z.v[variables[i]]), kOrigin);
      longest = std::min(longest, size / std::abs(direction[static_cast<Eigen::Index>(i)]));
    }
    for (double length = 0.1 * longest; length > 1e-9 * longest; length *= 0.1) {
      const double predicted = length * length * slope;
      if (!(predicted > 100.0 * kRounding * size_of_values(here, z.v))) break;
      double change = 0.0;
      bool defined = true;
      for (const double sign : {1.0, -1.0}) {
        State moved = z;
        for (std::size_t i = 0; i < variables.size(); ++i) {
          moved.v[variables[i]] += sign * length * direction[static_cast<Eigen::Index>(i)];
        }
        System there;
        defined = defined && return_to(active, own, variables, z, moved) &&
                  (mover == Player::Max || y_.empty() || newton(active, y_, max_rows, moved)) &&
                  evaluate(active, moved, there);
        change += (mover == Player::Min ? 1.0 : -1.0) * (there.f - here.f);
      }
      if (!defined) continue;
      const double share = change / predicted;
      if (share >= kShareOfGain) return true;
      equal = std::abs(share - last) <= 0.1 * std::abs(share) ? equal + 1 : 0;
      last = share;
    }
    return equal < 2 || last > 0.0;
  }

  /// Moves the variables back to the rows. False where that is farther than they are from z.
  [[nodiscard]] bool return_to(const std::vector<std::size_t>& active, const Places& rows,
                               const Places& variables, const State& from, State& z) {
    if (rows.empty()) return true;
    const VectorXd start = z.v;
    for (int k = 0; k < 20; ++k) {
      System here;
      if (!evaluate(active, z, here)) return false;
      const VectorXd violation = here.violation(rows);
      const MatrixXd a = here.rows(rows, variables);
      const VectorXd step = least_squares(a, -violation);
      if (!step.allFinite()) return false;
      z.v(variables) += step;
      if (max_norm(step) <= 1e-15 * (1.0 + max_norm(z.v))) break;
    }
    return (z.v - start).norm() <= 0.5 * (start - from.v).norm();
  }

  /// Random feasible points of one player alone: of Max with x fixed, or of Min without Max. A
  /// better one counts when the way back from it to z is better as long as rounding does not hide
  /// it.
  [[nodiscard]] bool none_better(const State& z, const System& here) {
    const bool max = !y_.empty();
    const Places& variables = max ? y_ : x_;
    const double visible = 1000.0 * kRounding * size_of_values(here, z.v);
    for (int k = 0; k < 20; ++k) {
      VectorXd step = VectorXd::Zero(z.v.size());
      for (const Eigen::Index i : variables) step[i] = normal();
      step *= std::pow(10.0, -2.0 - static_cast<double>(k % 5));
      // Where f falls to first order its gain ends before z, be it where rounding hides that.
      const VectorXd pulls = z.multipliers.cwiseProduct(here.rows * step);
      if ((max ? 1.0 : -1.0) * pulls.sum() > 1e-9 * pulls.cwiseAbs().sum()) continue;
      bool better = false;
      double last = 0.0;
      for (int part = 0; part < 8; ++part, step *= 0.1) {
        const DenseEvaluation there(problem_, z.v + step);
        if (!there.ok || !is_inside(z.v + step, there.constraints)) {
          better = false;  // beyond a gap
          break;
        }
        const double gain = (max ? 1.0 : -1.0) * (sigma_ * there.objective - here.f);
        if (std::abs(gain) <= visible + 2.0 * max_norm(here.gradient) * step.norm()) break;
        // Gains of higher derivatives shrink faster than with the square of the distance.
        better = gain > 0.0 && last > 0.0 && last <= 300.0 * gain;
        if (gain <= 0.0) break;
        last = gain;
      }
      if (better && !falls_next_to(z, here, step, max ? sigma_ : -sigma_)) return false;
    }
    return true;
  }
  /// Where rounding hides values slopes still show, along a step that gets shorter: whether z is
  /// better than what is next to it, though by less than what is gained beyond.
  [[nodiscard]] bool falls_next_to(const State& z, const System& here, VectorXd step, double sign) {
    for (int part = 0; part < 6; ++part, step *= 0.1) {
      const DenseEvaluation there(problem_, z.v + step);
      const double noise = 100.0 * kRounding * here.terms.dot(step.cwiseAbs());
      if (there.ok && sign * there.gradient.dot(step) < -noise) return true;
    }
    return false;
  }
  [[nodiscard]] bool is_inside(const VectorXd& v, const VectorXd& g) const {
    return std::ranges::all_of(rows_, [&](const Row& row) {
      const double off = row.value(v, g) - row.bound;
      return row.side == 0.0 ? off == 0.0 : row.side * off <= 0.0;
    });
  }

  static std::string text(double value) {
    std::ostringstream out;
    out.precision(4);
    out << value;
    return out.str();
  }
  static CertificateJudgement wrong(const std::string& why,
                                    std::optional<std::size_t> row = std::nullopt) {
    return {.verdict = CertificateVerdict::False, .why = why, .wrong_row = row};
  }

  Problem& problem_;
  const ProblemStructure& s_;
  const SolverOptions& options_;
  double sigma_;
  VectorXd given_, lambda_, z_;
  std::mt19937_64 random_;
  Places x_, y_, free_;
  std::vector<Row> rows_;
};

}  // namespace

CertificateJudgement judge_certificate(Problem& problem, const SolverOptions& options,
                                       const Result& result, std::uint64_t seed) {
  return CertificateJudge(problem, options, result, seed).run();
}

}  // namespace ipminmax::testing
