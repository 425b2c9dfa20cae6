#include <IpJournalist.hpp>
#include <IpSolveStatistics.hpp>
#include <cstdarg>
#include <string_view>

#include "adapter/ipopt/problem_tnlp.hpp"
#include "linalg/library_lock.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Counts MUMPS factorizations by Ipopt's message about each.
class FactorizationCounter : public Ipopt::Journal {
 public:
  FactorizationCounter() : Journal("factorizations", Ipopt::J_NONE) {
    SetPrintLevel(Ipopt::J_LINEAR_ALGEBRA, Ipopt::J_MOREDETAILED);
  }
  [[nodiscard]] Index count() const { return count_; }

 protected:
  void PrintImpl(Ipopt::EJournalCategory, Ipopt::EJournalLevel, const char* text) override {
    if (std::string_view(text).starts_with("Calling MUMPS-2 for numerical factorization")) ++count_;
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
  IpoptAnswer answer;
  answer.status = application->Initialize("");
  if (answer.status != Ipopt::Solve_Succeeded) return answer;

  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(model);
  answer = model->answer();
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
