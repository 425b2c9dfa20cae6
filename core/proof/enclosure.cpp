#include "core/proof/enclosure.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// The variables that are free, and the constraints that count.
struct Scope {
  std::vector<double> v;  ///< n: those held
  std::vector<Index> variables;
  std::vector<Interval> domain;
  std::vector<FunctionOfBoxes::Row> rows;
  std::string uncut;  ///< why the domain cannot be cut into boxes; empty: it can
};

Scope scope_of(const ProblemStructure& s, const SolverOptions& options,
               const BoxFunctions::Determined& determined) {
  std::vector<bool> follows(s.variable_lower.size()), defines(s.constraint_lower.size());
  for (const Index i : determined.variables) follows[at(i)] = true;
  for (const Index j : determined.constraints) defines[at(j)] = true;
  Scope scope{.v = s.variable_lower, .variables = {}, .domain = {}, .rows = {}, .uncut = {}};
  const auto bounds = [&](double lower, double upper) {
    return std::pair(lower <= options.nlp_lower_bound_inf ? -kInfinity : lower,
                     upper >= options.nlp_upper_bound_inf ? kInfinity : upper);
  };
  for (std::size_t i = 0; i < s.variable_lower.size(); ++i) {
    const auto [lower, upper] = bounds(s.variable_lower[i], s.variable_upper[i]);
    if (lower == upper || follows[i]) continue;
    scope.variables.push_back(static_cast<Index>(i));
    scope.domain.emplace_back(lower, upper);
    if ((std::isfinite(lower) && std::isfinite(upper)) || !scope.uncut.empty()) continue;
    scope.uncut = variable_name(s, static_cast<Index>(i)) + " is Max's and has not two bounds";
  }
  if (scope.variables.size() > IntervalJet::kMostDirections && scope.uncut.empty()) {
    scope.uncut = "Max has " + std::to_string(scope.variables.size()) + " free variables, " +
                  std::to_string(IntervalJet::kMostDirections) + " at most can be cut into boxes";
  }
  for (std::size_t j = 0; j < s.constraint_lower.size(); ++j) {
    const auto [lower, upper] = bounds(s.constraint_lower[j], s.constraint_upper[j]);
    if ((lower == -kInfinity && upper == kInfinity) || defines[j]) continue;
    scope.rows.push_back({static_cast<Index>(j), lower, upper});
  }
  return scope;
}

/// A solve may leave bounds by bound_relax_factor, and constraints by its tolerance: whether the
/// point counts, and what it has at least.
BestSeen rate(FunctionOfBoxes& function, const Scope& scope, const std::vector<double>& seen,
              double constr_viol_tol) {
  const BestSeen none{.y = {}, .value = -kInfinity};
  if (seen.empty()) return none;
  BestSeen best = none;
  for (std::size_t k = 0; k < scope.variables.size(); ++k) {
    best.y.push_back(
        std::clamp(seen[at(scope.variables[k])], scope.domain[k].lower(), scope.domain[k].upper()));
  }
  FunctionOfBoxes::Look look;
  function.look(std::vector<Interval>(best.y.begin(), best.y.end()), look);
  best.value = look.value.value().lower();
  for (std::size_t k = 0; k < look.rows.size(); ++k) {
    const auto& [constraint, lower, upper] = function.rows()[k];
    const double g = look.rows[k].value().middle();
    if (!(std::max(lower - g, g - upper) <= constr_viol_tol)) return none;
  }
  return std::isfinite(best.value) ? best : none;
}

/// Of a domain, by halving the sides in turn, the longest part of a side first.
std::vector<std::vector<Interval>> parts_of(const std::vector<Interval>& domain, ProofShare share) {
  std::vector<std::vector<Interval>> parts = {domain};
  if (share.processes == 0) return parts;
  const Index parts_wanted = domain.empty() ? 1 : kPartsOfAProof;
  for (std::size_t side = 0; static_cast<Index>(parts.size()) < parts_wanted;
       side = (side + 1) % domain.size()) {
    std::vector<std::vector<Interval>> halves;
    for (const std::vector<Interval>& part : parts) {
      const double middle = part[side].middle();
      for (const Interval& half :
           {Interval(part[side].lower(), middle), Interval(middle, part[side].upper())}) {
        halves.push_back(part);
        halves.back()[side] = half;
      }
    }
    parts = std::move(halves);
  }
  std::vector<std::vector<Interval>> own;
  for (std::size_t k = at(share.process); k < parts.size(); k += at(share.processes)) {
    own.push_back(std::move(parts[k]));
  }
  return own;
}

/// Whether it is complete, of what is known.
void conclude(double tolerance, WorstCaseProof& proof) {
  const double enough = tolerance * std::max(1.0, std::abs(proof.seen)) * (1.0 + 1e-12);
  proof.complete =
      proof.empty || (std::isfinite(proof.seen) && proof.proved - proof.seen <= enough);
}

}  // namespace

void add_share(WorstCaseProof&& other, double tolerance, WorstCaseProof& proof) {
  proof.boxes += other.boxes;
  proof.left += other.left;
  // Of NaN and a number the number.
  proof.proved = std::fmax(proof.proved, other.proved);
  proof.empty = proof.empty && other.empty;
  if (!proof.interrupted) proof.interrupted = other.interrupted;
  if (!(proof.seen >= other.seen) && !std::isnan(other.seen)) {
    proof.seen = other.seen;
    proof.v = std::move(other.v);
  }
  conclude(tolerance, proof);
}

WorstCaseProof enclose_maximum(Problem& inner, const SolverOptions& options,
                               const std::vector<double>& seen, const BoxEffort& effort,
                               ProofShare share) {
  WorstCaseProof proof;
  proof.proved = kInfinity;
  const BoxFunctions* functions = inner.over_boxes();
  if (functions == nullptr) {
    proof.message = "the model's formulas are not known";
    return proof;
  }
  const Scope scope = scope_of(inner.structure(), options, functions->determined());
  FunctionOfBoxes function(*functions, scope.v, inner.structure().constraint_lower.size(),
                           scope.variables, scope.rows);
  BestSeen best{.y = {}, .value = -kInfinity};
  try {
    if (!scope.uncut.empty()) {
      const Interval all = function.value_over(scope.domain);
      proof.boxes = 1;
      proof.proved = all.upper();
      proof.seen = all.lower();
      proof.left = 1;
      proof.message = scope.uncut;
    } else {
      best = rate(function, scope, seen, options.constr_viol_tol);
      double proved = -kInfinity;
      const BestSeen known = best;
      for (const std::vector<Interval>& part : parts_of(scope.domain, share)) {
        BestSeen seen_there = known;
        const BoxBound bound = bound_over_boxes(function, part, effort, seen_there);
        proof.boxes += bound.boxes;
        proof.left += bound.left;
        proved = std::max(proved, bound.proved);
        if (seen_there.value > best.value) best = std::move(seen_there);
      }
      proof.proved = proved;  // of all parts: until then nothing is
      proof.empty = proved == -kInfinity;
      proof.message = "too many boxes";
    }
  } catch (const std::domain_error& error) {
    proof.message = error.what();
  }
  if (!best.y.empty()) {
    proof.seen = best.value;
    proof.v = scope.v;
    for (std::size_t k = 0; k < best.y.size(); ++k) proof.v[at(scope.variables[k])] = best.y[k];
    functions->determine(proof.v);
  }
  conclude(effort.tolerance, proof);
  return proof;
}

void describe(Index constraint, double sign, WorstCaseProof& proof) {
  const std::string why =
      proof.interrupted ? std::string(name_of(*proof.interrupted)) : proof.message;
  proof.constraint = constraint;
  proof.least = sign < 0.0;
  proof.seen *= sign;
  proof.proved *= sign;
  char text[160];
  if (proof.empty) {
    proof.message = "proved: no y meets Max's constraints at this x";
  } else if (proof.complete) {
    std::snprintf(text, sizeof text, "proved over all y: within %.3g of %.10g (%lld boxes)",
                  std::abs(proof.proved - proof.seen), proof.seen,
                  static_cast<long long>(proof.boxes));
    proof.message = text;
  } else {
    std::snprintf(text, sizeof text,
                  "): %.10g was seen, the bound is %.10g, %lld boxes of %lld are left", proof.seen,
                  proof.proved, static_cast<long long>(proof.left),
                  static_cast<long long>(proof.boxes));
    proof.message = "not proved (" + why + text;
  }
}

}  // namespace ipminmax
