#pragma once
#include "formulas/autodiff.hpp"  // its public path is this one
