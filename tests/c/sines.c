/* The sines that the generated kernels use, for arrays: those of a pair, or with SHORT_ANGLES those that the compiled engine
 * takes for half a wheel angle. */
#include "omniroll.c"

#ifdef SHORT_ANGLES
#include "set_in_lanes.h"
#endif

void sines(int count, const omniroll_real *x, omniroll_real *sine, omniroll_real *cosine);

void sines(int count, const omniroll_real *x, omniroll_real *sine, omniroll_real *cosine)
{
    for (int k = 0; k < count; k++) {
#ifdef SHORT_ANGLES
        sine[k] = lanes_short_sin(lanes_of(x[k]))[0];
        cosine[k] = lanes_short_cos(lanes_of(x[k]))[0];
#else
        sine[k] = omniroll_sin(x[k]);
        cosine[k] = omniroll_cos(x[k]);
#endif
    }
}
