#pragma once
#include "control/stages.hpp"  // its public path is this one
