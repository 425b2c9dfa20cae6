#include "core/certificate/scaling.hpp"

#include <algorithm>
#include <utility>

#include "core/certificate/parameters.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

using namespace parameters::certificate;

constexpr double kUnknown = 0.0;
/// 1 / norm; unknown for zero and for what would leave the range of numbers.
double inverse(double norm) { return norm > 1e-150 && norm < 1e150 ? 1.0 / norm : kUnknown; }

struct Scaler {
  const CanonicalProblem& canonical;
  const Evaluation& evaluation;
  VariableScaling& scaling;
  Parts parts;
  Step &first = parts.step(), &second = parts.step();
  Vector& size = first.v;                                       ///< here or at the start
  Vector &diagonal = first.z_lower, &coupling = first.z_upper;  ///< of W
  Vector& norms = second.v;                                     ///< of rows of W
  Vector &rows = first.lambda, &columns = second.z_lower;       ///< of the Jacobian
  Vector& d = scaling.variable;

  /// The block of one player: diagonal entries first, then rows without one. Max's comes first; for
  /// Min what couples x to y counts, too: the maximizer's answer makes of it W_xy^2 / W_yy, which
  /// is curvature of x as well.
  void equilibrate(bool max) {
    diagonal.setZero(d.size());
    coupling.setZero(d.size());
    for_each_in_hessian(canonical, evaluation, [&](Index i, Index j, double value) {
      const bool row = canonical.owned_by_max(i) == max, col = canonical.owned_by_max(j) == max;
      if (i == j) diagonal[i] += std::abs(value);
      if (row == col || max) return;
      double& own = coupling[row ? i : j];
      own = std::max(own, std::abs(value) * d[row ? j : i]);
    });
    for (const Index i : indices(d)) {
      if (canonical.owned_by_max(i) == max)
        d[i] = inverse(std::max(std::sqrt(diagonal[i]), coupling[i]));
    }
    // Nothing but products, x_1 x_2: in proportion to their sizes.
    for_own(max, [&](Index i, Index j, double entry) {
      if (d[i] == kUnknown && d[j] == kUnknown) {
        const double both = inverse(std::sqrt(entry * size_of(i) * size_of(j)));
        d[i] = size_of(i) * both;
        d[j] = size_of(j) * both;
      } else if (d[i] == kUnknown || d[j] == kUnknown) {
        (d[i] == kUnknown ? d[i] : d[j]) = inverse(entry * std::max(d[i], d[j]));
      }
    });
    constexpr int kSweeps = 4;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      norms.setZero(d.size());
      for_own(max, [&](Index i, Index j, double entry) {
        norms[i] = std::max(norms[i], entry * (d[i] == kUnknown ? 1.0 : d[i]) * d[j]);
        norms[j] = std::max(norms[j], entry * (d[j] == kUnknown ? 1.0 : d[j]) * d[i]);
      });
      if (!(norms.size() > 0 && norms.maxCoeff() > 1.0)) break;
      d.array() /= norms.array().max(1.0).sqrt();
    }
  }

  /// Variables without curvature from the other player's, whose lengths are known; two that are
  /// both without share the coupling in proportion to their sizes.
  void measure_by_coupling() {
    Vector &known = norms, &unknown = coupling;
    known.setZero(d.size());
    unknown.setZero(d.size());
    for_each_in_hessian(canonical, evaluation, [&](Index i, Index j, double value) {
      if (canonical.owned_by_max(i) == canonical.owned_by_max(j)) return;
      for (const auto& [row, col] : {std::pair{i, j}, std::pair{j, i}}) {
        const bool is_known = d[col] != kUnknown;
        double& norm = is_known ? known[row] : unknown[row];
        norm = std::max(norm, std::abs(value) * (is_known ? d[col] : size_of(i) * size_of(j)));
      }
    });
    for (const Index i : indices(d)) {
      if (d[i] == kUnknown)
        d[i] = known[i] > 0.0 ? inverse(known[i]) : size_of(i) * inverse(std::sqrt(unknown[i]));
    }
  }

  /// Variables without curvature, from the constraints that tie them to others, but no less than
  /// their own size: a short one comes from an entry that vanishes.
  void spread_by_constraints() {
    set_row_norms();
    bool found = true;
    constexpr int kRounds = 16;
    for (int round = 0; found && round < kRounds; ++round) {
      columns.setZero(d.size());
      for_each_in_jacobian(canonical, evaluation, [&](Index row, Index col, double value) {
        if (d[col] == kUnknown && rows[row] > 0.0)
          columns[col] = std::max(columns[col], std::abs(value) / rows[row]);
      });
      found = false;
      for_each_in_jacobian(canonical, evaluation, [&](Index row, Index col, double value) {
        const double length = inverse(columns[col]);
        if (length == kUnknown) return;
        d[col] = std::max(length, size[col]);
        rows[row] = std::max(rows[row], std::abs(value) * d[col]);
        found = true;
      });
    }
    for (double& value : d) {
      if (value == kUnknown) value = 1.0;
    }
  }

  /// An equation ties its owner's variables to others: a length beside which those are nothing is
  /// cut to what they can make up for, or to the variable's own size. Each equation cuts one
  /// length, as it determines one variable.
  void cut_by_equations() {
    Vector& is_done = rows;           // or no equation
    Vector& largest = second.lambda;  // term, the next one, and whose it is
    Vector &next = parts.step().lambda, &owner = parts.step().lambda;
    for (const Index j : indices(is_done)) is_done[j] = canonical.slack_of(j) >= 0;
    bool any = true;
    constexpr int kRounds = 16;
    for (int round = 0; any && round < kRounds; ++round) {
      for (Vector* all : {&largest, &next, &owner}) all->setZero(rows.size());
      for_each_in_jacobian(canonical, evaluation, [&](Index row, Index col, double value) {
        if (is_done[row] > 0.0) return;
        const double term = std::abs(value) * d[col];
        next[row] = std::max(next[row], std::min(term, largest[row]));
        if (term > largest[row]) largest[row] = term, owner[row] = col;
      });
      any = false;
      for (const Index j : each_constraint(canonical)) {
        const auto i = static_cast<Index>(owner[j]);
        if (!(next[j] > 0.0) || kMinorShare * largest[j] <= next[j] ||
            canonical.owned_by_max(i) != canonical.max_constraints().contains(j)) {
          continue;
        }
        d[i] = std::min(d[i], std::max(d[i] * next[j] / largest[j], size[i]));
        is_done[j] = 1.0;
        any = true;
      }
    }
  }

  /// Rows of length about one, and slacks of their length.
  void measure_rows() {
    set_row_norms();
    for (const Index j : each_constraint(canonical)) {
      const double length = inverse(rows[j]);
      double& unit = scaling.constraint[j] = length == kUnknown ? 1.0 : length;
      if (canonical.slack_of(j) >= 0) d[canonical.slack_of(j)] = 1.0 / unit;
    }
  }

  /// Entries of W between variables of one player.
  template <class Visit>
  void for_own(bool max, Visit&& visit) {
    for_each_in_hessian(canonical, evaluation, [&](Index i, Index j, double value) {
      if (canonical.owned_by_max(i) == max && canonical.owned_by_max(j) == max)
        visit(i, j, std::abs(value));
    });
  }
  /// One where nothing shows it.
  double size_of(Index i) const { return size[i] > 0.0 ? size[i] : 1.0; }
  /// Largest |J_ji| d_i of each row, unknown ones left out.
  void set_row_norms() {
    rows.setZero(canonical.constraints());
    for_each_in_jacobian(canonical, evaluation, [&](Index row, Index col, double value) {
      rows[row] = std::max(rows[row], std::abs(value) * d[col]);
    });
  }
};

}  // namespace

void scale_variables(const CanonicalProblem& canonical, const Vector& v,
                     const Evaluation& evaluation, Parts parts, VariableScaling& scaling,
                     bool by_coupling) {
  scaling.variable.setConstant(canonical.variables(), kUnknown);
  scaling.constraint.setOnes(canonical.constraints());
  Scaler scaler{canonical, evaluation, scaling, parts};
  scaler.size = v.cwiseAbs().cwiseMax(canonical.starting_point().v.cwiseAbs());
  scaler.equilibrate(true);
  scaler.equilibrate(false);
  if (by_coupling) scaler.measure_by_coupling();
  scaler.spread_by_constraints();
  scaler.cut_by_equations();
  scaler.measure_rows();
}

VariableScaling variable_scaling(const CanonicalProblem& canonical, const Vector& v,
                                 const Evaluation& evaluation) {
  Workspace workspace;
  VariableScaling scaling;
  scale_variables(canonical, v, evaluation, Parts(workspace), scaling);
  return scaling;
}

double own_size(const CanonicalProblem& canonical, double v, Index i,
                const VariableScaling& scaling) {
  const double start = canonical.starting_point().v[i], unit = scaling.variable[i];
  const double size = std::max(std::abs(v), std::abs(start));
  const double width = canonical.upper()[i] - canonical.lower()[i];
  return std::min({size > 0.0 ? size : unit, width, std::max(std::abs(v - start), unit)});
}

double longest(const CanonicalProblem& canonical, const Vector& v, const VariableScaling& scaling) {
  double size = 0.0;
  for (const IndexRange own : {canonical.x(), canonical.y()}) {
    for (const Index i : indices(own)) size = std::max(size, std::abs(v[i]) / scaling.variable[i]);
  }
  return size;
}

double size_of_problem(const CanonicalProblem& canonical, const Vector& v,
                       const VariableScaling& scaling) {
  return std::max(longest(canonical, v, scaling),
                  longest(canonical, canonical.starting_point().v, scaling));
}

}  // namespace ipminmax
