#define OMNIROLL_BATCH
#include "engine_free.c"
