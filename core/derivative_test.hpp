#pragma once
#include "diagnostics/derivative_test.hpp"  // its public path is this one
