/* Messages -> bytes for the host: one frame at a time, stuffed while it is written. */
#ifndef SEND_H
#define SEND_H

#include <stdbool.h>
#include <stdint.h>

#define SEND_ROOM 200 /* of a frame, stuffed; below 254, so one COBS block never fills up */

void send_reset(void);

/* Whether the frame before is gone and a new one may be begun. */
bool send_idle(void);

void send_begin(uint8_t type, uint8_t ack);
void send_bytes(const uint8_t *bytes, uint8_t count);
void send8(uint8_t value);
void send16(uint16_t value);
void send32(uint32_t value);
void send_end(void);

/* Send what the line takes of what there is. */
void send_pass(void);

#endif
