#pragma once

#include <IpoptConfig.h>

// Objects compiled against Ipopt 3.11 and 3.14 have different virtual tables (the order after
// eval_h changed), yet link silently. The adapter's names therefore carry Ipopt's version: mixing
// versions is an undefined symbol at link time.
#define IPMINMAX_CONCAT_(a, b, c, d) a##b##c##d
#define IPMINMAX_CONCAT(a, b, c, d) IPMINMAX_CONCAT_(a, b, c, d)
#define IPMINMAX_IPOPT_ABI IPMINMAX_CONCAT(ipopt_, IPOPT_VERSION_MAJOR, _, IPOPT_VERSION_MINOR)

#define IPMINMAX_IPOPT_AT_LEAST(major, minor) \
  (IPOPT_VERSION_MAJOR > (major) ||           \
   (IPOPT_VERSION_MAJOR == (major) && IPOPT_VERSION_MINOR >= (minor)))
