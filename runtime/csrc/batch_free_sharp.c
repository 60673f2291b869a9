#define OMNIROLL_BATCH
#include "engine_free_sharp.c"
