#include <algorithm>
#include <stdexcept>
#include <typeinfo>
#include <utility>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/minmax_tnlp.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Indices of a SplitTNLP's constructor, and whose they are to be.
struct IndexList {
  const char* name;  ///< of the constructor's argument
  const char* what;  ///< "variable" or "constraint"
  const std::vector<Index>& indices;
  Player player;
};

[[noreturn]] void refuse(const auto&... parts) {
  THROW_EXCEPTION(Ipopt::TNLP::INVALID_TNLP, concat("SplitTNLP: ", parts...));
}

/// Gives players[i] to the list's player for every index i. first_place: room.
void give(const IndexList& list, Index size, std::vector<std::ptrdiff_t>& first_place,
          Player* players) {
  first_place.assign(at(size), -1);
  for (const auto k : indices(list.indices)) {
    const Index i = list.indices[k];
    if (i < 0 || i >= size) {
      refuse(list.name, "[", k, "] = ", i, " is out of range: the model has ", size, " ", list.what,
             "s (indices are 0-based)");
    }
    std::ptrdiff_t& place = first_place[at(i)];
    if (place >= 0) {
      refuse(list.name, " holds index ", i, " twice, at places ", place, " and ", k);
    }
    place = static_cast<std::ptrdiff_t>(k);
    players[i] = list.player;
  }
}

}  // namespace

bool MinMaxTNLP::get_constraint_players(Index, Player*) { return true; }

bool MinMaxTNLP::maximization_callback(Index, double) { return true; }

SplitTNLP::SplitTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model, std::vector<Index> max_variables,
                     std::vector<Index> max_constraints, std::vector<Index> min_constraints)
    : model_(model),
      max_variables_(std::move(max_variables)),
      max_constraints_(std::move(max_constraints)),
      min_constraints_(std::move(min_constraints)) {
  if (IsNull(model_)) throw std::invalid_argument("SplitTNLP: the model is null");
}

Ipopt::SmartPtr<Ipopt::TNLP> SplitTNLP::clone_model() const {
  if (typeid(*this) != typeid(SplitTNLP)) return nullptr;
  const auto model = clone_of(*model_);
  if (IsNull(model)) return nullptr;
  return new SplitTNLP(model, max_variables_, max_constraints_, min_constraints_);
}

bool SplitTNLP::get_variable_players(Index n, Player* players) {
  give({"max_variables", "variable", max_variables_, Player::Max}, n, first_place_, players);
  return true;
}

bool SplitTNLP::get_constraint_players(Index m, Player* players) {
  for (const Index j : min_constraints_) {
    if (std::ranges::find(max_constraints_, j) != max_constraints_.end()) {
      refuse("max_constraints and min_constraints both hold index ", j);
    }
  }
  give({"max_constraints", "constraint", max_constraints_, Player::Max}, m, first_place_, players);
  give({"min_constraints", "constraint", min_constraints_, Player::Min}, m, first_place_, players);
  return true;
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
