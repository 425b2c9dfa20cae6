#pragma once

#include "../../linalg/api.hpp"
#include "ipopt_version.hpp"

/// @file
/// Declarations for headers that only name the classes. A program that declares Ipopt's
/// IpoptApplication itself includes this instead: the names stand in an inline namespace, and a
/// second declaration outside of it would be another class.
namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

class MinMaxApplication;
class MinMaxStatistics;
class MinMaxTNLP;
class ObservableTNLP;
class SplitTNLP;

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
