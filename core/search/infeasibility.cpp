#include <algorithm>
#include <utility>

#include "core/model/norms.hpp"
#include "core/search/infeasibility.hpp"

namespace ipminmax {
namespace {

bool may_be_infeasible(const MethodContext& context, const SearchOutcome& outcome) {
  return search_failed(outcome.status) && context.canonical.max_constraints().size() > 0 &&
         context.canonical.robust_constraints().empty() &&
         max_norm(outcome.point.evaluation.c) > context.options.constr_viol_tol;
}

}  // namespace

void name_infeasibility(const MethodContext& context, const ProblemStructure& structure,
                        const Restorer& restorer, SearchOutcome& outcome) {
  if (!may_be_infeasible(context, outcome)) return;
  CanonicalProblem& canonical = context.canonical;
  const auto feasible = [&](const Eigen::VectorXd&, const Eigen::VectorXd& c) {
    return max_norm(c) <= context.options.constr_viol_tol;
  };
  IterationBudget& budget = context.budget;
  const Index granted = std::max<Index>(0, budget.limit - budget.iteration - budget.restoration);
  Index allowed = granted;
  Point least = outcome.point;
  const RestorationOutcome found = restore_feasibility(canonical, context.options, outcome.mu,
                                                       feasible, restorer, least, allowed);
  budget.restoration += granted - allowed;
  if (found != RestorationOutcome::UserStop && found != RestorationOutcome::LocallyInfeasible)
    return;

  evaluate_where_defined(canonical, least);
  measure(canonical, context.options, least);
  outcome.point = std::move(least);
  outcome.certificate = {};
  outcome.of_iteration.reset();
  outcome.message.clear();
  outcome.status = Status::UserStop;
  if (found == RestorationOutcome::UserStop) return;
  Result here;
  canonical.restore(outcome.point.iterate, here);
  const Index row = canonical.most_violated_constraint(here);
  outcome.message = "the violation of the constraints is at a local minimum, where " +
                    canonical.constraint_name(row) + " is violated most";
  outcome.status = structure.constraint_players[static_cast<std::size_t>(row)] == Player::Max
                       ? Status::InnerInfeasible
                       : Status::LocallyInfeasible;
}

}  // namespace ipminmax
