/* The two programmes that PIO runs, and where in its memory they are. */
#ifndef PROGRAMS_H
#define PROGRAMS_H

#include <stdint.h>

#define PROGRAM_WORDS 32

#define CAPTURE_START 0
#define CAPTURE_WRAP 5
#define RELEASE_START 18
#define RELEASE_WRAP 26

/* For how many ticks the emergency stop must read open without a break: 0.3 ms. */
#define STOP_OPEN_TICKS 6000u

extern const uint16_t programs[PROGRAM_WORDS];

#endif
