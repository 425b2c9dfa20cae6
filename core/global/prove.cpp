#include <algorithm>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/model/structure_check.hpp"
#include "core/parallel/joined_thread.hpp"
#include "core/parallel/ranks.hpp"
#include "core/proof.hpp"
#include "core/proof/enclosure.hpp"
#include "core/robust/row_over_y.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

void refuse(bool wrong, const std::string& what) {
  if (wrong) throw std::invalid_argument("a proof over y: " + what);
}

double sign_of(const ProofRequest& request) { return request.least ? -1.0 : 1.0; }

void check(Problem& problem, std::span<const double> v, const ProofRequest& request) {
  const ProblemStructure& s = problem.structure();
  refuse(!check_indices(s).empty(), "the model's structure is not valid");
  require_point("a proof over y: the point", s, v);
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

/// Of sign times the function, without a description.
WorstCaseProof find(Problem& problem, std::span<const double> v, const SolverOptions& options,
                    const ProofRequest& request, Budget& budget, ProofShare share) {
  Result work;
  const MaximizationContext context{options, budget, 0, problem.structure(), work, &request, share};
  MaximaOverY found;
  if (request.constraint < 0) {
    found = maximize_objective(problem, v, request.starts, {}, context);
  } else {
    RowOverY row(problem, request.constraint, sign_of(request), {v.begin(), v.end()},
                 RobustScopes(problem.structure()).of(request.constraint));
    found = maximize_over_y(row, request.starts, {}, context);
  }
  return std::move(*found.proof);
}

/// One rank's part in a proof: it searches in another thread and exchanges messages in this one.
class RankOfAProof {
 public:
  RankOfAProof(Ranks& ranks, Budget& budget)
      : ranks_(ranks), budget_(budget), others_(at(ranks.size())) {}

  template <class Search>
  WorstCaseProof run(Search search) {
    failure_ = run_beside([&] { own_ = search(); }, [&] { exchange(); });
    return ranks_.rank() == 0 ? gather() : hand_in();
  }

 private:
  using Kind = Ranks::Kind;

  void exchange() {
    ranks_.beat();
    if (ranks_.stop_requested()) budget_.stop(Status::UserStop);
    while (auto message = ranks_.receive()) {
      if (message->kind == Kind::Stop) budget_.stop(Status::UserStop);
      if (message->kind != Kind::Stop) others_[at(message->rank)] = std::move(message);
    }
    ranks_.pause();
  }
  void wait_for(int rank) {
    while (!others_[at(rank)] && !ranks_.is_lost(rank) && !ranks_.stop_requested()) exchange();
  }

  /// Of rank 0: puts the shares together, in the order of the ranks, and tells all.
  WorstCaseProof gather() {
    std::string error = failure_ ? what_of(failure_) : "";
    if (!error.empty()) ranks_.send_to_others(Kind::Stop);
    for (int rank = 1; rank < ranks_.size(); ++rank) {
      wait_for(rank);
      const auto& message = others_[at(rank)];
      if (message && message->kind == Kind::Result) {
        add_share(proof_from(message->bytes), own_);
      } else if (error.empty()) {
        error = message ? message->text()
                        : "rank " + std::to_string(rank) + " of the proof does not answer any more";
      }
      if (!message) ranks_.forget(rank);
    }
    const auto kind = error.empty() ? Kind::Final : Kind::Failure;
    const std::vector<char> bytes =
        error.empty() ? to_bytes(own_) : std::vector<char>(error.begin(), error.end());
    ranks_.send_to_others(kind, 0, bytes);
    if (failure_) std::rethrow_exception(failure_);
    if (!error.empty()) throw std::runtime_error(error);
    return std::move(own_);
  }

  WorstCaseProof hand_in() {
    if (failure_) {
      const std::string error = what_of(failure_);
      ranks_.send(0, Kind::Failure, 0, error);
    } else {
      ranks_.send(0, Kind::Result, 0, to_bytes(own_));
    }
    wait_for(0);
    if (failure_) std::rethrow_exception(failure_);
    if (!others_[0]) {
      ranks_.forget(0);
      throw std::runtime_error("rank 0 of the proof does not answer any more");
    }
    if (others_[0]->kind == Kind::Failure) throw std::runtime_error(others_[0]->text());
    return proof_from(others_[0]->bytes);
  }

  Ranks& ranks_;
  Budget& budget_;
  WorstCaseProof own_;
  std::exception_ptr failure_;
  std::vector<std::optional<Ranks::Message>> others_;  ///< the word of each
};

}  // namespace

WorstCaseProof prove_worst_case(Problem& problem, std::span<const double> v,
                                const SolverOptions& options, const ProofRequest& request,
                                const MultistartObserver& observer) {
  check(problem, v, request);
  Budget budget(options, observer);
  WorstCaseProof proof = find(problem, v, options, request, budget, {});
  proof.seconds = budget.stopwatch().wall();
  describe(request.constraint, sign_of(request), proof);
  return proof;
}

WorstCaseProof prove_worst_case_over_ranks(Problem& problem, std::span<const double> v,
                                           const SolverOptions& options,
                                           const ProofRequest& request,
                                           const MultistartObserver& observer) {
  check(problem, v, request);
  Ranks ranks;
  Budget budget(options, observer);
  ProofRequest each = request;
  each.most_boxes = std::max<Index>(request.most_boxes / kPartsOfAProof, 1);
  WorstCaseProof proof = RankOfAProof(ranks, budget).run([&] {
    return find(problem, v, options, each, budget, {ranks.rank(), ranks.size()});
  });
  proof.seconds = budget.stopwatch().wall();
  describe(request.constraint, sign_of(request), proof);
  return proof;
}

}  // namespace ipminmax
