#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <span>
#include <utility>

#include "core/diagnostics/derivative_test.hpp"
#include "core/differences/hessian_detection.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Rounding errors of a function's value, in units of kEpsilon times its size.
constexpr double kRounding = 8.0;

class DerivativeTester {
 public:
  DerivativeTester(Problem& problem, const SolverOptions& options)
      : problem_(problem),
        structure_(problem.structure()),
        options_(options),
        source_(problem),
        n_(static_cast<Index>(structure_.variable_lower.size())),
        m_(static_cast<Index>(structure_.constraint_lower.size())) {}

  DerivativeReport run() {
    if (!choose_point()) return std::move(report_);
    const bool first = options_.derivative_test != DerivativeTest::OnlySecondOrder;
    const bool second = options_.derivative_test != DerivativeTest::FirstOrder;
    if (first) test_first_derivatives();
    if (second && !structure_.has_hessian) {
      report_.remarks.emplace_back("The model has no second derivatives to test.");
    } else if (second) {
      test_second_derivatives();
    }
    return std::move(report_);
  }

 private:
  struct Values {
    double f = 0.0;
    std::vector<double> g;
  };

  [[nodiscard]] bool fail(std::string why) {
    report_.failure = std::move(why);
    return false;
  }

  bool choose_point() {
    std::vector<double> start(at(n_), 0.0), lambda(at(m_), 0.0), lower(at(n_), 0.0),
        upper(at(n_), 0.0);
    StartingPoint request{start, options_.warm_start_init_point, lambda, lower, upper};
    if (!problem_.starting_point(request)) return fail("the model gives no starting point");
    if (!all_finite(start)) return fail("the starting point is not finite");
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> fraction(0.0, 1.0);
    // Nearer to the starting point where the functions are undefined.
    double radius = options_.point_perturbation_radius;
    for (int trial = 0; trial < 30; ++trial, radius *= 0.5) {
      report_.v = start;
      for (Index i = 0; i < n_; ++i) {
        const double low = structure_.variable_lower[at(i)],
                     high = structure_.variable_upper[at(i)];
        if (!(low <= high)) return fail("the bounds of the variables are inconsistent");
        const double s = std::clamp(start[at(i)], low, high);
        const double a = std::max(low, s - radius), b = std::min(high, s + radius);
        report_.v[at(i)] = std::min(a + fraction(random) * (b - a), b);
      }
      if (evaluate(report_.v, here_) && source_.evaluate(report_.v, derivatives_)) return true;
    }
    return fail("the functions or their first derivatives are undefined around the starting point");
  }

  [[nodiscard]] bool evaluate(std::span<const double> v, Values& values) {
    values.g.assign(at(m_), 0.0);
    if (!all_finite(v)) return false;
    if (!problem_.objective(v, true, values.f) || !std::isfinite(values.f)) return false;
    return m_ == 0 || (problem_.constraints(v, false, values.g) && all_finite(values.g));
  }

  /// Calls evaluate at the point with variable i moved up or, where that leaves the bounds or is
  /// undefined, down. The step taken, 0 when neither works.
  template <class Evaluate>
  double move(Index i, Evaluate&& evaluate_at) {
    const double here = report_.v[at(i)];
    const double step = options_.derivative_test_perturbation * std::max(1.0, std::abs(here));
    std::vector<double> v = report_.v;
    bool inside = false;
    const auto moved = [&](double offset, bool respect_bounds) {
      v[at(i)] = here + offset;
      if (respect_bounds && !(structure_.variable_lower[at(i)] <= v[at(i)] &&
                              v[at(i)] <= structure_.variable_upper[at(i)])) {
        return false;
      }
      inside = true;
      return v[at(i)] != here && evaluate_at(v);
    };
    if (moved(step, true) || moved(-step, true)) return v[at(i)] - here;
    // A fixed variable has no room; its derivatives are tested all the same.
    if (!inside && (moved(step, false) || moved(-step, false))) return v[at(i)] - here;
    report_.remarks.push_back("The functions are undefined on both sides of " +
                              variable_name(structure_, i) + ".");
    return 0.0;
  }

  /// value_size: size of the differenced values, for their rounding errors.
  void compare(DerivativeEntry entry, bool in_structure, double value_size, double step) {
    const double gap = std::abs(entry.exact - entry.approximate);
    entry.relative_error = gap / std::max(1.0, std::abs(entry.approximate));
    const double noise = kRounding * kEpsilon * value_size / std::abs(step);
    const bool wrong = !(entry.relative_error < options_.derivative_test_tol) && !(gap <= noise);
    if (wrong) {
      entry.finding = in_structure ? DerivativeFinding::Differs : DerivativeFinding::Missing;
    }
    entry.crosses_players = entry.constraint >= 0 && entry.second_variable < 0 &&
                            structure_.constraint_players[at(entry.constraint)] == Player::Min &&
                            structure_.variable_players[at(entry.variable)] == Player::Max &&
                            (in_structure ? !options_.minmax_robust_constraints : wrong);
    const bool second = entry.second_variable >= 0;
    if (in_structure || wrong) ++(second ? report_.second_tested : report_.first_tested);
    if (wrong) ++(second ? report_.second_wrong : report_.first_wrong);
    if (wrong || entry.crosses_players || (in_structure && options_.derivative_test_print_all)) {
      report_.entries.push_back(entry);
    }
  }

  void test_first_derivatives() {
    std::vector<std::map<Index, double>> columns(at(n_));  // of the Jacobian
    for (const auto k : indices(structure_.jacobian)) {
      const auto [row, col] = structure_.jacobian[k];
      columns[at(col)][row] += derivatives_.jacobian[k];
    }
    Values there;
    for (Index i = std::max(options_.derivative_test_first_index, 0); i < n_; ++i) {
      const double step = move(i, [&](std::span<const double> v) { return evaluate(v, there); });
      if (step == 0.0) continue;
      compare({.variable = i,
               .exact = derivatives_.gradient[at(i)],
               .approximate = (there.f - here_.f) / step},
              true, std::max(std::abs(there.f), std::abs(here_.f)), step);
      for (Index k = 0; k < m_; ++k) {
        const auto found = columns[at(i)].find(k);
        const bool in_structure = found != columns[at(i)].end();
        const double a = here_.g[at(k)], b = there.g[at(k)];
        if (!in_structure && a == b) continue;
        compare({.constraint = k,
                 .variable = i,
                 .exact = in_structure ? found->second : 0.0,
                 .approximate = (b - a) / step},
                in_structure, std::max(std::abs(a), std::abs(b)), step);
      }
    }
  }

  /// A second derivative as the model has it and by a difference.
  struct Compared {
    double exact = 0.0, difference = 0.0;
    double size = 0.0;  ///< of the differenced derivatives; 0: they are the same
    double step = 1.0;
    bool in_structure = false;
  };

  void test_second_derivatives() {
    // Of a function (-1: the objective), a row, and a column that is no larger. Differences are of
    // all functions at once: per variable one gradient and one Jacobian.
    std::map<std::array<Index, 3>, Compared> entries;
    std::vector<bool> moves(at(n_));
    const auto here = by_function(derivatives_);
    FirstDerivatives moved;
    for (Index j = 0; j < n_; ++j) {
      const double step =
          move(j, [&](std::span<const double> v) { return source_.evaluate(v, moved); });
      moves[at(j)] = step != 0.0;
      if (step == 0.0) continue;
      for (const auto& [of, value] : by_function(moved)) {
        const double base = here.at(of);
        if (value == base) continue;
        // Either order of differentiation will do; the first is kept.
        entries.try_emplace({of.first, std::max(of.second, j), std::min(of.second, j)},
                            Compared{.difference = (value - base) / step,
                                     .size = std::max(std::abs(value), std::abs(base)),
                                     .step = step});
      }
    }
    const Index first = std::max(options_.derivative_test_first_index, -1);
    Index end = first;  // of the functions that are compared
    std::vector<double> values(structure_.hessian.size());
    for (; end < m_; ++end) {
      std::vector<double> lambda(at(m_), 0.0);
      if (end >= 0) lambda[at(end)] = 1.0;
      if (!problem_.hessian(report_.v, true, end < 0 ? 1.0 : 0.0, lambda, true, values)) {
        report_.remarks.emplace_back("The Hessian is undefined at the point of the test.");
        break;
      }
      for (const auto k : indices(values)) {
        const auto [row, col] = structure_.hessian[k];
        Compared& entry = entries[{end, std::max(row, col), std::min(row, col)}];
        entry.exact += values[k];
        entry.in_structure = true;
      }
    }
    for (const auto& [of, entry] : entries) {
      const auto [function, row, col] = of;
      if (function < first || function >= end ||
          (entry.size == 0.0 && !(moves[at(row)] && moves[at(col)])))
        continue;
      compare({.constraint = function,
               .variable = row,
               .second_variable = col,
               .exact = entry.exact,
               .approximate = entry.difference},
              entry.in_structure, entry.size, entry.step);
    }
  }

  /// The gradient of each function (-1: the objective), by variable.
  [[nodiscard]] std::map<std::pair<Index, Index>, double> by_function(
      const FirstDerivatives& derivatives) const {
    std::map<std::pair<Index, Index>, double> values;
    for (Index i = 0; i < n_; ++i) values[{-1, i}] = derivatives.gradient[at(i)];
    for (const auto k : indices(structure_.jacobian)) {
      const auto [row, col] = structure_.jacobian[k];
      values[{row, col}] += derivatives.jacobian[k];
    }
    return values;
  }

  Problem& problem_;
  const ProblemStructure& structure_;
  const SolverOptions& options_;
  FirstDerivativeSource source_;
  const Index n_, m_;
  DerivativeReport report_;
  Values here_;
  FirstDerivatives derivatives_;
};

}  // namespace

DerivativeReport test_derivatives(Problem& problem, const SolverOptions& options) {
  if (auto error = check_indices(problem.structure()); !error.empty()) {
    DerivativeReport report;
    report.failure = std::move(error);
    return report;
  }
  return DerivativeTester(problem, options).run();
}

std::string describe(const DerivativeEntry& entry, const ProblemStructure& structure) {
  const auto of_player = [](Player player) {
    return player == Player::Max ? " of Max" : " of Min";
  };
  const auto variable = [&](Index i) {
    return variable_name(structure, i) + of_player(structure.variable_players[at(i)]);
  };
  const bool second = entry.second_variable >= 0;
  std::string text = second                 ? "Hessian of "
                     : entry.constraint < 0 ? "gradient of "
                                            : "Jacobian of ";
  if (entry.constraint < 0) {
    text += "the objective";
  } else {
    text += constraint_name(structure, entry.constraint) +
            of_player(structure.constraint_players[at(entry.constraint)]);
  }
  text += " in " + variable(entry.variable);
  return second ? text + " and " + variable(entry.second_variable) : text;
}

}  // namespace ipminmax
