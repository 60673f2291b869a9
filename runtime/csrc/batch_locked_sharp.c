#define OMNIROLL_BATCH
#include "engine_locked_sharp.c"
