#include "core/certificate/direction.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/parameters.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/model/products.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

/// What the two searches have in common: one player's directions, and arcs along them.
struct DirectionSearch {
  CanonicalProblem& canonical;
  ActiveSetSystem& system;
  const Point& point;
  bool inner;
  FeasibleArc arc;
  IndexRange own;

  DirectionSearch(CanonicalProblem& its_canonical, ActiveSetSystem& its_system,
                  const Point& its_point, Player owner, bool stationary)
      : canonical(its_canonical),
        system(its_system),
        point(its_point),
        inner(owner == Player::Max),
        arc(canonical, system, point, owner, stationary),
        own(inner ? canonical.y() : canonical.x()) {}

  /// The owned part of a vector.
  [[nodiscard]] auto part(const Eigen::VectorXd& d) const {
    return d.segment(own.begin, own.size());
  }
  [[nodiscard]] bool right_with(const Regularization& shift) const {
    KktSystem& kkt = system.kkt();
    return inner ? kkt.has_expected_inner_inertia(kkt.factorize_inner(shift))
                 : kkt.has_expected_inertia(kkt.factorize(shift));
  }
  /// Orthogonal to those found, in units, with an owned part of length one. Without a tangent
  /// direction, or with curvature along all, solutions grow little: empty.
  [[nodiscard]] std::optional<Eigen::VectorXd> least_curvature(
      const std::vector<Eigen::VectorXd>& found, double least_growth, int most_solves) const;
};

std::optional<Eigen::VectorXd> DirectionSearch::least_curvature(
    const std::vector<Eigen::VectorXd>& found, double least_growth, int most_solves) const {
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  const auto solve = [&](const NewtonResidual& right, Step& solution) {
    return inner ? system.kkt().solve_inner(system.assembled(), right, solution)
                 : system.kkt().solve(system.assembled(), right, solution);
  };
  const auto prepare = [&](Eigen::VectorXd& d) {
    for (Index i = 0; i < d.size(); ++i) {
      if (!system.is_free(i)) d[i] = 0.0;
    }
    for (const Eigen::VectorXd& other : found) d -= part(other).dot(part(d)) * other;
  };
  bool grew = true;
  double last = 0.0;
  const auto stop = [&](int k, double growth) {
    grew = k == 0 || growth >= least_growth;
    const double curvature =
        (inner ? 1.0 : -1.0) * curvature_along(canonical, system.assembled(), step.v);
    const bool settled =
        k > 1 && curvature > 0.0 && std::abs(curvature - last) <= parameter::kSmall * curvature;
    last = curvature;
    return !grew || settled;
  };
  const InverseIteration how{
      .variables = own, .iterations = most_solves, .number = static_cast<int>(found.size())};
  if (!turn_to_curvature(how, rhs, step, solve, prepare, stop) || !grew) return {};
  return std::move(step.v);
}

// --- Directions that refute a point --------------------------------------------------------------

class Refutation : DirectionSearch {
 public:
  Refutation(CanonicalProblem& its_canonical, ActiveSetSystem& its_system, const Point& its_point,
             Player owner)
      : DirectionSearch(its_canonical, its_system, its_point, owner, false), owner_(owner) {}

  /// With a shift that makes the matrix right, a smaller one where that finds nothing.
  std::optional<WrongCurvature> search(double margin, double distance);

 private:
  [[nodiscard]] bool find_shift(double& shift) const;
  [[nodiscard]] bool gains(double length) { return gain(arc.take(step_, length), length); }
  [[nodiscard]] bool gain(const FeasibleArc::End& end, double length) const;
  [[nodiscard]] std::optional<WrongCurvature> try_steps(double distance);

  Player owner_;
  Eigen::VectorXd step_;    ///< of canonical variables
  double curvature_ = 0.0;  ///< along it; of the sign that is wrong: > 0
};

bool Refutation::find_shift(double& shift) const {
  for (int k = 0; k <= parameter::kMany; ++k, shift *= parameter::kGrowth) {
    if (right_with({.x = inner ? 0.0 : shift,
                    .y = inner ? shift : 0.0,
                    .lambda_x = parameter::kRelaxation,
                    .lambda_y = parameter::kRelaxation})) {
      return true;
    }
  }
  return false;
}

std::optional<WrongCurvature> Refutation::search(double margin, double distance) {
  for (const double first : {1e-2, 1e-4, 1e-6}) {
    double shift = first;
    if (!find_shift(shift)) return {};
    const auto direction = least_curvature({}, parameter::kTrace / shift, parameter::kMany);
    if (direction) {
      const double curvature = curvature_along(canonical, system.assembled(), *direction);
      curvature_ = inner ? curvature : -curvature;
      if (curvature_ > 0.0) {
        if (!(curvature_ > parameter::kClearlyWrong * margin * direction->squaredNorm())) return {};
        step_ = arc.step_along(*direction);
        return try_steps(distance);
      }
    }
    if (shift > first) return {};
  }
  return {};
}

/// Whether the value changes as the curvature says over an arc of this length.
bool Refutation::gain(const FeasibleArc::End& end, double length) const {
  const double predicted = 0.5 * length * length * curvature_;
  const double extent = std::abs(length) * longest(canonical, step_, system.units());
  // Where gradients are dependent a violation may be all that the gain is worth.
  return predicted > parameter::kRounding * std::abs(point.evaluation.f) && end.reached &&
         end.moved >= parameter::kConfirmed * extent &&
         end.left <= parameter::kConfirmed * std::abs(end.change) &&
         (inner ? end.change : -end.change) >= parameter::kLittle * predicted;
}

std::optional<WrongCurvature> Refutation::try_steps(double distance) {
  const double size = longest(canonical, point.iterate.v, system.units());
  double length = parameter::kLittle * std::max(1.0, size);
  const double least = distance / parameter::kLittle;
  for (int k = 0; k < parameter::kMany && length >= least; ++k, length *= parameter::kShorter) {
    // In both directions, so that no slope left over counts.
    if (gains(length) && gains(-length)) {
      return WrongCurvature{owner_, step_};
    }
  }
  return {};
}

// --- Directions without curvature ----------------------------------------------------------------

class FlatSearch : DirectionSearch {
 public:
  FlatSearch(CanonicalProblem& its_canonical, ActiveSetSystem& its_system, const Point& its_point,
             const SolverOptions& options, Player owner)
      : DirectionSearch(its_canonical, its_system, its_point, owner, true),
        options_(options),
        rounding_(kEpsilon * point.evaluation.gradient.cwiseProduct(point.iterate.v).lpNorm<1>()) {}

  FlatDirections run(double margin);

 private:
  [[nodiscard]] double curvature(const Eigen::VectorXd& d) const {
    return curvature_along(canonical, system.assembled(), d);
  }
  [[nodiscard]] double own_curvature(const Eigen::VectorXd& d) const;
  void find(double margin);
  [[nodiscard]] double change_by_relaxation(const Eigen::VectorXd& step) const;
  [[nodiscard]] bool is_flat(const Eigen::VectorXd& direction);

  const SolverOptions& options_;
  double rounding_;                     ///< of f, by its terms
  std::vector<Eigen::VectorXd> found_;  ///< in units, owned parts orthonormal
};

/// What the variables alone would have.
double FlatSearch::own_curvature(const Eigen::VectorXd& d) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < system.assembled().hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (i == j) sum += std::abs(system.assembled().hessian[k]) * d[i] * d[i];
  }
  return sum;
}

void FlatSearch::find(double margin) {
  const double most = margin / parameter::kLittle;
  for (int k = 0; k < parameter::kSeveral; ++k) {
    auto direction = least_curvature(found_, parameter::kLittle / most, parameter::kFew);
    if (!direction || std::abs(curvature(*direction)) > most * direction->squaredNorm()) return;
    found_.push_back(std::move(*direction));
  }
}

/// Of the value, over a step of length one: bounds that are relaxed give it multipliers' changes.
double FlatSearch::change_by_relaxation(const Eigen::VectorXd& step) const {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(step.size());
  add_hessian_product(canonical, point.evaluation, step, change);
  double sum = 0.0;
  for (Index i = 0; i < step.size(); ++i) {
    const int side = system.classes().side[at(i)];
    if (system.is_fixed(i) && side != 0)
      sum += std::abs(change[i]) * relaxation_of(canonical, i, side, options_);
  }
  return sum;
}

bool FlatSearch::is_flat(const Eigen::VectorXd& direction) {
  const Eigen::VectorXd step = arc.step_along(direction);
  // As far as the start, if that is farther: lengths may be short beside the variables. Bounds
  // that are near leave shorter arcs.
  const double size = size_of_problem(canonical, point.iterate, system.units());
  const double most = parameter::kLittle * std::max(1.0, size);
  const double relaxed = change_by_relaxation(step);
  int constant = 0;
  for (double length = most; length >= parameter::kLeastFar * most; length *= parameter::kShorter) {
    for (const double signed_length : {length, -length}) {
      const FeasibleArc::End end = arc.take(step, signed_length);
      if (!end.reached) continue;
      const double value = std::abs(point.evaluation.f) + length * length;
      const double extent = longest(canonical, step, system.units()) * length;
      if (end.moved < parameter::kConfirmed * extent) return false;
      if (!(std::abs(end.change) <= parameter::kConstant * value + rounding_ + relaxed * length)) {
        return false;
      }
      if (++constant == parameter::kEnough) return true;
    }
  }
  return false;
}

FlatDirections FlatSearch::run(double margin) {
  FlatDirections flat;
  if (!right_with({.x = inner ? 0.0 : margin, .y = inner ? margin : -margin})) return flat;
  find(margin);
  if (found_.empty()) return flat;
  arc.set_free_directions(found_);
  flat.verdict = FlatDirections::Verdict::Flat;
  flat.direction = arc.step_along(found_.front());
  std::vector<Eigen::VectorXd> tried = {found_.front()};
  if (found_.size() > 1) {  // all together, as each costs evaluations
    tried.push_back(Eigen::VectorXd::Zero(canonical.variables()));
    for (std::size_t k = 0; k < found_.size(); ++k) {
      tried.back() += std::cos(1.0 + static_cast<double>(k)) * found_[k];
    }
  }
  for (const Eigen::VectorXd& direction : tried) {
    const double size = direction.squaredNorm(), bend = curvature(direction);
    const double rounding =
        parameter::kHardly * own_curvature(direction) + parameter::kRounding * size;
    // Beside x, an answer of Max is as good where it is better than those next to it.
    const bool none =
        std::abs(bend) <= rounding || (inner && canonical.x().size() > 0 && bend < 0.0);
    if ((none || bend <= margin * size) && is_flat(direction) && none) continue;
    flat.verdict = FlatDirections::Verdict::Neither;
    flat.direction = arc.step_along(direction);
    break;
  }
  return flat;
}

}  // namespace

std::optional<WrongCurvature> find_refuting_direction(CanonicalProblem& canonical,
                                                      ActiveSetSystem& system, const Point& point,
                                                      double margin, double distance,
                                                      Player owner) {
  system.assemble({.min_fixed = true, .max_fixed = owner == Player::Max});
  return Refutation(canonical, system, point, owner).search(margin, distance);
}

FlatDirections find_flat_directions(CanonicalProblem& canonical, ActiveSetSystem& system,
                                    const Point& point, const SolverOptions& options, double margin,
                                    Player owner) {
  system.assemble({.min_fixed = true, .max_fixed = true});
  return FlatSearch(canonical, system, point, options, owner).run(margin);
}

}  // namespace ipminmax
