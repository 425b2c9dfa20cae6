#pragma once
#include "ipopt/ipopt_version.hpp"  // its public path is this one
