#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/trial.hpp"
#include "core/model/indices.hpp"
#include "core/model/iterate.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

struct DependenceSearch {
  TestContext& c;
  ActiveSetSystem& system;
  const Point& point;
  CanonicalProblem& canonical = c.canonical;
  const Vector& here = point.iterate.v;
  Evaluation rows =
      system.derivatives();      ///< gradients of length one in the owner's free variables
  std::vector<bool> vanishes{};  ///< of each row, in all its owner's variables
  Vector factor{};               ///< of each row, to the canonical constraint
  std::vector<Vector> null{};

  bool same_owner(Index row, Index col) const {
    return canonical.owned_by_max(col) == canonical.max_constraints().contains(row);
  }

  /// Of a robust constraint the gradient of its own maximum: x moves a trajectory through Max's
  /// equations.
  void take_gradients() {
    std::ranges::fill(rows.hessian, 0.0);
    if (!canonical.has_copies()) return;
    row_jacobian(canonical, point.iterate, point.evaluation, rows.jacobian);
    for_each_in_jacobian(canonical, rows, [&](Index row, Index col, double& value) {
      value *= system.scaling.constraint[row] * system.scaling.variable[col];
    });
  }

  void normalize() {
    take_gradients();
    vanishes.assign(at(canonical.constraints()), true);
    Vector free = Vector::Zero(canonical.constraints()), all = free;
    // The scaling of a robust constraint may be that of its worst case.
    Vector least = Vector::Ones(canonical.constraints());
    for (const auto& [row, col] : canonical.jacobian()) {
      if (canonical.min_constraints().contains(row) && !same_owner(row, col)) least[row] = 0.0;
    }
    for_each_in_jacobian(canonical, rows, [&](Index row, Index col, double& value) {
      if (!system.counts(row) || !same_owner(row, col)) value = 0.0;
      if (std::abs(value) > kZero * least[row]) vanishes[at(row)] = false;
      all[row] += value * value;
      if (system.is_fixed(col)) value = 0.0;
      free[row] += value * value;
    });
    factor.setOnes(canonical.constraints());
    for (const Index j : each_constraint(canonical)) {
      const double length = std::sqrt(free[j]);
      const bool none = length <= kDependent * std::max(std::sqrt(all[j]), least[j]);
      factor[j] = none ? 0.0 : 1.0 / length;
    }
    for_each_in_jacobian(canonical, rows,
                         [&](Index row, Index, double& value) { value *= factor[row]; });
    factor = (factor.array() == 0.0).select(1.0, factor);
  }

  bool factorize() {
    Vector curvature = Vector::Ones(canonical.variables());
    for_each_slack(canonical, [&](Index j, Index slack) {
      if (system.counts(j)) curvature[slack] = kRigid;
    });
    system.kkt.assemble(rows, curvature, system.left_out());
    return system.kkt.factorize_for_solutions({.lambda_x = kDualShift, .lambda_y = kDualShift})
               .status == FactorizationStatus::Ok;
  }

  /// Length of the combination of gradients of a vector of length one.
  double length_of(const Vector& w) const {
    Vector sum = Vector::Zero(canonical.variables());
    add_transposed_product(canonical, rows, w, sum);
    return sum.norm();
  }

  /// Inverse iteration from a vector of its own, orthogonal to those found.
  bool next_null_vector(Vector& w) {
    NewtonResidual rhs = zero_step(canonical);
    Step step = zero_step(canonical);
    const auto number = static_cast<int>(null.size());
    w.setZero(canonical.constraints());
    for (const Index j : each_constraint(canonical)) {
      if (system.counts(j)) w[j] = std::sin(1.0 + number + 1.7 * (number + 1) * j);
    }
    const auto orthogonalize = [&] {
      for (const Vector& other : null) w -= other.dot(w) * other;
    };
    orthogonalize();
    // To rounding: constraints that follow from others are known by a sum that stays what it is.
    for (int k = 0; k < 2 || (k < kNullIterations && length_of(w) > kRounding); ++k) {
      const double before = w.norm();
      if (!(before > 0.0)) return false;
      rhs.lambda = w;
      // Its accuracy is that of the null vector, which is tested.
      static_cast<void>(system.kkt.solve(rows, rhs, step, kUnrefined));
      w = step.lambda;
      for (const Index j : indices(w)) {
        if (!system.counts(j)) w[j] = 0.0;
      }
      orthogonalize();
      const double norm = w.norm();
      constexpr double kLeastGrowth = 1e-4;  // over that of a null vector
      if (!std::isfinite(norm) || norm * kDualShift < kLeastGrowth * before) return false;
      w /= norm;
    }
    // Short but not zero, as the states of long or unstable trajectories make it: each step has
    // made what is dependent grow beside it.
    return length_of(w) < kClearlyIndependent;
  }

  /// Each null vector gets a row of its own: Gauss and Jordan with the largest pivots.
  std::vector<Dependence> reduce() {
    std::vector<Dependence> found;
    std::vector<Vector>& rest = null;
    for (const auto k : indices(rest)) {
      std::size_t best = k;
      Index row = 0;
      double largest = -1.0;
      for (std::size_t other = k; other < rest.size(); ++other) {
        Index its_row = 0;
        const double size = rest[other].cwiseAbs().maxCoeff(&its_row);
        if (size > largest) best = other, row = its_row, largest = size;
      }
      std::swap(rest[k], rest[best]);
      rest[k] /= rest[k][row];
      for (const auto other : indices(rest)) {
        if (other == k) continue;
        rest[other] -= rest[other][row] * rest[k];
        rest[other][row] = 0.0;
      }
      found.push_back({.row = row, .weights = {}});
    }
    for (const auto k : indices(rest)) {
      Vector& weights = found[k].weights;
      weights = rest[k].cwiseProduct(factor).cwiseProduct(system.scaling.constraint);
      weights /= weights[found[k].row];
    }
    return found;
  }

  /// Rounding of the combination of constraints at v.
  double size_of(const Vector& weights, const Vector& v) const {
    double size = 0.01 * weights.lpNorm<1>();
    for_each_in_jacobian(canonical, point.evaluation, [&](Index row, Index col, double value) {
      size += std::abs(weights[row] * value * v[col]);
    });
    return size;
  }

  /// Zero where bounds stand at their values, within what they were relaxed by. value: at the
  /// point.
  bool consistent(const Vector& weights, double value) const {
    Vector slope = Vector::Zero(canonical.variables());
    add_transposed_product(canonical, point.evaluation, weights, slope);
    for_each_slack(canonical, [&](Index j, Index slack) { slope[slack] -= weights[j]; });
    double at_bounds = value, allowed = kConstant * size_of(weights, here);
    for (const Index i : indices(slope)) {
      const int side = system.set.side_of(i);
      if (!system.is_fixed(i) || slope[i] == 0.0 || side == 0) continue;
      at_bounds += slope[i] * side * system.set.distance(canonical, point.iterate, i);
      allowed += 2.0 * std::abs(slope[i]) * relaxation_of(canonical, i, side, c.options);
    }
    return std::abs(at_bounds) <= allowed;
  }

  /// Free variables moved inside their bounds; of_max: all x, for Max's rows must agree whatever x
  /// is.
  Vector moved(int place, double length, bool of_max) const {
    const double size = std::max(1.0, longest(canonical, here, system.scaling));
    Vector v = here;
    for (const Index i : each_variable(canonical)) {
      const bool held = system.is_fixed(i) && (canonical.owned_by_max(i) || !of_max);
      if (held || is_slack(canonical, i)) continue;
      const double most =
          0.05 * std::abs(v[i]) + std::min(0.01 * system.scaling.variable[i] * size, 1.0);
      const double way = length * most * std::sin(1.0 + place + 1.3 * (place + 1) * i);
      const int side = system.set.side_of(i);
      v[i] += system.is_fixed(i) && side != 0 ? -side * std::abs(way) : way;
    }
    for_each_bound(canonical, here, [&](Index i, int side, double before) {
      const double most = kConfirmed * before;
      if (system.is_free(i) && side * (v[i] - here[i]) > most) v[i] = here[i] + side * most;
    });
    join_copies(v);
    return v;
  }

  /// Rows that are the same have copies of y of their own, which stand at one place: they move as
  /// one.
  void join_copies(Vector& v) const {
    if (!canonical.has_copies()) return;
    std::vector<std::vector<Index>> places;  // copies of each rank among those of their row
    std::vector<std::size_t> rank(at(canonical.variables()), 0);
    for (const Index i : indices(canonical.y())) {
      const Index slack = canonical.robust_slack(i);
      if (slack < 0) continue;
      const std::size_t own = rank[at(slack)]++;
      if (own == places.size()) places.emplace_back();
      const double near = kNearby * own_size(canonical, here[i], i, system.scaling);
      const auto same = std::ranges::find_if(
          places[own], [&](Index other) { return std::abs(here[i] - here[other]) <= near; });
      if (same != places[own].end()) {
        v[i] = v[*same];
      } else {
        places[own].push_back(i);
      }
    }
  }

  bool constant(const Vector& weights, double value, bool of_max) {
    Vector values = Vector::Zero(canonical.constraints());
    constexpr int kPlaces = 3, kShortenings = 4;
    for (int place = 0; place < kPlaces; ++place) {
      double length = 1.0;
      Vector v = moved(place, length, of_max);
      for (int k = 0; !canonical.constraints(v, values); ++k) {
        if (k == kShortenings) return false;
        length *= 0.1;
        v = moved(place, length, of_max);
      }
      if (!(std::abs(weights.dot(values) - value) <= kConstant * size_of(weights, v))) return false;
    }
    return true;
  }

  void examine(Dependence& dependence) {
    Vector& weights = dependence.weights;
    // Rounding of the null vector.
    const double largest = weights.cwiseAbs().maxCoeff();
    for (double& weight : weights) {
      if (std::abs(weight) < kConstant * largest) weight = 0.0;
    }
    dependence.vanishing = vanishes[at(dependence.row)];
    const double value = weights.dot(point.evaluation.c);
    dependence.identical =
        consistent(weights, value) &&
        constant(weights, value, canonical.max_constraints().contains(dependence.row));
  }

  Dependences run() {
    Dependences answer;
    Index counted = 0;
    for (const Index j : each_constraint(canonical)) counted += system.counts(j) ? 1 : 0;
    // Rows beyond the number of variables depend on others.
    const Index variables = canonical.x().size() + canonical.y().size();
    constexpr Index kLeastCombinations = 16;
    const Index most =
        std::max(kLeastCombinations, kDependentEntries / (variables + canonical.constraints()));
    normalize();
    answer.complete = counted - variables <= most && factorize();
    if (!answer.complete) return answer;
    Vector w;
    while (next_null_vector(w)) {
      answer.complete = static_cast<Index>(null.size()) < most && length_of(w) <= kDependent;
      if (!answer.complete) break;
      null.push_back(w);
    }
    answer.found = reduce();
    for (Dependence& dependence : answer.found) examine(dependence);
    return answer;
  }
};

}  // namespace

Dependences find_dependences(TestContext& c, ActiveSetSystem& system, const Point& point) {
  return DependenceSearch{c, system, point}.run();
}

}  // namespace ipminmax
