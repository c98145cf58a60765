/* The release outputs: off, but for one bounded pulse. */
#ifndef RELEASE_H
#define RELEASE_H

#include <stdbool.h>
#include <stdint.h>

#define RELEASE_MAX_US 500000u
#define RELEASE_REST 3 /* the release rests this many times as long as it was on */

/* Outputs off, nothing to rest from. */
void release_reset(void);

/* Switch on, all at once, for so many ticks; returns the tick. Mask 0 moves the sync output only. */
uint32_t release_fire(uint8_t mask, uint32_t ticks);

/* Switch off, at once; `by` is the PULSE_END, should a pulse be on. The sync output stays. */
void release_off(uint8_t by);

/* The recording is over: sync output off. */
void release_done(void);

/* Whether the pulse is on: then `release_pass` belongs into every turn. */
bool release_on(void);

/* How many ticks the latest pulse was on, and the PULSE_END of it. */
uint32_t release_lasted(uint8_t *by);

/* See that the pulse ends when it is time. */
void release_pass(uint32_t now);

/* Milliseconds until the release has rested, rounded up. */
uint16_t release_rest_ms(uint32_t now);

#endif
