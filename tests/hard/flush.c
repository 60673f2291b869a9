/* Flush-to-zero and denormals-are-zero of this thread, on or off. */
#include <xmmintrin.h>

void flush(int on)
{
    const unsigned bits = 0x8040;
    _mm_setcsr(on ? _mm_getcsr() | bits : _mm_getcsr() & ~bits);
}
