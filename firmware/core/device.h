/* What the device decides: the answer to every request, and when it acts by itself. */
#ifndef DEVICE_H
#define DEVICE_H

#include <stdint.h>

/* Begin; `cause` goes into the BOOT frame. A complete drop that a reset left in memory is held. */
void device_start(uint8_t cause);

/* One turn of the main loop: never waits, and takes well under 0.1 ms. */
void device_pass(void);

#endif
