#pragma once
#include "ipopt/player_lists.hpp"  // its public path is this one
