/* The rates of the rollers in contact for each of nu. Their directions never change; their sizes do, with chi. */
#define OFFSET 1e-6                 /* of the joint's angle: over this a row's length changes               */

/* How much larger than where chi is 0 the rates of the rollers in contact are at these wheel angles, and how that
 * changes with chi. */
NEVER_INLINE void nearer_at(const int wheels, const vehicle_t *vehicle, const omniroll_bearing_t *contacts,
                            const double *joint, const double *chi, double *nearer, double *per_chi)
{
    double rows[MAX_WHEELS][6];         /* at chi and beside it, for each of nu                              */
    for (int first = 0; first < 6; first += LANES) {
        lanes_t nu[3], at[MAX_WHEELS], chi_dot[MAX_WHEELS], spin[MAX_WHEELS];
        for (int k = 0; k < 3; k++)
            nu[k] = lanes_of(0);
        for (int i = 0; i < wheels; i++)
            at[i] = lanes_of(chi[i]);
        for (int k = first; k < first + LANES && k < 6; k++) {
            nu[k%3][k - first] = 1;
            for (int i = 0; i < wheels && k >= 3; i++)
                at[i][k - first] -= (chi[i] < 0 ? -OFFSET : OFFSET)*joint[i];
        }
        set_wheel_rates(wheels, vehicle, nu, at, chi_dot, spin);
        for (int i = 0; i < wheels; i++)
            for (int k = first; k < first + LANES && k < 6; k++)
                rows[i][k] = spin[i][k - first];
    }
    for (int i = 0; i < wheels; i++) {
        const double size = length3(contacts[i].row);
        nearer[i] = length3(rows[i])/size;
        per_chi[i] = (nearer[i] - length3(rows[i] + 3)/size)/((chi[i] < 0 ? -OFFSET : OFFSET)*joint[i]);
    }
}
