#define OMNIROLL_SET locked_sharp
#define OMNIROLL_KERNEL "omniroll_locked_sharp.c"
#include "engine.c"
