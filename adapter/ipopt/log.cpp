#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <sstream>
#include <string_view>
#include <vector>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/ipopt_version.hpp"
#include "adapter/ipopt/log.hpp"
#include "core/answer.hpp"
#include "core/model/indices.hpp"
#include "core/model/status_table.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/robust_scope.hpp"
#include "core/version.h"
#include "core/worst_case.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax::log {

std::string format(const char* pattern, ...) {
  std::va_list arguments;
  va_start(arguments, pattern);
  std::va_list again;
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, pattern, arguments);
  va_end(arguments);
  std::string text(length > 0 ? at(length) : 0, '\0');
  std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(again);
  return text;
}

namespace {

std::string log10_or_dash(double value) {
  return value > 0.0 ? format("%.1f", std::log10(value)) : "-";
}

const char* yes_no(bool value) { return value ? "yes" : "no"; }

/// Counts of one row of the problem statistics: those of Min and those of Max.
struct PerPlayer {
  std::array<long, 2> count{};
  long& of(Player player) { return count[player == Player::Max ? 1 : 0]; }
};

std::string row(const char* label, const PerPlayer& value) {
  return format("%s %9ld %9ld\n", label, value.count[0], value.count[1]);
}

/// How many variables or constraints have which bounds.
struct BoundCounts {
  PerPlayer total, equal, only_lower, both, only_upper;

  BoundCounts(const std::vector<double>& lower, const std::vector<double>& upper,
              const std::vector<Player>& players, const SolverOptions& options) {
    PerPlayer free;
    for (const auto i : indices(players)) {
      const bool has_lower = lower[i] > options.nlp_lower_bound_inf;
      const bool has_upper = upper[i] < options.nlp_upper_bound_inf;
      PerPlayer& kind = has_lower && has_upper ? (lower[i] == upper[i] ? equal : both)
                        : has_lower            ? only_lower
                        : has_upper            ? only_upper
                                               : free;
      ++total.of(players[i]);
      ++kind.of(players[i]);
    }
  }
};

std::string inertia_row(const char* label, const Inertia& found, const Inertia& expected) {
  return format("%s %9d %6d %6d   %9d %6d %6d\n", label, found.positive, found.negative, found.zero,
                expected.positive, expected.negative, expected.zero);
}

/// Name of a variable or constraint of the model, else its number.
std::string name_or_number(const char* kind, const std::vector<std::string>& names, Index i) {
  const bool named = at(i) < names.size() && !names[at(i)].empty();
  return named ? names[at(i)] : concat(kind, i);
}

std::string certificate_report(const Certificate& certificate, const ProblemStructure& structure) {
  std::string text = concat("Second-order test.......: ", name_of(certificate.second_order),
                            "\nReturned point..........: ", name_of(certificate.kind), "\n");
  if (certificate.second_order == SecondOrder::NotTested) return text;
  text += "                           found: +      -      0   expected: +      -      0\n" +
          inertia_row("Inertia of K_yy.........:", certificate.inner, certificate.inner_expected) +
          inertia_row("Inertia of K............:", certificate.full, certificate.full_expected) +
          format("Curvature, probed by....: %24.16e\n", certificate.margin);
  if (certificate.least_curvature_variable >= 0) {
    text += format(
        "Least curvature, about..: %.1e (of 1), most in %s\n", certificate.least_curvature,
        name_or_number("variable ", structure.variable_names, certificate.least_curvature_variable)
            .c_str());
  }
  if (certificate.finite_differences) {
    text += format("Second derivatives......: finite differences, error estimate %.1e\n",
                   certificate.hessian_error);
  }
  if (certificate.hessian_disagrees) {
    text += "Second derivatives......: disagree with differences of the gradient\n";
  }
  text += format(
      "Independent gradients...: Min %s, Max %s\n"
      "Weakly active bounds....: Min %d, Max %d\n",
      yes_no(certificate.licq_min), yes_no(certificate.licq_max), certificate.weakly_active_min,
      certificate.weakly_active_max);
  if ((certificate.kind != PointKind::LocalMinmax && certificate.answer != InnerAnswer::Unknown) ||
      certificate.answer == InnerAnswer::BestNotUnique) {
    text += concat("Answer of the maximizer.: ", name_of(certificate.answer), "\n");
  }
  if (!certificate.proof.empty()) {
    text += "Solution near the point.: " + certificate.proof + "\n";
  }
  for (const CertificateReason& reason : certificate.reasons) {
    text += "Reason..................: " + reason.text + "\n";
  }
  return text;
}

std::string exit_text(const Result& result) {
  if (result.status == Status::NotLocalMinmax) {
    using Kind = CertificateReason::Kind;
    if (std::ranges::find(result.certificate.reasons, Kind::RobustRow, &CertificateReason::kind) !=
        result.certificate.reasons.end()) {
      return "First-order point found, but it is not a local minmax: a worst case is no maximum of "
             "its constraint.";
    }
    // The player that a wrong inertia belongs to. K_yy right and K wrong: the minimizer.
    const bool max = result.certificate.inner != result.certificate.inner_expected;
    return concat("First-order point found, but it is not a local minmax: curvature of the ",
                  max ? "maximizer" : "minimizer", " has the wrong sign.");
  }
  if (result.status == Status::SolvedDegenerate) {
    if (result.certificate.second_order == SecondOrder::Flat) {
      return "First-order point found in a valley of points with the same value.";
    }
    if (result.certificate.hessian_disagrees) {
      return "First-order point found; its second derivatives look wrong, so nothing is "
             "certified.";
    }
  }
  if (result.status == Status::Solved && result.certificate.second_order == SecondOrder::NotTested)
    return "First-order point found; its second-order conditions were not tested.";
  return std::string(row_of(result.status).sentence);
}

}  // namespace

std::string banner() {
  return "\n"
         "******************************************************************************\n"
         "This program contains Ipminmax, an interior-point solver for constrained\n"
         "nonconvex-nonconcave minmax problems, released under the BSD 3-Clause License.\n"
         "******************************************************************************\n\n";
}

std::string problem_statistics(const ProblemStructure& structure, const SolverOptions& options) {
  const auto& constraint_players = structure.constraint_players;
  const BoundCounts variables(structure.variable_lower, structure.variable_upper,
                              structure.variable_players, options);
  const BoundCounts constraints(structure.constraint_lower, structure.constraint_upper,
                                constraint_players, options);
  PerPlayer equality_nonzeros, inequality_nonzeros, inequalities;
  for (const Triplet& entry : structure.jacobian) {
    const auto i = at(entry.row);
    const bool equality = structure.constraint_lower[i] == structure.constraint_upper[i];
    ++(equality ? equality_nonzeros : inequality_nonzeros).of(constraint_players[i]);
  }
  for (const std::size_t p : {0U, 1U}) {
    inequalities.count[p] = constraints.total.count[p] - constraints.equal.count[p];
  }
  return "                                                            Min       Max\n" +
         row("Number of nonzeros in equality constraint Jacobian...:", equality_nonzeros) +
         row("Number of nonzeros in inequality constraint Jacobian.:", inequality_nonzeros) +
         format("Number of nonzeros in Lagrangian Hessian.............: %9zu\n\n",
                structure.hessian.size()) +
         row("Total number of variables............................:", variables.total) +
         row("                                     fixed variables:", variables.equal) +
         row("                     variables with only lower bounds:", variables.only_lower) +
         row("                variables with lower and upper bounds:", variables.both) +
         row("                     variables with only upper bounds:", variables.only_upper) +
         row("Total number of equality constraints.................:", constraints.equal) +
         row("Total number of inequality constraints...............:", inequalities) +
         row("        inequality constraints with only lower bounds:", constraints.only_lower) +
         row("   inequality constraints with lower and upper bounds:", constraints.both) +
         row("        inequality constraints with only upper bounds:", constraints.only_upper) +
         "\n";
}

std::string derivative_test(const DerivativeReport& report, const ProblemStructure& structure) {
  if (!report.failure.empty()) return "Derivative test not possible: " + report.failure + ".\n\n";
  std::string text = format("Derivative test: %d first and %d second derivatives.\n",
                            report.first_tested, report.second_tested);
  for (const std::string& remark : report.remarks) text += remark + "\n";
  for (const DerivativeEntry& entry : report.entries) {
    text += entry.finding == DerivativeFinding::Agrees ? "  " : "* ";
    text += describe(entry, structure);
    text += entry.finding == DerivativeFinding::Missing ? ": not in the structure"
                                                        : format(": %23.16e", entry.exact);
    text += format(" ~ %23.16e  [%9.3e]\n", entry.approximate, entry.relative_error);
    if (entry.crosses_players) {
      text += "  A constraint of Min must not vary with a variable of Max.\n";
    }
  }
  const Index wrong = report.first_wrong + report.second_wrong;
  if (wrong == 0) return text + "No errors detected by derivative test.\n\n";
  return text + format("Derivative test detected %d error(s).\n\n", wrong);
}

std::string iteration_header() {
  return "iter      objective   inf_pr   inf_dx   inf_dy lg(mu)    ||d|| lg(rgx) lg(rgy) alpha_du "
         "alpha_pr   ls\n";
}

std::string ipopt_iteration_header() {
  return "iter    objective    inf_pr   inf_du lg(mu)  ||d||  lg(rg) alpha_du alpha_pr  ls\n";
}

std::string ipopt_iteration_row(const IterationInfo& info, Index number) {
  constexpr std::string_view kIpoptsLetters = "fFhHkKnNRwSstTr";
  const KktError& error = info.error;
  std::string text = format("%4d%c%14.7e %7.2e %7.2e %5s ", number, info.restoration ? 'r' : ' ',
                            info.objective, error.primal, std::max(error.dual_min, error.dual_max),
                            log10_or_dash(info.mu).c_str());
  if (number == 0) return text + "0.00e+00    -  0.00e+00 0.00e+00   0\n";
  const bool is_ipopts = kIpoptsLetters.find(info.step_kind) != std::string_view::npos;
  return text + format("%7.2e %5s %7.2e %7.2e%c %3d\n", info.step_norm,
                       log10_or_dash(std::max(info.delta_x, info.delta_y)).c_str(), info.alpha_dual,
                       info.alpha_primal, is_ipopts ? info.step_kind : 'n', info.trials);
}

std::string ipopt_errors(const Result& result) {
  const KktError& error = result.error;
  const double dual = std::max(error.dual_min, error.dual_max);
  const double overall = std::max({dual, error.primal, error.complementarity});
  return format(
      "                                (unscaled)                (unscaled)\n"
      "Objective...............: %24.16e  %24.16e\n"
      "Dual infeasibility......: %24.16e  %24.16e\n"
      "Constraint violation....: %24.16e  %24.16e\n"
      "Complementarity.........: %24.16e  %24.16e\n"
      "Overall NLP error.......: %24.16e  %24.16e\n\n",
      result.objective, result.objective, dual, dual, error.primal, error.primal,
      error.complementarity, error.complementarity, error.total, overall);
}

std::string iteration_row(const IterationInfo& info, bool with_info) {
  const KktError& error = info.error;
  std::string text =
      format("%4d %14.7e %8.2e %8.2e %8.2e %6s ", info.iteration, info.objective, error.primal,
             error.dual_min, error.dual_max, log10_or_dash(info.mu).c_str());
  if (info.iteration == 0) {  // no step led here
    text += "       -       -       -        -        -    -";
  } else {
    text += format("%8.2e %7s %7s %8.2e %8.2e%c %3d", info.step_norm,
                   log10_or_dash(info.delta_x).c_str(), log10_or_dash(info.delta_y).c_str(),
                   info.alpha_dual, info.alpha_primal, info.step_kind, info.trials);
  }
  if (with_info) {
    text += format(" K %d Kyy %d", info.factorizations_full, info.factorizations_inner);
    if (info.factorizations_complement > 0) text += format(" S %d", info.factorizations_complement);
  }
  return text + "\n";
}

std::string start_header() { return " start      objective    error   iter cert  status\n"; }

std::string start_row(Index start, const Result& result) {
  const bool certified = result.certificate.kind == PointKind::LocalMinmax;
  return concat(format("%6d %14.7e %8.2e %6d %4s  ", start, result.objective, result.error.total,
                       result.iterations, certified ? "yes" : "-"),
                name_of(result.status), "\n");
}

void StartsProgress::add(const Result& result) {
  ++done_;
  starts_ = std::max(starts_, done_);  // branches of y found on the way are starts, too
  if (result.certificate.kind != PointKind::LocalMinmax) return;
  const bool better = larger_is_better_ ? result.objective > best_ : result.objective < best_;
  if (certified_++ == 0 || better) best_ = result.objective;
}

std::string StartsProgress::line() const {
  std::string text =
      format("Multistart: %d of %d starts, %d certified", done_, starts_, certified_);
  if (certified_ > 0) text += format(", best value %.8e", best_);
  const double spent = std::chrono::duration<double>(Clock::now() - begin_).count();
  if (done_ > 0) text += format(", %.0f s left", spent / done_ * (starts_ - done_));
  return text;
}

bool StartsProgress::due(double seconds) {
  const auto now = Clock::now();
  if (std::chrono::duration<double>(now - last_).count() < seconds) return false;
  last_ = now;
  return true;
}

namespace {

/// Last column of a multistart's table: a dash where nothing was looked for.
std::string worst_case_column(const WorstCase& found) {
  if (found.unbounded) return format(" %20s\n", "unbounded");
  if (found.v.empty()) return format(" %20s\n", "-");
  return format(" %20.12e\n", found.value);
}

}  // namespace

std::string multistart_summary(const MultistartResult& result) {
  constexpr std::size_t kMostPoints = 20;
  std::string text = format("\nMultistart: %d starts, %zu distinct certified points\n",
                            result.starts, result.points.size());
  const bool checked = !result.points.empty() && result.points.front().result.worst_case.starts > 0;
  if (!result.points.empty()) {
    text += "\n  rank       local minmax value  found  first start     margin";
    text += checked ? "     worst case found\n" : "\n";
  }
  std::size_t rank = 0;
  for (const DistinctPoint& point : result.points) {
    if (rank == kMostPoints) break;
    text += format("%6zu %24.16e %6d %12d %10.2e", ++rank, point.result.objective, point.found,
                   point.first_start, point.result.certificate.margin);
    text += checked ? worst_case_column(point.result.worst_case) : "\n";
  }
  if (result.points.size() > kMostPoints) {
    text += format("%6s and %zu more\n", "...", result.points.size() - kMostPoints);
  }
  text += "\n";
  for (const auto& [status, count] : result.statuses) {
    text += concat(format("%6d ", count), name_of(status), "\n");
  }
  return text;
}

namespace {

/// The variables that say where the worst case of a constraint is: the Max variables that it reads,
/// of f (beyond the constraints) all; where Max's equations determine these, as dynamics do states,
/// those that are free instead, as disturbances.
std::vector<Index> worst_case_variables(const ProblemStructure& structure, Index constraint) {
  ProblemStructure with_f = structure;
  if (at(constraint) >= structure.constraint_players.size()) {  // f: a row that reads all of y
    with_f.constraint_players.push_back(Player::Min);
    for (const Index i : numbers_below(structure.variable_players.size()))
      with_f.jacobian.push_back({constraint, i});
  }
  RobustScope scope = RobustScopes(with_f).of(constraint);
  std::erase_if(scope.variables, [&](Index i) {
    return std::ranges::binary_search(scope.dependent, i) ||
           std::ranges::binary_search(scope.irrelevant, i);
  });
  return std::move(scope.variables);
}

}  // namespace

std::string place_of(const RobustWorstCase& found, const ProblemStructure& structure) {
  constexpr std::size_t kMost = 6;
  std::string text;
  std::size_t count = 0;
  for (const Index i : worst_case_variables(structure, found.constraint)) {
    if (++count > kMost) continue;
    text += (count > 1 ? ", " : "") + name_or_number("variable ", structure.variable_names, i) +
            format(" = %.6g", found.v[at(i)]);
  }
  return count > kMost ? text + format(", ... (%zu in all)", count) : text;
}

std::string robust_summary(const Result& result, const ProblemStructure& structure) {
  constexpr std::size_t kMostRows = 50;
  const SearchOverY& y = result.over_y;
  const std::size_t cases = result.worst_cases.size();
  std::string text = format("\nRobust constraints: %zu worst case%s, %d solves, %d maximizations\n",
                            cases, cases == 1 ? "" : "s", y.solves, y.maximizations);
  text += "\nconstraint                                  value       multiplier  worst case\n";
  std::size_t shown = 0;
  for (const RobustWorstCase& found : result.worst_cases) {
    if (shown++ == kMostRows) break;
    const std::string name =
        at(found.constraint) >= structure.constraint_players.size()
            ? "f"
            : name_or_number("constraint ", structure.constraint_names, found.constraint);
    text += format("%-24s %24.16e %16.8e  %s%s\n", name.c_str(), found.value, found.multiplier,
                   place_of(found, structure).c_str(), found.active ? "" : " (inactive)");
  }
  if (cases > kMostRows) text += format("... and %zu more\n", cases - kMostRows);
  return text;
}

std::string summary(const Result& result, const ProblemStructure& structure, Index iterations) {
  const KktError& error = result.error;
  std::string text = format(
      "\nNumber of Iterations....: %d\n\n"
      "Objective...............: %24.16e\n"
      "Dual infeasibility, Min.: %24.16e\n"
      "Dual infeasibility, Max.: %24.16e\n"
      "Constraint violation....: %24.16e\n"
      "Complementarity.........: %24.16e\n"
      "Overall scaled error....: %24.16e\n\n",
      iterations, result.objective, error.dual_min, error.dual_max, error.primal,
      error.complementarity, error.total);
  text += certificate_report(result.certificate, structure);
  const auto [why, point, over_y, over_x] = statements(result);
  const bool game = has_max_variables(structure);
  if (game) text += "Over all y..............: " + over_y + "\n";
  if (game || result.over_x.asked > 1) text += "Over x..................: " + over_x + "\n";
  return text;
}

namespace {

/// "  K + K_yy for steps 6 + 5, certificate 1 + 1", empty where there were none.
std::string factorization_causes(const Counts& counts) {
  std::string text;
  for (std::size_t k = 0; k < kFactorizationCauses; ++k) {
    const auto cause = static_cast<FactorizationCause>(k);
    const auto [full, inner] = counts.factorizations_for(cause);
    if (full + inner == 0) continue;
    text += text.empty() ? "  K + K_yy for " : ", ";
    text += concat(name_of(cause), " ", full, " + ", inner);
  }
  return text.empty() ? text : text + "\n";
}

}  // namespace

std::string work(const Result& result) {
  const Counts& counts = result.counts;
  std::string text = format(
      "\nNumber of objective function evaluations              = %d\n"
      "Number of objective gradient evaluations              = %d\n"
      "Number of constraint evaluations                      = %d\n"
      "Number of constraint Jacobian evaluations             = %d\n"
      "Number of Lagrangian Hessian evaluations              = %d\n"
      "Number of factorizations of K                         = %d\n"
      "Number of factorizations of K_yy                      = %d\n",
      counts.objective, counts.gradient, counts.constraints, counts.jacobian, counts.hessian,
      counts.factorizations_full + counts.factorizations_for(FactorizationCause::Restoration).full,
      counts.factorizations_inner);
  if (counts.factorizations_complement > 0) {
    text += format("Number of factorizations of the complement of K_yy    = %d\n",
                   counts.factorizations_complement);
  }
  return text + factorization_causes(counts) +
         format(
             "Number of linear systems solved                       = %d\n"
             "Total seconds in Ipminmax (w/o function evaluations)  = %10.3f\n"
             "Total seconds in function evaluations                 = %10.3f\n",
             counts.solves,
             std::max(0.0, result.timing.total - result.timing.evaluations),  // of all threads
             result.timing.evaluations);
}

std::string ipopt_work(const Result& result, const ProblemStructure& structure) {
  const Counts& counts = result.counts;
  bool has_equations = false, has_inequalities = false;
  for (const auto j : indices(structure.constraint_lower)) {
    const bool equation = structure.constraint_lower[j] == structure.constraint_upper[j];
    (equation ? has_equations : has_inequalities) = true;
  }
  const auto line = [](const char* label, Index count) {
    return format("Number of %-42s = %d\n", label, count);
  };
  const std::string text =
      "\n" + line("objective function evaluations", counts.objective) +
      line("objective gradient evaluations", counts.gradient) +
      line("equality constraint evaluations", has_equations ? counts.constraints : 0) +
      line("inequality constraint evaluations", has_inequalities ? counts.constraints : 0) +
      line("equality constraint Jacobian evaluations", has_equations ? counts.jacobian : 0) +
      line("inequality constraint Jacobian evaluations", has_inequalities ? counts.jacobian : 0) +
      line("Lagrangian Hessian evaluations", counts.hessian);
  const double evaluations = result.timing.evaluations;  // of all threads
  const auto seconds = [](const char* label, double value) {
    return format("%-52s = %10.3f\n", label, std::max(0.0, value));
  };
#if IPMINMAX_IPOPT_AT_LEAST(3, 14)
  return text + seconds("Total seconds in IPOPT", result.timing.total) +
         seconds("Total seconds in NLP function evaluations", evaluations);
#else
  return text +
         seconds("Total CPU secs in IPOPT (w/o function evaluations)",
                 result.cpu_seconds - evaluations) +
         seconds("Total CPU secs in NLP function evaluations", evaluations);
#endif
}

std::string timing(const Timing& timing) {
  const double rest = timing.total - timing.evaluations - timing.assembly - timing.analysis -
                      timing.factorization - timing.solves;
  return format(
      "\nTiming Statistics (wall clock seconds):\n\n"
      "Total...................: %10.3f\n"
      " Function evaluations...: %10.3f\n"
      " KKT assembly...........: %10.3f\n"
      " Symbolic analysis......: %10.3f\n"
      " Factorization..........: %10.3f\n"
      " Solves and refinement..: %10.3f\n"
      " Everything else........: %10.3f\n",
      timing.total, timing.evaluations, timing.assembly, timing.analysis, timing.factorization,
      timing.solves, rest);
}

std::string exit_line(const Result& result) {
  std::string text = "\nEXIT: " + exit_text(result) + "\n";
  std::istringstream why(statements(result)[0]);
  for (std::string line; std::getline(why, line);)
    if (line != name_of(result.status)) text += "      " + line + "\n";
  if (result.objective_scale < 0.0) {
    text += "      The objective's factor is negative: Min maximizes and Max minimizes.\n";
  }
  return text;
}

namespace {

/// Ipopt's words for an end, empty where ours are the same.
std::string_view ipopt_words(Status status) {
  using enum Status;
  switch (status) {
    case Solved:
    case SolvedDegenerate:
      return "Optimal Solution Found.";
    case NotLocalMinmax:
    case NoLocalMinmaxFound:
      return row_of(TinyStep).sentence;
    case InnerUnbounded:
    case OuterUnbounded:
      return row_of(DivergingIterates).sentence;
    case InnerInfeasible:
      return row_of(LocallyInfeasible).sentence;
    case InertiaCorrectionFailed:
    case LinearSolverFailed:
      return "Error in step computation!";
    case EvaluationFailed:
    case InvalidNumber:
      return "Invalid number in NLP function or derivative detected.";
    default:
      return {};
  }
}

}  // namespace

std::string ipopt_exit_line(const Result& result) {
  const std::string words(ipopt_words(result.status));
  std::string text = exit_line(result);
  if (!words.empty()) {
    const std::string ours = exit_text(result);
    text.replace(text.find(ours), ours.size(), words + "\n      " + ours);
  }
  // Pyomo looks for this line where there is no solution file, and for the third of its parts.
  if (result.status == Status::TooFewDegreesOfFreedom)
    text = "\nTOO_FEW_DEGREES_OF_FREEDOM: the model: Too few degrees of freedom.\n" + text;
  return text;
}

std::string ipopt_solver_line(const std::string& linear_solver) {
  return concat("This is Ipminmax " IPMINMAX_VERSION ", with the interface of Ipopt " IPOPT_VERSION
                ", running with linear solver ",
                linear_solver, ".\n\n");
}

}  // namespace ipminmax::log
