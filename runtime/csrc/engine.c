/* The compiled engine of one set of effects: engine_<set>.c names the set; kernel_in_lanes.h says how it is compiled. */
#include "phase.c"

#include "batch.c"
