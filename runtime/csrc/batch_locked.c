#define OMNIROLL_BATCH
#include "engine_locked.c"
