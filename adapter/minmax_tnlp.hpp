#pragma once
#include "ipopt/minmax_tnlp.hpp"  // its public path is this one
