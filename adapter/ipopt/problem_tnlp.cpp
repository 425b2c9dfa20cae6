#include <IpJournalist.hpp>
#include <IpSolveStatistics.hpp>
#include <algorithm>
#include <cstdarg>
#include <cstring>

#include "adapter/ipopt/problem_tnlp.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

void copy_structure(const std::vector<Triplet>& triplets, Index* rows, Index* cols) {
  for (const auto& [row, col] : triplets) {
    *rows++ = row;
    *cols++ = col;
  }
}

/// Counts MUMPS factorizations by Ipopt's message about each.
class FactorizationCounter : public Ipopt::Journal {
 public:
  FactorizationCounter() : Journal("factorizations", Ipopt::J_NONE) {
    SetPrintLevel(Ipopt::J_LINEAR_ALGEBRA, Ipopt::J_MOREDETAILED);
  }
  [[nodiscard]] Index count() const { return count_; }

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    constexpr const char* kMessage = "Calling MUMPS-2 for numerical factorization";
    if (std::strncmp(text, kMessage, std::strlen(kMessage)) == 0) ++count_;
  }
  void PrintfImpl(Ipopt::EJournalCategory category, Ipopt::EJournalLevel level, const char* format,
                  va_list) override {
    PrintImpl(category, level, format);
  }
  void FlushBufferImpl() override {}

 private:
  Index count_ = 0;
};

}  // namespace

bool ProblemTnlp::get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                               IndexStyleEnum& index_style) {
  const ProblemStructure& structure = problem_.structure();
  n = static_cast<Index>(structure.variable_lower.size());
  m = static_cast<Index>(structure.constraint_lower.size());
  nnz_jac_g = static_cast<Index>(structure.jacobian.size());
  nnz_h_lag = static_cast<Index>(structure.hessian.size());
  index_style = C_STYLE;
  return true;
}

bool ProblemTnlp::get_var_con_metadata(Index, StringMetaDataMapType& var_string_md,
                                       IntegerMetaDataMapType&, NumericMetaDataMapType&, Index,
                                       StringMetaDataMapType& con_string_md,
                                       IntegerMetaDataMapType&, NumericMetaDataMapType&) {
  const ProblemStructure& structure = problem_.structure();
  if (!structure.variable_names.empty()) var_string_md["idx_names"] = structure.variable_names;
  if (!structure.constraint_names.empty()) con_string_md["idx_names"] = structure.constraint_names;
  return !structure.variable_names.empty() || !structure.constraint_names.empty();
}

bool ProblemTnlp::get_bounds_info(Index, double* x_l, double* x_u, Index, double* g_l,
                                  double* g_u) {
  const ProblemStructure& structure = problem_.structure();
  std::ranges::copy(structure.variable_lower, x_l);
  std::ranges::copy(structure.variable_upper, x_u);
  std::ranges::copy(structure.constraint_lower, g_l);
  std::ranges::copy(structure.constraint_upper, g_u);
  return true;
}

bool ProblemTnlp::get_scaling_parameters(double& obj_scaling, bool& use_x_scaling, Index,
                                         double* x_scaling, bool& use_g_scaling, Index,
                                         double* g_scaling) {
  UserScaling scaling;
  if (!problem_.user_scaling(scaling)) return false;
  obj_scaling = scaling.objective;
  use_x_scaling = !scaling.variables.empty();
  use_g_scaling = !scaling.constraints.empty();
  std::ranges::copy(scaling.variables, x_scaling);
  std::ranges::copy(scaling.constraints, g_scaling);
  return true;
}

bool ProblemTnlp::get_starting_point(Index n, bool, double* x, bool init_z, double* z_L,
                                     double* z_U, Index m, bool init_lambda, double* lambda) {
  std::fill_n(x, n, 0.0);
  StartingPoint start;
  start.v = {x, at(n)};
  start.needs_multipliers = init_z && init_lambda;  // Ipopt asks for both or none
  if (start.needs_multipliers) {
    std::fill_n(z_L, n, 0.0);
    std::fill_n(z_U, n, 0.0);
    std::fill_n(lambda, m, 0.0);
    start.z_lower = {z_L, at(n)};
    start.z_upper = {z_U, at(n)};
    start.lambda = {lambda, at(m)};
  }
  return problem_.starting_point(start);
}

bool ProblemTnlp::eval_f(Index n, const double* x, bool new_x, double& obj_value) {
  ++answer_.counts.objective;
  return problem_.objective({x, at(n)}, new_x, obj_value);
}

bool ProblemTnlp::eval_grad_f(Index n, const double* x, bool new_x, double* grad_f) {
  ++answer_.counts.gradient;
  return problem_.gradient({x, at(n)}, new_x, {grad_f, at(n)});
}

bool ProblemTnlp::eval_g(Index n, const double* x, bool new_x, Index m, double* g) {
  ++answer_.counts.constraints;
  return problem_.constraints({x, at(n)}, new_x, {g, at(m)});
}

bool ProblemTnlp::eval_jac_g(Index n, const double* x, bool new_x, Index, Index nele_jac,
                             Index* iRow, Index* jCol, double* values) {
  if (values == nullptr) {
    copy_structure(problem_.structure().jacobian, iRow, jCol);
    return true;
  }
  ++answer_.counts.jacobian;
  return problem_.jacobian({x, at(n)}, new_x, {values, at(nele_jac)});
}

bool ProblemTnlp::eval_rows(Index n, const double* x, bool new_x, Index count, const Index* rows,
                            Index m, double* g, Index nele_jac, double* values) {
  const std::span asked(rows, at(count));
  return g != nullptr ? problem_.constraint_rows(asked, {x, at(n)}, new_x, {g, at(m)})
                      : problem_.jacobian_rows(asked, {x, at(n)}, new_x, {values, at(nele_jac)});
}

bool ProblemTnlp::eval_h(Index n, const double* x, bool new_x, double obj_factor, Index m,
                         const double* lambda, bool new_lambda, Index nele_hess, Index* iRow,
                         Index* jCol, double* values) {
  if (values == nullptr) {
    copy_structure(problem_.structure().hessian, iRow, jCol);
    return true;
  }
  ++answer_.counts.hessian;
  return problem_.hessian({x, at(n)}, new_x, obj_factor, {lambda, at(m)}, new_lambda,
                          {values, at(nele_hess)});
}

void ProblemTnlp::finalize_solution(Ipopt::SolverReturn, Index n, const double* x,
                                    const double* z_L, const double* z_U, Index m, const double* g,
                                    const double* lambda, double obj_value, const Ipopt::IpoptData*,
                                    Ipopt::IpoptCalculatedQuantities*) {
  answer_.v.assign(x, x + n);
  answer_.z_lower.assign(z_L, z_L + n);
  answer_.z_upper.assign(z_U, z_U + n);
  answer_.constraints.assign(g, g + m);
  answer_.lambda.assign(lambda, lambda + m);
  answer_.objective = obj_value;
}

bool GameTNLP::get_variable_players(Index, Player* players) {
  std::ranges::copy(problem_.structure().variable_players, players);
  return true;
}

bool GameTNLP::get_constraint_players(Index, Player* players) {
  std::ranges::copy(problem_.structure().constraint_players, players);
  return true;
}

IpoptAnswer solve_with_ipopt(Problem& problem,
                             const std::function<void(Ipopt::OptionsList&)>& set_options) {
  const LibraryLock lock;  // Ipopt's MUMPS may be ours
  const Ipopt::SmartPtr<ProblemTnlp> model = new ProblemTnlp(problem);
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  application->RethrowNonIpoptException(true);
  application->Options()->SetIntegerValue("print_level", 0);
  application->Options()->SetStringValue("sb", "yes");
  application->Options()->SetStringValue("linear_solver", "mumps");
  if (set_options) set_options(*application->Options());
  const Ipopt::SmartPtr<FactorizationCounter> factorizations = new FactorizationCounter;
  application->Jnlst()->AddJournal(GetRawPtr(factorizations));
  IpoptAnswer failure;
  failure.status = application->Initialize("");
  if (failure.status != Ipopt::Solve_Succeeded) return failure;

  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(model);
  IpoptAnswer answer = model->answer();
  answer.status = status;
  answer.counts.factorizations_full = factorizations->count();
  const Ipopt::SmartPtr<Ipopt::SolveStatistics> statistics = application->Statistics();
  if (IsValid(statistics)) {
    answer.iterations = statistics->IterationCount();
    answer.seconds = statistics->TotalWallclockTime();
  }
  return answer;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
