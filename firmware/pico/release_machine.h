/* The state machine that drives the releases and the sync output. */
#ifndef RELEASE_MACHINE_H
#define RELEASE_MACHINE_H

#include <stdint.h>

#define RELEASE_MACHINE 2u

/* Outputs low, then driven; the machine waits for its first order once PIO runs. */
void release_machine_start(void);

/* The outputs of `release`, and sync, go on in one clock; the releases go off after `ticks`. */
void release_machine_fire(uint8_t release, uint32_t ticks);

#endif
