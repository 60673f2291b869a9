#define OMNIROLL_SET free_sharp
#define OMNIROLL_KERNEL "omniroll_free_sharp.c"
#define OMNIROLL_FREE_ROLLERS
#include "engine.c"
