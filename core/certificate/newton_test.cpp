#include "core/certificate/newton_test.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/parameters.hpp"
#include "core/model/products.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

double ratio(double a, double b) { return b > 0.0 ? a / b : 0.0; }

/// Newton's method for  grad L = 0 (free variables),  c = 0 (rows that count), v = bound (fixed).
class ActiveSetNewton {
 public:
  ActiveSetNewton(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                  const KktSolve& solve, bool is_part, const SolverOptions& options,
                  NewtonArrays& arrays)
      : canonical_(canonical),
        system_(system),
        options_(options),
        iterate_(point.iterate),
        evaluation_(point.evaluation),
        solve_(solve),
        is_part_(is_part),
        work_(arrays) {
    work_.lambda = iterate_.lambda;
    for (Index j = 0; j < canonical.constraints(); ++j) {
      if (!system.counts(j) && !system.classes().is_redundant(j)) work_.lambda[j] = 0.0;
    }
  }

  void run(NewtonTest& test);

 private:
  [[nodiscard]] bool first_step();
  void place_slacks();
  void look_at_classes(NewtonTest& test);
  void look_at_relaxed(NewtonTest& test);
  void choose_trial();
  [[nodiscard]] bool evaluate_there();
  [[nodiscard]] bool compare(NewtonTest& test);
  [[nodiscard]] bool is_there() const;
  [[nodiscard]] bool is_far_beyond() const;
  [[nodiscard]] bool compare_hessian(double times_trial, double times_step, NewtonTest& test);
  void measure_error(NewtonTest& test) const;
  void look_at_inequalities(const Eigen::VectorXd& c, NewtonTest& test);
  [[nodiscard]] double share_of_trial() const;
  void measure_turn(NewtonTest& test);
  [[nodiscard]] const Eigen::VectorXd& forces();
  void place_end(Iterate& z);
  [[nodiscard]] bool solve_in_units(double share, Eigen::VectorXd& v, Eigen::VectorXd& lambda);
  [[nodiscard]] double length_in_sizes(const Eigen::VectorXd& v) const;
  [[nodiscard]] double length(const Eigen::VectorXd& v) const {
    return longest(canonical_, v, system_.units());
  }

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const SolverOptions& options_;
  const Iterate& iterate_;
  const Evaluation& evaluation_;
  const KktSolve& solve_;
  bool is_part_;
  NewtonArrays& work_;
};

/// Longest entry beside the variable's size here or at the start; slacks apart.
double ActiveSetNewton::length_in_sizes(const Eigen::VectorXd& v) const {
  const Eigen::VectorXd& start = canonical_.starting_point().v;
  const double others = size_of_problem(canonical_, iterate_, system_.units());
  double longest = 0.0;
  for (Index i = 0; i < v.size(); ++i) {
    if (system_.is_slack(i)) continue;
    double size = std::max(std::abs(iterate_.v[i]), std::abs(start[i]));
    if (size == 0.0) size = system_.units().variable[i] * std::max(others, 1.0);
    longest = std::max(longest, std::abs(v[i]) / size);
  }
  return longest;
}

/// Right-hand side (-row_v, -row_c) and solution wanted in the canonical problem's lengths.
bool ActiveSetNewton::solve_in_units(double share, Eigen::VectorXd& v, Eigen::VectorXd& lambda) {
  const Units& units = system_.units();
  NewtonResidual& rhs = system_.rhs();
  Step& step = system_.step();
  set_zero(canonical_, rhs);
  set_zero(canonical_, step);
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (system_.is_free(i)) rhs.v[i] = units.variable[i] * -work_.row_v[i];
  }
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) rhs.lambda[j] = units.constraint[j] * -work_.row_c[j];
  }
  if (!solve_(rhs, step, share)) return false;
  v = step.v.cwiseProduct(units.variable);
  lambda = step.lambda.cwiseProduct(units.constraint);
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (!system_.is_free(i)) v[i] = 0.0;
  }
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (!system_.counts(j)) lambda[j] = 0.0;
  }
  return v.allFinite() && lambda.allFinite();
}

bool ActiveSetNewton::first_step() {
  const BoundClasses& classes = system_.classes();
  Eigen::VectorXd& fixed = work_.fixed;
  fixed.setZero(canonical_.variables());
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (!system_.is_fixed(i) || classes.side[at(i)] == 0) continue;
    fixed[i] = classes.side[at(i)] * classes.distance(canonical_, iterate_, i);
  }
  work_.gradient = evaluation_.gradient;
  add_transposed_product(canonical_, evaluation_, work_.lambda, work_.gradient);
  Eigen::VectorXd &row_v = work_.row_v, &row_c = work_.row_c;
  row_v = work_.gradient;
  add_hessian_product(canonical_, evaluation_, fixed, row_v);
  row_c = evaluation_.c;
  add_constraint_product(canonical_, evaluation_, fixed, row_c);
  if (!solve_in_units(parameter::kSlight, work_.dv, work_.dlambda)) return false;
  work_.dv += fixed;
  place_slacks();
  add_hessian_product(canonical_, evaluation_, work_.dv, work_.gradient);
  add_transposed_product(canonical_, evaluation_, work_.dlambda, work_.gradient);
  return true;
}

/// Slacks of inactive inequalities follow their constraint.
void ActiveSetNewton::place_slacks() {
  Eigen::VectorXd& change = work_.change_c;
  change = evaluation_.c;
  add_constraint_product(canonical_, evaluation_, work_.dv, change);
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (canonical_.slack_of(j) >= 0 && !system_.is_fixed(canonical_.slack_of(j)))
      work_.dv[canonical_.slack_of(j)] = change[j];
  }
}

/// Gradient of the Lagrangian at the end; of slacks: -lambda.
const Eigen::VectorXd& ActiveSetNewton::forces() {
  Eigen::VectorXd& force = work_.force;
  force = work_.gradient;
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (canonical_.slack_of(j) >= 0)
      force[canonical_.slack_of(j)] = -(work_.lambda[j] + work_.dlambda[j]);
  }
  return force;
}

/// test.changing: the first bound whose class the step changes.
void ActiveSetNewton::look_at_classes(NewtonTest& test) {
  const BoundClasses& classes = system_.classes();
  const Eigen::VectorXd& force = forces();
  const auto expect = [&](Index i, bool holds) {
    if (!holds && test.changing < 0) test.changing = i;
  };
  for (Index i = 0; i < canonical_.variables(); ++i) {
    const int side = classes.side[at(i)];
    if (side == 0 || !system_.is_fixed(i)) continue;
    const double before = classes.multiplier(iterate_, i);
    const double after = -side * canonical_.sign(i) * force[i];
    if (classes[i] == BoundClass::Active) {
      expect(i, std::abs(after - before) <= parameter::kConfirmed * before);
    } else if (canonical_.owned_by_max(i) && after < -before) {  // else zero, as far as can be told
      test.released.push_back(i);
      expect(i, false);
    }
  }
  for_each_bound(canonical_, iterate_.v, [&](Index i, int side, double distance) {
    const double towards = side * work_.dv[i];
    if (classes[i] == BoundClass::Inactive) {
      expect(i, towards <= parameter::kConfirmed * distance);
    }
  });
}

/// What bounds are relaxed by must not be what decides: with the model's own bounds the multipliers
/// of active ones and the distances of Max's inactive ones stay what they are to a half.
void ActiveSetNewton::look_at_relaxed(NewtonTest& test) {
  const BoundClasses& classes = system_.classes();
  Eigen::VectorXd &back = work_.fixed, &outside = work_.row_v;
  back.setZero(canonical_.variables());
  outside.setZero(canonical_.variables());
  bool decides = false;  // a bound of a variable without curvature
  // Curvature of its own makes a variable's best value one, whatever its multiplier is.
  Eigen::VectorXd& curvature = work_.change_v;
  curvature.setZero(canonical_.variables());
  for (std::size_t k = 0; k < evaluation_.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    if (i == j) curvature[i] += evaluation_.hessian[k];
  }
  // An inequality between variables without any is as a bound.
  for (const auto [row, col] : canonical_.jacobian()) {
    if (const Index slack = canonical_.slack_of(row); slack >= 0)
      curvature[slack] += std::abs(curvature[col]);
  }
  for_each_bound(canonical_, iterate_.v, [&](Index i, int side, double distance) {
    const double own = relaxation_of(canonical_, i, side, options_);
    if (system_.is_fixed(i) && classes.side[at(i)] == side) {
      back[i] = -side * own;
      decides = decides || curvature[i] == 0.0;
    } else if (!system_.is_fixed(i)) {
      if (distance <= 2.0 * own) outside[i] = own;
    }
  });
  if (!decides) return;
  Eigen::VectorXd& moved = work_.change_v;  // of the gradient, by those that no bound holds
  moved.setZero(canonical_.variables());
  for (std::size_t k = 0; k < evaluation_.hessian.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    moved[i] += std::abs(evaluation_.hessian[k]) * outside[j];
    if (i != j) moved[j] += std::abs(evaluation_.hessian[k]) * outside[i];
  }
  Eigen::VectorXd &dv = work_.second_v, &dlambda = work_.second_lambda;
  work_.row_v.setZero(canonical_.variables());
  work_.row_c.setZero(canonical_.constraints());
  add_hessian_product(canonical_, evaluation_, back, work_.row_v);
  add_constraint_product(canonical_, evaluation_, back, work_.row_c);
  if (!solve_in_units(parameter::kSlight, dv, dlambda)) return;
  dv += back;
  Eigen::VectorXd& change = work_.row_v;
  change.setZero(canonical_.variables());
  add_hessian_product(canonical_, evaluation_, dv, change);
  add_transposed_product(canonical_, evaluation_, dlambda, change);
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (canonical_.slack_of(j) >= 0) change[canonical_.slack_of(j)] = -dlambda[j];
  }
  for_each_bound(canonical_, iterate_.v, [&](Index i, int side, double distance) {
    const bool active = classes[i] == BoundClass::Active;
    const bool near = classes[i] == BoundClass::Inactive && canonical_.owned_by_max(i);
    if (classes.side[at(i)] != side || !(active || near)) return;
    const double left = active ? classes.multiplier(iterate_, i) : distance;
    const double lost = active ? side * canonical_.sign(i) * change[i] + moved[i]
                               : relaxation_of(canonical_, i, side, options_) + side * dv[i];
    if (lost <= parameter::kConfirmed * left) return;
    if (active) test.released.push_back(i);
    if (test.changing < 0) test.changing = i;
  });
}

void ActiveSetNewton::choose_trial() {
  const Units& units = system_.units();
  const double size = std::max(length(iterate_.v), parameter::kInTols);
  work_.trial = work_.dv;
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (system_.is_fixed(i)) {
      work_.trial[i] *= parameter::kShareOfWay;
    } else if (!system_.is_slack(i)) {
      // Beyond what a contraction leaves of the step: W may jump at the solution itself.
      const double own =
          std::min(std::abs(iterate_.v[i]), own_size(canonical_, iterate_.v[i], i, units));
      const double probe = parameter::kRootOfRounding * own +
                           parameter::kConstant * units.variable[i] * size +
                           parameter::kContraction * std::abs(work_.dv[i]);
      work_.trial[i] += work_.dv[i] < 0.0 ? -probe : probe;
    }
  }
  for_each_bound(canonical_, iterate_.v, [&](Index i, int side, double distance) {
    const double step = side * work_.dv[i], beyond = (1.0 + parameter::kContraction) * step;
    const double most = std::max(parameter::kLittle * distance, beyond < distance ? beyond : step);
    if (system_.is_free(i) && side * work_.trial[i] > most) work_.trial[i] = side * most;
  });
  work_.trial_v = iterate_.v + work_.trial;
  work_.trial_lambda = work_.lambda + work_.dlambda;
}

bool ActiveSetNewton::evaluate_there() {
  Evaluation& there = work_.there;
  there = evaluation_;
  return canonical_.constraints(work_.trial_v, there.c) == EvaluationStatus::Ok &&
         canonical_.first_derivatives(work_.trial_v, there) == EvaluationStatus::Ok &&
         canonical_.second_derivatives(work_.trial_v, work_.probed, there) == EvaluationStatus::Ok;
}

/// Derivatives at the trial point beside what the linearized equations predict there.
bool ActiveSetNewton::compare(NewtonTest& test) {
  const Evaluation& there = work_.there;
  Eigen::VectorXd& probed = work_.probed;
  probed = work_.trial_lambda;
  for (Index j = 0; j < probed.size(); ++j) {
    probed[j] += (work_.dlambda[j] < 0.0 ? -parameter::kRelaxation : parameter::kRelaxation) *
                 std::abs(probed[j]);
  }
  if (!evaluate_there()) return false;
  Eigen::VectorXd &row_v = work_.row_v, &row_c = work_.row_c;
  work_.back_v = -work_.trial;
  work_.back_lambda = -work_.lambda - work_.dlambda;
  row_v = there.gradient - evaluation_.gradient;
  add_transposed_product(canonical_, there, work_.trial_lambda, row_v);
  add_transposed_product(canonical_, evaluation_, work_.back_lambda, row_v);
  add_hessian_product(canonical_, evaluation_, work_.back_v, row_v);
  row_c = there.c - evaluation_.c;
  add_constraint_product(canonical_, evaluation_, work_.back_v, row_c);
  Eigen::VectorXd& second_v = work_.second_v;
  if (!solve_in_units(parameter::kSlight, second_v, work_.second_lambda)) return false;
  const double beside_sizes = ratio(length_in_sizes(second_v), length_in_sizes(work_.trial));
  const double in_lengths = ratio(length(second_v), length(work_.trial));
  // Any norm will do. It grows with the trial step; of rounding nothing is left.
  test.contraction = std::min(in_lengths, beside_sizes) / (1.0 + parameter::kContraction);
  if (test.contraction <= parameter::kRounding) test.contraction = 0.0;
  if (second_v.size() > 0) {
    second_v.cwiseQuotient(system_.units().variable).cwiseAbs().maxCoeff(&test.left_in);
  }
  test.hessian_change.resize(there.hessian.size());
  for (std::size_t k = 0; k < there.hessian.size(); ++k) {
    test.hessian_change[k] = std::abs(there.hessian[k] - evaluation_.hessian[k]);
  }
  if (is_far_beyond() && !compare_hessian(0.0, 1.0, test)) return false;
  if (is_part_ && !compare_hessian(0.0, 2.0, test)) return false;
  // On the other side of the end; a model that is undefined there has no other W.
  if (is_there()) static_cast<void>(compare_hessian(-1.0, 2.0, test));
  measure_error(test);
  look_at_inequalities(there.c, test);
  measure_turn(test);
  return test.error.allFinite() && std::isfinite(test.contraction);
}

/// Whether a step is nothing but rounding: then here and the trial point may be on one side of
/// where W jumps.
bool ActiveSetNewton::is_there() const {
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (system_.is_free(i) &&
        std::abs(work_.dv[i]) <= parameter::kStepIsRounding * std::abs(work_.trial[i])) {
      return true;
    }
  }
  return false;
}

/// Whether the trial point is so much farther than the end of the step that W there need not tell
/// of W at the end, and the end is not next to the start.
bool ActiveSetNewton::is_far_beyond() const {
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (!system_.is_free(i)) continue;
    const double step = std::abs(work_.dv[i]), beyond = std::abs(work_.trial[i] - work_.dv[i]);
    if (beyond > 2.0 * parameter::kLittle * step && step > parameter::kLittle * beyond) return true;
  }
  return false;
}

/// W at multiples of the trial step and of the Newton step, in free variables, as well.
bool ActiveSetNewton::compare_hessian(double times_trial, double times_step, NewtonTest& test) {
  Evaluation& end = work_.end;
  Eigen::VectorXd& v = work_.end_v;
  end = evaluation_;
  v = work_.trial_v;
  for (Index i = 0; i < v.size(); ++i) {
    if (system_.is_fixed(i)) continue;
    v[i] = iterate_.v[i] + times_trial * work_.trial[i] + times_step * work_.dv[i];
  }
  if (canonical_.second_derivatives(v, work_.probed, end) != EvaluationStatus::Ok) return false;
  for (std::size_t k = 0; k < end.hessian.size(); ++k) {
    const double change = std::abs(end.hessian[k] - evaluation_.hessian[k]);
    test.hessian_change[k] = std::max(test.hessian_change[k], change);
  }
  return true;
}

void ActiveSetNewton::measure_error(NewtonTest& test) const {
  const Units& units = system_.units();
  const BoundClasses& classes = system_.classes();
  test.error.setZero(canonical_.variables());
  work_.counted = test.hessian_change;
  for (std::size_t k = 0; k < work_.counted.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    const bool held = classes[i] == BoundClass::Active || classes[j] == BoundClass::Active;
    work_.counted[k] *= held ? 0.0 : 2.0;
  }
  add_row_sums(canonical_, work_.counted, units.variable, test.error);
}

/// Their values at the trial point, where they are not what their gradients predict. A doubtful one
/// is violated by no more than it is satisfied now.
void ActiveSetNewton::look_at_inequalities(const Eigen::VectorXd& c, NewtonTest& test) {
  Eigen::VectorXd& change = work_.change_v;
  change.setZero(canonical_.variables());
  for (Index j = 0; j < c.size(); ++j) {
    const Index slack = canonical_.slack_of(j);
    if (slack < 0 || system_.is_fixed(slack)) continue;
    change[slack] = work_.trial[slack] + c[j];
  }
  const BoundClasses& classes = system_.classes();
  const auto most = [&](Index i, double distance) {
    return (classes[i] == BoundClass::Inactive ? parameter::kConfirmed : 2.0) * distance;
  };
  for_each_bound(canonical_, iterate_.v, [&](Index i, int side, double distance) {
    if (!(side * change[i] <= most(i, distance)) && test.changing < 0) test.changing = i;
  });
}

/// The Newton step, with its rounding, over the step that is tried.
double ActiveSetNewton::share_of_trial() const {
  double share = 0.0;
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (!system_.is_free(i) || work_.trial[i] == 0.0) continue;
    const double step = std::abs(work_.dv[i]) + parameter::kRounding * std::abs(iterate_.v[i]);
    share = std::max(share, step / std::abs(work_.trial[i]));
  }
  return std::min(share, 1.0);
}

/// Equations turn over the step alone, for they have second derivatives; what bounds are relaxed by
/// moves inequalities about as far as the trial point.
void ActiveSetNewton::measure_turn(NewtonTest& test) {
  const Evaluation& there = work_.there;
  const Units& units = system_.units();
  const double share = share_of_trial();
  Eigen::VectorXd &all = work_.turns, &inner = work_.inner_turns;
  all.setZero(canonical_.constraints());
  inner.setZero(canonical_.constraints());
  for (std::size_t k = 0; k < there.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    if (!system_.counts(row) || system_.is_fixed(col)) continue;
    const double change = (canonical_.slack_of(row) < 0 ? share : 1.0) * units.constraint[row] *
                          units.variable[col] *
                          std::abs(there.jacobian[k] - evaluation_.jacobian[k]);
    all[row] += change;
    const bool is_inner =
        canonical_.max_constraints().contains(row) && canonical_.owned_by_max(col);
    if (is_inner) inner[row] += change;
  }
  if (all.size() == 0) return;
  test.turn = all.maxCoeff(&test.turning);
  test.inner_turn = inner.maxCoeff();
}

void ActiveSetNewton::place_end(Iterate& z) {
  const BoundClasses& classes = system_.classes();
  const Eigen::VectorXd& force = forces();
  z = iterate_;
  z.v += work_.dv;
  for (Index i = 0; i < work_.dv.size(); ++i) {
    if (system_.is_fixed(i)) z.v[i] = iterate_.v[i] + parameter::kShareOfWay * work_.dv[i];
  }
  z.lambda = work_.lambda + work_.dlambda;
  for_each_bound(canonical_, iterate_.v, [&](Index i, int side, double before) {
    double& multiplier = side < 0 ? z.z_lower[i] : z.z_upper[i];
    const double after =
        side < 0 ? canonical_.above_lower(i, z.v[i]) : canonical_.below_upper(i, z.v[i]);
    if (system_.is_fixed(i) && classes.side[at(i)] == side) {
      multiplier = std::max(-side * canonical_.sign(i) * force[i], parameter::kTrace * multiplier);
    } else if (after > 0.0) {
      multiplier *= before / after;
    }
  });
}

void ActiveSetNewton::run(NewtonTest& test) {
  test.clear();
  if (!first_step()) return;
  test.step = length(work_.dv);
  look_at_classes(test);
  look_at_relaxed(test);
  choose_trial();
  test.done = compare(test);
  test.classes_hold = test.done && test.changing < 0;
  place_end(test.end.iterate);
}

}  // namespace

void NewtonTest::clear() {
  done = classes_hold = false;
  released.clear();
  hessian_change.clear();
  error.setZero();
  contraction = step = turn = inner_turn = 0.0;
  changing = left_in = turning = -1;
}

void test_newton(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                 const KktSolve& solve, bool is_part, const SolverOptions& options,
                 NewtonArrays& arrays, NewtonTest& test) {
  ActiveSetNewton(canonical, system, point, solve, is_part, options, arrays).run(test);
}

}  // namespace ipminmax
