/* A generated kernel with lanes as its numbers, for the files of the compiled engine.
 *
 * Compiled once for each set of effects; engine_set_<set>.h includes it and defines
 *   OMNIROLL_SET              the set, for instance locked
 *   OMNIROLL_KERNEL           its file, "omniroll_locked.c"
 *   OMNIROLL_FREE_ROLLERS     where the set's free rollers have a state
 *   OMNIROLL_MASSLESS         where rollers have no inertia */
#ifndef OMNIROLL_KERNEL_IN_LANES_H
#define OMNIROLL_KERNEL_IN_LANES_H

#include "lanes.h"

#define OMNIROLL_REAL_T
typedef lanes_t real_t;
#define real_number(x) lanes_of((double)(x))
#define OMNIROLL_SHORT_ANGLES
#define real_sqrt lanes_sqrt
#define real_exp lanes_exp
#if SET_HAS_HEADING                         /* which is no short angle */
#define real_sin lanes_sin_of_any
#define real_cos lanes_cos_of_any
#endif
#define OMNIROLL_INLINE ALWAYS_INLINE
#define OMNIROLL_API ALWAYS_INLINE
#include OMNIROLL_KERNEL

#define OMNIROLL_PASTE(a, b, c) a##b##c
#define OMNIROLL_EXPAND(a, b, c) OMNIROLL_PASTE(a, b, c)
#define KERNEL(name) OMNIROLL_EXPAND(omniroll_, OMNIROLL_SET, _##name)

/* An exported function is compiled for several levels of the machine's vector instructions; the loader chooses. No level
 * fuses multiplications and additions, so that all give the same bits. Flags that name the machine (-march=native) have
 * chosen already; gcc 12 fails on clones below that level. */
#if defined __x86_64__ && defined __gnu_linux__ && defined __GNUC__ && !defined __clang__ && !defined __AVX__
#define EACH_LEVEL __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define EACH_LEVEL
#endif

#define MOST_WHEELS 64

#endif
