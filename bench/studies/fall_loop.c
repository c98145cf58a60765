/* The fall of rig/model/fall.py as a plain loop: what numpy's batch is measured against.
 *
 * Sums and products are those of the Python and in its order, so that a compiler which does not
 * fuse them gives the same bits.
 */
#include <math.h>
#include <stddef.h>

/* One chain, many falls. `masses`, `above` (the mass above each rod) and `heights` are of `rods`,
 * bottom up; all others of `count`. */
void falls(size_t count, size_t rods,
           const double *masses, const double *above, const double *heights,
           const double *alpha, const double *gamma, const double *drop,
           const double *gravity, const double *initial_speed,
           double *separation, double *speed, double *time)
{
    for (size_t i = 0; i < count; i++) {
        double now = initial_speed[i], arrival = now, before = -drop[i];
        double gained = 0.0, apart = 0.0, clock = 0.0;

        for (size_t k = 0; k < rods; k++) {
            const double distance = heights[k] - before;

            arrival = now;
            if (distance != 0.0) {
                arrival = sqrt(now * now + 2.0 * gravity[i] * distance);
                const double duration = 2.0 * distance / (now + arrival);
                clock += duration;
                apart += gained * duration;
            }
            if (k + 1 < rods) { /* the top rod has nothing to pull on */
                const double step =
                    arrival * (alpha[i] * masses[k] / (above[k] + gamma[i] * masses[k]));
                gained += step;
                now = arrival + step;
            }
            before = heights[k];
        }
        separation[i] = apart;
        speed[i] = arrival;
        time[i] = clock;
    }
}
