/* The compiled engine of one set of effects: engine_<set>.c names the header that says what the set is. batch_<set>.c takes
 * the same name and asks for the other half. */
#ifdef OMNIROLL_BATCH
#include "batch.c"
#else
#include "run.c"
#endif
