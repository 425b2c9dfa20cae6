#pragma once

#include <algorithm>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <IpIpoptApplication.hpp>
#include <IpJournalist.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>

#include <ipminmax/core/problem.hpp>
#include <ipminmax/core/result.hpp>

/// Ipopt's own answer to a Problem whose variables are all the Min player's.
namespace ipminmax::testing {

/// What Ipopt returned, in the units and with the signs of Result.
struct IpoptAnswer {
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  std::vector<double> v, lambda, z_lower, z_upper, constraints;
  double objective = 0.0;
  Index iterations = 0;
  double seconds = 0.0;
  Counts counts;  ///< the model's evaluations and factorizations_full

  [[nodiscard]] bool solved() const { return status == Ipopt::Solve_Succeeded; }
};

/// A Problem as Ipopt's model. Players are ignored.
class ProblemTnlp : public Ipopt::TNLP {
 public:
  explicit ProblemTnlp(Problem& problem) : problem_(problem) {}

  [[nodiscard]] const IpoptAnswer& answer() const { return answer_; }

  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& jacobian_entries,
                    Ipopt::Index& hessian_entries, IndexStyleEnum& index_style) override {
    const ProblemStructure& structure = problem_.structure();
    n = static_cast<Ipopt::Index>(structure.variable_lower.size());
    m = static_cast<Ipopt::Index>(structure.constraint_lower.size());
    jacobian_entries = static_cast<Ipopt::Index>(structure.jacobian.size());
    hessian_entries = static_cast<Ipopt::Index>(structure.hessian.size());
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Ipopt::Index, double* x_lower, double* x_upper, Ipopt::Index,
                       double* g_lower, double* g_upper) override {
    const ProblemStructure& structure = problem_.structure();
    std::ranges::copy(structure.variable_lower, x_lower);
    std::ranges::copy(structure.variable_upper, x_upper);
    std::ranges::copy(structure.constraint_lower, g_lower);
    std::ranges::copy(structure.constraint_upper, g_upper);
    return true;
  }

  bool get_starting_point(Ipopt::Index n, bool, double* x, bool init_z, double* z_lower,
                          double* z_upper, Ipopt::Index m, bool init_lambda,
                          double* lambda) override {
    std::fill_n(x, n, 0.0);
    StartingPoint start;
    start.v = {x, size(n)};
    start.needs_multipliers = init_z || init_lambda;
    if (init_z) {
      start.z_lower = {z_lower, size(n)};
      start.z_upper = {z_upper, size(n)};
    }
    if (init_lambda) start.lambda = {lambda, size(m)};
    return problem_.starting_point(start);
  }

  bool eval_f(Ipopt::Index n, const double* x, bool new_x, double& f) override {
    ++answer_.counts.objective;
    return problem_.objective({x, size(n)}, new_x, f);
  }

  bool eval_grad_f(Ipopt::Index n, const double* x, bool new_x, double* gradient) override {
    ++answer_.counts.gradient;
    return problem_.gradient({x, size(n)}, new_x, {gradient, size(n)});
  }

  bool eval_g(Ipopt::Index n, const double* x, bool new_x, Ipopt::Index m, double* g) override {
    ++answer_.counts.constraints;
    return problem_.constraints({x, size(n)}, new_x, {g, size(m)});
  }

  bool eval_jac_g(Ipopt::Index n, const double* x, bool new_x, Ipopt::Index, Ipopt::Index entries,
                  Ipopt::Index* rows, Ipopt::Index* cols, double* values) override {
    if (values == nullptr) {
      for (const auto& [row, col] : problem_.structure().jacobian) {
        *rows++ = row;
        *cols++ = col;
      }
      return true;
    }
    ++answer_.counts.jacobian;
    return problem_.jacobian({x, size(n)}, new_x, {values, size(entries)});
  }

  bool eval_h(Ipopt::Index n, const double* x, bool new_x, double sigma, Ipopt::Index m,
              const double* lambda, bool new_lambda, Ipopt::Index entries, Ipopt::Index* rows,
              Ipopt::Index* cols, double* values) override {
    if (values == nullptr) {
      for (const auto& [row, col] : problem_.structure().hessian) {
        *rows++ = row;
        *cols++ = col;
      }
      return true;
    }
    ++answer_.counts.hessian;
    return problem_.hessian({x, size(n)}, new_x, sigma, {lambda, size(m)}, new_lambda,
                            {values, size(entries)});
  }

  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index n, const double* x,
                         const double* z_lower, const double* z_upper, Ipopt::Index m,
                         const double* g, const double* lambda, double f, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    answer_.v.assign(x, x + n);
    answer_.z_lower.assign(z_lower, z_lower + n);
    answer_.z_upper.assign(z_upper, z_upper + n);
    answer_.constraints.assign(g, g + m);
    answer_.lambda.assign(lambda, lambda + m);
    answer_.objective = f;
  }

 private:
  static std::size_t size(Ipopt::Index n) { return static_cast<std::size_t>(n); }

  Problem& problem_;
  IpoptAnswer answer_;
};

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

/// Solves with Ipopt's defaults and MUMPS, silently; more settings by the function.
inline IpoptAnswer solve_with_ipopt(
    Problem& problem, const std::function<void(Ipopt::OptionsList&)>& set_options = {}) {
  const Ipopt::SmartPtr<ProblemTnlp> model = new ProblemTnlp(problem);
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  application->Options()->SetIntegerValue("print_level", 0);
  application->Options()->SetStringValue("sb", "yes");
  application->Options()->SetStringValue("linear_solver", "mumps");
  if (set_options) set_options(*application->Options());
  const Ipopt::SmartPtr<FactorizationCounter> factorizations = new FactorizationCounter;
  application->Jnlst()->AddJournal(Ipopt::GetRawPtr(factorizations));
  IpoptAnswer failure;
  failure.status = application->Initialize("");
  if (failure.status != Ipopt::Solve_Succeeded) return failure;

  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(model);
  IpoptAnswer answer = model->answer();
  answer.status = status;
  answer.counts.factorizations_full = factorizations->count();
  const Ipopt::SmartPtr<Ipopt::SolveStatistics> statistics = application->Statistics();
  if (Ipopt::IsValid(statistics)) {
    answer.iterations = statistics->IterationCount();
    answer.seconds = statistics->TotalWallclockTime();
  }
  return answer;
}

}  // namespace ipminmax::testing
