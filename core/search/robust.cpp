#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/model/model_start.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/ranking.hpp"
#include "core/search/robust_search.hpp"

namespace ipminmax {
namespace {

/// Maximizations over y that look for the branches that meet at a kink, unless
/// minmax_worst_case_starts says more.
constexpr int kBranchSearches = 10;

/// Whether indices can be followed; solve says what is wrong with others.
bool well_formed(const ProblemStructure& s) {
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  const auto inside = [](Index i, std::size_t size) {
    return i >= 0 && static_cast<std::size_t>(i) < size;
  };
  return s.variable_lower.size() == n && s.variable_upper.size() == n &&
         s.constraint_lower.size() == m && s.constraint_upper.size() == m &&
         std::ranges::all_of(s.jacobian,
                             [&](Triplet t) { return inside(t.row, m) && inside(t.col, n); }) &&
         std::ranges::all_of(s.hessian,
                             [&](Triplet t) { return inside(t.row, n) && inside(t.col, n); });
}

/// Whether a search may have ended where branches of inner maxima meet.
bool may_be_kink(Status status) {
  using enum Status;
  return status == NoLocalMinmaxFound || status == NotLocalMinmax || status == TinyStep ||
         status == SolvedDegenerate || status == MaxIterations || status == LocallyInfeasible ||
         status == InertiaCorrectionFailed || status == RestorationFailed;
}

/// Work of what came before the answer.
void add_before(const RobustResult& before, RobustResult& answer) {
  answer.solves += before.solves;
  answer.maximizations += before.maximizations;
  add_work(before.result, answer.result);
}

/// Of a problem in the form in which it is solved.
SolverOptions without_epigraph(SolverOptions options) {
  options.minmax_epigraph = options.minmax_epigraph_at_kinks = false;
  return options;
}

/// Why f cannot be treated as a robust constraint; empty: it can.
std::string epigraph_error(Problem& model, const SolverOptions& options) {
  if (!options.minmax_epigraph && !options.minmax_epigraph_at_kinks) return {};
  if (!has_max_variables(model.structure())) return {};
  bool mirrored = options.obj_scaling_factor < 0.0;
  if (options.nlp_scaling_method == Scaling::User) {
    UserScaling scaling;
    if (model.user_scaling(scaling) && scaling.objective < 0.0) mirrored = !mirrored;
  }
  if (!mirrored) return {};
  return std::string(options.minmax_epigraph ? "minmax_epigraph" : "minmax_epigraph_at_kinks") +
         " cannot be used with a negative factor of the objective, by which y minimizes f";
}

class RobustSolve {
 public:
  RobustSolve(Problem& model, const SolverOptions& options, const SolveObserver& observer)
      : model_(model),
        options_(without_epigraph(options)),
        epigraph_(options.minmax_epigraph && has_max_variables(model.structure())),
        at_kinks_(options.minmax_epigraph_at_kinks && has_max_variables(model.structure())),
        observer_(observer),
        limit_(options) {}

  /// start: n values of the model; empty: its own.
  [[nodiscard]] RobustResult from(const std::vector<double>& start);
  [[nodiscard]] RobustResult from_many_starts();

 private:
  [[nodiscard]] RobustResult as_asked(const std::vector<double>& start);
  [[nodiscard]] RobustResult in_epigraph_form(const std::vector<double>& start, bool at_kink);

  Problem& model_;
  const SolverOptions options_;  ///< without those of the epigraph form
  const bool epigraph_, at_kinks_;
  const SolveObserver& observer_;
  TimeLimit limit_;
};

RobustResult RobustSolve::from(const std::vector<double>& start) {
  if (epigraph_) return in_epigraph_form(start, false);
  RobustResult answer = as_asked(start);
  const bool has_point = !answer.result.v.empty() && all_finite(answer.result.v);
  if (!at_kinks_ || !may_be_kink(answer.result.status) || !has_point) {
    return answer;
  }
  if (observer_.message) observer_.message("a kink of the worst case: the epigraph form from here");
  // From the maxima over y where the search ended, then from where it began.
  for (const bool anew : {false, true}) {
    RobustResult branches =
        anew ? in_epigraph_form(start, false) : in_epigraph_form(answer.result.v, true);
    // The errors of a search over branches are those of its copies of y: only a certified answer is
    // one.
    const bool found = branches.result.certificate.kind == PointKind::LocalMinmax &&
                       better(branches.result, answer.result);
    RobustResult& chosen = found ? branches : answer;
    add_before(found ? answer : branches, chosen);
    if (found || branches.result.status == Status::UserStop || limit_.expired()) {
      return std::move(chosen);
    }
  }
  return answer;
}

RobustResult RobustSolve::as_asked(const std::vector<double>& start) {
  if (has_robust_constraints(model_.structure())) {
    return RobustSearch({model_, model_}, options_, options_.minmax_worst_case_starts, observer_,
                        limit_)
        .run(start);
  }
  RobustResult answer;
  SolverOptions options = options_;
  limit_.pass_on(options);
  if (!start.empty()) options.warm_start_init_point = false;
  if (options.minmax_starts > 1) options.minmax_max_restarts = 0;  // the starts are chosen here
  Restarted restarted(model_, start);
  answer.result = solve(restarted, options, observer_);
  answer.largest_violation = std::numeric_limits<double>::quiet_NaN();
  answer.solves = 1;
  return answer;
}

RobustResult RobustSolve::in_epigraph_form(const std::vector<double>& start, bool at_kink) {
  const std::unique_ptr<Problem> epigraph = make_epigraph(model_);
  const int starts = epigraph_ ? options_.minmax_worst_case_starts
                               : std::max(kBranchSearches, options_.minmax_worst_case_starts);
  std::vector<double> own = start;
  if (!own.empty()) {
    double f = 0.0;
    own.push_back(model_.objective(start, true, f) && std::isfinite(f) ? f : 0.0);
  }
  RobustSearch search({*epigraph, model_}, options_, starts, observer_, limit_);
  RobustResult answer =
      at_kink ? search.run_from_maxima(std::move(own)) : search.run(std::move(own));
  const auto m = static_cast<Index>(model_.structure().constraint_players.size());
  answer.branches = static_cast<Index>(std::ranges::count_if(
      answer.worst_cases, [&](const RobustWorstCase& found) { return found.constraint == m; }));
  if (answer.result.certificate.kind == PointKind::LocalMinmax && answer.branches > 1) {
    answer.result.message =
        "x minimizes the largest of " + std::to_string(answer.branches) + " local worst cases";
  }
  return answer;
}

RobustResult RobustSolve::from_many_starts() {
  RobustResult best;
  std::vector<DistinctPoint> points;
  const std::optional<std::vector<double>> center = model_start(model_);
  Index made = 0;
  bool interrupted = false;
  for (Index start = 0; start < (center ? options_.minmax_starts : 1) && !interrupted; ++start) {
    std::vector<double> v;
    if (start > 0) v = random_start(model_.structure(), *center, start, options_);
    RobustResult answer = from(v);
    answer.best_start = start;
    ++made;
    interrupted = answer.result.status == Status::UserStop || limit_.expired();
    if (answer.result.certificate.kind == PointKind::LocalMinmax) {
      add_distinct(model_.structure(), true, options_.minmax_distinct_tol, start,
                   Result(answer.result), points);
    }
    // Where the observer stops, its iterate is the answer.
    const bool chosen = start == 0 || answer.result.status == Status::UserStop ||
                        better(answer.result, best.result);
    if (start > 0) add_before(chosen ? best : answer, chosen ? answer : best);
    if (chosen) best = std::move(answer);
  }
  std::ranges::stable_sort(points, {}, [](const DistinctPoint& p) { return p.result.objective; });
  best.starts = made;
  best.points = std::move(points);
  return best;
}

}  // namespace

bool has_robust_constraints(const ProblemStructure& structure) {
  return well_formed(structure) && !robust_constraints(structure).empty();
}

RobustResult solve_robust(Problem& model, const SolverOptions& options,
                          const SolveObserver& observer) {
  RobustResult refused;
  if (!well_formed(model.structure()) || !check(options).empty()) {
    refused.result = solve(model, without_epigraph(options), observer);  // says what is wrong
    return refused;
  }
  if (auto error = epigraph_error(model, options); !error.empty()) {
    refused.result.status = Status::InvalidOption;
    refused.result.message = std::move(error);
    return refused;
  }
  RobustSolve robust(model, options, observer);
  return options.minmax_starts > 1 ? robust.from_many_starts() : robust.from({});
}

}  // namespace ipminmax
