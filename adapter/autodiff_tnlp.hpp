#pragma once
#include "ipopt/autodiff_tnlp.hpp"  // its public path is this one
