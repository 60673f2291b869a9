/* What a program under callgrind tells it: to count from here on, what to count, and to write down what it has counted. */
#include <valgrind/callgrind.h>

typedef int engine_t(void *run, const void *model);

void start_counting(void)
{
    CALLGRIND_START_INSTRUMENTATION;
}

/* Count from here on, or no more. */
void toggle_counting(void)
{
    CALLGRIND_TOGGLE_COLLECT;
}

/* Only this is counted. */
int counted_call(void *engine, void *run, const void *model)
{
    CALLGRIND_TOGGLE_COLLECT;
    const int status = ((engine_t *)engine)(run, model);
    CALLGRIND_TOGGLE_COLLECT;
    return status;
}

void write_down(const char *name)
{
    CALLGRIND_DUMP_STATS_AT(name);
}
