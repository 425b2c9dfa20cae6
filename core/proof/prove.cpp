#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/global/over_y.hpp"
#include "core/model/norms.hpp"
#include "core/model/robust_copies.hpp"
#include "core/model/row_over_y.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof.hpp"
#include "core/proof/boxes.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Boxes between two words to the observer.
constexpr Index kBoxesOfAWord = 1000;

void refuse(bool wrong, const std::string& what) {
  if (wrong) throw std::invalid_argument("a proof over y: " + what);
}

void check(const ProblemStructure& s, std::span<const double> v, const ProofRequest& request) {
  refuse(!has_valid_indices(s), "the model's structure is not valid");
  refuse(v.size() != s.variable_players.size(),
         "the point has " + std::to_string(v.size()) + " values for " +
             std::to_string(s.variable_players.size()) + " variables");
  refuse(!all_finite(v), "the point is not finite");
  refuse(!(request.tolerance > 0.0) || request.most_boxes < 1 || request.starts < 1,
         "tolerance, starts and most_boxes must be positive");
  const Index m = static_cast<Index>(s.constraint_players.size());
  refuse(request.constraint < -1 || request.constraint >= m,
         "there is no constraint " + std::to_string(request.constraint));
  refuse(request.least && request.constraint < 0, "Max wants no least value of the objective");
  if (request.constraint < 0) return;
  refuse(s.constraint_players[at(request.constraint)] != Player::Min,
         constraint_name(s, request.constraint) + " is Max's, and no constraint on all y");
}

/// Max's free variables and his constraints that count for what is asked.
struct Scope {
  std::vector<Index> variables;
  std::vector<FunctionOfBoxes::Row> rows;
  std::vector<Interval> domain;
};

Scope scope_of(const ProblemStructure& s, const SolverOptions& options, Index constraint) {
  std::vector<Index> variables, constraints;
  if (constraint >= 0) {
    RobustScope scope = robust_scope(s, constraint);
    variables = std::move(scope.variables);
    constraints = std::move(scope.constraints);
  } else {
    for (std::size_t i = 0; i < s.variable_players.size(); ++i) {
      if (s.variable_players[i] == Player::Max) variables.push_back(static_cast<Index>(i));
    }
    for (std::size_t j = 0; j < s.constraint_players.size(); ++j) {
      if (s.constraint_players[j] == Player::Max) constraints.push_back(static_cast<Index>(j));
    }
  }
  Scope found;
  for (const Index i : variables) {
    const double lower = s.variable_lower[at(i)], upper = s.variable_upper[at(i)];
    if (lower == upper) continue;
    refuse(lower <= options.nlp_lower_bound_inf || upper >= options.nlp_upper_bound_inf,
           variable_name(s, i) + " is Max's and has not two bounds");
    found.variables.push_back(i);
    found.domain.emplace_back(lower, upper);
  }
  refuse(found.variables.size() > IntervalJet::kMostDirections,
         "Max has " + std::to_string(found.variables.size()) + " free variables, " +
             std::to_string(IntervalJet::kMostDirections) + " at most can be cut into boxes");
  for (const Index j : constraints) {
    const double lower = s.constraint_lower[at(j)], upper = s.constraint_upper[at(j)];
    found.rows.push_back({j, lower <= options.nlp_lower_bound_inf ? -kInfinity : lower,
                          upper >= options.nlp_upper_bound_inf ? kInfinity : upper});
  }
  return found;
}

/// Fixed variables of Max's are where their bounds are.
std::vector<double> held(const ProblemStructure& s, std::span<const double> v) {
  std::vector<double> own(v.begin(), v.end());
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (s.variable_players[i] == Player::Max && s.variable_lower[i] == s.variable_upper[i]) {
      own[i] = s.variable_lower[i];
    }
  }
  return own;
}

/// The largest value that our own maximizations find.
BestSeen maximize(Problem& problem, const std::vector<double>& v, const ProofRequest& request,
                  double sign, const Scope& scope, const MaximizationContext& context) {
  MaximaOverY found;
  if (request.constraint < 0) {
    found = maximize_objective(problem, v, request.starts, {}, context);
  } else {
    RowOverY row(problem, request.constraint, sign, v);
    found = maximize_over_y(row, request.starts, {}, context);
  }
  BestSeen best{.y = {}, .value = -kInfinity};
  if (found.maxima.empty()) return best;
  for (std::size_t k = 0; k < scope.variables.size(); ++k) {
    // A solve may leave bounds by bound_relax_factor.
    best.y.push_back(std::clamp(found.maxima.front().v[at(scope.variables[k])],
                                scope.domain[k].lower(), scope.domain[k].upper()));
  }
  return best;
}

std::string sentence(const WorstCaseProof& proof, const std::string& why) {
  char text[160];
  if (proof.empty) return "proved: no y meets Max's constraints at this x";
  if (proof.complete) {
    std::snprintf(text, sizeof text, "proved over all y: within %.3g of %.10g (%lld boxes)",
                  std::abs(proof.proved - proof.seen), proof.seen,
                  static_cast<long long>(proof.boxes));
    return text;
  }
  std::snprintf(text, sizeof text,
                "not proved (%s): %.10g was seen, the bound is %.10g, %lld boxes", why.c_str(),
                proof.seen, proof.proved, static_cast<long long>(proof.left));
  return std::string(text) + " of " + std::to_string(proof.boxes) + " are left";
}

/// Whether a point of Y(x), to the tolerance of solves, gives at least `value`.
void rate(FunctionOfBoxes& function, double constr_viol_tol, BestSeen& best) {
  if (best.y.empty()) return;
  FunctionOfBoxes::Look look;
  function.look(std::vector<Interval>(best.y.begin(), best.y.end()), look);
  best.value = look.value.value().lower();
  for (std::size_t k = 0; k < look.rows.size(); ++k) {
    const auto& [constraint, lower, upper] = function.rows()[k];
    const double g = look.rows[k].value().middle();
    if (!(std::max(lower - g, g - upper) <= constr_viol_tol)) best.value = -kInfinity;
  }
  if (!std::isfinite(best.value)) best = {.y = {}, .value = -kInfinity};
}

}  // namespace

WorstCaseProof prove_worst_case(Problem& problem, std::span<const double> v,
                                const SolverOptions& options, const ProofRequest& request,
                                const MultistartObserver& observer) {
  const ProblemStructure& s = problem.structure();
  check(s, v, request);
  const auto* functions = dynamic_cast<const BoxFunctions*>(&problem);
  refuse(functions == nullptr, "the model has no functions over boxes (ProvableProblem)");
  const Scope scope = scope_of(s, options, request.constraint);
  const std::vector<double> point = held(s, v);
  const double sign = request.least ? -1.0 : 1.0;
  Budget budget(options, observer);
  Result work;
  const MaximizationContext context{options, budget, 0, s, work, work.over_y};
  FunctionOfBoxes function(*functions, point, s.constraint_players.size(), request.constraint, sign,
                           scope.variables, scope.rows);
  WorstCaseProof proof;
  std::string why = "too many boxes";
  BestSeen best = maximize(problem, point, request, sign, scope, context);
  BoxBound bound{.proved = kInfinity};
  Index words = 0;
  const auto go_on = [&](Index boxes, double at_most) {
    if (budget.interrupted()) return false;
    if (boxes >= words * kBoxesOfAWord) {
      IterationInfo info;
      info.iteration = words++;
      info.over_y = true;
      info.objective = sign * at_most;
      info.v = point;
      info.result = [&work] { return work; };
      info.scaling = [](UserScaling&) {};
      if (!budget.tell(0, info)) return false;
    }
    return boxes < request.most_boxes;
  };
  try {
    rate(function, options.constr_viol_tol, best);
    bound = bound_over_boxes(function, scope.domain, request.tolerance, best, go_on);
  } catch (const UndecidedComparison& error) {
    why = error.what();
  }
  proof.interrupted = budget.interrupted();
  if (proof.interrupted) why = std::string(name_of(*proof.interrupted));
  proof.boxes = bound.boxes;
  proof.left = bound.left;
  proof.proved = sign * bound.proved;
  proof.empty = bound.proved == -kInfinity;
  if (!best.y.empty()) {
    proof.seen = sign * best.value;
    proof.v = point;
    for (std::size_t k = 0; k < best.y.size(); ++k) proof.v[at(scope.variables[k])] = best.y[k];
  }
  const double gap = bound.proved - best.value;
  proof.complete =
      proof.empty || gap <= request.tolerance * std::max(1.0, std::abs(best.value)) * (1.0 + 1e-12);
  proof.seconds = budget.stopwatch().wall();
  proof.message = sentence(proof, why);
  return proof;
}

}  // namespace ipminmax
