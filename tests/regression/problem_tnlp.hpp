#pragma once

#include "adapter/ipopt/problem_tnlp.hpp"

/// Ipopt's own answer to a Problem whose variables are all the Min player's.
namespace ipminmax::testing {

using ipminmax::IpoptAnswer;
using ipminmax::ProblemTnlp;
using ipminmax::solve_with_ipopt;

}  // namespace ipminmax::testing
