#pragma once
#include "ipopt/minmax_statistics.hpp"  // its public path is this one
