#define OMNIROLL_BATCH
#include "engine_massless.c"
