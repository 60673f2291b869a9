#define OMNIROLL_ENGINE_SET "engine_set_free_sharp.h"
#include "engine.c"
