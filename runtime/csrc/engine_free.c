#define OMNIROLL_ENGINE_SET "engine_set_free.h"
#include "engine.c"
