#define OMNIROLL_ENGINE_SET "engine_set_locked.h"
#include "engine.c"
