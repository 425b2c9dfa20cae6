#pragma once

#include <vector>

#include <IpTNLP.hpp>

#include <ipminmax/adapter/ipopt_version.hpp>
#include <ipminmax/core/problem.hpp>

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// An Ipopt model that says who owns what. One vector of variables, one of constraints, one
/// objective and one Hessian of the Lagrangian sigma f + lambda' g serve both players.
class MinMaxTNLP : public Ipopt::TNLP {
 public:
  /// players: n entries, all Min on entry. False stops with Invalid_Problem_Definition.
  virtual bool get_variable_players(Ipopt::Index n, Player* players) = 0;

  /// players: m entries; on entry what the Jacobian's structure implies (Max when the constraint
  /// has an entry in a Max variable). Override to give a constraint in Min variables to Max.
  /// False stops with Invalid_Problem_Definition.
  virtual bool get_constraint_players(Ipopt::Index m, Player* players);
};

/// Any unmodified Ipopt model, split from outside. Every call is passed on to the model.
class SplitTNLP : public MinMaxTNLP {
 public:
  /// max_variables: 0-based indices of the variables that the maximizer chooses.
  /// max_constraints: 0-based constraints given to Max besides the implied ones.
  SplitTNLP(Ipopt::SmartPtr<Ipopt::TNLP> model, std::vector<Ipopt::Index> max_variables,
            std::vector<Ipopt::Index> max_constraints = {});

  // (overrides of every TNLP method follow)
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
