#include "core/certificate/basic_multipliers.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/parameters.hpp"
#include "core/model/canonical_problem.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

/// Changes of multipliers that leave the gradient of the Lagrangian as it is.
struct NullVector {
  Eigen::VectorXd rows;    ///< of lambda
  Eigen::VectorXd bounds;  ///< of the multipliers, positive for the right sign, of fixed variables
};

class BasicSearch {
 public:
  BasicSearch(const ActiveSetSystem& system, const Point& point, const SolverOptions& options)
      : system_(system),
        canonical_(system.canonical()),
        options_(options),
        given_(point.iterate),
        found_{.iterate = point.iterate, .classes = system.classes()} {}

  /// Along a null vector, in its direction or the other one, to where an inequality's multiplier is
  /// zero. The others lose their share in this inequality.
  bool take(NullVector& along, double direction, std::vector<NullVector>& others);
  [[nodiscard]] BasicMultipliers finish();

 private:
  [[nodiscard]] double multiplier(Index i) const {
    return found_.classes.multiplier(found_.iterate, i);
  }
  [[nodiscard]] double allowed_violation(const NullVector& along, Index dropped) const;

  const ActiveSetSystem& system_;
  const CanonicalProblem& canonical_;
  const SolverOptions& options_;
  const Iterate& given_;
  BasicMultipliers found_;
  std::vector<Index> touched_;
};

/// The bound at which a fixed variable stands.
double bound_of(const CanonicalProblem& canonical, const BoundClasses& classes, Index i) {
  return classes.side[at(i)] < 0 ? canonical.lower()[i] : canonical.upper()[i];
}

/// Distances of the bounds in a null vector are dependent to first order as the gradients are: that
/// of the dropped one is what the others' were relaxed by where the model's own bounds agree.
double BasicSearch::allowed_violation(const NullVector& along, Index dropped) const {
  double sum =
      parameter::kConstant * std::max(1.0, std::abs(bound_of(canonical_, found_.classes, dropped)));
  for (Index i = 0; i < along.bounds.size(); ++i) {
    if (along.bounds[i] == 0.0 || i == dropped) continue;
    sum += 1.1 * std::abs(along.bounds[i] / along.bounds[dropped]) *
           relaxation_of(canonical_, i, found_.classes.side[at(i)], options_);
  }
  return sum;
}

bool BasicSearch::take(NullVector& along, double direction, std::vector<NullVector>& others) {
  const double largest = along.bounds.lpNorm<Eigen::Infinity>();
  double length = kInfinity;
  Index first = -1;
  for (Index i = 0; i < along.bounds.size(); ++i) {
    const double rate = direction * along.bounds[i];
    if (!(rate < -parameter::kZero * largest)) continue;
    if (const double until = multiplier(i) / -rate; until < length) length = until, first = i;
  }
  if (first < 0) return false;
  Iterate& z = found_.iterate;
  z.lambda += direction * length * along.rows;
  for (Index i = 0; i < along.bounds.size(); ++i) {
    if (along.bounds[i] == 0.0) continue;
    double& own = found_.classes.side[at(i)] < 0 ? z.z_lower[i] : z.z_upper[i];
    own = i == first ? 0.0 : std::max(own + direction * length * along.bounds[i], 0.0);
    touched_.push_back(i);
  }
  found_.classes.dropped.push_back(
      {.variable = first, .violation = allowed_violation(along, first)});
  for (NullVector& other : others) {
    const double share = other.bounds[first] / along.bounds[first];
    other.rows -= share * along.rows;
    other.bounds -= share * along.bounds;
    other.bounds[first] = 0.0;
  }
  return true;
}

/// Classes of those whose multipliers have changed.
BasicMultipliers BasicSearch::finish() {
  BoundClasses& classes = found_.classes;
  BoundClasses guess;
  guess_classes(canonical_, options_, found_.iterate, system_.units(),
                parameters::certificate::kStrictRatio, guess);
  for (const Index i : touched_) {
    const double before = classes.multiplier(given_, i);
    if (classes[i] == BoundClass::Active && multiplier(i) >= parameter::kLittle * before) continue;
    if (guess.side[at(i)] == classes.side[at(i)]) classes.of[at(i)] = guess[i];
  }
  for (const DroppedBound& dropped : classes.dropped) {
    classes.of[at(dropped.variable)] = BoundClass::Dropped;
  }
  count_doubtful(canonical_, classes);
  return std::move(found_);
}

/// Empty: variables of the other player or such that are held for other reasons are in it.
std::optional<NullVector> null_vector(const ActiveSetSystem& system, const Point& point,
                                      const Dependence& dependence, bool max) {
  const CanonicalProblem& canonical = system.canonical();
  const BoundClasses& classes = system.classes();
  NullVector t{.rows = dependence.weights, .bounds = Eigen::VectorXd::Zero(canonical.variables())};
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(canonical.variables()), size = sum;
  for (std::size_t k = 0; k < point.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    const double part = t.rows[row] * point.evaluation.jacobian[k];
    if (part != 0.0 && canonical.owned_by_max(col) != max) return std::nullopt;
    sum[col] += part;
    size[col] += std::abs(part);
  }
  for (Index i = 0; i < sum.size(); ++i) {
    if (!system.is_fixed(i) || system.is_slack(i)) continue;
    if (std::abs(sum[i]) <= parameter::kZero * size[i]) continue;
    if (classes.side[at(i)] == 0) return std::nullopt;
    t.bounds[i] = -classes.side[at(i)] * canonical.sign(i) * sum[i];
  }
  for (Index j = 0; j < t.rows.size(); ++j) {
    const Index slack = canonical.slack_of(j);
    if (slack < 0 || t.rows[j] == 0.0) continue;
    if (classes.side[at(slack)] == 0) return std::nullopt;
    t.bounds[slack] = classes.side[at(slack)] * canonical.sign(slack) * t.rows[j];
  }
  return t;
}

bool are_active(const BoundClasses& classes, const NullVector& t) {
  for (Index i = 0; i < t.bounds.size(); ++i) {
    if (t.bounds[i] != 0.0 && classes[i] != BoundClass::Active) return false;
  }
  return true;
}

/// With all variables in the rows of the null vectors held, and these rows left out.
BoundClasses narrowed(const ActiveSetSystem& system, BoundClasses classes,
                      const std::vector<NullVector>& all) {
  const CanonicalProblem& canonical = system.canonical();
  std::vector<bool>& left_out = classes.redundant;
  left_out.resize(at(canonical.constraints()), false);
  for (const NullVector& t : all) {
    for (Index j = 0; j < t.rows.size(); ++j) {
      if (t.rows[j] != 0.0) left_out[at(j)] = true;
    }
    for (Index i = canonical.y().begin; i < canonical.y().end; ++i) {
      if (t.bounds[i] != 0.0) classes.hold(i);
    }
  }
  for (const auto& [row, col] : canonical.jacobian()) {
    if (left_out[at(row)] && canonical.owned_by_max(col)) classes.hold(col);
  }
  count_doubtful(canonical, classes);
  return classes;
}

}  // namespace

std::vector<BasicMultipliers> basic_multipliers(const ActiveSetSystem& system, const Point& point,
                                                const Dependences& dependences,
                                                const SolverOptions& options, bool max) {
  const CanonicalProblem& canonical = system.canonical();
  std::vector<NullVector> all, redundant;
  for (const Dependence& dependence : dependences.found) {
    if (canonical.max_constraints().contains(dependence.row) != max) continue;
    auto t = null_vector(system, point, dependence, max);
    if (!t) return {};
    const bool left_out = system.classes().is_redundant(dependence.row);
    (left_out ? redundant : all).push_back(std::move(*t));
  }
  std::vector<BasicMultipliers> found;
  if (all.empty() || !dependences.complete) return found;
  const unsigned tries = all.size() == 1 ? 2 : parameter::kFew;
  for (unsigned trial = 0; trial < tries; ++trial) {
    std::vector<NullVector> rest = all;
    BasicSearch search(system, point, options);
    bool done = true;
    for (unsigned k = 0; done && !rest.empty(); ++k) {
      NullVector along = std::move(rest.back());
      rest.pop_back();
      const double direction = ((trial >> (k % 2)) & 1U) == 0 ? 1.0 : -1.0;
      done = search.take(along, direction, rest) || search.take(along, -direction, rest);
    }
    if (!done) continue;
    BasicMultipliers basic = search.finish();
    // A row is redundant beside bounds that hold alone.
    const bool hold = std::ranges::all_of(
        redundant, [&](const NullVector& t) { return are_active(basic.classes, t); });
    if (!hold) continue;
    if (max && canonical.x().size() > 0) basic.narrow = narrowed(system, basic.classes, all);
    found.push_back(std::move(basic));
  }
  return found;
}

}  // namespace ipminmax
