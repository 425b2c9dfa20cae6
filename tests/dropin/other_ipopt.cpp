// Stands for the Ipopt that a program is linked with where this library was built with another
// version: 3.14 has GetIpoptCurrentIterate, 3.11 has not.
#include "adapter/ipopt/ipopt_version.hpp"

namespace Ipopt {
double CpuTime();
double CpuTime() { return 0.0; }
}  // namespace Ipopt

extern "C" {
void* CreateIpoptProblem();
void* CreateIpoptProblem() { return nullptr; }

#if !IPMINMAX_IPOPT_AT_LEAST(3, 14)
int GetIpoptCurrentIterate();
int GetIpoptCurrentIterate() { return 0; }
#endif
}
