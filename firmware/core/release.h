/* The release outputs: off, but for one bounded pulse. */
#ifndef RELEASE_H
#define RELEASE_H

#include <stdbool.h>
#include <stdint.h>

#define RELEASE_MAX_US 500000u
#define RELEASE_REST 3 /* the release rests this many times as long as it was on */

/* Outputs off, nothing to rest from. */
void release_reset(void);

/* Switch on, all in one port write; returns the tick. Mask 0 moves the sync output only. */
uint32_t release_fire(uint8_t mask, uint32_t pulse_us);

/* Switch off, at once. The sync output stays. */
void release_off(void);

/* The recording is over: sync output off. */
void release_done(void);

/* Whether the pulse is on: then its end has to be looked for at every turn. */
bool release_on(void);

/* End the pulse when it is time. */
void release_pass(uint32_t now);

/* Milliseconds until the release has rested, rounded up. */
uint16_t release_rest_ms(uint32_t now);

#endif
