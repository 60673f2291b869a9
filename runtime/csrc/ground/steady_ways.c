/* Where a contact goes that lets go under loads that follow the motion. The reasons are in
 * runtime/omniroll/effects/steady_ways.py; the names and the numbers are the same. */
#if SET_FIRST_DIRECTION == 0
#define TURNED 1e-6                 /* rad, by which a direction is turned                                   */
#define FARTHEST (TURN/4)           /* rad: no force of a direction beyond has held                          */
#define FOUND 1e-15                 /* rad                                                                   */

/* A direction that is turned by some angles, one a lane; rates of slips along it and across, in m/s^2; all loads. */
typedef struct {
    double turn[LANES], way[LANES][2];
    lanes_t along, across, load[MOST_WHEELS];
} turned_t;

/* Whether a contact slips in a direction that may turn. */
ALWAYS_INLINE int turns_in_plane(const omniroll_run_t *run, int contact)
{
#if SET_STRIPS
    return slides(run, contact) && !roller_mode(run, contact);
#else
    return slides(run, contact);
#endif
}

/* What a contact does in its directions, under the loads of these. */
static void find_turned(const omniroll_run_t *run, const work_t *work, int contact, turned_t *turned)
{
    const double *const own = run->grips[contact].towards;
    lanes_t toward[2*MOST_WHEELS], push[2*MOST_WHEELS], slope[4*MOST_WHEELS], nu_dot[3];
    for (int k = 0; k < 2*run->wheels; k++)
        toward[k] = lanes_of(run->grips[k/2].towards[k%2]);
    for (int lane = 0; lane < LANES; lane++) {
        const double cosine = cos(turned->turn[lane]), sine = sin(turned->turn[lane]);
        toward[2*contact][lane] = turned->way[lane][0] = cosine*own[0] - sine*own[1];
        toward[2*contact + 1][lane] = turned->way[lane][1] = cosine*own[1] + sine*own[0];
    }
    set_sliding_forces(run->wheels, &work->vehicle, toward, work->load, work->friction, push, slope);
    for (int k = 0; k < 2*run->wheels; k++)
        if (!slides(run, k/2))
            push[k] = lanes_of(0);
    push_contacts(run, work, 0, push, nu_dot);
    const lanes_t *const rate = work->slip_dot + 2*contact, *const way = toward + 2*contact;
    turned->along = way[0]*rate[0] + way[1]*rate[1];
    turned->across = way[0]*rate[1] - way[1]*rate[0];
    for (int i = 0; i < run->wheels; i++)
        turned->load[i] = work->loads[LOADS_NOW].compression[i];
    (void)slope;
}

/* Whether a slip begins with a rate that is not zero. */
static int begins_by_rate(const omniroll_run_t *run, const work_t *work, int contact, turned_t *turned)
{
    memset(turned->turn, 0, sizeof turned->turn);
    find_turned(run, work, contact, turned);
    return turned->along[0] > run->ground.settles;
}

/* Whether slips that leave the direction of a contact are turned back. */
static int is_steady(const omniroll_run_t *run, const work_t *work, int contact, turned_t *turned)
{
    turned->turn[0] = TURNED, turned->turn[1] = -TURNED;
    find_turned(run, work, contact, turned);
    return turned->across[0] < turned->across[1];
}

/* The turn to the next steady direction on a side, 1 or -1, of one that is not; 0 where there is none. */
static double next_steady(const omniroll_run_t *run, const work_t *work, int contact, int side, turned_t *turned)
{
    double near = 0, far = 0;
    for (double first = TURNED; far == 0 && near <= FARTHEST; first = 2*near) {
        for (int lane = 0; lane < LANES; lane++)
            turned->turn[lane] = side*first*(1 << lane);
        find_turned(run, work, contact, turned);
        for (int lane = 0; lane < LANES && far == 0; lane++)
            if (side*turned->across[lane] > 0)
                near = first*(1 << lane);
            else
                far = first*(1 << lane);
    }
    if (near > FARTHEST)
        return 0;
    while (far - near > FOUND && near + (far - near)/(LANES + 1) > near) {
        const double low = near, part = (far - near)/(LANES + 1);
        for (int lane = 0; lane < LANES; lane++)
            turned->turn[lane] = side*(low + part*(lane + 1));
        find_turned(run, work, contact, turned);
        for (int lane = 0; lane < LANES; lane++)
            if (side*turned->across[lane] > 0)
                near = low + part*(lane + 1);
            else {
                far = low + part*(lane + 1);
                break;
            }
    }
    return side*(near + far)/2;
}

/* A contact goes in one of its directions, and all have the loads of that. */
static void take_turned(omniroll_run_t *run, int contact, const turned_t *turned, int lane)
{
    memcpy(run->grips[contact].towards, turned->way[lane], sizeof turned->way[lane]);
    for (int i = 0; i < run->wheels; i++)
        if (run->grips[i].carries)
            run->grips[i].load = fmax(turned->load[i][lane], LEAST_LOAD*run->ground.weight);
}

/* Directions and loads find each other slowly where two solutions are near each other, and not at all where loads feel
 * more of a direction than it has turned. Contacts that let go, `rests`, turn to the next steady direction on the side
 * to which their slips are turned, if these do not fall along it: where friction is just used up they have no rate. */
static void turn_on(omniroll_run_t *run, const work_t *work, const int *rests)
{
    for (int i = 0; i < run->wheels; i++) {
        turned_t turned = {.turn = {0}};
        if (!rests[i] || !turns_in_plane(run, i))
            continue;
        find_turned(run, work, i, &turned);
        const double way = next_steady(run, work, i, turned.across[0] > 0 ? 1 : -1, &turned);
        turned.turn[0] = way;
        find_turned(run, work, i, &turned);
        if (way != 0 && turned.along[0] >= -run->ground.settles)
            take_turned(run, i, &turned, 0);
    }
}

/* Whether a contact that lets go, `rests`, does so in a direction that is not steady: it gets one that is, and all
 * loads those of it. Where there are two the run stops. */
static int turns_to_steady(omniroll_run_t *run, const work_t *work, const int *rests)
{
    for (int i = 0; i < run->wheels; i++) {
        turned_t turned;
        if (!rests[i] || !turns_in_plane(run, i))
            continue;
        if (begins_by_rate(run, work, i, &turned) || is_steady(run, work, i, &turned))
            continue;
        const double ways[2] = {next_steady(run, work, i, 1, &turned), next_steady(run, work, i, -1, &turned)};
        memcpy(turned.turn, ways, sizeof ways);
        find_turned(run, work, i, &turned);
        const int grows[2] = {ways[0] != 0 && turned.along[0] > run->ground.settles,
                              ways[1] != 0 && turned.along[1] > run->ground.settles};
        if (grows[0] + grows[1] == 1) {
            take_turned(run, i, &turned, grows[1]);
            return 1;
        }
        if (grows[0]) {
            carrying_t last;
            try_present_set(run, work, &last);
            fail(run, OMNIROLL_LOADS_SEVERAL, &last);
            return 0;
        }
    }
    return 0;
}
#else
/* Massless rollers do not slip along their axles: their slips do not turn. */
static int turns_to_steady(omniroll_run_t *run, const work_t *work, const int *rests)
{
    (void)run, (void)work, (void)rests;
    return 0;
}

static void turn_on(omniroll_run_t *run, const work_t *work, const int *rests)
{
    (void)run, (void)work, (void)rests;
}
#endif
