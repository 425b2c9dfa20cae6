#include <stdexcept>
#include <string>
#include <utility>

#include "core/global/over_y.hpp"
#include "core/model/norms.hpp"
#include "core/model/row_over_y.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof.hpp"
#include "core/proof/enclosure.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

void refuse(bool wrong, const std::string& what) {
  if (wrong) throw std::invalid_argument("a proof over y: " + what);
}

void check(Problem& problem, std::span<const double> v, const ProofRequest& request) {
  const ProblemStructure& s = problem.structure();
  refuse(!has_valid_indices(s), "the model's structure is not valid");
  refuse(v.size() != s.variable_players.size(),
         "the point has " + std::to_string(v.size()) + " values for " +
             std::to_string(s.variable_players.size()) + " variables");
  refuse(!all_finite(v), "the point is not finite");
  refuse(!(request.tolerance > 0.0) || request.most_boxes < 1 || request.starts < 1,
         "tolerance, starts and most_boxes must be positive");
  const Index m = static_cast<Index>(s.constraint_players.size());
  refuse(request.constraint < -1 || request.constraint >= m,
         "there is no constraint " + std::to_string(request.constraint));
  refuse(request.least && request.constraint < 0, "Max wants no least value of the objective");
  refuse(problem.over_boxes() == nullptr,
         "the model has no functions over boxes (ProvableProblem)");
  if (request.constraint < 0) return;
  refuse(s.constraint_players[at(request.constraint)] != Player::Min,
         constraint_name(s, request.constraint) + " is Max's, and no constraint on all y");
}

}  // namespace

WorstCaseProof prove_worst_case(Problem& problem, std::span<const double> v,
                                const SolverOptions& options, const ProofRequest& request,
                                const MultistartObserver& observer) {
  check(problem, v, request);
  Budget budget(options, observer);
  Result work;
  const MaximizationContext context{options, budget,      0,       problem.structure(),
                                    work,    work.over_y, &request};
  const double sign = request.least ? -1.0 : 1.0;
  MaximaOverY found;
  if (request.constraint < 0) {
    found = maximize_objective(problem, v, request.starts, {}, context);
  } else {
    RowOverY row(problem, request.constraint, sign, {v.begin(), v.end()});
    found = maximize_over_y(row, request.starts, {}, context);
  }
  WorstCaseProof proof = std::move(*found.proof);
  proof.seconds = budget.stopwatch().wall();
  describe(request.constraint, sign, proof);
  return proof;
}

}  // namespace ipminmax
