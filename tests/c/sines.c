/* The sines that the generated kernels use, for arrays. */
#include "omniroll_free.c"

void sines(int count, const real_t *x, real_t *sine, real_t *cosine)
{
    for (int k = 0; k < count; k++) {
        sine[k] = real_sin(x[k]);
        cosine[k] = real_cos(x[k]);
    }
}
