/* The public path of adapter/c/ipminmax.h. */
#include "c/ipminmax.h"
