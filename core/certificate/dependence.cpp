#include "core/certificate/dependence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/parameters.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/products.hpp"
#include "core/point/residual.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

class DependenceSearch {
 public:
  DependenceSearch(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                   const SolverOptions& options)
      : canonical_(canonical), system_(system), point_(point), options_(options) {}

  Dependences run();

 private:
  void take_gradients();
  void normalize();
  [[nodiscard]] bool factorize();
  [[nodiscard]] bool next_null_vector(int number, Eigen::VectorXd& w);
  [[nodiscard]] std::vector<Dependence> reduce();
  [[nodiscard]] double length_of(const Eigen::VectorXd& w) const;
  void examine(Dependence& dependence);
  [[nodiscard]] bool consistent(const Eigen::VectorXd& weights, double& value) const;
  [[nodiscard]] bool constant(const Eigen::VectorXd& weights, double value, bool of_max);
  [[nodiscard]] Eigen::VectorXd moved(int trial, double length, bool of_max) const;
  void join_copies(Eigen::VectorXd& v) const;
  [[nodiscard]] double size_of(const Eigen::VectorXd& weights, const Eigen::VectorXd& v) const;
  [[nodiscard]] bool same_owner(Index row, Index col) const {
    return canonical_.owned_by_max(col) == canonical_.max_constraints().contains(row);
  }

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const Point& point_;
  const SolverOptions& options_;
  Evaluation rows_;             ///< gradients of length one in the owner's free variables
  std::vector<bool> vanishes_;  ///< of each row, in all its owner's variables
  Eigen::VectorXd factor_;      ///< of each row, to the canonical constraint
  std::vector<Eigen::VectorXd> null_;
};

/// In units. Of a robust constraint the gradient of its own maximum: x moves a trajectory through
/// Max's equations.
void DependenceSearch::take_gradients() {
  rows_ = system_.derivatives();
  std::ranges::fill(rows_.hessian, 0.0);
  if (!canonical_.has_copies()) return;
  row_jacobian(canonical_, point_.iterate, point_.evaluation, rows_.jacobian);
  const Units& units = system_.units();
  for (std::size_t k = 0; k < rows_.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    rows_.jacobian[k] *= units.constraint[row] * units.variable[col];
  }
}

void DependenceSearch::normalize() {
  take_gradients();
  vanishes_.assign(at(canonical_.constraints()), true);
  Eigen::VectorXd free = Eigen::VectorXd::Zero(canonical_.constraints()), all = free;
  // Units of a robust constraint may be those of its worst case.
  Eigen::VectorXd least = Eigen::VectorXd::Ones(canonical_.constraints());
  for (const auto& [row, col] : canonical_.jacobian()) {
    if (canonical_.min_constraints().contains(row) && !same_owner(row, col)) least[row] = 0.0;
  }
  for (std::size_t k = 0; k < rows_.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    double& value = rows_.jacobian[k];
    if (!system_.counts(row) || !same_owner(row, col)) value = 0.0;
    if (std::abs(value) > parameter::kZero * least[row]) vanishes_[at(row)] = false;
    all[row] += value * value;
    if (system_.is_fixed(col)) value = 0.0;
    free[row] += value * value;
  }
  factor_.setOnes(canonical_.constraints());
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const double length = std::sqrt(free[j]);
    const double full = std::sqrt(all[j]);
    const bool none = length <= parameter::kDependent * std::max(full, least[j]);
    factor_[j] = none ? 0.0 : 1.0 / length;
  }
  for (std::size_t k = 0; k < rows_.jacobian.size(); ++k) {
    rows_.jacobian[k] *= factor_[canonical_.jacobian()[k].row];
  }
  for (double& factor : factor_) {
    if (factor == 0.0) factor = 1.0;
  }
}

bool DependenceSearch::factorize() {
  Eigen::VectorXd curvature = Eigen::VectorXd::Constant(canonical_.variables(), 1.0);
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (canonical_.slack_of(j) >= 0 && system_.counts(j))
      curvature[canonical_.slack_of(j)] = parameter::kRigid;
  }
  KktSystem& kkt = system_.kkt();
  kkt.assemble(rows_, curvature, system_.left_out());
  const Regularization relaxed{.lambda_x = parameter::kRelaxation,
                               .lambda_y = parameter::kRelaxation};
  return kkt.factorize_for_solutions(relaxed).status == FactorizationStatus::Ok;
}

/// Inverse iteration from a vector of its own, orthogonal to those found.
bool DependenceSearch::next_null_vector(int number, Eigen::VectorXd& w) {
  NewtonResidual rhs = zero_step(canonical_);
  Step step = zero_step(canonical_);
  w.setZero(canonical_.constraints());
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) w[j] = std::sin(1.0 + number + 1.7 * (number + 1) * j);
  }
  const auto orthogonalize = [&] {
    for (const Eigen::VectorXd& other : null_) w -= other.dot(w) * other;
  };
  orthogonalize();
  // To rounding: constraints that follow from others are known by a sum that stays what it is.
  for (int k = 0; k < 2 || (k < parameter::kFew && length_of(w) > parameter::kRounding); ++k) {
    const double before = w.norm();
    if (!(before > 0.0)) return false;
    rhs.lambda = w;
    // Its accuracy is that of the null vector, which is tested.
    static_cast<void>(system_.kkt().solve(rows_, rhs, step, kUnrefined));
    w = step.lambda;
    for (Index j = 0; j < w.size(); ++j) {
      if (!system_.counts(j)) w[j] = 0.0;
    }
    orthogonalize();
    const double norm = w.norm();
    if (!std::isfinite(norm) || norm * parameter::kRelaxation < parameter::kSlight * before)
      return false;
    w /= norm;
  }
  // Short but not zero, as the states of long or unstable trajectories make it: each step has made
  // what is dependent grow beside it.
  return length_of(w) < parameter::kClearlyIndependent;
}

/// Length of the combination of gradients of a vector of length one.
double DependenceSearch::length_of(const Eigen::VectorXd& w) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(canonical_.variables());
  add_transposed_product(canonical_, rows_, w, sum);
  return sum.norm();
}

/// Each null vector gets a row of its own: Gauss and Jordan with the largest pivots.
std::vector<Dependence> DependenceSearch::reduce() {
  std::vector<Dependence> found;
  std::vector<Eigen::VectorXd> rest = null_;
  for (std::size_t k = 0; k < rest.size(); ++k) {
    std::size_t best = k;
    Index row = 0;
    double largest = -1.0;
    for (std::size_t other = k; other < rest.size(); ++other) {
      Index here = 0;
      const double size = rest[other].cwiseAbs().maxCoeff(&here);
      if (size > largest) best = other, row = here, largest = size;
    }
    std::swap(rest[k], rest[best]);
    rest[k] /= rest[k][row];
    for (std::size_t other = 0; other < rest.size(); ++other) {
      if (other == k) continue;
      const double multiple = rest[other][row];
      rest[other] -= multiple * rest[k];
      rest[other][row] = 0.0;
    }
    found.push_back({.row = row, .weights = {}});
  }
  for (std::size_t k = 0; k < rest.size(); ++k) {
    found[k].weights = rest[k].cwiseProduct(factor_).cwiseProduct(system_.units().constraint);
    found[k].weights /= found[k].weights[found[k].row];
  }
  return found;
}

/// Rounding of the combination of constraints at v.
double DependenceSearch::size_of(const Eigen::VectorXd& weights, const Eigen::VectorXd& v) const {
  double size = 0.01 * weights.lpNorm<1>();
  for (std::size_t k = 0; k < point_.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    size += std::abs(weights[row] * point_.evaluation.jacobian[k] * v[col]);
  }
  return size;
}

/// Zero where bounds stand at their values, within what they were relaxed by. value: at the point.
bool DependenceSearch::consistent(const Eigen::VectorXd& weights, double& value) const {
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(canonical_.variables());
  add_transposed_product(canonical_, point_.evaluation, weights, slope);
  for (Index j = 0; j < weights.size(); ++j) {
    if (canonical_.slack_of(j) >= 0) slope[canonical_.slack_of(j)] -= weights[j];
  }
  value = weights.dot(point_.evaluation.c);
  const BoundClasses& classes = system_.classes();
  double at_bounds = value;
  double allowed = parameter::kConstant * size_of(weights, point_.iterate.v);
  for (Index i = 0; i < slope.size(); ++i) {
    if (!system_.is_fixed(i) || slope[i] == 0.0 || classes.side[at(i)] == 0) continue;
    at_bounds += slope[i] * classes.side[at(i)] * classes.distance(canonical_, point_.iterate, i);
    allowed +=
        2.0 * std::abs(slope[i]) * relaxation_of(canonical_, i, classes.side[at(i)], options_);
  }
  return std::abs(at_bounds) <= allowed;
}

/// Free variables moved inside their bounds; of_max: all x, for Max's rows must agree whatever x
/// is.
Eigen::VectorXd DependenceSearch::moved(int trial, double length, bool of_max) const {
  const Units& units = system_.units();
  const double size = std::max(1.0, longest(canonical_, point_.iterate.v, units));
  Eigen::VectorXd v = point_.iterate.v;
  for (Index i = 0; i < canonical_.variables(); ++i) {
    const bool held = system_.is_fixed(i) && (canonical_.owned_by_max(i) || !of_max);
    if (held || system_.is_slack(i)) continue;
    const double most = 0.05 * std::abs(v[i]) + std::min(0.01 * units.variable[i] * size, 1.0);
    const double way = length * most * std::sin(1.0 + trial + 1.3 * (trial + 1) * i);
    const int side = system_.classes().side[at(i)];
    v[i] += system_.is_fixed(i) && side != 0 ? -side * std::abs(way) : way;
  }
  for_each_bound(canonical_, point_.iterate.v, [&](Index i, int side, double before) {
    const double most = parameter::kConfirmed * before;
    const double way = side * (v[i] - point_.iterate.v[i]);
    if (system_.is_free(i) && way > most) v[i] = point_.iterate.v[i] + side * most;
  });
  join_copies(v);
  return v;
}

/// Rows that are the same have copies of y of their own, which stand at one place: they move as one.
void DependenceSearch::join_copies(Eigen::VectorXd& v) const {
  if (!canonical_.has_copies()) return;
  const Eigen::VectorXd& here = point_.iterate.v;
  std::vector<std::vector<Index>> places;  // copies of each rank among those of their row
  std::vector<std::size_t> rank(at(canonical_.variables()), 0);
  for (Index i = canonical_.y().begin; i < canonical_.y().end; ++i) {
    const Index slack = canonical_.served_slack(i);
    if (slack < 0) continue;
    const std::size_t own = rank[at(slack)]++;
    if (own == places.size()) places.emplace_back();
    const double near = parameter::kHardly * own_size(canonical_, here[i], i, system_.units());
    const auto same = std::ranges::find_if(
        places[own], [&](Index other) { return std::abs(here[i] - here[other]) <= near; });
    if (same != places[own].end()) {
      v[i] = v[*same];
    } else {
      places[own].push_back(i);
    }
  }
}

bool DependenceSearch::constant(const Eigen::VectorXd& weights, double value, bool of_max) {
  Eigen::VectorXd c;
  for (int trial = 0; trial < parameter::kEnough; ++trial) {
    double length = 1.0;
    Eigen::VectorXd v = moved(trial, length, of_max);
    c.setZero(canonical_.constraints());
    for (int k = 0; canonical_.constraints(v, c) != EvaluationStatus::Ok; ++k) {
      if (k == parameter::kFew) return false;
      length *= 0.1;
      v = moved(trial, length, of_max);
    }
    if (!(std::abs(weights.dot(c) - value) <= parameter::kConstant * size_of(weights, v)))
      return false;
  }
  return true;
}

void DependenceSearch::examine(Dependence& dependence) {
  Eigen::VectorXd& weights = dependence.weights;
  // Rounding of the null vector.
  const double largest = weights.cwiseAbs().maxCoeff();
  for (double& weight : weights) {
    if (std::abs(weight) < parameter::kConstant * largest) weight = 0.0;
  }
  dependence.vanishing = vanishes_[at(dependence.row)];
  double value = 0.0;
  if (!consistent(weights, value)) return;
  dependence.identical =
      constant(weights, value, canonical_.max_constraints().contains(dependence.row));
}

Dependences DependenceSearch::run() {
  Dependences answer;
  Index rows = 0;
  for (Index j = 0; j < canonical_.constraints(); ++j) rows += system_.counts(j) ? 1 : 0;
  // Rows beyond the number of variables depend on others.
  const Index variables = canonical_.x().size() + canonical_.y().size();
  const Index most = std::max<Index>(
      parameter::kMany, parameter::kDependentEntries / (variables + canonical_.constraints()));
  answer.too_many = rows - variables > most;
  normalize();
  if (answer.too_many || !factorize()) {
    answer.complete = false;
    return answer;
  }
  Eigen::VectorXd w;
  while (next_null_vector(static_cast<int>(null_.size()), w)) {
    answer.too_many = static_cast<Index>(null_.size()) == most;
    answer.complete = !answer.too_many && length_of(w) <= parameter::kDependent;
    if (!answer.complete) break;
    null_.push_back(w);
  }
  answer.found = reduce();
  for (Dependence& dependence : answer.found) examine(dependence);
  return answer;
}

}  // namespace

bool Dependences::independent(const CanonicalProblem& canonical, bool max) const {
  if (!complete) return false;
  return std::ranges::none_of(found, [&](const Dependence& d) {
    return canonical.max_constraints().contains(d.row) == max;
  });
}

Dependences find_dependences(CanonicalProblem& canonical, ActiveSetSystem& system,
                             const Point& point, const SolverOptions& options) {
  return DependenceSearch(canonical, system, point, options).run();
}

}  // namespace ipminmax
