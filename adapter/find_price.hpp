#pragma once
#include "control/find_price.hpp"  // its public path is this one
