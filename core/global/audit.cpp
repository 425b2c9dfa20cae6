#include "core/global/audit.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <random>
#include <span>
#include <utility>

#include "core/diagnostics/derivative_test.hpp"
#include "core/diagnostics/diagnosis.hpp"
#include "core/global/over_y.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/robust_scope.hpp"
#include "core/worst_case.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Points of y's box that show the range of a function beside the witnesses.
constexpr int kSamples = 4;
/// Units of bound_relax_factor, beside the range of a robust row, that its solve may use: rows are
/// solved in units in which their bounds are no larger than that (row_units.hpp).
constexpr double kRelaxations = 16.0;

/// The functions at the answer's x with one y.
struct ValuesAtY {
  std::vector<double> v, g;  ///< g: the constraints, then f

  double f() const { return g.back(); }
};

/// What the bound is relaxed by that a value exceeds.
double relaxation_where_exceeded(double value, double lower, double upper,
                                 const SolverOptions& options) {
  return relaxation(value > upper ? upper : lower, upper - lower, options);
}

/// The functions at the answer's x, and their ranges over y.
class FunctionsAtAnswer {
 protected:
  FunctionsAtAnswer(Problem& model, const SolverOptions& options, const Result& result,
                    Counts& counts)
      : model_(model),
        s_(model.structure()),
        options_(options),
        counts_(counts),
        m_(s_.constraint_players.size()),
        here_{result.v, result.constraints},
        moves_(moves_from_start(model, result.v)),
        ranges_(m_ + 1) {
    here_.g.resize(m_, kNaN);
    here_.g.push_back(result.objective);
    see(here_);
  }

  /// How far a solve moved a variable, as a function of its index.
  auto moved() const {
    return [this](std::size_t i) { return moves_.moved(i); };
  }

  /// v: n values.
  std::optional<ValuesAtY> evaluate(const std::vector<double>& v) {
    ValuesAtY seen{v, here_.g};
    ++counts_.objective;
    if (!model_.objective(v, true, seen.g.back())) seen.g.back() = kNaN;
    if (m_ > 0) {
      ++counts_.constraints;
      if (!model_.constraint_rows(rows_that_change(v), v, false, rows_of(seen))) {
        look_for_undefined(v);
        return {};
      }
    }
    see(seen);
    return seen;
  }

  /// What the functions change by at the answer as each Min variable moves by its size.
  void measure_changes_by_min() {
    std::vector<double> gradient(here_.v.size());
    jacobian_.resize(s_.jacobian.size());
    ++counts_.gradient;
    ++counts_.jacobian;
    if (!model_.gradient(here_.v, true, gradient) || !model_.jacobian(here_.v, false, jacobian_))
      return;
    changes_ = changes_by_min(s_, jacobian_, moved());
    // No samples show what a variable without bounds can do, and witnesses may be few.
    for (std::size_t k = 0; k < jacobian_.size(); ++k) {
      const auto [row, col] = s_.jacobian[k];
      if (s_.variable_players[at(col)] != Player::Max) continue;
      const double own = here_.g[at(row)], width = moves_.of(at(col));
      if (width < kUnbounded) ranges_[at(row)].see(own - std::abs(jacobian_[k]) * width);
      if (!is_boxed(at(col))) ranges_[at(row)].see(own - changes_[at(row)]);
    }
    changes_.push_back(change_by_min(s_, gradient, moved()));
  }

  /// The same of one constraint, also through explicit equations of Max: by the chain rule,
  /// backwards.
  void measure_change_by_equations(std::size_t j) {
    if (changes_.empty() || follows_->empty()) return;
    std::vector<double> slopes(here_.v.size(), 0.0);
    const auto entries = entries_of_rows(s_);
    for (const std::size_t k : entries[j]) slopes[at(s_.jacobian[k].col)] += jacobian_[k];
    for (auto equation = follows_->rbegin(); equation != follows_->rend(); ++equation) {
      const auto [row, variable] = *equation;
      double own = 0.0;
      const double slope = std::exchange(slopes[at(variable)], 0.0);
      if (slope == 0.0) continue;
      for (const std::size_t k : entries[at(row)])
        own += s_.jacobian[k].col == variable ? jacobian_[k] : 0.0;
      for (const std::size_t k : entries[at(row)]) {
        if (s_.jacobian[k].col != variable)
          slopes[at(s_.jacobian[k].col)] -= slope / own * jacobian_[k];
      }
    }
    ranges_[j].cap = std::max(ranges_[j].cap, change_by_min(s_, slopes, moved()));
  }

  /// Whether Max's constraints hold, up to the relaxation that they were solved with.
  bool max_may_choose(const ValuesAtY& seen) const {
    for (const auto j : indices(s_.constraint_players)) {
      const double relaxed = options_.bound_relax_factor * ranges_[j].size();
      if (s_.constraint_players[j] == Player::Max && !holds(j, seen.g[j], options_.tol, relaxed)) {
        return false;
      }
    }
    return true;
  }

  /// Whether a value is within the bounds of constraint j, which may be `wider`, to tol of its
  /// range.
  bool holds(std::size_t j, double value, double tol, double wider = 0.0) const {
    return is_met(value, s_.constraint_lower[j] - wider, s_.constraint_upper[j] + wider, ranges_[j],
                  tol);
  }

  bool is_boxed(std::size_t i) const {
    return s_.variable_lower[i] > options_.nlp_lower_bound_inf &&
           s_.variable_upper[i] < options_.nlp_upper_bound_inf;
  }

  std::span<double> rows_of(ValuesAtY& seen) const { return std::span(seen.g).first(m_); }

  Problem& model_;
  const ProblemStructure& s_;
  const SolverOptions& options_;
  Counts& counts_;
  std::size_t m_;                   ///< constraints
  ValuesAtY here_;                  ///< the answer; NaN where a constraint is not known
  VariableRanges moves_;            ///< of variables, from the model's start to the answer
  std::vector<ValueRange> ranges_;  ///< of each function
  std::vector<double> changes_;     ///< of each function by x; empty: not known
  std::optional<RobustWorstCase> undefined_;
  std::optional<ExplicitEquations> follows_;

 private:
  /// Keeps the first y at which a robust constraint is undefined or infinite, also beside it in Y:
  /// at a bound of y its limit may be what counts, as of y log(y).
  void look_for_undefined(std::vector<double> v) {
    constexpr double kBeside = 1e-3;  // of the way to the answer's y
    if (undefined_) return;
    for (std::size_t i = 0; i < v.size(); ++i) v[i] += kBeside * (here_.v[i] - v[i]);
    // A model may write what is defined and say that not all is.
    ValuesAtY beside{v, std::vector<double>(m_ + 1, kNaN)};
    ++counts_.constraints;
    static_cast<void>(model_.constraint_rows(numbers_below(m_), v, true, rows_of(beside)));
    if (!max_may_choose(beside)) return;
    for (const Index row : robust_constraints(s_)) {
      if (undefined_ || std::isfinite(beside.g[at(row)])) continue;
      undefined_ = {.constraint = row, .v = v, .value = kNaN, .active = true};
    }
  }

  /// Other constraints have the values that they have at the answer, where these are known.
  std::vector<Index> rows_that_change(const std::vector<double>& v) {
    std::vector<bool> changes(m_, !all_finite(rows_of(here_)));
    for (const auto& [row, col] : s_.jacobian) {
      if (v[at(col)] != here_.v[at(col)]) changes[at(row)] = true;
    }
    return marked(changes);
  }

  void see(const ValuesAtY& seen) {
    for (const auto j : indices(ranges_)) ranges_[j].see(seen.g[j]);
  }

  std::vector<double> jacobian_;  ///< at the answer
};

/// What the witnesses say of the functions at the answer's x.
class WitnessTest : FunctionsAtAnswer {
 public:
  WitnessTest(Problem& model, const SolverOptions& options, const Result& result, Counts& counts)
      : FunctionsAtAnswer(model, options, result, counts),
        scale_of_f_(std::abs(result.objective_scale)),
        of_max_(variables_of(s_, Player::Max)) {
    std::mt19937_64 random(20220411);
    std::vector<double> y = max_part(s_, here_.v);
    for (int k = 0; k < kSamples; ++k) {
      for (const auto i : indices(y)) {
        const SampledRange box{s_.variable_lower[of_max_[i]], s_.variable_upper[of_max_[i]]};
        if (is_boxed(of_max_[i])) y[i] = box.draw(random);
      }
      if (const auto v = answer_with(y); !v.empty()) evaluate(v);
    }
    measure_changes_by_min();
  }

  /// starts: show the ranges of the functions, and refute nothing.
  void add(const Points& witnesses, const Points& starts) {
    for (const auto& v : distinct(starts, options_.minmax_distinct_tol)) evaluate(v);
    for (const auto& v : distinct(witnesses, options_.bound_relax_factor)) {
      if (auto seen = evaluate(v)) seen_.push_back(std::move(*seen));
    }
    std::erase_if(seen_, [&](const ValuesAtY& seen) { return !max_may_choose(seen); });
    cap_ranges();
  }

  /// The y with the largest f, where that exceeds the answer's by tol of its range, and by what the
  /// error of x does not explain; null: there is none.
  const ValuesAtY* higher(double tol) {
    const ValuesAtY* worst = nullptr;
    for (const ValuesAtY& seen : seen_) {
      if (std::isfinite(seen.f()) && (worst == nullptr || seen.f() > worst->f())) worst = &seen;
    }
    if (worst == nullptr || !clearly_greater(worst->f(), here_.f(), ranges_.back(), tol))
      return nullptr;
    counts_.gradient += 2;
    const double explained = change_with_x(model_, here_.v, worst->v, options_.tol);
    return worst->f() - here_.f() > explained ? worst : nullptr;
  }

  /// The y that violates a robust constraint most, beside its range; or one where it is undefined.
  /// What follows from y, which is that of the x where it was met, is computed anew.
  std::optional<RobustWorstCase> violated() {
    constexpr double kVanishingRange = 1e-300;
    const double tol = options_.minmax_worst_case_tol + kRelaxations * options_.bound_relax_factor;
    std::optional<RobustWorstCase> worst;
    double largest = 0.0;
    for (const Index row : robust_constraints(s_)) {
      const std::size_t j = at(row);
      if (is_missed_at_answer(j))
        worst = {.constraint = row, .v = here_.v, .value = here_.g[j], .active = true};
      bool measured = false;
      for (const ValuesAtY& seen : seen_) {
        if (holds(j, seen.g[j], tol)) continue;
        const ValuesAtY here = anew(seen);
        if (!std::exchange(measured, true)) measure_change_by_equations(j);
        const double beside =
            excess_of_row(s_, j, here.g[j]) / std::max(ranges_[j].size(), kVanishingRange);
        if (holds(j, here.g[j], tol) || beside <= largest || !max_may_choose(here)) continue;
        worst = {.constraint = row, .v = here.v, .value = here.g[j], .active = true};
        largest = beside;
      }
    }
    return worst ? worst : undefined_;
  }

 private:
  /// Whether the answer's own y violates a row by what no tolerance of its solve explains.
  bool is_missed_at_answer(std::size_t j) const {
    constexpr double kNoTolerance = 1e-6;  // of the row's range, or of what x can change
    return excess_of_row(s_, j, here_.g[j]) >
           kNoTolerance * std::max(ranges_[j].size(), ranges_[j].cap) +
               2.0 * relaxation_where_exceeded(here_.g[j], s_.constraint_lower[j],
                                               s_.constraint_upper[j], options_);
  }

  /// The answer with another y, Max's variables, cut by the bounds; empty: it is the answer's.
  std::vector<double> answer_with(const std::vector<double>& y) const {
    std::vector<double> v = here_.v;
    for (const auto k : indices(of_max_)) {
      const std::size_t i = of_max_[k];
      v[i] = std::clamp(y[k], s_.variable_lower[i], s_.variable_upper[i]);
    }
    return v != here_.v && all_finite(v) ? v : std::vector<double>{};
  }

  /// Of y that are equal up to tol of the ranges the first, as far as sorting brings them together:
  /// maximizations of many constraints end at the same ones.
  Points distinct(const Points& all, double tol) const {
    VariableRanges ranges(s_);
    Points points;
    for (const auto& y : all) {
      if (auto v = answer_with(y); !v.empty()) points.push_back(std::move(v));
      if (!points.empty()) ranges.see(points.back());
    }
    std::vector<Index> order = numbers_below(points.size());
    const auto point = [&](Index k) -> const std::vector<double>& { return points[at(k)]; };
    std::ranges::stable_sort(order, {}, point);
    const auto same = [&](Index a, Index b) {
      return same_point(point(a), point(b), ranges, of_max_, tol);
    };
    order.erase(std::unique(order.begin(), order.end(), same), order.end());
    std::ranges::sort(order);
    Points first;
    for (const Index k : order) first.push_back(std::move(points[at(k)]));
    return first;
  }

  /// With the variables that follow from y by explicit equations at the answer's x.
  ValuesAtY anew(const ValuesAtY& seen) {
    if (!follows_) follows_ = RobustScopes(s_, linear_entries(model_, here_.v, counts_)).follows();
    ValuesAtY here = seen;
    if (follows_->empty() || !complete(model_, *follows_, here.v)) return seen;
    ++counts_.constraints;
    return model_.constraints(here.v, true, rows_of(here)) ? here : seen;
  }

  /// To what matters at the answer: what x can change there, or, where it changes nothing, how
  /// witnesses differ, some of which may be far away; and what a solve leaves undecided.
  void cap_ranges() {
    if (changes_.empty()) return;
    const double least = options_.tol / options_.minmax_worst_case_tol;
    for (std::size_t j = 0; j <= m_; ++j) {
      ValueRange seen;
      if (j == m_) seen.see(here_.f());
      for (const ValuesAtY& one : seen_) seen.see(one.g[j]);
      ranges_[j].cap = std::max(changes_[j] > 0.0 ? changes_[j] : seen.size(),
                                j == m_ ? least / scale_of_f_ : least);
    }
  }

  double scale_of_f_;
  std::vector<std::size_t> of_max_;  ///< variables
  std::vector<ValuesAtY> seen_;
};

/// Of its range: by what f must be exceeded.
double tolerance_of_f(const SolverOptions& options) {
  return std::max(options.tol, options.minmax_worst_case_tol);
}

void look_at_witnesses(Problem& model, const SolverOptions& options, const Witnesses& witnesses,
                       Result& result, Counts& counts) {
  const ProblemStructure& s = model.structure();
  // f is that of an inner maximum, and may be exceeded, also where no local minmax was found.
  const bool claims = is_success(result.status) || is_certified(result) ||
                      result.status == Status::NoLocalMinmaxFound;
  if (!claims || result.v.size() != s.variable_players.size() || !all_finite(result.v)) return;
  const Points known = witnesses.all();
  if (known.empty()) return;
  WitnessTest test(model, options, result, counts);
  test.add(known, witnesses.starts());
  if (options.minmax_robust_constraints) {
    if (auto violated = test.violated()) {
      result.over_y.better_known = true;
      result.worst_cases.push_back(std::move(*violated));
    }
  }
  // With a negative factor of the objective other y are no question.
  if (result.worst_case.higher || result.objective_scale < 0.0 || !has_max_variables(s) ||
      !std::isfinite(result.objective)) {
    return;
  }
  const ValuesAtY* higher = test.higher(tolerance_of_f(options));
  if (higher == nullptr) return;
  WorstCase& worst = result.worst_case;
  worst.value = higher->f();
  worst.v = higher->v;
  worst.y = max_part(s, worst.v);
  worst.higher = true;
  result.over_y.better_known =
      result.over_y.better_known || starts_over_y_of_objective(options) > 0;
}

/// A variable that is beyond its bounds by more than their relaxation; -1: none.
Index outside_bounds(const ProblemStructure& s, const SolverOptions& options,
                     const Result& result) {
  constexpr double kRounding = 1e-12;
  for (const auto i : indices(result.v)) {
    const double lower = s.variable_lower[i], upper = s.variable_upper[i];
    const double beyond = excess(result.v[i], lower, upper);
    const double relaxed = relaxation_where_exceeded(result.v[i], lower, upper, options);
    if (beyond > 2.0 * relaxed + kRounding * std::abs(result.v[i])) return static_cast<Index>(i);
  }
  return -1;
}

/// Steps of one variable, as shares of its range, with which f rises: clearly with the last, with
/// each before it by more than that share of the range of f.
struct Rise {
  std::span<const double> steps;
  double before_last;
};

/// Whether f rises in one of these ways with a step of one Max variable: y is no maximum.
bool rises_beside(Problem& model, const SolverOptions& options, const Result& result,
                  std::span<const Rise> ways, Counts& counts) {
  constexpr std::size_t kMostVariables = 50;
  const double accuracy = options.tol / std::abs(result.objective_scale);  // of f
  const ProblemStructure& s = model.structure();
  if (result.v.size() != s.variable_players.size() || result.objective_scale < 0.0) return false;
  VariableRanges sizes(s);
  sizes.see(result.v);
  const std::vector<std::size_t> of_max = variables_of(s, Player::Max);
  const std::vector<double> own = max_part(s, result.v);
  const WitnessTest here(model, options, result, counts);
  for (std::size_t k = 0; k < std::min(of_max.size(), kMostVariables); ++k) {
    // What goes back from a relaxed bound changes f by that.
    constexpr double kFarBesideRelaxation = 16.0;
    const std::size_t i = of_max[k];
    const double least =
        kFarBesideRelaxation * excess(own[k], s.variable_lower[i], s.variable_upper[i]);
    for (const double sign : {-1.0, 1.0}) {
      const auto rises_by = [&](double step, double tol) -> double {
        if (step * sizes.of(i) < least) return 0.0;
        std::vector<double> y = own;
        y[k] += sign * step * sizes.of(i);
        WitnessTest beside = here;
        beside.add({y}, {});
        const auto* higher = beside.higher(tol);
        return higher != nullptr ? higher->f() - result.objective : 0.0;
      };
      const bool rises = std::ranges::any_of(ways, [&](const Rise& way) {
        const auto before = way.steps.first(way.steps.size() - 1);
        return std::ranges::all_of(
                   before, [&](double step) { return rises_by(step, way.before_last) > 0.0; }) &&
               rises_by(way.steps.back(), tolerance_of_f(options)) > accuracy;
      });
      if (rises) return true;
    }
  }
  return false;
}

/// The constraints at the model's start, or those given where they are undefined there.
std::vector<double> rows_at_start(Problem& model, const std::vector<double>& given,
                                  Counts& counts) {
  std::vector<double> rows = given;
  ++counts.constraints;
  const auto start = model_start(model);
  return start && model.constraints(*start, true, rows) ? rows : given;
}

/// Says so where f would change by what counts as variables and constraints go back to bounds that
/// were relaxed: a large bound is moved by much beside the range of a small variable. And where a
/// row is violated by what counts beside its change from the start.
void name_relaxed_bounds(Problem& model, const SolverOptions& options, Result& result,
                         Counts& counts) {
  using enum CertificateReason::Kind;
  constexpr double kCounts = 1e-3;  // share of a value, or of a row's change
  const double counts_from = std::max(kCounts * std::abs(result.objective), options.tol);
  const ProblemStructure& s = model.structure();
  const Certificate& certificate = result.certificate;
  std::vector<CertificateReason>& reasons = result.certificate.reasons;
  if (!is_success(result.status) ||
      std::ranges::find(reasons, Relaxed, &CertificateReason::kind) != reasons.end()) {
    return;
  }
  const auto add = [&](CertificateReason about, const std::string& effect) {
    about.kind = Relaxed;
    about.text = "relaxed: bound_relax_factor moved a bound of " + about.text + effect;
    reasons.push_back(std::move(about));
  };
  const auto changes_f_by = [](double change) {
    return ", which changes f by about " + number_text(change, 2);
  };
  std::vector<double> at_start;
  for (std::size_t j = 0; j < std::min(result.constraints.size(), result.lambda.size()); ++j) {
    const double g = result.constraints[j];
    const double lower = s.constraint_lower[j], upper = s.constraint_upper[j];
    const double beyond = excess(g, lower, upper);
    const auto row = static_cast<Index>(j);
    const double change = beyond * std::abs(result.lambda[j]);
    std::string effect;
    // A multiplier of zero says nothing of how far the row is violated, nor do those of rows with
    // worst cases, which have their own.
    const bool weak = certificate.weakly_active_min + certificate.weakly_active_max > 0 ||
                      !result.worst_cases.empty();
    const double most = relaxation_where_exceeded(g, lower, upper, options);
    if (change > counts_from) {
      effect = changes_f_by(change);
    } else if (beyond > 0.0 && lower != upper && (weak || !(beyond > 0.5 * most))) {
      if (at_start.empty()) at_start = rows_at_start(model, result.constraints, counts);
      const double share = beyond / std::abs(at_start[j] - g);
      if (share > kCounts && std::isfinite(share))
        effect =
            ", which is violated by " + number_text(share, 2) + " of its change from the start";
    }
    if (effect.empty()) continue;
    return add(
        {.player = s.constraint_players[j], .text = constraint_name(s, row), .constraints = {row}},
        effect);
  }
  std::vector<double> gradient;
  for (std::size_t i = 0; i < result.v.size(); ++i) {
    const double leaves_by = excess(result.v[i], s.variable_lower[i], s.variable_upper[i]);
    if (leaves_by <= 2.0 * options.bound_relax_factor) continue;
    if (gradient.empty()) {
      gradient.resize(result.v.size());
      ++counts.gradient;
      if (!model.gradient(result.v, true, gradient)) return;
    }
    // Where the multiplier vanishes all between the bound and here are equal, if f reads others.
    const double change = leaves_by * std::max({std::abs(gradient[i]), std::abs(result.z_lower[i]),
                                                std::abs(result.z_upper[i])});
    const auto variable = static_cast<Index>(i);
    if (!(change > counts_from)) continue;
    return add({.player = s.variable_players[i],
                .text = variable_name(s, variable),
                .variables = {variable}},
               changes_f_by(change));
  }
}

/// Why a point that passed its own test is no answer to what was asked.
std::string why_refuted(const ProblemStructure& s, const Result& result) {
  const SearchOverY& y = result.over_y;
  if (y.better_known) {
    if (result.worst_case.higher) return describe_worst_case(result);
    if (result.worst_cases.empty()) return "a robust constraint is violated there";
    const RobustWorstCase& worst = result.worst_cases.back();
    const bool of_objective = at(worst.constraint) >= s.constraint_players.size();
    if (of_objective) return "f is " + number_text(worst.value, 8) + " at another y";
    return constraint_name(s, worst.constraint) + " is " +
           (std::isnan(worst.value) ? "undefined" : number_text(worst.value, 8)) +
           " at another y: " + describe_y(s, worst.constraint, worst.v);
  }
  const auto open = std::ranges::find(y.proofs, false, &WorstCaseProof::complete);
  if (open != y.proofs.end()) return open->message;
  if (!y.finished) return y.open.empty() ? "the search over y was not finished" : y.open;
  const SearchOverX& x = result.over_x;
  return std::to_string(x.made) + " of " + std::to_string(x.asked) + " starts were made";
}

/// Takes a success back. why: empty where the status says all.
void refute(Status status, const std::string& why, Result& result) {
  result.status = status;
  result.message = std::string(name_of(status)) + (why.empty() ? "" : ": ") + why;
}

void revoke_certificate(CertificateReason reason, Result& result) {
  Certificate& c = result.certificate;
  c.kind = PointKind::FirstOrderPoint;
  c.reasons.insert(c.reasons.begin(), std::move(reason));
}

/// The second-order test was about a worst case that may not be the highest, or about derivatives
/// that are wrong.
void revoke_test(CertificateReason reason, Result& result) {
  if (result.status == Status::Solved) result.status = Status::SolvedDegenerate;
  result.message += "; " + reason.text;
  Certificate& c = result.certificate;
  c.second_order = SecondOrder::Undecided;
  c.answer = InnerAnswer::Unknown;
  c.margin = c.least_curvature = 0.0;
  c.least_curvature_variable = -1;
  revoke_certificate(std::move(reason), result);
}

}  // namespace

void check_first_derivatives(Problem& problem, const SolverOptions& options, Result& result) {
  if (!is_certified(result) || !has_max_variables(problem.structure())) return;
  const std::string wrong = wrong_gradient_beside(problem, options, result);
  if (!wrong.empty())
    revoke_test({CertificateReason::Kind::WrongHessian, Player::Max, wrong}, result);
}

namespace {

/// Every function has its proof, and none says that there is no y.
void audit_proofs(Result& result) {
  SearchOverY& y = result.over_y;
  if (std::ssize(y.proofs) < y.functions) y.finished = false;
  const auto empty = std::ranges::find(y.proofs, true, &WorstCaseProof::empty);
  if (empty == y.proofs.end() || !is_success(result.status)) return;
  refute(Status::InnerInfeasible, empty->message, result);
}

void judge(Problem& model, const SolverOptions& options, const Witnesses& witnesses,
           std::optional<Status> cut, Result& result, Counts& counts) {
  using enum CertificateReason::Kind;
  look_at_witnesses(model, options, witnesses, result, counts);
  name_relaxed_bounds(model, options, result, counts);
  const SearchOverY& y = result.over_y;
  const Certificate& c = result.certificate;
  const bool seems_wrong = c.inner.positive > c.inner_expected.positive;
  const bool undecided =
      c.second_order == SecondOrder::Undecided || c.second_order == SecondOrder::Flat;
  const bool own_point = y.branches == 0;  // else f is that of one of several y
  const bool not_unique = c.answer == InnerAnswer::BestNotUnique;
  // However small the step: also along a kink, which curvature does not see. Where curvature does
  // not bend f it may rise farther out, and by nothing that counts before.
  static constexpr double kFarther[] = {1e-2, 1e-1}, kNearer[] = {1e-4, 1e-3, 1e-2};  // for spans
  const auto rises = [&] {
    std::vector<Rise> ways;
    if (own_point) ways.push_back({kFarther, 0.0});
    if (!not_unique)
      ways.push_back({std::span(kNearer).last(seems_wrong ? 1 : 3), tolerance_of_f(options)});
    return rises_beside(model, options, result, ways, counts);
  };
  if (is_success(result.status) && (undecided || not_unique) && (own_point || seems_wrong) &&
      has_max_variables(model.structure()) && rises()) {
    // Errors over branches are those of the form that was solved.
    refute(own_point ? Status::NotLocalMinmax : Status::WorstCaseNotMet,
           "f rises with y beside the point, y is no maximum", result);
  }
  const Index outside =
      is_success(result.status) ? outside_bounds(model.structure(), options, result) : -1;
  if (outside >= 0) {
    refute(Status::WorstCaseNotMet,
           variable_name(model.structure(), outside) + " is outside its bounds", result);
  }
  if (options.minmax_worst_case_proof) audit_proofs(result);
  const bool stopped = cut == Status::UserStop || cut == Status::OutOfMemory;
  const bool unfinished = !y.finished || result.over_x.made < result.over_x.asked;
  const bool was_cut = cut && (stopped || unfinished);
  const bool unmet = is_success(result.status) && (unfinished || y.better_known);
  if (was_cut ? result.status != *cut : unmet) {
    refute(was_cut ? *cut : Status::WorstCaseNotMet,
           unfinished || unmet ? why_refuted(model.structure(), result) : "", result);
  }
  if (is_certified(result) && !is_success(result.status)) {
    revoke_certificate({Search, y.better_known || !y.finished ? Player::Max : Player::Min,
                        "a strict local minmax by itself, but not the answer: " + result.message},
                       result);
  }
  const KktError& error = result.error;
  if (is_certified(result) &&
      error.complementarity > std::max(options.compl_inf_tol, error.total)) {  // hidden by s_c
    revoke_certificate({Search, Player::Min,
                        "the complementarity error exceeds compl_inf_tol: f may be off by " +
                            number_text(error.complementarity, 2)},
                       result);
  }
  if (!is_certified(result) || y.open.empty()) return;
  CertificateReason open{RobustRow, Player::Max, y.open};
  if (y.open_constraint >= 0) open.constraints.push_back(y.open_constraint);
  revoke_test(std::move(open), result);
}

}  // namespace

bool stands(const Result& result) {
  const SearchOverY& y = result.over_y;
  return y.finished && !y.better_known && result.over_x.made >= result.over_x.asked;
}

Rank rank_of(const Result& result) {
  // NaN would break the order.
  const auto number = [](double value) { return std::isnan(value) ? kInfinity : value; };
  const Certificate& found = result.certificate;
  // With a negative factor Min maximizes.
  const double objective = result.objective_scale < 0.0 ? -result.objective : result.objective;
  if (result.v.empty()) return {7, 0, 0.0};
  if (found.kind == PointKind::LocalMinmax && stands(result)) return {1, 0, number(objective)};
  if (found.second_order == SecondOrder::Violated) return {5, 0, number(result.error.total)};
  if (is_success(result.status) && stands(result)) {
    return {2, found.inner == found.inner_expected ? 0 : 1, number(objective)};
  }
  if (found.kind == PointKind::InfeasiblePoint) return {6, 0, number(result.error.primal)};
  if (found.second_order == SecondOrder::Satisfied) {
    if (result.worst_case.higher) return {3, 0, number(result.worst_case.value)};
    return {3, 1, number(result.over_y.largest_violation)};
  }
  return {4, 0, number(result.error.total)};
}

bool better(const Result& a, const Result& b) { return rank_of(a) < rank_of(b); }

void audit(Problem& model, const SolverOptions& options, const Witnesses& witnesses, Budget& budget,
           Result& result, Counts& counts) {
  try {
    judge(model, options, witnesses, budget.interrupted(), result, counts);
  } catch (const std::bad_alloc&) {  // what was not audited is no success
    budget.stop(Status::OutOfMemory);
    result.status = Status::OutOfMemory;
    result.message = "out of memory";
    if (is_certified(result)) result.certificate.kind = PointKind::FirstOrderPoint;
  }
}

}  // namespace ipminmax
