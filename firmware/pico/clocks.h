/* Clocks from the crystal: 120 MHz for the processor and PIO, 48 MHz for USB, 1 MHz for the timer. */
#ifndef CLOCKS_H
#define CLOCKS_H

#include <stdint.h>

void clocks_start(void);

/* Take blocks of the chip out of reset. */
void blocks_start(uint32_t which);

#endif
