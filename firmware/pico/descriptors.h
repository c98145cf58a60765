/* What the board tells a USB host about itself. */
#ifndef DESCRIPTORS_H
#define DESCRIPTORS_H

#include <stdint.h>

#define PACKET 64
#define NOTICES 1 /* endpoint on which a modem would tell of its lines; nothing ever comes */
#define BYTES_INTERFACE 1
#define BYTES 2   /* endpoint of the line itself, in and out */

/* The descriptor of a type and index, its size at `size`; 0: there is none. `number` is the board's
 * own. What it returns holds until the next call. */
const uint8_t *descriptor(uint8_t type, uint8_t index, const uint8_t number[8], uint16_t *size);

#endif
