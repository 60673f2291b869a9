#define OMNIROLL_SET free
#define OMNIROLL_SHARP
#define OMNIROLL_KERNEL "omniroll_free.c"
#define OMNIROLL_FREE_ROLLERS
#include "engine.c"
