#define OMNIROLL_ENGINE_SET "engine_set_massless.h"
#include "engine.c"
