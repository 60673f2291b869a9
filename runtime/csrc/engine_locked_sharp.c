#define OMNIROLL_SET locked
#define OMNIROLL_SHARP
#define OMNIROLL_KERNEL "omniroll_locked.c"
#include "engine.c"
