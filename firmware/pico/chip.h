/* What the chips that this firmware runs on have each in their own way. */
#ifndef CHIP_H
#define CHIP_H

#include <stdint.h>

/* Have the timer and the watchdog count microseconds of a crystal of so many MHz. */
void chip_ticks(uint32_t crystal_mhz);

/* The board's unique number. No code or table may be in flash: of an RP2040 it cannot be read as
 * memory from now on. */
void chip_number(uint8_t number[8]);

/* The chip's own program shows a drive to copy firmware to. It restarts the chip, and so all pins are
 * inputs. */
void chip_boot(void);

#endif
