#define OMNIROLL_SET massless
#define OMNIROLL_KERNEL "omniroll_massless.c"
#define OMNIROLL_MASSLESS
#include "engine.c"
