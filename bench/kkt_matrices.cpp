#include <memory>
#include <stdexcept>

#include <support/forwarding_problem.hpp>

#include "core/kkt/block.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/initial_point.hpp"
#include "core/solver.hpp"
#include "kkt_matrices.hpp"
#include "measure.hpp"

namespace bench {
namespace {

using ipminmax::Index;
using ipminmax::KktBlock;
using ipminmax::KktPart;
using ipminmax::KktPattern;
using ipminmax::testing::StartedProblem;

KktMatrix copy_of(KktBlock& block, const ipminmax::SolverOptions& options) {
  if (block.empty()) return {};
  if (!block.analyze(options).ok) throw std::runtime_error("out of memory in the analysis");
  (void)block.factorize({});  // completes the diagonal
  return {block.matrix(), {block.signs().begin(), block.signs().end()}};
}

}  // namespace

KktMatrices kkt_matrices_at(ipminmax::Problem& problem, const ipminmax::Result& result,
                            const ipminmax::SolverOptions& options) {
  StartedProblem started(problem, result);
  ipminmax::SolverOptions warm = options;
  warm.warm_start_init_point = true;
  for (double ipminmax::SolverOptions::*push :
       {&ipminmax::SolverOptions::warm_start_bound_push,
        &ipminmax::SolverOptions::warm_start_bound_frac,
        &ipminmax::SolverOptions::warm_start_slack_bound_push,
        &ipminmax::SolverOptions::warm_start_slack_bound_frac,
        &ipminmax::SolverOptions::warm_start_mult_bound_push}) {
    warm.*push = 1e-14;
  }
  ipminmax::Counts counts;
  ipminmax::Timing timing;
  ipminmax::CanonicalProblem canonical(started, warm, counts, timing);
  if (const std::string error = canonical.build(); !error.empty()) throw std::runtime_error(error);

  ipminmax::Iterate iterate = canonical.starting_point();
  ipminmax::Evaluation evaluation;
  evaluation.c.setZero(canonical.constraints());
  evaluation.gradient.setZero(canonical.variables());
  evaluation.jacobian.assign(canonical.jacobian().size(), 0.0);
  evaluation.hessian.assign(canonical.hessian().size(), 0.0);
  if (!canonical.constraints(iterate.v, evaluation.c)) {
    throw std::runtime_error(canonical.evaluation_error());
  }
  canonical.start_slacks(iterate, evaluation.c);
  ipminmax::start_bound_multipliers(canonical, warm, iterate);
  if (!canonical.first_derivatives(iterate.v, evaluation) ||
      !canonical.second_derivatives(iterate.v, iterate.lambda, evaluation)) {
    throw std::runtime_error(canonical.evaluation_error());
  }
  Eigen::VectorXd curvature = Eigen::VectorXd::Zero(canonical.variables());
  for (const Index i : canonical.lower_bounded()) {
    curvature[i] += iterate.z_lower[i] / (iterate.v[i] - canonical.lower()[i]);
  }
  for (const Index i : canonical.upper_bounded()) {
    curvature[i] += iterate.z_upper[i] / (canonical.upper()[i] - iterate.v[i]);
  }
  const ipminmax::KktLayout layout(canonical);
  const auto block = [&](KktPart which) {
    return KktBlock(std::make_shared<KktPattern>(which, canonical, layout), canonical);
  };
  KktBlock full = block(KktPart::Full);
  KktBlock inner = block(KktPart::Inner);
  full.assemble(evaluation, curvature);
  inner.assemble(evaluation, curvature);
  KktMatrices matrices{copy_of(full, warm), copy_of(inner, warm), {}};
  matrices.inner_row.assign(static_cast<std::size_t>(full.dimension()), -1);
  for (ipminmax::Index i = inner.variables().begin; i < inner.variables().end; ++i) {
    if (const auto row = full.row_of_variable(i); row >= 0) {
      matrices.inner_row[static_cast<std::size_t>(row)] = inner.row_of_variable(i);
    }
  }
  for (ipminmax::Index j = inner.constraints().begin; j < inner.constraints().end; ++j) {
    matrices.inner_row[static_cast<std::size_t>(full.row_of_constraint(j))] =
        inner.row_of_constraint(j);
  }
  return matrices;
}

KktMatrices kkt_matrices_after(ipminmax::Problem& problem, int iterations,
                               ipminmax::SolverOptions options) {
  options.max_iter = iterations;
  return kkt_matrices_at(problem, ipminmax::solve(problem, options), options);
}

double time_factorization(ipminmax::SymmetricSolver& solver,
                          const ipminmax::SymmetricMatrix& matrix, double seconds) {
  const Clock clock;
  int count = 0;
  do {
    (void)solver.factorize(matrix);
    ++count;
  } while (clock.seconds() < seconds);
  return clock.seconds() / count;
}

}  // namespace bench
