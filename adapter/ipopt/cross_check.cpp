#include <IpJournalist.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>

#include "adapter/control/horizon_shift.hpp"
#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/cross_check.hpp"
#include "adapter/ipopt/log.hpp"
#include "adapter/ipopt/status.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

using Ipopt::SmartPtr;
using log::format;

namespace {

/// Error over tol up to which Ipopt's point is put to the second-order test.
constexpr double kTestableError = 100.0;
/// Violation up to which a point counts as feasible, over the range of the constraint's values.
constexpr double kFeasible = 1e-8;
/// Range of f, times this, of which gain_tolerance is at most.
constexpr double kOfRange = 100.0;

/// The minimization of -f, which Ipopt solves.
class Negated final : public SameRows {
 public:
  using SameRows::SameRows;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    const bool ok = model().objective(v, new_v, f);
    f = -f;
    return ok;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    const bool ok = model().gradient(v, new_v, grad);
    for (double& slope : grad) slope = -slope;
    return ok;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return model().hessian(v, new_v, -sigma, lambda, new_lambda, values);
  }
};

// --- Options
// --------------------------------------------------------------------------------------

/// As in an options file.
std::string text_of(const OptionSetting& setting) {
  return setting.first + " \"" + setting.second + "\"\n";
}

/// Row of the option table, null when the solver has no such option.
const OptionInfo* find_option(std::string_view name) {
  const auto table = option_table();
  const auto found = std::ranges::find(table, name, &OptionInfo::name);
  return found == table.end() ? nullptr : &*found;
}

/// What the settings say about players, taken out of them.
PlayerOptions take_player_options(std::vector<OptionSetting>& settings) {
  PlayerOptions players;
  std::erase_if(settings, [&](const OptionSetting& setting) {
    auto* to = setting.first == "minmax_max_variables"     ? &players.max_variables
               : setting.first == "minmax_max_constraints" ? &players.max_constraints
               : setting.first == "minmax_min_constraints" ? &players.min_constraints
                                                           : nullptr;
    if (to != nullptr) *to = setting.second;
    return to != nullptr;
  });
  return players;
}

std::string read_own_options(const CrossCheckSettings& settings, SolverOptions& options) {
  const SmartPtr<RegisteredOptions> registry = new OptionRegistry();
  const SmartPtr<OptionsList> list = new OptionsList(registry, new Ipopt::Journalist());
  for (const auto& [name, value] : settings.options) {
    if (IsValid(registry->GetOption(name)) && find_option(name) == nullptr)
      return concat("option \"", name, "\" has no effect in a cross check");
    if (auto error = set_option(name, value, *registry, *list, false); !error.empty()) return error;
  }
  return solver_options(*list, options);
}

SmartPtr<RegisteredOptions> ipopt_registry() {
  const SmartPtr<RegisteredOptions> registry = new RegisteredOptions();
  Ipopt::IpoptApplication::RegisterAllIpoptOptions(registry);
  return registry;
}

/// The settings that Ipopt gets, as an options file. inner: for the maximizations over y, which
/// choose start, bounds and barrier themselves.
std::string ipopt_options_text(const CrossCheckSettings& settings, bool inner) {
  const SmartPtr<RegisteredOptions> registry = ipopt_registry();
  std::string text;
  for (const OptionSetting& setting : settings.options) {
    const std::string& name = setting.first;
    const OptionInfo* info = find_option(name);
    const bool shared = info != nullptr && !name.starts_with("minmax_") &&
                        name != "linear_solver" && IsValid(registry->GetOption(name));
    const bool ours =
        inner && shared &&
        (info->category == "Initialization" || info->category == "Barrier Parameter" ||
         name == "bound_relax_factor" || name == "fixed_variable_treatment");
    if (shared && !ours) text += text_of(setting);
  }
  for (const OptionSetting& setting : settings.ipopt_options) text += text_of(setting);
  return text;
}

void set_from_text(OptionsList& list, const std::string& text) {
  const Ipopt::Journalist silent;
  std::istringstream input(text);
  list.ReadFromStream(silent, input);
}

/// What Ipopt says against the settings, empty when nothing.
std::string check_ipopt_options(const std::string& text) {
  const SmartPtr<OptionsList> list = new OptionsList(ipopt_registry(), new Ipopt::Journalist());
  try {
    set_from_text(*list, text);
  } catch (const Ipopt::IpoptException& error) {
    return "Ipopt: " + error.Message();
  }
  return {};
}

// --- Two answers to one problem
// -------------------------------------------------------------------

/// max |a - b| / max(1, largest |b|) over the entries that count.
template <class Counts>
double relative_difference(const std::vector<double>& a, const std::vector<double>& b,
                           Counts counts) {
  double difference = 0.0, size = 1.0;
  for (const double value : b) size = std::max(size, std::abs(value));
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    if (counts(i)) difference = std::max(difference, std::abs(a[i] - b[i]));
  }
  return difference / size;
}

AnswerDifference difference_of(const ProblemStructure& structure, const Result& ours,
                               const IpoptAnswer& ipopt) {
  const auto all = [](std::size_t) { return true; };
  const auto free = [&](std::size_t i) {
    return structure.variable_lower[i] != structure.variable_upper[i];
  };
  return {
      .objective = (ours.objective - ipopt.objective) / std::max(1.0, std::abs(ipopt.objective)),
      .point = relative_difference(ours.v, ipopt.v, all),
      .lambda = relative_difference(ours.lambda, ipopt.lambda, all),
      .z_lower = relative_difference(ours.z_lower, ipopt.z_lower, free),
      .z_upper = relative_difference(ours.z_upper, ipopt.z_upper, free)};
}

/// Ipopt's maximum, as the minimum of -f: grad(-f) + J'l - z_L + z_U = 0.
void negate(IpoptAnswer& answer) {
  answer.objective = -answer.objective;
  for (auto* multipliers : {&answer.lambda, &answer.z_lower, &answer.z_upper}) {
    for (double& value : *multipliers) value = -value;
  }
}

/// This solver's second-order test at Ipopt's point: a warm start without an iteration.
Certificate certify(Problem& problem, const IpoptAnswer& answer, SolverOptions options) {
  Result start;
  start.v = answer.v;
  start.lambda = answer.lambda;
  start.z_lower = answer.z_lower;
  start.z_upper = answer.z_upper;
  AtResult view(problem, &start);
  constexpr double kTiny = std::numeric_limits<double>::min();
  warm_start(options, kTiny);  // mu_init is raised to the final barrier parameter
  options.warm_start_mult_init_max = 1e20;
  options.max_iter = 0;
  options.acceptable_tol = kTestableError * options.tol;
  options.acceptable_iter = 1;
  return solve(view, options).certificate;
}

bool succeeded(const IpoptAnswer& answer) {
  return answer.solved() || answer.status == Ipopt::Solved_To_Acceptable_Level;
}

CrossCheckVerdict compare(const CrossCheck& check, const CrossCheckSettings& settings,
                          bool maximization) {
  using enum CrossCheckVerdict;
  if (succeeded(check.ipopt) && check.ipopt_certificate.second_order == SecondOrder::Violated) {
    return IpoptRefuted;
  }
  const bool ours_solved = is_success(check.ours.status);
  const bool ipopt_solved = succeeded(check.ipopt);
  if (!ours_solved || !ipopt_solved) {
    return ours_solved ? OnlyOursSolved : ipopt_solved ? OnlyIpoptSolved : NeitherSolved;
  }
  const double better = maximization ? check.difference.objective : -check.difference.objective;
  if (better > settings.tolerance) return OursBetter;
  if (better < -settings.tolerance) return IpoptBetter;
  return check.difference.point <= settings.point_tolerance ? SameSolution : SameObjective;
}

// --- The maximizer at fixed x
// ---------------------------------------------------------------------

/// Ipopt's maximizations over y at fixed x.
class InnerMaximization {
 public:
  InnerMaximization(Problem& problem, const std::vector<double>& v,
                    const CrossCheckSettings& settings)
      : problem_(problem),
        v_(v),
        settings_(settings),
        ipopt_options_(ipopt_options_text(settings, true)),
        start_(v.size(), 0.0),
        g_(problem.structure().constraint_lower.size()),
        row_ranges_(g_.size()) {
    StartingPoint request{start_, false, {}, {}, {}};
    if (!problem.starting_point(request)) std::ranges::fill(start_, 0.0);
    const ProblemStructure& s = problem.structure();
    const auto is_free = [&](std::size_t i) {
      return s.variable_players[i] == Player::Max && s.variable_lower[i] != s.variable_upper[i];
    };
    for (const auto i : indices(v)) {
      if (is_free(i)) free_.push_back(i);
    }
    restrains_y_.assign(s.constraint_players.size(), false);
    for (const auto& [row, col] : s.jacobian) {
      if (is_free(at(col))) restrains_y_[at(row)] = s.constraint_players[at(row)] == Player::Max;
    }
  }

  [[nodiscard]] InnerMaximumCheck run() {
    InnerMaximumCheck check;
    if (!problem_.objective(v_, true, check.objective) || !std::isfinite(check.objective)) {
      throw std::runtime_error("the objective is undefined at the point whose y is checked");
    }
    check.best_near = check.best_far = check.objective;
    if (free_.empty()) return check;
    std::mt19937 random(settings_.seed);
    std::vector<std::vector<double>> starts;
    for (int k = 0; k < settings_.near_starts + settings_.far_starts; ++k) {
      starts.push_back(start(random, k == 0                      ? 0.0
                                     : k < settings_.near_starts ? settings_.radius
                                                                 : 1.0));
      see(starts.back());
    }
    see(v_);
    see(start_);  // f may be flat in y at the answer's x
    allowed_violation_ = std::max(violation(v_), 1.0);
    // Both solvers are accurate to tol in the units of f, unless f hardly varies in these.
    const double size =
        std::min(std::max(1.0, std::abs(check.objective)), kOfRange * range_.size());
    for (int k = 0; k < settings_.near_starts + settings_.far_starts; ++k) {
      const bool near = k < settings_.near_starts;
      const double tol = near ? settings_.gain_tolerance : settings_.tolerance;
      maximize(starts[at(k)], near, check,
               check.objective + std::max(tol * size, range_.resolution(0.0)));
    }
    return check;
  }

 private:
  [[nodiscard]] double reach(std::size_t i) const {
    const ProblemStructure& s = problem_.structure();
    return length_of(v_[i], start_[i], s.variable_lower[i], s.variable_upper[i]);
  }

  /// Takes the values at a point into the ranges; the constraints' stay in g_.
  void see(const std::vector<double>& v) {
    double f = 0.0;
    if (problem_.objective(v, true, f)) range_.see(f);
    if (g_.empty() || !problem_.constraints(v, true, g_)) return;
    for (const auto j : indices(g_)) row_ranges_[j].see(g_[j]);
  }

  /// v with y moved by up to radius times its lengths within its bounds.
  [[nodiscard]] std::vector<double> start(std::mt19937& random, double radius) const {
    const ProblemStructure& s = problem_.structure();
    std::vector<double> v = v_;
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (const std::size_t i : free_) {
      v[i] = std::clamp(v[i] + radius * reach(i) * unit(random), s.variable_lower[i],
                        s.variable_upper[i]);
    }
    return v;
  }

  /// Largest violation of a constraint that restrains y, over the smallest that counts.
  [[nodiscard]] double violation(const std::vector<double>& v) {
    const ProblemStructure& s = problem_.structure();
    if (g_.empty()) return 0.0;
    if (!problem_.constraints(v, true, g_)) return kInfinity;
    double worst = 0.0;
    for (const auto j : indices(g_)) {
      const double excess = std::max(s.constraint_lower[j] - g_[j], g_[j] - s.constraint_upper[j]);
      if (restrains_y_[j] && excess > 0.0)
        worst = std::max(worst, excess / row_ranges_[j].resolution(kFeasible));
    }
    return worst;
  }

  /// One maximization; keeps its point when it is feasible and better than all before and than
  /// the threshold.
  void maximize(const std::vector<double>& from, bool near, InnerMaximumCheck& check,
                double threshold) {
    Restructured held(problem_);
    ProblemStructure& s = held.changed;
    s.variable_lower = s.variable_upper = v_;
    for (const std::size_t i : free_) {
      const double r = near ? settings_.radius * reach(i) : kInfinity;
      s.variable_lower[i] = std::max(problem_.structure().variable_lower[i], v_[i] - r);
      s.variable_upper[i] = std::min(problem_.structure().variable_upper[i], v_[i] + r);
    }
    for (const auto j : indices(g_)) {
      if (restrains_y_[j]) continue;
      s.constraint_lower[j] = -kInfinity;
      s.constraint_upper[j] = kInfinity;
    }
    Result start;
    start.v = from;
    AtResult started(held, &start);
    Negated negated(started);
    IpoptAnswer answer = solve_with_ipopt(negated, [&](OptionsList& list) {
      list.SetIntegerValue("max_iter", 300);
      list.SetNumericValue("bound_relax_factor", 0.0);
      // A larger barrier would hold y in the middle of its box, which is y*.
      if (near) list.SetNumericValue("mu_init", 1e-8);
      set_from_text(list, ipopt_options_);
    });
    if (near) {
      ++check.near_runs;
      check.near_solved += succeeded(answer);
    }
    if (answer.v.empty()) return;
    negate(answer);
    double& best = near ? check.best_near : check.best_far;
    if (!(answer.objective > std::max(best, threshold))) return;
    if (!(violation(answer.v) <= allowed_violation_)) return;
    best = answer.objective;
    (near ? check.improved_near : check.improved_far) = true;
    (near ? check.v_near : check.v_far) = answer.v;
  }

  Problem& problem_;
  const std::vector<double>& v_;
  const CrossCheckSettings& settings_;
  std::string ipopt_options_;
  std::vector<std::size_t> free_;  ///< Max variables that are not fixed
  std::vector<bool> restrains_y_;  ///< constraints of Max that read one of these
  std::vector<double> start_, g_;
  ValueRange range_;                    ///< of f at all starts and the problem's
  std::vector<ValueRange> row_ranges_;  ///< of constraints there
  double allowed_violation_ = 1.0;
};

// --- Report
// ---------------------------------------------------------------------------------------

std::string comparison_report(const CrossCheck& check) {
  const Result& ours = check.ours;
  const IpoptAnswer& ipopt = check.ipopt;
  std::string text = format("%-24s %24s %24s\n", "", "Ipminmax", "Ipopt");
  const auto row = [&](const char* label, std::string_view a, std::string_view b) {
    text += format("%-24s %24s %24s\n", label, std::string(a).c_str(), std::string(b).c_str());
  };
  row("Status", name_of(ours.status), name_of(ipopt.status));
  row("Second-order test", name_of(ours.certificate.second_order),
      name_of(check.ipopt_certificate.second_order));
  text += format("%-24s %24.16e %24.16e\n", "Objective", ours.objective, ipopt.objective);
  const auto count = [&](const char* label, double a, double b) {
    text += format("%-24s %24.10g %24.10g\n", label, a, b);
  };
  count("Iterations", ours.iterations, ipopt.iterations);
  count("Evaluations: objective", ours.counts.objective, ipopt.counts.objective);
  count("             gradient", ours.counts.gradient, ipopt.counts.gradient);
  count("             constraints", ours.counts.constraints, ipopt.counts.constraints);
  count("             Jacobian", ours.counts.jacobian, ipopt.counts.jacobian);
  count("             Hessian", ours.counts.hessian, ipopt.counts.hessian);
  count("Factorizations", ours.factorizations, ipopt.counts.factorizations_full);
  text += format("%-24s %24.3f %24.3f\n", "Seconds", ours.seconds, ipopt.seconds);
  if (!ours.v.empty() && !ipopt.v.empty()) {
    const AnswerDifference& d = check.difference;
    text += format(
        "Relative differences: objective %.2e, point %.2e, lambda %.2e, z_L %.2e, z_U %.2e\n",
        d.objective, d.point, d.lambda, d.z_lower, d.z_upper);
  }
  return text;
}

std::string minmax_report(const CrossCheck& check) {
  const InnerMaximumCheck& inner = check.inner;
  return concat("Status of Ipminmax...........: ", name_of(check.ours.status),
                "\nSecond-order test............: ", name_of(check.ours.certificate.second_order)) +
         format(
             "\nObjective f(x*, y*)..........: %24.16e\n"
             "Ipopt's runs near y*.........: %d, %d of them solved\n"
             "Largest f near y*............: %24.16e%s\n"
             "Largest f found elsewhere....: %24.16e%s\n",
             inner.objective, inner.near_runs, inner.near_solved, inner.best_near,
             inner.improved_near ? "  (better)" : "", inner.best_far,
             inner.improved_far ? "  (better: y* is not the global maximum)" : "");
}

/// In the order of CrossCheckVerdict.
struct VerdictText {
  std::string_view name, words;
};
constexpr auto kVerdicts = std::to_array<VerdictText>({
    {"not compared", "nothing to compare"},
    {"same solution", "both solvers find the same solution"},
    {"same objective", "both solvers find the same objective, at different points"},
    {"Ipminmax better", "both solvers succeed, Ipminmax with the better objective"},
    {"Ipopt better", "both solvers succeed, Ipopt with the better objective"},
    {"only Ipminmax solved", "only Ipminmax succeeds"},
    {"only Ipopt solved", "only Ipopt succeeds"},
    {"neither solved", "neither solver succeeds"},
    {"Ipopt refuted", "Ipopt reports success at a point that the second-order test refutes"},
    {"maximum confirmed",
     "Ipopt finds no better y near y* (the minimizer's side cannot be checked with Ipopt)"},
    {"maximum refuted", "Ipopt finds a better y near y*: the point is not a local minmax"},
});
VerdictText text_of(CrossCheckVerdict verdict) {
  const auto at = static_cast<std::size_t>(verdict);
  return at < kVerdicts.size() ? kVerdicts[at] : VerdictText{"unknown", "unknown"};
}

}  // namespace

std::string_view name_of(CrossCheckVerdict verdict) { return text_of(verdict).name; }

std::string CrossCheck::report() const {
  const char* kind = min_variables == variables ? "minimization"
                     : min_variables == 0       ? "maximization"
                                                : "minmax problem";
  std::string text = format("Cross check with Ipopt: %s, %d variables (%d Min), %d constraints\n",
                            kind, variables, min_variables, constraints);
  if (verdict == CrossCheckVerdict::NotCompared) {
    return text + "Not compared: " + message + "\n";
  }
  const bool minmax = verdict == CrossCheckVerdict::MaximumConfirmed ||
                      verdict == CrossCheckVerdict::MaximumRefuted;
  text += minmax ? minmax_report(*this) : comparison_report(*this);
  return concat(text, "Verdict: ", text_of(verdict).words, ".\n");
}

CrossCheck cross_check_with_ipopt(Problem& problem, const CrossCheckSettings& settings) {
  CrossCheck check;
  const ProblemStructure& structure = problem.structure();
  check.variables = static_cast<Index>(structure.variable_players.size());
  check.min_variables =
      static_cast<Index>(std::ranges::count(structure.variable_players, Player::Min));
  check.constraints = static_cast<Index>(structure.constraint_players.size());
  SolverOptions options;
  check.message = read_own_options(settings, options);
  const std::string ipopt_options = ipopt_options_text(settings, false);
  if (check.message.empty()) check.message = check_ipopt_options(ipopt_options);
  if (!check.message.empty()) {
    check.ours.status = Status::InvalidOption;
    check.ours.message = check.message;
    return check;
  }

  check.ours = solve(problem, options);
  if (!has_iterate(check.ours.status)) {  // Ipopt does not check what it would be given
    check.message = check.ours.message;
    return check;
  }
  if (check.min_variables != 0 && check.min_variables != check.variables) {
    if (check.ours.v.empty() || !std::isfinite(check.ours.objective)) {
      check.message = "no point was found: " + check.ours.message;
      return check;
    }
    check.inner = InnerMaximization(problem, check.ours.v, settings).run();
    if (!check.inner.improved_near && check.inner.near_runs > 0 && check.inner.near_solved == 0) {
      check.message = "Ipopt solved none of its maximizations near y*";
      return check;
    }
    check.verdict = check.inner.improved_near ? CrossCheckVerdict::MaximumRefuted
                                              : CrossCheckVerdict::MaximumConfirmed;
    return check;
  }

  const bool maximization = check.variables > 0 && check.min_variables == 0;
  Negated negated(problem);
  check.ipopt = solve_with_ipopt(maximization ? negated : problem, [&](OptionsList& list) {
    list.SetStringValue("honor_original_bounds", "no");  // as here; Ipopt 3.11 projects otherwise
    set_from_text(list, ipopt_options);
  });
  if (maximization) negate(check.ipopt);
  if (!check.ipopt.v.empty()) {
    check.ipopt_certificate = certify(problem, check.ipopt, options);
    if (!check.ours.v.empty()) check.difference = difference_of(structure, check.ours, check.ipopt);
  }
  check.verdict = compare(check, settings, maximization);
  return check;
}

CrossCheck cross_check_with_ipopt(const SmartPtr<Ipopt::TNLP>& model,
                                  const CrossCheckSettings& settings) {
  CrossCheck check;
  check.ours.status = Status::InvalidProblem;
  if (IsNull(model)) {
    check.message = check.ours.message = "the model is null";
    return check;
  }
  CrossCheckSettings others = settings;
  TnlpProblem problem(model, take_player_options(others.options));
  if (auto error = problem.load(); !error.empty()) {
    check.message = check.ours.message = error;
    return check;
  }
  return cross_check_with_ipopt(problem, others);
}

InnerMaximumCheck check_inner_maximum(Problem& problem, const std::vector<double>& v,
                                      const CrossCheckSettings& settings) {
  const std::size_t n = problem.structure().variable_players.size();
  if (v.size() != n) {
    throw std::invalid_argument(concat("check_inner_maximum: the point has ", v.size(),
                                       " entries, the problem ", n, " variables"));
  }
  SolverOptions options;
  std::string error = read_own_options(settings, options);
  if (error.empty()) error = check_ipopt_options(ipopt_options_text(settings, true));
  if (!error.empty()) throw std::invalid_argument("check_inner_maximum: " + error);
  return InnerMaximization(problem, v, settings).run();
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
