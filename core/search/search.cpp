#include <algorithm>
#include <utility>

#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "core/search/divergence.hpp"
#include "core/search/search.hpp"

namespace ipminmax {
namespace {

/// A test goes on: it may use what steps keep for it, and what it uses is counted as its own.
class Testing : Uncopied {
 public:
  Testing(SolveLimit& limit, const KktSystem& kkt)
      : limit_(limit), kkt_(kkt), before_(kkt.factorizations()) {
    limit_.testing = true;
  }
  ~Testing() {
    limit_.testing = false;
    limit_.tests += kkt_.factorizations() - before_;
  }

 private:
  SolveLimit& limit_;
  const KktSystem& kkt_;
  Index before_;
};

}  // namespace

Search::Search(const MethodContext& context, Purpose purpose, BarrierUpdate& barrier,
               Observation& observation, Start& start, SearchArrays& arrays)
    : MethodContext(context),
      purpose_(purpose),
      barrier_(barrier),
      observation_(observation),
      test_(canonical_, options_),
      arrays_(arrays),
      step_{.kind = start.how},
      last_iteration_(start.algorithm_one_until) {
  arrays_.point = std::move(start.point);
  arrays_.next = arrays_.point;
  arrays_.best.see(rank_of(canonical_, options_, arrays_.point), arrays_.point, barrier_.mu(),
                   limit_.iteration);
}

SearchOutcome Search::run(StepMethod& method, std::optional<SearchOutcome>& kept) {
  for (;; ++limit_.iteration) {
    if (!observation_.tell(arrays_.point, barrier_.mu(), step_)) return ended(Status::UserStop);
    zero_multipliers_of_feasibility(options_.tol);

    bool escaped = false;
    if (const auto passed = test_.passed(arrays_.point)) {
      Verdict verdict = judge(*passed);
      escaped = leave(verdict, method, kept);
      if (!escaped) return ended(std::move(verdict));
    }
    // For a balanced point as long again as to the first that met the tolerances, and some more.
    constexpr Index kMore = 100;
    if (met_at_ < 0 && !arrays_.best.rank.is_unmet) met_at_ = limit_.iteration;
    if (met_at_ >= 0 && limit_.iteration > 2 * met_at_ + kMore)
      return given_up(Status::MaxIterations);
    if (const auto status = limit_reached()) return given_up(*status);
    if (escaped) continue;
    if (last_iteration_ && limit_.iteration >= *last_iteration_)
      return ended(Status::NoLocalMinmaxFound);

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
  name_divergence(*this, arrays_.point, status, message);
  const bool limited = options_.minmax_max_factorizations > 0;
  if (status == Status::MaxIterations && limited && limit_.iterations_left() > 0 &&
      message.empty()) {
    message = "the factorizations that minmax_max_factorizations allows are used up";
  }
  SearchOutcome outcome{.status = status,
                        .message = std::move(message),
                        .point = std::move(arrays_.next),
                        .mu = barrier_.mu(),
                        .certificate = {},
                        .iterations = limit_.iteration};
  outcome.point = arrays_.point;
  return outcome;
}

/// Without a solution. Unless it diverges, a minimization ends at a point that met the tolerances
/// and was refused, if there is one.
SearchOutcome Search::given_up(Status status, std::string message) {
  if (arrays_.best.rank.is_unmet ||
      !is_within_acceptable_tolerances(arrays_.best.point.error, options_) ||
      purpose_ != Purpose::Solution || stopped_from_outside(status) ||
      status == Status::OuterUnbounded || status == Status::DivergingIterates) {
    return ended(status, std::move(message));
  }
  arrays_.point = arrays_.best.point;
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
  outcome.certificate = verdict.test.certificate;
  if (verdict.test.point) {
    outcome.point = std::move(*verdict.test.point);
    outcome.mu = verdict.test.mu;
    measure_anew(canonical_, options_, outcome.point);
  }
  return outcome;
}

void Search::measure_point() {
  measure(canonical_, options_, arrays_.point);
  arrays_.best.see(rank_of(canonical_, options_, arrays_.point), arrays_.point, barrier_.mu(),
                   limit_.iteration + 1);
}

void Search::make_step(StepMethod& method) {
  const double mu = barrier_.mu();
  step_ = method.step(arrays_.point, mu, arrays_.next);
  if (step_.moved) std::swap(arrays_.point, arrays_.next);
  // Where the search ends the point stays as it was told.
  if (!step_.failure) canonical_.keep_distances(arrays_.point.iterate, mu);
  measure_point();
}

/// Whether no step but a restoration led on from an acceptable point, not for the first time: a
/// minimization would go round in circles.
bool Search::restores_again() {
  constexpr int kMostRestorations = 1;
  return step_.kind == StepKind::Restoration && !has_max() && purpose_ == Purpose::Solution &&
         test_.is_acceptable(arrays_.next) && ++restored_when_acceptable_ > kMostRestorations;
}

SearchOutcome Search::after_failed_step() {
  // Whatever failed past the time limit was cut short.
  if (const auto exceeded = limit_.exceeded()) return ended(*exceeded);
  // As in Ipopt: where no better point can be reached, the acceptable tolerances are enough, at the
  // best point if not where the last restoration ended.
  const bool stuck =
      step_.failure == Status::TinyStep || step_.failure == Status::RestorationFailed;
  const bool enough = stuck && !has_max() && purpose_ == Purpose::Solution;
  if (enough && !test_.is_acceptable(arrays_.point) && test_.is_acceptable(arrays_.best.point)) {
    arrays_.point = arrays_.best.point;
  }
  if (stuck) zero_multipliers_of_feasibility(options_.acceptable_tol);
  if (enough && test_.is_acceptable(arrays_.point))
    return ended(judge(Status::SolvedToAcceptableLevel));
  return given_up(*step_.failure, step_.message);
}

std::optional<Status> Search::limit_reached() {
  if (max_norm(arrays_.point.iterate.v) > options_.diverging_iterates_tol) {
    return Status::DivergingIterates;
  }
  if (limit_.iterations_left() <= 0) return Status::MaxIterations;
  const bool far =
      !has_max() && has_run_away(canonical_, arrays_.point, {0, canonical_.variables()});
  runaway_iterations_ = far ? runaway_iterations_ + 1 : 0;
  constexpr Index kMostRunaway = 100;
  if (runaway_iterations_ > kMostRunaway) return Status::OuterUnbounded;
  if (limit_.expired()) return limit_.exceeded();
  return std::nullopt;
}

void Search::zero_multipliers_of_feasibility(double tolerance) {
  // Without a gradient of the objective every feasible point is optimal, with multipliers zero.
  const bool minimization = !has_max() || canonical_.is_constant();
  if (!minimization || arrays_.point.evaluation.c.size() == 0 ||
      max_norm(arrays_.point.evaluation.gradient) > 0.0 ||
      max_norm(arrays_.point.evaluation.c) > tolerance ||
      max_norm(arrays_.point.iterate.lambda) == 0.0) {
    return;
  }
  Iterate& iterate = arrays_.point.iterate;
  iterate.lambda.setZero();
  // In the model's units, too: nothing balances them now.
  const double most = options_.tol * std::min(1.0, canonical_.user_objective_scale());
  iterate.z_lower = iterate.z_lower.cwiseMin(most);
  iterate.z_upper = iterate.z_upper.cwiseMin(most);
  static_cast<void>(evaluate_second_derivatives(canonical_, arrays_.point));
  measure_anew(canonical_, options_, arrays_.point);
}

Search::Verdict Search::judge(Status first_order) {
  barrier_.settle();
  Verdict verdict{.status = first_order, .test = {}};
  Finding& test = verdict.test;
  Certificate& certificate = test.certificate;
  if (options_.minmax_certificate == CertificateEffort::None) {
    certificate.kind = PointKind::FirstOrderPoint;
    return verdict;
  }
  const KktSystem::Counting counting(kkt_, FactorizationCause::Certificate);
  {
    const Testing testing(limit_, kkt_);
    test = certify(canonical_, kkt_, arrays_.point, barrier_.mu(), options_,
                   factorizations_for_test(), arrays_.certificate);
  }
  const Point& certified = test.point ? *test.point : arrays_.point;
  const bool plateau =
      certificate.answer == InnerAnswer::BestNotUnique && is_on_plateau(*this, certified, test.mu);
  if (plateau) {
    certificate = {};
    certificate.kind = PointKind::FirstOrderPoint;
    certificate.second_order = SecondOrder::Undecided;
  }
  if (certificate.second_order != SecondOrder::Satisfied) test.point.reset();
  if (certificate.second_order == SecondOrder::Violated) {
    verdict.status = Status::NotLocalMinmax;
  } else if ((certificate.second_order == SecondOrder::Undecided ||
              certificate.second_order == SecondOrder::Flat) &&
             purpose_ == Purpose::Solution) {
    // The test of a point that was not certified has gone over to pivoting.
    kkt_.reset_quality();
    if (plateau || runs_to_infinity(*this, arrays_.point, barrier_.mu(), test_)) {
      verdict.status = Status::DivergingIterates;
      verdict.message = "the iterates diverge while the gradient goes to zero";
    } else {
      if (certificate.hessian_disagrees) verdict.message = test.remark;
      if (first_order == Status::Solved) verdict.status = Status::SolvedDegenerate;
    }
  }
  return verdict;
}

Index Search::factorizations_for_test() const {
  // Beside copies of y: what they stand for is maximized over all of y, at many times the cost.
  const bool small = kkt_.layout().dimension() <= parameters::kSmallSystem;
  if (small || canonical_.has_copies()) return parameters::test::kForSmallSystems;
  const Index tests = limit_.tests;
  const Index others = kkt_.factorizations() - tests;
  return std::max(parameters::test::kFewestForTests,
                  others / parameters::test::kShareOfTests - tests);
}

bool Search::leave(const Verdict& verdict, StepMethod& method, std::optional<SearchOutcome>& kept) {
  if (limit_.iterations_left() <= 0 || limit_.expired()) return false;
  // A degenerate point is left only when the inner maximum is clear or clearly none, and kept for
  // the case that nothing better comes.
  const Certificate& found = verdict.test.certificate;
  if (found.hessian_disagrees) return false;  // curvature that is wrong leads nowhere
  const std::optional<WrongCurvature>& wrong = verdict.test.wrong;
  const bool degenerate =
      verdict.status == Status::SolvedDegenerate && !kept && (has_max() || wrong) &&
      found.second_order != SecondOrder::Flat &&
      (found.inner == found.inner_expected || found.inner.positive > found.inner_expected.positive);
  if (verdict.status != Status::NotLocalMinmax && !degenerate) return false;
  StepReport step = method.escape(arrays_.point, barrier_.mu(), wrong, arrays_.next);
  if (!step.moved) return false;
  if (degenerate) {
    Point to = std::move(arrays_.next);  // the search goes on
    kept = ended(Verdict{verdict});
    arrays_.next = std::move(to);
  }
  step_ = std::move(step);
  std::swap(arrays_.point, arrays_.next);
  measure_point();
  test_.begin_anew();
  kkt_.reset_quality();
  barrier_.forget_progress();
  return true;
}

}  // namespace ipminmax
