/* A set's generated kernel with lanes as its numbers, for the files of the compiled engine.
 *
 * Compiled once for each set of effects, in whose folder omniroll.h and kernel_in_lanes.h are. */
#ifndef OMNIROLL_SET_IN_LANES_H
#define OMNIROLL_SET_IN_LANES_H

#include "lanes.h"

#include "omniroll.h"

#include "kernel_in_lanes.h"

/* Tells the compiler the number of wheels, so that it unrolls the loops of the kernel. */
#define WITH_WHEELS(model, number) \
    do { \
        if ((model)->wheels != (number)) \
            __builtin_unreachable(); \
    } while (0)

/* A library is compiled for one number of wheels, whose loops it unrolls, or for any number. */
#ifdef OMNIROLL_WHEELS
#define MAX_WHEELS OMNIROLL_WHEELS
#define FIXED_WHEELS(wheels) OMNIROLL_WHEELS
#define TAKES_WHEELS(wheels) ((wheels) == OMNIROLL_WHEELS)
#else
#define MAX_WHEELS 64
#define FIXED_WHEELS(wheels) (wheels)
#define TAKES_WHEELS(wheels) ((wheels) <= MAX_WHEELS)
#endif

#endif
