#pragma once
#include "formulas/autodiff_problem.hpp"  // its public path is this one
