#include "core/diagnostics/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "core/certificate/scaling.hpp"
#include "core/differences/directional_check.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/model/status_table.hpp"
#include "core/model/structure_check.hpp"
#include "core/point/point.hpp"
#include "linalg/array.hpp"

namespace ipminmax {

namespace {

std::size_t player(Player p) { return p == Player::Max ? 1 : 0; }

struct Shares {
  std::array<std::size_t, 2> free{}, open{}, equations{};
  /// Open variables of Min that several of Max's equations read: states look like that.
  std::vector<Index> shared{};
};

bool is_open(const ProblemStructure& s, std::size_t i) {
  return s.variable_lower[i] <= -kUnbounded || s.variable_upper[i] >= kUnbounded;
}

/// Equations without free variables of their owner restrict nobody's choice.
Shares count(const ProblemStructure& s) {
  Shares counts;
  std::vector<bool> fixed(s.variable_players.size());
  for (const auto i : indices(fixed)) {
    fixed[i] = s.variable_lower[i] == s.variable_upper[i];
    if (!fixed[i]) ++counts.free[player(s.variable_players[i])];
    if (!fixed[i] && is_open(s, i)) ++counts.open[player(s.variable_players[i])];
  }
  std::vector<bool> moved(s.constraint_players.size(), false);
  for (const auto& [row, col] : s.jacobian) {
    if (!fixed[at(col)] && s.variable_players[at(col)] == s.constraint_players[at(row)])
      moved[at(row)] = true;
  }
  const auto equation = [&](std::size_t j) {
    return moved[j] && s.constraint_lower[j] == s.constraint_upper[j];
  };
  for (const auto j : indices(moved)) {
    if (equation(j)) ++counts.equations[player(s.constraint_players[j])];
  }
  std::vector<Index> last_reader(fixed.size(), -1);
  for (const auto& [row, col] : s.jacobian) {
    if (s.constraint_players[at(row)] != Player::Max || !equation(at(row)) || fixed[at(col)] ||
        s.variable_players[at(col)] != Player::Min || !is_open(s, at(col))) {
      continue;
    }
    if (last_reader[at(col)] >= 0 && last_reader[at(col)] != row) counts.shared.push_back(col);
    last_reader[at(col)] = row;
  }
  sort_each_once(counts.shared);
  return counts;
}

std::string plural(std::size_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace

std::string one_player_remark(const ProblemStructure& s) {
  const auto free = count(s).free;
  const auto has_variables = [&](Player p) {
    return std::ranges::find(s.variable_players, p) != s.variable_players.end();
  };
  if (!has_variables(Player::Max)) return "Max has no variables: this is a plain minimization.";
  if (!has_variables(Player::Min)) return "Min has no variables: this is a plain maximization.";
  if (free[1] == 0) return "Max's variables are all fixed: this is a plain minimization.";
  if (free[0] == 0) return "Min's variables are all fixed: this is a plain maximization.";
  return {};
}

std::vector<std::string> split_remarks(const ProblemStructure& s) {
  const Shares counts = count(s);
  std::vector<std::string> remarks;
  if (counts.free[0] == 0 || counts.free[1] == 0) return remarks;
  if (counts.equations[1] >= counts.free[1]) {
    remarks.push_back(
        "Max has " + plural(counts.equations[1], "equality constraint") + " for " +
        plural(counts.free[1], "variable") +
        ": no choice is left to him. Do other variables belong to Max, too: the states that these "
        "equations define, or his decisions?");
  } else if (counts.equations[1] > counts.open[1] && !counts.shared.empty()) {
    remarks.push_back(
        "Max has " + plural(counts.equations[1], "equality constraint") + " for " +
        plural(counts.open[1], "variable") + " without two bounds, and " +
        plural(counts.shared.size(), "variable") + " of Min's in several of them (the first: " +
        variable_name(s, counts.shared.front()) + "). Are these states, which belong to Max, too?");
  }
  return remarks;
}

namespace {

/// Whether each constraint reads variables of (Min, Max).
template <class Counts>
std::vector<std::array<bool, 2>> readers(const ProblemStructure& s, Counts&& counts) {
  std::vector<std::array<bool, 2>> reads(s.constraint_players.size());
  for (const auto& [row, col] : s.jacobian) {
    if (counts(at(col))) reads[at(row)][player(s.variable_players[at(col)])] = true;
  }
  return reads;
}

/// Where no stationary point withstands, or branches of y end, max over y of f may have a kink.
std::string at_possible_kink(const ProblemStructure& s) {
  std::string text =
      "if another y is as good here, max over y of f has a kink: minmax_epigraph yes minimizes the "
      "largest of the maxima over y";
  const auto reads = readers(s, [](std::size_t) { return true; });
  for (const auto j : indices(reads)) {
    if (s.constraint_players[j] != Player::Max || s.constraint_lower[j] != s.constraint_upper[j] ||
        reads[j][0]) {
      continue;
    }
    return text + "\nan inequality in place of Max's equation " +
           constraint_name(s, static_cast<Index>(j)) + " may have no kink";
  }
  return text;
}

}  // namespace

std::string unmet(const ProblemStructure& s, const SolverOptions& options, const Result& result) {
  if (result.status != Status::NoLocalMinmaxFound && result.status != Status::InnerUnbounded)
    return {};
  for (const Player of : {Player::Max, Player::Min}) {
    std::size_t worst = 0;
    double most = options.constr_viol_tol;
    for (const auto j : indices(result.constraints)) {
      const double g = result.constraints[j];
      const double outside = excess(g, s.constraint_lower[j], s.constraint_upper[j]);
      if (s.constraint_players[j] == of && outside > most) most = outside, worst = j;
    }
    if (!(most > options.constr_viol_tol)) continue;
    const std::string where =
        constraint_name(s, static_cast<Index>(worst)) + " by " + number_text(most, 3);
    return of == Player::Max
               ? "Max's constraints are not met at this x, " + where +
                     ": no y may satisfy them there\n"
                     "should they restrict Min, or should one of their variables be Min's?"
               : "Min's constraints are not met where the search ended, " + where +
                     "\ncheck whether they can be met, or begin elsewhere (minmax_starts)";
  }
  return {};
}

bool joins_players(const ProblemStructure& s) {
  const auto is_joint = [&](Triplet entry) {
    return s.variable_players[at(entry.row)] != s.variable_players[at(entry.col)];
  };
  const auto reads_other = [&](Triplet entry) {
    return s.constraint_players[at(entry.row)] != s.variable_players[at(entry.col)];
  };
  return !s.has_hessian || std::ranges::any_of(s.hessian, is_joint) ||
         std::ranges::any_of(s.jacobian, reads_other);
}

std::string advice(const ProblemStructure& s, const Result& result) {
  const std::size_t n = s.variable_players.size();
  const bool kink = result.status == Status::NoLocalMinmaxFound;
  const bool runs_away = result.status == Status::InnerUnbounded;
  const bool refuted = result.status == Status::NotLocalMinmax;
  if ((!kink && !runs_away && !refuted) || result.v.size() != n) return {};
  const Shares counts = count(s);
  if (counts.free[0] == 0 || counts.free[1] == 0) return {};
  if (refuted) return at_possible_kink(s);
  std::string text;
  for (const std::string& mistake : split_remarks(s)) text += (text.empty() ? "" : " ") + mistake;
  if (!text.empty()) return text;
  if (runs_away) {
    Index largest = -1;
    for (std::size_t i = 0; i < n; ++i) {
      if (s.variable_players[i] == Player::Max && is_open(s, i) &&
          (largest < 0 || std::abs(result.v[i]) > std::abs(result.v[at(largest)])))
        largest = static_cast<Index>(i);
    }
    if (largest >= 0)
      text = "the disturbance wins: f grows with " + variable_name(s, largest) + "\n";
    if (result.over_y.functions > 0 && !result.worst_cases.empty())  // a robust constraint
      return "what may help: bounds for Max's variables, or feedback for Min";
  }
  return text +
         "what may help: a higher price of Max's variables in f (find_price finds the least one), "
         "tighter bounds for them, feedback for Min" +
         (kink ? ", other starts (minmax_starts)\n" + at_possible_kink(s) : "");
}

std::string coupled_remark(const ProblemStructure& s) {
  const auto is_free = [&](std::size_t i) { return s.variable_lower[i] != s.variable_upper[i]; };
  const auto reads = readers(s, is_free);
  Index coupled = -1;
  for (std::size_t j = reads.size(); j-- > 0;) {
    const bool of_max = s.constraint_players[j] == Player::Max;
    if (!of_max && reads[j][1]) return {};  // robust: the user knows
    if (of_max && reads[j][0] && reads[j][1] && s.constraint_lower[j] < s.constraint_upper[j])
      coupled = static_cast<Index>(j);
  }
  if (coupled < 0) return {};
  return constraint_name(s, coupled) +
         " reads variables of both players and restricts Max. If Min must satisfy it for every y, "
         "give it to Min.";
}

namespace {

/// Longest entry of a step, over the size of the variables, for central differences of values.
constexpr double kStepOfValues = 1e-5;

bool may_be_due_to_derivatives(Status status) {
  using enum Status;
  return status == MaxIterations || (row_of(status).group == StatusRow::Group::Failure &&
                                     status != EvaluationFailed && status != InvalidNumber);
}

SolverOptions unscaled_at_the_point(SolverOptions options) {
  options.nlp_scaling_method = Scaling::None;
  options.warm_start_init_point = true;
  options.warm_start_bound_push = options.warm_start_bound_frac = parameters::kConstant;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = parameters::kConstant;
  options.warm_start_mult_init_max = 1e20;
  return options;
}

bool is_finite(const Result& result) {
  return all_finite(result.v) && all_finite(result.lambda) && all_finite(result.z_lower) &&
         all_finite(result.z_upper);
}

std::string beside(const Deviation& found) {
  char text[96];
  std::snprintf(text, sizeof text, " (%.3g along a small step, differences say %.3g)", found.exact,
                found.difference);
  return text;
}

/// here: first derivatives at v.
std::string find_wrong_gradient(CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                const Evaluation& here, const char* where) {
  const auto wrong =
      compare_first_derivatives(canonical, v, here, generic_step(canonical, v, kStepOfValues));
  if (!wrong) return {};
  const std::string of = wrong->index < 0 ? "the objective" : canonical.row_name(wrong->index);
  return "the gradient of " + of + " looks wrong " + where + beside(*wrong) +
         "\ntry derivative_test first-order";
}

std::optional<std::string> find_wrong_derivative(CanonicalProblem& canonical, bool has_hessian) {
  const Eigen::VectorXd v = canonical.starting_point().v;
  const Eigen::VectorXd lambda = canonical.starting_point().lambda;
  Evaluation here = unevaluated_point(canonical, canonical.starting_point()).evaluation;
  if (!canonical.first_derivatives(v, here)) return {};
  if (auto wrong = find_wrong_gradient(canonical, v, here, "at the last point"); !wrong.empty())
    return wrong;
  if (!has_hessian || !canonical.second_derivatives(v, lambda, here)) return {};
  const VariableScaling scaling = variable_scaling(canonical, v, here);
  Step first, second;
  Evaluation end;
  constexpr double kWrong = 1e-3, kStep = 1e-6;  // of each variable's length
  if (const auto wrong =
          compare_second_derivatives(canonical, v, lambda, here, generic_step(canonical, v, kStep),
                                     scaling.variable, kWrong, {first, second, end})) {
    return "the second derivatives in " + canonical.column_name(wrong->index) +
           " look wrong at the last point" + beside(*wrong) + "\ntry derivative_test second-order";
  }
  return std::string();
}

/// Says where the model is undefined a small step of Min's variables away, as far as bounds allow:
/// a search that ends there ends for this reason. Empty: not so, or there are no such variables.
std::string undefined_beside(CanonicalProblem& canonical) {
  constexpr double kSmallStep = 1e-2;  // of a variable's length
  const Eigen::VectorXd v = canonical.starting_point().v;
  const IndexRange x = canonical.x();
  Eigen::VectorXd there, c = Eigen::VectorXd::Zero(canonical.constraints());
  const auto moved = [&](Index i, double sign) {
    const double lower = canonical.lower()[i], upper = canonical.upper()[i];
    return std::clamp(v[i] + sign * kSmallStep * length_of(v[i], 0.0, lower, upper), lower, upper);
  };
  for (const double sign : {-1.0, 1.0}) {
    const auto is_defined = [&](Index count) {
      there = v;
      for (Index i = x.begin; i < x.begin + count; ++i) there[i] = moved(i, sign);
      double f = 0.0;
      return canonical.values(there, f, c);
    };
    if (is_defined(x.size()) || !is_defined(0)) continue;
    Index defined = 0, undefined = x.size();  // the first variables moved
    while (undefined - defined > 1) {
      const Index middle = defined + (undefined - defined) / 2;
      (is_defined(middle) ? defined : undefined) = middle;
    }
    const Index i = x.begin + defined;
    const double unit = canonical.variable_scale(i);
    return "the model is undefined if " + canonical.column_name(i) + " goes from " +
           number_text(v[i] / unit, 3) + " to " + number_text(moved(i, sign) / unit, 3) +
           "\nbound the variable where the model is defined, or check whether f has a minimum "
           "there";
  }
  return {};
}

/// Says which function carries fewer digits than a double: it stays the same over a small part of a
/// step over which it changes, and not over a larger part. Four values. Empty: none does, or it
/// cannot be told.
std::string few_digits(CanonicalProblem& canonical) {
  constexpr double kAside = 1e-2;  // of each variable's length
  constexpr double kPart = 1e-7;   // of that step: below the rounding of a float
  constexpr double kLarge = 1e-3;  // of it: over which only what is constant stays the same
  constexpr double kSeen = 2e-5;   // change over the step, beside the value, whose part is seen
  const Eigen::VectorXd v = canonical.starting_point().v;
  Eigen::VectorXd there = v;  // slacks stay
  const Eigen::VectorXd moved = aside(canonical, v, kAside);
  for (const IndexRange range : {canonical.x(), canonical.y()})
    there.segment(range.begin, range.size()) = moved.segment(range.begin, range.size());
  std::array<double, 4> f{};
  std::array<Eigen::VectorXd, 4> c;
  const std::array<Eigen::VectorXd, 4> points = {v, there, there + kPart * (there - v),
                                                 there + kLarge * (there - v)};
  for (const auto k : indices(points)) {
    c[k] = Eigen::VectorXd::Zero(canonical.constraints());
    if (!canonical.objective(points[k], f[k]) || !canonical.constraints(points[k], c[k])) {
      return {};
    }
  }
  const auto is_rounded = [&](double before, double here, double beside, double farther) {
    return here == beside && here != farther && std::abs(here - before) > kSeen * std::abs(here);
  };
  std::string name = is_rounded(f[0], f[1], f[2], f[3]) ? "the objective" : "";
  for (Index j = 0; name.empty() && j < canonical.constraints(); ++j)
    if (is_rounded(c[0][j], c[1][j], c[2][j], c[3][j])) name = canonical.row_name(j);
  if (name.empty()) return {};
  return name +
         " is rounded to few digits: it stays the same over a small step\ncompute it in double "
         "precision";
}

}  // namespace

void diagnose_failure(Problem& problem, const SolverOptions& options, Result& result) {
  if (!may_be_due_to_derivatives(result.status) || result.v.empty() || !is_finite(result)) return;
  const bool has_hessian = problem.structure().has_hessian &&
                           (options.hessian_approximation == HessianApproximation::Unset ||
                            options.hessian_approximation == HessianApproximation::Exact);
  const bool kink = result.status == Status::NoLocalMinmaxFound;
  const auto drop_first_line = [&] {  // which speaks of kinks
    const std::string rest =
        result.message.substr(std::min(result.message.find('\n'), result.message.size()));
    result.message = std::string(name_of(result.status)) + rest;
  };
  std::string help = unmet(problem.structure(), options, result);
  const bool joined = joins_players(problem.structure());
  if (help.empty() && kink && !joined)
    help = "check whether f has a minimum over x, or begin elsewhere (minmax_starts)";
  if (!help.empty()) {
    drop_first_line();
  } else if (joined) {
    help = advice(problem.structure(), result);
  }
  AtResult at(problem, &result);
  const SolverOptions own = unscaled_at_the_point(options);
  CanonicalProblem canonical(at, own, result.counts, result.timing);
  const bool built = canonical.build().empty();
  std::string cause;
  if (built && (kink || result.status == Status::TinyStep ||
                result.status == Status::InertiaCorrectionFailed)) {
    cause = undefined_beside(canonical);
    if (cause.empty()) cause = few_digits(canonical);
  }
  if (!cause.empty() && kink) {
    drop_first_line();
    result.message += '\n' + cause;
    return;
  }
  if (!cause.empty()) help = std::move(cause);
  const auto wrong = built ? find_wrong_derivative(canonical, has_hessian) : std::nullopt;
  std::string verdict = wrong.value_or("");
  if (wrong && wrong->empty())
    verdict = "first and second derivatives agree with differences there";
  if (wrong && !wrong->empty()) {  // the cause, whatever else is seen
    help.clear();
    if (kink) drop_first_line();
  }
  for (const std::string& text : {verdict, help}) {
    if (text.empty()) continue;
    if (result.message.empty()) result.message = std::string(name_of(result.status));
    result.message += "\n" + text;
  }
}

std::string wrong_gradient_beside(Problem& problem, const SolverOptions& options, Result& result) {
  if (!is_finite(result)) return {};
  AtResult at(problem, &result);
  const SolverOptions own = unscaled_at_the_point(options);
  CanonicalProblem canonical(at, own, result.counts, result.timing);
  if (!canonical.build().empty()) return {};
  constexpr double kAside = 1e-3;
  const Eigen::VectorXd v = aside(canonical, canonical.starting_point().v, kAside);
  Evaluation here = unevaluated_point(canonical, canonical.starting_point()).evaluation;
  if (!canonical.first_derivatives(v, here)) return {};
  return find_wrong_gradient(canonical, v, here, "beside the answer");
}

}  // namespace ipminmax
