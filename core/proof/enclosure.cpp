#include "core/proof/enclosure.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Dense>

#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
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
  for (const auto i : indices(s.variable_lower)) {
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
  for (const auto j : indices(s.constraint_lower)) {
    const auto [lower, upper] = bounds(s.constraint_lower[j], s.constraint_upper[j]);
    if ((lower == -kInfinity && upper == kInfinity) || defines[j]) continue;
    scope.rows.push_back({static_cast<Index>(j), lower, upper});
  }
  return scope;
}

/// Random points at which the model is evaluated before boxes are.
constexpr int kKnownPoints = 16;
/// Gauss-Newton steps from a point to where the constraints hold.
constexpr int kStepsToRows = 20;
/// Units of rounding of its terms by which a formula widens a value.
constexpr double kUnitsOfWidth = 8.0;

/// Moves y to where the constraints hold to rounding, by steps of least length; a solve stops at
/// its tolerance. False: none is found.
bool meet_rows(FunctionOfBoxes& function, const std::vector<Interval>& domain,
               std::vector<double>& y) {
  FunctionOfBoxes::BoxValues found;
  for (int step = 0;; ++step) {
    function.evaluate(std::vector<Interval>(y.begin(), y.end()), found);
    std::vector<std::size_t> missed;
    for (const auto k : indices(found.rows)) {
      if (!function.rows()[k].is_met(found.rows[k].value())) missed.push_back(k);
    }
    if (missed.empty() || step == kStepsToRows) return missed.empty();
    Eigen::MatrixXd slopes(static_cast<Eigen::Index>(missed.size()),
                           static_cast<Eigen::Index>(y.size()));
    Eigen::VectorXd distance(slopes.rows());
    for (Eigen::Index r = 0; r < slopes.rows(); ++r) {
      const std::size_t k = missed[static_cast<std::size_t>(r)];
      const double g = found.rows[k].value().middle();
      distance[r] = std::clamp(g, function.rows()[k].lower, function.rows()[k].upper) - g;
      for (Eigen::Index i = 0; i < slopes.cols(); ++i) {
        const auto variable = static_cast<std::size_t>(i);
        slopes(r, i) = found.rows[k].gradient(variable).middle() *
                       (domain[variable].upper() - domain[variable].lower());
      }
    }
    if (!slopes.allFinite() || !distance.allFinite()) return false;
    const Eigen::VectorXd move = slopes.completeOrthogonalDecomposition().solve(distance);
    for (const auto i : indices(y)) {
      const double width = domain[i].upper() - domain[i].lower();
      y[i] = std::clamp(y[i] + width * move[static_cast<Eigen::Index>(i)], domain[i].lower(),
                        domain[i].upper());
    }
  }
}

/// What a function is at points, by its own evaluation and over the box that is a point. best:
/// becomes the best of those that meet the constraints.
class Sampling {
 public:
  Sampling(Problem& inner, const BoxFunctions& functions, const Scope& scope,
           FunctionOfBoxes& function, BestSeen& best)
      : inner_(inner), functions_(functions), scope_(scope), function_(function), best_(best) {
    values.rows.resize(scope.rows.size());
  }

  /// seen: n values, or none.
  void run(const std::vector<double>& seen) {
    std::vector<double> y;
    for (const auto k : indices(scope_.variables)) {
      const double at_seen = seen.empty() ? 0.0 : seen[at(scope_.variables[k])];
      y.push_back(std::clamp(at_seen, scope_.domain[k].lower(), scope_.domain[k].upper()));
    }
    if (!seen.empty()) add(y);
    std::mt19937_64 generator(1);
    for (int point = 0; point < kKnownPoints; ++point) {
      for (const auto k : indices(y)) {
        const auto [lower, upper] = std::pair(scope_.domain[k].lower(), scope_.domain[k].upper());
        const double share = uniform(generator);
        if (std::isfinite(lower) && std::isfinite(upper)) y[k] = lower + share * (upper - lower);
      }
      add(y);
    }
  }

  KnownValues values;

 private:
  void add(std::vector<double> y) {
    KnownValues::Point point{y, {}, {}, scope_.uncut.empty()};
    FunctionOfBoxes::BoxValues found;
    if (scope_.uncut.empty()) {
      point.is_met = meet_rows(function_, scope_.domain, point.y);
      if (!point.is_met) point.y = std::move(y);
      function_.evaluate(std::vector<Interval>(point.y.begin(), point.y.end()), found);
    } else {
      found.value = IntervalJet(function_.value_over(std::vector<Interval>(y.begin(), y.end())));
    }
    std::vector<double> v = scope_.v, g(inner_.structure().constraint_lower.size());
    for (const auto k : indices(point.y)) v[at(scope_.variables[k])] = point.y[k];
    functions_.determine(v);
    double f = 0.0;
    if (!inner_.objective(v, true, f) || !std::isfinite(f)) return;
    if (!found.rows.empty() && (!inner_.constraints(v, false, g) || !all_finite(g))) return;
    point.value = with_rounding(f, found.value.value());
    agree(-1, found.value.value(), point.value);
    for (const auto k : indices(found.rows)) {
      point.rows.push_back(with_rounding(g[at(scope_.rows[k].constraint)], found.rows[k].value()));
      agree(scope_.rows[k].constraint, found.rows[k].value(), point.rows.back());
      see(point.rows.back(), values.rows[k]);
    }
    values.points.push_back(point);
    if (!point.is_met && scope_.uncut.empty()) return;
    see(found.value.value(), best_.range);
    const double least = found.value.value().lower();
    if (point.is_met && std::isfinite(least) && least > best_.value) {
      best_.value = least;
      best_.y = std::move(point.y);
    }
  }
  /// The model may compute the formula in another order.
  static Interval with_rounding(double value, const Interval& over) {
    const double width = over.upper() - over.lower();
    return Interval(value) + Interval(-width, width);
  }
  static void see(const Interval& value, ValueRange& range) {
    range.see(value.lower());
    const double width = value.upper() - value.lower();
    if (std::isfinite(width)) range.terms = std::max(range.terms, width / kUnitsOfWidth / kEpsilon);
  }

  Problem& inner_;
  const BoxFunctions& functions_;
  const Scope& scope_;
  FunctionOfBoxes& function_;
  BestSeen& best_;
};

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
void conclude(WorstCaseProof& proof) {
  const double enough = proof.resolution * (1.0 + 1e-12);  // of the difference's own rounding
  proof.complete =
      proof.empty || (std::isfinite(proof.seen) && proof.proved - proof.seen <= enough);
}

}  // namespace

void add_share(WorstCaseProof&& other, WorstCaseProof& proof) {
  proof.boxes += other.boxes;
  proof.left += other.left;
  // Of NaN and a number the number.
  proof.proved = std::fmax(proof.proved, other.proved);
  proof.resolution = std::max(proof.resolution, other.resolution);
  proof.empty = proof.empty && other.empty;
  if (!proof.interrupted) proof.interrupted = other.interrupted;
  if (!(proof.seen >= other.seen) && !std::isnan(other.seen)) {
    proof.seen = other.seen;
    proof.v = std::move(other.v);
  }
  conclude(proof);
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
  BestSeen best;
  try {
    Sampling sampling(inner, *functions, scope, function, best);
    sampling.run(seen);
    const KnownValues& values = sampling.values;
    proof.resolution = best.range.resolution(effort.tolerance);
    if (!scope.uncut.empty()) {
      const Interval all = function.value_over(scope.domain);
      for (const KnownValues::Point& point : values.points) agree(-1, all, point.value);
      proof.boxes = 1;
      proof.proved = all.upper();
      proof.seen = all.lower();
      proof.left = 1;
      proof.message = scope.uncut;
    } else {
      double proved = -kInfinity;
      const BestSeen known = best;
      for (const std::vector<Interval>& part : parts_of(scope.domain, share)) {
        BestSeen seen_there = known;
        const BoxBound bound = bound_over_boxes(function, part, values, effort, seen_there);
        proof.boxes += bound.boxes;
        proof.left += bound.left;
        proved = std::max(proved, bound.proved);
        proof.resolution =
            std::max(proof.resolution, seen_there.range.resolution(effort.tolerance));
        if (seen_there.value > best.value) best = std::move(seen_there);
      }
      proof.proved = proved;  // of all parts: until then nothing is
      proof.empty = proved == -kInfinity;
      proof.message = std::isinf(proved) ? "the formulas are not finite" : "too many boxes";
    }
  } catch (const WrongOverBoxes& error) {
    best = {};
    proof.message = (error.constraint < 0 ? "its value"
                                          : constraint_name(inner.structure(), error.constraint)) +
                    (" " + std::string(error.what()));
  } catch (const std::domain_error& error) {
    proof.message = error.what();
  }
  if (!best.y.empty()) {
    proof.seen = best.value;
    proof.v = scope.v;
    for (const auto k : indices(best.y)) proof.v[at(scope.variables[k])] = best.y[k];
    functions->determine(proof.v);
  }
  conclude(proof);
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
    std::snprintf(text, sizeof text, "proved over all y: within %.3g of %.10g (%lld box%s)",
                  std::abs(proof.proved - proof.seen), proof.seen,
                  static_cast<long long>(proof.boxes), proof.boxes == 1 ? "" : "es");
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
