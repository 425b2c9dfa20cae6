#pragma once
#include "ipopt/tnlp_problem.hpp"  // its public path is this one
