#pragma once
#include "ipopt/minmax_fwd.hpp"  // its public path is this one
