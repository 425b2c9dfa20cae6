#pragma once
#include "ipopt/problem_tnlp.hpp"  // its public path is this one
