/* The unique number of the flash chip. */
#ifndef FLASH_NUMBER_H
#define FLASH_NUMBER_H

#include <stdint.h>

/* Read it. No code or table may be in flash: from now on it cannot be read as memory. */
void flash_number(uint8_t number[8]);

#endif
