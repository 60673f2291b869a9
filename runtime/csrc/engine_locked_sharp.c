#define OMNIROLL_ENGINE_SET "engine_set_locked_sharp.h"
#include "engine.c"
