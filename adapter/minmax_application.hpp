#pragma once
#include "ipopt/minmax_application.hpp"  // its public path is this one
