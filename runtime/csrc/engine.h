/* A run of the compiled engine: what the caller gives, what it gets back. See run.c and batch.c. */
#ifndef OMNIROLL_ENGINE_H
#define OMNIROLL_ENGINE_H

#include "omniroll.h"

#include "engine_calls.h"

#endif
