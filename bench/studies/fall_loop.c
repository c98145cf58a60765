/* The fall of rig/model/fall.py as a loop that a compiler can turn into vector instructions: blocks
 * of falls pass all rods together, and what they need stays in the first-level cache.
 *
 * Sums and products are those of the Python and in its order, so that a compiler which does not
 * fuse them gives the same bits.
 */
#include <math.h>
#include <stddef.h>

#define BLOCK 512
#define MIN(a, b) ((a) < (b) ? (a) : (b))

/* One chain, many falls. `gaps` to the next rod and `ratios`, the mass above each rod over its own,
 * are of `rods` less one, bottom up; all others of `count`. */
void falls(size_t count, size_t rods, const double *gaps, const double *ratios,
           const double *alpha, const double *gamma, const double *drop,
           const double *gravity, const double *initial_speed,
           double *separation, double *speed, double *time)
{
    for (size_t first = 0; first < count; first += BLOCK) {
        const size_t size = MIN(BLOCK, count - first);
        double now[BLOCK], gained[BLOCK], apart[BLOCK], clock[BLOCK];
        for (size_t i = 0; i < size; i++) {
            const double start = initial_speed[first + i], h = drop[first + i];
            now[i] = sqrt(start * start + 2.0 * gravity[first + i] * h);
            clock[i] = h == 0.0 ? 0.0 : 2.0 * h / (start + now[i]);
            gained[i] = apart[i] = 0.0;
        }
        for (size_t k = 0; k + 1 < rods; k++)
            for (size_t i = 0; i < size; i++) {
                const double step = now[i] * (alpha[first + i] / (gamma[first + i] + ratios[k]));
                const double after = now[i] + step;
                now[i] = sqrt(after * after + 2.0 * gravity[first + i] * gaps[k]);
                const double duration = 2.0 * gaps[k] / (after + now[i]);
                gained[i] += step;
                clock[i] += duration;
                apart[i] += gained[i] * duration;
            }
        for (size_t i = 0; i < size; i++) {
            separation[first + i] = apart[i];
            speed[first + i] = now[i];
            time[first + i] = clock[i];
        }
    }
}
