#pragma once
#include "ipopt/cross_check.hpp"  // its public path is this one
