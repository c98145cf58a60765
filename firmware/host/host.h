/* Hands around the host's board, for whoever drives it. Times are ticks since power-up. */
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>
#include <stdint.h>

/* Power up: all memory as new; the 32-bit time begins at `tick`. */
void host_power(uint32_t tick);

/* Reset: the kept memory stays. */
void host_reset(uint8_t cause);

/* Run until a moment; returns where it stopped. */
uint64_t host_run(uint64_t until);

/* Have a gate change; in order of time, at most 8192 ahead. False when there is no room. */
bool host_change(uint64_t when, uint8_t gate, bool blocked);

/* A byte begins to arrive not before `when`. False when there is no room. */
bool host_feed(uint64_t when, uint8_t byte);

/* Take the next byte the device has sent by now; -1 when there is none. */
int host_take(uint64_t *when);

/* The reference gives a pulse; at most 16 ahead. */
void host_reference(uint64_t when);

/* The release-sense input changes so long after each FIRE; 0: never. */
void host_sense(uint64_t after_fire);

void host_stop(bool open);
uint8_t host_outputs(void);

#endif
