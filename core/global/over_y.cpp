#include "core/global/over_y.hpp"

#include <cmath>
#include <utility>

#include "core/global/inner_problem.hpp"
#include "core/model/indices.hpp"
#include "core/search/one_start.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {
namespace {

/// Starts of y for each robust constraint unless the option says how many.
constexpr Index kStartsOfRows = 8;
/// Most of them where one more maximum could violate the constraint, and the share of starts that
/// may lead to such ones.
constexpr Index kMostStartsOfRows = 100;
constexpr double kUnseenShare = 1e-2;
/// Of the range of values: what the next maximum may have more where those found are equal.
constexpr double kUnseenExcess = 1e-2;
/// Searches after which a row is not looked at any longer whose maxima, less than half as many, are
/// far from the limit: of 9,000 more in 250 random programs none exceeded it.
constexpr Index kSearchesFromAfar = 3;
/// Of so many starts that found the highest maximum, a higher one to which half as many lead would
/// have been missed once in exp(10 / 2) = 150 times.
constexpr Index kFoundOften = 10;
/// Searches that begin beside a maximum.
constexpr std::size_t kBeside = 4;
/// Maxima of one value that searches begin beside.
constexpr Index kBesideOneHeight = 3;
/// Boxes of a proof between two words to the listener.
constexpr Index kBoxesOfAWord = 1000;

/// Of a maximum: its multipliers, and whether searches began beside it.
struct Beside {
  std::vector<double> lambda;
  bool looked = false;
};

/// Whether so many maximizations ended at few maxima, far from the limit.
bool is_far(const MaximaOverY& found, double limit) {
  const auto distinct = static_cast<Index>(found.heights().size());
  return found.made >= kSearchesFromAfar && distinct > 0 && found.made > 2 * distinct &&
         !is_near_limit(limit - found.highest(), found.range.size());
}

/// Whether another start is worth its cost. Where n random ones found maxima of w values,
/// w (w + 1) / (n - w - 2) more are to be expected, to which w (w + 1) / (n (n - 1)) of all starts
/// lead (Boender and Rinnooy Kan 1987): half a one is not, nor a rare one. Nor does one count that
/// would have to be higher than the highest by more than the known ones differ.
bool is_worth_more(const MaximaOverY& found, double limit, Index made) {
  const std::vector<double> values = found.heights();
  const auto distinct = static_cast<Index>(values.size());
  const double lowest = values.empty() ? kInfinity : std::ranges::min(values);
  const double most = found.highest();
  const double more = std::max(most - lowest, kUnseenExcess * found.range.size());
  return !found.is_higher(most, limit) && most + more > limit &&
         (made <= 2 * distinct * distinct + 3 * distinct + 2 ||
          distinct * (distinct + 1) > kUnseenShare * made * (made - 1));
}

/// Of maxima: a point of a convex Y.
std::vector<double> center(const std::vector<WorstCaseMaximum>& maxima) {
  std::vector<double> mean(maxima.front().v.size(), 0.0);
  for (const WorstCaseMaximum& maximum : maxima) {
    for (const auto i : indices(mean)) mean[i] += maximum.v[i] / static_cast<double>(maxima.size());
  }
  return mean;
}

/// How large the function can become over all y; a value that shows above the highest of the
/// sorted maxima is one, too.
void prove(Problem& inner, const MaximizationContext& context, MaximaOverY& found) {
  const double known = found.highest();
  const ProofRequest request = context.proof != nullptr ? *context.proof : ProofRequest{};
  const std::vector<double> seen =
      found.maxima.empty() ? std::vector<double>{} : found.maxima.front().v;
  Index words = 0;
  const auto tell = [&](double bound) {
    IterationInfo info;
    info.iteration = words++;
    info.over_y = true;
    info.objective = bound;
    info.v = std::span(seen).first(std::min(seen.size(), context.told.variable_players.size()));
    info.result = [&] { return context.work; };
    info.scaling = [](UserScaling&) {};
    return context.budget.tell(context.start, info);
  };
  const auto go_on = [&](Index boxes, double bound) {
    return !context.budget.interrupted() && (boxes < words * kBoxesOfAWord || tell(bound)) &&
           boxes < request.most_boxes;
  };
  const double before = context.budget.stopwatch().wall();
  WorstCaseProof proof =
      enclose_maximum(inner, context.options, seen,
                      {request.tolerance, go_on, context.options.minmax_threads}, context.share);
  proof.seconds = context.budget.stopwatch().wall() - before;
  proof.interrupted = context.budget.interrupted();
  found.finished = found.finished && !proof.interrupted;
  if (!proof.v.empty() && (found.maxima.empty() || proof.seen - known > proof.resolution)) {
    found.maxima.insert(found.maxima.begin(), {proof.v, proof.seen, false, 0});
    found.range.see(proof.seen);
  }
  found.maximized = found.maximized || proof.complete;
  found.proof = std::move(proof);
}

/// The maximizations over y of one function at one x.
class MaximizationOverY {
 public:
  /// limit: from which value, and by how much of the range, a maximum is one too many; without it
  /// there are as many starts as are asked for.
  MaximizationOverY(Problem& problem, const MaximizationContext& context,
                    std::optional<double> limit)
      : inner_(problem, context.options, context.work.counts),
        context_(context),
        limit_(limit),
        ranges_(inner_.sampled),
        has_branches_(inner_.equations > 0 && !context.complete) {
    // x is held: its multipliers, a gradient and a Jacobian more, are not read.
    options_.fixed_variable_treatment = FixedVariableTreatment::MakeParameterNodual;
    options_.warm_start_init_point = false;
    found_.tol = options_.minmax_worst_case_tol;
    // In units of a row's size. After the first stages it may hardly depend on y.
    constexpr double kSolvedTo = 10.0;
    if (context_.complete) found_.range.accuracy = kSolvedTo * options_.tol;
  }

  MaximaOverY run(Index starts, Points given) {
    if (starts > 1 && !options_.minmax_concave_in_y) {
      std::vector<double> vertex = best_vertex(inner_);
      if (vertex.empty()) vertex = best_held_vertex();
      if (!vertex.empty()) given.push_back(std::move(vertex));
    }
    const Index count = std::max(starts, static_cast<Index>(given.size()) + 1);
    context_.work.counts += detect_hessian(inner_.model, options_, structure_);
    Index start = 0;
    const bool looks_longer = limit_ && may_look_longer(options_);
    const auto may_be_higher = [&] {
      return looks_longer && is_worth_more(found_, *limit_, start);
    };
    const auto goes_on = [&] {
      const bool may_end = looks_longer && inner_.is_connected() && !has_branches_;
      return (start < count && !(may_end && is_far(found_, *limit_))) ||
             (start < kMostStartsOfRows && may_be_higher());
    };
    bool is_sampled = !looks_longer;
    for (;; ++start) {
      std::vector<double> v;
      if (!goes_on()) {
        if (std::exchange(is_sampled, true) || is_above_limit(found_.highest())) break;
        v = higher_sample(inner_, kMostStartsOfRows + 1, found_.range, found_.highest());
        if (v.empty()) break;
      }
      SolverOptions options = count > 1 ? without_restarts(options_) : options_;
      if (start > 0 && v.empty()) {
        if (inner_.start.empty()) break;
        v = at(start) <= given.size() ? given[at(start) - 1] : drawn(start, options);
        if (v.empty()) continue;
      }
      if (!maximize_from(std::move(v), options)) break;
      if (start + 1 >= count && limit_ && !look_beside()) break;
    }
    Index often = 0;  // the highest value was found
    for (const WorstCaseMaximum& maximum : found_.maxima) {
      if (!found_.is_higher(found_.highest(), maximum.value)) often += maximum.found;
    }
    found_.conclusive = found_.infeasible_vertices.empty() &&
                        (start < kMostStartsOfRows || !may_be_higher() || often >= kFoundOften);
    // As a single solve does, which is not to find more than many starts.
    if (found_.finished && count > 1 && !found_.any_certified() && makes_new_starts(options_)) {
      maximize_from({}, options_);
    }
    // A search that failed above all maxima, next to the limit, shows that there is a higher one.
    if (limit_ && found_.is_higher(found_.highest(), highest_maximum_) && !found_.unbounded &&
        is_near_limit(*limit_ - found_.highest(), found_.range.size())) {
      found_.maximized = false;
    }
    fit_range();
    std::ranges::stable_sort(found_.maxima, std::greater{}, &WorstCaseMaximum::value);
    const bool proves = context_.proof != nullptr || options_.minmax_worst_case_proof;
    if (proves && !is_above_limit(found_.highest())) prove(inner_.model, context_, found_);
    found_.single_branch =
        found_.single_branch && found_.maxima.size() == 1 && found_.any_certified();
    return std::move(found_);
  }

 private:
  /// If equations determine the states from few variables with two bounds, as from unknown
  /// parameters: the vertex of these with the largest value, by a solve that holds them there for
  /// each. A solve that diverges, as on an unstable trajectory, may be worse than all others.
  std::vector<double> best_held_vertex() {
    if (inner_.start.empty() || inner_.boxed.empty() || inner_.boxed.size() > kMostHeld ||
        inner_.is_box() || !inner_.is_connected())
      return {};
    holds_box_ = true;
    std::optional<Result> best;
    for (std::size_t number = 0; number < inner_.vertices() && !context_.budget.used_up();
         ++number) {
      const std::vector<double> v = inner_.vertex(number);
      Result result = solve_held(v);
      if (!is_success(result.status)) {
        found_.infeasible_vertices.push_back(v);
      } else if (!best || result.objective > best->objective) {
        best = std::move(result);
      }
    }
    if (!best) return {};
    best->certificate = {};  // of what is held
    if (limit_) add(*best);
    return std::move(best->v);
  }

  /// The states that equations determine from the boxed variables of v.
  Result solve_held(std::vector<double> v) {
    Held held(inner_.model, inner_.boxed, std::move(v));
    SolverOptions options = without_restarts(options_);
    // Full steps meet one stage of explicit dynamics after the other, wherever they begin.
    options.minmax_pure_newton = true;
    Result result = solve_from_start(held, options, context_.budget, observer(), nullptr);
    add_work(result, context_.work);
    ++context_.work.over_y.maximizations;
    return result;
  }

  /// First where trajectories are at their worst: what has two bounds all at lower bounds, all at
  /// upper ones, and in turn, for random disturbances cancel along a trajectory and what is worst
  /// mostly pushes one way. Then a random one, every other one above it, unless single variables
  /// lead away from Y at once. Empty: the states diverge.
  std::vector<double> drawn(Index start, SolverOptions& options) {
    constexpr std::size_t kBangBangStarts = 4;
    if (!holds_box_ && !inner_.boxed.empty() && inner_.equations > 0 &&
        bang_bang_starts_ < kBangBangStarts) {
      options = staying_near(options);
      const std::size_t first = bang_bang_starts_++, step = first > 1 ? 1 : 0;
      return inner_.at_bounds([&](std::size_t k) { return (first + k * step) % 2 == 1; });
    }
    const Index number = context_.drawn + start;
    std::vector<double> v = random_start(inner_.sampled, inner_.start, number, options_);
    const bool is_even = start % 2 == 0;
    if (holds_box_ && !(has_branches_ && is_even)) {
      std::vector<double> moved = inner_.start;
      for (const std::size_t i : inner_.boxed) moved[i] = v[i];
      Result result = solve_held(std::move(moved));
      return is_success(result.status) ? std::move(result.v) : std::vector<double>{};
    }
    const bool ascends = is_even && limit_ && !found_.maxima.empty() && inner_.equations == 0 &&
                         inner_.boxed.size() > kMostHeld;
    if (!ascends) return v;
    options = staying_near(options);
    return start_above(inner_, center(found_.maxima), std::move(v), number);
  }

  bool is_above_limit(double value) const { return limit_ && found_.is_higher(value, *limit_); }

  /// Beside the highest maximum, then beside others, if little more would violate the constraint:
  /// with one variable at another bound. Of maxima of one value, as on a face of Y, beside a few:
  /// those on which x rests have one value, too.
  /// False: nothing more can be done.
  bool look_beside() {
    const SolverOptions options = without_restarts(staying_near(options_));
    const auto looked_at_height_of = [&](double value) {
      Index looked = 0;
      for (const auto k : indices(beside_)) {
        if (beside_[k].looked && found_.is_as_high(value, found_.maxima[k].value)) ++looked;
      }
      return looked;
    };
    while (!options_.minmax_concave_in_y && found_.made < kMostStartsOfRows) {
      std::optional<std::size_t> from;
      for (const auto k : indices(found_.maxima)) {
        const auto& [v, value, certified, found] = found_.maxima[k];
        // Beside the maxima of a face, which are not certified, stand more of them.
        const bool wanted = !beside_[k].looked &&
                            value + kUnseenExcess * found_.range.size() > *limit_ &&
                            looked_at_height_of(value) < (certified ? kBesideOneHeight : 1);
        if (wanted && (!from || value > found_.maxima[*from].value)) from = k;
      }
      if (!from || is_above_limit(found_.highest())) return true;
      beside_[*from].looked = true;
      for (auto& start : next_to(inner_, found_.maxima[*from].v, beside_[*from].lambda, kBeside)) {
        if (!maximize_from(std::move(start), options)) return false;
      }
    }
    return true;
  }

  /// By values at infeasible points, up to the size of the function; at most to what matters beside
  /// the highest maximum: what x can change there, as each Min variable changes by its size, how
  /// far other maxima are below, and what a solve leaves undecided.
  void fit_range() {
    const double width = std::min(on_the_way_.size(), context_.size);
    if (width > found_.range.size()) found_.range.see(found_.range.most - width);
    found_.range.terms = std::max(found_.range.terms, context_.size);
    if (found_.maxima.empty()) return;
    const auto [lowest, top] =
        std::ranges::minmax_element(found_.maxima, {}, &WorstCaseMaximum::value);
    const std::vector<double>& v = top->v;
    std::vector<double> gradient(v.size());
    ++context_.work.counts.gradient;
    if (!inner_.model.gradient(v, true, gradient)) return;
    const auto size = [&](std::size_t i) {
      return context_.sizes != nullptr ? context_.sizes->moved(i) : std::abs(v[i]);
    };
    const double change = change_by_min(inner_.s, gradient, size, top->value - lowest->value);
    double steepest = options_.nlp_scaling_max_gradient;
    for (const std::size_t i : variables_of(inner_.s, Player::Min))
      steepest = std::max(steepest, std::abs(gradient[i]));
    // A solve meets its constraints as they are scaled.
    accuracy_ *= steepest / options_.nlp_scaling_max_gradient;
    found_.range.cap = std::max(change, accuracy_ / found_.tol);
    // Where y changes nothing, all that x can change.
    if (limit_ && found_.range.size() == 0.0) found_.range.see(top->value - found_.range.cap);
  }

  /// False: nothing more can be done.
  bool maximize_from(std::vector<double> v, const SolverOptions& options) {
    if (context_.budget.used_up()) {
      found_.finished = false;
      return false;
    }
    if (context_.witnesses != nullptr) context_.witnesses->add_start(v);  // may be undefined there
    Restarted restarted(inner_.model, std::move(v));
    const Result result =
        solve_from_start(restarted, options, context_.budget, observer(), &structure_);
    add_work(result, context_.work);
    if (context_.budget.interrupted()) found_.finished = false;
    ++found_.made;
    ++context_.work.over_y.maximizations;
    add(result);
    return found_.finished && !is_final(result.status);
  }

  SolveObserver observer() {
    SolveObserver observer;
    observer.on_iteration = [this](const IterationInfo& info) {
      if (info.iteration == 0) found_.starts.emplace_back(info.v.begin(), info.v.end());
      // Where Max's constraints do not hold the function may be anything.
      const bool feasible = !info.restoration && info.error.primal <= options_.constr_viol_tol;
      (feasible ? found_.range : on_the_way_).see(info.objective);
      if (info.iteration == 0 && context_.witnesses != nullptr)
        context_.witnesses->add_start(info.v);
      found_.single_branch = found_.single_branch && info.delta_y == 0.0;
      IterationInfo told = info;
      told.over_y = true;
      const std::size_t n = context_.told.variable_players.size();
      if (n < info.v.size()) {
        told.v = info.v.first(n);
        told.result = [this, &info] {
          Result result = info.result();
          cut(context_.told, result);
          return result;
        };
      }
      return context_.budget.tell(context_.start, told);
    };
    return observer;
  }

  /// Whether the function is above the limit farther out in the direction of a point: where it
  /// runs to a value that it never reaches it is not.
  bool exceeds_farther_out(const std::vector<double>& v) {
    if (inner_.start.empty()) return false;
    std::vector<double> there = v;
    for (const double times : {1e3, 1e6, 1e9}) {
      for (const std::size_t i : inner_.free) {
        const double own = inner_.start[i];
        there[i] = std::clamp(own + times * (v[i] - own), inner_.s.variable_lower[i],
                              inner_.s.variable_upper[i]);
      }
      const auto value = inner_.value_at(there);
      if (value && is_above_limit(*value)) return true;
    }
    return false;
  }

  void add(const Result& result) {
    using enum Status;
    const bool runs_away =
        !inner_.is_box() && (result.status == InnerUnbounded || result.status == OuterUnbounded ||
                             result.status == DivergingIterates);
    const bool maximum = is_success(result.status);
    found_.maximized = found_.maximized || maximum || runs_away;
    if (maximum || runs_away) highest_maximum_ = std::max(highest_maximum_, result.objective);
    found_.single_branch = found_.single_branch && maximum;
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    if (runs_away ||
        (maximum && !certified && limit_ && !inner_.is_box() && !inner_.is_determined_by_box())) {
      // Far away and infeasible, nothing is seen of f.
      double size = 0.0;
      for (const std::size_t i : inner_.free) size = std::max(size, std::abs(result.v[i]));
      const bool seen = result.error.primal <= options_.constr_viol_tol * size;
      if (seen && (!limit_ || exceeds_farther_out(result.v))) found_.unbounded = true;
    }
    if (result.v.empty() || !std::isfinite(result.objective) ||
        !(result.error.primal <= options_.constr_viol_tol)) {
      return;
    }
    std::vector<double> v = result.v;
    double value = result.objective;
    if (context_.complete) {
      ++context_.work.counts.objective;
      if (!context_.complete(v) || !inner_.model.objective(v, true, value)) {
        found_.completed = false;
        return;
      }
    }
    found_.range.see(value);
    accuracy_ = std::min(accuracy_, options_.tol / std::abs(result.objective_scale));
    if (context_.witnesses != nullptr) context_.witnesses->add(v);
    ranges_.see(v);
    for (WorstCaseMaximum& known : found_.maxima) {
      if (!same_point(v, known.v, ranges_, inner_.free, options_.minmax_distinct_tol) ||
          !found_.is_as_high(value, known.value)) {
        continue;
      }
      ++known.found;
      known.certified = known.certified || certified;
      if (value > known.value) {
        known.value = value;
        known.v = std::move(v);
      }
      return;
    }
    // A feasible point bounds the maximum from below, whatever ended the search there.
    found_.maxima.push_back({std::move(v), value, certified, 1});
    beside_.push_back({result.lambda, false});
  }

  InnerProblem inner_;
  SolverOptions& options_ = inner_.options;
  const MaximizationContext& context_;
  std::optional<double> limit_;
  VariableRanges ranges_;
  bool has_branches_;  ///< equations are not known to be explicit
  KeptWork structure_ = kept_structure();
  MaximaOverY found_;
  double highest_maximum_ = -kInfinity;  ///< of searches that ended there or ran away
  ValueRange on_the_way_;                ///< of values at infeasible points
  double accuracy_ = kInfinity;          ///< of the value that a maximization leaves
  bool holds_box_ = false;               ///< few boxed variables determine all others
  std::vector<Beside> beside_;           ///< each of the maxima
  std::size_t bang_bang_starts_ = 0;     ///< made
};

}  // namespace

void cut(const ProblemStructure& model, Result& result) {
  const auto shorten = [](std::vector<double>& values, std::size_t most) {
    if (values.size() > most) values.resize(most);
  };
  for (auto* values : {&result.v, &result.z_lower, &result.z_upper})
    shorten(*values, model.variable_players.size());
  for (auto* values : {&result.lambda, &result.constraints})
    shorten(*values, model.constraint_players.size());
}

SolverOptions without_restarts(SolverOptions options) {
  options.minmax_max_restarts = 0;
  return options;
}

Index starts_over_y_of_rows(const SolverOptions& options) {
  const Index asked = options.minmax_worst_case_starts;
  if (asked < 0) return kStartsOfRows;
  return options.minmax_worst_case_proof ? std::max<Index>(1, asked) : asked;
}

Index starts_over_y_of_objective(const SolverOptions& options) {
  if (options.minmax_worst_case_proof || options.minmax_epigraph)
    return starts_over_y_of_rows(options);
  return std::max(0, options.minmax_worst_case_starts);
}

MaximaOverY maximize_over_y(Problem& inner, Index starts, const Points& given,
                            const MaximizationContext& context, std::optional<double> limit) {
  return MaximizationOverY(inner, context, limit).run(starts, given);
}

MaximaOverY maximize_objective(Problem& model, std::span<const double> v, Index starts,
                               const Points& given, const MaximizationContext& context) {
  Held inner = alone(model, Player::Max, v);
  if (context.options.minmax_concave_in_y) return maximize_over_y(inner, 1, {}, context);
  return maximize_over_y(inner, starts, given, context);
}

}  // namespace ipminmax
