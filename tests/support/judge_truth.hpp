#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/diagnostics/diagnosis.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

/// Finds what a result says that is not so at its own point, recomputed from the model. What cannot
/// be recomputed from v and the multipliers alone, the slacks of inequalities, makes lower bounds
/// of equalities.
class TruthJudge {
 public:
  /// fails: the model may have been undefined in the solve where it is not now.
  TruthJudge(Problem& model, const SolverOptions& options, const Result& result, bool fails)
      : model_(model), s_(model.structure()), options_(options), result_(result), fails_(fails) {}

  /// Empty: all is true.
  [[nodiscard]] std::string untruths() {
    judge_message();
    if (result_.v.empty()) {
      judge_no_point();
    } else if (sizes_fit()) {
      judge_values();
      judge_primal();
      judge_dual();
      judge_complementarity();
      judge_certificate();
      judge_success();
    }
    return text_.str();
  }

 private:
  static bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }
  void expect(bool holds, const std::string& what) {
    if (!holds) text_ << what << "; ";
  }
  /// value is that which the model gives, or, with slacks around, no less; NaN stands for NaN.
  void expect_error(const char* name, double said, double found, double rounding) {
    std::ostringstream what;
    what.precision(17);
    what << name << " is " << said << ", found " << found;
    if (!std::isfinite(found)) {
      expect(!std::isfinite(said) || (fails_ && std::isnan(said)), what.str());
      return;
    }
    if (std::isnan(said) && (fails_ || has_slacks())) return;  // slacks may overflow
    rounding += 1e-250;                                        // where products underflow
    const bool least = said >= found - rounding;
    const bool most = has_slacks() || said <= found + rounding;
    expect(least && most, what.str());
  }
  /// Whether any constraint counts.
  [[nodiscard]] bool has_rows() const {
    for (std::size_t j = 0; j < s_.constraint_lower.size(); ++j) {
      if (has_lower(s_.constraint_lower[j]) || has_upper(s_.constraint_upper[j])) return true;
    }
    return false;
  }
  [[nodiscard]] bool has_slacks() const {
    for (std::size_t j = 0; j < s_.constraint_lower.size(); ++j) {
      const double lower = s_.constraint_lower[j], upper = s_.constraint_upper[j];
      if (lower != upper && (has_lower(lower) || has_upper(upper))) return true;
    }
    return false;
  }
  [[nodiscard]] bool has_lower(double bound) const { return bound > options_.nlp_lower_bound_inf; }
  [[nodiscard]] bool has_upper(double bound) const { return bound < options_.nlp_upper_bound_inf; }
  [[nodiscard]] bool is_parameter(std::size_t i) const {
    const auto t = options_.fixed_variable_treatment;
    return !result_.fixed_variables_relaxed && s_.variable_lower[i] == s_.variable_upper[i] &&
           (t == FixedVariableTreatment::MakeParameter ||
            t == FixedVariableTreatment::MakeParameterNodual);
  }
  [[nodiscard]] double relaxation(double bound, double width) const {
    double size = std::max(1.0, std::abs(bound));
    if (width > 0.0) size = std::min(size, 100.0 * width);
    return std::min(options_.bound_relax_factor * size, options_.constr_viol_tol);
  }

  void judge_message() {
    const std::string& message = result_.message;
    expect(!message.empty() && message.front() != ' ', "the message is '" + message + "'");
    const auto says = [&](const char* part) { return message.find(part) != std::string::npos; };
    const Status status = result_.status;
    if (says("minimization looks unbounded")) {
      expect(status == Status::OuterUnbounded, "message against status: " + message);
    }
    if (says("maximization over y looks")) {
      expect(status == Status::InnerUnbounded, "message against status: " + message);
    }
    if (says("maximum over y disappears")) {
      expect(status == Status::NoLocalMinmaxFound, "message against status: " + message);
    }
    if (is_success(status)) {
      const bool remark = result_.certificate.hessian_disagrees;
      std::string own = message;  // without what an application adds about who owns what
      for (const std::string& text : split_remarks(s_)) {
        if (own.ends_with("\n" + text)) own.resize(own.size() - text.size() - 1);
      }
      const std::string name(name_of(status));
      // Of a multistart that knows a worse y; others keep that to Result::worst_case.
      const bool warned = result_.worst_case.higher && own.starts_with(name + "\nvalue ");
      // Of secant pairs no second-order statement follows, and the message says so.
      const bool secant = own == name + "; limited-memory Hessian: nothing is certified" &&
                          result_.certificate.kind != PointKind::LocalMinmax;
      // A minimization that found no better point than one whose gradient only the scaling hides.
      const bool kept = status == Status::SolvedToAcceptableLevel &&
                        own.starts_with(name + ": the scaled tolerances are met");
      // Many answers, each of them a saddle point.
      const bool saddle = status == Status::SolvedDegenerate &&
                          own.starts_with(name + "; duality gap ") && says(": a saddle point");
      expect(
          remark ? says("second derivatives") : own == name || warned || secant || kept || saddle,
          "message of a success: " + message);
    }
    if (result_.worst_case.higher && result_.worst_case.starts == 0) judge_worse_y();
  }
  /// The y of another start, said to be worse at this x.
  void judge_worse_y() {
    const WorstCase& found = result_.worst_case;
    double f = 0.0;
    expect(found.v.size() == result_.v.size(), "a worse y without a point");
    if (found.v.size() != result_.v.size()) return;
    expect(model_.objective(found.v, true, f) && f == found.value && f > result_.objective,
           "a worse y that is none");
    for (std::size_t i = 0; i < found.v.size(); ++i) {
      if (s_.variable_players[i] == Player::Min) {
        expect(found.v[i] == result_.v[i], "a worse y at another x");
      }
    }
  }
  void judge_no_point() {
    const KktError& e = result_.error;
    expect(result_.lambda.empty() && result_.z_lower.empty() && result_.z_upper.empty() &&
               result_.constraints.empty(),
           "multipliers without a point");
    for (const double value :
         {result_.objective, e.primal, e.dual_min, e.dual_max, e.complementarity, e.total}) {
      expect(std::isnan(value), "a value without a point");
    }
    expect(result_.certificate.kind == PointKind::Unknown, "a kind without a point");
    expect(result_.certificate.second_order == SecondOrder::NotTested, "a test without a point");
    expect(!is_success(result_.status), "a success without a point");
  }
  [[nodiscard]] bool sizes_fit() {
    const std::size_t n = s_.variable_players.size(), m = s_.constraint_players.size();
    const bool fit = result_.v.size() == n && result_.z_lower.size() == n &&
                     result_.z_upper.size() == n && result_.lambda.size() == m &&
                     result_.constraints.size() == m;
    expect(fit, "sizes");
    return fit;
  }
  [[nodiscard]] bool finite_point() const {
    return std::ranges::all_of(result_.v, [](double x) { return std::isfinite(x); });
  }

  void judge_values() {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    double f = kNaN;
    if (!finite_point() || !model_.objective(result_.v, true, f)) f = kNaN;
    expect(same(f, result_.objective) || (fails_ && !std::isfinite(result_.objective)),
           "objective is " + std::to_string(result_.objective) + ", found " + std::to_string(f));
    std::vector<double> g(result_.constraints.size(), kNaN);
    if (!g.empty() && (!finite_point() || !model_.constraints(result_.v, true, g))) {
      std::ranges::fill(g, kNaN);
    }
    for (std::size_t j = 0; j < g.size(); ++j) {
      expect(
          same(g[j], result_.constraints[j]) || (fails_ && !std::isfinite(result_.constraints[j])),
          "constraint " + std::to_string(j) + " is " + std::to_string(result_.constraints[j]) +
              ", found " + std::to_string(g[j]));
    }
  }

  void judge_primal() {
    double worst = 0.0, size = 0.0;
    bool undefined = false;
    const auto measure = [&](double value, double lower, double upper) {
      if (!has_lower(lower) && !has_upper(upper)) return;
      undefined = undefined || std::isnan(value);
      worst = std::max({worst, lower - value, value - upper});
      size = std::max(size, std::abs(value));
      if (has_lower(lower)) size = std::max(size, std::abs(lower));
      if (has_upper(upper)) size = std::max(size, std::abs(upper));
    };
    for (std::size_t i = 0; i < result_.v.size(); ++i) {
      measure(result_.v[i], s_.variable_lower[i], s_.variable_upper[i]);
    }
    for (std::size_t j = 0; j < result_.constraints.size(); ++j) {
      measure(result_.constraints[j], s_.constraint_lower[j], s_.constraint_upper[j]);
    }
    if (undefined) worst = std::numeric_limits<double>::quiet_NaN();
    expect_error("primal error", result_.error.primal, worst, 1e-14 * size);
  }

  void judge_dual() {
    if (options_.honor_original_bounds) return;  // v was moved after it
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const std::size_t n = result_.v.size();
    std::vector<double> slope(n, kNaN), jacobian(s_.jacobian.size(), kNaN);
    bool defined = finite_point() && model_.gradient(result_.v, true, slope);
    if (defined && has_rows()) defined = model_.jacobian(result_.v, true, jacobian);
    std::vector<double> size(n);
    for (std::size_t i = 0; i < n; ++i) {
      size[i] = std::abs(slope[i]) + std::abs(result_.z_lower[i]) + std::abs(result_.z_upper[i]);
      slope[i] += result_.z_upper[i] - result_.z_lower[i];
    }
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      const auto row = static_cast<std::size_t>(s_.jacobian[k].row);
      const auto col = static_cast<std::size_t>(s_.jacobian[k].col);
      if (!has_lower(s_.constraint_lower[row]) && !has_upper(s_.constraint_upper[row])) continue;
      slope[col] += jacobian[k] * result_.lambda[row];
      size[col] += std::abs(jacobian[k] * result_.lambda[row]);
    }
    double worst[2] = {0.0, 0.0}, rounding[2] = {0.0, 0.0};
    bool undefined[2] = {false, false};
    for (std::size_t i = 0; i < n; ++i) {
      if (is_parameter(i)) continue;
      const auto p = static_cast<std::size_t>(s_.variable_players[i] == Player::Max);
      undefined[p] = undefined[p] || !defined || std::isnan(slope[i]);
      worst[p] = std::max(worst[p], std::abs(slope[i]));
      rounding[p] = std::max(rounding[p], 1e-12 * size[i]);
    }
    for (const std::size_t p : {0U, 1U}) {
      if (undefined[p]) worst[p] = kNaN;
      expect_error(p == 0 ? "dual error of Min" : "dual error of Max",
                   p == 0 ? result_.error.dual_min : result_.error.dual_max, worst[p], rounding[p]);
    }
  }

  void judge_complementarity() {
    if (options_.honor_original_bounds) return;
    double worst = 0.0, rounding = 0.0;
    const auto measure = [&](double distance, double z, double bound, double v) {
      const double product = std::abs(distance * z);  // NaN where z has overflowed
      if (!(product <= worst)) worst = product;
      rounding = std::max(rounding, (2e-12 * std::max(1.0, std::abs(bound)) +
                                     1e-15 * (std::abs(v) + std::abs(bound))) *
                                        std::abs(z));
    };
    for (std::size_t i = 0; i < result_.v.size(); ++i) {
      const double v = result_.v[i], lower = s_.variable_lower[i], upper = s_.variable_upper[i];
      const bool by_constraint = lower == upper && options_.fixed_variable_treatment ==
                                                       FixedVariableTreatment::MakeConstraint;
      if (is_parameter(i) || by_constraint) continue;
      if (has_lower(lower))
        measure(v - lower + relaxation(lower, upper - lower), result_.z_lower[i], lower, v);
      if (has_upper(upper))
        measure(upper + relaxation(upper, upper - lower) - v, result_.z_upper[i], upper, v);
    }
    expect_error("complementarity error", result_.error.complementarity, worst, rounding);
  }

  void judge_certificate() {
    const Certificate& c = result_.certificate;
    const double primal = result_.error.primal;
    if (c.second_order == SecondOrder::NotTested) {
      const PointKind kind = std::isnan(primal)                   ? PointKind::Unknown
                             : primal <= options_.constr_viol_tol ? PointKind::FeasiblePoint
                                                                  : PointKind::InfeasiblePoint;
      // A first-order point may be left untested: by option, or where iterates run away from there.
      const bool may_be = options_.minmax_certificate == CertificateEffort::None ||
                          result_.error.total <= std::max(options_.tol, options_.acceptable_tol);
      const bool untested = may_be && c.kind == PointKind::FirstOrderPoint;
      expect(untested || c.kind == kind, "kind is " + std::string(name_of(c.kind)));
      return;
    }
    // Points are tested that meet the tolerances.
    const double tested = std::max(options_.tol, options_.acceptable_tol);
    expect(result_.error.total <= tested, "tested at error " + std::to_string(result_.error.total));
    expect(c.kind == PointKind::LocalMinmax || c.kind == PointKind::FirstOrderPoint,
           "tested, but kind is " + std::string(name_of(c.kind)));
    expect((c.kind == PointKind::LocalMinmax) <= (c.second_order == SecondOrder::Satisfied),
           "a local minmax that is not certified");
    expect((c.second_order == SecondOrder::Violated) <= !is_success(result_.status),
           "a success at a wrong point");
  }

  void judge_success() {
    if (!is_success(result_.status)) return;
    const auto finite = [&](const std::vector<double>& values, const char* name) {
      for (const double value : values)
        expect(std::isfinite(value), std::string(name) + " not finite");
    };
    const KktError& e = result_.error;
    finite(result_.v, "v");
    finite(result_.lambda, "lambda");
    finite(result_.z_lower, "z_lower");
    finite(result_.z_upper, "z_upper");
    finite(result_.constraints, "constraints");
    finite({result_.objective, e.primal, e.dual_min, e.dual_max, e.complementarity, e.total},
           "objective or error");
    const bool acceptable = result_.status == Status::SolvedToAcceptableLevel;
    expect(e.total <= (acceptable ? options_.acceptable_tol : options_.tol), "not converged");
  }

  Problem& model_;
  const ProblemStructure& s_;
  const SolverOptions& options_;
  const Result& result_;
  bool fails_;
  std::ostringstream text_;
};

}  // namespace ipminmax::testing
