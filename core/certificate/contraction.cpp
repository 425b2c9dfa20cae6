#include "core/certificate/contraction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ipminmax {
namespace {

/// Part of the way to an active bound: models may be undefined on it.
constexpr double kAlmostThere = 0.99;
/// Relative change of a multiplier or a distance up to which the class is confirmed.
constexpr double kConfirmed = 0.5;
/// Way that may be left at the end of a step, over its length: Newton's method contracts by so
/// much.
constexpr double kLeft = 0.1;
/// Part of a distance to an inactive bound that may be used up by a probe.
constexpr double kProbeOfDistance = 0.1;
/// Least relative distance over which derivatives are compared: where f is flat to rounding, its
/// gradient cannot be told from zero nearer than that. For variables at zero, in units.
constexpr double kProbe = 1e-8;
constexpr double kProbeAtZero = 1e-12;
constexpr double kLeastSize = 100.0;
constexpr double kMultiplierProbe = 1e-10;
/// Of a trial step, by which others like it may differ.
constexpr double kAlike = 0.1;
/// Of the Newton step, that its error may be: W is compared and the bounds are looked at along it.
constexpr double kErrorOfStep = 1e-4;
/// Of the trial step, below which a Newton step is rounding.
constexpr double kRounding = 1e-5;
/// The same of the second step, whose length is all that counts.
constexpr double kErrorOfSecondStep = 1e-3;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// product += W v
void add_hessian_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         const Eigen::VectorXd& v, Eigen::VectorXd& product) {
  for (std::size_t k = 0; k < evaluation.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    product[i] += evaluation.hessian[k] * v[j];
    if (i != j) product[j] += evaluation.hessian[k] * v[i];
  }
}

/// product += J' lambda, slacks apart.
void add_transposed_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& lambda, Eigen::VectorXd& product) {
  for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    product[col] += evaluation.jacobian[k] * lambda[row];
  }
}

/// c += J v, slacks included.
void add_constraint_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& v, Eigen::VectorXd& c) {
  for (std::size_t k = 0; k < evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    c[row] += evaluation.jacobian[k] * v[col];
  }
  const auto slack_of = canonical.slack_of_constraint();
  for (Index j = 0; j < c.size(); ++j) {
    if (const Index s = slack_of[at(j)]; s >= 0) c[j] -= v[s];
  }
}

/// Newton's method for  grad L = 0 (free variables),  c = 0 (rows that count),  v = bound (fixed).
class ActiveSetNewton {
 public:
  ActiveSetNewton(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                  const NewtonRequest& request, NewtonArrays& arrays)
      : canonical_(canonical),
        system_(system),
        iterate_(point.iterate),
        evaluation_(point.evaluation),
        solve_(request.solve),
        probe_(request.probe),
        work_(arrays) {
    work_.lambda = iterate_.lambda;
    for (Index j = 0; j < canonical.constraints(); ++j) {
      const bool kept = system.counts(j) || system.classes().is_redundant(j);
      if (!kept) work_.lambda[j] = 0.0;
    }
  }

  void run(NewtonTest& test);

 private:
  [[nodiscard]] bool first_step();
  void place_slacks();
  [[nodiscard]] bool classes_hold(NewtonTest& test);
  void choose_trial();
  [[nodiscard]] bool was_compared();
  [[nodiscard]] bool evaluate_there();
  [[nodiscard]] bool compare(NewtonTest& test);
  [[nodiscard]] bool is_far_beyond() const;
  [[nodiscard]] bool is_there() const;
  [[nodiscard]] bool compare_hessian_at(double times_trial, double times_step,
                                        const Eigen::VectorXd& lambda, NewtonTest& test);
  void measure_error(NewtonTest& test) const;
  [[nodiscard]] bool inequalities_stay_open(const Eigen::VectorXd& c);
  void measure_turn(NewtonTest& test);
  [[nodiscard]] const Eigen::VectorXd& forces();
  void place_end(Iterate& z);
  [[nodiscard]] bool solve_in_units(double share, Eigen::VectorXd& v, Eigen::VectorXd& lambda);
  [[nodiscard]] double length(const Eigen::VectorXd& v) const {
    return longest(canonical_, v, system_.units());
  }

  [[nodiscard]] double length_in_sizes(const Eigen::VectorXd& v) const;

  CanonicalProblem& canonical_;
  ActiveSetSystem& system_;
  const Iterate& iterate_;
  const Evaluation& evaluation_;
  const KktSolve& solve_;
  Probe probe_;
  NewtonArrays& work_;
};

/// Longest entry beside the variable's size here or at the start, whichever is larger; slacks
/// apart.
double ActiveSetNewton::length_in_sizes(const Eigen::VectorXd& v) const {
  const Eigen::VectorXd& start = canonical_.starting_point().v;
  const double others = std::max(length(iterate_.v), length(start));
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
    if (!system_.is_slack(i) && !system_.is_fixed(i))
      rhs.v[i] = units.variable[i] * -work_.row_v[i];
  }
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) rhs.lambda[j] = units.constraint[j] * -work_.row_c[j];
  }
  if (!solve_(rhs, step, share)) return false;
  v = step.v.cwiseProduct(units.variable);
  lambda = step.lambda.cwiseProduct(units.constraint);
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (system_.is_slack(i) || system_.is_fixed(i)) v[i] = 0.0;
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
  if (!solve_in_units(kErrorOfStep, work_.dv, work_.dlambda)) return false;
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
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (slack_of[at(j)] >= 0 && !system_.is_fixed(slack_of[at(j)]))
      work_.dv[slack_of[at(j)]] = change[j];
  }
}

/// Gradient of the Lagrangian at the end; of slacks: -lambda.
const Eigen::VectorXd& ActiveSetNewton::forces() {
  Eigen::VectorXd& force = work_.force;
  force = work_.gradient;
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (slack_of[at(j)] >= 0) force[slack_of[at(j)]] = -(work_.lambda[j] + work_.dlambda[j]);
  }
  return force;
}

bool ActiveSetNewton::classes_hold(NewtonTest& test) {
  const BoundClasses& classes = system_.classes();
  const Eigen::VectorXd& force = forces();
  bool hold = true;
  for (Index i = 0; i < canonical_.variables(); ++i) {
    const int side = classes.side[at(i)];
    if (side == 0 || !system_.is_fixed(i)) continue;
    const double before = classes.multiplier(iterate_, i);
    const double after = -side * canonical_.sign(i) * force[i];
    if (classes[i] == BoundClass::Active) {
      hold = hold && std::abs(after - before) <= kConfirmed * before;
      if (!(after > 0.0)) test.contradicted.push_back(i);
    } else if (canonical_.owned_by_max(i)) {
      if (after < -before) test.pulled_off.push_back(i);  // else zero, as far as can be told
    }
  }
  hold = hold && test.pulled_off.empty();
  const auto stays_away = [&](Index i, int side, double towards, double distance) {
    if (classes[i] == BoundClass::Inactive) {
      hold = hold && towards <= kConfirmed * distance;
      if (!(towards < distance) && classes.side[at(i)] == side) test.contradicted.push_back(i);
    }
    if (classes[i] == BoundClass::Dropped) {
      hold = hold && (1.0 + kLeft) * towards <= distance + classes.allowed_violation(i);
    }
  };
  for (const Index i : canonical_.lower_bounded()) {
    stays_away(i, -1, -work_.dv[i], canonical_.above_lower(i, iterate_.v[i]));
  }
  for (const Index i : canonical_.upper_bounded()) {
    stays_away(i, 1, work_.dv[i], canonical_.below_upper(i, iterate_.v[i]));
  }
  return hold;
}

void ActiveSetNewton::choose_trial() {
  const Units& units = system_.units();
  const double size = std::max(length(iterate_.v), kLeastSize);
  work_.trial = work_.dv;
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (system_.is_fixed(i)) {
      work_.trial[i] *= kAlmostThere;
    } else if (!system_.is_slack(i)) {
      const double probe =
          kProbe * std::abs(iterate_.v[i]) + kProbeAtZero * units.variable[i] * size;
      work_.trial[i] += work_.dv[i] < 0.0 ? -probe : probe;
    }
  }
  const auto keep_inside = [&](Index i, double towards, double distance, double side) {
    const double most = std::max(kProbeOfDistance * distance, side * work_.dv[i]);
    if (!system_.is_fixed(i) && !system_.is_slack(i) && towards > most)
      work_.trial[i] = side * most;
  };
  for (const Index i : canonical_.lower_bounded()) {
    keep_inside(i, -work_.trial[i], canonical_.above_lower(i, iterate_.v[i]), -1.0);
  }
  for (const Index i : canonical_.upper_bounded()) {
    keep_inside(i, work_.trial[i], canonical_.below_upper(i, iterate_.v[i]), 1.0);
  }
  work_.trial_v = iterate_.v + work_.trial;
  work_.trial_lambda = work_.lambda + work_.dlambda;
}

/// Whether the trial point last compared serves, from other classes or units; then it is this one.
bool ActiveSetNewton::was_compared() {
  if (!work_.is_there_known) return false;
  for (Index i = 0; i < work_.trial.size(); ++i) {
    const double apart = std::abs(work_.there_v[i] - work_.trial_v[i]);
    if (!(apart <= kAlike * std::abs(work_.trial[i]))) return false;
  }
  for (Index j = 0; j < work_.probed.size(); ++j) {
    const double probe = std::abs(work_.dlambda[j]) + kMultiplierProbe * std::abs(work_.probed[j]);
    if (!(std::abs(work_.there_lambda[j] - work_.probed[j]) <= kAlike * probe)) return false;
  }
  work_.trial_v = work_.there_v;
  work_.trial = work_.trial_v - iterate_.v;
  return true;
}

bool ActiveSetNewton::evaluate_there() {
  Evaluation& there = work_.there;
  there = evaluation_;
  work_.there_v = work_.trial_v;
  work_.there_lambda = work_.probed;
  work_.is_there_known =
      canonical_.constraints(work_.trial_v, there.c) == EvaluationStatus::Ok &&
      canonical_.first_derivatives(work_.trial_v, there) == EvaluationStatus::Ok &&
      canonical_.second_derivatives(work_.trial_v, work_.probed, there) == EvaluationStatus::Ok;
  return work_.is_there_known;
}

/// Derivatives at the trial point beside what the linearized equations predict there.
bool ActiveSetNewton::compare(NewtonTest& test) {
  const Evaluation& there = work_.there;
  Eigen::VectorXd& probed = work_.probed;
  probed = work_.trial_lambda;
  for (Index j = 0; j < probed.size(); ++j) {
    probed[j] +=
        (work_.dlambda[j] < 0.0 ? -kMultiplierProbe : kMultiplierProbe) * std::abs(probed[j]);
  }
  if (!was_compared() && !evaluate_there()) return false;
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
  if (!solve_in_units(kErrorOfSecondStep, second_v, work_.second_lambda)) return false;
  const auto ratio = [&](auto&& norm) {
    const double tried = norm(work_.trial);
    return tried > 0.0 ? norm(second_v) / tried : 0.0;
  };
  test.contraction = std::min(ratio([&](const Eigen::VectorXd& v) { return length(v); }),
                              ratio([&](const Eigen::VectorXd& v) { return length_in_sizes(v); }));

  test.hessian_change.resize(there.hessian.size());
  for (std::size_t k = 0; k < there.hessian.size(); ++k) {
    test.hessian_change[k] = std::abs(there.hessian[k] - evaluation_.hessian[k]);
  }
  if (probe_ == Probe::EndAndBeyond && is_far_beyond() &&
      !compare_hessian_at(0.0, 1.0, probed, test)) {
    return false;
  }
  // On the other side of the end; a model that is undefined there has no other W.
  if (is_there()) static_cast<void>(compare_hessian_at(-1.0, 2.0, probed, test));
  measure_error(test);
  test.classes_hold = test.classes_hold && inequalities_stay_open(there.c);
  measure_turn(test);
  return test.error.allFinite() && std::isfinite(test.contraction);
}

/// Whether the trial point is so much farther than the end of the step that W there need not tell
/// of W at the end, and the end is not next to the start.
bool ActiveSetNewton::is_far_beyond() const {
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (system_.is_fixed(i) || system_.is_slack(i)) continue;
    const double step = std::abs(work_.dv[i]), beyond = std::abs(work_.trial[i] - work_.dv[i]);
    if (beyond > kLeft * step && step > kLeft * beyond) return true;
  }
  return false;
}

/// Whether a step is nothing but rounding: then here and the trial point may be on one side of
/// where W jumps.
bool ActiveSetNewton::is_there() const {
  for (Index i = 0; i < work_.trial.size(); ++i) {
    if (system_.is_fixed(i) || system_.is_slack(i)) continue;
    if (std::abs(work_.dv[i]) <= kRounding * std::abs(work_.trial[i])) return true;
  }
  return false;
}

/// W at multiples of the trial step and of the Newton step, in free variables, as well.
bool ActiveSetNewton::compare_hessian_at(double times_trial, double times_step,
                                         const Eigen::VectorXd& lambda, NewtonTest& test) {
  Evaluation& end = work_.end;
  Eigen::VectorXd& v = work_.end_v;
  end = evaluation_;
  v = work_.trial_v;
  for (Index i = 0; i < v.size(); ++i) {
    if (system_.is_fixed(i)) continue;
    v[i] = iterate_.v[i] + times_trial * work_.trial[i] + times_step * work_.dv[i];
  }
  if (canonical_.second_derivatives(v, lambda, end) != EvaluationStatus::Ok) return false;
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
  for (std::size_t k = 0; k < test.hessian_change.size(); ++k) {
    const auto [i, j] = canonical_.hessian()[k];
    if (classes[i] == BoundClass::Active || classes[j] == BoundClass::Active) continue;
    const double change = 2.0 * units.variable[i] * units.variable[j] * test.hessian_change[k];
    test.error[i] += change;
    if (i != j) test.error[j] += change;
  }
}

/// Their values at the trial point, where they are not what their gradients predict. A doubtful one
/// is violated by no more than it is satisfied now.
bool ActiveSetNewton::inequalities_stay_open(const Eigen::VectorXd& c) {
  const auto slack_of = canonical_.slack_of_constraint();
  Eigen::VectorXd& change = work_.change_v;
  change.setZero(canonical_.variables());
  for (Index j = 0; j < c.size(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack < 0 || system_.is_fixed(slack)) continue;
    change[slack] = work_.trial[slack] + c[j];
  }
  const BoundClasses& classes = system_.classes();
  const auto most = [&](Index i, double distance) {
    if (classes[i] == BoundClass::Dropped) {
      return (distance + classes.allowed_violation(i)) / (1.0 + kLeft);
    }
    return (classes[i] == BoundClass::Inactive ? kConfirmed : 2.0) * distance;
  };
  const auto above = [&](Index i) {
    return -change[i] <= most(i, canonical_.above_lower(i, iterate_.v[i]));
  };
  const auto below = [&](Index i) {
    return change[i] <= most(i, canonical_.below_upper(i, iterate_.v[i]));
  };
  return std::ranges::all_of(canonical_.lower_bounded(), above) &&
         std::ranges::all_of(canonical_.upper_bounded(), below);
}

void ActiveSetNewton::measure_turn(NewtonTest& test) {
  const Evaluation& there = work_.there;
  const Units& units = system_.units();
  Eigen::VectorXd &all = work_.turns, &inner = work_.inner_turns;
  all.setZero(canonical_.constraints());
  inner.setZero(canonical_.constraints());
  for (std::size_t k = 0; k < there.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    if (!system_.counts(row) || system_.is_fixed(col)) continue;
    const double change = units.constraint[row] * units.variable[col] *
                          std::abs(there.jacobian[k] - evaluation_.jacobian[k]);
    all[row] += change;
    const bool is_inner =
        canonical_.max_constraints().contains(row) && canonical_.owned_by_max(col);
    if (is_inner) inner[row] += change;
  }
  if (all.size() == 0) return;
  test.turn = all.maxCoeff();
  test.inner_turn = inner.maxCoeff();
}

void ActiveSetNewton::place_end(Iterate& z) {
  constexpr double kLeastShare = 1e-3;  // of a multiplier: it stays positive
  const BoundClasses& classes = system_.classes();
  const Eigen::VectorXd& force = forces();
  z = iterate_;
  z.v += work_.dv;
  for (Index i = 0; i < work_.dv.size(); ++i) {
    if (system_.is_fixed(i)) z.v[i] = iterate_.v[i] + kAlmostThere * work_.dv[i];
  }
  z.lambda = work_.lambda + work_.dlambda;
  const auto follow = [&](Index i, int side, double before, double after, double& multiplier) {
    if (system_.is_fixed(i) && classes.side[at(i)] == side) {
      multiplier = std::max(-side * canonical_.sign(i) * force[i], kLeastShare * multiplier);
    } else if (after > 0.0) {
      multiplier *= before / after;
    }
  };
  for (const Index i : canonical_.lower_bounded()) {
    follow(i, -1, canonical_.above_lower(i, iterate_.v[i]), canonical_.above_lower(i, z.v[i]),
           z.z_lower[i]);
  }
  for (const Index i : canonical_.upper_bounded()) {
    follow(i, 1, canonical_.below_upper(i, iterate_.v[i]), canonical_.below_upper(i, z.v[i]),
           z.z_upper[i]);
  }
}

void ActiveSetNewton::run(NewtonTest& test) {
  test.clear();
  if (!first_step()) return;
  test.step = length(work_.dv);
  test.classes_hold = classes_hold(test);
  choose_trial();
  test.done = compare(test);
  place_end(test.end.iterate);
}

}  // namespace

void NewtonTest::clear() {
  done = classes_hold = false;
  pulled_off.clear();
  contradicted.clear();
  hessian_change.clear();
  error.setZero();
  contraction = step = turn = inner_turn = 0.0;
}

void test_newton(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                 const NewtonRequest& request, NewtonArrays& arrays, NewtonTest& test) {
  ActiveSetNewton(canonical, system, point, request, arrays).run(test);
}

}  // namespace ipminmax
