#include <algorithm>
#include <utility>

#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "core/search/divergence.hpp"
#include "core/search/search.hpp"

namespace ipminmax {
namespace {

constexpr const char* kToInfinity = "the iterates diverge while the gradient goes to zero";

/// Whether K_yy has a wrong sign, although no direction was found that proves it.
bool seems_wrong(const Certificate& found) {
  return found.inner.positive > found.inner_expected.positive;
}

}  // namespace

Search::Search(const MethodContext& context, Purpose purpose, BarrierUpdate& barrier,
               Observation& observation, const Start& start, SearchArrays& arrays)
    : context_(context),
      purpose_(purpose),
      barrier_(barrier),
      observation_(observation),
      test_(context.canonical, context.options),
      arrays_(arrays),
      step_{.kind = start.how},
      deadline_(start.deadline) {
  arrays_.point = arrays_.next = start.point;
  arrays_.best.see(rank_of(context_.canonical, context_.options, arrays_.point), arrays_.point,
                   barrier_.mu(), context_.budget.iteration);
}

SearchOutcome Search::run(StepMethod& method, std::optional<SearchOutcome>& kept) {
  for (;; ++context_.budget.iteration) {
    if (!observation_.tell(arrays_.point, barrier_.mu(), step_)) return ended(Status::UserStop);
    drop_idle_multipliers(context_.options.tol);

    bool escaped = false;
    if (const auto claim = test_.claim(arrays_.point)) {
      Verdict verdict = judge(*claim);
      escaped = leave(verdict, method, kept);
      if (!escaped) return ended(std::move(verdict));
    }
    // For a balanced point as long again as to the first that met the tolerances, and some more.
    constexpr Index kMore = 100;
    if (met_at_ < 0 && !arrays_.best.rank().is_unmet) met_at_ = context_.budget.iteration;
    if (met_at_ >= 0 && context_.budget.iteration > 2 * met_at_ + kMore)
      return given_up(Status::MaxIterations);
    if (const auto status = limit_reached()) return given_up(*status);
    if (escaped) continue;
    if (deadline_ && context_.budget.iteration >= deadline_->iteration)
      return ended(deadline_->status);

    if (barrier_.update(arrays_.point, step_)) method.barrier_changed();
    make_step(method);
    if (restores_again()) {
      std::swap(arrays_.point, arrays_.next);
      step_.fail(Status::RestorationFailed);
    }
    if (step_.failure) return after_failed_step();
  }
}

SearchOutcome Search::ended(Status status, std::string message) const {
  name_divergence(context_, arrays_.point, status, message);
  const bool limited = context_.options.minmax_max_factorizations > 0;
  if (status == Status::MaxIterations && limited && !context_.budget.is_spent() &&
      message.empty()) {
    message = "the factorizations that minmax_max_factorizations allows are used up";
  }
  SearchOutcome outcome{.status = status,
                        .message = std::move(message),
                        .point = std::move(arrays_.ended),
                        .mu = barrier_.mu(),
                        .certificate = {},
                        .iterations = context_.budget.iteration};
  outcome.point = arrays_.point;
  return outcome;
}

/// Without a solution. Unless it diverges, a minimization ends at a point that met the tolerances
/// and was refused, if there is one.
SearchOutcome Search::given_up(Status status, std::string message) {
  if (arrays_.best.rank().is_unmet ||
      !is_within_acceptable_tolerances(arrays_.best.point().error, context_.options) ||
      purpose_ != Purpose::Solution || stopped_from_outside(status) ||
      status == Status::OuterUnbounded || status == Status::DivergingIterates) {
    return ended(status, std::move(message));
  }
  arrays_.point = arrays_.best.point();
  Verdict verdict = judge(Status::SolvedToAcceptableLevel);
  if (verdict.message.empty()) {
    verdict.message = std::string(name_of(verdict.status)) +
                      ": the scaled tolerances are met, but the gradient of the Lagrangian is not "
                      "small beside its terms";
  }
  return ended(std::move(verdict));
}

SearchOutcome Search::ended(Verdict&& verdict) const {
  SearchOutcome outcome = ended(verdict.status, std::move(verdict.message));
  outcome.certificate = verdict.finding.certificate;
  if (verdict.finding.point) {
    outcome.point = std::move(*verdict.finding.point);
    outcome.mu = verdict.finding.mu;
    measure_anew(context_.canonical, context_.options, outcome.point);
  }
  return outcome;
}

void Search::measure_point() {
  measure(context_.canonical, context_.options, arrays_.point);
  arrays_.best.see(rank_of(context_.canonical, context_.options, arrays_.point), arrays_.point,
                   barrier_.mu(), context_.budget.iteration + 1);
}

void Search::make_step(StepMethod& method) {
  const double mu = barrier_.mu();
  step_ = method.step(arrays_.point, mu, arrays_.next);
  if (step_.moved) std::swap(arrays_.point, arrays_.next);
  // Where the search ends the point stays as it was told.
  if (!step_.failure) context_.canonical.keep_distances(arrays_.point.iterate, mu);
  measure_point();
}

/// Whether no step but a restoration led on from an acceptable point, not for the first time: a
/// minimization would go round in circles.
bool Search::restores_again() {
  constexpr int kMostRestorations = 1;
  return step_.kind == StepKind::Restoration && context_.canonical.max_size() == 0 &&
         purpose_ == Purpose::Solution && test_.is_acceptable(arrays_.next) &&
         ++restored_when_acceptable_ > kMostRestorations;
}

SearchOutcome Search::after_failed_step() {
  // Whatever failed past the time limit was cut short.
  if (const auto exceeded = context_.limit.exceeded()) return ended(*exceeded);
  // As in Ipopt: where no better point can be reached, the acceptable tolerances are enough, at the
  // best point if not where the last restoration ended.
  const bool stuck =
      step_.failure == Status::TinyStep || step_.failure == Status::RestorationFailed;
  const bool enough = stuck && context_.canonical.max_size() == 0 && purpose_ == Purpose::Solution;
  if (enough && !test_.is_acceptable(arrays_.point) && test_.is_acceptable(arrays_.best.point())) {
    arrays_.point = arrays_.best.point();
  }
  if (stuck) drop_idle_multipliers(context_.options.acceptable_tol);
  if (enough && test_.is_acceptable(arrays_.point))
    return ended(judge(Status::SolvedToAcceptableLevel));
  return given_up(*step_.failure, step_.message);
}

std::optional<Status> Search::limit_reached() {
  CanonicalProblem& canonical = context_.canonical;
  if (max_norm(arrays_.point.iterate.v) > context_.options.diverging_iterates_tol) {
    return Status::DivergingIterates;
  }
  if (context_.budget.is_spent()) return Status::MaxIterations;
  const bool far = canonical.max_size() == 0 &&
                   has_run_away(canonical, arrays_.point, {0, canonical.variables()});
  runaway_iterations_ = far ? runaway_iterations_ + 1 : 0;
  constexpr Index kMostRunaway = 100;
  if (runaway_iterations_ > kMostRunaway) return Status::OuterUnbounded;
  if (context_.limit.expired()) return context_.limit.exceeded();
  return std::nullopt;
}

void Search::drop_idle_multipliers(double tolerance) {
  // Without a gradient of the objective every feasible point is optimal, with multipliers zero.
  const bool minimization = context_.canonical.max_size() == 0 || context_.canonical.is_constant();
  if (!minimization || arrays_.point.evaluation.c.size() == 0 ||
      max_norm(arrays_.point.evaluation.gradient) > 0.0 ||
      max_norm(arrays_.point.evaluation.c) > tolerance ||
      max_norm(arrays_.point.iterate.lambda) == 0.0) {
    return;
  }
  Iterate& iterate = arrays_.point.iterate;
  iterate.lambda.setZero();
  iterate.z_lower = iterate.z_lower.cwiseMin(context_.options.tol);
  iterate.z_upper = iterate.z_upper.cwiseMin(context_.options.tol);
  static_cast<void>(evaluate_second_derivatives(context_.canonical, arrays_.point));
  measure_anew(context_.canonical, context_.options, arrays_.point);
}

Search::Verdict Search::judge(Status claim) {
  barrier_.settle();
  Verdict verdict{.status = claim, .finding = {}};
  Finding& finding = verdict.finding;
  if (context_.options.minmax_certificate == CertificateEffort::None) {
    finding.certificate.kind = PointKind::FirstOrderPoint;
    return verdict;
  }
  const KktSystem::Counting counting(context_.kkt, FactorizationCause::Certificate);
  const Index before = context_.kkt.factorizations();
  context_.kkt.allow_factorizations(context_.budget.factorizations);
  finding = certify(context_.canonical, context_.kkt, arrays_.point, barrier_.mu(),
                    context_.options, factorizations_for_test(), arrays_.certificate);
  context_.kkt.allow_factorizations(context_.budget.factorizations_of_steps());
  context_.budget.tests += context_.kkt.factorizations() - before;
  const Point& certified = finding.point ? *finding.point : arrays_.point;
  const bool plateau = finding.certificate.answer == InnerAnswer::BestNotUnique &&
                       is_on_plateau(context_, certified, finding.mu);
  if (plateau) {
    finding.certificate = {};
    finding.certificate.kind = PointKind::FirstOrderPoint;
    finding.certificate.second_order = SecondOrder::Undecided;
  }
  if (finding.certificate.second_order != SecondOrder::Satisfied) finding.point.reset();
  if (finding.certificate.second_order == SecondOrder::Violated) {
    verdict.status = Status::NotLocalMinmax;
  } else if ((finding.certificate.second_order == SecondOrder::Undecided ||
              finding.certificate.second_order == SecondOrder::Flat) &&
             purpose_ == Purpose::Solution) {
    // The test of a point that was not certified has gone over to pivoting.
    context_.kkt.reset_quality();
    if (plateau || runs_to_infinity(context_, arrays_.point, barrier_.mu(), test_)) {
      verdict.status = Status::DivergingIterates;
      verdict.message = kToInfinity;
    } else if (finding.certificate.hessian_disagrees) {
      verdict.message = finding.remark;
      if (claim == Status::Solved) verdict.status = Status::SolvedDegenerate;
    } else if (claim == Status::Solved) {
      verdict.status = Status::SolvedDegenerate;
    }
  }
  return verdict;
}

Index Search::factorizations_for_test() const {
  return std::min(context_.kkt.factorizations_left(), reasonable_factorizations_for_test());
}

Index Search::reasonable_factorizations_for_test() const {
  // Beside copies of y: what they stand for is maximized over all of y, at many times the cost.
  const bool small = context_.kkt.layout().dimension() <= parameters::kSmallSystem;
  if (small || context_.canonical.has_copies()) return parameters::test::kForSmallSystems;
  const Index tests = context_.budget.tests;
  const Index others = context_.kkt.factorizations() - tests;
  return std::max(parameters::test::kFewestForTests,
                  others / parameters::test::kShareOfTests - tests);
}

bool Search::leave(const Verdict& verdict, StepMethod& method, std::optional<SearchOutcome>& kept) {
  if (context_.budget.is_spent() || context_.limit.expired()) return false;
  // A degenerate point is left only when the inner maximum is clear or clearly none, and kept for
  // the case that nothing better comes.
  const Certificate& found = verdict.finding.certificate;
  if (found.hessian_disagrees) return false;  // curvature that is wrong leads nowhere
  const bool minimization = context_.canonical.max_size() == 0;
  const std::optional<WrongCurvature>& wrong = verdict.finding.wrong;
  const bool degenerate = verdict.status == Status::SolvedDegenerate && !kept &&
                          (!minimization || wrong) && found.second_order != SecondOrder::Flat &&
                          (found.inner == found.inner_expected || seems_wrong(found));
  if (verdict.status != Status::NotLocalMinmax && !degenerate) return false;
  StepReport step = method.escape(arrays_.point, barrier_.mu(), wrong, arrays_.next);
  if (!step.moved) return false;
  if (degenerate) kept = ended(Verdict{verdict});
  step_ = std::move(step);
  std::swap(arrays_.point, arrays_.next);
  measure_point();
  test_.begin_anew();
  context_.kkt.reset_quality();
  barrier_.forget_progress();
  return true;
}

}  // namespace ipminmax
