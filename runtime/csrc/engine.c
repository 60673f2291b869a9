/* The compiled engine of one set of effects: engine_<set>.c names the set; kernel_in_lanes.h says how it is compiled.
 * batch_<set>.c takes the same names and asks for the other half. */
#ifdef OMNIROLL_BATCH
#include "batch.c"
#else
#include "phase.c"
#endif
