#pragma once
#include "control/horizon_shift.hpp"  // its public path is this one
