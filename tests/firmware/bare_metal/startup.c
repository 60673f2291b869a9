/* Start of a program on a bare Cortex-M4F or M7: the vector table, and the floating-point unit. */
#include <stdint.h>

extern uint32_t __stack;
extern void _mainCRTStartup(void); /* of the C library: clears memory, runs main, ends by semihosting */

#define CPACR (*(volatile uint32_t *)0xE000ED88u)

void reset(void);
void reset(void)
{
    CPACR |= 0xFu << 20; /* before any instruction of the floating-point unit */
    __asm volatile("dsb\n isb");
    _mainCRTStartup();
}

static void stop(void)
{
    for (;;)
        ;
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &__stack, (void *)reset, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop,
    (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop,
};
