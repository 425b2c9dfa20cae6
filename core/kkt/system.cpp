#include "core/kkt/system.hpp"
#include "core/model/budget.hpp"

namespace ipminmax {
namespace {

/// Operations of a factorization of K below which the bookkeeping of the Schur complement costs
/// more than it saves (bench/schur).
constexpr double kLeastSchurFlops = 5e4;

}  // namespace

KktSystem::KktSystem(const CanonicalProblem& canonical, const SolverOptions& options,
                     Counts& counts, Timing& timing, SolveLimit* limit, const KeptKkt& kept)
    : Kept(kept.arrays),
      canonical_(canonical),
      options_(options),
      counts_(counts),
      timing_(timing),
      limit_(limit),
      kept_analysis_(kept.analysis),
      layout_(canonical),
      full_(pattern_of(KktPart::Full), canonical, &full_arrays_),
      inner_(pattern_of(KktPart::Inner), canonical, &inner_arrays_) {
  reduced_.setZero(layout_.dimension());
  eliminated_.setZero(canonical.variables());
  proximal_ = eliminated_;
  for (Step* step : {&residual_, &correction_}) set_zero(canonical, *step);
  last_residual_.v = residual_.v;
  last_residual_.lambda = residual_.lambda;
}

/// Without rows where time is over: nothing is analyzed then.
std::shared_ptr<const KktPattern> KktSystem::pattern_of(KktPart which) const {
  KktLayout layout = layout_;
  if (is_over()) {
    layout.lambda_y.end = 0;
  } else if (kept_analysis_ != nullptr) {
    return which == KktPart::Full ? kept_analysis_->full_pattern : kept_analysis_->inner_pattern;
  }
  return std::make_shared<KktPattern>(which, canonical_, layout);
}

bool KktSystem::analyze() {
  if (!analyze_or_adopt()) return false;
  const auto stop = [this] { return is_over(); };
  for (const KktBlock* block : {&full_, &inner_}) {
    if (!block->empty()) block->solver()->stop_when(stop);
  }
  if (schur_) schur_->second(inner_)->stop_when(stop);
  return true;
}

bool KktSystem::analyze_or_adopt() {
  const KktAnalysis* kept = kept_analysis_;
  if (kept != nullptr && kept->linear_solver == options_.linear_solver &&
      kept->schur_option == options_.minmax_schur_complement &&
      kept->options == solver_options(options_)) {
    full_.adopt(kept->full);
    inner_.adopt(kept->inner);
    if (!kept->by_schur_complement) return true;
    schur_ = std::make_unique<KktSchur>(full_, inner_);
    return schur_->prepare(inner_, kept->second_inner);
  }
  const ScopedTimer timer(timing_.analysis);
  counts_.analyses += inner_.empty() ? 1 : 2;
  const Analysis full = full_.analyze(options_);
  if (!full.ok || is_over()) return false;
  const Analysis inner = inner_.analyze(options_);
  if (!inner.ok) return false;
  decide_on_schur_complement(full);
  if (!schur_) return true;
  ++counts_.analyses;
  return schur_->prepare(inner_, nullptr);
}

/// Whether K by way of K_yy is cheaper than K as a whole.
void KktSystem::decide_on_schur_complement(const Analysis& full) {
  const SchurComplementUse use = options_.minmax_schur_complement;
  if (use == SchurComplementUse::No || inner_.empty()) return;
  const double outer = layout_.dimension() - inner_.dimension();
  const bool open = use == SchurComplementUse::Auto;
  if (open && (full.flops < kLeastSchurFlops || outer * outer * outer / 3.0 > full.flops)) return;
  schur_ = std::make_unique<KktSchur>(full_, inner_);
  if (open && schur_->predict_flops(inner_) > full.flops) schur_ = nullptr;
}

KktAnalysis KktSystem::analysis() const {
  return {.linear_solver = options_.linear_solver,
          .options = solver_options(options_),
          .full = full_.solver(),
          .inner = inner_.solver(),
          .second_inner = schur_ ? schur_->second(inner_) : nullptr,
          .schur_option = options_.minmax_schur_complement,
          .by_schur_complement = schur_ != nullptr,
          .full_pattern = full_.pattern(),
          .inner_pattern = inner_.pattern()};
}

void KktSystem::release_full() {
  if (full_factors_.by_schur_complement) full_factors_.serial = 0;
  if (schur_) schur_->release_full();
}

void KktSystem::assemble(const Iterate& iterate, const Evaluation& evaluation) {
  const ScopedTimer timer(timed(timing_.assembly));
  release_full();
  full_.assemble(iterate, evaluation);
  inner_.assemble(iterate, evaluation);
}

void KktSystem::assemble_inner(const Iterate& iterate, const Evaluation& evaluation) {
  const ScopedTimer timer(timed(timing_.assembly));
  inner_.assemble(iterate, evaluation);
}

void KktSystem::assemble(const Evaluation& evaluation, const Eigen::VectorXd& barrier_curvature,
                         const std::vector<bool>& decoupled) {
  const ScopedTimer timer(timed(timing_.assembly));
  release_full();
  full_.assemble(evaluation, barrier_curvature);
  inner_.assemble(evaluation, barrier_curvature);
  full_.decouple(decoupled);
  inner_.decouple(decoupled);
}

void KktSystem::count_factorizations(Index full, Index inner) {
  counts_.factorizations_full += full;
  counts_.factorizations_inner += inner;
  counts_.factorizations_for(cause_).full += full;
  counts_.factorizations_for(cause_).inner += inner;
}

bool KktSystem::may_factorize() {
  if (factorizations_left() > 0) return true;
  limit_->exceed(Status::MaxIterations);
  return false;
}

Factorization KktSystem::factorize(KktBlock& block, const Regularization& shift,
                                   Certainty certainty) {
  if (block.is_factorized(shift, certainty)) return block.factorize(shift, certainty);
  if (!may_factorize()) return {};
  const ScopedTimer timer(timed(timing_.factorization));
  const bool full = &block == &full_;
  count_factorizations(full, !full);
  return block.factorize(shift, certainty);
}

template <class Make>
auto KktSystem::counted(const Make& make) {
  Index factorized = 0;
  decltype(make(factorized)) result = Factorization{};
  if (!may_factorize()) return result;
  const ScopedTimer timer(timed(timing_.factorization));
  result = make(factorized);
  count_factorizations(0, factorized);
  return result;
}

const KktFactors& KktSystem::hold(KktFactors& at_hand, const Factorization& result, bool kept) {
  static_cast<Factorization&>(at_hand) = result;
  if (!kept || at_hand.serial == 0) at_hand.serial = ++factorizations_;
  return at_hand;
}

KktFactors KktSystem::factorize(const Regularization& shift, Certainty certainty) {
  const Certainty needed_here = needed(certainty);
  return factorize_full(shift, needed_here, needed_here == Certainty::Usual);
}

KktFactors KktSystem::factorize_for_solutions(const Regularization& shift, Certainty certainty) {
  return factorize_full(shift, certainty, true);
}

KktFactors KktSystem::factorize_full(const Regularization& shift, Certainty certainty,
                                     bool by_schur_complement) {
  full_factors_.shift = shift;
  full_factors_.certainty = certainty;
  if (full_.empty()) {
    full_factors_.by_schur_complement = false;
    return hold(full_factors_, {.status = FactorizationStatus::Ok, .inertia = layout_.expected()},
                false);
  }
  const bool made = full_.is_factorized(shift, certainty);
  const bool kept = made && !full_factors_.by_schur_complement;
  std::optional<Factorization> result;
  if (schur_ && by_schur_complement && !made) {
    full_.shift_by(shift);
    result = counted([&](Index& factorized) {
      return schur_->factorize(full_, certainty, factorized, counts_.factorizations_complement);
    });
  }
  full_factors_.by_schur_complement = result.has_value();
  if (!result) result = factorize(full_, shift, certainty);
  result->inertia = layout_.with_slacks(result->inertia);
  return hold(full_factors_, *result, kept);
}

KktFactors KktSystem::factorize_inner(const Regularization& shift, Certainty certainty) {
  inner_factors_.shift = shift;
  inner_factors_.certainty = certainty;
  if (inner_.empty()) {
    return hold(inner_factors_,
                {.status = FactorizationStatus::Ok, .inertia = layout_.expected_inner()}, false);
  }
  Factorization result;
  bool kept = false;
  if (schur_) {
    inner_.shift_by(shift);
    result = counted(
        [&](Index& factorized) { return schur_->factorize_inner(inner_, certainty, factorized); });
  } else {
    kept = inner_.is_factorized(shift, certainty);
    result = factorize(inner_, shift, certainty);
  }
  result.inertia = layout_.with_slacks_inner(result.inertia);
  return hold(inner_factors_, result, kept);
}

KktFactors KktSystem::make_certain() {
  if (full_.empty() || full_factors_.status == FactorizationStatus::Failed) return full_factors_;
  const Regularization shift = full_factors_.shift;
  if (full_factors_.by_schur_complement) {
    static_cast<void>(factorize_full(shift, full_factors_.certainty, false));
  }
  const ScopedTimer timer(timed(timing_.factorization));
  Factorization result = full_.make_certain(shift);
  result.inertia = layout_.with_slacks(result.inertia);
  return hold(full_factors_, result, false);
}

void KktSystem::forget_factors(bool full, bool inner) {
  release_full();
  if (schur_) schur_->forget_factors();
  if (full) full_factors_ = {};
  if (inner) inner_factors_ = {};
}

bool KktSystem::increase_quality() {
  const bool full = full_.increase_quality();
  const bool inner = inner_.increase_quality();
  forget_factors(full, inner);
  return full || inner;
}

void KktSystem::begin_pivoting() {
  const bool full = full_.begin_pivoting();
  const bool inner = inner_.begin_pivoting();
  if (full || inner) forget_factors(full, inner);
}

void KktSystem::reset_quality() {
  release_full();
  if (schur_) schur_->reset_quality();
  full_.reset_quality();
  inner_.reset_quality();
  full_factors_.serial = inner_factors_.serial = 0;
}

}  // namespace ipminmax
