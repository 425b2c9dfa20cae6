#pragma once

#include <IpAlgTypes.hpp>
#include <IpReturnCodes.hpp>
#include <string_view>

#include "../../core/result.hpp"
#include "ipopt_version.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// What OptimizeTNLP returns. Ipopt 3.11 has no Maximum_WallTime_Exceeded: CPU time stands in.
[[nodiscard]] Ipopt::ApplicationReturnStatus application_status(Status status);

/// What finalize_solution is told.
[[nodiscard]] Ipopt::SolverReturn solver_return(Status status);

/// Whether a solve that ends so was begun: false if it was refused (invalid option or problem, too
/// few degrees of freedom). As in Ipopt, finalize_solution is then not called.
[[nodiscard]] bool has_iterate(Status status);

/// The enumerator's name, as "Solve_Succeeded".
[[nodiscard]] std::string_view name_of(Ipopt::ApplicationReturnStatus status);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
