/* A generated kernel with lanes as its numbers, for the files of the compiled engine.
 *
 * Compiled once for each set of effects; engine_<set>.c defines
 *   OMNIROLL_SET              the set, for instance locked
 *   OMNIROLL_KERNEL           its file, "omniroll_locked.c"
 *   OMNIROLL_SHARP            where the set's functions for sharp tips solve for nu'
 *   OMNIROLL_FREE_ROLLERS     where the set's free rollers have a state
 *   OMNIROLL_MASSLESS         where rollers have no inertia */
#ifndef OMNIROLL_KERNEL_IN_LANES_H
#define OMNIROLL_KERNEL_IN_LANES_H

#include "lanes.h"

#define OMNIROLL_REAL_T
typedef lanes_t real_t;
#define real_number(x) lanes_of((double)(x))
#define OMNIROLL_SHORT_ANGLES
#define OMNIROLL_INLINE ALWAYS_INLINE
#define OMNIROLL_API ALWAYS_INLINE
#include OMNIROLL_KERNEL

#define OMNIROLL_PASTE(a, b, c) a##b##c
#define OMNIROLL_EXPAND(a, b, c) OMNIROLL_PASTE(a, b, c)
#define KERNEL(name) OMNIROLL_EXPAND(omniroll_, OMNIROLL_SET, _##name)
/* SOLVED: a function of the set that solves for nu'; ENGINE: a function of the engine. */
#ifdef OMNIROLL_SHARP
#define SOLVED(name) OMNIROLL_EXPAND(omniroll_, OMNIROLL_SET, _##name##_sharp)
#define ENGINE(name) OMNIROLL_EXPAND(omniroll_, OMNIROLL_SET, _sharp_##name)
#else
#define SOLVED(name) KERNEL(name)
#define ENGINE(name) KERNEL(name)
#endif

/* An exported function is compiled for several levels of the machine's vector instructions; the loader chooses. No level
 * fuses multiplications and additions, so that all give the same bits. Flags that name the machine (-march=native) have
 * chosen already; gcc 12 fails on clones below that level. */
#if defined __x86_64__ && defined __gnu_linux__ && defined __GNUC__ && !defined __clang__ && !defined __AVX__
#define EACH_LEVEL __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define EACH_LEVEL
#endif

#ifdef OMNIROLL_FREE_ROLLERS
#define MOMENTA(momenta) , momenta
#else
#define MOMENTA(momenta)
#endif

#define MOST_WHEELS 64

#endif
