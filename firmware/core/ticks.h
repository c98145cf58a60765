/* The 16-bit counter -> 32-bit time, without an overflow interrupt that could delay a stamp.
 *
 * The main loop looks at the counter, at least once in 3.7 ms (at 16 MHz). What the interrupt stamps
 * is right if it looks once in 1.7 ms. */
#ifndef TICKS_H
#define TICKS_H

#include <stdint.h>

#define TICKS_PER_US (BOARD_HZ / 1000000u)
#define TICKS_PER_MS (BOARD_HZ / 1000u)

/* Begin; the counter's bits stand in for the lower 16 of `time`. */
void ticks_start(uint32_t time);

/* Look at the counter. */
void ticks_pass(void);

/* Now, or up to 16 us later, without holding interrupts off. */
uint32_t ticks_roughly(void);

/* Now. */
uint32_t ticks_now(void);

/* The time of a count taken not longer than 4 ms ago. */
uint32_t ticks_of(uint16_t count);

/* The time of a count stamped together with the published half, not longer than 0.5 s ago. */
uint32_t ticks_stamped(uint16_t count, uint8_t half);

#endif
