#pragma once
#include "formulas/interval.hpp"  // its public path is this one
