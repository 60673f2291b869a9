/* One long step through many joints, in as many calls as the bound on the joints of a call takes: a scene's vehicle with
 * free rollers and no further effects.
 *
 * Prints the number of calls; then, bit by bit, nu, pose, chi, the rollers in contact and the axial speeds. */
#include <stdio.h>

#include "omniroll_constants.h"

enum { WHEELS = OMNIROLL_WHEELS, ROLLERS = OMNIROLL_ROLLERS, SLOTS = WHEELS*(ROLLERS - 1) };

static const omniroll_model *const model = &omniroll_constant_model;
static omniroll_real chi[WHEELS], axial[SLOTS], momenta[2*WHEELS], work[OMNIROLL_WORK(WHEELS, ROLLERS)];
static int contact[WHEELS];

static void show(const omniroll_real *numbers, int count)
{
    for (int k = 0; k < count; k++)
        printf("%a\n", (double)numbers[k]);
}

int main(void)
{
    omniroll_state state = {0};
    int status, calls = 1;

    state.chi = chi;
    state.contact = contact;
    state.axial = axial;
    state.momenta = momenta;
    state.work = work;
    state.nu[0] = 1;
    state.nu[1] = (omniroll_real)0.25;
    state.nu[2] = 8;
    status = omniroll_start(model, &state);
    if (status != OMNIROLL_OK)
        return status;
    status = omniroll_step(model, OMNIROLL_IMPACT, 1, &state);
    for (; status == OMNIROLL_UNFINISHED; calls++)
        status = omniroll_step(model, OMNIROLL_IMPACT, state.left, &state);
    printf("%d\n", calls);
    show(state.nu, 3);
    show(state.pose, 3);
    show(chi, WHEELS);
    for (int i = 0; i < WHEELS; i++)
        printf("%d\n", contact[i]);
    show(axial, SLOTS);
    return status;
}
